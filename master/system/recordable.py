"""What is read at every step besides outputs, and what some connection takes: variables that are to be recorded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ...ssp.wires import End, Network
from ..slaves.base import Slave
from .addresses import matches


def internals(network: Network, slaves: Mapping[str, Slave], patterns: Iterable[str]) -> list[End]:
    """Variables that are no outputs or inputs and still have columns.

    Those are what connectors of kind output lead to, and what patterns mean that match no other column.
    """
    made = dict.fromkeys(_connectors(network, slaves))
    if not (patterns := list(patterns)):
        return list(made)
    taken = {wire.start for wire in (*network.wires, *network.outputs)}
    usual = [*network.inputs, *(wire.end[1] for wire in network.outputs)]
    others: dict[str, End] = {}
    for component, slave in slaves.items():
        for name, v in slave.variables.items():
            end = component, name
            if v.type not in slave.forms:
                continue
            if v.causality in ("input", "output") or end in made or end in taken:
                usual.append(f"{component}.{name}")
            else:
                others[f"{component}.{name}"] = end
    for pattern in patterns:
        if not any(_means(pattern, address) for address in usual):
            made |= dict.fromkeys(end for address, end in others.items() if _means(pattern, address))
    return list(made)


def _connectors(network: Network, slaves: Mapping[str, Slave]) -> Iterator[End]:
    for path, part in network.parts.items():
        for connector in part.component.connectors:
            v = slaves[path].variables.get(connector.name) if path in slaves else None
            if v is not None and connector.kind == "output" and v.causality not in ("input", "output"):
                yield path, connector.name


def _means(pattern: str, address: str) -> bool:
    """Whether a pattern means a variable, or an element of it where it is an array."""
    return matches(address, pattern) or (pattern.endswith("]") and matches(address, pattern.rpartition("[")[0]))
