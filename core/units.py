"""Units: one table of names, dimensions and factors to SI, used for FMI unit definitions and conversions.

A unit is a power product of SI base units with a factor and an offset: SI value = factor * value + offset.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import UsageError, did_you_mean

if TYPE_CHECKING:
    import numpy as np

Value = TypeVar("Value", float, "np.ndarray[Any, np.dtype[np.float64]]")

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""The base units of FMI 2.0 and SSP 1.0, in the order of the standards."""


@dataclass(frozen=True)
class Unit:
    """A named unit; `exponents` maps base units to powers, SI value = factor * value + offset.

    exponents is None for a unit of which only the name is known; `defined` is false where the name alone was given, and
    the rest is what units of that name usually are.
    """

    name: str
    exponents: dict[str, int] | None = field(default_factory=dict)
    factor: float = 1.0
    offset: float = 0.0
    defined: bool = field(default=True, compare=False)

    @property
    def counts_turns(self) -> bool:
        """Whether it counts turns or may do so: a rate of events that is not 1/s, as 1/min is one of revolutions.

        One whose factor has the radians of a turn or a degree in it, as 2 pi / 60, does not leave that open.
        """
        if self.name in TURNS:
            return UNITS[self.name] == self
        if self.exponents != {"s": -1} or self.factor == 1.0:
            return False
        angles = (self.factor * span / angle for span in (1.0, 60.0, 3600.0) for angle in (2.0 * pi, pi / 180.0))
        return not any(abs(ratio - 1.0) < 1e-3 for ratio in angles)

    def same_dimension(self, other: Unit) -> bool:
        """True when both are known to measure the same quantity; an angle may count as a number."""
        if self.exponents is None or other.exponents is None:
            return False
        a, b = ({k: v for k, v in x.items() if k != "rad"} for x in (self.exponents, other.exponents))
        if any(x.counts_turns for x in (self, other)) and self.exponents.get("rad") != other.exponents.get("rad"):
            return False  # a turn is 2 pi, not 1
        return a == b


def _unit(name: str, factor: float = 1.0, offset: float = 0.0, **exponents: int) -> Unit:
    return Unit(name, {b: exponents[b] for b in BASE if exponents.get(b)}, factor, offset)


TURNS = ("Hz", "kHz", "rev/s", "rev/min", "r/min", "rpm", "m3/rev", "mL/rev", "cm3/rev", "in3/rev")
"""Units of the table that count turns."""

INCH, FOOT, POUND, US_GALLON = 0.0254, 0.3048, 0.45359237, 3.785411784e-3
"""International inch [m], foot [m] and pound [kg], exact since 1959; the gallon of the United States [m3]."""

POUND_FORCE = POUND * 9.80665
"""Weight of a pound in standard gravity [N]."""

_PRESSURE = {"kg": 1, "m": -1, "s": -2}
_FORCE = {"kg": 1, "m": 1, "s": -2}
_TORQUE = {"kg": 1, "m": 2, "s": -2}
_FLOW = {"m": 3, "s": -1}

UNITS: dict[str, Unit] = {
    u.name: u
    for u in (
        _unit("1"),
        _unit("%", 0.01),
        _unit("m", m=1),
        _unit("mm", 1e-3, m=1),
        _unit("cm", 1e-2, m=1),
        _unit("km", 1e3, m=1),
        _unit("um", 1e-6, m=1),
        *(_unit(name, INCH, m=1) for name in ("inch", "in")),
        _unit("ft", FOOT, m=1),
        _unit("s", s=1),
        _unit("ms", 1e-3, s=1),
        _unit("us", 1e-6, s=1),
        _unit("min", 60.0, s=1),
        _unit("h", 3600.0, s=1),
        _unit("Hz", s=-1),
        _unit("kHz", 1e3, s=-1),
        _unit("1/s", s=-1),
        _unit("rev/s", s=-1),
        *(_unit(name, 1 / 60, s=-1) for name in ("rpm", "rev/min", "r/min")),
        _unit("1/m", m=-1),
        _unit("kg", kg=1),
        _unit("g", 1e-3, kg=1),
        _unit("t", 1e3, kg=1),
        _unit("lb", POUND, kg=1),
        _unit("kg/m", kg=1, m=-1),
        _unit("kg/m3", kg=1, m=-3),
        _unit("kg.m2", kg=1, m=2),
        _unit("m/s", m=1, s=-1),
        _unit("mm/s", 1e-3, m=1, s=-1),
        _unit("cm/s", 1e-2, m=1, s=-1),
        *(_unit(name, INCH, m=1, s=-1) for name in ("inch/s", "in/s")),
        _unit("in/min", INCH / 60, m=1, s=-1),
        _unit("ft/s", FOOT, m=1, s=-1),
        _unit("ft/min", FOOT / 60, m=1, s=-1),
        _unit("m/s2", m=1, s=-2),
        _unit("ft/s2", FOOT, m=1, s=-2),
        _unit("rad", rad=1),
        _unit("deg", pi / 180, rad=1),
        _unit("rad/s", rad=1, s=-1),
        _unit("deg/s", pi / 180, rad=1, s=-1),
        _unit("rad/s2", rad=1, s=-2),
        _unit("N", **_FORCE),
        _unit("kN", 1e3, **_FORCE),
        _unit("lbf", POUND_FORCE, **_FORCE),
        _unit("kgf", 9.80665, **_FORCE),
        _unit("N.m", **_TORQUE),
        *(_unit(name, POUND_FORCE * FOOT, **_TORQUE) for name in ("lbf.ft", "ft.lbf")),
        *(_unit(name, POUND_FORCE * INCH, **_TORQUE) for name in ("lbf.in", "in.lbf")),
        _unit("N/m", kg=1, s=-2),
        _unit("N/mm", 1e3, kg=1, s=-2),
        _unit("lbf/in", POUND_FORCE / INCH, kg=1, s=-2),
        _unit("lbf/ft", POUND_FORCE / FOOT, kg=1, s=-2),
        _unit("N.s/m", kg=1, s=-1),
        _unit("N.m.s/rad", kg=1, m=2, s=-1, rad=-1),
        _unit("J", kg=1, m=2, s=-2),
        _unit("W", kg=1, m=2, s=-3),
        _unit("kW", 1e3, kg=1, m=2, s=-3),
        _unit("hp", 550 * FOOT * POUND_FORCE, kg=1, m=2, s=-3),
        _unit("Pa", **_PRESSURE),
        _unit("kPa", 1e3, **_PRESSURE),
        _unit("MPa", 1e6, **_PRESSURE),
        _unit("GPa", 1e9, **_PRESSURE),
        _unit("bar", 1e5, **_PRESSURE),
        _unit("mbar", 1e2, **_PRESSURE),
        _unit("psi", 6894.757293168361, **_PRESSURE),
        _unit("ksi", 6894757.293168361, **_PRESSURE),
        _unit("1/Pa", kg=-1, m=1, s=2),
        _unit("Pa.s/m3", kg=1, m=-4, s=-1),
        _unit("m2/s", m=2, s=-1),
        _unit("cSt", 1e-6, m=2, s=-1),
        _unit("Pa.s", kg=1, m=-1, s=-1),
        _unit("m2", m=2),
        _unit("mm2", 1e-6, m=2),
        _unit("cm2", 1e-4, m=2),
        _unit("in2", INCH**2, m=2),
        _unit("ft2", FOOT**2, m=2),
        _unit("m3", m=3),
        *(_unit(name, 1e-3, m=3) for name in ("L", "l")),
        *(_unit(name, 1e-6, m=3) for name in ("mL", "ml", "cm3")),
        _unit("in3", INCH**3, m=3),
        _unit("ft3", FOOT**3, m=3),
        _unit("gal", US_GALLON, m=3),
        _unit("m3/rev", m=3),
        *(_unit(name, 1e-6, m=3) for name in ("mL/rev", "cm3/rev")),
        _unit("in3/rev", INCH**3, m=3),
        _unit("m3/s", **_FLOW),
        _unit("m3/h", 1 / 3600, **_FLOW),
        *(_unit(name, 1e-3, **_FLOW) for name in ("L/s", "l/s")),
        *(_unit(name, 1e-3 / 60, **_FLOW) for name in ("L/min", "l/min")),
        _unit("cm3/s", 1e-6, **_FLOW),
        _unit("in3/s", INCH**3, **_FLOW),
        _unit("in3/min", INCH**3 / 60, **_FLOW),
        *(_unit(name, US_GALLON / 60, **_FLOW) for name in ("gal/min", "gpm")),
        _unit("m3/(s.Pa)", kg=-1, m=4, s=1),
        _unit("A", A=1),
        _unit("mA", 1e-3, A=1),
        _unit("A/s", A=1, s=-1),
        _unit("mA/s", 1e-3, A=1, s=-1),
        _unit("A.s", A=1, s=1),
        _unit("mA.s", 1e-3, A=1, s=1),
        _unit("mV", 1e-3, kg=1, m=2, s=-3, A=-1),
        _unit("V", kg=1, m=2, s=-3, A=-1),
        _unit("K", K=1),
        _unit("degC", 1.0, 273.15, K=1),
        _unit("degF", 5 / 9, 459.67 * 5 / 9, K=1),
    )
}


def unit(name: str) -> Unit:
    """The unit of that name; `UsageError` with the nearest known name otherwise."""
    try:
        return UNITS[name]
    except KeyError:
        raise UsageError(f"unknown unit '{name}'{did_you_mean(name, list(UNITS))}") from None


def conversion(source: Unit, target: Unit) -> tuple[float, float]:
    """(factor, offset) with value in target = factor * value in source + offset.

    Units of the same name of which one is not defined count as the same. Raises `UsageError` where the units measure
    different quantities or cannot be compared.
    """
    if source == target or (source.name == target.name and None in (source.exponents, target.exponents)):
        return 1.0, 0.0
    for x in (source, target):
        if x.exponents is None:
            raise UsageError(f"cannot convert '{source.name}' to '{target.name}': unit '{x.name}' is not defined")
    if not source.same_dimension(target):
        raise UsageError(f"cannot convert '{source.name}' to '{target.name}': they measure different quantities")
    return source.factor / target.factor, (source.offset - target.offset) / target.factor


def alike(source: Unit, target: Unit) -> bool:
    """Whether a value means the same in both."""
    try:
        return conversion(source, target) == (1.0, 0.0)
    except UsageError:
        return False


def convert(value: Value, source: str, target: str) -> Value:
    """`value` in unit `source` expressed in unit `target` (scalars and arrays)."""
    a, b = unit(source), unit(target)
    if not a.same_dimension(b):
        raise UsageError(f"cannot convert '{source}' to '{target}': they measure different quantities")
    return (a.factor * value + a.offset - b.offset) / b.factor
