"""The budget as pieces of a bar: from the deviation as delivered to the noise, on the squared deviation.

Squares of independent deviations add up, amplitudes do not; so a bar has to divide squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

Data = Mapping[str, Any]
"""A section of diagnosis.json."""


@dataclass(frozen=True)
class Piece:
    """A piece of the bar. `energy`: of the squared deviation, in the square of the unit of its levels."""

    kind: str
    """calibration, effect, form (of the effect before it), unexplained or noise."""
    key: str
    """The same for the same part in every bar of a report."""
    name: str
    energy: float
    minor: bool = False


def part_key(part: Data) -> str:
    """What tells a part from the others, in the whole budget, of a channel and of a run."""
    return str(part["kind"]) if part["kind"] != "effect" else f"effect:{part.get('group') or _effects(part)}"


def part_name(part: Data) -> str:
    """A part for people: its effect in words, or the group where several effects can be meant."""
    if part["kind"] != "effect":
        return "unexplained"
    group = part.get("group")
    return str(_effects(part) if len(part.get("effects", ())) == 1 or not group else group).replace("_", " ")


def _effects(part: Data) -> str:
    return " + ".join(part.get("effects", ())) or "effect"


def pieces(levels: Data, parts: Sequence[Data]) -> list[Piece]:
    """The pieces between `delivered` and nothing; levels: noise, delivered and calibrated, RMS in one unit."""
    noise, delivered, calibrated = (float(levels[k]) ** 2 for k in ("noise", "delivered", "calibrated"))
    above_noise = max(0.0, calibrated - noise)
    bar = [Piece("calibration", "calibration", "calibration", max(0.0, delivered - max(calibrated, noise)))]
    for p in sorted(parts, key=lambda p: p["kind"] == "unexplained"):
        key, name, share = part_key(p), part_name(p), max(0.0, float(p["share"]))
        minor, form = bool(p.get("minor", False)), p.get("form")
        of_form = min(share, max(0.0, float(form["share"]))) if form else 0.0
        bar.append(Piece(str(p["kind"]), key, name, (share - of_form) * above_noise, minor))
        if form and of_form:
            bar.append(Piece("form", f"{key}:form", f"form of {name}", of_form * above_noise, minor))
    return [*bar, Piece("noise", "noise", "noise", noise)]


def amplitude(share: float, levels: Data) -> float:
    """RMS that a part with that share makes alone, in the unit of the levels."""
    return sqrt(max(0.0, share) * max(0.0, levels["calibrated"] ** 2 - levels["noise"] ** 2))
