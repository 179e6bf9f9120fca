"""What is asked of a design and what may be changed about it, from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import product
from math import inf, prod
from pathlib import Path
from typing import Any

from ...core.errors import UsageError
from ...core.toml_tables import Tables
from ..sweep.metrics import Metric, parse_metric

FINEST = 1e-9
"""Least `within`, as a share of the axis."""

MAX_DESIGNS = 10_000
"""Most combinations of choices."""


@dataclass(frozen=True)
class Choice:
    """One way to build a part of the machine."""

    name: str
    parameters: Mapping[str, Any]
    cost: float = 0.0


@dataclass(frozen=True)
class Group:
    """The ways to build a part; the first is what the machine has."""

    name: str
    choices: tuple[Choice, ...]
    mapped: bool = False


@dataclass(frozen=True)
class Requirement:
    """A metric and the range that it has to be in; one that does not exist is not in it."""

    metric: Metric
    at_least: float
    at_most: float

    def holds(self, value: float | None) -> bool:
        """Whether the value is in the range."""
        return value is not None and self.at_least <= value <= self.at_most


@dataclass(frozen=True)
class Options:
    """All of it; the axis says how far a design goes."""

    parameter: str
    unit: str
    low: float
    high: float
    within: float
    requirements: tuple[Requirement, ...]
    groups: tuple[Group, ...]
    stop_time: float | None = None


@dataclass(frozen=True)
class Design:
    """A choice of each group."""

    groups: tuple[Group, ...]
    choices: tuple[Choice, ...]

    @property
    def cost(self) -> float:
        """Sum of the choices' costs."""
        return sum(c.cost for c in self.choices)

    @property
    def changes(self) -> tuple[str, ...]:
        """What differs from the machine as it is, e.g. 'line: 5 mm'."""
        pairs = zip(self.groups, self.choices, strict=True)
        return tuple(f"{g.name}: {c.name}" for g, c in pairs if c is not g.choices[0])

    @property
    def parameters(self) -> dict[str, Any]:
        """All that the choices set."""
        return {name: value for c in self.choices for name, value in c.parameters.items()}


def designs(groups: Sequence[Group]) -> list[Design]:
    """Every combination, the last group fastest."""
    return [Design(tuple(groups), choices) for choices in product(*(g.choices for g in groups))]


def read(path: Path | None = None) -> Options:
    """The options of a file, or those of the deep-sea machine; raises `UsageError` in one line."""
    take = Tables(UsageError)
    if path is None:
        where = "options.toml"
        data = take.parse(files(__package__).joinpath(where).read_text(encoding="utf-8"), where)
    else:
        where, data = str(path), take.load(path)
    take.reject_unknown_keys(data, ("stop_time", "axis", "require", "group"), where)
    axis = take.get(data, where, "axis", dict)
    at = f"{where}: [axis]"
    take.reject_unknown_keys(axis, ("parameter", "unit", "low", "high", "within"), at)
    low, high, within = (take.number(axis, at, key) for key in ("low", "high", "within"))
    if not (low < high and (high - low) * FINEST <= within < high - low):
        raise UsageError(f"{at}: low {low:g}, high {high:g} and within {within:g} do not fit together")
    made = Options(
        take.get(axis, at, "parameter", str), take.get(axis, at, "unit", str, ""), low, high, within,
        tuple(_requirement(take, t, f"{where}: [[require]]") for t in take.tables(data, where, "require")),
        tuple(_group(take, t, f"{where}: [[group]]") for t in take.tables(data, where, "group")),
        take.number(data, where, "stop_time") if "stop_time" in data else None,
    )  # fmt: skip
    if not made.requirements or not made.groups:
        raise UsageError(f"{where}: at least one [[require]] and one [[group]] are needed")
    if (count := prod(len(g.choices) for g in made.groups)) > MAX_DESIGNS:
        raise UsageError(f"{where}: {count} combinations of choices; at most {MAX_DESIGNS}")
    labels = {r.metric.label: str(r.metric) for r in made.requirements}
    for r in made.requirements:
        if labels[r.metric.label] != str(r.metric):
            raise UsageError(f"{where}: [[require]]: two metrics have the label '{r.metric.label}'")
    names = [g.name for g in made.groups]
    if len(set(names)) < len(names):
        raise UsageError(f"{where}: two groups have the same name")
    return made


def _requirement(take: Tables, table: dict[str, Any], where: str) -> Requirement:
    take.reject_unknown_keys(table, ("metric", "at_least", "at_most"), where)
    metric = parse_metric(take.get(table, where, "metric", str))
    ends = [take.number(table, where, k) if k in table else d for k, d in (("at_least", -inf), ("at_most", inf))]
    if ends == [-inf, inf]:
        raise UsageError(f"{where}: {metric}: at_least or at_most is missing")
    if ends[0] > ends[1]:
        raise UsageError(f"{where}: {metric}: nothing is at least {ends[0]:g} and at most {ends[1]:g}")
    return Requirement(metric, *ends)


def _group(take: Tables, table: dict[str, Any], where: str) -> Group:
    take.reject_unknown_keys(table, ("name", "map", "choice"), where)
    name = take.get(table, where, "name", str)
    at = f"{where} {name}"
    choices = []
    for t in take.tables(table, at, "choice"):
        take.reject_unknown_keys(t, ("name", "parameters", "cost"), at)
        choices.append(
            Choice(take.get(t, at, "name", str), take.get(t, at, "parameters", dict), take.number(t, at, "cost", 0.0))
        )
    if len({c.name for c in choices}) < len(choices):
        raise UsageError(f"{at}: two choices have the same name")
    if not choices:
        raise UsageError(f"{at}: it has no [[group.choice]]")
    if choices[0].cost:
        raise UsageError(f"{at}: the first choice is what the machine has; it costs nothing")
    return Group(name, tuple(choices), take.get(table, at, "map", bool, False))
