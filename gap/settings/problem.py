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
    told_bias: float = 3.0
    """Standard deviations of a sensor's bias from which it is told."""
    told_clock: float = 5.0
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
