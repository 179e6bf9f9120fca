"""In which order components are visited: that of the data flow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING

from .strongly_connected import strongly_connected_components

if TYPE_CHECKING:
    from ..slaves.base import FmuInstance
    from .connections import SignalConnection


def component_order(instances: Mapping[str, FmuInstance], links: Iterable[SignalConnection]) -> list[str]:
    """Order of the data flow; within a loop, and where nothing decides, that of the package.

    A loop in which an output that answers at once would then be more than a step late is gone through so that it is
    not, if what answers can come after what it answers to: components that answer to each other, by different outputs,
    stay as they are.
    """
    links = [link for link in links if link.source.component]
    place = {name: i for i, name in enumerate(instances)}
    drives: dict[str, set[str]] = {name: set() for name in place}
    for link in links:
        if link.source.component != link.target.component:
            drives[link.source.component].add(link.target.component)
    group = {name: {name} for name in place}
    circles = strongly_connected_components(drives)
    for members in circles:
        for name in members:
            group[name] = members
    in_time = _in_time(instances, links, circles)
    place = {name: i for i, name in enumerate(in_time)}
    waits = {id(g): 0 for g in group.values()}
    for name, targets in drives.items():
        for other in targets:
            waits[id(group[other])] += group[other] is not group[name]
    remaining = {id(g): len(g) for g in group.values()}
    free = [place[name] for name in place if not waits[id(group[name])]]
    heapify(free)
    order = []
    while free:
        name = in_time[heappop(free)]
        order.append(name)
        remaining[id(group[name])] -= 1
        if remaining[id(group[name])]:
            continue  # what comes after a loop comes after all of it
        for member in group[name]:
            for other in drives[member]:
                if group[other] is not group[name]:
                    waits[id(group[other])] -= 1
                    if not waits[id(group[other])]:
                        for n in group[other]:
                            heappush(free, place[n])
    return order


def _in_time(instances: Mapping[str, FmuInstance], links: list[SignalConnection], circles: list[set[str]]) -> list[str]:
    """The components in the order of the package, where circles keep their places but may change in themselves."""
    order = list(instances)
    at = {name: i for i, name in enumerate(order)}
    circle = {name: number for number, members in enumerate(circles) for name in members}
    within: dict[int, list[SignalConnection]] = {}
    for link in links:
        if (number := circle.get(link.source.component)) is not None and number == circle.get(link.target.component):
            within.setdefault(number, []).append(link)
    for number, members in enumerate(circles):
        if len(members) < 3:
            continue
        inner_links = within[number]
        places = sorted(at[name] for name in members)
        current = [order[i] for i in places]
        if _age(instances, inner_links, current) < 2:
            continue
        better = _sources_first(instances, inner_links, current)
        if _age(instances, inner_links, better) < _age(instances, inner_links, current):
            for i, name in zip(places, better, strict=True):
                order[i] = name
    return order


def _feedthrough_pairs(instances: Mapping[str, FmuInstance], links: list[SignalConnection]) -> list[tuple[int, int]]:
    """Pairs of numbers of links: one, and another to an input that the output of the first depends on at once."""
    into: dict[tuple[str, str], list[int]] = {}
    for i, link in enumerate(links):
        into.setdefault(link.end, []).append(i)
    pairs = []
    for i, link in enumerate(links):
        component, output = link.start
        for name in instances[component].direct_feedthrough(output) or ():
            pairs += [(i, other) for other in into.get((component, name), ())]
    return pairs


def _age(instances: Mapping[str, FmuInstance], links: list[SignalConnection], order: list[str]) -> int:
    """How many steps old what passes outputs that answer at once is at most, where components step in this order."""
    at = {name: i for i, name in enumerate(order)}
    before: dict[int, set[int]] = {i: set() for i in range(len(links))}
    for i, other in _feedthrough_pairs(instances, links):
        before[i].add(other)
    age: dict[int, int] = {}
    try:
        for i in TopologicalSorter(before).static_order():
            is_late = at[links[i].source.component] >= at[links[i].target.component]
            age[i] = is_late + max((age[other] for other in before[i]), default=0)
    except CycleError:  # an algebraic loop, which is solved in every step
        return 0
    return max(age.values(), default=0)


def _sources_first(instances: Mapping[str, FmuInstance], links: list[SignalConnection], order: list[str]) -> list[str]:
    """What answers at once after what it answers to; where that cannot be, the order given."""
    at = {name: i for i, name in enumerate(order)}
    after: dict[str, set[str]] = {name: set() for name in order}
    for _, other in _feedthrough_pairs(instances, links):
        if links[other].source.component != links[other].target.component:
            after[links[other].target.component].add(links[other].source.component)
    sorter, result = TopologicalSorter(after), list[str]()
    try:
        sorter.prepare()
    except CycleError:
        return order
    while sorter.is_active():
        ready = sorted(sorter.get_ready(), key=at.__getitem__)
        result += ready
        sorter.done(*ready)
    return result
