"""How far each design goes, by bisection; and the cheapest designs that go far enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ...core.errors import SimulationError
from ...master.pool import Pool
from ..sweep.run import Settings, Task, measure
from .options import Design, Options


@dataclass(frozen=True)
class Question:
    """How far does a design go?"""

    options: Options
    parameters: dict[str, Any]


@dataclass(frozen=True)
class Reach:
    """The greatest value of the axis at which everything holds, to within the options' `within`.

    None where it does not hold even at the low end; `whole` where it holds up to the high end.
    """

    value: float | None
    whole: bool = False


def settings(options: Options) -> Settings:
    """Those of every run."""
    return Settings(tuple(r.metric for r in options.requirements), stop=options.stop_time)


def holds(options: Options, entry: dict[str, Any]) -> bool:
    """Whether a run's metrics are as required; a run that failed has none."""
    values = entry.get("values", {})
    return all(r.holds(values.get(r.metric.label)) for r in options.requirements)


def reach(package: str, question: Question) -> Reach | str:
    """The answer, in this process; a text where even the low end cannot be run.

    Bisection takes it that what holds at a value holds below it too.
    """
    o = question.options

    def at(x: float) -> dict[str, Any]:
        return measure(package, Task(settings(o), {**question.parameters, o.parameter: x}))

    first = at(o.low)
    if "failed" in first:
        return str(first["failed"])
    if not holds(o, first):
        return Reach(None)
    if holds(o, at(o.high)):
        return Reach(o.high, whole=True)
    low, high = o.low, o.high
    while high - low > o.within:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(o, at(middle)) else (low, middle)
    return Reach(low)


def reaches(
    pool: Pool, options: Options, designs: Sequence[Design], fixed: dict[str, Any],
    progress: Callable[[], None] = lambda: None,
) -> list[Reach]:  # fmt: skip
    """How far each design goes."""
    found: dict[int, Reach] = {}
    for k, answer in pool.each(reach, [Question(options, {**fixed, **d.parameters}) for d in designs]):
        if isinstance(answer, str):
            raise SimulationError(f"{', '.join(designs[k].changes) or 'the machine as it is'}: {answer}")
        found[k] = answer
        progress()
    return [found[k] for k in range(len(designs))]


def cheapest(
    pool: Pool, options: Options, designs: Sequence[Design], at: float, fixed: dict[str, Any]
) -> list[Design]:
    """All designs of the least cost that hold at that value of the axis; those with fewer changes first."""
    for cost in sorted({round(d.cost, 9) for d in designs}):  # 0.1 + 0.2 costs as much as 0.3
        mine = sorted((d for d in designs if round(d.cost, 9) == cost), key=lambda d: len(d.changes))
        tasks = [Task(settings(options), {**fixed, **d.parameters, options.parameter: at}) for d in mine]
        good = sorted(k for k, entry in pool.each(measure, tasks) if holds(options, entry))
        if good:
            return [mine[k] for k in good]
    return []
