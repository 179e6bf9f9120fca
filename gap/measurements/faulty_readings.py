"""Readings of a run that a sensor got wrong: glitches, drop-outs and stretches in which it was stuck.

A fault of a sensor is in one channel alone. Where the course of any channel of the run changes at the same moment, the
machine has done something, and what looks like a fault is kept: the acceleration at an end stop is one sample long.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..settings import FILE_LIMITS, FaultSettings
from .glitches import Scale, Stretch, distance_of, dropout_candidates, glitch_candidates
from .machine_events import happens_elsewhere, has_event, kinks
from .stuck_sensor import constant_stretches, is_stuck_in_motion, is_stuck_in_noise, leaves_with_a_jump
from .table import FloatArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class FaultyReadings:
    """Which readings of a channel are faulty: masks (n,), by kind."""

    glitches: Mask
    dropouts: Mask
    stuck: Mask

    @property
    def any(self) -> Mask:
        """Those of any kind (n,)."""
        return np.asarray(self.glitches | self.dropouts | self.stuck)

    def without(self, keep: Mask) -> FaultyReadings:
        """The same where `keep` (n,) is not true."""
        return FaultyReadings(self.glitches & ~keep, self.dropouts & ~keep, self.stuck & ~keep)

    def counts(self) -> dict[str, int]:
        """Number of readings by kind, of kinds that there are."""
        kinds = {"glitches": self.glitches, "drop-outs": self.dropouts, "stuck": self.stuck}
        return {kind: int(mask.sum()) for kind, mask in kinds.items() if mask.any()}


@dataclass(frozen=True)
class _Channel:
    t: FloatArray
    y: FloatArray
    scale: Scale
    kinks: FloatArray
    """Of the channel without its candidates."""
    glitches: list[Stretch]
    dropouts: list[Stretch]

    def sample(self, moment: float) -> int:
        """Number of the first reading at or after a moment [s]."""
        return int(np.searchsorted(self.t, moment))


def find_faulty_readings(
    series: Mapping[str, tuple[FloatArray, FloatArray]], settings: FaultSettings | None = None
) -> dict[str, FaultyReadings]:
    """The faulty readings of each channel of a run: times [s] and finite readings, both (n,), by name."""
    settings = settings or FaultSettings()
    channels = {name: _prepare(t, y, settings) for name, (t, y) in series.items()}
    return {name: _find_faults(channels, name, settings) for name in channels}


def scale_of(y: FloatArray) -> Scale:
    """What is usual in readings y (n,)."""
    steps = np.abs(np.diff(y))
    moving = steps[steps > 1e-9 * max(float(np.abs(y).max()), 1e-300)]
    low, high = np.percentile(y, [2.0, 98.0])
    # the median of third differences, which a few faults do not move; of a channel in motion it says a little too much
    noise = float(np.median(np.abs(np.diff(y, 3)))) / (0.6745 * np.sqrt(20.0))
    return Scale(float(high - low), noise, float(moving.min()) if len(moving) else 0.0)


def _prepare(t: FloatArray, y: FloatArray, settings: FaultSettings) -> _Channel:
    if len(y) < FILE_LIMITS.min_judged:
        return _Channel(t, y, Scale(0.0, 0.0, 0.0), np.zeros(len(y)), [], [])
    scale = scale_of(y)
    glitches = glitch_candidates(y, scale, settings)
    in_glitch = _mask(len(y), glitches)
    dropouts = [s for s in dropout_candidates(t, y, scale, settings) if not in_glitch[s.first - 1 : s.last + 1].any()]
    good = ~(in_glitch | _mask(len(y), dropouts))
    filled = np.interp(t, t[good], y[good])
    return _Channel(t, y, scale, kinks(t, filled, settings), glitches, dropouts)


def _find_faults(channels: Mapping[str, _Channel], name: str, settings: FaultSettings) -> FaultyReadings:
    channel = channels[name]
    n = len(channel.y)
    glitches = [s for s in channel.glitches if not _machine_did_something(channels, channel, s, settings)]
    dropouts = [s for s in channel.dropouts if not _machine_did_something(channels, channel, s, settings)]
    stuck = [s for s in constant_stretches(channel.t, channel.y, settings) if _is_stuck(channels, name, s, settings)]
    faulty = FaultyReadings(_mask(n, glitches), _mask(n, dropouts), _mask(n, stuck))
    none = np.zeros(n, dtype=bool)
    if _mask(n, channel.glitches + channel.dropouts).mean() > settings.most:
        faulty = FaultyReadings(none, none, faulty.stuck)
    return FaultyReadings(none, none, none) if faulty.any.mean() > settings.most_faulty else faulty


def _machine_did_something(
    channels: Mapping[str, _Channel], channel: _Channel, stretch: Stretch, settings: FaultSettings
) -> bool:
    """Whether any channel, the stretch's own among them, changes its course where the stretch begins or ends.

    Of a few readings that are off by more than the channel's whole course it is chance that both come together, unless
    others are off wherever as much happens.
    """
    is_short = stretch.last - stretch.first <= settings.longest_glitch
    is_outside = is_short and distance_of(channel.y, stretch) > settings.outside * channel.scale.span
    moments = (float(channel.t[stretch.first]), float(channel.t[stretch.last - 1]))
    marked = [float(channel.t[s.first]) for s in (*channel.glitches, *channel.dropouts)]
    return any(
        _has_event(c, moment, settings) and not (is_outside and _happens_elsewhere(c, moment, marked, settings))
        for c in channels.values()
        for moment in moments
    )


def _has_event(c: _Channel, moment: float, settings: FaultSettings) -> bool:
    noise = c.scale.noise + c.scale.resolution / 4.0
    return has_event(c.kinks, c.sample(moment), noise, settings)


def _happens_elsewhere(c: _Channel, moment: float, marked: Sequence[float], settings: FaultSettings) -> bool:
    return happens_elsewhere(c.kinks, c.sample(moment), [c.sample(time) for time in marked], settings)


def _is_stuck(channels: Mapping[str, _Channel], name: str, stretch: Stretch, settings: FaultSettings) -> bool:
    channel = channels[name]
    if is_stuck_in_motion(channel.t, channel.y, stretch, channel.scale, settings):
        return True
    if not is_stuck_in_noise(channel.y, stretch, channel.scale, settings):
        return False
    begin, end = channel.t[stretch.first], channel.t[stretch.last - 1]
    others_move = (_moves(c, begin, end, settings) for other_name, c in channels.items() if other_name != name)
    return leaves_with_a_jump(channel.y, stretch, channel.scale) or any(others_move)


def _moves(c: _Channel, begin: float, end: float, settings: FaultSettings) -> bool:
    inside = c.y[(c.t >= begin) & (c.t <= end)]
    return len(inside) > 1 and float(np.ptp(inside)) > max(settings.rests_within * c.scale.span, 10.0 * c.scale.noise)


def _mask(n: int, stretches: list[Stretch]) -> Mask:
    mask = np.zeros(n, dtype=bool)
    for s in stretches:
        mask[s.first : s.last] = True
    return mask
