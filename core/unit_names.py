"""What a unit's name says where nothing defines it: names as Modelica writes them ("kg.m2/s2", "W/(m2.K)", "mA")."""

from __future__ import annotations

import re
from functools import lru_cache
from math import pi

from .units import BASE, UNITS, Unit

PREFIXES = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3, "M": 1e6, "G": 1e9}

_ENERGY = {"kg": 1, "m": 2, "s": -2}
_POWER = {"kg": 1, "m": 2, "s": -3}

SYMBOLS: dict[str, tuple[float, dict[str, int]]] = {
    **{name: (1.0, {name: 1}) for name in ("m", "s", "A", "K", "mol", "cd", "rad")},
    "g": (1e-3, {"kg": 1}), "N": (1.0, {"kg": 1, "m": 1, "s": -2}), "Pa": (1.0, {"kg": 1, "m": -1, "s": -2}),
    "J": (1.0, _ENERGY), "W": (1.0, _POWER), "V": (1.0, {**_POWER, "A": -1}), "Ohm": (1.0, {**_POWER, "A": -2}),
    "S": (1.0, {"kg": -1, "m": -2, "s": 3, "A": 2}), "C": (1.0, {"s": 1, "A": 1}),
    "F": (1.0, {"kg": -1, "m": -2, "s": 4, "A": 2}), "H": (1.0, {**_ENERGY, "A": -2}),
    "Wb": (1.0, {**_ENERGY, "A": -1}),
    "T": (1.0, {"kg": 1, "s": -2, "A": -1}), "L": (1e-3, {"m": 3}), "l": (1e-3, {"m": 3}),
    "bar": (1e5, {"kg": 1, "m": -1, "s": -2}),
}  # fmt: skip
"""Symbols that take prefixes: factor to SI and powers of base units."""

PLAIN: dict[str, tuple[float, dict[str, int]]] = {
    "min": (60.0, {"s": 1}), "h": (3600.0, {"s": 1}), "d": (86400.0, {"s": 1}), "deg": (pi / 180.0, {"rad": 1}),
    "lb": (0.45359237, {"kg": 1}), "lbf": (4.4482216152605, {"kg": 1, "m": 1, "s": -2}),
    "kgf": (9.80665, {"kg": 1, "m": 1, "s": -2}), "ft": (0.3048, {"m": 1}), "in": (0.0254, {"m": 1}),
    "t": (1e3, {"kg": 1}), "atm": (101325.0, {"kg": 1, "m": -1, "s": -2}), "1": (1.0, {}),
}  # fmt: skip
"""Symbols that take none. Units that count turns stand in the table only (`units.TURNS`)."""

SAME = {
    "lpm": "l/min", "LPM": "l/min", "GPM": "gpm", "cc": "cm3", "cc/rev": "cm3/rev", "msw": "m", "fsw": "ft", "-": "1",
    "Nm": "N.m", "Nms": "N.m.s", "Ω": "Ohm", "°": "deg", "°C": "degC",
}  # fmt: skip
"""Names that tools use for others."""


@lru_cache(maxsize=4096)
def named(name: str) -> Unit | None:
    """The unit that a name usually stands for, or None."""
    if name.startswith("[") and name.endswith("]"):
        known = named(name[1:-1])
        return known and Unit(name, known.exponents, known.factor, known.offset)
    known = UNITS.get(name) or UNITS.get(SAME.get(name, ""))
    if known is not None:
        return Unit(name, known.exponents, known.factor, known.offset)
    parsed = _parse(SAME.get(name, name).replace("*", ".").replace("^", ""))
    if parsed is None:
        return None
    factor, powers = parsed
    return Unit(name, {b: powers[b] for b in BASE if powers.get(b)}, factor)


def _parse(text: str) -> tuple[float, dict[str, int]] | None:
    above, slash, below = text.partition("/")
    if slash and below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    elif "." in below:
        return None  # a.b/c.d leaves open what d is
    if "/" in below:
        return None
    factor = 1.0
    powers: dict[str, int] = {}
    for part, sign in ((above, 1), (below, -1)):
        for operand in part.split(".") if part else ([] if sign < 0 and not slash else [""]):
            found = _operand(operand)
            if found is None:
                return None
            size, bases = found
            factor *= size**sign
            for base, power in bases.items():
                powers[base] = powers.get(base, 0) + sign * power
    return factor, powers


def _operand(text: str) -> tuple[float, dict[str, int]] | None:
    match = re.fullmatch(r"([A-Za-zµ]+)([+-]?[1-9])?|1", text)
    if match is None:
        return None
    symbol, power = (match[1] or "1").replace("µ", "u"), int(match[2] or 1)
    found = PLAIN.get(symbol) or SYMBOLS.get(symbol)
    if found is None and symbol[1:] in SYMBOLS and symbol[0] in PREFIXES:
        size, bases = SYMBOLS[symbol[1:]]
        found = PREFIXES[symbol[0]] * size, bases
    if found is None:
        return None
    return found[0] ** power, {base: n * power for base, n in found[1].items()}
