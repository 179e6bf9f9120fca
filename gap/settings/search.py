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

    sizes: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
    """Sizes of an effect that are run, in usual ones; between them responses are scaled."""
    first: tuple[float, ...] = (0.1, 1.0)
    """Those that every effect is run at; others where the best sets ask for them."""
    unseen: float = 0.1
    """Normalised RMS of the change at all of these below which an effect is run at every size of the grid."""
    same: float = 0.1
    """The same of what the change differs by between the least and the largest of these, as a share of it."""
    looks: int = 4
    """How often they may ask."""
    trifle: float = 0.01
    """Share of the energy left by calibration below which what the best set leaves is asked about once more only."""
    curve_trifle: float = 0.003
    """The same share below which no curve is tried."""
    asking: int = 60
    """Sets that do."""
    ratio: float = 3.5
    """Times the largest of these from which the end of a range is so far that sizes between are run, too."""
    shapes: int = 4
    """Starts of an effect's shapes up to which each is run at every size."""
    derivative_step: float = 0.15
    """Step of a derivative, in normalised parameters, or as a share of an effect's size."""
    beyond: float = 3.0
    """How far the smallest size that was run may be scaled down, and the largest up."""
    near: float = 0.5
    """Share of the delivered gap below which the refit of the base parameters is where the first bank is made."""
    strained: float = 0.34
    """Share of the base parameters at the ends of their tolerances from which it is not: they are bent then."""
    base_looks: int = 2
    """How often that refit may look for derivatives."""
    base_alone: tuple[float, ...] = (-1.0, -0.5, 0.5, 1.0)
    base_starts: int = 2
    """Where that refit stops far from the data: shares of its range at which each is tried alone, fits from there."""
    price: float = 12.0
    """What an effect costs in a comparison of sets, in -2 log probability."""
    form_price: float = 6.0
    """The same of a form other than the plain one."""
    form_leaders: int = 4
    """Best sets, beside the best of each size, whose effects are tried in other forms. With two, friction of a joint
    that holds more one way was left out behind others (seed 20261202, case 4), and wrong effects stood in for it."""
    little_left: float = 1.1
    """Times the noise below which the best set leaves so little that sets which leave far more are tried in no form."""
    form_beyond: float = 1.5
    """How far beyond its start a form's parameter may be expected to go, in that."""
    forms_fitted: int = 5
    """Of these the best that are fitted."""
    form_looks: int = 1
    """How often such a fit may look for derivatives before those that stay behind are left."""
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
    many_runs: int = 12
    some_runs: int = 6
    """Runs above which the search begins on some of them, and on how many; for the time it takes, tuned on no seed."""
    same_conditions: float = 0.1
    """What a run under the same conditions as another is worth beside one that is as far from it as the runs are."""
    fitted_to_all: int = 4
    """Best sets that are then fitted to all runs."""
    more_left: float = 1.2
    """Times what the best of them left of some runs from which, left of all, the search goes on."""
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
    much: float = 20.0
    """Gain of such a look, in -2 log probability, from which the next one takes derivatives anew."""
    far: float = 3.0
    """Times the noise that a set leaves from which it is not fitted to the end without one of its effects: with
    derivatives over wide steps fits were seen to stop at twice of what was to be had (case 21)."""
    fine_step: float = 1e-3
    """Step of these derivatives, in normalised parameters."""
    near_leader: float = 25.0
    most_leaders: int = 6
    """Cost behind the best up to which a set is fitted to the end, too, and sets for which that is done."""
    remembered: int = 30
    """Sets whose points diagnosis.json tells, to go on from."""
    relatives: int = 3
    """Effects of the same group that are fitted in the place of one of the best set."""
    relatives_near: float = 100.0
    """Cost behind the best up to which these are fitted from where it stands; on one case (seed 777, four lands with a
    late sensor)."""
    size_looks: int = 2
    """How often the sizes between those of the grid are halved for that."""
    period_range: float = 0.3
    """How far beside the size that serves best on the average a period is looked for, as a share of it; this and the
    next six on two cases (seed 20261202, case 42, and 20261128, case 14)."""
    periods_averaged: float = 4.0
    """Longest periods over which that average is taken."""
    period_window: float = 0.5
    """Stretch of a run, from where it begins to move, over which that is begun [s]; doubled until it ends."""
    turn: float = 0.1
    small_turn: float = 0.05
    """Parts of a period's turn at the end of a stretch: between neighbours that are tried, and of a difference."""
    moved: float = 5.0
    """Times the noise by which a reading leaves where it began when a run begins to move."""
    periods_kept: int = 3
    """Periods that are gone on with over the next stretch."""
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
    step_sensitive: float = 0.5
    """Share of what an effect does by which it may do something else at the step of a fit's runs."""
