"""Which nodes of a graph depend on each other, and an order in which none comes before what it depends on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import TopologicalSorter
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from _typeshed import SupportsRichComparison

Node = TypeVar("Node", bound="SupportsRichComparison")


def strongly_connected_components(edges: Mapping[Node, Iterable[Node]]) -> list[set[Node]]:
    """Sets of nodes that all depend on each other (Tarjan), of two or more."""
    index: dict[Node, int] = {}
    low: dict[Node, int] = {}
    stack: list[Node] = []
    on: set[Node] = set()
    components: list[set[Node]] = []
    for root in edges:
        if root in index:
            continue
        work = [(root, iter(sorted(edges.get(root, ()))))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on.add(root)
        while work:
            node, children = work[-1]
            child = next(children, None)
            if child is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    members = set()
                    while True:
                        last = stack.pop()
                        on.discard(last)
                        members.add(last)
                        if last == node:
                            break
                    if len(members) > 1 or node in edges.get(node, ()):
                        components.append(members)
            elif child not in index:
                index[child] = low[child] = len(index)
                stack.append(child)
                on.add(child)
                work.append((child, iter(sorted(edges.get(child, ())))))
            elif child in on:
                low[node] = min(low[node], index[child])
    return components


def in_order(edges: Mapping[Node, Iterable[Node]]) -> list[Node]:
    """All nodes, each after those it depends on, and alike in every process, where sets of texts are not.

    Raises `graphlib.CycleError`.
    """
    return list(TopologicalSorter({node: sorted(sources) for node, sources in edges.items()}).static_order())
