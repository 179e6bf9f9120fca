"""Table 1 of the paper: the steady loss of one line, from the dynamic line model (flow source in, ambient out).

    python -m deepsea_cosim.study.table1
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import exp

import numpy as np

from ..core.jit import kernel
from ..core.sea import ambient_pressure
from ..hydraulics_fmu.constants import by_name, constants
from ..hydraulics_fmu.line import line_derivatives, steady_loss
from ..hydraulics_fmu.oil import pressure
from ..hydraulics_fmu.variables import HYDRAULICS

RHO, BETA = 850.0, 1.4e9
BASE = {"alpha": 2.2e-8, "nu0": 22e-6, "length": 4.0, "diameter": 4e-3, "depth": 6000.0, "Q": 3e-3 / 60}


@dataclass(frozen=True)
class Row:
    """A row of Table 1: what differs from the base case, the printed losses [MPa], which of them are misprinted."""

    label: str
    change: dict[str, float]
    simulated: float
    theoretical: float
    misprint: bool = False
    """The theoretical loss is."""
    simulated_misprint: bool = False
    case: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "case", {**BASE, **self.change})

    @property
    def eq22(self) -> float:
        """Loss [Pa] by Eq. 22."""
        c = self.case
        P_o = ambient_pressure(c["depth"])
        return steady_loss(c["Q"], P_o, RHO * c["nu0"], c["alpha"], c["length"], c["diameter"])


ROWS = (
    Row("base case", {}, 2.2421, 2.2847),
    Row("alpha 1.5e-8", {"alpha": 1.5e-8}, 1.4333, 1.4804),
    Row("alpha 3e-8", {"alpha": 3e-8}, 2.5693, 2.3281, misprint=True, simulated_misprint=True),
    Row("nu0 10 cSt", {"nu0": 10e-6}, 0.9920, 1.0243),
    Row("nu0 32 cSt", {"nu0": 32e-6}, 3.3365, 3.3624),
    Row("L 3 m", {"length": 3.0}, 1.6608, 1.7027),
    Row("L 5 m", {"length": 5.0}, 2.8378, 2.8743),
    Row("D 3 mm", {"diameter": 3e-3}, 7.9246, 7.6517),
    Row("D 5 mm", {"diameter": 5e-3}, 0.8920, 0.9920, misprint=True),
    Row("depth 0", {"depth": 0.0}, 0.6043, 0.6005),
    Row("depth 11 km", {"depth": 11000.0}, 7.2067, 7.2413),
    Row("Q 2 L/min", {"Q": 2e-3 / 60}, 1.4702, 1.5103),
    Row("Q 4 L/min", {"Q": 4e-3 / 60}, 3.0397, 3.0725),
)


P_VAPOUR = 3000.0
"""Vapour pressure of the oil [Pa]."""


@kernel
def fed_line(y: object, P_out: float, q: float, constants: object, f: object) -> None:
    """Write the rates of a line's states y (2n,), its inlet node's pressure the last of them, into f; q flows in."""
    c = by_name(constants)
    line_derivatives(y, 0, len(y), pressure(y[-1], P_VAPOUR), P_out, c, f)
    f[-1] = 2.0 * c.line.stiffness * (q - y[0])


def line_response(
    alpha: float,
    nu0: float,
    length: float,
    diameter: float,
    depth: float,
    Q: float,
    variable: bool = True,
    segments: int = 5,
    stop: float = 3.0,
    points: int = 200,
    rise: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and loss [Pa] of one line from rest, into whose inlet flows Q [m3/s] after a `rise` [s].

    The inlet node carries half a segment of oil, the outlet is the ambient pressure.
    """
    from scipy.integrate import solve_ivp

    P_out = ambient_pressure(depth)
    row = constants(HYDRAULICS.parameters({
        "oil.rho": RHO, "oil.nu0": nu0, "oil.alpha": alpha, "oil.beta": BETA, "oil.p_vapour": P_VAPOUR,
        "line.length": length, "line.diameter": diameter, "line.segments": segments,
        "line.variable_viscosity": variable, "depth": depth,
    }))  # fmt: skip

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        f = np.empty_like(y)
        fed_line(y, P_out, Q if t >= rise else Q * t / rise, row, f)
        return f

    y0 = np.zeros(2 * segments)
    y0[1::2] = P_out
    tolerance = np.where(np.arange(2 * segments) % 2, 1.0, 1e-11)  # pressures [Pa], flows [m3/s]
    times = np.linspace(0.0, stop, points)
    solution = solve_ivp(rate, (0.0, stop), y0, "LSODA", times, rtol=1e-7, atol=tolerance)
    return solution.t, np.array([pressure(p, P_VAPOUR) for p in solution.y[-1]]) - P_out


@dataclass(frozen=True)
class Result:
    """A row with the loss [Pa] that the dynamic line ends with."""

    row: Row
    dynamic: float


def table(rows: Iterable[Row] = ROWS) -> list[Result]:
    """The steady losses of the dynamic line model."""
    return [Result(row, float(line_response(**row.case)[1][-1])) for row in rows]


def main() -> None:
    """Print the table."""
    print(f"{'[MPa]':<14}{'paper sim.':>12}{'paper theory':>14}{'Eq. 22':>10}{'dynamic':>10}{'of Eq. 22':>11}")
    for result in table():
        row = result.row
        note = "  misprint" if row.misprint else ""
        print(
            f"{row.label:<14}{row.simulated:>12.4f}{row.theoretical:>14.4f}{row.eq22 / 1e6:>10.4f}"
            f"{result.dynamic / 1e6:>10.4f}{100 * (result.dynamic / row.eq22 - 1):>10.3f}%{note}"
        )
    eta = RHO * BASE["nu0"] * exp(BASE["alpha"] * ambient_pressure(11000.0))
    constant = line_response(**{**BASE, "depth": 11000.0}, variable=False)[1][-1]
    print(f"constant viscosity at 11 km: {constant / 1e6:.4f} MPa (paper 6.6593), eta = {1e3 * eta:.1f} mPa s")


if __name__ == "__main__":
    main()
