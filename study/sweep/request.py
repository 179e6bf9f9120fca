"""What is asked of a sweep, from the command line or from Python, and checked against the package."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import UsageError
from ...core.files import name_of_results
from .axes import Axis, parse_axis, settled
from .cases import Case, grid, parse_sample, sample
from .metrics import parse_metric

if TYPE_CHECKING:  # the simulator is imported when it is needed
    from .run import Settings

OWN_COLUMNS = ("case", "failed", "warnings")
"""Columns of the table beside axes and metrics."""


@dataclass(frozen=True)
class SweepRequest:
    """A sweep as it is asked for; texts as the options of `cosim-study sweep` have them, times in s."""

    package: Path
    vary: tuple[str, ...]
    metrics: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    sample: str | None = None
    seed: int = 0
    step: float | None = None
    stop_time: float | None = None
    method: str | None = None
    stimuli: Path | None = None
    processes: int | None = None
    dask: str | None = None
    case_time: float | None = None
    """Longest wall time of a case."""
    retry_failed: bool = False

    @property
    def usual_folder(self) -> Path:
        """Where the results go if nothing else is said."""
        return Path("results") / f"sweep_{name_of_results(self.package)}"


@dataclass(frozen=True)
class SweepPlan:
    """A sweep that can be run."""

    axes: Sequence[Axis]
    kind: str
    """How the cases are drawn; '' for a grid."""
    cases: Sequence[Case]
    settings: Settings
    units: Mapping[str, str]
    """Units by name of an axis or a metric, where they are known."""

    @property
    def labels(self) -> list[str]:
        """The metrics' columns of the table."""
        return [m.label for m in self.settings.metrics]


def make_plan(request: SweepRequest) -> SweepPlan:
    """What is asked, checked against the package."""
    axes = [parse_axis(text) for text in request.vary]
    for axis in axes:
        if axis.name in OWN_COLUMNS:
            raise UsageError(f"--vary {axis.name}=...: the table has a column of that name; name its component, too")
    if request.dask is not None and request.case_time is not None:
        raise UsageError("--case-time: a process of a Dask cluster cannot be ended from here; leave one of them out")
    if request.case_time is not None and not hasattr(signal, "setitimer"):
        raise UsageError("--case-time: this system has no timers for it (docs/platforms.md); leave it out")
    from ...master.algorithms import choose_method
    from ...master.simulation.session import Session
    from ...master.simulation.time_grid import time_grid
    from .run import Settings, check, default_metrics, units, value_of

    metrics = tuple(parse_metric(text) for text in request.metrics)
    texts = fixed_values(request.fixed, axes)
    with Session(request.package) as session:
        value = partial(value_of, session)
        axes = [settled(axis, value) for axis in axes]
        kind, cases = _cases(axes, request)
        fixed = {name: value(name, text) for name, text in texts.items()}
        metrics = metrics or default_metrics(session)
        _, stop, step, _ = time_grid(session.structure, request.stop_time, request.step)
        table_of_inputs = request.stimuli and request.stimuli.resolve()
        method = choose_method(request.method, session.structure.method)
        settings = Settings(metrics, step, stop, method, fixed, table_of_inputs)
        check(session, cases[0], settings, _ends(axes))
        plan = SweepPlan(axes, kind, cases, settings, units(session, [a.name for a in axes], metrics))
    for name in (*(a.name for a in axes), *OWN_COLUMNS):
        if name in plan.labels:
            raise UsageError(f"--metric {name}=...: the table has a column of that name already")
    if len(set(plan.labels)) < len(plan.labels):
        raise UsageError("two metrics have the same name; give them labels: --metric 'late=at(x, 9)'")
    return plan


def _ends(axes: Sequence[Axis]) -> Iterator[Case]:
    """Every value of a list, and of a range the ends and one within, which is no whole number."""
    for axis in axes:
        for value in axis.values or (axis.low, axis.low + 0.381966 * (axis.high - axis.low), axis.high):
            yield {axis.name: value}


def _cases(axes: Sequence[Axis], request: SweepRequest) -> tuple[str, list[Case]]:
    if not request.sample:
        return "", grid(axes)
    kind, number = parse_sample(request.sample)
    cases = sample(axes, kind, number, request.seed)
    for axis in axes:
        drawn = {case[axis.name] for case in cases}
        if left := [str(value) for value in axis.values if value not in drawn]:
            told = f"none of the {len(cases)} cases has {axis.name} = {', '.join(left)}; draw more of them"
            print(f"cosim-study: warning: {told}", file=sys.stderr)
    return kind, cases


def fixed_values(changes: Sequence[str], axes: Sequence[Axis]) -> dict[str, str]:
    """Values of `--set NAME=VALUE` as they are written; none of them may be varied too."""
    from ...master.options import parse_change

    made: dict[str, str] = {}
    for text in changes:
        name, value = parse_change(text)
        if name in {a.name for a in axes}:
            raise UsageError(f"--set {text}: it is varied")
        if name in made:
            raise UsageError(f"--set {text}: it is set already, to {made[name]}")
        made[name] = value
    return made
