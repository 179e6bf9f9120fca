"""Power bonds and the residual energy of the coupling (Sadjina et al. 2017, ECCO).

Two opposite connections between two components whose units multiply to a power form a bond. What one side believes to
hand over in a step, its output times its held input, differs from what the other side believes: the difference is
energy that the coupling creates or destroys.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .slave import Slave
from .system import Link, System

_POWER = {"kg": 1, "m": 2, "s": -3}
_BASE = ("kg", "m", "s", "A", "K", "mol", "cd")


def _exponents(slave: Slave, variable: str) -> dict[str, int] | None:
    name = slave.unit(variable)
    for unit in slave.description.unitDefinitions:
        if unit.name == name and unit.baseUnit is not None:
            if getattr(unit.baseUnit, "factor", 1.0) not in (1.0, "1", None):
                return None
            return {b: int(getattr(unit.baseUnit, b) or 0) for b in _BASE}
    return None


@dataclass(frozen=True)
class Bond:
    """A pair of links that carry effort and flow in opposite directions."""

    forth: Link
    back: Link

    @property
    def name(self) -> str:
        """The two outputs, e.g. 'hydraulics.F_h x arm.v_h'."""
        return f"{'.'.join(self.forth.start)} x {'.'.join(self.back.start)}"


def find_bonds(system: System) -> list[Bond]:
    """All pairs of opposite links whose units multiply to watts."""

    def unit(end: tuple[str, str]) -> dict[str, int] | None:
        return _exponents(system.slaves[end[0]], end[1])

    bonds = []
    for a, b in combinations(system.links, 2):
        if (a.start[0], a.end[0]) != (b.end[0], b.start[0]):
            continue
        ua, ub = unit(a.start), unit(b.start)
        if ua is None or ub is None:
            continue
        product = {key: ua[key] + ub[key] for key in _BASE if ua[key] + ub[key]}
        if product == _POWER:
            bonds.append(Bond(a, b))
    return bonds


class ResidualEnergy:
    """Sums up the residual energy of each bond from blocks of recorded communication points."""

    def __init__(self, bonds: list[Bond]):
        self.bonds = bonds
        self.absolute = np.zeros(len(bonds))
        self.net = np.zeros(len(bonds))
        self.exchanged = np.zeros(len(bonds))
        self._last: tuple[float, np.ndarray, np.ndarray] | None = None

    def add(self, time: np.ndarray, read: np.ndarray, given: np.ndarray) -> None:
        """Take in rows of times (n,), outputs at these times (n, outputs) and inputs held from then on (n, inputs)."""
        if not self.bonds or len(time) == 0:
            return
        if self._last is not None:
            time = np.concatenate([[self._last[0]], time])
            read = np.concatenate([self._last[1][None], read])
            given = np.concatenate([self._last[2][None], given])
        self._last = (float(time[-1]), read[-1].copy(), given[-1].copy())
        h = np.diff(time)
        for i, bond in enumerate(self.bonds):
            # each side: its output at the end of the step times the input that it held during the step
            left = read[1:, bond.forth.source] * given[:-1, bond.back.target]
            right = given[:-1, bond.forth.target] * read[1:, bond.back.source]
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
