"""The measurements of a campaign stacked into one vector, and what the model predicts of each.

Entries are grouped in blocks, one per run and channel. Everything is in the unit of the FMU's variable; residuals are
divided by the noise of each entry, so they are dimensionless: normalised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..settings import NoiseSettings
from .noise import estimate_noise_std
from .sensors import Sensor
from .swing import SwingFeature


@dataclass(frozen=True)
class EventObservation:
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

    def observe(self, t: np.ndarray, x: np.ndarray) -> float:
        """The duration [s] in the signal x (n,) at times t (n,), between samples by a straight line.

        A signal that does not arrive is continued with its mean speed until then, at least a twentieth of the way long.
        """
        end = max(2, int(np.searchsorted(t, self.until, side="right")))
        t, x = t[:end], x[:end]
        distance = np.abs(x - self.target) - self.within
        start = int(np.searchsorted(t, self.after))
        outside = distance[start:] > 0.0
        if self.first and not outside.all():
            outside[int(np.argmin(outside)) :] = False
        if not outside.any():
            duration = 0.0
        else:
            k = start + int(np.flatnonzero(outside)[-1])
            if k + 1 < len(t):
                duration = t[k] + (t[k + 1] - t[k]) * distance[k] / (distance[k] - distance[k + 1]) - self.after
            else:
                path = max(abs(x[-1] - x[start]), 0.05 * abs(x[start] - self.target), 1e-12)
                duration = (t[-1] - self.after) * (1.0 + distance[-1] / path)
        return float(min(max(duration, self.low), self.high))


@dataclass(frozen=True, eq=False)
class Block:
    """The samples of one channel in one run: times [s], readings, noise, and their place in that vector.

    With an `event` it is a single reading: a duration. With a `feature` its readings describe a swing.
    """

    run: int
    channel: int
    connector: str
    t: np.ndarray
    y: np.ndarray
    noise_std: float
    place: slice
    event: EventObservation | None = None
    stated: bool = True
    """The noise is what the campaign says, not what was estimated."""
    clock_jitter: float | None = None
    """Standard deviation of the readings' times [s]; None: the usual share of a sample interval."""
    feature: SwingFeature | None = None
    members: np.ndarray | None = None
    """Times [s] (n, m) of the samples that each reading, or sample of a swing, is the mean of; None: of one, at `t`."""

    def observe(self, grid: np.ndarray, x: np.ndarray, sensor: Sensor | None = None) -> np.ndarray:
        """What the samples (n,) would be if the signal were x (k,) at the increasing times `grid`: averaged as they
        are, for a mean over a spike is not what the signal is in the middle."""
        t = self.t if self.feature is None else self.feature.swing.t
        at = t[:, None] if self.members is None else self.members
        flat = np.interp(at.ravel(), grid, x) if sensor is None else sensor.observe(grid, x, at.ravel())
        readings: np.ndarray = flat.reshape(at.shape).mean(1)
        return readings

    @property
    def last_sample(self) -> np.ndarray:
        """Times [s] (n,) of the latest sample of each reading of a signal."""
        return self.t if self.members is None else self.members[:, -1]

    @property
    def is_series(self) -> bool:
        """Whether it is samples of a signal."""
        return self.event is None and self.feature is None

    @property
    def takes_bias(self) -> bool:
        """Whether a bias of its channel's sensor is added to its readings."""
        return self.feature is None or self.feature.takes_bias

    @property
    def interval(self) -> float:
        """Time between samples [s]."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else 0.0


@dataclass(frozen=True, eq=False)
class Observations:
    """All blocks, readings and noise of all entries (n,), and which run, channel and time each entry has."""

    blocks: tuple[Block, ...]
    y: np.ndarray
    noise_std: np.ndarray
    run: np.ndarray
    channel: np.ndarray
    time: np.ndarray
    span: np.ndarray
    """Largest minus smallest reading of each channel over all runs."""
    level: np.ndarray
    """Largest magnitude of a reading of each channel."""
    middle: np.ndarray
    """Middle between largest and smallest reading of each channel over all runs."""
    settings: NoiseSettings = field(default_factory=NoiseSettings)

    @property
    def series(self) -> list[Block]:
        """The blocks that are time series."""
        return [b for b in self.blocks if b.is_series]

    @cached_property
    def takes_bias(self) -> np.ndarray:
        """Which readings (n,) a bias of their channel's sensor is added to: not amplitude and frequency of a swing."""
        return np.concatenate([np.full(len(b.t), b.takes_bias) for b in self.blocks])

    def __len__(self) -> int:
        return len(self.y)

    def observe(
        self,
        grids: Sequence[np.ndarray],
        rows: Sequence[np.ndarray],
        columns: Mapping[str, int],
        sensors: Mapping[str, Sensor] | None = None,
    ) -> np.ndarray:
        """What the channels read when run r gives the signals rows[r] (n, signals) at the times grids[r]."""
        readings = np.empty(len(self.y))
        for b in self.blocks:
            x = rows[b.run][:, columns[b.connector]]
            sensor = (sensors or {}).get(b.connector)
            if b.event is not None:
                readings[b.place] = b.event.observe(grids[b.run], x)
                continue
            read = b.observe(grids[b.run], x, sensor)
            readings[b.place] = read if b.feature is None else b.feature.observe(read)
        return readings

    def whiten(self, model: np.ndarray) -> np.ndarray:
        """Readings minus a prediction of all of them (n,), divided by the noise: the normalised residual (n,)."""
        residual: np.ndarray = (self.y - model) / self.noise_std
        return residual

    def structured_energy(self, residual: np.ndarray) -> float:
        """Energy per reading that a normalised residual (n,) shares from one reading to the next.

        Noise shares none, however large it was taken; what a model leaves unexplained is slower than the
        samples, or swings with them. Zero to within 1/sqrt(n) if only noise is left. Of readings that stand alone it is
        what they have beyond the noise; and a channel whose noise is stated has no more than that either: what repeats
        from reading to reading but not from test to test is part of such a noise.
        """
        total = 0.0
        channels: dict[int, np.ndarray] = {}
        for b in self.blocks:
            x = residual[b.place]
            beyond = float(x @ x) - len(x)
            if not b.is_series:
                total += beyond
            elif b.stated:
                channels.setdefault(b.channel, np.zeros(2))[:] += (
                    _lagged_products(x, self.settings.swing_evidence),
                    beyond,
                )
            else:
                total += _lagged_products(x, self.settings.swing_evidence)
        for energy, beyond in channels.values():
            total += min(energy, max(0.0, beyond))
        return float(total) / len(self)

    def middle_of(self, connector: str) -> float:
        """Middle between a channel's largest and smallest reading in any run."""
        return next((float(self.middle[b.channel]) for b in self.blocks if b.connector == connector), 0.0)

    def is_constant(self, channel: int, share: float) -> bool:
        """Whether a channel's readings differ by a share of the largest at most; moments alone say nothing of that."""
        return bool(0.0 < self.span[channel] <= max(1e-300, share * self.level[channel]))

    def of_run(self, run: int) -> dict[str, Block]:
        """The time series of a run by connector."""
        return {b.connector: b for b in self.series if b.run == run}

    def entries(self, runs: Sequence[int]) -> np.ndarray:
        """Where the readings of some runs stand among all readings (m,)."""
        places: np.ndarray = np.flatnonzero(np.isin(self.run, runs))
        return places

    def of_runs(self, runs: Sequence[int]) -> Observations:
        """Those of some runs, which are counted anew in that order; a channel's span and level stay those of all."""
        number = {r: k for k, r in enumerate(runs)}
        blocks, end = [], 0
        for b in (b for b in self.blocks if b.run in number):
            begin, end = end, end + b.place.stop - b.place.start
            blocks.append(replace(b, run=number[b.run], place=slice(begin, end)))
        at = self.entries(runs)
        return replace(
            self, blocks=tuple(blocks), y=self.y[at], noise_std=self.noise_std[at], channel=self.channel[at],
            time=self.time[at], run=np.array([number[r] for r in self.run[at]], dtype=int),
        )  # fmt: skip

    def until(self, end: float) -> Observations:
        """The samples of signals that were taken until then [s], without moments and swings."""
        blocks, kept, count = [], [], 0
        for b in self.series:
            at = np.flatnonzero(b.last_sample <= end)
            if at.size:
                place, count = slice(count, count + at.size), count + at.size
                members = None if b.members is None else b.members[at]
                blocks.append(replace(b, t=b.t[at], y=b.y[at], members=members, place=place))
                kept.append(b.place.start + at)
        entries = np.concatenate(kept) if kept else np.zeros(0, dtype=int)
        return replace(
            self, blocks=tuple(blocks), y=self.y[entries], noise_std=self.noise_std[entries], run=self.run[entries],
            channel=self.channel[entries], time=self.time[entries],
        )  # fmt: skip

    def stretches(self, width: float) -> np.ndarray:
        """The stretch of time of a run, `width` [s] long, in which each reading lies (n,): 0, 1, ... without gaps."""
        per_run = int(self.time.max() / width) + 1
        place = (self.time / width).astype(int) + self.run * per_run
        return np.asarray(np.unique(place, return_inverse=True)[1])

    def slope(self, model: np.ndarray) -> np.ndarray:
        """Rate of change [unit/s] of a prediction along each block."""
        slopes = np.zeros(len(self.y))
        for b in self.blocks:
            if b.event is None and b.takes_bias and len(b.t) > 1:
                slopes[b.place] = np.gradient(model[b.place], b.t)
        return slopes

    def clock_jitter(self, block: Block) -> float:
        """Standard deviation of the times of a block's readings [s]: as stated, else a share of their interval."""
        return self.settings.clock_jitter * block.interval if block.clock_jitter is None else block.clock_jitter

    def with_numerical_error(self, model: np.ndarray, error: np.ndarray) -> Observations:
        """The same with a noise that has timing jitter on the model's slopes and the model's numerical error in it.

        model, error: (n,), in the unit of the readings.
        """
        observations, settings = self.without_model_roughness(model), self.settings
        slope, noise = observations.slope(model), observations.noise_std.copy()
        for b in observations.blocks:
            rough = np.sqrt(_smooth(slope[b.place] ** 2, b.t, settings.smoothing))
            numerical = np.sqrt(_smooth(error[b.place] ** 2, b.t, settings.smoothing))
            share = observations.step_error_share(b, error)
            numerical *= min(1.0, settings.step_error_share / max(share, 1e-300))
            jitter = self.clock_jitter(b) * rough
            noise[b.place] = np.sqrt(b.noise_std**2 + jitter**2 + numerical**2)
        return replace(observations, noise_std=noise)

    def step_error_share(self, block: Block, error: np.ndarray) -> float:
        """The macro step's error (n,) in a block over its noise: that which most readings have, for it may be large
        for a moment when a valve switches a step later."""
        settings = self.settings
        local = np.sqrt(_smooth(error[block.place] ** 2, block.t, settings.smoothing))
        return float(np.quantile(local, settings.step_error_quantile)) / block.noise_std

    def without_model_roughness(self, model: np.ndarray) -> Observations:
        """The same without, in estimated noise, what the same estimate makes of the model, which has no noise."""
        blocks = []
        for b in self.blocks:
            rough = estimate_noise_std(model[b.place], self.settings, b.t) if not b.stated else 0.0
            reduced = float(np.sqrt(max(b.noise_std**2 - rough**2, 0.0)))
            blocks.append(replace(b, noise_std=float(max(reduced, self.settings.least_share * b.noise_std))))
        return replace(self, blocks=tuple(blocks))


def _lagged_products(x: np.ndarray, evidence: float) -> float:
    """Energy that samples (n,) share with the next one, or with the second next where they swing too fast for that."""
    first, second = float(x[1:] @ x[:-1]), float(abs(x[2:] @ x[:-2]))
    return second if second > first + evidence * np.sqrt(len(x)) else first


def _smooth(x: np.ndarray, t: np.ndarray, width: float) -> np.ndarray:
    """Running mean of x over +-width [s]."""
    total = np.concatenate([[0.0], np.cumsum(x)])
    low, high = np.searchsorted(t, t - width), np.searchsorted(t, t + width, side="right")
    mean: np.ndarray = np.maximum((total[high] - total[low]) / (high - low), 0.0)
    return mean


def average_neighbours(t: np.ndarray, y: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Readings averaged over m neighbours so that at most `most` are left, (n,), and the times of these, (n, m)."""
    m = -(-len(t) // most)
    n = len(t) // m * m
    return t[:n].reshape(-1, m), y[:n].reshape(-1, m).mean(1)


class RawBlock(NamedTuple):
    """A block before it has its place among all readings: see `Block`."""

    run: int
    channel: int
    connector: str
    t: np.ndarray
    y: np.ndarray
    noise_std: float
    event: EventObservation | None
    stated: bool
    clock_jitter: float | None = None
    members: np.ndarray | None = None


def gather(blocks: Sequence[RawBlock], settings: NoiseSettings | None = None) -> Observations:
    """The observations of all blocks."""
    placed, place = [], 0
    for b in blocks:
        end = place + len(b.t)
        at = slice(place, end)
        placed.append(
            Block(
                b.run, b.channel, b.connector, b.t, b.y, b.noise_std, at, b.event, b.stated, b.clock_jitter,
                members=b.members,
            )
        )  # fmt: skip
        place = end
    channels = 1 + max(b.channel for b in placed)
    span, level, middle = np.zeros(channels), np.zeros(channels), np.zeros(channels)
    for c in range(channels):
        parts = [b.y for b in placed if b.channel == c and b.event is None]
        if parts:
            greatest, least = np.max([p.max() for p in parts]), np.min([p.min() for p in parts])
            span[c], middle[c] = max(greatest - least, 1e-300), 0.5 * (greatest + least)
            level[c] = max(float(np.abs(p).max()) for p in parts)
    return Observations(
        tuple(placed),
        np.concatenate([b.y for b in placed]),
        np.concatenate([np.full(len(b.t), b.noise_std) for b in placed]),
        np.concatenate([np.full(len(b.t), b.run) for b in placed]),
        np.concatenate([np.full(len(b.t), b.channel) for b in placed]),
        np.concatenate([b.t for b in placed]),
        span,
        level,
        middle,
        settings or NoiseSettings(),
    )
