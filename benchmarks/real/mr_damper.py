"""Runs of a magnetorheological damper with 1 A, moved to and fro by 1.6 mm at 5.1 Hz.

Position and speed are measured and drive the model; the force that this takes is compared. The record is one of 2.25 s.
It is cut where the damper turns round, into its start with shorter strokes, which is learned from, runs of two whole
periods, which are learned from and held out by turns, and its end, in which the motion dies away and which is held out.
What is before the first turn of each run, half a period or so, drives the model and is not compared: what the fluid has
been through before is not known.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FILE = "mr_damper/2mm5Hz1A.txt"
PERIODS = 2
"""Whole periods in a run."""

STEADY = (0.19, 2.0)
"""Between these times in the record the motion is steady [s]."""

HARMONICS = 21
"""Of the force over the motion's phase: with more of them nothing more is explained."""


def _turns(t: np.ndarray, v: np.ndarray) -> list[int]:
    """First samples after the damper has turned round at its innermost position, up to the end of the steady motion."""
    turns = np.flatnonzero((v[:-1] < 0.0) & (v[1:] >= 0.0)) + 1
    return [int(k) for k in turns if t[k] < STEADY[1]]


def _run(columns: np.ndarray, begin: int, end: int, name: str, use: str) -> Run:
    t, x, v, force = columns[:, begin:end]
    turned = np.logical_or.accumulate(v * v[0] < 0.0)
    counted = np.where(turned, force, np.nan)
    return Run(name, {"time": t - t[0], "x": x, "v": v, "F": counted}, {}, use)


def _scatter(t: np.ndarray, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> float:
    """What the force differs by from period to period at the same phase [N], standard deviation."""
    steady = (t > STEADY[0] + 0.2) & (t < STEADY[1])
    phase = np.arctan2(v / np.std(v[steady]), x / np.std(x[steady]))[steady]
    waves = [f(n * phase) for n in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]
    basis = np.column_stack([np.ones_like(phase), *waves])
    rest = force[steady] - basis @ np.linalg.lstsq(basis, force[steady], rcond=None)[0]
    return float(np.sqrt(np.sum(rest**2) / (basis.shape[0] - basis.shape[1])))


def measured(folder: Path) -> Measured:
    """The runs in the data folder."""
    columns = np.loadtxt(folder / FILE).T
    first, *turns = _turns(columns[0], columns[2])
    cuts = turns[::PERIODS]
    half = (turns[1] - turns[0]) // 2
    runs = [_run(columns, first, turns[0] + 1, "start", "fit")]
    for k, (begin, end) in enumerate(pairwise(cuts)):
        name = f"periods_{PERIODS * k + 1}_to_{PERIODS * (k + 1)}"
        runs.append(_run(columns, begin - half, end + 1, name, ("fit", "holdout")[k % 2]))
    runs.append(_run(columns, cuts[-1] - half, columns.shape[1], "end", "holdout"))
    channels = (
        Channel("x", "damper.x", "mm", "input"), Channel("v", "damper.v", "mm/s", "input"),
        Channel("F", "damper.F", "N", noise_std=_scatter(*columns)),
    )  # fmt: skip
    return Measured("mr_damper", "damper", 1e-3, channels, runs)
