"""What the comparison says in the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...core.display_units import DisplayUnits
from ...core.errors import first_few
from ..page.content import shown_value
from ..simulation.answers import shown_answer
from .compare import Comparison, Run, answers_apart, parameters_apart
from .difference import Difference, Moment, Value

SHOWN, PARAMETERS, WARNINGS = 20, 10, 3
"""Most signals that differ, parameters, and warnings of each run that are listed."""


def report(comparison: Comparison, tolerance: float, display: DisplayUnits) -> Iterator[str]:
    """Lines about two runs."""
    a, b = comparison.a, comparison.b
    yield f"{a.label}: {_about(a)}"
    yield f"{b.label}: {_about(b)}"
    yield from (f"  {text}" for text in remarks(comparison))
    for name, values in answers_apart([a, b]).items():
        told = [shown_answer(value, unit, display) if value is not None else "none" for value, unit in values]
        if told[0] != told[1]:
            yield f"  {name}: {told[0]} -> {told[1]}"
    apart = parameters_apart([a, b])
    for name, values in list(apart.items())[:PARAMETERS]:
        texts = [_parameter(value, unit, display) for value, unit in values]
        yield f"  parameter {name}: {texts[0]} -> {texts[1]}"
    if len(apart) > PARAMETERS:
        yield f"  and {len(apart) - PARAMETERS} more parameters"
    off = [d for d in comparison.differences if d.differs]
    count = len(comparison.differences)
    if not off:
        yield f"the same: {_signals(count)} within {tolerance:g} of their ranges{_largest(comparison)}"
        return
    yield f"different: {len(off)} of {_signals(count)} by more than {tolerance:g} of their ranges"
    yield from _table(off, display, a.label, b.label)


def remarks(comparison: Comparison) -> Iterator[str]:
    """What the reader of the numbers has to know: at which times they are, and what only one of the runs has."""
    a, b, common = comparison.a, comparison.b, comparison.common
    if not common.same:
        span = f"{len(common.times)} rows from {common.times[0]:g} to {common.times[-1]:g} s"
        if common.shared:
            yield f"their times differ: compared at the {span} that both have"
        else:
            yield (
                f"their times differ: compared at the {span} of the one with fewer of them, the other on straight "
                "lines between its rows (switches, whole numbers and texts as held)"
            )
    ends = a.times[-1], b.times[-1]
    if not common.same and abs(ends[0] - ends[1]) > 1e-9 * abs(ends[0]):
        early, late = (a, b) if ends[0] < ends[1] else (b, a)
        yield f"{early.label} ends at {min(ends):g} s, {late.label} at {max(ends):g} s: the rest is not compared"
    for run in (a, b):
        if run.record.summary.get("error"):
            yield f"{run.label} {run.record.summary.get('status')}: {run.record.summary['error']}"
        yield from (f"{run.label} warns: {text}" for text in run.record.listed("warnings")[:WARNINGS])
    for run, names in ((a, comparison.only_a), (b, comparison.only_b)):
        if names:
            yield f"only {run.label} has {_signals(len(names))}: {first_few(names)}"


def _about(run: Run) -> str:
    times = run.times
    place = f"{run.record.name}, " if run.record.name != run.label else ""
    return f"{place}{len(times)} rows from {times[0]:g} to {times[-1]:g} s, {_signals(len(run.names))}"


def _signals(count: int) -> str:
    return f"{count} signal{'s' * (count != 1)}"


def _largest(comparison: Comparison) -> str:
    worst = comparison.differences[0]
    return f"; the most is {worst.relative:.1e} ({worst.name})" if worst.relative > 0.0 else ", to the last bit"


def _parameter(value: Any, unit: str, display: DisplayUnits) -> str:
    if value is None:
        return "none"
    shown = shown_value(value, unit, display)
    return f"{shown['value']} {shown['unit']}".rstrip()


def _table(off: list[Difference], display: DisplayUnits, a: str, b: str) -> Iterator[str]:
    width = max(len(d.name) for d in off[:SHOWN])
    a, b = (label if len(label) <= 12 else f"{label[:11]}…" for label in (a, b))
    values = f"{'t [s]':>9} {a:>12} {b:>12}"
    yield ""
    yield f"  {'':<{width}}  {'first apart':>35}   {'most apart':>35}"
    yield f"  {'signal':<{width}}  {values}   {values}   {'of range':>8} {'unit':>8}"
    for d in off[:SHOWN]:
        if d.remark or d.first is None or d.most is None:
            yield f"  {d.name:<{width}}  cannot be compared: {d.remark}"
            continue
        sizes = [abs(v) for m in (d.first, d.most) for v in (m.a, m.b) if isinstance(v, float)]
        unit, factor, offset = display.of(d.unit, max((v for v in sizes if v < 1e300), default=0.0))
        cells = (_moment(m, factor, offset) for m in (d.first, d.most))
        yield f"  {d.name:<{width}}  {'   '.join(cells)}   {d.relative:>8.2g} {unit:>8}".rstrip()
    if len(off) > SHOWN:
        yield f"  and {len(off) - SHOWN} more"


def _moment(moment: Moment, factor: float, offset: float) -> str:
    def shown(value: Value) -> str:
        text = value if isinstance(value, str) else f"{factor * value + offset:.6g}"
        return text if len(text) <= 12 else f"{text[:11]}…"

    return f"{moment.time:>9.6g} {shown(moment.a):>12} {shown(moment.b):>12}"
