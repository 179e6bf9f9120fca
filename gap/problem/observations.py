"""The measurements of a campaign as one long vector, and the model's answer to each of its entries.

Entries are grouped in blocks, one per run and channel. Everything is in the unit of the FMU's variable; residuals are
divided by the floor of each entry, so they are dimensionless.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .noise import noise_std
from .sensors import Sensor

MOST = 1500
"""Most samples of a block; what is faster is averaged over neighbours."""

SWINGS = 3.0
"""Standard deviations, for noise, by which samples have to be more like the second next than like the next to swing."""

JITTER = 0.03
"""Timing that nobody guarantees, in sample intervals: it enters the floor with the slope of the signal."""


@dataclass(frozen=True)
class Moment:
    """When a signal comes to stay within `within` of `target` until `until` [s], from `after` [s]; a limit clips it.

    first: when it comes there for the first time, whether it stays or not.
    """

    target: float
    within: float
    after: float
    low: float = -np.inf
    high: float = np.inf
    until: float = np.inf
    first: bool = False

    def read(self, t: np.ndarray, x: np.ndarray) -> float:
        """The duration [s] in the signal x (n,) at times t (n,), between samples by a straight line.

        A signal that does not arrive is continued with its mean speed until then, at least a twentieth of the way long.
        """
        end = max(2, int(np.searchsorted(t, self.until, side="right")))
        t, x = t[:end], x[:end]
        away = np.abs(x - self.target) - self.within
        start = int(np.searchsorted(t, self.after))
        outside = away[start:] > 0.0
        if self.first and not outside.all():
            outside[int(np.argmin(outside)) :] = False
        if not outside.any():
            found = 0.0
        else:
            k = start + int(np.flatnonzero(outside)[-1])
            if k + 1 < len(t):
                found = t[k] + (t[k + 1] - t[k]) * away[k] / (away[k] - away[k + 1]) - self.after
            else:
                path = max(abs(x[-1] - x[start]), 0.05 * abs(x[start] - self.target), 1e-12)
                found = (t[-1] - self.after) * (1.0 + away[-1] / path)
        return float(min(max(found, self.low), self.high))


@dataclass(frozen=True)
class Block:
    """The samples of one channel in one run: times [s], readings, floor, and their place in the long vector.

    With a `moment` it is a single reading: a duration.
    """

    run: int
    channel: int
    connector: str
    t: np.ndarray
    y: np.ndarray
    floor: float
    place: slice
    moment: Moment | None = None
    stated: bool = True
    """The floor is what the campaign says, not what was estimated."""

    @property
    def interval(self) -> float:
        """Time between samples [s]."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else 0.0


@dataclass
class Observations:
    """All blocks, the readings and floors of all entries, and which run, channel and time each entry has."""

    blocks: list[Block]
    y: np.ndarray
    floor: np.ndarray
    run: np.ndarray
    channel: np.ndarray
    time: np.ndarray
    span: np.ndarray
    """Largest minus smallest reading of each channel over all runs."""
    level: np.ndarray
    """Largest magnitude of a reading of each channel."""

    @property
    def series(self) -> list[Block]:
        """The blocks that are time series."""
        return [b for b in self.blocks if b.moment is None]

    def __len__(self) -> int:
        return len(self.y)

    def read(
        self,
        grids: Sequence[np.ndarray],
        rows: Sequence[np.ndarray],
        columns: Mapping[str, int],
        sensors: Mapping[str, Sensor] | None = None,
    ) -> np.ndarray:
        """What the channels read when run r gives the signals rows[r] (n, signals) at the times grids[r]."""
        made = np.empty(len(self.y))
        for b in self.blocks:
            x = rows[b.run][:, columns[b.connector]]
            sensor = (sensors or {}).get(b.connector)
            if b.moment is not None:
                made[b.place] = b.moment.read(grids[b.run], x)
            elif sensor is None:
                made[b.place] = np.interp(b.t, grids[b.run], x)
            else:
                made[b.place] = sensor.read(grids[b.run], x, b.t)
        return made

    def whiten(self, model: np.ndarray) -> np.ndarray:
        """Readings minus a long vector, in floors."""
        return (self.y - model) / self.floor

    def shared(self, residual: np.ndarray) -> float:
        """Energy per reading, in floors squared, that a residual (n,) shares from one reading to the next.

        Noise shares none, however large its floor was taken; what a model leaves unexplained is slower than the
        samples, or swings with them. Zero to within 1/sqrt(n) if only noise is left. Of readings that stand alone it is
        what they have beyond the floor; and a channel whose noise is stated has no more than that either: what repeats
        from reading to reading but not from test to test is part of such a noise.
        """
        total = 0.0
        channels: dict[int, np.ndarray] = {}
        for b in self.blocks:
            x = residual[b.place]
            beyond = float(x @ x) - len(x)
            if b.moment is not None:
                total += beyond
            elif b.stated:
                channels.setdefault(b.channel, np.zeros(2))[:] += _with_neighbours(x), beyond
            else:
                total += _with_neighbours(x)
        for energy, beyond in channels.values():
            total += min(energy, max(0.0, beyond))
        return float(total) / len(self)

    def of_run(self, run: int) -> dict[str, Block]:
        """The time series of a run by connector."""
        return {b.connector: b for b in self.series if b.run == run}

    def slope(self, model: np.ndarray) -> np.ndarray:
        """Rate of change [unit/s] of a long vector along each block."""
        made = np.zeros(len(self.y))
        for b in self.blocks:
            if b.moment is None:
                made[b.place] = np.gradient(model[b.place], b.t)
        return made

    def mend(self, model: np.ndarray) -> None:
        """Take out of estimated floors what the same estimate makes of the model, which has no noise."""
        made = []
        for b in self.blocks:
            rough = noise_std(model[b.place]) if not b.stated else 0.0
            made.append(replace(b, floor=float(max(np.sqrt(max(b.floor**2 - rough**2, 0.0)), 0.2 * b.floor))))
        self.blocks = made

    def widen(self, model: np.ndarray, numerical: np.ndarray) -> None:
        """Take timing jitter on the model's slopes and the model's numerical error into the floor."""
        self.mend(model)
        slope = self.slope(model)
        for b in self.blocks:
            rough = np.sqrt(_smooth(slope[b.place] ** 2, b.t, 0.05))
            error = np.sqrt(_smooth(numerical[b.place] ** 2, b.t, 0.05))
            self.floor[b.place] = np.sqrt(b.floor**2 + (JITTER * b.interval * rough) ** 2 + error**2)


def _with_neighbours(x: np.ndarray) -> float:
    """Energy that samples (n,) share with the next one, or with the second next where they swing too fast for that."""
    first, second = float(x[1:] @ x[:-1]), float(abs(x[2:] @ x[:-2]))
    return second if second > first + SWINGS * np.sqrt(len(x)) else first


def _smooth(x: np.ndarray, t: np.ndarray, width: float) -> np.ndarray:
    """Running mean of x over +-width [s]."""
    total = np.concatenate([[0.0], np.cumsum(x)])
    low, high = np.searchsorted(t, t - width), np.searchsorted(t, t + width, side="right")
    return np.maximum((total[high] - total[low]) / (high - low), 0.0)


def thin(t: np.ndarray, y: np.ndarray, most: int = MOST) -> tuple[np.ndarray, np.ndarray, int]:
    """Times and readings averaged over m neighbours so that at most `most` are left; and m."""
    m = -(-len(t) // most)
    if m == 1:
        return t, y, 1
    n = len(t) // m * m
    return t[:n].reshape(-1, m).mean(1), y[:n].reshape(-1, m).mean(1), m


def gather(blocks: list[tuple[int, int, str, np.ndarray, np.ndarray, float, Moment | None, bool]]) -> Observations:
    """Observations from (run, channel, connector, times, readings, floor, moment, stated) of every block."""
    made, place = [], 0
    for run, channel, connector, t, y, floor, moment, stated in blocks:
        made.append(Block(run, channel, connector, t, y, floor, slice(place, place + len(t)), moment, stated))
        place += len(t)
    channels = 1 + max(b.channel for b in made)
    span, level = np.zeros(channels), np.zeros(channels)
    for c in range(channels):
        parts = [b.y for b in made if b.channel == c and b.moment is None]
        if parts:
            span[c] = max(np.max([p.max() for p in parts]) - np.min([p.min() for p in parts]), 1e-300)
            level[c] = max(float(np.abs(p).max()) for p in parts)
    return Observations(
        made,
        np.concatenate([b.y for b in made]),
        np.concatenate([np.full(len(b.t), b.floor) for b in made]),
        np.concatenate([np.full(len(b.t), b.run) for b in made]),
        np.concatenate([np.full(len(b.t), b.channel) for b in made]),
        np.concatenate([b.t for b in made]),
        span,
        level,
    )
