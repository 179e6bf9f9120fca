"""The stacked bar of the budget as coordinates of an SVG, with labels that never overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from math import sqrt

from ..result.numbers import multiple
from .parts import Data, Piece


@dataclass(frozen=True)
class Geometry:
    """Sizes in the drawing's units, one of which is about a pixel on a laptop."""

    width: float = 1000.0
    height: float = 40.0
    """Of a bar."""
    row: float = 17.0
    """Height of a row of labels."""
    character: float = 8.0
    """Width of a character of a label, a little more than wide sans-serif letters have on average."""
    space: float = 12.0
    """Between two labels of a row."""
    mark: float = 4.0
    """Between a label and its line."""
    zoom: float = 0.6
    """Share of the whole below which what calibration leaves is drawn a second time, over the whole width."""


SIZE = Geometry()
CALIBRATION, UNEXPLAINED, NOISE = "#e69f00", "#d55e00", "#c9ced4"
EFFECTS = ("#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#f0e442")
"""Okabe and Ito's colours, which the colour-blind tell apart."""
DARK = ("#0072b2", "#009e73", "#d55e00")
"""Those on which white letters are read best."""


@dataclass(frozen=True)
class Box:
    """A rectangle of the bar: left end and width."""

    x: float
    width: float
    colour: str
    hatched: bool
    title: str


@dataclass(frozen=True)
class Label:
    """A text from `x` on in a row of labels (0: next to the bar), with a line to the place `anchor` of the bar.

    The text begins at its line, or ends there where it would not fit beside it otherwise.
    """

    text: str
    x: float
    row: int
    anchor: float
    width: float
    ends: bool = False

    def collides(self, other: Label) -> bool:
        """Whether two texts touch, or the line of one of them crosses the text of the other."""
        if self.row == other.row:
            return self.x < other.x + other.width + SIZE.space and other.x < self.x + self.width + SIZE.space
        low, high = sorted((self, other), key=lambda label: label.row)
        return low.x <= high.anchor <= low.x + low.width


@dataclass(frozen=True)
class Inside:
    """A text in the middle of its box."""

    text: str
    x: float
    ink: str


@dataclass(frozen=True)
class Strip:
    """A bar with what is written above, in and below it."""

    boxes: tuple[Box, ...]
    inside: tuple[Inside, ...]
    above: tuple[Label, ...]
    below: tuple[Label, ...]

    @property
    def rows_above(self) -> int:
        """Rows of labels above the bar."""
        return 1 + max((label.row for label in self.above), default=-1)

    @property
    def rows_below(self) -> int:
        """Rows of labels below the bar."""
        return 1 + max((label.row for label in self.below), default=-1)


def colours(parts: Sequence[Piece]) -> dict[str, str]:
    """Colour of every piece by its key: that of an effect is its own in all bars of a report."""
    by_key = {"calibration": CALIBRATION, "unexplained": UNEXPLAINED, "noise": NOISE}
    for piece in parts:
        if piece.kind == "effect" and piece.key not in by_key:
            by_key[piece.key] = EFFECTS[(len(by_key) - 3) % len(EFFECTS)]
            by_key[f"{piece.key}:form"] = by_key[piece.key]
    return by_key


def spread(texts: Sequence[tuple[str, float]], width: float = SIZE.width) -> tuple[Label, ...]:
    """Labels at their anchors: no two texts touch, no line crosses a text where that can be avoided, none is beyond
    the ends."""
    ending: list[Label] = []
    for text, anchor in sorted(texts, key=lambda w: -w[1]):
        size = min(width - SIZE.mark, SIZE.character * len(text))
        crowded = any(label.x <= anchor for label in ending)
        if anchor + SIZE.mark + size > width or (crowded and anchor > SIZE.mark + size):
            x = max(0.0, min(anchor, width) - SIZE.mark - size)
            ending.append(Label(text, x, 0, anchor, size, ends=True))
    beginning = [w for w in sorted(texts, key=lambda w: -w[1]) if w not in [(e.text, e.anchor) for e in ending]]
    labels: list[Label] = []
    for label in reversed(ending):
        labels.append(_in_free_row(label, labels))
    for text, anchor in beginning:
        label = Label(text, anchor + SIZE.mark, 0, anchor, min(width - SIZE.mark, SIZE.character * len(text)))
        labels.append(_in_free_row(label, labels))
    return tuple(labels)


def _in_free_row(label: Label, placed: Sequence[Label]) -> Label:
    """The label in the first row in which it collides with no other; a new one if there is none."""
    rows = [replace(label, row=r) for r in range(2 + max((o.row for o in placed), default=-1))]
    return next((x for x in rows if not any(x.collides(o) for o in placed)), rows[-1])


def boxes(parts: Sequence[Piece], colour: Mapping[str, str], width: float = SIZE.width) -> tuple[Box, ...]:
    """The pieces side by side; together they have the width."""
    total = sum(p.energy for p in parts) or 1.0
    ends = [0.0, *accumulate(width * p.energy / total for p in parts)]
    return tuple(
        Box(x, end - x, colour.get(p.key, NOISE), p.kind in ("form", "unexplained"), f"{p.name}: {_share(p, total)}")
        for p, x, end in zip(parts, ends, ends[1:], strict=False)
    )


def strip(
    parts: Sequence[Piece], colour: Mapping[str, str], texts: Mapping[str, str], marks: Sequence[tuple[str, float]]
) -> Strip:
    """A bar. texts: what is written for a piece, by key; marks: texts above it and their deviation (RMS)."""
    drawn = boxes(parts, colour)
    inside, below = [], []
    for piece, box in zip(parts, drawn, strict=True):
        text = texts.get(piece.key, "")
        middle = box.x + 0.5 * box.width
        if not text:
            continue
        if SIZE.character * len(text) + 8.0 < box.width and not box.hatched:
            inside.append(Inside(text, middle, "#fff" if box.colour in DARK else "#111"))
        else:
            below.append((text, middle))
    total = sum(p.energy for p in parts) or 1.0
    places = [(text, SIZE.width * (1.0 - min(1.0, level**2 / total))) for text, level in marks]
    return Strip(drawn, tuple(inside), spread(places), spread(below))


def budget_strips(levels: Data, parts: Sequence[Piece], texts: Mapping[str, str]) -> tuple[Strip, ...]:
    """The bar of the whole and, where calibration takes most of it, a second one of what it leaves."""
    colour = colours(parts)
    whole = sum(p.energy for p in parts) or 1.0
    rest = [p for p in parts if p.kind != "calibration"]
    remaining = sum(p.energy for p in rest)
    start = (f"{multiple(levels['delivered'])} as delivered", levels["delivered"])
    middle = (f"{multiple(levels['calibrated'])} calibrated", levels["calibrated"])
    ends = [(f"{multiple(levels['noise'])} noise", levels["noise"])]
    effects = sum(p.energy for p in parts if p.kind in ("effect", "form"))
    if effects and any(p.kind == "unexplained" and p.energy for p in parts):
        ends.insert(0, (f"{multiple(levels['explained'])} with the effects", sqrt(remaining - effects)))
    shown = {p.key: texts.get(p.key, "") for p in parts if p.energy > 0.0 and not p.minor}
    if remaining / whole > SIZE.zoom or len(rest) < 3:
        return (strip(parts, colour, shown, [start, middle, *ends]),)
    first = {k: v for k, v in shown.items() if k == "calibration"}
    return strip(parts, colour, first, [start, middle]), strip(rest, colour, shown, [middle, *ends])


def _share(piece: Piece, total: float) -> str:
    return f"{100.0 * piece.energy / total:.1f} % of the squared deviation as delivered"
