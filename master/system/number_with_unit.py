"""Numbers that a user gives with a unit behind: `--set target=200mm`, `--set P=210bar`."""

from __future__ import annotations

import re
from typing import Any

from ...core.errors import ParameterError, UsageError, did_you_mean
from ...core.unit_names import named
from ...core.units import UNITS, conversion
from ..engine.values import REAL
from .value_conversion import Quantity

NUMBER_AND_UNIT = re.compile(
    r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*((?:1/)?(?![eE][+-]?\d)[A-Za-z%°µΩ][^\s,]*)"
)
"""A unit begins with a letter, or with 1/; an exponent is none."""


def in_unit_of(value: Any, quantity: Quantity, is_array: bool, where: str) -> Any:
    """The value with what has a unit behind turned into a number in the unit of what takes it; others as they are.

    Raises `ParameterError` for a unit that is unknown or measures something else.
    """
    if quantity.family != REAL:
        return value
    if isinstance(value, (tuple, list)):
        return type(value)(_number(v, quantity, where) for v in value)
    if is_array and isinstance(value, str):
        return tuple(_number(v, quantity, where) for v in value.replace(",", " ").split())
    return _number(value, quantity, where)


def _number(value: Any, quantity: Quantity, where: str) -> Any:
    if not isinstance(value, str) or (found := NUMBER_AND_UNIT.fullmatch(value.strip())) is None:
        return value
    number, name = float(found[1]), found[2]
    unit = named(name)
    if unit is None:
        otherwise_written = next((known for known in UNITS if known.lower() == name.lower()), name)
        raise ParameterError(f"{where}: unknown unit '{name}'{did_you_mean(otherwise_written, list(UNITS))}")
    if quantity.unit is None:
        raise ParameterError(f"{where}: {quantity.shown} has no unit; give a number alone")
    try:
        factor, offset = conversion(unit, quantity.unit)
    except UsageError as error:
        raise ParameterError(f"{where}: {error}") from None
    return factor * number + (0.0 if quantity.relative else offset)
