"""What the sensors make of the plant's signals: channels with noise, bias, delay, quantisation and holes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .system import KEYS

Array = NDArray[np.float64]
DEG = np.pi / 180.0
BITS = 12
BIAS_SHARE = 5e-4
"""Standard deviation of every sensor's own bias, share of its range."""
DELAY_MOST = 1e-3
"""Greatest delay of the whole recording (s)."""
MISSING = 0.01
"""Share of samples that are missing."""


@dataclass(frozen=True)
class Kind:
    """A kind of sensor: column, SSP connector, unit, SI value of the unit, range and range of noise (SI)."""

    key: str
    connector: str
    unit: str
    factor: float
    span: float
    quiet: float
    loud: float


KINDS = (
    Kind("x_h", "arm.x_h", "mm", 1e-3, 0.25, 3e-5, 1e-4),
    Kind("v_h", "arm.v_h", "mm/s", 1e-3, 0.2, 3e-4, 1e-3),
    Kind("P1", "hydraulics.P1", "MPa", 1e6, 30e6, 1e4, 4e4),
    Kind("P2", "hydraulics.P2", "MPa", 1e6, 30e6, 1e4, 4e4),
    Kind("Pa", "hydraulics.Pa", "bar", 1e5, 30e6, 1e4, 4e4),
    Kind("Pb", "hydraulics.Pb", "bar", 1e5, 30e6, 1e4, 4e4),
    Kind("Pp", "hydraulics.Pp", "MPa", 1e6, 30e6, 1e4, 4e4),
    Kind("F_h", "hydraulics.F_h", "N", 1.0, 4e4, 30.0, 100.0),
    Kind("x_v", "hydraulics.x_v", "%", 0.01, 2.0, 1.5e-3, 2.5e-3),
    Kind("theta", "arm.theta", "deg", DEG, 120 * DEG, 0.015 * DEG, 0.03 * DEG),
)


@dataclass(frozen=True)
class Channel:
    """A measured channel of a case, with what is not told: noise and bias (SI), and errors that are an effect."""

    kind: Kind
    noise: float
    bias: float
    error: Mapping[str, float] = field(default_factory=dict)
    """bias (SI), scale, lag (s), its order (1 or 2), delay (s), its jitter (share), wave (SI) and wave_length (SI),
    drift (SI) after 20 s and drift_time (s), bow (SI) of half a wave over bow_span (SI) and bow_phase (rad)."""

    @property
    def step(self) -> float:
        """Quantum (SI)."""
        return self.kind.span / 2**BITS

    @property
    def std(self) -> float:
        """Standard deviation of noise and quantisation together (SI)."""
        return float(np.hypot(self.noise, self.step / np.sqrt(12.0)))


def draw_channels(rng: np.random.Generator) -> tuple[Channel, ...]:
    """The displacement always; in a quarter of the cases at most one more, else four channels or more."""
    poor = rng.random() < 0.25
    count = int(rng.integers(0, 2)) if poor else int(rng.integers(3, len(KINDS)))
    others = sorted(rng.choice(np.arange(1, len(KINDS)), count, replace=False))
    channels = []
    for k in [0, *others]:
        kind = KINDS[k]
        noise = float(np.exp(rng.uniform(np.log(kind.quiet), np.log(kind.loud))))
        channels.append(Channel(kind, noise, float(rng.normal(0.0, BIAS_SHARE * kind.span))))
    return tuple(channels)


def lagged(t: Array, x: Array, tau: float) -> Array:
    """y with tau y' + y = x, y(t_0) = x(t_0), on a uniform grid, x joined by straight lines."""
    h = t[1] - t[0]
    decay = np.exp(-h / tau)
    gain = tau / h * (1.0 - decay)
    y = np.empty_like(x)
    y[0] = x[0]
    for k in range(1, x.size):
        y[k] = decay * y[k - 1] + (gain - decay) * x[k - 1] + (1.0 - gain) * x[k]
    return y


def scatter(n: int) -> Array:
    """So many numbers, even between -1 and 1, in an order without a pattern; always the same (multiples of the golden
    ratio)."""
    return 2.0 * np.modf(0.5 * (np.sqrt(5.0) - 1.0) * np.arange(n) ** 2)[0] - 1.0


def ideal(channel: Channel, grid: Array, signals: Array, at: Array, delay: float = 0.0) -> Array:
    """Readings (SI) at the times `at` with the channel's error and the common delay (s), nothing random."""
    x = signals[:, KEYS.index(channel.kind.key)]
    e = channel.error
    if e.get("wave"):
        x = x + e["wave"] * np.sin(2.0 * np.pi * x / e["wave_length"])
    if e.get("bow"):
        x = x + e["bow"] * np.sin(np.pi * x / e["bow_span"] + e["bow_phase"])
    if e.get("lag"):
        if e.get("order", 1.0) == 2.0:
            x = lagged(grid, lagged(grid, x, 0.5 * e["lag"]), 0.5 * e["lag"])
        else:
            x = lagged(grid, x, e["lag"])
    late = e.get("delay", 0.0)
    if e.get("jitter"):
        late = late * (1.0 + e["jitter"] * scatter(at.size))
    y = e.get("scale", 1.0) * np.interp(at - delay - late, grid, x) + e.get("bias", 0.0)
    if e.get("drift"):  # towards a limit, as of a sensor that warms up
        y = y + e["drift"] * np.expm1(-at / e["drift_time"]) / np.expm1(-20.0 / e["drift_time"])
    return y


def measured(channel: Channel, reading: Array, rng: np.random.Generator) -> Array:
    """The reading (SI) as recorded: with noise and the sensor's own bias, quantised, some samples NaN."""
    y = reading + channel.bias + rng.normal(0.0, channel.noise, reading.size)
    y = channel.step * np.round(y / channel.step)
    return np.where(rng.random(reading.size) < MISSING, np.nan, y)
