"""A sweep's table in the units in which it is shown; files keep those of the FMUs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...core.display_units import DisplayUnits
from .axes import Axis
from .request import SweepPlan


@dataclass(frozen=True)
class Shown:
    """Axes and table with their units by name, where they are known."""

    axes: Sequence[Axis]
    table: Sequence[Mapping[str, Any]]
    units: Mapping[str, str]


def shown_in(plan: SweepPlan, table: Sequence[Mapping[str, Any]], display: DisplayUnits) -> Shown:
    """The sweep in these units. One with an offset is not taken: a metric may be a difference."""
    units, factors = dict(plan.units), dict[str, float]()
    for name, unit in plan.units.items():
        sizes = [abs(row[name]) for row in table if _is_number(row.get(name))]
        other, factor, offset = display.of(unit, max(sizes, default=0.0))
        if other != unit and offset == 0.0:
            units[name], factors[name] = other, factor
    axes = [replace(axis, values=tuple(_times(v, factors.get(axis.name)) for v in axis.values)) for axis in plan.axes]
    rows = [{name: _times(value, factors.get(name)) for name, value in row.items()} for row in table]
    return Shown(axes, rows, units)


def _times(value: Any, factor: float | None) -> Any:
    """The product without the digits of its rounding; what is no number as it is."""
    return value if factor is None or not _is_number(value) else float(f"{factor * value:.12g}")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
