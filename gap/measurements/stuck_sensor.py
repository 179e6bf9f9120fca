"""Stretches in which a sensor is stuck: its readings are exactly constant where they cannot be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..settings import FaultSettings
from .glitches import Scale, Stretch
from .table import FloatArray


def constant_stretches(t: FloatArray, y: FloatArray, settings: FaultSettings) -> list[Stretch]:
    """Stretches of equal readings y (n,), long enough in time [s] and samples, with others before or after."""
    edges = np.r_[0, np.flatnonzero(np.diff(y) != 0.0) + 1, len(y)]
    if len(edges) == 2:
        return []
    return [
        Stretch(int(i), int(j))
        for i, j in pairwise(edges)
        if j - i >= settings.shortest_stuck_samples and t[j - 1] - t[i] >= settings.shortest_stuck
    ]


def is_stuck_in_noise(y: FloatArray, stretch: Stretch, scale: Scale, settings: FaultSettings) -> bool:
    """Whether noise of several steps of the converter before and after is missing in the stretch; at an end of the
    readings on the side that there is.

    A reading at either end of the channel's range is one that cannot go further, and 0 one that is too small to be
    told: neither is a stuck sensor.
    """
    near = settings.stuck_vicinity
    sides = (y[max(stretch.first - near, 0) : stretch.first], y[stretch.last : stretch.last + near])
    value = y[stretch.first]
    margin = 0.01 * scale.span
    if value == 0.0 or not y.min() + margin < value < y.max() - margin:
        return False
    return all(_is_noisy(side, scale, settings) for side in sides if len(side))


def _is_noisy(side: FloatArray, scale: Scale, settings: FaultSettings) -> bool:
    """Whether readings turn round often about the parabola through them, by several steps: a motion does not."""
    if len(side) < settings.stuck_vicinity // 2:
        return False
    x = np.linspace(-1.0, 1.0, len(side))
    left = side - np.polyval(np.polyfit(x, side, 2), x)
    steps = np.diff(left)
    turns = np.mean(steps[1:] * steps[:-1] < 0.0)
    seldom_equal = np.mean(np.diff(side) == 0.0) < settings.seldom_equal
    return bool(turns > settings.restless and seldom_equal and left.std() >= 2.0 * scale.resolution)


def leaves_with_a_jump(y: FloatArray, stretch: Stretch, scale: Scale) -> bool:
    """Whether the first readings after the stretch are beyond the noise around its value."""
    after = y[stretch.last : stretch.last + 3]
    if not len(after):
        return False
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
    if min(travelled) < settings.stuck_moving * (scale.noise + scale.resolution):
        return False
    if speeds[0] * speeds[1] <= 0.0 or min(map(abs, speeds)) < 0.3 * max(map(abs, speeds)):
        return False
    least = max(settings.share_of_span * scale.span, settings.above_resolution * scale.resolution)
    if abs(jump) <= max(least, settings.stuck_jump_over_steps * float(usual.max())):
        return False
    return settings.stuck_jump[0] <= jump / expected <= settings.stuck_jump[1]
