"""How sets of effects are looked for and fitted."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """Dispersion of a residual, and Jacobians over wide steps."""

    min_independent: float = 600.0
    """Readings that count at least in the dispersion, however long their residuals stay on one side."""
    wide_step: float = 0.2
    """Step of differences, in normalised parameters, that serve for larger moves: refits without a fold, intervals."""
    rough_from: float = 0.7
    """Change of a difference from one step to the next, as a share of it, from which runs are not smooth."""


@dataclass(frozen=True, kw_only=True)
class SearchSettings:
    """The search over sets of effects on a bank of responses. Chosen on cases 6 and 20 to 22 of seed 20261126."""

    # sizes of effects in the bank
    sizes: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
    """Sizes of an effect that are run, in usual ones; between them responses are scaled."""
    usual: float = 1.0
    """That which every effect is run at first."""
    small: float = 0.1
    """That which it is run at next, unless it would need a larger one to do as much as is left; others where the best
    sets ask for them."""
    max_size_ratio: float = 3.5
    """Largest ratio between neighbouring sizes beyond the listed ones, up to the end of a range."""
    shapes: int = 4
    """Starts of an effect's shapes up to which each is run at every size."""
    min_response_rms: float = 0.1
    """Normalised RMS of a response at all first sizes below which an effect is run at every size of the grid."""
    min_response_difference: float = 0.1
    """Share of a response by which its smallest and largest first size have to differ, else as above."""
    threshold_rounds: int = 3
    """Rounds in which sizes are added where an effect sets in between two that were run."""
    threshold_steepness: float = 1.5
    """Power of the size by which a response has to grow from one to the next for that."""
    threshold_width: float = 1.25
    """Ratio of two sizes between which there is no further one."""
    threshold_way: tuple[float, float] = (0.25, 0.75)
    """Shares of the way from the larger to the smaller one between which it lies, in logarithms."""
    size_rounds: int = 4
    """Rounds in which sizes that the best sets ask for are added to the bank."""
    sets_asking: int = 60
    """Best sets whose wanted sizes are added in such a round."""
    extrapolation: float = 3.0
    """Factor by which the smallest size that was run may be scaled down, and the largest up."""
    derivative_step: float = 0.15
    """Step of a derivative, in normalised parameters, or as a share of an effect's size."""
    rows: int = 12_000
    """Readings at which responses are kept."""
    batch: int = 120
    """Runs that are simulated at a time."""

    # the refit of the base parameters, and where the first bank is made
    max_baseline_ratio: float = 0.5
    """RMS of the baseline over that of the nominal model below which the first bank is made at the baseline."""
    max_share_at_tolerance: float = 0.34
    """Share of base parameters at a tolerance's end above which it is made at the nominal model: they are bent then."""
    baseline_rounds: int = 2
    """Rounds of that refit with new derivatives."""
    base_alone: tuple[float, ...] = (-1.0, -0.5, 0.5, 1.0)
    """Where that refit stops far from the data: shares of its range at which each base parameter is tried alone."""
    base_starts: int = 2
    """How many of the best of these the refit starts from again."""

    # the comparison of sets
    most_effects: int = 3
    """Effects of a set at most: more stand in for a form."""
    pairs: int = 200
    """Sets of two that are kept, and as many of three."""
    leading_pairs: int = 60
    """Pairs that are tried with a third effect."""
    least_left: float = 1e-3
    """Share of the residual's squares that the best set may be expected to leave, at least."""
    own_radius: float = 0.3
    """How far an effect that is in already may be expected to move, as a share of its size."""
    negligible: float = 0.01
    """Normalised size of an effect that is as good as absent."""

    # a first look
    first_sets: int = 6
    """Sets that are fitted as soon as every effect has been run at its usual size."""
    first_fit_steps: int = 4
    """Quasi-Newton steps of these fits."""

    # quick fits of the proposed sets
    sets_per_round: int = 12
    """Sets that are fitted in a round."""
    quick_fit_steps: int = 6
    """Quasi-Newton steps of a quick fit."""
    promise: float = 0.7
    """Times what the best quick fit leaves; a set that was expected to leave less, and does not, is fitted anew."""
    broken_promise: float = 1.5
    """Times that expectation from which its fit has failed it."""
    fits_anew: int = 6
    """Sets that are fitted anew in a round, the most promising of each size by turns."""
    initial_trust_radius: float = 0.5
    """Trust radius at its start, as a share of a parameter's value."""
    min_trust_scale: float = 0.6
    """What a parameter's value counts for at least in its trust radius."""
    trust_growth: float = 1.5
    """Factor of the trust radius after an accepted step."""
    trust_shrinkage: float = 0.4
    """Factor of the trust radius after a rejected step."""
    max_rejected_steps: int = 3
    """Rejected steps in a row that end a quick fit."""
    least_gain: float = 0.5
    """Expected gain below which a quick fit stays where it is."""

    # fits to the end
    polished_per_round: int = 4
    """Best quick fits of a round that are polished."""
    polish_steps: int = 4
    """Steps of a round of polishing, with derivatives from small steps."""
    polish_rounds: int = 3
    """Rounds of polishing, each with a new exact run."""
    polish_difference_step: float = 1e-3
    """Step of the derivatives in polishing, in normalised parameters."""
    jacobian_refresh_gain: float = 20.0
    """Gain of a round of polishing, in -2 log probability, from which the next one takes derivatives anew."""
    exact_trial_gain: float = 20.0
    """Gain that a linear step foretells, in -2 log probability, from which an exact run is worth it."""
    polish_within: float = 25.0
    """Search cost behind the best within which sets are polished."""
    max_polished: int = 6
    """Sets near the best that are polished at most."""
    max_drop_ratio: float = 3.0
    """Times what a set leaves up to which it is fitted to the end without one of its effects: with derivatives over
    wide steps fits were seen to stop at twice of what was to be had (case 21)."""
    squeeze: tuple[float, ...] = (0.5, 0.2)
    """Shares of its size that an effect may keep, one after the other, before it is taken away from a fit that has come
    less far without it than derivatives foretell (seed 20261128, case 7: 17 noises left at once, 1.02 this way)."""
    wide_leaders: int = 3
    """Best sets whose derivatives are taken over wide steps, too, for refits without a fold of the data."""
    min_round_gain: float = 3.0
    """Search cost that a round has to gain for the search to go on there."""

    # forms and curves
    form_leaders: int = 4
    """Best sets, beside the best of each size, whose effects are tried in other forms. With two, friction of a joint
    that holds more one way was left out behind others (seed 20261202, case 4), and wrong effects stood in for it."""
    little_left: float = 1.1
    """Normalised RMS of the best set up to which sets that leave far more are tried in no form."""
    max_form_ratio: float = 3.0
    """Times what the best set leaves that is far more in this."""
    form_beyond: float = 1.5
    """How far beyond its start a form's parameter may be expected to go, as a multiple."""
    forms_fitted: int = 5
    """Sets in other forms that are fitted, the best that are expected."""
    form_polish_rounds: int = 1
    """Rounds of polishing of such a fit before those that stay behind are left."""
    min_energy_share: float = 0.01
    """Share of the baseline's structured energy below which only one further round is run and no shorter step tried."""
    curve_min_energy_share: float = 0.003
    """Share of the same below which no free curve is tried."""

    # frequencies
    frequency_spacing: float = 0.1
    """Part of a turn by which the end of a run shifts from one frequency that is tried to the next."""
    frequency_trials: int = 300
    """Frequencies between two starts that are tried at the most."""
    frequency_difference: float = 0.01
    """Step of a derivative by a frequency, as of others."""
    frequencies_run: int = 2
    """The best of them that are run."""

    # relatives and periods
    relatives: int = 3
    """Effects in the place of one of the best set of their group that are fitted, of all together."""
    relatives_within: float = 100.0
    """Search cost behind the best up to which relatives are fitted from where the best set stands; on one case (seed
    777, four lands with a late sensor)."""
    size_halvings: int = 2
    """How often the gaps between sizes are halved for relatives and periods."""
    period_range: float = 0.3
    """How far beside the size that serves best on the average a period is looked for, as a share of it; this and the
    next six on two cases (seed 20261202, case 42, and 20261128, case 14)."""
    periods_averaged: float = 4.0
    """Longest periods over which that average is taken."""
    period_window: float = 0.5
    """Stretch of a run, from where it begins to move, over which the search for a period begins [s]; doubled until it
    is the whole run."""
    period_spacing: float = 0.1
    """Part of a period by which the end of a stretch shifts from one trial to the next."""
    period_trials: int = 400
    """Trials over the first stretch at the most. A period of 30 ms takes as many; one of 1 ms would take ten thousand,
    and half an hour, so it is looked for less far beside the size that serves best on the average."""
    period_difference: float = 0.05
    """Part of a period by which it shifts in a difference."""
    motion_threshold: float = 5.0
    """Noises by which a reading leaves its start when a run begins to move."""
    periods_kept: int = 5
    """Local minima that are gone on with over the next stretch: with three the right one, fourth over the first, was
    lost (seed 20261128, case 14)."""
    period_average: float = 0.1
    """Share of a period by which it is changed to see what it does on the average over many turns; this and the next
    on one case (seed 20261210, case 134)."""
    period_within: float = 1.3
    """What may be left with a period that serves on the average, as a multiple of what the best set leaves, for it to
    be looked for where that set is adequate."""

    # what long steps spoil
    step_sensitive: float = 0.5
    """Share of what an effect does by which it may do something else at the step of a fit's runs."""

    # many runs, and diagnoses to go on from
    many_runs: int = 12
    """Runs above which the search begins on some of them; for the time it takes, tuned on no seed."""
    some_runs: int = 6
    """On how many it begins then."""
    same_conditions: float = 0.1
    """What a run under the same conditions as another is worth beside one that is as far from it as the runs are."""
    fitted_to_all: int = 4
    """Best sets on some runs that are then fitted to all runs."""
    more_left: float = 1.2
    """Times what the best of them left of some runs from which, left of all, the search goes on."""
    saved_sets: int = 30
    """Sets whose points are saved in diagnosis.json, to resume from."""
