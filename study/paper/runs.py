"""Runs the paper's cases with the package's FMUs and answers what the figures and claims ask of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from ...core.errors import CosimError, SimulationError, UsageError
from ...master.parallel.pool import Failure, Job
from ...master.results.measures import reaches
from ...master.simulation.session import Session
from .cases import DEEPEST, RAMP, RECORD, STOP, T_DOWN, T_START, Case, all_cases
from .choices import OURS, Choices

STEP = 1e-3


@dataclass(frozen=True)
class Run:
    """The signals of a run (n, len(RECORD)) at the times t [s]."""

    case: Case
    t: np.ndarray
    rows: np.ndarray
    choices: Choices = OURS
    arrivals: dict[tuple[float, ...], float] = field(default_factory=dict, repr=False, compare=False)
    """Times that have been looked for; a run is asked for the same ones with many choices."""

    def __getitem__(self, name: str) -> np.ndarray:
        """The signal of that name, without its component where that is clear."""
        return self.rows[:, next(k for k, r in enumerate(RECORD) if name in (r, r.partition(".")[2]))]

    @property
    def target(self) -> float:
        """Target of the command [m]."""
        return float(self.case.parameters["hydraulics.command.target"])

    def _first(self, goal: float, start: float) -> float:
        """Seconds from `start` until x_h is at the goal (`choices.done`) for the first time; infinite if never."""
        key = goal, start, self.choices.done
        if key not in self.arrivals:
            found = reaches(self.t, self["x_h"], goal, self.choices.done, start)
            self.arrivals[key] = float("inf") if found is None else found
        return self.arrivals[key]

    @property
    def extension(self) -> float:
        """Time of the extension [s]."""
        return self._first(self.target, T_START)

    @property
    def retraction(self) -> float:
        """Time of the retraction [s], from wherever the extension has come to."""
        return self._first(0.0, T_DOWN)

    @property
    def arrives(self) -> bool:
        """It reaches the target before it is sent back."""
        return self.extension < T_DOWN - T_START

    @property
    def behind(self) -> float:
        """How late the extension is: its time [s]; for one that never arrives longer, the more is missing."""
        if self.arrives:
            return self.extension
        return T_DOWN - T_START + 1e3 * (self.target - float(self["x_h"].max()))

    @property
    def on_time(self) -> bool:
        """Both motions take what the command takes; the loop itself lags by some hundredths."""
        return max(self.extension, self.retraction) <= RAMP + self.choices.late

    @property
    def lag(self) -> float:
        """Greatest distance [m] from the command, overshoot included."""
        return float(np.abs(self["x_cmd"] - self["x_h"]).max())

    def full(self, opening: float) -> float:
        """Share of the extension's command during which the spool is open by more than `opening`."""
        ramp = (self.t > T_START) & (self.t < T_START + RAMP)
        return float((np.abs(self["x_v"][ramp]) > opening).mean())

    def at(self, name: str, t: float | None = None) -> float:
        """A signal at a time [s]; without one in mid-extension (`choices.mid`)."""
        t = T_START + self.choices.mid if t is None else t
        k = min(max(int(self.t.searchsorted(t)), 1), len(self.t) - 1)
        return float(np.interp(t, self.t[k - 1 : k + 1], self[name][k - 1 : k + 1]))  # a whole column takes a copy

    @property
    def overflow(self) -> float:
        """Energy [J] that the flow through the relief valve turns into heat."""
        power = self["Qrv"] * (self["Pp"] - self["Pt"])
        return float(np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(self.t)))

    @property
    def losses(self) -> tuple[float, float]:
        """Pressure losses [Pa] of the lines a-1 and 2-b in mid-extension."""
        return self.at("Pa") - self.at("P1"), self.at("P2") - self.at("Pb")


class Runs:
    """The runs of the study by their case, looked at with what the paper does not say chosen so."""

    def __init__(self, made: Mapping[tuple[tuple[str, float], ...], Run], choices: Choices = OURS):
        self._made = made
        self.choices = choices

    def __getitem__(self, case: Case) -> Run:
        return replace(self._made[case.key], case=case, choices=self.choices)

    def chosen(self, choices: Choices) -> Runs:
        """The same runs with other choices."""
        return Runs(self._made, choices)

    def of(self, cases: Sequence[Case]) -> list[Run]:
        """The runs of the cases."""
        return [self[c] for c in cases]


def check(package: Path) -> None:
    """Raise `CosimError` where the package is no machine of the paper: it has not what the cases set and record."""
    with Session(package) as session:
        try:
            for name in RECORD:
                session.signal(name)
            session.values(DEEPEST.parameters)
        except CosimError as error:
            raise UsageError(f"{package} is not the paper's machine: {error}") from None


class Runner(Protocol):
    """What runs jobs: a `Pool`, or one process."""

    def run(self, jobs: Sequence[Job]) -> list[np.ndarray | Failure]:
        """The results in the order of the jobs."""
        ...


def simulate(pool: Runner, fixed: Mapping[str, float] | None = None) -> Runs:
    """All runs, with further parameters that are the same in all; raises `SimulationError` when one has to stop."""
    cases = all_cases()
    found = pool.run([Job(RECORD, STOP, STEP, {**c.parameters, **(fixed or {})}) for c in cases])
    made = {}
    t = np.arange(round(STOP / STEP) + 1) * STEP
    for case, rows in zip(cases, found, strict=True):
        if isinstance(rows, Failure):
            raise SimulationError(f"{case.label} ({dict(case.parameters)}): {rows.reason}")
        made[case.key] = Run(case, t, rows)
    return Runs(made)
