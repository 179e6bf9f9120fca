"""Stretches in which a sensor is stuck: its readings are exactly constant where they cannot be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .fault_settings import FaultSettings
from .glitches import Scale, Stretch
from .table import FloatArray

RESTLESS = 0.3
"""Share of readings that turn round; of white noise it is two thirds, of a smooth course next to none."""

SELDOM = 0.3
"""Share of readings that equal the next one, where noise is at least as large as the converter's step."""

NEAR = 30
"""Samples before and after a stretch that tell whether the channel is noisy there."""

SAME_COURSE = (0.5, 1.6)
"""Least and largest jump at the end of a stuck stretch, as a share of what the speeds before and after foretell."""

JUMP_OVER_STEPS = 5.0
"""Times the usual change from sample to sample that this jump is at least."""


MOVING = 5.0
"""Noise and steps of the converter that the channel travels just before and after, where it moves."""


def constant_stretches(t: FloatArray, y: FloatArray, settings: FaultSettings) -> list[Stretch]:
    """Stretches of equal readings y (n,), long enough in time [s] and samples, with others before and after."""
    edges = np.flatnonzero(np.diff(y) != 0.0) + 1
    return [
        Stretch(int(i), int(j))
        for i, j in pairwise(edges)
        if j - i >= settings.shortest_stuck_samples and t[j - 1] - t[i] >= settings.shortest_stuck
    ]


def is_stuck_in_noise(y: FloatArray, stretch: Stretch, scale: Scale) -> bool:
    """Whether noise of several steps of the converter before and after is missing in the stretch.

    A reading at either end of the channel's range is one that cannot go further, and no stuck sensor.
    """
    sides = (y[max(stretch.first - NEAR, 0) : stretch.first], y[stretch.last : stretch.last + NEAR])
    value = y[stretch.first]
    margin = 0.01 * scale.span
    if not y.min() + margin < value < y.max() - margin:
        return False
    return scale.noise >= 2.0 * scale.resolution and all(_is_noisy(side) for side in sides)


def _is_noisy(side: FloatArray) -> bool:
    if len(side) < NEAR // 2:
        return False
    steps = np.diff(side)
    return bool(np.mean(steps[1:] * steps[:-1] < 0.0) > RESTLESS and np.mean(steps == 0.0) < SELDOM)


def leaves_with_a_jump(y: FloatArray, stretch: Stretch, scale: Scale) -> bool:
    """Whether the first readings after the stretch are beyond the noise around its value."""
    after = y[stretch.last : stretch.last + 3]
    return float(np.abs(np.median(after) - y[stretch.first])) > 6.0 * scale.noise


def is_stuck_in_motion(
    t: FloatArray, y: FloatArray, stretch: Stretch, scale: Scale, settings: FaultSettings
) -> bool:
    """Whether the channel moves on after the stretch as if it had moved on meanwhile: at once, and by as much."""
    i, j, w = stretch.first, stretch.last, settings.event_window
    if i < w + 1 or len(y) - j < w:
        return False
    before, after = slice(i - w, i + 1), slice(j, j + w)
    speeds = [float(np.polyfit(t[part] - t[i], y[part], 1)[0]) for part in (before, after)]
    expected = (speeds[0] + speeds[1]) / 2.0 * float(t[j] - t[i])
    jump = float(y[j] - y[i])
    usual = np.abs(np.r_[np.diff(y[before]), np.diff(y[after])])
    travelled = [abs(v) * float(np.ptp(t[part])) for v, part in zip(speeds, (before, after), strict=True)]
    if min(travelled) < MOVING * (scale.noise + scale.resolution):
        return False
    if speeds[0] * speeds[1] <= 0.0 or min(map(abs, speeds)) < 0.3 * max(map(abs, speeds)):
        return False
    least = max(settings.share_of_span * scale.span, settings.above_resolution * scale.resolution)
    if abs(jump) <= max(least, JUMP_OVER_STEPS * float(usual.max())):
        return False
    return SAME_COURSE[0] <= jump / expected <= SAME_COURSE[1]
