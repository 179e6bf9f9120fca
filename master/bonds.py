"""Power bonds: two opposite connections between two components whose units multiply to a power, or that the package
declares as such."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import pi

from ..core.errors import PackageError, did_you_mean
from ..core.units import TURNS, UNITS, Unit
from .slaves.base import REAL
from .system import Link, System

_POWER = {"kg": 1, "m": 2, "s": -3}

@dataclass(frozen=True)
class Bond:
    """A pair of links that carry effort and flow in opposite directions; `watts`: the power of 1 x 1 in their units."""

    forth: Link
    back: Link
    watts: float = 1.0

    @property
    def name(self) -> str:
        """The two outputs, e.g. 'hydraulics.F_h x arm.v_h'."""
        return f"{self.forth.source.address} x {self.back.source.address}"


def _scalar(link: Link) -> bool:
    return link.source.family == link.target.family == REAL and link.source.size == 1 and link.cast.factor != 0.0


def find_bonds(system: System) -> list[Bond]:
    """All pairs of opposite links whose units multiply to watts, and those that the package declares."""

    def unit(link: Link) -> Unit | None:
        if link.start[0] == "":
            return None
        found = link.wire.unit or system.slaves[link.start[0]].unit(link.start[1])
        return found if found is not None and found.exponents is not None else None

    declared = {frozenset(pair) for pair in system.network.structure.bonds}
    known = {k.source.address for k in system.links}
    for address in sorted(a for pair in declared for a in pair if a not in known):
        hint = did_you_mean(address, sorted(known))
        raise PackageError(f"the power bond names '{address}', which drives nothing{hint}")
    bonds = []
    for a, b in combinations([k for k in system.links if _scalar(k)], 2):
        if (a.start[0], a.end[0]) != (b.end[0], b.start[0]) or a.start[0] == a.end[0]:
            continue
        ua, ub = unit(a), unit(b)
        factor = ua.factor * ub.factor if ua is not None and ub is not None else 1.0
        if frozenset((a.source.address, b.source.address)) in declared:
            bonds.append(Bond(a, b, factor))
            continue
        if ua is None or ub is None or ua.offset or ub.offset:
            continue
        assert ua.exponents is not None
        assert ub.exponents is not None
        keys = (set(ua.exponents) | set(ub.exponents)) - {"rad"}
        product = {k: p for k in keys if (p := ua.exponents.get(k, 0) + ub.exponents.get(k, 0))}
        if product == _POWER:
            turns = any(u.name in TURNS and u == UNITS[u.name] for u in (ua, ub))
            bonds.append(Bond(a, b, factor * (2.0 * pi if turns else 1.0)))
    return bonds
