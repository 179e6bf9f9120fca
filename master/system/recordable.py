"""What is read at every step besides outputs, and what some connection takes: variables that are to be recorded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ...ssp.flat_system import End, FlatSystem
from ..slaves.base import FmuInstance
from .addresses import matches


def internals(network: FlatSystem, instances: Mapping[str, FmuInstance], patterns: Iterable[str]) -> list[End]:
    """Variables that are no outputs or inputs and still have columns.

    Those are what connectors of kind output lead to, and what patterns mean that match no other column.
    """
    ends = dict.fromkeys(_connectors(network, instances))
    if not (patterns := list(patterns)):
        return list(ends)
    recorded = {flat_connection.start for flat_connection in (*network.flat_connections, *network.outputs)}
    usual = [*network.inputs, *(flat_connection.end[1] for flat_connection in network.outputs)]
    by_address: dict[str, End] = {}
    for component, instance in instances.items():
        for name, v in instance.variables.items():
            end = component, name
            if v.type not in instance.types:
                continue
            if v.causality in ("input", "output") or end in ends or end in recorded:
                usual.append(f"{component}.{name}")
            else:
                by_address[f"{component}.{name}"] = end
    for pattern in patterns:
        if not any(_means(pattern, address) for address in usual):
            ends |= dict.fromkeys(end for address, end in by_address.items() if _means(pattern, address))
    return list(ends)


def _connectors(network: FlatSystem, instances: Mapping[str, FmuInstance]) -> Iterator[End]:
    for path, flat_component in network.components.items():
        for connector in flat_component.component.connectors:
            v = instances[path].variables.get(connector.name) if path in instances else None
            if v is not None and connector.kind == "output" and v.causality not in ("input", "output"):
                yield path, connector.name


def _means(pattern: str, address: str) -> bool:
    """Whether a pattern means a variable, or an element of it where it is an array."""
    return matches(address, pattern) or (pattern.endswith("]") and matches(address, pattern.rpartition("[")[0]))
