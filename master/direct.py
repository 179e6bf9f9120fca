"""How an output answers at once to an input that its partner drives, measured by a nudge before the first step."""

from __future__ import annotations

from ..core.errors import CosimError
from .agreement import handles
from .bonds import Bond
from .slaves.base import REAL
from .system import Link, System

NUDGE = 1e-6
"""Change of an input, relative to 1 + its size."""


def at_once(system: System, bond: Bond) -> tuple[float, float]:
    """|dy/dx| of both sides' outputs of a bond; x is what the side gets besides its rate: a position besides its speed.

    0 where the FMU declares no such dependence. What is nudged is put back.
    """
    made = []
    for gives, takes in ((bond.forth, bond.back), (bond.back, bond.forth)):
        inputs = [link for link in system.links if _integral(system, link, takes)]
        declared = system.slaves[gives.source.component].feed_through(gives.source.name) or []
        made.append(sum(abs(_slope(system, gives, link)) for link in inputs if link.target.name in declared))
    return made[0], made[1]


def _integral(system: System, link: Link, flow: Link) -> bool:
    """Whether a link carries what another one between the same components carries the rate of."""
    if (link.source.component, link.target.component) != (flow.source.component, flow.target.component):
        return False
    if link.target.family != REAL or link.target.size != 1:
        return False
    units = [system.slaves[k.target.component].unit(k.target.name) for k in (link, flow)]
    if any(u is None or u.exponents is None for u in units):
        return False
    own, rate = ({k: p for k, p in u.exponents.items() if k != "rad"} for u in units)  # type: ignore[union-attr]
    return {**own, "s": own.get("s", 0) - 1} == {"s": 0, **rate}


def _slope(system: System, output: Link, link: Link) -> float:
    """dy/du of one output of the component that a link ends at; NaN if that cannot be had."""
    reals = system.board.reals
    give, take = handles(system, link.target.component)
    place, u, y = link.target.place, reals[link.target.place], output.source.place
    nudge = NUDGE * (1.0 + abs(u))
    found = []
    try:
        for value in (u + nudge, u):
            reals[place] = value
            give.once()
            take.once()
            found.append(float(reals[y]))
    except CosimError:
        return float("nan")
    finally:
        reals[place] = u
    return (found[0] - found[1]) / nudge
