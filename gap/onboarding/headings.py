"""What the heading of a column says: words, and a unit in whatever way it is written there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher

from ...core.unit_names import named
from ...core.units import UNITS, Unit
from ..measurements.table import split_unit
from ..settings import NAMES

TIME_WORDS = frozenset(
    (
        "time",
        "t",
        "zeit",
        "temps",
        "tempo",
        "tiempo",
        "tijd",
        "timestamp",
        "zeitstempel",
        "elapsed",
        "datetime",
        "date",
        "uhrzeit",
        "clock",
        "heure",
        "hora",
        "ora",
    )
)
"""What the column of time is called."""

CONCEPTS = {
    "position": "x s y pos position displacement stroke travel extension weg hub lage laser way distance",
    "velocity": "v vel velocity speed geschwindigkeit rate",
    "acceleration": "a acc acceleration beschleunigung",
    "force": "f force kraft load load_cell friction",
    "torque": "torque moment drehmoment tau",
    "pressure": "p pressure druck press",
    "flow": "q flow volumenstrom durchfluss",
    "angle": "angle phi theta winkel alpha beta",
    "level": "level h height fuellstand tank",
    "spool": "spool schieber slide xv",
    "command": "u cmd command setpoint soll sollwert input drive control target ref reference voltage spannung",
    "current": "i current strom",
    "temperature": "temp temperature temperatur",
    "output": "y out output response",
}
"""Words that mean the same quantity, in the languages that loggers speak here."""

_MEANS: dict[str, set[str]] = {}
for _concept, _words in CONCEPTS.items():
    for _word in _words.split():
        _MEANS.setdefault(_word, set()).add(_concept)


@dataclass(frozen=True)
class Reading:
    """One way to read a heading: its words, and a unit or None."""

    words: tuple[str, ...]
    unit: str | None


def words(text: str) -> tuple[str, ...]:
    """Words of a name, in small letters: `PistonPos_2` is piston, pos, 2."""
    parts = re.findall(r"[A-ZÄÖÜ]+(?![a-zäöü])|[A-ZÄÖÜ]?[a-zäöüß]+|\d+", text)
    return tuple(p.lower() for p in parts)


def campaign_unit(name: str | None) -> str | None:
    """The name that campaigns have for a unit as it is written in a file, or None where it is no known one."""
    found = named((name or "").strip())
    if found is None:
        return None
    if found.name in UNITS and UNITS[found.name] == found:
        return found.name
    return next((u.name for u in UNITS.values() if _same(u, found)), None)


def _same(a: Unit, b: Unit) -> bool:
    alike = a.exponents == b.exponents and abs(a.offset - b.offset) < 1e-9 * max(abs(a.offset), 1.0)
    return alike and abs(a.factor / b.factor - 1.0) < 1e-9


def readings(name: str, stated: str | None) -> Iterator[Reading]:
    """The ways to read a heading, the plainer first: `x [mm]`, `x_mm`, `x/mm`, `v_mm_s`, or with a row of units."""
    plain, in_heading = split_unit(name)
    if (unit := campaign_unit(stated or in_heading)) is not None:
        yield Reading(words(plain), unit)
        return
    yield Reading(words(plain), None)
    for pattern in (r"(.+)[/,]\s*([^\s]+)", r"(.+?)[_ .]([^_ .]+/[^_ .]+)", r"(.+?)[_ .]([^_ .]+_[^_ .]+)",
                    r"(.+)[_ .]([^_ .]+)"):  # fmt: skip
        match = re.fullmatch(pattern, plain)
        if match is None:
            continue
        for text in (match[2], match[2].replace("_", "/")):
            if (unit := campaign_unit(text)) is not None and unit != "1":
                yield Reading(words(match[1]), unit)
                break


def time_unit(name: str, stated: str | None) -> str | None:
    """The unit of time that the heading of a time column says, or None."""
    units = (r.unit for r in readings(name, stated) if r.unit is not None)
    return next((u for u in units if UNITS[u].same_dimension(UNITS["s"])), None)


def is_time_heading(name: str) -> bool:
    """Whether a heading is one of time in any usual way of writing it."""
    return any(
        r.words and (set(r.words) & TIME_WORDS or r.words[0] in ("sec", "seconds")) for r in readings(name, None)
    )


def likeness(column: Iterable[str], connector: str, description: str) -> float:
    """How alike the words of a column and a connector `component.name` with its description are: 0 to 1.

    1: the same name; 0.5 to 0.8: words that mean the same quantity, or words of the description.
    """
    own, name = tuple(column), words(connector.partition(".")[2] or connector)
    if not own:
        return 0.0
    joined = "".join(own)
    if joined in ("".join(name), "".join(words(connector))):
        return 1.0
    if len(name) > 1 and joined == name[-1] and len(joined) > 2:
        return NAMES.end
    letters = SequenceMatcher(None, joined, "".join(name)).ratio() if min(len(joined), len("".join(name))) > 2 else 0.0
    told = set(name) | set(words(description.partition("@")[0]))
    shared = sum(1 for w in own if w in told and len(w) > 1) / len(own)
    meaning = NAMES.meaning if _concepts(own) & (_concepts(name) | _concepts(words(description)[:3])) else 0.0
    score = max(NAMES.letters * letters, NAMES.words * shared, meaning + NAMES.word_beside * bool(shared))
    if _marks(own) and _marks(name):  # P1 is not P2, pressure A is that of chamber A
        score += NAMES.same_mark if _marks(own) & _marks(name) else -NAMES.other_mark
    return float(min(max(score, 0.0), NAMES.most))


def _concepts(parts: Iterable[str]) -> set[str]:
    found: set[str] = set()
    for part in parts:
        found |= _MEANS.get(part, set())
    return found


def _marks(parts: tuple[str, ...]) -> set[str]:
    """What tells quantities of a kind apart: numbers, and a single letter behind another word."""
    return {p for k, p in enumerate(parts) if p.isdigit() or (k and len(p) == 1)}
