"""What fits are judged by: left-out data, evidence, probabilities, shares, intervals."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ScoringConstants:
    """How fits are scored. No part of `Settings`: these were calibrated together with
    `selection/probability_calibration.json` and change only with it."""

    price: float = 12.0
    """What an effect costs in a comparison of sets, in -2 log probability."""
    form_price: float = 6.0
    """What a form other than the plain one costs, likewise."""
    deviance_readings: float = 150.0
    """Readings that count in the penalised deviance by which the search ranks fits until they are judged."""
    chance: float = 1.5
    """Standard deviations of the energy that noise shares by chance which are no evidence."""
    moving_rounds: int = 8
    """Rounds in which the point is found at which parameters count when a hypothesis is judged."""
    least_share: float = 0.003
    """Share of the gap below which an expected share tells no more."""
    min_probability: float = 1e-6
    """Floor of a raw probability and of its complement, so that its odds are finite."""
    max_probability: float = 0.99
    """Cap of a calibrated probability: among the surest 2 to 3 in 100 were wrong."""


SCORING = ScoringConstants()


@dataclass(frozen=True, kw_only=True)
class ValidationSettings:
    """Stretches of time that are left out and predicted from the rest."""

    folds: int = 20
    """Number of folds; each run is cut into as many stretches, one to a fold."""
    linear_within: float = 0.5
    """How far a refit without a fold may move, in normalised parameters: beyond, the model is not linear."""


@dataclass(frozen=True, kw_only=True)
class EvidenceSettings:
    """Prior probabilities of hypotheses; what calibrates them is in `selection/probability_calibration.json`."""

    prior_none: float = 0.3
    """Prior probability that there is no effect."""
    prior_of_size: tuple[float, ...] = (0.5, 0.16, 0.04)
    """Prior probability of one, two and three effects together, shared by all sets of that size."""
    prior_of_form: float = 0.2
    """Prior probability of a form that an effect may have, beside the plain one's 1."""
    adequate: float = 0.02
    """Structured energy beyond chance, per reading, with which nothing is left to explain."""


@dataclass(frozen=True, kw_only=True)
class PosteriorSettings:
    """Which probabilities a verdict needs, and what lowers them."""

    named: float = 0.5
    """Inclusion probability from which an effect is named."""
    sure: float = 0.8
    """Inclusion probability from which an effect explains a part of the gap."""
    at_bound: float = 0.2
    """Odds of an effect whose parameter stands at its bound are multiplied by it: sizes that make no sense are no
    explanation (inches declared as mm were "94 % sure" so)."""
    unfinished: float = 0.3
    """Odds of all effects are multiplied by it when the search was cut off."""


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
    form: float = 0.15
    """What each set of effects may leave more or less in the form that the machine has, as a share of what calibration
    leaves (rms)."""


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
