"""What is left, in the words of a mechanic: which channel, which part of the motion, with what it grows, how fast."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..problem.problem import Problem
from .localisation import GapLocation
from .residual_structure import Structure


@dataclass(frozen=True)
class Character:
    """Of a normalised residual; empty where it is noise."""

    channel: str
    share: float
    """Of the channel in what is left."""
    region: str
    varies_with: str
    frequency: tuple[float, float] | None
    """Range that holds most of its energy [Hz]; None where nothing stands out."""

    @property
    def text(self) -> str:
        """For people."""
        if not self.channel:
            return "within the noise"
        parts = [f"mostly in {self.channel} ({100.0 * self.share:.0f} %)"]
        if self.region not in ("everywhere", "nowhere"):
            parts.append(self.region)
        if self.varies_with:
            parts.append(f"varies most with the {self.varies_with}")
        if self.frequency is not None:
            parts.append(_hertz(*self.frequency))
        return "; ".join(parts)


def describe_residual(
    problem: Problem, residual: np.ndarray, places: Sequence[GapLocation], structure: Structure | None
) -> Character:
    """The character of a normalised residual (n,); places: its own, the largest share first."""
    settings = problem.settings.analysis
    if not places or float(np.mean(residual**2)) <= 1.0 + problem.settings.budget.adequate_excess:
        return Character("", 0.0, "", "", None)
    top = places[0]
    varies_with = ""
    if structure is not None and structure.channels.get(top.channel, 0.0) > settings.min_predictable_share:
        varies_with = structure.varies_with.get(top.channel, "")
    channel = problem.labels.index(top.channel)
    frequency = _main_frequencies(problem, residual, channel, settings.frequency_share)
    return Character(top.channel, top.share, top.region, varies_with, frequency)


def _main_frequencies(problem: Problem, residual: np.ndarray, channel: int, share: float) -> tuple[float, float] | None:
    """The narrowest range [Hz] with that share of the energy of a channel's residual, all runs together."""
    blocks = [b for b in problem.observations.series if b.channel == channel and len(b.t) > 8]
    if not blocks:
        return None
    frequencies, energies = [], []
    for b in blocks:
        e = residual[b.place]
        frequencies.append(np.fft.rfftfreq(len(e), b.interval))
        energies.append(np.abs(np.fft.rfft(e)) ** 2)
    f, energy = np.concatenate(frequencies), np.concatenate(energies)
    order = np.argsort(f)
    f, total = f[order], np.concatenate([[0.0], np.cumsum(energy[order])])
    target = share * total[-1]
    ends = np.searchsorted(total, total[:-1] + target)
    possible = np.flatnonzero(ends < len(total))
    if not len(possible):
        return None
    widths = f[ends[possible] - 1] - f[possible]
    k = int(possible[np.argmin(widths)])
    low, high = float(f[k]), float(f[ends[k] - 1])
    return None if high > 0.5 * float(f[-1]) else (low, high)


def _hertz(low: float, high: float) -> str:
    if high < 0.05:
        return "slower than 0.05 Hz"
    if low < 0.05 or low < 0.1 * high:
        return f"below {high:.2g} Hz"
    if high < 1.2 * low:
        return f"at {0.5 * (low + high):.2g} Hz"
    return f"{low:.2g} to {high:.2g} Hz"


def nearest_effects(gains: Mapping[str, float], named: Sequence[str], count: int) -> tuple[str, ...]:
    """Effects that come nearest to what is left: those that gain most beside the best, but for what is named."""
    unnamed = [(gain, id) for id, gain in gains.items() if id not in named and gain > 0.0]
    return tuple(id for _, id in sorted(unnamed, key=lambda entry: -entry[0])[:count])
