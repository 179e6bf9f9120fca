"""Gauss-Seidel with nearly energy-preserving coupling elements (after Sadjina & Pedersen 2019).

What an input is held at differs, in the mean over a step, from what the output does in that step. A component that
comes after its source knows the output at both ends of the step: the mean itself is held. For one that comes before,
half of the output's last change is added, which is what holding its value lacked in the last step.
"""

from __future__ import annotations

from ..agreement import refresh, renew, stale
from ..engine.program import Program
from ..system import System
from ._history import blend
from .extrapolation import AHEAD

MEAN = -0.5
"""Half a step back: the mean of the newest value and the one before."""


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    order = {name: i for i, name in enumerate(system.order)}
    late = stale(system)[0]
    for name in system.order:
        links = system.links_to(name)
        for link in links:
            source, instead = link.source, None
            if system.is_continuous(link) and source.component:
                ahead = MEAN if order[source.component] < order[name] else AHEAD
                instead = {source.place: blend(system, program, source.place, source.size, ahead)}
            system.pass_on(program, link, instead)
        program.advance([system.slaves[name]])
        if name in late:  # its outputs are to answer to inputs at the end of the step, as far as these are known
            before = [k for k in links if order.get(k.source.component, len(order)) < order[name]]
            renew(system, program, [name], [k for k in before if system.is_continuous(k)])
    refresh(system, program)
