"""Power bonds and the residual energy of the coupling (Sadjina et al. 2017, ECCO).

Two opposite connections between two components whose units multiply to a power form a bond; a package may declare
others. What one side believes to hand over in a step, its output times its held input, differs from what the other side
believes: the difference is energy that the coupling creates or destroys.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..core.units import Unit
from .results.columns import Layout
from .slaves.base import REAL
from .system import Link, System

_POWER = {"kg": 1, "m": 2, "s": -3}

TRUSTED = 0.1
"""Share of residual energy above which a run warns."""


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
            bonds.append(Bond(a, b, factor))
    return bonds


class ResidualEnergy:
    """Sums up the residual energy of each bond from blocks of recorded communication points."""

    def __init__(self, bonds: list[Bond], layout: Layout):
        self.bonds = bonds
        outputs = {place: i for i, place in enumerate(layout.outputs)}
        inputs = {place: len(layout.outputs) + i for i, place in enumerate(layout.inputs)}
        self._columns = [
            (outputs[b.forth.source.place], inputs[b.back.target.place], inputs[b.forth.target.place],
             outputs[b.back.source.place], b.back.cast.factor / b.forth.cast.factor)
            for b in bonds
        ]  # fmt: skip
        self.absolute = np.zeros(len(bonds))
        self.net = np.zeros(len(bonds))
        self.exchanged = np.zeros(len(bonds))
        self._last: tuple[float, np.ndarray] | None = None

    def add(self, time: np.ndarray, rows: np.ndarray) -> None:
        """Take in rows (n, outputs + inputs): outputs at times (n,) and inputs held from then on."""
        if not self.bonds or len(time) == 0:
            return
        if self._last is not None:
            time = np.concatenate([[self._last[0]], time])
            rows = np.concatenate([self._last[1][None], rows])
        self._last = (float(time[-1]), rows[-1].copy())
        h = np.diff(time)
        for i, (bond, (y_a, u_a, u_b, y_b, ratio)) in enumerate(zip(self.bonds, self._columns, strict=True)):
            # each side: its output at the end of the step times the input that it held during the step
            left = bond.watts * rows[1:, y_a] * rows[:-1, u_a]
            right = bond.watts * ratio * rows[:-1, u_b] * rows[1:, y_b]
            self.absolute[i] += np.sum(np.abs(left - right) * h)
            self.net[i] += np.sum((left - right) * h)
            self.exchanged[i] += np.sum(0.5 * np.abs(left + right) * h)

    def summary(self) -> list[dict[str, float | str]]:
        """Per bond: its name, residual energy (sum of absolute values, and net) and energy exchanged [J]."""
        return [
            {
                "bond": bond.name,
                "residual_energy_J": float(self.absolute[i]),
                "net_residual_energy_J": float(self.net[i]),
                "exchanged_energy_J": float(self.exchanged[i]),
                "relative": float(self.absolute[i] / self.exchanged[i]) if self.exchanged[i] > 0 else 0.0,
            }
            for i, bond in enumerate(self.bonds)
        ]

    def warnings(self) -> list[str]:
        """Bonds over which the coupling is not to be trusted."""
        return [
            f"the coupling created or destroyed {bond['relative']:.0%} of the energy exchanged over {bond['bond']}: "
            "do not trust this run; take a shorter step"
            for bond in self.summary()
            if float(bond["relative"]) > TRUSTED
        ]
