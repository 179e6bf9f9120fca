"""Algebraic loops: outputs that depend at once on inputs which they drive."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

from ..system.strongly_connected import strongly_connected_components
from ..system.system import System

Node = tuple[str, str]

ANY = ""
"""Stands for all inputs of a component: thousands of outputs and thousands of inputs are no millions of pairs then."""


def graph(system: System, doubtful: bool) -> dict[Node, set[Node]]:
    """Who depends on whom at once: links, and the feed-through that the FMUs declare.

    doubtful: outputs of which an FMU does not say what they depend on count as depending on all its inputs.
    """
    edges: dict[Node, set[Node]] = {}
    for link in system.links:
        edges.setdefault(link.end, set()).add(link.start)
    for component, output in system.outputs:
        instance = system.instances[component]
        inputs = instance.direct_feedthrough(output)
        if inputs is None:
            inputs = [ANY] if doubtful else []
        edges.setdefault((component, output), set()).update((component, name) for name in inputs)
    if doubtful:
        edges |= {(name, ANY): {(name, s.name) for s in instance.inputs} for name, instance in system.instances.items()}
    return edges


def loops(
    system: System, doubtful: bool = False, more: Mapping[Node, Collection[Node]] = MappingProxyType({})
) -> list[list[str]]:
    """One loop, as addresses from signal to signal, for every set of signals that depend on each other at once.

    more: what signals depend on besides.
    """
    edges = graph(system, doubtful)
    for node, sources in more.items():
        edges.setdefault(node, set()).update(sources)
    found_loops = []
    for members in strongly_connected_components(edges):
        begin = min(node for node in members if node[1] != ANY)
        found_loops.append([".".join(node) for node in _way_back(edges, begin, members) if node[1] != ANY])
    return found_loops


def _way_back(edges: dict[Node, set[Node]], begin: Node, members: set[Node]) -> list[Node]:
    """The shortest way from a node back to itself, in the direction of the data."""
    ways = [[begin]]
    visited = set()
    while ways:
        way = ways.pop(0)
        for child in sorted(edges.get(way[-1], ())):
            if child == begin:
                return [begin, *reversed(way)]
            if child in members and child not in visited:
                visited.add(child)
                ways.append([*way, child])
    return [begin]
