"""From a package and run files to the draft of a campaign."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.errors import PackageError
from ...core.units import convert, unit
from ..campaign.campaign import CampaignError
from ..campaign.catalogue import Catalogue
from ..campaign.read_catalogue import load_from_package
from ..checks.shapes import Signal, compare
from ..measurements.table import MeasurementError
from ..problem.noise import estimate_channel_noise
from ..settings import CHECKS, DEFAULT, ONBOARDING
from . import declared_effects
from .clock import Clock, read_clock
from .columns import ColumnOfRuns, Matched, match_columns
from .conditions import Condition, Usual, condition_of, is_held_out, parameters_called, short_name, stated_in
from .draft import Draft, RunDraft, Unmatched
from .headings import readings
from .model import Model, Parameter
from .sources import Source, load, side_by_side, with_interval


def guess(model: Model, files: Sequence[Path], name: str, rate: float | None) -> Draft:
    """The draft; rate: samples a second of files without times. Raises `CampaignError` for a file that is no run."""
    sources = _load(files, rate)
    catalogue = _catalogue(model.path)
    usual = {e.parameter: e.values for e in catalogue.experiments} if catalogue else {}
    timed = [_timed(s, model) for s in sources]
    clocks = [read_clock(s, model) for s in timed]
    columns = _columns(timed, clocks)
    conditions = [_conditions(s, columns, r, model, usual) for r, s in enumerate(timed)]
    parameters = [{c.parameter: c.value for c in found} for found in conditions]
    matched = match_columns(columns, model, parameters, spread(len(timed), ONBOARDING.shown_runs))
    clocks = [_aligned(clock, r, columns, matched) for r, clock in enumerate(clocks)]
    alike = set.intersection(*({x.text for x in stated_in(s.name)} for s in timed))
    runs = tuple(
        _run(s, clock, tuple(found), r, columns, matched, sources[r].timeless, alike)
        for r, (s, clock, found) in enumerate(zip(timed, clocks, conditions, strict=True))
    )
    interval = float(np.median([np.median(np.diff(clock.times(s))) for s, clock in zip(timed, clocks, strict=True)]))
    written = None if catalogue else declared_effects.catalogue(model.parameters, interval)
    has_effects = bool(catalogue and catalogue.effects) or bool(declared_effects.rows(model.parameters))
    said = {c.parameter for found in conditions for c in found}
    base = () if catalogue and catalogue.base else _base(model, said)
    return Draft(
        name, matched.matches, _noise(columns, matched), _unmatched(columns, matched, said, model), runs, base, {},
        matched.failure, written, has_effects, _remarks(timed),
    )  # fmt: skip


def _load(files: Sequence[Path], rate: float | None) -> list[Source]:
    sources: list[Source] = []
    for path in files:
        try:
            sources += side_by_side(load(path, rate))
        except MeasurementError as error:
            raise CampaignError(str(error)) from None
    names = [s.name for s in sources]
    return [
        replace(s, name=f"{s.file.parent.name}_{s.name}") if names.count(s.name) > 1 and s.file.parent.name else s
        for s in sources
    ]


def _catalogue(package: Path) -> Catalogue | None:
    """The package's own catalogue, if it has one."""
    if package.suffix.lower() != ".ssp":
        return None
    try:
        return load_from_package(package)
    except PackageError as error:
        if "holds no resources" in str(error):
            return None
        raise


def _timed(source: Source, model: Model) -> Source:
    """A run that has no times, as long as the scenario, or a macro step for each reading."""
    if not source.timeless:
        return source
    interval = model.stop / (len(source.time) - 1) if model.stop else model.step or 1.0
    return with_interval(source, interval)


def _columns(sources: Sequence[Source], clocks: Sequence[Clock]) -> list[ColumnOfRuns]:
    made = []
    for name in dict.fromkeys(name for s in sources for name in s.columns):
        signals, stated = {}, None
        for r, (s, clock) in enumerate(zip(sources, clocks, strict=True)):
            if name in s.columns:
                times, values = clock.times(s), s.columns[name].values
                used = np.isfinite(values) & (times >= -1e-9)
                if used.sum() > 2:
                    signals[r] = Signal(times[used], values[used])
                stated = stated or s.columns[name].unit
        if signals:
            made.append(ColumnOfRuns(name, stated, signals))
    return made


def _conditions(source: Source, columns: Sequence[ColumnOfRuns], r: int, model: Model, usual: Usual) -> list[Condition]:
    """What the file's name and columns that do not change say of a run."""
    found = {c.parameter: c for s in stated_in(source.name) if (c := condition_of(s, model, usual)) is not None}
    for column in columns:
        if r not in column.signals or not column.is_constant:
            continue
        if (condition := _constant(column, r, model, usual)) is not None:
            found.setdefault(condition.parameter, condition)
    return list(found.values())


def _constant(column: ColumnOfRuns, r: int, model: Model, usual: Usual) -> Condition | None:
    value = float(np.median(column.signals[r].y))
    for reading in readings(column.name, column.stated):
        called = parameters_called(" ".join(reading.words), model, usual)
        names = {short_name(p, model) for p in called}
        if len(names) != 1:
            continue
        p = called[0]
        if reading.unit is not None and p.unit is not None:
            if not unit(reading.unit).same_dimension(unit(p.unit)):
                continue
            value = convert(value, reading.unit, p.unit)
        return Condition(names.pop(), float(f"{value:.12g}"), f"the column '{column.name}', which does not change")
    return None


def spread(count: int, most: int) -> list[int]:
    """Some of so many runs, from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))})


def _aligned(clock: Clock, r: int, columns: Sequence[ColumnOfRuns], matched: Matched) -> Clock:
    """The clock of a run that nothing measured drives, with the start at which it moves as the model does."""
    if r not in matched.nominal or any(m.connector.is_input for m in matched.matches):
        return clock
    best = None
    for m in matched.matches:
        column = next(c for c in columns if c.name == m.column)
        if r not in column.signals:
            continue
        found = compare(
            column.signals[r], matched.nominal[r][m.connector.address], ONBOARDING.points, ONBOARDING.longest_shift
        )
        if (
            found.shifted > CHECKS.follows
            and found.correlation < CHECKS.follows_not
            and (best is None or found.shifted > best.shifted)
        ):
            best = found
    if best is None:
        return clock
    start = float(f"{(clock.start or 0.0) + float(f'{best.shift:.4g}'):.12g}")
    doubt = f"does the model start at {start:g} s of the file? It then moves as the model does"
    return replace(clock, start=start, doubt=doubt)


def _run(
    source: Source, clock: Clock, conditions: tuple[Condition, ...], r: int, columns: Sequence[ColumnOfRuns],
    matched: Matched, timeless: bool, alike: Collection[str],
) -> RunDraft:  # fmt: skip
    doubts = [clock.doubt] if clock.doubt else []
    if timeless:
        apart = float(np.median(np.diff(source.time)))
        doubts.append(f"how far are its readings apart? It has no times; {apart:g} s were taken (--rate says it)")
    elif clock.start is not None and not clock.doubt:
        doubts.append(f"is the model's 0 s at its first reading ({clock.start:g} s)?")
    said = " ".join(c.said for c in conditions)
    for stated in stated_in(source.name):
        if stated.text in alike:  # tells no runs apart
            continue
        if f"'{stated.text}'" not in said and not _is_measured(stated.value, stated.unit, r, columns, matched):
            doubts.append(f"'{stated.text}' in the file's name: which parameter does it set?")
    return RunDraft(source, clock, conditions, "holdout" if is_held_out(source.name) else None, tuple(doubts))


def _is_measured(value: float, name: str, r: int, columns: Sequence[ColumnOfRuns], matched: Matched) -> bool:
    """Whether a number in the file's name is the level or the largest reading of a channel in that unit."""
    for m in matched.matches:
        column = next(c for c in columns if c.name == m.column)
        if r not in column.signals or not name:
            continue
        stated = next((x.unit for x in readings(f"x [{name}]", None)), None)
        if stated is None or not unit(stated).same_dimension(unit(m.unit)):
            continue
        y = np.abs(column.signals[r].y) * unit(m.unit).factor / unit(stated).factor
        if any(
            abs(float(level) - abs(value)) <= ONBOARDING.near_level * abs(value) for level in (np.median(y), y.max())
        ):
            return True
    return False


def _noise(columns: Sequence[ColumnOfRuns], matched: Matched) -> dict[str, float]:
    """Noise of each output's column, as estimated, in the unit that the channel has once it is scaled."""
    made = {}
    for m in matched.matches:
        column = next(c for c in columns if c.name == m.column)
        if not m.connector.is_input:
            estimates = [estimate_channel_noise(s.y, DEFAULT.noise, s.t) for s in column.signals.values()]
            made[m.column] = abs(m.scale) * float(np.median(estimates))
    return made


def _unmatched(
    columns: Sequence[ColumnOfRuns], matched: Matched, said: set[str], model: Model
) -> tuple[Unmatched, ...]:
    used = {m.column for m in matched.matches}
    made = []
    for c in columns:
        if c.name in used:
            continue
        if c.is_constant and any(
            short_name(p, model) in said for x in readings(c.name, c.stated)
            for p in parameters_called(" ".join(x.words), model, dict.fromkeys(said, ()))
        ):  # fmt: skip
            continue  # a condition
        stated = next((x.unit for x in readings(c.name, c.stated) if x.unit), None)
        candidates = tuple(matched.candidates.get(c.name, ()))
        taken = {m.connector.address for m in matched.matches}
        free = tuple(a for a in candidates if a not in taken)
        made.append(Unmatched(c.name, float(c.values.min()), float(c.values.max()), free, stated))
    return tuple(made)


def _base(model: Model, said: set[str]) -> tuple[Parameter, ...]:
    """Parameters of numbers that are there, are no effect and no condition: it may be asked how well they are known."""
    return tuple(
        p for p in model.parameters
        if isinstance(p.value, float) and p.value not in (0.0, 1.0) and declared_effects.said(p) is None
        and short_name(p, model) not in said
    )[: ONBOARDING.asked_base]  # fmt: skip


def _remarks(sources: Sequence[Source]) -> tuple[str, ...]:
    """What was unusual about the files, each said once."""
    by_text: dict[str, list[str]] = {}
    for s in sources:
        for remark in s.remarks:
            by_text.setdefault(remark, []).append(s.file.name)
    return tuple(f"{', '.join(dict.fromkeys(names[:3]))}{' ...' if len(names) > 3 else ''}: {text}"
                 for text, names in by_text.items())  # fmt: skip
