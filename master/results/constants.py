"""Parameters as columns of a result: each has one value from the first row to the last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import CosimError, UsageError, did_you_mean
from ..system.addresses import matches
from ..system.parameters import ParameterInForce
from ..system.system import System
from .columns import Column, kind_of

COLUMN_TYPES = {"float": np.float64, "integer": np.int64, "unsigned": np.uint64, "boolean": np.bool_}


@dataclass(frozen=True)
class Constant:
    """A column and the value that it has in every row."""

    column: Column
    value: Any

    def rows(self, count: int) -> np.ndarray | list[object]:
        """So many rows of it."""
        kind = COLUMN_TYPES.get(self.column.type)
        return [self.value] * count if kind is None else np.full(count, self.value, kind)


def chosen_parameters(parameters: Sequence[ParameterInForce], patterns: Sequence[str]) -> list[ParameterInForce]:
    """Those whose addresses match one of the patterns, or whose elements do; raises `UsageError` for a pattern that
    matches none."""
    found = set()
    for pattern in patterns:
        mine = [i for i, p in enumerate(parameters) if any(matches(name, pattern) for name in (p.address, *_names(p)))]
        if not mine:
            near = did_you_mean(pattern, [p.address for p in parameters])
            raise UsageError(f"--record-parameters '{pattern}' matches no parameter{near}")
        found.update(mine)
    return [p for i, p in enumerate(parameters) if i in found]


def constants(
    system: System, parameters: Sequence[ParameterInForce], patterns: Sequence[str], taken: Sequence[Column]
) -> list[Constant]:
    """A column for each value of the parameters that are chosen, unless the result has a column of that name already.

    Of an array whose elements are named by a pattern all are there. What only the FMU knows is asked of it.
    """
    names = {c.name for c in taken}
    made = []
    for p in chosen_parameters(parameters, patterns):
        value = _asked(system, p) if p.value is None else p.value
        values = value if isinstance(value, tuple) else (value,)
        kind = _kind(system, p)
        for name, one in zip(_names(p, value), values, strict=True):
            if name not in names and one is not None:
                made.append(Constant(Column(name, kind, p.unit), one))
    return made


def _names(p: ParameterInForce, value: Any = None) -> list[str]:
    """Names of the columns of a parameter."""
    value = p.value if value is None else value
    return [f"{p.address}[{k + 1}]" for k in range(len(value))] if isinstance(value, tuple) else [p.address]


def _asked(system: System, p: ParameterInForce) -> Any:
    """What an FMU has for a parameter now; None where it does not say."""
    try:
        return system.instances[p.component].get(p.variable)
    except (CosimError, KeyError):
        return None


def _kind(system: System, p: ParameterInForce) -> str:
    """Type of the columns."""
    if not p.component:
        signal = system.system_inputs[p.variable]
        return kind_of(signal.type, signal.family)
    instance = system.instances[p.component]
    type = instance.variables[p.variable].type
    return kind_of(type, instance.types[type].family)
