"""A diagnosis as text for a terminal: at most 25 lines of at most 100 characters, the budget first."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .report.headline import VERDICTS
from .report.next_step import action
from .report.parts import Piece, part_key, part_name, pieces
from .report.signals import Signals, without_signals
from .report.swings import sentence
from .result.numbers import (
    NBSP,
    cleaned,
    duration,
    listed,
    multiple,
    percent,
    percents,
    pretty,
    quantity,
    with_interval,
)
from .settings import TerminalSettings

Data = Mapping[str, Any]

LAYOUT = TerminalSettings()


@dataclass(frozen=True)
class Marks:
    """Characters of the bar's pieces; effects take theirs by turns."""

    calibration: str
    effects: str
    unexplained: str
    noise: str


BLOCKS = Marks("▒", "█▓", "░", "·")
PLAIN = Marks(":", "#=", "?", ".")
"""Where the encoding of the output has no blocks."""

_ASCII = str.maketrans({
    NBSP: " ", "−": "-", "–": "-", "→": "->", "×": "x", "±": "+-", "·": ".", "°": "deg ",
    "“": '"', "”": '"', "’": "'", "…": "...",
    **{c: str(k) for k, c in enumerate("⁰¹²³⁴⁵⁶⁷⁸⁹")}, "⁻": "-",
})  # fmt: skip


def lines(data: Data, signals: Signals | None = None, encoding: str | None = "utf-8", files: str = "") -> list[str]:
    """The text.

    data: the contents of diagnosis.json; signals: for the units in which channels were measured; encoding: of the
    output, what it lacks is replaced; files: what is said of the files in the end.
    """
    data = cleaned(dict(data))
    signals = signals or without_signals(data)
    blocks = _has("".join((BLOCKS.calibration, BLOCKS.effects, BLOCKS.unexplained, BLOCKS.noise)), encoding)
    marks = BLOCKS if blocks else PLAIN
    fixed = [
        *_budget(data, marks),
        *_where(data, signals),
        *_wrapped(sentence(data, signals), 2, "    "),
        *_next(data, signals),
        *_end(data),
        *([files] if files else []),
    ]
    room = LAYOUT.lines - len(fixed)
    head = _wrapped(f"{VERDICTS[data['verdict']]}. {data['headline']}", min(LAYOUT.headline, max(2, room)))
    budget = len(_budget(data, marks))
    moments = _moments(data)[: max(0, room - len(head))]
    channels = _channels(data, signals, room - len(head) - len(moments))
    all_lines = [*head, *fixed[:budget], *channels, *moments, *fixed[budget:]]
    return [_cut(_encodable(line, encoding)) for line in all_lines]


def _has(text: str, encoding: str | None) -> bool:
    try:
        text.encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


def _encodable(text: str, encoding: str | None) -> str:
    """A text without characters that the encoding lacks."""
    text = text.replace(NBSP, " ")
    if _has(text, encoding):
        return text
    codec = encoding if _has("", encoding) else "ascii"
    return text.translate(_ASCII).encode(codec or "ascii", "replace").decode(codec or "ascii")


def _cut(text: str) -> str:
    return text if len(text) <= LAYOUT.width else text[: LAYOUT.width - 3] + "..."


def _wrapped(text: str, most: int, indent: str = "") -> list[str]:
    return textwrap.wrap(text, LAYOUT.width, subsequent_indent=indent, max_lines=most, placeholder=" ...")


def _mark_of(parts: Sequence[Piece], marks: Marks) -> dict[str, str]:
    """Mark of every piece by its key."""
    mark = {"calibration": marks.calibration, "unexplained": marks.unexplained, "noise": marks.noise}
    effects = [p.key for p in parts if p.kind == "effect"]
    mark |= {key: marks.effects[k % len(marks.effects)] for k, key in enumerate(effects)}
    return mark | {f"{key}:form": mark[key] for key in effects}


def bar(parts: Sequence[Piece], mark: Mapping[str, str], width: int) -> str:
    """The pieces as characters, each that is not minor at least one of them; together the width."""
    total = sum(p.energy for p in parts) or 1.0
    cells = [max(int(width * p.energy / total), int(p.energy > 0.0 and not p.minor)) for p in parts]
    largest = max(range(len(parts)), key=lambda k: parts[k].energy)
    cells[largest] += width - sum(cells)
    return "".join(mark[p.key] * n for p, n in zip(parts, cells, strict=True))


def _budget(data: Data, marks: Marks) -> list[str]:
    """The bar, and a line or two for each of its pieces."""
    budget = data["budget"]
    whole = pieces(budget, budget["parts"])
    mark = _mark_of(whole, marks)
    total = sum(p.energy for p in whole) or 1.0
    levels = " → ".join(multiple(budget[k]) for k in ("delivered", "calibrated", "explained"))
    rows = ["", f"{bar(whole, mark, LAYOUT.bar)} {levels} times the noise"]
    of_all = percent(whole[0].energy / total)
    rows.append(f"{marks.calibration} calibration: {of_all} of the squared deviation as delivered; of what it leaves:")
    effects = [p for p in budget["parts"] if p["kind"] == "effect"]
    shown = [p for p in effects if not p["minor"] or p["inclusion_probability"] >= LAYOUT.probable][: LAYOUT.parts]
    for p in shown:
        rows += _wrapped(f"{mark[part_key(p)]} {_part(p)}", 2, "    ")
    if len(effects) > len(shown):
        rest = [p["share"] for p in effects if not any(p is q for q in shown)]
        rows.append(f"  {len(rest)} minor {'effect' if len(rest) == 1 else 'effects'}: {percent(max(0.0, sum(rest)))}")
    for p in (p for p in budget["parts"] if p["kind"] == "unexplained"):
        text = f"{percent(p['share'])} ({percents(p['ci95'])}) in no effect of the catalogue: {p['character']}"
        rows += _wrapped(f"{marks.unexplained} {text}", 2, "    ")
    return rows


def _part(p: Data) -> str:
    """A part with its effects, share, probability and parameters."""
    names = listed(list(p["effects"]), 2, "or")
    name = names if len(p["effects"]) == 1 else f"{part_name(p)} ({names})"
    text = f"{name} {percent(p['share'])} ({percents(p['ci95'])}), probability {percent(p['inclusion_probability'])}"
    values = [_value(n, v) for n, v in p["parameters"].items()]
    return "; ".join([text, *values]) if p["inclusion_probability"] >= LAYOUT.probable else text


def _value(name: str, p: Data) -> str:
    value, ends, power = with_interval(p["value"], p["ci95"])
    unit = pretty(p["unit"])
    end = ", at bound" if p["at_bound"] else ""
    return f"{name.rpartition('.')[2]} {value}{power}{NBSP}{unit}".rstrip(NBSP) + f" ({ends}{power}{end})"


def _channels(data: Data, signals: Signals, room: int) -> list[str]:
    """The channels that are furthest off, RMS in the unit in which they were measured."""
    per_channel = data["budget"]["per_channel"]
    ordered = sorted(per_channel, key=lambda c: -per_channel[c]["delivered"] / (per_channel[c]["noise"] or 1e-300))
    shown = ordered[: min(LAYOUT.channels, room - 1)] if room > 1 else []
    rows = []
    for label in shown:
        c, x = signals.channel(label, per_channel[label]["unit"]), per_channel[label]
        off = [quantity(x[k] * c.factor, c.unit) for k in ("delivered", "calibrated", "explained", "noise")]
        rows.append(f"  {c.column[:26]:<26} {' → '.join(off[:3])}; noise {off[3]}")
    return ["RMS as delivered → calibrated → with the effects:", *rows] if rows else []


def _moments(data: Data) -> list[str]:
    events = sorted(data.get("events") or [], key=lambda e: -abs(e["measured"] - e["delivered"]) / (e["std"] or 1e-300))
    rows = []
    for e in events[: LAYOUT.moments]:
        models = " → ".join(f"{e[k]:.3f}" for k in ("delivered", "calibrated", "explained"))
        measured = " ".join(x for x in (e["limit"], f"{e['measured']:.3f} s") if x)
        rows.append(f"  {e['run']}, {e['event']}: measured {measured}; {models} s")
    return rows


def _where(data: Data, signals: Signals) -> list[str]:
    if data["verdict"] == "no_significant_gap" or not data["where"]:
        return []
    texts = [f"{signals.channel(w['channel']).column} {percent(w['share'])} ({w['region']})" for w in data["where"][:2]]
    return _wrapped(f"Where calibration leaves it: {'; '.join(texts)}", 1)


def _next(data: Data, signals: Signals) -> list[str]:
    step = data["next_experiment"]
    if not step:
        return []
    sets = " from ".join(" + ".join(e) or "no effect" for e in step["separates"])
    separation, sure = multiple(step["expected_separation"]), step["expected_probability"]
    hint = f"{separation} times the noise apart; {percent(sure['then'])} sure then, {percent(sure['now'])} now"
    return _wrapped(f"Measure next: {action(step, signals)}; tells {sets} ({hint})", 2, "    ")


def _end(data: Data) -> list[str]:
    t, notes = data["timing"], len(set(data["warnings"]))
    noted = f"; {notes} {'warning' if notes == 1 else 'warnings'} in the report and in diagnosis.json" if notes else ""
    return [f"{t['simulations']} runs in {duration(t['wall_s'])}{noted}"]
