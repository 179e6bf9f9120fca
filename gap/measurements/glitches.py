"""Glitches and drop-outs: a few readings far from those before and after, which agree with each other."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..settings import FaultSettings
from .table import FloatArray


@dataclass(frozen=True)
class Scale:
    """What is usual in a channel [its unit]: the span of nearly all readings, noise, and the converter's step."""

    span: float
    noise: float
    resolution: float


@dataclass(frozen=True)
class Stretch:
    """The readings first to last - 1 of a channel."""

    first: int
    last: int


def far_enough(y: FloatArray, stretch: Stretch, scale: Scale, settings: FaultSettings) -> bool:
    """Whether the readings of a stretch are all to one side of, and far from, the line between their neighbours."""
    distance = distance_of(y, stretch)
    least = max(
        settings.share_of_span * scale.span,
        settings.above_noise * scale.noise,
        settings.above_resolution * scale.resolution,
    )
    if distance <= least:
        return False
    return distance > settings.above_steps * usual_step(y, stretch, settings)


def distance_of(y: FloatArray, stretch: Stretch) -> float:
    """How far the readings of a stretch are from the line between their neighbours at least; 0 if on both sides."""
    i, j = stretch.first, stretch.last
    before, after = y[i - 1], y[j]
    line = before + (after - before) * (np.arange(i, j) - (i - 1)) / (j - i + 1)
    away = y[i:j] - line
    return 0.0 if (away > 0.0).any() and (away < 0.0).any() else float(np.abs(away).min())


def usual_step(y: FloatArray, stretch: Stretch, settings: FaultSettings) -> float:
    """Change from sample to sample before and after a stretch; other faults nearby do not count."""
    i, j, w = stretch.first, stretch.last, settings.nearby
    steps = np.abs(np.r_[np.diff(y[max(i - w, 0) : i]), np.diff(y[j : j + w])])
    return float(np.percentile(steps, 80.0)) if len(steps) else np.inf


def neighbours_agree(y: FloatArray, stretch: Stretch, settings: FaultSettings) -> bool:
    """Whether the two readings on each side of a stretch differ by little, or by what the channel moves meanwhile."""
    i, j = stretch.first, stretch.last
    sides = y[[i - 2, i - 1, j, j + 1]]
    distance = float(np.abs(y[i:j] - (y[i - 1] + y[j]) / 2.0).min())
    if distance == 0.0:  # one of the readings lies right between the sides
        return False
    motion = 1.2 * (j - i + 3) * usual_step(y, stretch, settings)
    share = float(np.clip(motion / distance, settings.neighbours_agree, settings.neighbours_agree_in_motion))
    return float(np.ptp(sides)) <= share * distance


def glitch_candidates(y: FloatArray, scale: Scale, settings: FaultSettings) -> list[Stretch]:
    """Stretches of one to a few readings that stand out; without those at either end of y (n,)."""
    steps = np.abs(np.diff(y))
    jumps = np.flatnonzero(steps > max(settings.share_of_span * scale.span, settings.above_noise * scale.noise))
    stretches: list[Stretch] = []
    if (steps[jumps] > settings.above_steps * np.median(steps)).sum() > settings.most * len(y):
        return []  # pulses are this channel's way
    for jump in jumps:
        i = int(jump) + 1
        if i < 2 or (stretches and i < stretches[-1].last):
            continue
        for j in range(i + 1, min(i + settings.longest_glitch, len(y) - 2) + 1):
            stretch = Stretch(i, j)
            if far_enough(y, stretch, scale, settings) and neighbours_agree(y, stretch, settings):
                stretches.append(stretch)
                break
    return stretches


def dropout_candidates(t: FloatArray, y: FloatArray, scale: Scale, settings: FaultSettings) -> list[Stretch]:
    """Stretches at 0, or constant at the least or largest reading, that are entered and left within one sample.

    t (n,) [s], y (n,). The readings before and after need not agree: the machine moves on meanwhile.
    """
    steps = np.diff(y)
    jumps = np.flatnonzero(np.abs(steps) > settings.share_of_span * scale.span)
    stretches: list[Stretch] = []
    for a, b in pairwise(jumps):
        i, j = int(a) + 1, int(b) + 1
        short = t[j] - t[i] <= settings.longest_dropout or j - i <= settings.longest_dropout_samples
        if i < 2 or j > len(y) - 2 or not short or steps[a] * steps[b] >= 0.0:
            continue
        inside = y[i:j]
        jump = min(abs(steps[a]), abs(steps[b]))
        at_zero = float(np.abs(inside).max()) < 0.02 * jump
        at_end = bool((inside == inside[0]).all()) and inside[0] in (y.min(), y.max())
        if (at_zero or at_end) and far_enough(y, Stretch(i, j), scale, settings):
            stretches.append(Stretch(i, j))
    return stretches
