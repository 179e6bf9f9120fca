"""What the lines' segments are off by: one line against characteristics, and the whole machine against forty.

    python -m benchmarks.line_segments [build/deepsea_0km.ssp]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.study.characteristics import line_transient
from deepsea_cosim.study.table1 import BASE, line_response

SEGMENTS, MANY = (5, 10, 20), 40
RISES = (2e-3, 5e-3, 10e-3, 20e-3)
SIGNALS = ("arm.x_h", "hydraulics.P1", "hydraulics.P2", "hydraulics.Pa", "hydraulics.Pb")


def one_line() -> None:
    """RMS of the first 100 ms of the loss, of that of the method of characteristics."""
    print("one line, flow rising in " + ", ".join(f"{1e3 * rise:g}" for rise in RISES) + " ms: off by")
    for depth in (1000.0, 3000.0):
        case = {**BASE, "depth": depth}
        for n in SEGMENTS:
            made = []
            for rise in RISES:
                t, exact = line_transient(**case, rise=rise, stop=0.1)
                times, loss = line_response(**case, segments=n, rise=rise, stop=0.1, points=4001)
                made.append(rms(loss - np.interp(times, t, exact)) / rms(exact))
            print(f"{depth / 1e3:4g} km {n:3d} segments  " + "  ".join(f"{100 * x:5.1f} %" for x in made))


def machine(package: Path) -> None:
    """The shipped stroke at the package's step."""
    session = Session(package)
    for depth in (0.0, 1000.0, 3000.0, 11000.0):
        runs = {}
        for n in (*SEGMENTS, MANY):
            begin = time.perf_counter()
            changes = {"depth": depth, "hydraulics.line.segments": n}
            runs[n] = np.array(session.run(SIGNALS, 22.0, 1e-3, changes, {})[1]), time.perf_counter() - begin
        for n in SEGMENTS:
            apart, taken = runs[n][0] - runs[MANY][0], runs[n][1] / runs[SEGMENTS[0]][1]
            x, p = apart[:, 0], apart[:, 1:]
            print(f"{depth / 1e3:4g} km {n:3d} segments  x_h {1e6 * np.abs(x).max():.2g} um at most, pressures "
                  f"{max(rms(c) for c in p.T) / 1e3:.2g} kPa rms, {np.abs(p).max() / 1e3:.2g} at most; "
                  f"{taken:.2f} of the time of {SEGMENTS[0]}")  # fmt: skip


if __name__ == "__main__":
    one_line()
    machine(Path(sys.argv[1] if len(sys.argv) > 1 else "build/deepsea_0km.ssp"))
