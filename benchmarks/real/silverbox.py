"""Runs of the Silverbox: two of its multisines, from rest, and two parts of the record of growing amplitude.

Both voltages are read from zero, that is less their readings in a pause. The driving voltage is band-limited to 200 Hz
and sampled at 610 Hz, so it can be interpolated to four times that rate, at which the model is stepped.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FILE = "silverbox_SNLS80mV.csv.gz"
RATE = 610.35
"""Samples a second."""

FINER = 4
PAUSE = slice(40500, 40580)
"""Samples of a pause, where both voltages rest."""

STRETCHES = {
    "multisine_1": (49240, 1000, "fit"),
    "growing_middle": (20000, 1000, "fit"),
    "multisine_5": (83990, 1000, "holdout"),
    "growing_end": (39000, 1000, "holdout"),
}
"""First sample, length and use of the runs; the last holds the largest amplitude."""

UNKNOWN = 120
"""Samples (four time constants) that a run needs to forget that its start is known only roughly."""


def _finer(u: np.ndarray, begin: int, count: int) -> np.ndarray:
    """u from sample `begin` on, FINER values a sample, by sinc interpolation under a Kaiser window of +-40 samples."""
    half = 40
    taps = np.arange(-half * FINER, half * FINER + 1) / FINER
    kernel = np.sinc(taps) * np.kaiser(len(taps), 8.0)
    padded = np.pad(u, half, mode="edge")[begin : begin + count + 2 * half]
    spread = np.zeros(len(padded) * FINER)
    spread[::FINER] = padded
    return np.convolve(spread, kernel, "same")[half * FINER : (half + count) * FINER]


def _noise(y: np.ndarray) -> float:
    """Standard deviation of white noise from what lies above 250 Hz, where nothing drives the box."""
    spectrum = np.fft.rfft(y * np.blackman(len(y))) / np.sqrt(np.sum(np.blackman(len(y)) ** 2))
    return float(np.sqrt(np.median(np.abs(spectrum[np.fft.rfftfreq(len(y), 1.0 / RATE) > 255.0]) ** 2) / np.log(2.0)))


def measured(folder: Path) -> Measured:
    """The runs in the data folder."""
    with gzip.open(folder / FILE, "rt") as file:
        u, y = np.genfromtxt(file, delimiter=",", skip_header=1, usecols=(0, 1)).T
    u, y = u - u[PAUSE].mean(), y - y[PAUSE.stop - 20 : PAUSE.stop].mean()
    runs = []
    for name, (begin, count, use) in STRETCHES.items():
        reading = np.full(count * FINER, np.nan)
        reading[::FINER] = y[begin : begin + count]
        reading[: UNKNOWN * FINER] = np.nan
        time = np.arange(count * FINER) / (RATE * FINER)
        columns = {"time": time, "u": _finer(u, begin, count), "y": reading}
        rate = (8.0 * (y[begin + 1] - y[begin - 1]) - (y[begin + 2] - y[begin - 2])) / 12.0 * RATE
        runs.append(Run(name, columns, {"box.y0": float(y[begin]), "box.v0": float(rate)}, use))
    begin, count, _ = STRETCHES["growing_end"]
    noise = _noise(y[begin : begin + count])
    channels = (Channel("u", "box.u", "V", "input"), Channel("y", "box.y", "V", noise_std=noise))
    return Measured("silverbox", "box", 1.0 / (RATE * FINER), channels, runs)
