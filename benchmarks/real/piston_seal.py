"""Runs of the pneumatic piston with an O-ring: four pressures, five tests each, about two strokes to and fro of each.

The position (smoothed) and the pressure are measured and drive the model. Friction is the measured force less area
times pressure, counted from the middle between the strokes in and out (the load cell's zero moves by 1.5 N from test to
test), in the middle of the stroke, away from the reversals. Of the records with other names for the same test only one
is used: rep_reconnected_1 equals the first test, and rep_rerun_2 equals rep_reconnected_2.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FILE = "piston_seal_friction.npz"
TESTS = {
    "": "fit",
    "rep_reconnected_2_": "fit",
    "rep_rerun_1_": "fit",
    "rep_reconnected_3_": "holdout",
    "rep_rerun_3_": "holdout",
}
BEGIN, LENGTH, RATE = 1.0, 16.0, 25.0
"""Of a run in its record [s], and samples a second."""

MIDDLE = (5.0, 30.0)
"""Where friction counts [mm]."""

AREA = 51.87
"""Of a bore of 25.7 mm [N/bar]."""


def _mean(t: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Means over +-1/RATE around the times `at`."""
    fine = np.arange(at[0] - 1.0 / RATE, at[-1] + 1.0 / RATE + 1e-9, 0.25 / RATE)
    return np.convolve(np.interp(fine, t, values), np.full(9, 1.0 / 9.0), "valid")[::4]


def _run(record: np.ndarray, name: str, use: str) -> Run:
    record = record[1:].astype(float)  # the first row is the last one of another test
    t = record[:, 0] / 1e3
    at = BEGIN + np.arange(round(LENGTH * RATE) + 1) / RATE
    x, p, force = (_mean(t, record[:, k], at) for k in (4, 5, 6))
    counts = (x > MIDDLE[0]) & (x < MIDDLE[1])
    counts[0] = False  # the direction is not known yet
    friction = np.where(counts, force - AREA * p, np.nan)
    friction -= np.mean(_levels(x, friction))
    return Run(name, {"time": at - BEGIN, "x": x, "p": p, "F": friction}, {}, use)


def _levels(x: np.ndarray, friction: np.ndarray) -> tuple[float, float]:
    """Mean friction going in and coming out [N]."""
    way = np.gradient(x) > 0.0
    return float(np.nanmean(friction[way])), float(np.nanmean(friction[~way]))


def measured(folder: Path) -> Measured:
    """The runs in the data folder. Noise is what the mean friction differs by from test to test at equal pressure."""
    runs, variances = [], []
    with np.load(folder / FILE) as data:
        for bar in (1, 3, 5, 7):
            same = [
                _run(data[f"{test}O-ring257_{bar}bar"], f"{bar}bar_{test.removeprefix('rep_') or 'first_'}"[:-1], use)
                for test, use in TESTS.items()
            ]
            levels = [_levels(run.columns["x"], run.columns["F"])[0] for run in same]
            variances.append(np.var(levels, ddof=1))
            runs += same
    channels = (
        Channel("x", "piston.x", "mm", "input"),
        Channel("p", "piston.p", "bar", "input"),
        Channel("F", "piston.F", "N", noise_std=float(np.sqrt(np.mean(variances)))),
    )
    return Measured("piston_seal", "piston", 0.02, channels, runs)
