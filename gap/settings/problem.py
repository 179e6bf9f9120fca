"""What a reading is worth, which steps simulations take, what parameters may be."""

from __future__ import annotations

from dataclasses import dataclass


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
    bias_warning_from: float = 3.0
    """Standard deviations of a sensor's bias from which it is told."""
    clock_warning_from: float = 5.0
    """Standard deviations of a run's clock error from which it is told."""


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
    step_warning_from: float = 0.5
    """Normalised RMS change under halving from which the user is asked for a shorter step."""
    kept: float = 200e6
    """Memory for the latest runs [bytes], so that no point is simulated twice in a row."""


@dataclass(frozen=True, kw_only=True)
class ParameterSettings:
    """Base parameters and effects as quantities to be estimated."""

    base_reach: float = 1.0
    """How far a base parameter may go, in its tolerances: with 2, the refit explained a payload 8 % too heavy."""
    base_std: float = 0.6
    """Prior standard deviation of a base parameter, in its tolerance."""
    effect_std: float = 3.0
    """Prior standard deviation of an effect's size, in its usual size."""
    effect_range: float = 3.0
    """Such standard deviations that reach to the end of an effect's range, at most: what a catalogue allows is not
    ruled out by what is usual (friction of a seal 43 times the usual one, 12 of 46 noises, was found and judged away:
    seed 20261202, case 28)."""
    least_span: float = 1e-9
    """Span of a channel's readings, as a share of the largest, up to which its sensor reads the same all the time."""
    drift_time: float = 60.0
    """Time over which a catalogue states a sensor's drift [s]."""


@dataclass(frozen=True, kw_only=True)
class CurveSettings:
    """Free curves in the place of a formula."""

    length: float = 1.0
    """Distance, in knots, over which values resemble each other: with 2 a hump as wide as three knots was out of reach
    (2.1 times the noise were left of 4.8, with 1 it is 1.1)."""
    mirror: float = 0.5
    """How much values at the same distance to either side of zero do: machines are nearly symmetric."""
    least_energy: float = 0.02
    """Share of the strongest shape's variance below which a shape is left out."""
    std: float = 1.0
    """Prior standard deviation of a shape's size, in usual ones."""
    reach: float = 5.0
    """Largest size of a shape, in usual ones."""
    start: float = 0.7
    """Size at which a shape is run to foretell what it would do, in usual ones."""
    step: float = 1e-4
    """Step of the derivative of a drawn curve, in normalised parameters."""
    told: float = 0.1
    """Probability from which a curve is told."""
    drawn: int = 3
    """Points between two knots at which a curve is told: what a formula adds bends there."""


@dataclass(frozen=True, kw_only=True)
class SwingSettings:
    """A machine that swings by itself is compared by its trend, amplitude and frequency: what does not depend on
    phase."""

    window: float = 1.0
    """Width of the window that finds the trend around which a signal swings [s]."""
    periods: float = 2.5
    """The same in periods of the swing, where that is longer: a swing at a window's border would leak into the
    trend."""
    envelope_from: float = 2.5
    """Amplitude of a swing in the noise of its channel."""
    coherence_window: float = 3.0
    """Time over which the model's own swing is compared with the measured one [s]."""
    coherent: float = 0.5
    """Share of the measured swing's energy that follows the model's, from which it keeps pace: it is compared
    sample by sample, for a constant shift of phase says when something happens."""
    own_share: float = 0.1
    """Energy of the model's swing in that of the measured one below which it does not swing, whatever its phase."""
    least: float = 3.0
    """How long a swing lasts at least [s]."""
    gap: float = 1.0
    """Pause that does not end a swing [s]."""
    cycles: float = 6.0
    """Periods that it has at least."""
    narrow: float = 0.3
    """Half width of the band around its frequency, as a share of that, in which a swing has its energy."""
    narrow_share: float = 0.6
    """Share of the energy there at least: what follows a rough command has none."""
    least_samples: float = 4.0
    """Samples in a period at least."""
    driven_share: float = 0.01
    """Energy of a measured input in that band, as a share of all it has, from which it drives the swing."""
    envelope_error: float = 0.05
    """What a model's form leaves open of an amplitude, as a share of it."""
    frequency_error: float = 0.01
    """The same of a frequency."""
    trend_error: float = 0.02
    """What it leaves open of the trend, as a share of the amplitude."""
    crossing: float = 0.3
    """Amplitude that a signal reaches between two of its zero crossings, as a share of its RMS."""
