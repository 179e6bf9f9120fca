"""Fits the linkage numbers that the paper does not give to its four published times, with the full model.

    python -m deepsea_cosim.study.calibrate                  # the fit that is shipped
    python -m deepsea_cosim.study.calibrate --global         # all that would do: `calibration`

Five numbers (beam length, eye radius, theta0, base hinge) meet four times, so a weak pull towards the prototype's
linkage decides the rest. Two conditions keep the result buildable: at x_h = 0 the cylinder is at least 0.44 m long for
its stroke of 0.25 m, and the linkage's dead centre lies 5 mm beyond that. The result is one of a set;
docs/calibration.md says what of the study depends on the choice.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from math import hypot
from pathlib import Path

import numpy as np

from ..core.cli import OneLineParser, exit_code, folder, natural, positive
from ..hydraulics_fmu import circuit, integrator, states
from ..hydraulics_fmu.constants import by_name, constants
from ..hydraulics_fmu.memory import new_memory, remembering
from ..hydraulics_fmu.steady import steady_state
from ..hydraulics_fmu.variables import HYDRAULICS
from ..hydraulics_fmu.workspace import new_workspace
from ..master.results.measures import reaches
from ..mechanics.arm import Arm
from ..mechanics.linkage import linkage
from ..mechanics.variables import ARM
from .paper.cases import STOP, T_DOWN, T_START, TARGET, TIMES, WITHIN

NAMES = ("beam_length", "rod_eye_radius", "theta0", "base_x", "base_y")
PROTOTYPE = np.array([1.58, 0.216, 0.384, 0.304, -0.370])
MIN_LENGTH, MIN_REACH = 0.44, 0.255
LATE = 10.0
"""What counts for a motion that never arrives [s]: the time between the two ramps."""

PUBLISHED = np.ravel(list(TIMES.values()))


def run(
    hydraulics: Mapping[str, float], arm: Mapping[str, float], h: float = 4e-3, stop: float = STOP
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and displacements [m] of the machine, both halves in one process, stepped one after the other."""
    p = HYDRAULICS.parameters(hydraulics)
    numbers = constants(p)
    c = by_name(numbers)
    scale = states.state_scales(c)
    body = Arm(ARM.parameters(arm))
    y, _ = steady_state(numbers, body.F_hold)
    w = new_workspace(c)
    m = remembering(new_memory())
    out = np.zeros(len(circuit.OUTPUTS))
    n = round(stop / h)
    x_h = np.zeros(n + 1)
    v_h = 0.0
    for k in range(n):
        t = k * h
        if integrator.advance(y, w, c, scale, t, h, x_h[k], v_h, 0.0, 0.0, m):
            raise ArithmeticError(f"the integration failed at t = {t:g} s")
        circuit.outputs_at(y, c, t, h, x_h[k], v_h, 0.0, 0.0, float("nan"), m, out)
        body.step(t, h, float(out[0]))
        x_h[k + 1], v_h = body.out.item(0), body.out.item(1)
    return np.arange(n + 1) * h, x_h


def travel_times(t: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Times [s] from the start of both ramps until x [m] is within 1 mm of where it is sent; 10 s if never."""
    out, back = (reaches(t, x, goal, WITHIN, start) for goal, start in ((TARGET, T_START), (0.0, T_DOWN)))
    return LATE if out is None else out, LATE if back is None else back


def times(geometry: np.ndarray, h: float = 4e-3) -> np.ndarray:
    """The four times [s] for a geometry in the order of NAMES."""
    arm = dict(zip(NAMES, geometry.tolist(), strict=True))
    found = [travel_times(*run({"line.variable_viscosity": variable}, arm, h)) for variable in TIMES]
    return np.ravel(found)


def fit() -> np.ndarray:
    """The fitted geometry in the order of NAMES."""
    from scipy.optimize import least_squares

    def residuals(z: np.ndarray) -> np.ndarray:
        g = PROTOTYPE * (1.0 + z)
        length = linkage.py_func(g[2], g[1], g[3], g[4])[0]
        reach = g[1] + hypot(g[3], g[4]) - length
        misfit = 100.0 * (times(g) / PUBLISHED - 1.0)
        walls = [200.0 * max(0.0, MIN_LENGTH - length), 200.0 * max(0.0, MIN_REACH - reach)]
        return np.concatenate([misfit, 2.0 * z, walls])

    found = least_squares(residuals, np.zeros(5), diff_step=3e-3, xtol=1e-4, ftol=1e-4, max_nfev=12)
    return PROTOTYPE * (1.0 + found.x)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(prog="python -m deepsea_cosim.study.calibrate", description=__doc__)
    p.add_argument("--global", dest="everywhere", action="store_true", help="search all buildable linkages and "
                   "valve.lam_crit; the same command goes on where it was stopped")  # fmt: skip
    p.add_argument("--package", type=Path, metavar="deepsea_11km.ssp", help="a built scenario (default: build one)")
    p.add_argument("--out", type=folder, metavar="DIR", default=Path("results/calibrations"),
                   help="default: results/calibrations")  # fmt: skip
    p.add_argument("--samples", type=positive, default=256, metavar="N", help="points of the sample (default 256)")
    p.add_argument("--fits", type=positive, default=40, metavar="N", help="fits from its best points (default 40)")
    p.add_argument("--most", type=positive, default=12, metavar="N", help="linkages that are judged (default 12)")
    p.add_argument("--seed", type=natural, default=1, help="of the sample (default 1)")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    kept = "interrupted; what is done is kept, the same command goes on"
    return exit_code("calibrate", lambda: _work(options), kept if options.everywhere else "interrupted")


def _work(options: argparse.Namespace) -> int:
    if options.everywhere:
        from .calibration.terminal import global_command

        return global_command(options)
    shipped = np.array([ARM[name].start for name in NAMES])
    for label, geometry in (("shipped", shipped), ("fitted", fit())):
        found = times(geometry, 1e-3)
        print(label, ", ".join(f"{n} {v:.5f}" for n, v in zip(NAMES, geometry, strict=True)))
        print("  times    ", "  ".join(f"{v:.3f} s" for v in found))
        print("  published", "  ".join(f"{v:.3f} s" for v in PUBLISHED))
        print("  error    ", "  ".join(f"{100 * e:+.2f} %" for e in found / PUBLISHED - 1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
