"""How outputs answer at once to inputs, measured by nudges before the first step."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np

from ..core.errors import CosimError
from .agreement import handles
from .bonds import Bond
from .slaves.base import REAL, TEXT, Slave
from .system import Link, System

NUDGE = 1e-6
"""Change of an input, relative to 1 + its size."""


def probe(system: System) -> None:
    """Find out what outputs answer to at once where an FMU does not say (`Slave.answers`).

    By FMI such an output may depend on every input, which would make loops of all that are connected both ways; so each
    connected real is nudged, and what does not follow counts as not dependent. What is nudged is put back.
    """
    for name, slave in system.slaves.items():
        silent = [s for s in slave.outputs if s.family != TEXT and slave.feed_through(s.name) is None]
        inputs = dict.fromkeys(k.target for k in system.links_to(name) if k.target.family == REAL)
        if not silent or not inputs:
            continue
        give, take = handles(system, name)
        places = {s.name: slice(s.place, s.place + s.size) for s in silent}
        found: dict[str, list[str]] = {s.name: [] for s in silent}
        reals, bits = system.board.reals, system.board.integers
        with suppress(CosimError):  # what cannot be read here is told by the first step
            give.once()
            take.once()
            before = {output: bits[where].copy() for output, where in places.items()}
            for target in inputs:
                for place in filter(lambda p: np.isfinite(reals[p]), range(target.place, target.place + target.size)):
                    with _nudged(system, slave, target.name, place):
                        give.once()
                        take.once()
                    for output, where in places.items():
                        if target.name not in found[output] and not np.array_equal(bits[where], before[output]):
                            found[output].append(target.name)
            give.once()
            take.once()
            slave.answers = found


@contextmanager
def _nudged(system: System, slave: Slave, name: str, place: int) -> Iterator[float]:
    """An input's slot with a value a little above or, where the FMU allows no more, below its own; the change."""
    reals, (_, most) = system.board.reals, slave.bounds(name)
    u = reals[place]
    nudge = NUDGE * (1.0 + abs(u))
    reals[place] = u - nudge if u + nudge > most else u + nudge
    try:
        yield float(reals[place] - u)
    finally:
        reals[place] = u


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
    reals, y = system.board.reals, output.source.place
    name, place = link.target.component, link.target.place
    give, take = handles(system, name)
    try:
        with _nudged(system, system.slaves[name], link.target.name, place) as nudge:
            give.once()
            take.once()
            changed = float(reals[y])
        give.once()
        take.once()
    except CosimError:
        return float("nan")
    return (changed - float(reals[y])) / nudge
