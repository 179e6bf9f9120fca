"""Every number that the diagnosis was tuned with, in one place: unit, meaning and why that value.

A `Settings` is made once by the command, passed down inside the problem, and written into diagnosis.json.

Unless said otherwise, values were chosen on the development seeds 20261123 to 20261125 of the blind benchmark
(benchmarks/blind) and on the real campaigns (benchmarks/real). "Normalised" means divided by the noise of a reading.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class ReadingSettings:
    """What a campaign's files may hold. Not tuned: what lies beyond is a slip of whoever wrote them down."""

    min_samples: int = 20
    """Fewest samples of a channel in a run that a diagnosis can use."""
    late_start: float = 0.2
    """Share of a run's length that time may start late without a word."""
    start_elsewhere: float = 1.0
    """Share of it from which the key `start` is asked for."""
    finest_noise: float = 1e-9
    """A stated noise as a share of its channel's level, below which no sensor gets."""
    coarsest_noise: float = 10.0
    """A stated noise as a multiple of its channel's span, beyond which all is hid."""
    hole: float = 20.0
    """Usual sample intervals without a reading that are told."""
    latest_event: float = 10.0
    """Times its length after which nothing of a run can have happened."""
    largest_factor: float = 1000.0
    """Tolerance of a base parameter as a factor, beyond which nothing is known of it."""
    largest_quantity: float = 1e100
    """Magnitude beyond which a number is no quantity of a machine [any unit]; its square still is a number."""
    deepest_struct: int = 4
    """MATLAB structs inside each other that are looked into."""
    told_jitter: float = 0.015
    """Standard deviation of time stamps, in sample intervals, from which a clock is told to jitter: that of +-3 %."""
    min_judged: int = 30
    """Readings of a channel below which nothing is said of faulty ones."""


READING = ReadingSettings()


@dataclass(frozen=True, kw_only=True)
class NoiseSettings:
    """What a reading is worth, and the nuisances of every measurement."""

    max_samples: int = 1500
    """Samples of one channel in one run; what is faster is averaged over neighbours, for a residual lasts longer."""
    window: int = 40
    """Samples of a window within which the noise is estimated from third differences."""
    max_quantisation_levels: int = 2**14
    """Steps of a converter: readings on a finer grid are not quantised."""
    clock_jitter: float = 0.03
    """Timing that nobody guarantees, in sample intervals: it enters the noise with the slope of the signal."""
    smoothing: float = 0.05
    """Time over which slopes and step errors are averaged when they widen the noise [s]."""
    step_error_share: float = 0.5
    """Macro step's error, in a channel's noise, by which most of its readings may be widened at most (12 % in all):
    what the step changes beyond that is no noise, and is told."""
    step_error_quantile: float = 0.75
    """Share of a channel's readings that are most of them."""
    least_share: float = 0.2
    """Share of an estimated noise that is kept whatever the model itself would be estimated to have."""
    swing_evidence: float = 3.0
    """Standard deviations by which samples have to resemble the second next more than the next to count as a swing."""
    bias_of_span: float = 1.5e-3
    """Usual bias of a sensor as a share of its channel's span: a nuisance of every fit."""
    bias_of_level: float = 5e-4
    """The same as a share of the channel's largest reading; the larger of both counts."""
    clock_offset: float = 0.1
    """Usual misalignment of a run's clock in sample intervals: a nuisance of every fit."""
    max_clock_offset: float = 1e-3
    """Most of that [s]."""
    told_bias: float = 3.0
    """Standard deviations of a sensor's bias from which it is told."""
    told_clock: float = 5.0
    """Standard deviations of a run's clock error from which it is told."""


@dataclass(frozen=True, kw_only=True)
class FaultSettings:
    """When a reading is a fault of the sensor and not of the machine.

    Chosen so that nothing is left out of the clean signals of the examples, of the four real data sets and of the blind
    benchmark, while faults as large as a tenth of a channel's span are found.
    """

    longest_glitch: int = 3
    """Samples of a glitch; a pressure spike that lasts longer has been sampled and is taken as real."""
    longest_dropout: float = 1.0
    """Length of a drop-out [s]; a cable that is loose for longer cannot be told from a machine that stands still."""
    longest_dropout_samples: int = 10
    """Samples of a drop-out that may last longer than that, of slow loggers."""
    shortest_stuck: float = 0.5
    """Length of a constant stretch of a stuck sensor [s]; shorter ones do no harm to a fit."""
    shortest_stuck_samples: int = 10
    """Samples of it at least; fewer equal readings happen by chance."""
    share_of_span: float = 0.05
    """A fault is at least this share of the channel's span [-]; what is smaller does not dominate a fit."""
    above_noise: float = 20.0
    """Noise standard deviations that a fault is away; the farthest of 1e6 readings with white noise is at 5."""
    above_steps: float = 10.0
    """Times the usual change from sample to sample nearby that a fault is away: a fast motion's edge is about once."""
    above_resolution: float = 10.0
    """Steps of the converter that a fault is away: a switch or a coarse channel jumps by one or a few of them."""
    neighbours_agree: float = 0.1
    """Share of the fault by which the readings before and after may differ: an edge changes the level."""
    neighbours_agree_in_motion: float = 0.25
    """The same, where the channel moves so fast that the readings before and after differ by that."""
    nearby: int = 10
    """Samples before and after that tell the usual change."""
    event: float = 5.0
    """Times the usual kink of a channel from which its course changes: then the machine itself has done something."""
    event_window: int = 8
    """Samples of the two straight lines whose difference is a kink."""
    event_vicinity: int = 60
    """Samples on each side over which the usual kink of a channel is taken."""
    event_at: int = 2
    """Samples by which a kink may be off: it is where the two lines fit least."""
    hole: float = 3.0
    """Usual intervals that readings may be apart; beyond, nothing is said of what the channel did meanwhile."""
    stuck_vicinity: int = 30
    """Samples before and after a constant stretch that tell whether the channel is noisy there."""
    restless: float = 0.3
    """Share of readings that turn round where there is noise; of white noise it is two thirds."""
    seldom_equal: float = 0.3
    """Share of readings that equal the next one, where noise is at least as large as the converter's step."""
    stuck_jump: tuple[float, float] = (0.5, 1.6)
    """Least and largest jump at the end of a stuck stretch, as a share of what the speeds before and after foretell."""
    stuck_jump_over_steps: float = 5.0
    """Times the usual change from sample to sample that this jump is at least."""
    stuck_moving: float = 5.0
    """Noise and steps of the converter that a channel travels just before and after, where it moves."""
    rests_within: float = 0.02
    """Share of its span that a channel moves where the machine does not rest."""
    most: float = 0.1
    """Share of a channel's readings that may be faulty, or jump so far; more is a signal and all are kept."""


@dataclass(frozen=True, kw_only=True)
class NumericsSettings:
    """Macro steps and finite differences."""

    difference_steps: tuple[float, ...] = (1e-4, 1e-3, 1e-2, 5e-2)
    """Steps of a finite difference in normalised parameters: the smallest at which the simulations are smooth."""
    smooth_within: float = 0.1
    """How far, in its own size, a change may be from half of that of twice the step to be smooth."""
    max_steps: float = 5e6
    """Macro steps of a run: more than a day of most machines; a longer run is in another unit of time."""
    extrapolate_from: float = 0.03
    """Normalised RMS change under halving of the macro step that is worth an extrapolation."""
    second_order_method: str = "nepce"
    """A coupling of second order that every FMU can take."""
    second_order_from: float = 0.15
    """Change under halving from which that is tried: a run of it costs twice as much."""
    second_order_gain: float = 0.3
    """Share of the default coupling's error that it may have to be taken."""
    second_order_doublings: int = 2
    """How often the package's step is doubled for it at most."""
    second_order_error: float = 0.1
    """Normalised RMS change that a doubling may make."""
    coarsenings: tuple[int, ...] = (8, 4, 2, 1)
    """Macro steps of an estimation, in those of exact runs."""
    coarse_error: float = 5.0
    """Largest normalised RMS difference of a run at the fit's step to an exact one, before correction."""
    unresolved: float = 0.2
    """Normalised RMS change by which the extrapolated run at a best fit may still depend on the step."""
    unresolved_share: float = 0.1
    """The same as a share of what is left; the larger of both counts."""
    max_halvings: int = 2
    """How often the macro step is halved for a best fit at most."""
    refitted: int = 4
    """Fits that are made anew after a halving."""
    told_step_error: float = 0.5
    """Normalised RMS change under halving from which the user is asked for a shorter step."""
    kept_runs: int = 150
    """Simulated runs that are kept in memory, so that no point is simulated twice in a row."""


@dataclass(frozen=True, kw_only=True)
class ParameterSettings:
    """Base parameters and effects as quantities to be estimated."""

    base_reach: float = 1.0
    """How far a base parameter may go, in its tolerances: with 2, the refit explained a payload 8 % too heavy."""
    base_std: float = 0.6
    """Prior standard deviation of a base parameter, in its tolerance."""
    effect_std: float = 3.0
    """Prior standard deviation of an effect's size, in its usual size."""


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """The Gauss-Newton fit of one hypothesis."""

    min_independent: float = 600.0
    """Readings that count at least in the dispersion, however long their residuals stay on one side."""
    wide_step: float = 0.2
    """Step of differences, in normalised parameters, that serve for larger moves: refits without a fold, intervals."""
    rough_from: float = 0.7
    """Change of a difference from one step to the next, as a share of it, from which runs are not smooth."""
    exact_below: float = 10.0
    """Normalised RMS below which the error of the fit's longer step matters and is corrected."""
    slack: float = 0.001
    """Step of a difference for each unit of normalised RMS that is left beyond 1: far away larger steps see better."""
    slow_share: float = 0.02
    """Share of the cost that a step has to gain for larger differences to be kept."""
    outlier_window: float = 0.5
    """Time over which a residual's RMS is taken to find stretches out of step [s]."""
    outlier_from: float = 2.0
    """Times the channel's usual RMS from which a stretch counts for no more than that in the next step."""
    trials: int = 4
    """Steps that are tried from a point."""
    least_gain: float = 0.3
    """Gain in cost below which a step is not worth a run."""
    small_gain: float = 2.0
    """Gain in cost below which the next step will not be worth one."""
    foretold_within: float = 0.1
    """How nearly a step has to have done what was foretold for its derivatives to serve again."""
    base_radius: float = 1.0
    """Trust radius of a base parameter at the start, in its tolerance."""


@dataclass(frozen=True, kw_only=True)
class SearchSettings:
    """The search over sets of effects on a bank of responses. Chosen on cases 6 and 20 to 22 of seed 20261126."""

    sizes: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
    """Sizes of an effect that are run, in usual ones; between them responses are scaled."""
    first: tuple[float, ...] = (0.1, 1.0)
    """Those that every effect is run at; others where the best sets ask for them."""
    unseen: float = 0.1
    """Normalised RMS of the change at all of these below which an effect is run at every size of the grid."""
    looks: int = 4
    """How often they may ask."""
    asking: int = 60
    """Sets that do."""
    ratio: float = 3.5
    """Times the largest of these from which the end of a range is so far that sizes between are run, too."""
    shapes: int = 2
    """Starts of a shape that are run."""
    derivative_step: float = 0.15
    """Step of a derivative, in normalised parameters, or as a share of an effect's size."""
    beyond: float = 3.0
    """How far the smallest size that was run may be scaled down, and the largest up."""
    near: float = 0.5
    """Share of the delivered gap below which the refit of the base parameters is where the first bank is made."""
    base_looks: int = 2
    """How often that refit may look for derivatives."""
    base_alone: tuple[float, ...] = (-1.0, -0.5, 0.5, 1.0)
    base_starts: int = 2
    """Where that refit stops far from the data: shares of its range at which each is tried alone, fits from there."""
    price: float = 12.0
    """What an effect costs in a comparison of sets, in -2 log probability."""
    least_left: float = 1e-3
    """Share of the residual's squares that the best set may be expected to leave, at least."""
    own_radius: float = 0.3
    """How far an effect that is in already may be expected to move, as a share of its size."""
    most_effects: int = 3
    """Effects of a set at most: more stand in for a form."""
    pairs: int = 200
    """Sets of two, and of three, that are kept."""
    leading_pairs: int = 60
    """Pairs that are tried with a third."""
    rows: int = 12_000
    """Readings at which responses are kept."""
    batch: int = 120
    """Runs that are simulated at a time."""
    fitted: int = 12
    """Sets that are fitted in a round."""
    steps: int = 6
    """Steps of such a fit."""
    corrected: int = 4
    """Best of these fits that are run exactly."""
    further: int = 4
    """Steps that they then go further, with derivatives from small steps."""
    polish_looks: int = 3
    """How often that is done anew."""
    fine_step: float = 1e-3
    """Step of these derivatives, in normalised parameters."""
    near_leader: float = 25.0
    most_leaders: int = 6
    """Cost behind the best up to which a set is fitted to the end, too, and sets for which that is done."""
    negligible: float = 0.01
    """Normalised size of an effect that is as good as absent."""
    wide_leaders: int = 3
    """Best sets whose derivatives are taken over wide steps, too, for refits without a fold of the data."""
    radius: float = 0.5
    least_reach: float = 0.6
    """Trust radius at its start, as a share of a parameter's value, and what a value counts for at least."""
    grow: float = 1.5
    shrink: float = 0.4
    """What the radius is multiplied by after a step that was good, and one that was not."""
    failures: int = 3
    least_gain: float = 0.5
    """Steps in a row that were not good, and expected gain, from which a fit stays where it is."""
    better: float = 3.0
    """Gain of a round below which it was the last."""


@dataclass(frozen=True, kw_only=True)
class ValidationSettings:
    """Stretches of time that are left out and predicted from the rest."""

    folds: int = 20
    """Stretches of each run, and how many of them are left out in turn."""
    linear_within: float = 0.5
    """How far a refit without a fold may move, in normalised parameters: beyond, the model is not linear."""


@dataclass(frozen=True, kw_only=True)
class EvidenceSettings:
    """Prior probabilities of hypotheses; what calibrates them is in `selection/calibration.json`."""

    prior_none: float = 0.3
    prior_of_size: tuple[float, ...] = (0.5, 0.16, 0.04)
    """Prior probability of no effect, and of one, two and three together (shared by all sets of that size)."""
    adequate: float = 0.02
    """Structured energy beyond chance, per reading, with which nothing is left to explain."""
    chance: float = 1.5
    """Standard deviations of the energy that noise shares by chance which are no evidence."""
    deviance_readings: float = 150.0
    """Readings that count in the penalised deviance by which the search ranks fits until they are judged."""


@dataclass(frozen=True, kw_only=True)
class PosteriorSettings:
    """Which probabilities a verdict needs, and what lowers them."""

    plain_energy: float = 0.3
    """Energy per reading that is plainly left: of more, only its share in the gap tells how sure an effect is."""
    named: float = 0.5
    """Inclusion probability from which an effect is named."""
    sure: float = 0.8
    """Inclusion probability from which an effect explains a part of the gap."""
    at_bound: float = 0.2
    """Odds of an effect whose parameter stands at its bound are multiplied by it: sizes that make no sense are no
    explanation (inches declared as mm were "94 % sure" so)."""
    unfinished: float = 0.3
    """Odds of all effects are multiplied by it when the search was cut off."""
    least: float = 1e-6
    """Of a raw probability and of its complement, so that its odds are finite."""
    surest: float = 0.99
    """Of a calibrated probability: among the surest 2 to 3 in 100 were wrong."""


@dataclass(frozen=True, kw_only=True)
class BudgetSettings:
    """How the gap is divided."""

    alternatives: int = 8
    """Hypotheses over which shares are averaged."""
    least_probability: float = 0.03
    """Probability beside the best one's from which a hypothesis is one of them."""
    minor: float = 0.05
    """Share below which a part is minor and in no headline."""
    adequate_excess: float = 0.1
    """Squared normalised residual above noise and stated scatter with which a gap counts as explained: 5 % in RMS,
    about how well a noise is known."""


@dataclass(frozen=True, kw_only=True)
class BootstrapSettings:
    """How intervals of shares and of the reduction are drawn."""

    bin: float = 0.5
    """Stretch of time that is drawn together at least [s]."""
    draws: int = 400
    """Draws."""
    seed: int = 0
    """Of the random numbers."""
    fewest: int = 10
    """Stretches up to which their memory is not estimated: with fewer than 8 that even fails."""


@dataclass(frozen=True, kw_only=True)
class UncertaintySettings:
    """Intervals of parameters."""

    width: float = 1.96
    """Half width of a 95 % interval in standard deviations."""
    form_of_effect: float = 0.05
    """What another mathematical form than the library's does to an effect's size, as a share of it."""
    form_of_base: float = 0.3
    """What it does to a base parameter, in its tolerance."""
    form_energy: float = 0.01
    """Energy that lasts through all readings, so that these count as one piece of it. With these three 94 % of the
    effects' and 93 % of the base parameters' intervals held the truth on development cases, with noise alone 34 and
    60 %."""


@dataclass(frozen=True, kw_only=True)
class SanitySettings:
    """What no campaign can mean."""

    impossible_spans: float = 20.0
    """Spans of model and readings that a reading may lie beyond both."""
    missing_marks: tuple[float, ...] = (999.0, 9999.0, 99999.0, 999999.0)
    """What is written, or its negative, where there was no reading."""
    swapped: float = 0.3
    """Share of the gap that two columns leave, each taken for the other, when they are swapped."""
    quiet: float = 20.0
    """Times the noise within which a channel rests: its level is looked at, not its span."""
    rest: float = 1e-3
    """Share of its level within which the model's channel rests: only its level says anything of the unit."""
    wrong_ratio: float = 20.0
    """Times that a channel may move more or less than the model before another unit is the likelier story."""
    doubtful_ratio: float = 3.0
    """Times from which another unit is asked about where it explains the channel better: few effects do as much."""
    possible_ratio: float = 2.0
    """Times from which it is remarked on where it explains the channel much better: inches and centimetres are 2.5."""
    ratio_fits: float = 0.3
    """How near, in its logarithm, the ratio has to be to that of the units."""
    better_share: float = 0.35
    """Share of the gap that the other unit may leave to be better."""
    much_better_share: float = 0.2
    """The same to be much better."""
    shape_missed: float = 0.5
    """Share of the readings' movement, in the other unit, that the model may miss for that unit to explain them."""
    zero_beyond: float = 5.0
    """Times the span of a channel that lie between the zeros of two units where no effect can have shifted it so."""
    movement_lost: float = 0.5
    """Share of a channel's movement that the model has to miss for an input or the time to be suspected."""
    movement_found: float = 0.35
    """Share that it may miss with that input or time in another unit."""
    least_movement: float = 0.05
    most_movement: float = 20.0
    """Shares of a movement between which they count: no perfect or lost channel may speak for all."""
    as_good: float = 1.0
    """Sum of the logarithms of the channels' shares within which two stories are as good as each other."""
    steps_between_readings: float = 100.0
    """Macro steps that readings of a driven run are apart, or in one step, from which another unit of time is
    suspected: a thousandth of that is then the usual. Campaigns here have 1 to 25."""
    steps_of_first_part: float = 2e5
    """Macro steps of the run's first part over which the model tells: some seconds."""
    no_worse: float = 0.1
    """Sum of logarithms as above by which the other unit may do worse and be as likely."""
    identity: float = 1e-4
    """Share of a signal's spread that an identity between signals of the model may miss."""
    rate_scale: float = 0.03
    """How far the scale between a signal and the rate of another may be from 1."""
    rate_left: float = 0.5
    """Share of the signal that such a scale may leave to be plain."""
    least_part: float = 0.01
    """Share of a sum's movement from which a signal is a part of it."""
    contradiction: float = 3.0
    """Normalised RMS from which sensors of an identity contradict each other."""


@dataclass(frozen=True, kw_only=True)
class AnalysisSettings:
    """Where the gap lies and what it follows."""

    hypotheses_told: int = 20
    """Hypotheses that are listed, the most probable first."""
    parameters_told: int = 8
    """Of these, those whose parameters are told."""
    bands: tuple[float, ...] = (0.0, 0.5, 5.0, 25.0, float("inf"))
    """Edges of the frequency bands [Hz]."""
    change_point_bins: int = 200
    """Stretches of a run among which change points are looked for."""
    change_points: int = 4
    """Most change points of a channel in a run."""
    nested_regions: int = 3
    """Most regions that are nested to describe where a gap is densest."""
    least_bins: int = 20
    """Stretches from which change points are looked for."""
    change_point_rms: float = 1.3
    """Normalised RMS of a channel in a run from which they are."""
    least_region: float = 0.02
    """Share of all readings that a region holds, and that lies outside it, at least."""
    least_nested: float = 0.03
    """Share of a channel's readings that nested regions hold at least."""
    region_share: float = 0.6
    region_density: float = 1.15
    """Share of a gap, and density of it beside that of the whole, from which a region describes where it is."""
    replay_kernel: float = 0.05
    """Standard deviation of the kernel that smooths a measured signal before it drives a component [s]."""
    replay_copies: int = 3
    """Disturbed copies from which the noise that a component passes on is estimated."""
    frequency_share: float = 0.7
    """Share of a residual's energy that the range of frequencies holds which is told."""
    structure_told: float = 0.1
    """Predictable share of a channel's residual from which is told what it varies with."""
    nearest: int = 3
    """Effects that are told as nearest to what is left."""
    structure_stretches: int = 300
    """Stretches of time of a run that are left out in turn when what is left is predicted from the signals."""
    structure_samples: int = 4000
    """Readings of a channel that are looked at."""
    structure_least: int = 100
    """Readings of a channel below which nothing is said."""
    structure_bins: int = 40
    """Bins of a signal in which the residual's mean is taken."""


@dataclass(frozen=True, kw_only=True)
class TerminalSettings:
    """What the terminal prints."""

    width: int = 100
    """Characters of a line at most."""
    lines: int = 25
    """Lines at most."""
    headline: int = 7
    """Lines of the headline at most."""
    bar: int = 60
    """Characters of the budget's bar."""
    parts: int = 4
    channels: int = 4
    moments: int = 3
    """Effects, channels and measured moments that are shown, the largest first."""
    probable: float = 0.5
    """Inclusion probability from which an effect's parameters are shown, and the effect however small its share."""


@dataclass(frozen=True, kw_only=True)
class ReportSettings:
    """What the report shows; no part of a diagnosis."""

    trace: float = 0.02
    """Inclusion probability and share up to which an effect is only counted: less cannot be told from nothing."""
    channels: int = 12
    regions: int = 14
    hypotheses: int = 8
    """Rows of a table, those that matter most first; the rest is in diagnosis.json."""
    probable: float = 0.5
    """Inclusion probability from which an effect is named in sentences."""
    clear_dependence: float = 0.05
    """Share of a residual's energy that a signal predicts from which it is said to vary with it."""
    apart: float = 3.0
    """Distance of two hypotheses [multiples of the noise, RMS] from which they are called clearly apart."""
    component_misses: float = 1.3
    """Deviation of a component driven with what was measured [multiples of the noise] from which it is set in bold."""
    little: float = 1.1
    """Deviation [multiples of the noise] below which what is left is called hardly more than noise."""
    mean_intervals: int = 48
    """Intervals of a signal in which the mean of what is left is drawn."""
    trace_points: int = 4000
    """Points of a channel in a run at most: twice what a screen has."""
    fewest_points: int = 600
    """Points of a channel that are kept however many channels there are."""
    all_points: int = 120_000
    """Points of all channels together: the page stays below about 6 MB."""
    scatter_points: int = 1500
    """Points of a residual against a signal."""
    hole: float = 5.0
    """A hole in a measurement is this many times as long as its usual interval; no line crosses it."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All settings of a diagnosis."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    faults: FaultSettings = field(default_factory=FaultSettings)
    numerics: NumericsSettings = field(default_factory=NumericsSettings)
    parameters: ParameterSettings = field(default_factory=ParameterSettings)
    fit: FitSettings = field(default_factory=FitSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    validation: ValidationSettings = field(default_factory=ValidationSettings)
    evidence: EvidenceSettings = field(default_factory=EvidenceSettings)
    posterior: PosteriorSettings = field(default_factory=PosteriorSettings)
    budget: BudgetSettings = field(default_factory=BudgetSettings)
    bootstrap: BootstrapSettings = field(default_factory=BootstrapSettings)
    uncertainty: UncertaintySettings = field(default_factory=UncertaintySettings)
    sanity: SanitySettings = field(default_factory=SanitySettings)
    analysis: AnalysisSettings = field(default_factory=AnalysisSettings)

    def as_dict(self) -> dict[str, Any]:
        """All values by name, for a result; JSON has no infinity."""
        made = asdict(self)
        return {name: {key: _finite(value) for key, value in values.items()} for name, values in made.items()}


@dataclass(frozen=True, kw_only=True)
class SyntheticSettings:
    """Synthetic campaigns; no part of a diagnosis."""

    rate: float = 100.0
    """Samples a second unless a run says otherwise [1/s]."""
    step: float = 0.25e-3
    """Macro step of the finer of the two runs from which that of no macro step is extrapolated [s]."""
    max_samples: float = 1e7
    """Samples of a run above which a rate or a time is taken for a mistake."""


def _finite(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_finite(v) for v in value]
    return "inf" if value == float("inf") else value


DEFAULT = Settings()
