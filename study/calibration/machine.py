"""What a linkage does in the machine's package: the four times, and the paper's claims. Each is computed once.

A run costs 0.05 to 0.2 s of CPU in the package, a tenth of what `calibrate.run` takes. What was computed is kept on
disk, so the same search, which draws the same sample, goes on where it was stopped.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import CosimError
from ...core.versions import versions
from ...master.parallel.pool import Failure, Job, session, simulate
from ...master.simulation.manifest import digest as digest_of_file
from ..calibrate import travel_times
from ..paper import runs
from ..paper.cases import STOP, TIMES
from ..paper.choices import OURS
from ..paper.claims import judged
from ..paper.lines import Lines, responses
from ..sweep.store import Store, digest
from ..table1 import Result, table
from .buildable import Linkage, as_values

COARSE, QUICK, EXACT = (8e-3, "gauss-seidel"), (8e-3, "nepce"), (1e-3, "gauss-seidel")
"""Step [s] and coupling of the sample (its times are within 0.15 % of those at 1 ms), of the fits (0.03 %), and of what
is shipped."""


class Machine:
    """The package's machine with any linkage; a context manager that holds the folder of its results."""

    def __init__(self, package: Path, folder: Path):
        self.package = str(package.resolve())
        self.simulated = 0
        """Runs that were not on disk yet."""
        self._store = Store(folder)
        self._same = {"package": digest_of_file(package), "versions": versions()}
        self._of_lines: tuple[Sequence[Result], Lines] | None = None

    def __enter__(self) -> Machine:
        self._store.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._store.__exit__(*error)

    def times(self, of: Linkage, how: tuple[float, str] = QUICK) -> np.ndarray | None:
        """The four times [s] in the order of `calibrate.PUBLISHED`; None where the machine cannot be run."""
        step, method = how
        name = self._name("times", of, step=step, method=method)
        if (entry := self._store.get(name)) is None:
            entry = self._timed(of, step, method)
            self._store.put(name, entry)
        return np.array(list(entry["values"].values())) if "values" in entry else None

    def _timed(self, of: Linkage, step: float, method: str) -> dict[str, Any]:
        found: dict[str, float] = {}
        for variable in TIMES:
            changes = {**of.parameters, "hydraulics.line.variable_viscosity": variable}
            self.simulated += 1
            try:
                t, rows = session(self.package).run(("arm.x_h",), STOP, step, changes, method=method)
            except CosimError as error:
                return {"failed": str(error)}
            for what, time in zip(("out", "in"), travel_times(t, rows[:, 0]), strict=True):
                found[f"{what}, {'variable' if variable else 'constant'}"] = time
        return {"values": found}

    def claims(self, of: Linkage) -> dict[str, bool] | None:
        """Whether each of the paper's claims holds, by place and text; None where a run of the study fails."""
        name = self._name("claims", of, claims=claims_of_code())
        if (entry := self._store.get(name)) is None:
            try:
                if self._of_lines is None:
                    self._of_lines = table(), responses()  # no linkage moves these
                made = runs.simulate(self, of.parameters)
                entry = {"values": {f"{c.where}: {c.text}": c.holds for c in judged(*self._of_lines, made, OURS)}}
            except CosimError as error:
                entry = {"failed": str(error)}
            self._store.put(name, entry)
        return entry.get("values")

    def run(self, jobs: Sequence[Job]) -> list[np.ndarray | Failure]:
        """The jobs one after the other in this process; what `runs.simulate` asks of a pool."""
        self.simulated += len(jobs)
        return [simulate(self.package, job) for job in jobs]

    def _name(self, what: str, of: Linkage, **how: Any) -> str:
        return digest({**self._same, "what": what, "linkage": as_values(of), **how})


def claims_of_code() -> str:
    """A digest of the code that judges claims: another judgement is another result."""
    folder = Path(runs.__file__).parent
    names = "cases.py", "choices.py", "claims.py", "runs.py"
    return digest({name: (folder / name).read_text(encoding="utf-8") for name in names})
