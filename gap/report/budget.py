"""Section "budget": the stacked bar, the same in physical units, and what each part is."""

from __future__ import annotations

from typing import Any

from ..result.channels import leading_channel
from ..result.numbers import listed, multiple, percent, percents, pretty, quantity, with_interval
from .bar import SIZE, boxes, budget_strips, colours
from .parts import Data, Piece, amplitude, part_key, part_name, pieces
from .section import SHOWN, Context, Section
from .signals import Channel, Signals


def context(data: Data, signals: Signals) -> Context:
    """Bars, sentence, table of the parts, table of the channels."""
    budget = data["budget"]
    whole = pieces(budget, budget["parts"])
    colour = colours(whole)
    main = leading_channel(budget)
    calibrated = whole[0].energy
    total = sum(p.energy for p in whole) or 1.0
    return {
        "strips": budget_strips(budget, whole, {p.key: _on_bar(p, budget, total) for p in whole}),
        "row": SIZE.row, "height": SIZE.height,
        "sentence": sentence(data, signals),
        "held_out": budget["held_out"],
        "calibration": {"colour": colour["calibration"], "share": percent(calibrated / total), "any": calibrated > 0.0},
        "parts": [_part(p, budget, colour, main, signals) for p in budget["parts"]],
        "noise": {"colour": colour["noise"], "share": percent(whole[-1].energy / total)},
        "main": signals.channel(main).column if main else "",
        "channels": [_channel(name, c, colour, signals) for name, c in budget["per_channel"].items()],
        "worse": budget["calibrated"] > 1.02 * budget["delivered"],
        "left": multiple(budget["calibrated"]),
    }  # fmt: skip


def sentence(data: Data, signals: Signals) -> str:
    """The budget in the unit of the channel that speaks for it."""
    budget = data["budget"]
    label = leading_channel(budget)
    if not label:
        return ""
    levels = budget["per_channel"][label]
    c = signals.channel(label, levels["unit"])
    off, fitted, remaining, noise = (in_unit(c, levels[k]) for k in ("delivered", "calibrated", "explained", "noise"))
    sure = [p for p in budget["parts"] if p.get("inclusion_probability", 0.0) >= SHOWN.probable]
    names = [part_name(p) for p in sure if not p.get("minor", False)]
    text = f"In {c.column} the model as delivered is {off} off; calibration within the tolerances leaves {fitted}"
    text += f", and with {listed(names)} in the model {remaining} are left" if names else ""
    return f"{text}. The noise of this channel is {noise} (all RMS, on data that were not fitted)."


def in_unit(c: Channel, x: float) -> str:
    """A difference of readings in the unit in which they were measured."""
    return quantity(x * c.factor, c.unit)


def _on_bar(piece: Piece, budget: Data, total: float) -> str:
    """What is written on a piece: of calibration its share of the whole, of a part that of what calibration leaves."""
    if piece.kind == "noise":
        return ""
    above_noise = budget["calibrated"] ** 2 - budget["noise"] ** 2
    of = total if piece.kind == "calibration" else above_noise
    return f"{piece.name} {percent(piece.energy / of)}" if of > 0.0 else piece.name


def _part(part: Data, budget: Data, colour: dict[str, str], main: str, signals: Signals) -> Context:
    key, levels = part_key(part), budget["per_channel"].get(main)
    shares = {part_key(p): p["share"] for p in levels["parts"]} if levels else {}
    alone = in_unit(signals.channel(main, levels["unit"]), amplitude(shares[key], levels)) if key in shares else "–"
    inclusion, within = part.get("inclusion_probability"), part.get("within_group") or {}
    texts = part.get("text") or {}
    members = [
        {"id": e, "text": texts.get(e, ""), "share": percent(within[e]) if e in within and len(within) > 1 else ""}
        for e in dict.fromkeys([*part.get("effects", ()), *within])
    ]
    form = part.get("form")
    return {
        "name": part_name(part), "unexplained": part["kind"] != "effect", "minor": part.get("minor", False),
        "colour": colour.get(key, "#999"), "share": percent(part["share"]), "interval": percents(part["ci95"]),
        "inclusion": "–" if inclusion is None else percent(inclusion), "alone": alone, "members": members,
        "character": part.get("character", ""),
        "form": {
            "name": str(form["id"]).replace("_", " "), "share": percent(form["share"]),
            "inclusion": percent(form["inclusion_probability"]),
        } if form else None,
        "parameters": [parameter(n, p, signals) for n, p in (part.get("parameters") or {}).items()],
    }  # fmt: skip


def parameter(name: str, p: Data, signals: Signals) -> dict[str, Any]:
    """Value and interval of a parameter as texts."""
    value, ends, power = with_interval(p["value"], p["ci95"])
    neutral = signals.neutral.get(name)
    return {
        "name": name, "label": name.rpartition(".")[2], "value": value, "ends": ends, "power": power,
        "unit": pretty(p["unit"]), "at_bound": p.get("at_bound", False),
        "neutral": "" if neutral is None else quantity(neutral, p["unit"]),
    }  # fmt: skip


def _channel(label: str, levels: Data, colour: dict[str, str], signals: Signals) -> Context:
    c = signals.channel(label, levels["unit"])
    entry: Context = {k: in_unit(c, levels[k]) for k in ("delivered", "calibrated", "explained", "noise")}
    noise = levels["noise"] or 1e-300
    entry["multiples"] = [multiple(levels[k] / noise) for k in ("delivered", "calibrated", "explained")]
    entry |= {"column": c.column, "label": label if label != c.column else ""}
    return entry | {"boxes": boxes(pieces(levels, levels.get("parts", ())), colour, 100.0)}


SECTION = Section("budget", "Budget of the gap", context)
