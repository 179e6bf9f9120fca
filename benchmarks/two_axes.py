"""What coupling two axes to one supply costs in accuracy: the scenario against the whole as one differential equation.

    python -m benchmarks.two_axes build/two_axes.ssp [STOP]

The monolith has the components' equations (`hydraulics_fmu`, `mechanics`), but no FMU, no master and none of their
integrators: scipy's LSODA moves both circuits, both arms and the supply at once.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from deepsea_cosim.hydraulics_fmu import circuit
from deepsea_cosim.hydraulics_fmu.constants import by_name, constants
from deepsea_cosim.hydraulics_fmu.controller import command, command_rate
from deepsea_cosim.hydraulics_fmu.memory import new_memory, remembering
from deepsea_cosim.hydraulics_fmu.states import state_scales
from deepsea_cosim.hydraulics_fmu.steady import steady_state
from deepsea_cosim.hydraulics_fmu.supply_unit import equations as unit
from deepsea_cosim.hydraulics_fmu.supply_unit.variables import SUPPLY
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.mechanics import loads, stepping
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.variables import ARM

AXES = ("first", "second")
SIGNALS = (
    *(f"{axis}_{name}" for axis in AXES for name in ("arm.x_h", "hydraulics.P1", "hydraulics.P2")),
    "supply.P_s", "supply.P_r",
)  # fmt: skip
STOP = 22.0
ROW = 4e-3
"""Distance of the times that are compared [s]."""
RUNS = (("gauss-seidel", 2e-3), ("gauss-seidel", 1e-3), ("gauss-seidel", 5e-4), ("nepce", 2e-3), ("nepce", 1e-3),
        ("interface-jacobian", 1e-3))  # fmt: skip


class Axis:
    """A cylinder with its circuit and its arm."""

    def __init__(self, hydraulics: dict[str, float], arm: dict[str, float], P_s: float, P_r: float):
        self.arm = Arm(ARM.parameters(arm))
        numbers = constants(HYDRAULICS.parameters(hydraulics))
        self.c = by_name(numbers)
        self.y, _ = steady_state(numbers, float(self.arm.F_hold), P_s, P_r)
        self.m = remembering.py_func(new_memory())
        self.scale = np.concatenate([state_scales(self.c), [0.1, 0.1]])
        self.out = np.zeros(len(circuit.OUTPUTS))

    def start(self) -> np.ndarray:
        """The circuit's states, the beam's angle and its rate."""
        return np.concatenate([self.y, [self.arm.theta, 0.0]])

    def corners(self) -> list[float]:
        """Times at which its command bends [s]."""
        c = self.c.command
        up = c.t_start + c.ramp_time
        return [c.t_start, up, up + c.hold_time, up + c.hold_time + c.ramp_time]

    def look(self, t: float, z: np.ndarray, P_s: float, P_r: float) -> tuple[float, float, float, float]:
        """x_h, v_h, command and its rate at t [s]; the outputs go to `out`."""
        self.m.P_s, self.m.P_r = P_s, P_r
        stepping.evaluate(self.arm.row.ctypes.data, z[-2], z[-1], t, 0.0)
        p = self.arm.projection
        at = float(p[loads.X]), float(p[loads.V]), command(t, t, 0.0, 0.0, self.c), command_rate(t, 0.0, self.c)
        circuit.outputs(z[:-2], self.c, *at, np.nan, self.m, self.out)
        return at

    def rates(self, at: tuple[float, float, float, float], z: np.ndarray) -> np.ndarray:
        """Rates of the states, after `look`."""
        f, p = np.empty(len(z)), self.arm.projection
        circuit.derivatives(z[:-2].copy(), self.c, *at, np.nan, self.m, f[:-2])
        f[-2], f[-1] = z[-1], (p[loads.TORQUE] + p[loads.LEVER] * self.out[0]) / p[loads.MASS]
        return f


def monolith(values: dict[str, float], stop: float) -> np.ndarray:
    """The signals (n, SIGNALS) every `ROW` of a run to `stop` [s], with these parameters by address."""
    from scipy.integrate import solve_ivp

    def of(component: str, table: object) -> dict[str, float]:
        names = [v.name for v in table.of("parameter")]  # type: ignore[attr-defined]
        return {name: values[f"{component}.{name}"] for name in names}

    c = unit.by_name.py_func(unit.constants(SUPPLY.parameters(of("supply", SUPPLY))))
    supply = unit.rest(c, 0.0)
    for _ in range(20):  # what the valves take at rest hangs on the pressure a little
        given = float(supply[0]), float(supply[2])
        axes = [Axis(of(f"{name}_hydraulics", HYDRAULICS), of(f"{name}_arm", ARM), *given) for name in AXES]
        for axis in axes:
            axis.look(0.0, axis.start(), *given)
        supply = unit.rest(c, sum(float(axis.out[circuit.OUTPUTS.index("Qp")]) for axis in axes))
    n = len(axes[0].start())
    taken, given = circuit.OUTPUTS.index("Qp"), circuit.OUTPUTS.index("Qt")

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        made, Q_p, Q_t = [], 0.0, 0.0
        for k, axis in enumerate(axes):
            own = z[k * n : (k + 1) * n]
            made.append(axis.rates(axis.look(t, own, z[-5], z[-3]), own))
            Q_p, Q_t = Q_p + axis.out[taken], Q_t + axis.out[given]
        f = np.empty(5)
        unit.rates(z[-5:].copy(), Q_p, Q_t, c, f)
        return np.concatenate([*made, f])

    z = np.concatenate([*(axis.start() for axis in axes), supply])
    scale = np.concatenate([*(axis.scale for axis in axes), [1e7, 1e-4, 1e7, 0.1, 0.1]])
    cuts = sorted({0.0, stop, *(t for axis in axes for t in axis.corners() if t < stop)})
    times, rows = np.arange(round(stop / ROW) + 1) * ROW, []
    for a, b in pairwise(cuts):
        last = b == stop
        at = times[(times >= a - 1e-9) & ((times < b - 1e-9) | (last & (times <= b + 1e-9)))]
        # the command's rate is that just before a corner, so a piece begins just behind it
        ends = np.unique(np.clip(np.append(np.minimum(at, b - 1e-9), b), a + 1e-9, b))
        found = solve_ivp(rate, (a + 1e-9, b), z, "LSODA", ends, rtol=1e-8, atol=1e-9 * scale)
        if not found.success:
            raise ArithmeticError(f"the monolith fails after {a:g} s: {found.message}")
        z = found.y[:, -1]
        for t, state in zip(at, np.ascontiguousarray(found.y.T), strict=False):
            row = []
            for k, axis in enumerate(axes):
                own = state[k * n : (k + 1) * n]
                x = axis.look(float(t), own, state[-5], state[-3])[0]
                row += [x, axis.out[circuit.OUTPUTS.index("P1")], axis.out[circuit.OUTPUTS.index("P2")]]
            rows.append([*row, state[-5], state[-3]])
    return np.array(rows)


def errors(
    package: Path, stop: float = STOP, runs: tuple[tuple[str, float], ...] = RUNS,
    changes: Mapping[str, float] | None = None,
) -> list[np.ndarray]:  # fmt: skip
    """Largest differences (SIGNALS,) of each run of the package, with these parameters changed, from the monolith."""
    made = []
    with Session(package) as session:
        changed = dict(changes or {})
        exact = monolith({**session.values(), **changed}, stop)
        for method, step in runs:
            rows = np.array(session.run(SIGNALS, stop, step, changed, method=method)[1])[:: round(ROW / step)]
            made.append(np.abs(rows[: len(exact)] - exact).max(axis=0))
    return made


def main() -> None:
    """Print a table."""
    package = Path(sys.argv[1] if len(sys.argv) > 1 else "build/two_axes.ssp")
    stop = float(sys.argv[2]) if len(sys.argv) > 2 else STOP
    for (method, step), error in zip(RUNS, errors(package, stop), strict=True):
        x, P = max(error[0], error[3]), max(error[1], error[2], error[4], error[5])
        print(f"{method:18} {1e3 * step:4g} ms  x_h {1e3 * x:.4f} mm  chambers {P / 1e3:.1f} kPa  "
              f"supply {error[6] / 1e3:.2f} kPa  tank {error[7]:.2f} Pa", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
