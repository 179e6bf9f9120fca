"""A diagnosis as text for a terminal: at most 25 lines, the budget first."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

from .settings import TerminalSettings

BLOCKS = "█▓▒░·"
PLAIN = "#=+-."
"""Of the bar: calibration, effects by turns, unexplained, noise; and the same where the encoding has no blocks."""

Data = Mapping[str, Any]

VERDICTS = {
    "explained": "Explained", "explained_in_part": "Explained in part",
    "no_significant_gap": "No significant gap", "unexplained": "Unexplained",
}  # fmt: skip


LAYOUT = TerminalSettings()


def lines(data: Data, blocks: bool = True) -> list[str]:
    """data: the contents of diagnosis.json; blocks: whether the output can show block characters."""
    marks = BLOCKS if blocks else PLAIN
    head = "" if data["finished"] else f"NOT FINISHED, stopped while {data['unfinished_stage']}. "
    made = textwrap.wrap(f"{VERDICTS[data['verdict']]}. {head}{data['headline']}", LAYOUT.width)[: LAYOUT.headline]
    made += [*_bar(data["budget"], marks), *_parts(data), *_channels(data)]
    made += [*_moments(data), *_where(data), *_next(data)]
    return [_cut(line) for line in [*made[: LAYOUT.lines - 2], *_end(data)]]


def _cut(text: str) -> str:
    return text if len(text) <= LAYOUT.width else text[: LAYOUT.width - 3] + "..."


def _energies(budget: Data) -> list[tuple[str, float]]:
    """Mark's place in the marks and squared residual of every piece, from as delivered to the noise."""
    noise, calibrated = budget["noise"] ** 2, budget["calibrated"] ** 2
    left = max(0.0, calibrated - noise)
    made = [("calibration", max(0.0, budget["delivered"] ** 2 - max(calibrated, noise)))]
    made += [(p["kind"], p["share"] * left) for p in budget["parts"]]
    return [*made, ("noise", noise)]


def _bar(budget: Data, marks: str) -> list[str]:
    """One bar from as delivered to the noise, on squares, which add up."""
    pieces = _energies(budget)
    total = sum(e for _, e in pieces) or 1.0
    text, done, effects = "", 0.0, 0
    for kind, energy in pieces:
        done += energy
        place = {"calibration": 0, "unexplained": 3, "noise": 4}.get(kind, 1 + effects % 2)
        effects += kind == "effect"
        text += marks[place] * (round(LAYOUT.bar * done / total) - len(text))
    levels = f"{_times(budget['delivered'])} -> {_times(budget['calibrated'])} -> {_times(budget['explained'])}"
    legend = f"{marks[0]} calibration  {marks[1]}{marks[2]} effects  {marks[3]} unexplained  {marks[4]} noise"
    return ["", f"|{text}| {levels} x noise", f" {legend}   (squared residual)"]


def _parts(data: Data) -> list[str]:
    made = []
    effects = [p for p in data["budget"]["parts"] if p["kind"] == "effect"]
    for p in [p for p in effects if not p["minor"] or p["inclusion_probability"] >= 0.5][: LAYOUT.parts]:
        name = ", ".join(p["effects"][:2]) + (" ..." if len(p["effects"]) > 2 else "")
        made.append(f"  {p['share']:>5.0%} {_interval(p['ci95'])}  {name}  ({p['inclusion_probability']:.0%} sure)")
        values = "; ".join(_value(n, v) for n, v in list(p["parameters"].items())[:2])
        if values and p["inclusion_probability"] >= 0.5:
            made.append(f"         {values}")
    rest = next(p for p in data["budget"]["parts"] if p["kind"] == "unexplained")
    left = f"  {rest['share']:>5.0%} {_interval(rest['ci95'])}  in no effect of the catalogue: {rest['character']}"
    return [*made, *textwrap.wrap(left, LAYOUT.width, subsequent_indent=" " * 9, drop_whitespace=False)[:2]]


def _value(name: str, p: Data) -> str:
    unit = "" if p["unit"] == "1" else f" {p['unit']}"
    end = ", at its bound" if p["at_bound"] else ""
    low, high = p["ci95"]
    return f"{name.rsplit('.', 1)[-1]} = {p['value']:.4g}{unit} ({low:.4g} to {high:.4g}{end})"


def _channels(data: Data) -> list[str]:
    """The channels that are furthest off, RMS in their unit."""
    found = sorted(data["budget"]["per_channel"].items(), key=lambda item: -item[1]["delivered"] / item[1]["noise"])
    made = []
    for name, c in found[: LAYOUT.channels]:
        levels = " -> ".join(f"{c[k]:.3g}" for k in ("delivered", "calibrated", "explained"))
        unit = "" if c["unit"] == "1" else f" {c['unit']}"
        made.append(f"  {name:<26.26} {levels}{unit}  (noise {c['noise']:.2g}{unit})")
    return ["as delivered -> calibrated -> with the effects:", *made]


def _moments(data: Data) -> list[str]:
    found = sorted(data.get("events", []), key=lambda e: -abs(e["measured"] - e["delivered"]) / e["std"])
    return [
        f"  {e['run']}, {e['event']}: {e['limit']} {e['measured']:.3f} s measured, "
        f"{e['delivered']:.3f} -> {e['calibrated']:.3f} -> {e['explained']:.3f} s".replace(":  ", ": ")
        for e in found[: LAYOUT.moments]
    ]


def _where(data: Data) -> list[str]:
    if data["verdict"] == "no_significant_gap" or not data["where"]:
        return []
    told = [f"{w['channel']} {w['share']:.0%} ({w['region']})" for w in data["where"][:2]]
    return [f"where calibration leaves it: {'; '.join(told)}"]


def _next(data: Data) -> list[str]:
    n = data["next_experiment"]
    if not n:
        return []
    change = ", ".join(f"{k} = {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in n["change"].items())
    first, second = (" + ".join(e) or "no effect" for e in n["separates"])
    return [f"measure next: {change}; tells {first} from {second} ({_times(n['expected_separation'])} x noise apart)"]


def _end(data: Data) -> list[str]:
    t, notes = data["timing"], len(data["warnings"])
    noted = f"; {notes} note{'s' if notes != 1 else ''} in the report" if notes else ""
    return [f"{t['simulations']} runs in {t['wall_s']:.0f} s{noted}"]


def _times(x: float) -> str:
    return f"{x:.0f}" if x >= 99.5 else f"{x:.1f}" if x >= 9.95 else f"{x:.2f}"


def _interval(ends: Any) -> str:
    return f"({ends[0]:.0%} to {ends[1]:.0%})"
