"""Which column of the run files is which connector of the package: by name, unit, size, and shape against the model."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...core.units import unit
from ..checks.shapes import Likeness, Signal, compare
from ..checks.unit_mistakes import likelier_unit
from ..settings import CHECKS, NAMES, ONBOARDING
from .headings import Reading, likeness, readings
from .model import Connector, Model

WORKSHOP = ("m", "mm", "cm", "Pa", "bar", "MPa", "kPa", "psi", "N", "kN", "rad", "deg", "m/s", "mm/s", "A", "mA", "V",
            "mV", "L/min", "m3/s", "N.m", "1", "%", "K", "degC")  # fmt: skip
"""Units that a column without one is looked at in."""

ELECTRICAL = ("V", "mV", "A", "mA")
"""Units of what a sensor gives."""


@dataclass(frozen=True, eq=False)
class ColumnOfRuns:
    """A column: its heading, the unit that files state for it, and its readings by run (on the model's clock)."""

    name: str
    stated: str | None
    signals: Mapping[int, Signal]

    @property
    def values(self) -> np.ndarray:
        """All readings (n,)."""
        return np.concatenate([s.y for s in self.signals.values()])

    @property
    def is_constant(self) -> bool:
        """Whether it does not change within any run."""
        return all(np.ptp(s.y) <= ONBOARDING.constant * max(np.abs(s.y).max(), 1e-300) for s in self.signals.values())


@dataclass(frozen=True)
class Match:
    """A column that is a connector: in which unit, why, and what is to be asked about it."""

    column: str
    connector: Connector
    unit: str
    why: str
    doubts: tuple[str, ...] = ()
    scale: float = 1.0
    """What one of its numbers is in the unit."""


@dataclass(frozen=True, eq=False)
class Matched:
    """What was found of the columns, and why the model did not run, where it did not."""

    matches: tuple[Match, ...]
    candidates: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Of each column that is none: connectors that it could be, the likeliest first."""
    failure: str = ""
    nominal: Mapping[int, Mapping[str, Signal]] = field(default_factory=dict)
    """Signals of the model as delivered, of the runs that it was simulated for."""


@dataclass(frozen=True, eq=False)
class _Run:
    """A run that the model is simulated for."""

    index: int
    stop: float
    interval: float
    parameters: Mapping[str, Any]


def match_columns(
    columns: Sequence[ColumnOfRuns], model: Model, parameters: Sequence[Mapping[str, Any]], simulated: Sequence[int]
) -> Matched:
    """What the columns are; parameters: conditions of each run; simulated: runs that the model is held against."""
    moving = [c for c in columns if not c.is_constant]
    runs = [_run(moving, r, parameters[r]) for r in simulated if any(r in c.signals for c in moving)]
    inputs = _inputs_by_name(moving, model)
    rest = [c for c in moving if c.name not in inputs]
    free = [c for c in model.inputs if c.address not in inputs.values()]
    nominal, failure = _nominal(model, runs, moving, inputs)
    if free and rest and not inputs and len(free) <= 3 and runs:
        tried = _inputs_by_trial(model, runs[0], moving, rest, free)
        if tried:
            inputs |= tried
            rest = [c for c in rest if c.name not in tried]
            nominal, failure = _nominal(model, runs, moving, inputs)
    matches = [_input_match(next(c for c in moving if c.name == n), model.connector(a)) for n, a in inputs.items()]
    found, candidates = _assign(rest, model, nominal)
    sensors = _sensors_in_volts(
        [c for c in rest if c.name in candidates], model, nominal, {m.connector.address for m in (*matches, *found)}
    )
    found += sensors
    candidates = {name: x for name, x in candidates.items() if name not in {m.column for m in sensors}}
    return Matched((*matches, *found), candidates, failure, nominal)


def _run(columns: Sequence[ColumnOfRuns], r: int, parameters: Mapping[str, Any]) -> _Run:
    times = [c.signals[r].t for c in columns if r in c.signals]
    return _Run(r, max(float(t[-1]) for t in times), float(np.median(np.diff(times[0]))), parameters)


def _named(column: ColumnOfRuns, connector: Connector) -> tuple[float, Reading | None]:
    """How alike the names are, by the reading of the heading that fits best; 0 where units do not fit."""
    best: tuple[float, Reading | None] = (0.0, None)
    ways = list(readings(column.name, column.stated))
    other_quantity = any(not connector.takes(x.unit) for x in ways)
    for reading in ways:
        if not connector.takes(reading.unit):
            continue
        score = likeness(reading.words, connector.address, connector.description)
        if connector.quantity is not None and reading.unit is not None and score < 1.0:
            score = min(score + NAMES.same_unit, NAMES.most) if score else NAMES.word_beside
        if other_quantity and score < 1.0:  # x_h is no x in hours, but pressure_V is no pressure in Pa
            continue
        if score > best[0]:
            best = score, reading
    return best


def _inputs_by_name(columns: Sequence[ColumnOfRuns], model: Model) -> dict[str, str]:
    """Columns that drive an input of their name and are no output: {column: address}."""
    found: dict[str, str] = {}
    for c in columns:
        scores = {i.address: _named(c, i)[0] for i in model.inputs}
        output = max((_named(c, o)[0] for o in model.outputs), default=0.0)
        address = max(scores, key=scores.__getitem__, default="")
        least = ONBOARDING.like_input if len(model.inputs) <= 3 else ONBOARDING.same_name
        taken = address in found.values()
        if address and scores[address] >= least and scores[address] > output and not taken:
            found[c.name] = address
    return found


def _driving(column: ColumnOfRuns, connector: Connector, r: int) -> Signal:
    """The readings of a run in SI, as they drive an input."""
    name = unit_of_input(column, connector)
    u = unit(name)
    return Signal(column.signals[r].t, column.signals[r].y * u.factor + u.offset)


def unit_of_input(column: ColumnOfRuns, connector: Connector) -> str:
    """The unit of a column that drives an input: its own, else that of the input."""
    _, reading = _named(column, connector)
    stated = [x.unit for x in readings(column.name, column.stated) if x.unit and connector.takes(x.unit)]
    if reading is not None and reading.unit is not None:
        return reading.unit
    return stated[0] if stated else connector.declared or connector.hint or "1"


def _nominal(
    model: Model, runs: Sequence[_Run], columns: Sequence[ColumnOfRuns], inputs: Mapping[str, str]
) -> tuple[dict[int, dict[str, Signal]], str]:
    """Signals of the model as delivered by run, driven by what drives it, and why a run is missing."""
    made: dict[int, dict[str, Signal]] = {}
    failure = ""
    for run in runs:
        driven = {
            a: _driving(c, model.connector(a), run.index)
            for c in columns if (a := inputs.get(c.name)) is not None and run.index in c.signals
        }  # fmt: skip
        result = model.run(run.stop, run.interval, run.parameters, driven)
        if isinstance(result, str):
            failure = failure or result
        else:
            made[run.index] = result
    return made, failure


def _inputs_by_trial(
    model: Model, run: _Run, columns: Sequence[ColumnOfRuns], rest: Sequence[ColumnOfRuns], free: Sequence[Connector]
) -> dict[str, str]:
    """Which columns drive the inputs: those with which the model moves like the other columns."""
    best: tuple[float, dict[str, str]] = (ONBOARDING.least_score, {})
    usable = [c for c in rest if run.index in c.signals]
    for k, chosen in enumerate(permutations(usable, min(len(free), max(len(usable) - 1, 0)))):
        if k >= ONBOARDING.most_trials or not chosen:
            break
        inputs = {c.name: i.address for c, i in zip(chosen, free, strict=False) if _fits(c, i)}
        if len(inputs) < len(chosen):
            continue
        signals, _ = _nominal(model, [run], columns, inputs)
        others = [c for c in usable if c.name not in inputs]
        if run.index not in signals:
            continue
        alike = [
            max(
                (abs(_shape(c, a, {run.index: signals[run.index]}).correlation) for a in signals[run.index]),
                default=0.0,
            )
            for c in others
        ]
        score = float(np.mean(alike)) + ONBOARDING.share_of_names_in_trial * float(
            np.mean([_named(c, i)[0] for c, i in zip(chosen, free, strict=False)])
        )
        if score > best[0] + ONBOARDING.margin:
            best = score, inputs
    return best[1]


def _fits(column: ColumnOfRuns, connector: Connector) -> bool:
    """Whether units allow it."""
    ways = list(readings(column.name, column.stated))
    if all(connector.takes(x.unit) for x in ways):
        return True
    return any(connector.takes(x.unit) and likeness(x.words, connector.address, "") == 1.0 for x in ways)


def _shape(column: ColumnOfRuns, address: str, nominal: Mapping[int, Mapping[str, Signal]]) -> Likeness:
    """How alike a column and an output are, over the runs in the middle."""
    found = [
        compare(column.signals[r], signals[address], ONBOARDING.points, ONBOARDING.longest_shift)
        for r, signals in nominal.items() if r in column.signals
    ]  # fmt: skip
    if not found:
        return Likeness(0.0, 0.0, 0.0, 0.0)
    return sorted(found, key=lambda x: x.correlation)[len(found) // 2]


def _assign(
    columns: Sequence[ColumnOfRuns], model: Model, nominal: Mapping[int, Mapping[str, Signal]]
) -> tuple[list[Match], dict[str, tuple[str, ...]]]:
    """The outputs that the columns are, each at most one; and what else they could be."""
    outputs = model.outputs
    if not columns or not outputs:
        return [], {c.name: () for c in columns}
    names = np.array([[_named(c, o)[0] for o in outputs] for c in columns])
    shapes = [[_shape(c, o.address, nominal) if nominal else None for o in outputs] for c in columns]
    fits = np.array([[_fits(c, o) for o in outputs] for c in columns])
    scores = np.array(
        [[_score(n, s) for n, s in zip(row, s_row, strict=True)] for row, s_row in zip(names, shapes, strict=True)]
    )
    scores[~fits] = -1.0
    alike = np.array([[abs(x.correlation) if x is not None else 0.0 for x in row] for row in shapes])
    rows, places = linear_sum_assignment(-scores)
    found, candidates = [], {}
    chosen = dict(zip(rows.tolist(), places.tolist(), strict=True))
    for i, c in enumerate(columns):
        j = chosen.get(i)
        order = np.argsort(-scores[i])
        likely = tuple(outputs[k].address for k in order[:3] if scores[i, k] > ONBOARDING.proposed_from)
        rivals = [k for k in range(len(outputs)) if k != j and k not in chosen.values()]
        sure = j is not None and (
            names[i, j] >= ONBOARDING.same_name
            or _leads(scores[i], j, rivals, ONBOARDING.least_score, ONBOARDING.margin)
            or (scores[i, j] > 0.0 and _leads(alike[i], j, rivals, ONBOARDING.shape_alone, ONBOARDING.margin_of_shape))
        )
        if j is None or not sure:
            candidates[c.name] = likely
            continue
        found.append(_output_match(c, outputs[j], names[i, j], shapes[i][j]))
    return found, candidates


def _sensors_in_volts(
    columns: Sequence[ColumnOfRuns],
    model: Model,
    nominal: Mapping[int, Mapping[str, Signal]],
    taken: Collection[str],
) -> list[Match]:
    """Columns in volts or amperes that move like another quantity of the model: sensors, with scales that fit."""
    found: list[Match] = []
    for c in columns:
        volts = next((x for x in readings(c.name, c.stated) if x.unit in ELECTRICAL), None)
        if volts is None or not nominal:
            continue
        free = [o for o in model.outputs if o.address not in {*taken, *(m.connector.address for m in found)}]
        shapes = {o.address: _shape(c, o.address, nominal) for o in free if o.quantity is not None}
        scores = {
            o.address: abs(shapes[o.address].correlation) + likeness(volts.words, o.address, o.description)
            for o in free if o.address in shapes
        }  # fmt: skip
        address = max(scores, key=scores.__getitem__, default="")
        if not address or abs(shapes[address].correlation) < ONBOARDING.sensor_follows:
            continue
        connector, shape = model.connector(address), shapes[address]
        own = connector.declared or _si_of(connector)
        scale = float(f"{np.sign(shape.correlation) / shape.ratio:.2g}")
        doubt = f"what is 1 {volts.unit} in {own}? {scale:g} makes it move as the model does: scale"
        reason = f"by its shape (correlation with the model {shape.correlation:.2f})"
        found.append(Match(c.name, connector, own, reason, (doubt,), scale))
    return found


def _si_of(connector: Connector) -> str:
    """The unit in which numbers of a connector that declares none are taken."""
    quantity = connector.quantity
    same = (u for u in WORKSHOP if quantity is not None and unit(u).same_dimension(quantity))
    return next((u for u in same if unit(u).factor == 1.0 and unit(u).offset == 0.0), connector.hint or "1")


def _leads(row: np.ndarray, j: int, rivals: Sequence[int], least: float, margin: float) -> bool:
    """Whether an entry of a row is large enough and far enough above its rivals."""
    return bool(row[j] >= least and row[j] >= max((row[k] for k in rivals), default=0.0) + margin)


def _score(name: float, shape: Likeness | None) -> float:
    if shape is None or not 0.0 < shape.ratio < float("inf"):
        return name
    share = ONBOARDING.share_of_name
    return share * name + (1.0 - share) * max(abs(shape.correlation), ONBOARDING.shifted_counts * abs(shape.shifted))


def _input_match(column: ColumnOfRuns, connector: Connector) -> Match:
    name = unit_of_input(column, connector)
    score, _ = _named(column, connector)
    why = "by its name" if score >= ONBOARDING.like_input else "for the model then moves like the other columns"
    doubts: tuple[str, ...] = ()
    states = any(x.unit for x in readings(column.name, column.stated))
    if not states and connector.quantity is not None and name != "1":
        doubts = (f"is it in {name}? The file states no unit, and the input is in that",)
    return Match(column.name, connector, name, why, doubts)


def _output_match(column: ColumnOfRuns, connector: Connector, name: float, shape: Likeness | None) -> Match:
    known = shape is not None and 0.0 < shape.ratio < float("inf")
    reasons = (["name"] if name >= ONBOARDING.like_input else []) + (
        [f"shape (correlation with the model {shape.correlation:.2f})"] if shape is not None and known else []
    )
    chosen, doubt = _unit_of(column, connector, shape if known else None)
    doubts = [doubt] if doubt else []
    if shape is not None and known and shape.correlation < CHECKS.against:
        doubts.append("it moves against the model: is its sign the other way round? Then scale = -1")
    if name < ONBOARDING.like_input:
        doubts.append(f"is it {connector.address}? Its name does not say so")
    return Match(
        column.name,
        connector,
        chosen,
        f"by its {' and '.join(reasons)}" if reasons else "the only one left",
        tuple(doubts),
    )


def _unit_of(column: ColumnOfRuns, connector: Connector, shape: Likeness | None) -> tuple[str, str]:
    """The unit of a column that is an output, and a question where it is not sure."""
    _, reading = _named(column, connector)
    stated = [x.unit for x in readings(column.name, column.stated) if x.unit and connector.takes(x.unit)]
    if reading is not None and reading.unit is not None:
        return reading.unit, ""
    if reading is None and stated:
        return stated[0], ""
    own = connector.declared or connector.hint or "1"
    if connector.quantity is None:
        far = shape is not None and abs(np.log(shape.ratio)) > np.log(ONBOARDING.unit_within)
        size = f"; its readings are {shape.ratio:.3g} times as large as the model's" if far and shape else ""
        return own, f"in which unit is it? Neither file nor FMU says one{size}"
    if shape is None:
        return own, f"is it in {own}? Neither the file nor its size says so"
    # readings as numbers against the model in SI: what one of them is in SI
    si_ratio = shape.ratio if connector.declared is None else shape.ratio / unit(connector.declared).factor
    own_si = _si_of(connector)
    if abs(np.log(si_ratio)) <= np.log(ONBOARDING.unit_within):
        return own_si, ""
    better = likelier_unit(own_si, si_ratio, float(np.log(ONBOARDING.unit_within)))
    candidates = [better] if better else []
    common = [u for u in WORKSHOP if unit(u).same_dimension(connector.quantity)]
    near = [u for u in common if abs(np.log(si_ratio * unit(u).factor)) <= np.log(ONBOARDING.unit_within)]
    if near or candidates:
        return (near or candidates)[0], ""
    return own, f"is it in {own}? Its readings are {si_ratio:.3g} times as large as the model's in {own_si}"
