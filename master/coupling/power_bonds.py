"""Power bonds: two opposite connections between two components whose units multiply to a power, or that the package
declares as such. Arrays make one with each element."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from math import isclose, pi

from ...core.errors import PackageError, did_you_mean
from ...core.units import Unit
from ..engine.values import REAL, Signal
from ..system.connections import SignalConnection
from ..system.system import System

Line = tuple[float, float]
"""Factor and offset."""

_POWER = {"kg": 1, "m": 2, "s": -3}

MAX_ELEMENTS = 24
"""Of an array of which nothing says that it makes bonds: a field of thousands of values is no list of forces."""


@dataclass(frozen=True)
class Bond:
    """A pair of links that carry effort and flow in opposite directions."""

    forth: SignalConnection
    back: SignalConnection
    forth_si: Line = (1.0, 0.0)
    """Factor and offset that bring the output of `forth` to SI units."""
    back_si: Line = (1.0, 0.0)
    gear: float = 1.0
    """What both links multiply by besides the conversion of units, as a gear or a lever does to effort and flow."""

    def to_si(self) -> tuple[Line, Line, Line, Line]:
        """Factors and offsets that bring to SI units, as the output that drives it would be: the output that a gives,
        the input that a gets, the input that b gets, the output that b gives."""
        return self.forth_si, _before(self.back, self.back_si), _before(self.forth, self.forth_si), self.back_si

    @property
    def name(self) -> str:
        """The two outputs, e.g. 'hydraulics.F_h x arm.v_h'."""
        return f"{self.forth.source.label} x {self.back.source.label}"

    @property
    def of_elements(self) -> bool:
        """Whether one side is an element of an array."""
        ends = (end for link in (self.forth, self.back) for end in (link.source, link.target))
        return any(end.element is not None for end in ends)


def _before(link: SignalConnection, si: Line) -> Line:
    """From what a link's target holds to its source in SI units."""
    factor = si[0] / link.conversion.factor
    return factor, si[1] - factor * link.conversion.offset


def singles(links: Iterable[SignalConnection], declared: Iterable[str] = ()) -> Iterator[SignalConnection]:
    """The links of reals, those of arrays element by element; `declared` are addresses of arrays of any size."""
    for link in links:
        if not link.source.family == link.target.family == REAL or link.conversion.factor == 0.0:
            continue
        if link.source.size == 1:
            yield link
        elif link.source.size <= MAX_ELEMENTS or link.source.address in declared:
            for k in range(link.source.size):
                yield replace(link, source=link.source.part(k), target=link.target.part(k))


def find_bonds(system: System) -> list[Bond]:
    """All pairs of opposite links whose units multiply to watts, and those that the package declares."""

    def unit(link: SignalConnection) -> Unit | None:
        if link.start[0] == "":
            return None
        return known(link.flat_connection.unit or system.instances[link.start[0]].unit(link.start[1]))

    def multiplied(link: SignalConnection) -> float | None:
        """What a link makes of 1 in SI units, if the units at its ends are known."""
        hops, instance = link.flat_connection.hops, system.instances.get(link.end[0])
        start = unit(link)
        end = known((hops[-1].unit if hops else None) or (instance.unit(link.end[1]) if instance is not None else None))
        return abs(link.conversion.factor) * end.factor / start.factor if start and end else None

    def known(unit_found: Unit | None) -> Unit | None:
        return unit_found if unit_found is not None and unit_found.exponents is not None else None

    declared = {_names(*pair) for pair in system.network.structure.bonds}
    links = list(singles(system.links, {address for pair in declared for address in pair}))
    driving = {link.source.address for link in system.links} | {link.source.label for link in links}
    for address in sorted(a for pair in declared for a in pair if a not in driving):
        hint = did_you_mean(address, sorted(driving))
        raise PackageError(f"the power bond names '{address}', which drives nothing{hint}")
    bonds, possible = [], []
    for a, b in _opposite(links):
        ua, ub = unit(a), unit(b)
        forth, back = multiplied(a), multiplied(b)
        gear = forth if forth and back and isclose(forth, back, rel_tol=1e-9) else 1.0
        whole = _names(".".join(a.start), ".".join(b.start))
        if not declared.isdisjoint((_names(a.source.label, b.source.label), whole)):
            both_known = ua is not None and ub is not None
            forth_si, back_si = ((u.factor, u.offset) if both_known and u else (1.0, 0.0) for u in (ua, ub))
            bonds.append(Bond(a, b, forth_si, back_si, gear))
            continue
        if ua is None or ub is None or ua.offset or ub.offset:
            continue
        assert ua.exponents is not None
        assert ub.exponents is not None
        keys = (set(ua.exponents) | set(ub.exponents)) - {"rad"}
        product = {k: p for k in keys if (p := ua.exponents.get(k, 0) + ub.exponents.get(k, 0))}
        if product == _POWER:
            radians = 2.0 * pi if ua.counts_turns or ub.counts_turns else 1.0
            possible.append(Bond(a, b, (ua.factor * radians, 0.0), (ub.factor, 0.0), gear))
    place = {id(link): i for i, link in enumerate(links)}
    return sorted(bonds + _pairs(possible, bonds), key=lambda bond: (place[id(bond.forth)], place[id(bond.back)]))


def _names(a: str, b: str) -> frozenset[str]:
    return frozenset((a, b))


def _opposite(links: list[SignalConnection]) -> Iterator[tuple[SignalConnection, SignalConnection]]:
    """Pairs of links between the same two components, there and back, the earlier one first."""
    ways: dict[tuple[str, str], list[tuple[int, SignalConnection]]] = {}
    for place, link in enumerate(links):
        ways.setdefault((link.start[0], link.end[0]), []).append((place, link))
    for place, a in enumerate(links):
        if a.start[0] != a.end[0]:
            for later, b in ways.get((a.end[0], a.start[0]), ()):
                if later > place and _meet(a.source, b.target) and _meet(a.target, b.source):
                    yield a, b


def _meet(a: Signal, b: Signal) -> bool:
    """Whether what a component gives and what it takes are the same element, where both are one."""
    return None in (a.element, b.element) or a.element == b.element


def _pairs(possible: list[Bond], certain: list[Bond]) -> list[Bond]:
    """Of forces and speeds in several directions, those that belong together: by their names, then by their order.

    Each link has one partner; where they are more in one direction than in the other, some of these have several.
    """
    paired = {id(link) for bond in certain for link in (bond.forth, bond.back)}
    free = [bond for bond in possible if id(bond.forth) not in paired and id(bond.back) not in paired]
    ways: dict[tuple[str, str], dict[int, SignalConnection]] = {}  # the links from one component to another
    for bond in free:
        for link in (bond.forth, bond.back):
            ways.setdefault((link.start[0], link.end[0]), {})[id(link)] = link
    place: dict[int, tuple[int, str, str]] = {}  # which one of these a link is, and what tells its ends apart
    for links in ways.values():
        starts = _apart([link.source.name + link.source.index for link in links.values()])
        ends = _apart([link.target.name + link.target.index for link in links.values()])
        place |= dict(zip(links, zip(range(len(links)), starts, ends, strict=True), strict=True))

    def likeness(bond: Bond) -> tuple[float, int]:
        (first, *forth), (second, *back) = place[id(bond.forth)], place[id(bond.back)]
        pairs = (forth[0], back[1]), (back[0], forth[1])
        return sum(SequenceMatcher(None, x, y).ratio() for x, y in pairs), -abs(first - second)

    best = sorted(free, key=likeness, reverse=True)
    chosen = []
    for lonely in (2, 1):  # first links that both have no partner yet, then those that have found none
        for bond in best:
            if sum(id(link) not in paired for link in (bond.forth, bond.back)) == lonely:
                chosen.append(bond)
                paired |= {id(bond.forth), id(bond.back)}
    return chosen


def _apart(names: list[str]) -> list[str]:
    """What tells names apart: without what all begin or end with, in small letters."""
    small = [name.lower() for name in names]
    if len(set(small)) < 2:
        return small
    begin = _common(small)
    end = _common([name[begin:][::-1] for name in small])
    return [name[begin : len(name) - end] for name in small]


def _common(names: list[str]) -> int:
    """How many letters all names begin with."""
    columns = zip(*names, strict=False)
    return next((i for i, letters in enumerate(columns) if len(set(letters)) > 1), min(map(len, names)))
