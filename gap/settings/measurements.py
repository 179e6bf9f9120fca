"""What a campaign's files may hold, faulty readings in them, and what no campaign can mean."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FileLimits:
    """What a campaign's files may hold. Not tuned: what lies beyond is a slip of whoever wrote them down."""

    most_runs: float = 2000.0
    """Runs of a campaign that are taken unless it says how many: a first budget of 40 takes minutes."""
    most_megabytes: float = 1000.0
    """Size of its run files together, unless it says how much: text takes about as much memory while it is read."""
    megabyte: float = 1e6
    """Bytes."""
    min_samples: int = 20
    """Fewest samples of a channel in a run that a diagnosis can use."""
    early_start: float = 0.5
    """Share of a sample interval that time may start before 0 without a word."""
    late_start: float = 0.2
    """Share of a run's length that time may start late without a word."""
    start_elsewhere: float = 1.0
    """Share of it from which the key `start` is asked for."""
    finest_noise: float = 1e-9
    """A stated noise as a share of its channel's level, below which no sensor gets."""
    coarsest_noise: float = 10.0
    """A stated noise as a multiple of its channel's span, beyond which all is hid."""
    coarsest_scatter: float = 1.0
    """What a model may miss, as a multiple of it, beyond which all is hid."""
    far_reading: float = 1e3
    """Times what nearly all readings are within, beyond which one says nothing of how fine its sensor is."""
    most_jitter: float = 50.0
    """Jitter of a clock in sample intervals, beyond which it is written in another unit."""
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
    jitter_warning_from: float = 0.015
    """Standard deviation of time stamps, in sample intervals, from which a clock is told to jitter: that of +-3 %."""
    finest_range: float = 1e-6
    """Width of an effect's bounds as a share of their largest value, and its prior of that width, at least."""
    widest_range: float = 1e30
    """Width of an effect's bounds at most [its unit]."""
    widest_prior: float = 100.0
    """Prior of an effect as a multiple of that width, at most."""
    longest_cell: int = 2**26
    """Characters of a cell of a text file; a head that is cut with another delimiter is one cell."""
    block: int = 2**22
    """Characters of a text file that are read together."""
    min_judged: int = 30
    """Readings of a channel below which nothing is said of faulty ones."""


FILE_LIMITS = FileLimits()


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
    outside: float = 2.0
    """Times its channel's span that a reading is off, from which one event of the machine does not excuse it. Chosen on
    the pool test with glitches put in; of 1354 series without any (blind, pool, real) nothing is left out."""
    event_alike: float = 0.5
    """Share of an event's kink from which another one would move the same readings: an impact does more, the harder.
    Chosen with `outside`."""
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
    most_faulty: float = 0.8
    """Share of faulty readings from which none is left out: what they are measured by is then in doubt itself."""
    rests_within: float = 0.02
    """Share of its span that a channel moves where the machine does not rest."""
    most: float = 0.1
    """Share of a channel's readings that may be faulty, or jump so far; more is a signal and all are kept."""


@dataclass(frozen=True, kw_only=True)
class SanitySettings:
    """What no campaign can mean."""

    impossible_spans: float = 20.0
    """Spans of model and readings that a reading may lie beyond both."""
    missing_marks: tuple[float, ...] = (999.0, 9999.0, 99999.0, 999999.0)
    """What is written, or its negative, where there was no reading."""
    repeated_marks: int = 3
    """Readings that are the same of them, from which they need not lie so far off."""
    marks_away: float = 0.5
    """Spans of all others that such ones lie away from them at least."""
    finer_units: tuple[float, ...] = (1e3, 1e6, 1e9)
    """How many times too short a run is whose times are taken to be in ms, us or ns and are not."""
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
