"""How alike two signals are in shape, whatever their units: correlation, size, and how much one is late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Likeness:
    """Of readings and a model's signal."""

    correlation: float
    """-1 to 1; 0 where one of both rests."""
    ratio: float
    """Standard deviation of the readings over that of the model; 0 or inf where one of both rests."""
    shift: float
    """By how much the readings would be late [s] where they are most alike, or most opposite."""
    shifted: float
    """Correlation then."""


@dataclass(frozen=True, eq=False)
class Signal:
    """Times (n,) [s] and values (n,)."""

    t: FloatArray
    y: FloatArray


def compare(read: Signal, model: Signal, points: int, longest_shift: float) -> Likeness:
    """Readings against a model's signal, at so many points; shifts up to that share of the common time are tried."""
    begin, end = max(read.t[0], model.t[0]), min(read.t[-1], model.t[-1])
    if not end > begin:
        return Likeness(0.0, 0.0, 0.0, 0.0)
    grid = np.linspace(begin, end, points)
    a, b = np.interp(grid, read.t, read.y), np.interp(grid, model.t, model.y)
    spread_a, spread_b = float(a.std()), float(b.std())
    tiny = 1e-12 * max(float(np.abs(b).max()), 1e-300)
    if spread_a <= 1e-12 * max(float(np.abs(a).max()), 1e-300) or spread_b <= tiny:
        return Likeness(0.0, spread_a / spread_b if spread_b > tiny else float("inf"), 0.0, 0.0)
    plain = correlation(a, b)
    most = int(longest_shift * points)
    k = _shift(a, b, most)
    shifted = _at(a, b, k)
    while better := [n for n in (k - 1, k + 1) if abs(n) <= most and abs(_at(a, b, n)) > abs(shifted)]:
        k, shifted = better[0], _at(a, b, better[0])
    if abs(shifted) <= abs(plain):
        k, shifted = 0, plain
    return Likeness(plain, spread_a / spread_b, k * (end - begin) / (points - 1), shifted)


def _at(a: FloatArray, b: FloatArray, k: int) -> float:
    """Correlation of a (n,) with b (n,) where a is k points late, over what both have."""
    n = len(a)
    return correlation(a[max(k, 0) : n + min(k, 0)], b[max(-k, 0) : n - max(k, 0)])


def correlation(a: FloatArray, b: FloatArray) -> float:
    """Of two signals (n,); 0 where one of them rests."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _shift(a: FloatArray, b: FloatArray, most: int) -> int:
    """Points by which a (n,) is late where it is most like b (n,), or most opposite to it."""
    n = len(a)
    spectrum = np.fft.rfft(a - a.mean(), 2 * n) * np.conj(np.fft.rfft(b - b.mean(), 2 * n))
    product = np.fft.irfft(spectrum, 2 * n)
    lags = np.r_[np.arange(most + 1), np.arange(-most, 0)]
    return int(lags[np.argmax(np.abs(product[lags]))])
