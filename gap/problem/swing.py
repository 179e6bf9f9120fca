"""What does not depend on phase of a signal that swings by itself: its trend, its amplitude, its frequency.

Two machines that swing alike do not stay in step, so the difference of their samples says nothing: it is as large for
the right model as for none. The trend is a local straight line with the weights of a Hann window; the rest is what
swings. All that is linear in the samples is so in the measured and in the model's alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..settings import SwingSettings

COURSE, AMPLITUDE, FREQUENCY = "trend", "amplitude", "frequency"


@dataclass(frozen=True, eq=False)
class Swing:
    """A stretch of time in which a signal swings: its samples' times (n,) and those at which it is described (m,)."""

    t: np.ndarray
    at: np.ndarray
    """Spaced by half a window [s]."""
    window: float
    """Full width of the trend's window [s]."""
    noise_std: np.ndarray
    """Of the samples (n,)."""
    frequency: float | None
    """As measured [1/s]; None of a signal that shows several."""
    settings: SwingSettings

    @property
    def quantities(self) -> tuple[str, ...]:
        """What describes it."""
        return (COURSE, AMPLITUDE) if self.frequency is None else (COURSE, AMPLITUDE, FREQUENCY)

    @cached_property
    def _course(self) -> csr_array:
        return local_lines(self.t, self.t, self.window)

    @cached_property
    def _whole(self) -> slice:
        """The samples whose window is whole, if those are half of them: at a record's ends a line turns the phase."""
        half = 0.5 * self.window
        start, end = np.searchsorted(self.t, [self.t[0] + half, self.t[-1] - half])
        return slice(int(start), int(end)) if 2 * (end - start) >= len(self.t) else slice(None)

    @cached_property
    def course_weights(self) -> csr_array:
        """The trend at the description's times from the samples (m, n)."""
        return local_lines(self.t, self.at, self.window)

    @cached_property
    def energy_weights(self) -> csr_array:
        """Weights (m, n) of the rest's squares, which add up to 1."""
        return hann_means(self.t, self.at, self.window)

    @cached_property
    def least_energy(self) -> float:
        """Squared amplitude of what stands out of the noise."""
        return float(np.mean(self.noise_std**2)) * self.settings.envelope_from**2

    def oscillation(self, x: np.ndarray) -> np.ndarray:
        """What swings (n,) of samples (n,)."""
        oscillation: np.ndarray = x - self._course @ x
        return oscillation

    @cached_property
    def noise_energy(self) -> np.ndarray:
        """Mean square of the rest of pure noise (m,), times two: squared amplitude that it looks like."""
        gain = 1.0 - 2.0 * self._course.diagonal() + (self._course**2).sum(axis=1)
        energy: np.ndarray = 2.0 * self.energy_weights @ (self.noise_std**2 * gain)
        return energy

    def trend(self, x: np.ndarray) -> np.ndarray:
        """Around which the samples (n,) swing (m,)."""
        trend: np.ndarray = self.course_weights @ x
        return trend

    def amplitude(self, x: np.ndarray, noisy: bool) -> np.ndarray:
        """Logarithm of the amplitude (m,) with the noise's part, which samples of a model are given."""
        energy = 2.0 * (self.energy_weights @ self.oscillation(x) ** 2)
        log_amplitude: np.ndarray = 0.5 * np.log(energy + (0.0 if noisy else self.noise_energy))
        return log_amplitude

    def log_frequency(self, x: np.ndarray) -> float:
        """Logarithm of the frequency; that of what swings less than noise is as good as any: the measured one."""
        assert self.frequency is not None
        oscillation = self.oscillation(x)
        frequency = crossing_frequency(self.t[self._whole], oscillation[self._whole], self.settings.crossing)
        if frequency is None:
            return float(np.log(self.frequency))
        energy = 2.0 * float(np.mean(oscillation**2))
        share = energy / (energy + self.least_energy)
        return float(share * np.log(frequency) + (1.0 - share) * np.log(self.frequency))

    def noise_of(self, quantity: str, y: np.ndarray) -> np.ndarray:
        """Standard deviation (m,), or one for the frequency, of what readings y (n,) say of a quantity.

        The noise of samples passed on, and what no model's form promises (settings).
        """
        settings, variance = self.settings, self.noise_std**2
        squared = np.maximum(np.exp(2.0 * self.amplitude(y, True)) - self.noise_energy, 1e-300)
        if quantity == COURSE:
            passed = self.course_weights**2 @ variance
            return np.asarray(np.sqrt(passed + settings.trend_error**2 * squared))
        if quantity == AMPLITUDE:
            weight = self.energy_weights**2
            spread = weight @ (2.0 * variance**2) + (weight @ (2.0 * variance)) * squared
            return np.asarray(np.hypot(np.sqrt(spread) / (squared + self.noise_energy), settings.envelope_error))
        assert self.frequency is not None
        duration = float(self.t[-1] - self.t[0])
        usual = float(np.sqrt(np.mean(variance) / np.mean(squared)))
        timing = np.sqrt(2.0) * usual / (2.0 * np.pi * self.frequency * duration)
        return np.array([np.hypot(timing, settings.frequency_error)])


@dataclass(frozen=True, eq=False)
class SwingFeature:
    """One quantity of a swing: what a block compares instead of samples."""

    swing: Swing
    quantity: str
    """trend [unit of the channel], amplitude (its logarithm), frequency (its logarithm)."""

    @property
    def takes_bias(self) -> bool:
        """Whether a bias of the sensor moves it as it does samples."""
        return self.quantity == COURSE

    @property
    def at(self) -> np.ndarray:
        """Times at which it is read [s]."""
        at = self.swing.at
        return at if self.quantity != FREQUENCY else np.array([0.5 * (at[0] + at[-1])])

    def observe(self, x: np.ndarray, noisy: bool = False) -> np.ndarray:
        """The quantity of samples at the swing's times (n,); noisy: measured ones."""
        if self.quantity == COURSE:
            return self.swing.trend(x)
        if self.quantity == AMPLITUDE:
            return self.swing.amplitude(x, noisy)
        return np.array([self.swing.log_frequency(x)])


def hann_means(t: np.ndarray, at: np.ndarray, window: float) -> csr_array:
    """Weights (m, n) of a Hann window of full width `window` around each time of `at` (m,) on samples at t (n,)."""
    return _weights(t, at, window, lines=False)


def local_lines(t: np.ndarray, at: np.ndarray, window: float) -> csr_array:
    """Weights (m, n) that give the value there of a straight line through the samples in the window: at the ends of
    the record, too, where a mean would lag behind."""
    return _weights(t, at, window, lines=True)


def _weights(t: np.ndarray, at: np.ndarray, window: float, lines: bool) -> csr_array:
    half = 0.5 * window
    low, high = np.searchsorted(t, at - half), np.searchsorted(t, at + half, side="right")
    lengths, ends = high - low, np.concatenate([[0], np.cumsum(high - low)])
    row = np.repeat(np.arange(len(at)), lengths)
    columns = np.arange(ends[-1]) + (low - ends[:-1])[row]
    d = t[columns] - at[row]
    w = 0.5 + 0.5 * np.cos(np.pi * d / half) + 1e-12
    s0, s1, s2 = (np.bincount(row, w * d**k, len(at)) for k in range(3))
    level, slope = np.where(lines & (lengths > 2), (s2, s1), ([1.0], [0.0]))
    w *= (level[row] - slope[row] * d) / (s0 * level - s1 * slope)[row]
    return csr_array((w, columns, ends), shape=(len(at), len(t)))


def crossing_frequency(t: np.ndarray, oscillation: np.ndarray, share: float) -> float | None:
    """Frequency [1/s] from the first to the last zero crossing of what swings (n,), between which it reaches a share
    of its RMS; None where it has less than three."""
    level = share * float(np.sqrt(np.mean(oscillation**2)))
    clear = np.flatnonzero(np.abs(oscillation) > level)
    turned = np.flatnonzero(np.diff(np.sign(oscillation[clear])) != 0.0)
    if len(turned) < 3:
        return None
    crossings = [_crossing(t, oscillation, clear[k], clear[k + 1]) for k in (turned[0], turned[-1])]
    return float((len(turned) - 1) / (2.0 * max(crossings[1] - crossings[0], 1e-300)))


def _crossing(t: np.ndarray, x: np.ndarray, a: int, b: int) -> float:
    """Time at which x changes its sign last between two samples of unlike sign."""
    k = a + int(np.flatnonzero(np.sign(x[a:b]) != np.sign(x[b]))[-1])
    return float(t[k] + (t[k + 1] - t[k]) * x[k] / (x[k] - x[k + 1]))
