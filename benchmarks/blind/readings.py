"""What the sensors of a case would read without noise, with any of its effects and any base parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .case import BASE, GRID, Array, Case, Wrong, erring, machine_of, span_of
from .measure import Channel, ideal
from .plant import simulate
from .refit import SCAN, left_by_refit


class Readings:
    """Readings of all runs and channels of a case in one vector (n,), each divided by the standard deviation of its
    noise; nothing random in them, neither a sensor's own bias nor the recording's delay."""

    def __init__(self, case: Case):
        self.case = case
        self.plain = self.signals(case.factors, ())
        self.spans = {c.kind.key: span_of(self.plain, c) for c in case.channels}
        self.reading = self.whitened(self.plain, case.channels)

    def signals(self, factors: Mapping[str, float], wrong: tuple[Wrong, ...]) -> list[Array]:
        """Signals of the plant by run, a row per point of the grid; may raise `PlantError`."""
        return [
            simulate(machine_of(run, factors, wrong), np.arange(round(run.stop / GRID) + 1) * GRID)
            for run in self.case.runs
        ]

    def whitened(self, signals: list[Array], channels: tuple[Channel, ...], delay: float = 0.0) -> Array:
        """Readings (n,) of the signals with the errors of the channels and a common delay (s)."""
        parts = []
        for run, s in zip(self.case.runs, signals, strict=True):
            grid = np.arange(s.shape[0]) * GRID
            parts += [ideal(c, grid, s, run.at, delay) / c.std for c in channels]
        return np.concatenate(parts)

    def change(self, wrong: tuple[Wrong, ...]) -> Array:
        """What effects change in all readings (n,), base parameters as they truly are."""
        machine = any(w.column is None for w in wrong)
        signals = self.signals(self.case.factors, wrong) if machine else self.plain
        return self.whitened(signals, erring(self.case.channels, wrong, self.spans)) - self.reading

    def left(
        self, target: Array, wrong: tuple[Wrong, ...] = (), enough: float = 0.0, scan: int = SCAN
    ) -> float:  # fmt: skip
        """RMS of what the best refit of the base parameters, with these effects in the machine, leaves of the target
        readings (n,); not looked for below `enough`. scan: values at which each parameter is tried alone."""
        channels = erring(self.case.channels, wrong, self.spans)

        def model(b: Array) -> Array:
            factors = dict(zip(BASE, b.tolist(), strict=True))
            return self.whitened(self.signals(factors, wrong), channels)

        return left_by_refit(
            model,
            target,
            np.array([self.case.factors[address] for address in BASE]),
            self.case.tolerance,
            [(run.at.size, run.rate) for run in self.case.runs for _ in self.case.channels],
            enough,
            scan,
        )
