"""Writes a sea state as stimuli: how the base of the arm heaves and pitches in irregular waves.

    python examples/sea_state/make.py sea.csv            # waves of 1 m, with their peak at 8 s
    cosim-master build/deepsea_3km.ssp --stimuli sea.csv --out results/at_sea

The waves have the spectrum of Bretschneider (ISSC), S(f) = 5/16 H^2 fp^4 f^-5 exp(-5/4 (fp/f)^4), and phases that a
seed gives. The base heaves as the surface does, and pitches by a share of the waves' slope. Both come up over the first
seconds, so that a run begins at rest; rates and accelerations are exact, not differences.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

GRAVITY = 9.81
COLUMNS = ("base.heave_rate", "base.heave_acceleration", "base.pitch", "base.pitch_rate", "base.pitch_acceleration")
WAVES = 200
"""Waves of different frequencies that make the sea, from half of its peak's frequency to four times that."""


def motion(
    t: np.ndarray, height: float, period: float, pitch: float, rise: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Heave [m] (n,) at the times t [s], and the arm's inputs (n, 5) in the order of `COLUMNS`.

    height: significant height [m]; period: of the spectrum's peak [s]; pitch: share of the waves' slope; rise: time in
    which the motion comes up [s].
    """
    edges = np.linspace(0.5 / period, 4.0 / period, WAVES + 1)
    f = 0.5 * (edges[1:] + edges[:-1])
    spectrum = 0.3125 * height**2 * period**-4 * f**-5 * np.exp(-1.25 * (period * f) ** -4)
    amplitude, w = np.sqrt(2.0 * spectrum * np.diff(edges)), 2.0 * np.pi * f
    angle = np.outer(t, w) + np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, WAVES)
    sine, cosine = np.sin(angle), np.cos(angle)
    slope = pitch * amplitude * w**2 / GRAVITY  # of waves on deep water, a quarter of a period behind
    heave = _risen(t, rise, cosine @ amplitude, -sine @ (amplitude * w), -cosine @ (amplitude * w**2))
    turn = _risen(t, rise, sine @ slope, cosine @ (slope * w), -sine @ (slope * w**2))
    return heave[0], np.column_stack([*heave[1:], *turn])


def _risen(
    t: np.ndarray, rise: float, y: np.ndarray, rate: np.ndarray, acceleration: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What y, its rate and second rate are when it comes up as s^3 (10 - 15 s + 6 s^2), s = t/rise."""
    s = np.clip(t / rise, 0.0, 1.0)
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    first, second = 30.0 * (s * (1.0 - s)) ** 2 / rise, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / rise**2
    return share * y, share * rate + first * y, share * acceleration + 2.0 * first * rate + second * y


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(description="write a sea state as stimuli of the arm's base")
    p.add_argument("file", type=Path, help="the table to be written (.csv)")
    p.add_argument("--component", default="arm", help="the arm's name in the package (default: arm)")
    p.add_argument("--height", type=float, default=1.0, metavar="M", help="significant height (default: 1)")
    p.add_argument("--period", type=float, default=8.0, metavar="S", help="period of the spectrum's peak (default: 8)")
    p.add_argument("--pitch", type=float, default=0.5, help="share of the waves' slope (default: 0.5)")
    p.add_argument("--rise", type=float, default=2.0, metavar="S", help="time in which it comes up (default: 2)")
    p.add_argument("--stop-time", type=float, default=22.0, metavar="S", help="end of the table (default: 22)")
    p.add_argument("--seed", type=int, default=1, help="of the waves' phases (default: 1)")
    o = p.parse_args(arguments)
    for name in ("period", "rise", "stop_time"):
        if not 0.0 < getattr(o, name) < np.inf:
            p.error(f"--{name.replace('_', '-')} = {getattr(o, name):g} s has to be above zero")
    if not (0.0 <= o.height < np.inf and np.isfinite(o.pitch)):
        p.error(f"--height = {o.height:g} m and --pitch = {o.pitch:g} have to be finite, the height not negative")
    t = np.linspace(0.0, o.stop_time, max(2, round(o.stop_time / 0.01) + 1))
    _, inputs = motion(t, o.height, o.period, o.pitch, o.rise, o.seed)
    head = ",".join(["time", *(f"{o.component}.{name}" for name in COLUMNS)])
    np.savetxt(o.file, np.column_stack([t, inputs]), "%.9g", ",", header=head, comments="")


if __name__ == "__main__":
    main()
