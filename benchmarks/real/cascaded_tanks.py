"""The two records of the cascaded tanks, as the benchmark has them: one to fit, one to hold out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FILE = "cascaded_tanks.csv"
STEP = 4.0
"""Sampling time [s]; the pump's voltage is held over it."""


def _run(name: str, u: np.ndarray, y: np.ndarray, use: str) -> Run:
    """Each voltage twice, at the start and just before the end of its step: straight lines then make stairs."""
    begin = np.arange(len(u)) * STEP
    time = np.column_stack([begin, begin + 0.999 * STEP]).ravel()[:-1]
    level = np.column_stack([y, np.full(len(y), np.nan)]).ravel()[:-1]
    return Run(name, {"time": time, "u": np.repeat(u, 2)[:-1], "y": level}, {}, use)


def measured(folder: Path) -> Measured:
    """The runs in the data folder."""
    u1, u2, y1, y2 = np.genfromtxt(folder / FILE, delimiter=",", skip_header=1, usecols=(0, 1, 2, 3)).T
    runs = (_run("estimation", u1, y1, "fit"), _run("validation", u2, y2, "holdout"))
    channels = (Channel("u", "tanks.u", "V", "input"), Channel("y", "tanks.y", "V"))
    return Measured("cascaded_tanks", "tanks", STEP, channels, runs)
