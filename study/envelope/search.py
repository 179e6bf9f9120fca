"""How far each design goes, by bisection; and the cheapest designs that go far enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ...core.errors import SimulationError, UsageError
from ...master.algorithms import DEFAULT
from ...master.parallel.pool import Pool
from ..sweep.run import Settings, Task, measure
from .options import Design, Options


@dataclass(frozen=True)
class Question:
    """How far does a design go?"""

    options: Options
    parameters: dict[str, Any]
    method: str = DEFAULT
    """The coupling algorithm of all runs."""


@dataclass(frozen=True)
class Reach:
    """The greatest value of the axis at which everything holds, to within the options' `within`.

    None where it does not hold even at the low end; `whole` where it holds up to the high end. `why`: the low end
    cannot be run; `hole`: a value below at which it does not hold; `beyond`: runs just beyond fail, and why; `absent`:
    what is required and has no number at the low end, as an event that never comes.
    """

    value: float | None
    whole: bool = False
    why: str | None = None
    hole: float | None = None
    beyond: str | None = None
    absent: tuple[str, ...] = ()


def settings(options: Options, method: str = DEFAULT) -> Settings:
    """Those of every run; method: its coupling algorithm."""
    return Settings(tuple(r.metric for r in options.requirements), stop=options.stop_time, method=method)


def holds(options: Options, entry: dict[str, Any]) -> bool:
    """Whether a run's metrics are as required; a run that failed has none."""
    values = entry.get("values", {})
    return all(r.holds(values.get(r.metric.label)) for r in options.requirements)


LOOKS = 3
"""Values below the edge, evenly spaced, at which it is looked whether everything holds there too."""


def reach(package: str, question: Question) -> Reach:
    """The answer, in this process.

    Bisection takes it that what holds at a value holds below it too, which is then looked at in a few places.
    """
    o = question.options

    def at(x: float) -> dict[str, Any]:
        return measure(package, Task(settings(o, question.method), {**question.parameters, o.parameter: x}))

    first = at(o.low)
    if "failed" in first:
        return Reach(None, why=str(first["failed"]))
    if not holds(o, first):
        numbers = first.get("values", {})
        return Reach(None, absent=tuple(r.metric.label for r in o.requirements if numbers.get(r.metric.label) is None))
    low, high = o.low, o.high
    held = {low}
    last = at(high)
    whole = holds(o, last)
    if whole:
        low = high
    while high - low > o.within:
        middle = 0.5 * (low + high)
        entry = at(middle)
        if holds(o, entry):
            held.add(middle)
            low = middle
        else:
            high, last = middle, entry
    beyond = last.get("failed")
    for k in range(LOOKS, 0, -1):
        x = o.low + k / (LOOKS + 1) * (low - o.low)
        if min(abs(x - known) for known in held) > o.within and not holds(o, at(x)):
            return Reach(low, whole, hole=x, beyond=beyond)
    return Reach(low, whole, beyond=beyond)


def reaches(
    pool: Pool, options: Options, designs: Sequence[Design], fixed: dict[str, Any], method: str = DEFAULT
) -> Iterator[tuple[Design, Reach]]:
    """How far each design goes, as soon as it is known; raises `CosimError` where no design says anything."""
    why, never = [], {r.metric.label: str(r.metric) for r in options.requirements}
    questions = [Question(options, {**fixed, **d.parameters}, method) for d in designs]
    for k, answer in pool.each_surviving(reach, questions):
        found = answer if isinstance(answer, Reach) else Reach(None, why=answer.reason)
        why.append(found.why and f"{', '.join(designs[k].changes) or 'the machine as it is'}: {found.why}")
        never = {label: text for label, text in never.items() if label in found.absent}
        yield designs[k], found
    for text in never.values():
        raise UsageError(f"{text} has no number in any design at {options.low:g} {options.unit}: what it waits for "
                         "never comes; is it meant in the connector's unit?")  # fmt: skip
    if all(why):
        raise SimulationError(f"no design can be run at {options.low:g} {options.unit}; {why[0]}")


def cheapest(
    pool: Pool, options: Options, designs: Sequence[Design], at: float, fixed: dict[str, Any], method: str = DEFAULT
) -> tuple[list[Design], int]:
    """All designs of the least cost that hold at that value of the axis, those with fewer changes first; and how many
    could not be run."""
    failed = 0
    for cost in sorted({round(d.cost, 9) for d in designs}):  # 0.1 + 0.2 costs as much as 0.3
        mine = sorted((d for d in designs if round(d.cost, 9) == cost), key=lambda d: len(d.changes))
        tasks = [Task(settings(options, method), {**fixed, **d.parameters, options.parameter: at}) for d in mine]
        good = []
        for k, entry in pool.each_surviving(measure, tasks):
            failed += not isinstance(entry, dict) or "failed" in entry
            if isinstance(entry, dict) and holds(options, entry):
                good.append(k)
        if good:
            return [mine[k] for k in sorted(good)], failed
    return [], failed
