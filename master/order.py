"""In which order components are visited: that of the data flow."""

from __future__ import annotations

from collections.abc import Iterable
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING

from .together import together

if TYPE_CHECKING:
    from .system import Link


def component_order(names: Iterable[str], links: Iterable[Link]) -> list[str]:
    """Order of the data flow; within a loop, and where nothing decides, that of the package."""
    place = {name: i for i, name in enumerate(names)}
    drives: dict[str, set[str]] = {name: set() for name in place}
    for k in links:
        if k.source.component and k.source.component != k.target.component:
            drives[k.source.component].add(k.target.component)
    group = {name: {name} for name in place}
    for members in together(drives):
        for name in members:
            group[name] = members
    waits = {id(g): 0 for g in group.values()}
    for name, others in drives.items():
        for other in others:
            waits[id(group[other])] += group[other] is not group[name]
    left = {id(g): len(g) for g in group.values()}
    free = [place[name] for name in place if not waits[id(group[name])]]
    heapify(free)
    known, order = list(place), []
    while free:
        name = known[heappop(free)]
        order.append(name)
        left[id(group[name])] -= 1
        if left[id(group[name])]:
            continue  # what comes after a loop comes after all of it
        for member in group[name]:
            for other in drives[member]:
                if group[other] is not group[name]:
                    waits[id(group[other])] -= 1
                    if not waits[id(group[other])]:
                        for n in group[other]:
                            heappush(free, place[n])
    return order
