"""Warnings about a session's runs, by what these exchanged."""

from __future__ import annotations

import numpy as np

from ..algorithms import method_named
from ..coupling.power_bonds import find_bonds
from ..coupling.residual_energy import ResidualEnergy
from ..slaves.base import fmu_warnings
from .session import Session


class SessionWarnings:
    """Warnings about the runs of a session."""

    def __init__(self, session: Session):
        self.session = session
        self.bonds = [bond for bond in find_bonds(session.system) if not bond.of_elements]  # sessions record no arrays
        outputs = [s for b in self.bonds for s in (b.forth.source, b.back.source)]
        inputs = [s for b in self.bonds for s in (b.forth.target, b.back.target)]
        self.record = [s.address for s in (*outputs, *inputs)]
        """Signals that a run has to record, in this order."""
        self._slots = [s.place for s in outputs], [s.place for s in inputs]

    def warnings(self, t: np.ndarray, rows: np.ndarray, method: str) -> list[str]:
        """Of the session's last run, which recorded rows (n, len(record)) at times t (n,)."""
        instances = self.session.system.instances.values()
        interpolating = method_named(method).interpolating(instances)
        energy = ResidualEnergy(self.bonds, *self._slots, [(0.0, 0.0)] * len(self.bonds), interpolating)
        energy.add(t, rows)
        return list(dict.fromkeys([*fmu_warnings(instances), *energy.warnings()]))
