"""The budget of the gap: what of it calibration accounts for, each effect, and nothing in the catalogue.

Calibration comes first and apart. What it leaves, as squared normalised residual above the noise, is divided among the
effects of every hypothesis that is plausible (`shapley`), and the hypotheses are averaged with their probabilities. The
parts add up to 1. Intervals come from a moving-block bootstrap over stretches of the held-out residuals, in which the
hypotheses are drawn, too, and what each set of effects leaves: the machine has these in another form than the
catalogue, so a right one leaves something, and what one of them misses another takes up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimation.uncertainty import block_length
from ..problem.observations import Observations
from ..settings import BootstrapSettings
from .shapley import monotone, shapley

Labels = frozenset[str]
"""Labels of effects: an id, with the channel of a sensor's effect."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """A plausible hypothesis: its probability among these, and what every subset of its effects leaves."""

    probability: float
    residuals: Mapping[Labels, np.ndarray]
    """Normalised held-out residual (n,) of every subset, the empty one among them: the refit of the base parameters."""

    @property
    def labels(self) -> Labels:
        """All its effects."""
        return max(self.residuals, key=len)


@dataclass(frozen=True)
class Part:
    """A share of the gap and its 95 % interval."""

    share: float
    ci95: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Budget:
    """Normalised RMS at each step, and the parts of what calibration leaves."""

    calibrated: float
    explained: float
    effects: Mapping[str, float]
    """Share of every effect by label, averaged over the hypotheses."""
    groups: Mapping[str, Part]
    """The same for groups of effects that a campaign may not tell apart."""
    unexplained: Part


class _Game(NamedTuple):
    """The worth of every subset in the game of an alternative, and what there is to share: arrays (draws,)."""

    worth: dict[Labels, np.ndarray]
    gap: np.ndarray


def _excess(mean_square: np.ndarray) -> np.ndarray:
    """Squared normalised residual above the noise."""
    return np.maximum(mean_square - 1.0, 0.0)


def _game(alternative: Alternative, energies: Mapping[Labels, np.ndarray], count: np.ndarray) -> _Game:
    """energies, count: of every subset, in every draw: sum of squares and number of readings (draws,)."""
    left = {s: _excess(energies[s] / count) for s in alternative.residuals}
    gap = left[frozenset()]
    return _Game({s: gap - x for s, x in left.items()}, gap)


def _shares(game: _Game) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Share of every effect, and of what none explains (draws,)."""
    worth = monotone(game.worth)
    gap = np.maximum(game.gap, 1e-300)
    effects = {label: value / gap for label, value in shapley(worth).items()}
    explained = sum(effects.values(), np.zeros_like(gap))
    return effects, np.where(game.gap > 0.0, 1.0 - explained, 1.0)


class Split(NamedTuple):
    """How the gap in some of the readings is divided."""

    calibrated: float
    explained: float
    effects: dict[str, float]
    unexplained: float


def split(alternatives: Sequence[Alternative], mask: np.ndarray | slice = slice(None)) -> Split:
    """The gap in the readings of a mask (n,), shared out and averaged over the alternatives; what calibration leaves is
    as the first of these sees it."""
    effects: dict[str, float] = {}
    excess_left = unexplained = 0.0
    gaps: list[float] = []
    for a in alternatives:
        energies = {s: np.array([float(r[mask] @ r[mask])]) for s, r in a.residuals.items()}
        count = np.array([float(len(a.residuals[frozenset()][mask]))])
        game = _game(a, energies, count)
        shares, unexplained_share = _shares(game)
        gaps.append(float(game.gap[0]))
        unexplained += a.probability * float(unexplained_share[0])
        excess_left += a.probability * (gaps[-1] - float(game.worth[a.labels][0]))
        for label, share in shares.items():
            effects[label] = effects.get(label, 0.0) + a.probability * float(share[0])
    return Split(float(np.sqrt(1.0 + gaps[0])), float(np.sqrt(1.0 + excess_left)), effects, unexplained)


def budget(
    observations: Observations, alternatives: Sequence[Alternative], groups: Mapping[str, str],
    settings: BootstrapSettings,
) -> Budget:  # fmt: skip
    """The budget on all readings; groups: of each effect by its label."""
    whole = split(alternatives)
    draws = _draws(observations, alternatives[0].residuals[frozenset()], settings)
    rng = np.random.default_rng(settings.seed)
    drawn = [_drawn_shares(observations, a, draws, settings, rng) for a in alternatives]
    probability = np.array([a.probability for a in alternatives])
    parts = {}
    for group in dict.fromkeys(groups[label] for label in whole.effects):
        members = {label for label in whole.effects if groups[label] == group}
        share = sum(whole.effects[label] for label in sorted(members))
        samples = np.stack([sum((d.effects[x] for x in sorted(members & a.labels)), np.zeros(len(draws)))
                            for d, a in zip(drawn, alternatives, strict=True)])  # fmt: skip
        parts[group] = Part(share, _interval(_mixed(samples, probability, rng), share))
    unexplained_draws = np.stack([d.unexplained for d in drawn])
    unexplained = Part(whole.unexplained, _interval(_mixed(unexplained_draws, probability, rng), whole.unexplained))
    return Budget(whole.calibrated, whole.explained, whole.effects, parts, unexplained)


class _Drawn(NamedTuple):
    effects: dict[str, np.ndarray]
    unexplained: np.ndarray


def _draws(observations: Observations, residual: np.ndarray, settings: BootstrapSettings) -> np.ndarray:
    """How often each stretch is drawn (draws, stretches), in blocks as long as the residual's memory."""
    from arch.bootstrap import MovingBlockBootstrap

    place = observations.stretches(settings.bin)
    energy = np.bincount(place, residual**2)
    count = len(energy)
    if count < 4:
        return np.random.default_rng(settings.seed).multinomial(count, np.full(count, 1.0 / count), settings.draws)
    length = block_length(energy, "circular", settings) or 1.0
    block = int(np.clip(np.ceil(length), 1, max(1, count // 3)))
    bootstrap = MovingBlockBootstrap(block, np.arange(count), seed=settings.seed)
    return np.stack([np.bincount(data[0][0], minlength=count) for data in bootstrap.bootstrap(settings.draws)])


def _drawn_shares(
    observations: Observations, a: Alternative, draws: np.ndarray, settings: BootstrapSettings,
    rng: np.random.Generator,
) -> _Drawn:  # fmt: skip
    place = observations.stretches(settings.bin)
    count = draws @ np.bincount(place)
    energies = {s: draws @ np.bincount(place, r**2) for s, r in a.residuals.items()}
    level = np.sqrt(_excess(energies[frozenset()] / count))
    for s in sorted(energies, key=sorted):  # in the same order in every process, for hashes are not
        if s:
            left = np.sqrt(_excess(energies[s] / count)) + settings.form * level * rng.normal(size=len(draws))
            energies[s] = count * (1.0 + np.maximum(left, 0.0) ** 2)
    return _Drawn(*_shares(_game(a, energies, count)))


def _mixed(samples: np.ndarray, weight: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One alternative for each draw: samples (alternatives, draws), weight (alternatives,)."""
    chosen = rng.choice(len(weight), samples.shape[1], p=weight)
    return np.asarray(samples[chosen, np.arange(samples.shape[1])])


def _interval(samples: np.ndarray, value: float) -> tuple[float, float]:
    """The middle 95 % of the samples, with the value in it."""
    low, high = np.quantile(samples, [0.025, 0.975])
    return float(min(low, value)), float(max(high, value))
