"""Conditions of a run: what the name of its file says (`depth=3000`, `run_3km`), and columns that do not change."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ...core.units import convert, unit
from ..settings import ONBOARDING
from .headings import campaign_unit, words
from .model import Model, Parameter

COUNTERS = frozenset(
    ("run", "test", "messung", "nr", "no", "rep", "trial", "file", "versuch", "sample", "record", "log", "lauf", "day",
     "rerun", "reconnected", "v", "part", "data", "take", "shot", "exp", "experiment", "series", "rig", "set")
)  # fmt: skip
"""Words before a number that only counts."""

HOLDOUT = frozenset(("val", "valid", "validation", "holdout", "heldout", "unseen"))
"""Words in the name of a run that is kept to test what the others say."""

Usual = Mapping[str, tuple[float, ...]]
"""Parameters that runs usually differ in, with usual values."""

_TOKEN = re.compile(r"(?P<key>[A-Za-z.]*?)[=]?(?P<value>-?\d+(?:[.,]\d+)?(?:e-?\d+)?)(?P<unit>[A-Za-z%]*)")


@dataclass(frozen=True)
class Stated:
    """A number that the name of a file states, as it is written: key and unit may be empty."""

    text: str
    key: str
    value: float
    unit: str


@dataclass(frozen=True)
class Condition:
    """A parameter of the package, and its value in a run in the parameter's unit; where that is said."""

    parameter: str
    value: float
    said: str


def stated_in(name: str) -> list[Stated]:
    """The numbers in a file's name that are no counters."""
    found: list[Stated] = []
    pieces = [p for p in re.split(r"[\s_;]+|,(?!\d)|-(?=[A-Za-z])|(?<=[A-Za-z])-", name) if p]
    for k, piece in enumerate(pieces):
        match = _TOKEN.fullmatch(piece)
        if match is None:
            continue
        key, text = match["key"], match["unit"]
        before = pieces[k - 1] if k and not key and not re.search(r"\d", pieces[k - 1]) else ""
        key = key or (before if not text or before.lower() not in COUNTERS else "")
        if not text and (key.lower() in COUNTERS or not key):
            continue
        if text and campaign_unit(text) is None:
            continue
        found.append(
            Stated(piece, "" if key.lower() in COUNTERS else key, float(match["value"].replace(",", ".")), text)
        )
    return found


def is_held_out(name: str) -> bool:
    """Whether the name of a run says that it is kept to test the others."""
    return bool(set(words(name)) & HOLDOUT)


def condition_of(stated: Stated, model: Model, usual: Usual) -> Condition | None:
    """The parameter that a number in a file's name sets, if exactly one can be meant.

    usual: parameters that runs of the package usually differ in, and values (the catalogue's experiments).
    """
    named = parameters_called(stated.key, model, usual) if stated.key else []
    stated_unit = campaign_unit(stated.unit) if stated.unit else None
    fitting = [p for p in named if _takes(p, stated_unit)]
    if not fitting and not stated.key and stated_unit is not None:
        likely = [p for name in usual for p in parameters_called(name, model, usual)]
        likely = likely or [p for p in model.parameters if _shared(p, model)]
        same = [p for p in likely if p.unit and unit(p.unit).same_dimension(unit(stated_unit))]
        fitting = [p for p in same if _is_usual(p, convert(stated.value, stated_unit, p.unit or ""), usual)]
    names = {short_name(p, model) for p in fitting}
    if len(names) != 1:
        return None
    p = fitting[0]
    value = convert(stated.value, stated_unit, p.unit) if stated_unit and p.unit else stated.value
    return Condition(names.pop(), float(f"{value:.12g}"), f"'{stated.text}' in the file's name")


def parameters_called(name: str, model: Model, usual: Usual) -> list[Parameter]:
    """Parameters of a name as people shorten it: `depth`; `load`, where runs usually differ in arm.load_weight."""
    own = "".join(words(name))
    numbers = [p for p in model.parameters if isinstance(p.value, (int, float)) and not isinstance(p.value, bool)]
    exact = [p for p in numbers if own in _names(p)]
    if exact or len(own) < 3:
        return exact
    among = [p for p in numbers if any(p.address == u or p.address.endswith(f".{u}") for u in usual)]
    return [p for p in among if set(words(name)) <= set(words(p.address))]


def _names(p: Parameter) -> set[str]:
    parts = p.address.split(".")
    return {"".join(words(".".join(parts[k:]))) for k in range(len(parts))}


def short_name(p: Parameter, model: Model) -> str:
    """The name that campaigns have for a parameter: without its component, where several share it with one value."""
    return p.address.partition(".")[2] if _shared(p, model) else p.address


def _shared(p: Parameter, model: Model) -> bool:
    name = p.address.partition(".")[2]
    others = [q for q in model.parameters if q.address.partition(".")[2] == name]
    return bool(name) and len(others) > 1 and all(q.value == p.value for q in others)


def _is_usual(p: Parameter, number: float, usual: Usual) -> bool:
    """Whether a value is not far beyond those that runs usually have; true where none are known."""
    values = next((v for name, v in usual.items() if p.address == name or p.address.endswith(f".{name}")), ())
    most = ONBOARDING.usual_within
    return not values or min(values) / most <= number <= most * max(values)


def _takes(p: Parameter, stated: str | None) -> bool:
    return stated is None or p.unit is None or unit(p.unit).same_dimension(unit(stated))
