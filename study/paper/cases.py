"""The runs behind the paper's figures 9 and 11 to 21. Wu et al. 2022, sections 4.2 and 4.3.

Where the paper's text gives no values for a curve (alpha, L, D, ...), round ones around the base case are taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

KM = 1e3
L_MIN = 1e-3 / 60.0
"""1 L/min in m3/s."""

DEEP = 11.0 * KM
T_START, T_DOWN, RAMP, TARGET = 2.0, 12.0, 5.0, 0.2
"""Start of both ramps and their length [s], target [m]: the scenario's command."""

BASE: Mapping[str, float | bool] = {
    "hydraulics.oil.alpha": 2.2e-8, "hydraulics.oil.nu0": 22e-6, "hydraulics.line.length": 4.0,
    "hydraulics.line.diameter": 4e-3, "hydraulics.valve.q_rated": 5 * L_MIN, "hydraulics.relief.p_crack": 20e6,
    "hydraulics.line.variable_viscosity": True,
    "hydraulics.command.target": TARGET, "hydraulics.command.ramp_time": RAMP,
    "arm.load_weight": 800.0, "arm.current_speed": 0.5, "arm.drag_as_printed": False,
}  # fmt: skip
"""What the machine has where a case says nothing."""

WITHIN = 1e-3
"""The motion is done within 1 mm, 0.5 % of the stroke commanded in most runs [m]."""

VISCOSITY: Mapping[bool, str] = {True: "variable", False: "constant"}
"""What a viscosity is called, by whether it grows with pressure."""

TIMES: Mapping[bool, tuple[float, float]] = {True: (7.625, 7.156), False: (7.178, 6.779)}
"""Published times of extension and retraction at 11 km [s], by whether the viscosity is variable."""

STOP = 22.0
MID = T_START + 3.0
"""The paper looks at 8 s of a clock whose ramp starts at 5 s: three seconds after the start [s]."""


@dataclass(frozen=True)
class Case:
    """A run: label of its curve and the parameters that differ from the machine at 11 km."""

    label: str
    changes: Mapping[str, float | bool] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, float | bool]:
        """All that a figure varies, the depth included."""
        return {"depth": DEEP, **BASE, **self.changes}

    @property
    def key(self) -> tuple[tuple[str, float], ...]:
        """What tells runs apart, to nine digits."""
        return tuple(sorted((name, float(f"{value:.9g}")) for name, value in self.parameters.items()))


def _one(name: str, factor: float, unit: str, values: tuple[float, ...]) -> tuple[Case, ...]:
    """Cases of one parameter; a unit that begins with a power of ten ends the number."""
    told = unit if unit.startswith("e-") else f" {unit}"
    return tuple(Case(f"{v:g}{told}", {name: v * factor}) for v in values)


CONSTANT = Case("11 km, constant viscosity", {"hydraulics.line.variable_viscosity": False})
DEEPEST = Case("11 km", {})
SLOWER = Case("200 mm in 10 s", {"hydraulics.command.ramp_time": 2 * RAMP})
DEPTHS = _one("depth", KM, "km", (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11))

FIGURES: Mapping[int, tuple[str, tuple[Case, ...]]] = {
    9: ("Displacement at different depths", (*(DEPTHS[k] for k in (3, 6, 9, 10, 11)), CONSTANT)),
    11: ("Losses of both lines in mid-extension", DEPTHS),
    12: ("Valve pressure difference, spool and speed in mid-extension", DEPTHS),
    13: ("Pressure-viscosity index", _one("hydraulics.oil.alpha", 1e-8, "e-8 1/Pa", (1.5, 1.8, 2.0, 2.2, 2.5))),
    14: ("Viscosity at ambient pressure", _one("hydraulics.oil.nu0", 1e-6, "cSt", (10, 15, 22, 32))),
    15: ("Length of the lines", _one("hydraulics.line.length", 1.0, "m", (2, 3, 4, 5))),
    16: ("Inner diameter of the lines", _one("hydraulics.line.diameter", 1e-3, "mm", (3, 3.5, 4, 4.5, 5))),
    17: ("Rated flow of the servo valve", _one("hydraulics.valve.q_rated", L_MIN, "L/min", (2.5, 5, 10, 20, 40))),
    18: ("Cracking pressure of the relief valve", _one("hydraulics.relief.p_crack", 1e6, "MPa", (18, 20, 22, 25))),
    19: ("Command", _one("hydraulics.command.target", 1e-3, "mm", (100, 150, 200, 220))),
    20: ("Weight of the load", _one("arm.load_weight", 1.0, "N", (400, 600, 800, 1000))),
    21: ("Current", _one("arm.current_speed", 1.0, "m/s", (-1, -0.5, 0, 0.5, 1))),
}
"""Title and curves of each figure that shows runs of the machine."""

PROMPT: Mapping[int, tuple[str, float]] = {
    9: ("9 km and less", TARGET), 13: ("1.8e-8 1/Pa and less", TARGET), 14: ("10 cSt", TARGET), 15: ("2 m", TARGET),
    16: ("5 mm", TARGET), 19: ("100 mm", 0.1),
}  # fmt: skip
"""What the paper says is not delayed, by figure, and the command's target [m]."""

RECORD = (
    "arm.x_h", "arm.v_h", "arm.theta", "arm.M_hd", "hydraulics.F_h", "hydraulics.P1", "hydraulics.P2", "hydraulics.Pa",
    "hydraulics.Pb", "hydraulics.Pp", "hydraulics.Pt", "hydraulics.Qrv", "hydraulics.x_v", "hydraulics.x_cmd",
)  # fmt: skip


def all_cases() -> tuple[Case, ...]:
    """Every run once."""
    found: dict[tuple[tuple[str, float], ...], Case] = {}
    for case in (DEEPEST, SLOWER, *(c for _, cases in FIGURES.values() for c in cases)):
        found.setdefault(case.key, case)
    return tuple(found.values())
