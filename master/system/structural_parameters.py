"""Structural parameters, which give arrays their size, and so come before all others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...ssp.flat_system import BoundParameter, FlatSystem
from ..slaves.base import FmuInstance
from .addresses import split
from .findings import Findings
from .start_values import StartValue, bound_values, resolve


def configure(
    network: FlatSystem, instances: Mapping[str, FmuInstance], changes: Iterable[tuple[str, Any]] = ()
) -> tuple[FlatSystem, list[tuple[str, Any]], list[StartValue]]:
    """Hand structural parameters to the instances, before sizes are asked for; what the network and the changes have
    left, and the values.

    They have to come before all others, for arrays are checked against the sizes they give.
    """

    def structural(component: str, name: str) -> bool:
        instance = instances.get(component)
        variable = instance.variables.get(name) if instance is not None else None
        return variable is not None and variable.causality == "structuralParameter"

    bound_parameters = [s for s in network.bound_parameters if structural(s.component, s.variable)]
    values = bound_values(replace(network, bound_parameters=tuple(bound_parameters)), instances, Findings())
    changes_left = []
    for address, value in changes:
        component, name = split(address, instances)
        if any(structural(c, name) for c in ([component] if component else instances)):
            found_values = resolve([(address, value)], instances)
            values += [v for v in found_values if structural(v.component, v.variable)]
            changes_left += [
                (f"{v.component}.{v.variable}", value) for v in found_values if not structural(v.component, v.variable)
            ]
        else:
            changes_left.append((address, value))
    for v in values:
        instances[v.component].configure(v.variable, v.value)
    bound_parameters = [s for s in network.bound_parameters if not structural(s.component, s.variable)]
    return (
        replace(network, bound_parameters=tuple(_in_force(bound_parameters, instances, changes_left))),
        changes_left,
        values,
    )


def _in_force(
    bound_parameters: Sequence[BoundParameter], instances: Mapping[str, FmuInstance], changes: Iterable[tuple[str, Any]]
) -> Iterator[BoundParameter]:
    """The bound parameters without those of arrays that others win over, for their size may not be right any more."""
    changed = {split(address, instances) for address, _ in changes}
    winning = {(s.component, s.variable): s for s in bound_parameters}
    for s in bound_parameters:
        end = s.component, s.variable
        variable = instances[s.component].variables.get(s.variable) if s.component in instances else None
        if variable is None or not variable.dimensions or (winning[end] is s and end not in changed):
            yield s
