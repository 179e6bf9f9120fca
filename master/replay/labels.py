"""Texts at places of a scene: what the package wants shown, and the components' names where there are several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.display_units import DisplayUnits
from ...core.errors import CosimError, did_you_mean
from ...ssp.model import ReplayAsked, ReplayLabel
from .colours import values
from .motion import names
from .stage import Part, Stage

Box = tuple[float, float, float, float]
"""Left, top, right, bottom [pixels]."""

KINDS = ("site", "geom", "body")
SIDES = (
    (0.06, -0.08), (0.06, 0.06), (-0.06, -0.08), (-0.06, 0.06), (0.10, -0.01), (-0.10, -0.01), (0.14, 0.08),
    (-0.14, -0.08), (-0.14, 0.08), (0.14, -0.12), (0.0, -0.17), (0.0, 0.14), (0.22, 0.0), (-0.22, 0.0),
)  # fmt: skip
"""Where a text may stand beside its place, the best first, as shares of the picture's height."""


COVERED = 0.3
"""How bad it is to cover a part of the machine, where covering another text is 1."""


@dataclass(frozen=True)
class Label:
    """A text at a site, geom or body of the model (kind, number), with a value over the times of its run (n,) as it is
    shown: `factor` times it and `offset` in `unit`."""

    place: tuple[str, int]
    text: str
    times: np.ndarray
    values: np.ndarray | None = None
    factor: float = 1.0
    offset: float = 0.0
    unit: str = ""
    decimals: int = 0

    def at(self, t: float) -> str:
        """The text at a time [s]."""
        if self.values is None:
            return self.text
        x = self.factor * float(np.interp(t, self.times, self.values)) + self.offset
        return self.text.replace("{}", f"{_plain(x, self.decimals)} {self.unit}".rstrip(), 1)


def _plain(x: float, decimals: int) -> str:
    """A number without the sign of a zero."""
    return f"{x:.{decimals}f}" if round(x, decimals) else f"{0.0:.{decimals}f}"


def labels(asked: ReplayAsked, stage: Stage, display: DisplayUnits) -> tuple[tuple[Label, ...], list[str]]:
    """What stands at the parts that are no ghosts, and remarks on what is left out."""
    parts = {p.prefix: p for p in stage.parts}
    numbers = {kind: names(stage.model, kind) for kind in KINDS}
    made, remarks = [], []
    for told in asked.labels:
        name = f"{told.component}/{told.at}"
        place = next(((kind, numbers[kind][name]) for kind in KINDS if name in numbers[kind]), None)
        part = parts.get(f"{told.component}/")
        if part is None or place is None:
            own = [n.removeprefix(f"{told.component}/") for kind in KINDS for n in numbers[kind]]
            hint = did_you_mean(told.at, own)
            remarks.append(f"{told.where}: not shown: '{told.component}' has no place '{told.at}' in a scene{hint}")
            continue
        try:
            made.append(_label(told, place, part, display))
        except CosimError as error:
            remarks.append(f"{told.where}: not shown: {error}")
    return (*made, *_names(asked, stage)), remarks


def _names(asked: ReplayAsked, stage: Stage) -> list[Label]:
    """Names of components at their scenes, where there are several and the package says nothing of one."""
    solid = [p for p in stage.parts if not p.ghost]
    told = {label.component for label in asked.labels}
    geoms = names(stage.model, "geom")
    made = []
    for part in solid if len(solid) > 1 else ():
        place = next((k for name, k in geoms.items() if name.startswith(part.prefix)), None)
        if part.scene.component not in told and place is not None:
            made.append(Label(("geom", place), part.scene.component, part.run.times))
    return made


def _label(told: ReplayLabel, place: tuple[str, int], part: Part, display: DisplayUnits) -> Label:
    times = part.run.times
    if not told.formula:
        return Label(place, told.text, times)
    x = values(told.formula, part.run)
    largest = float(np.nanmax(np.abs(x))) if np.isfinite(x).any() else 0.0
    unit, factor, offset = display.of(told.unit, largest) if told.unit else ("", 1.0, 0.0)
    shown = abs(factor) * largest
    decimals = int(np.clip(2 - np.floor(np.log10(shown)), 0, 6)) if shown > 0.0 else 0
    text = told.text if "{}" in told.text else f"{told.text} {{}}"
    return Label(place, text, times, x, factor, offset, "" if unit == "1" else unit, decimals)


def arranged(
    anchors: np.ndarray, sizes: Sequence[tuple[float, float]], taken: Sequence[Box], picture: tuple[int, int],
    busy: np.ndarray,
) -> list[tuple[float, float]]:  # fmt: skip
    """Offsets [pixels] of the middles of texts from their places, so that texts cover neither each other nor what is
    taken, and stay in the picture, over the whole film, and cover little of the points that are busy: anchors
    (n, labels, 2), sizes of the texts (width, height), busy (n, points, 2)."""
    chosen: list[tuple[float, float]] = []
    placed: list[np.ndarray] = [np.tile(np.array(box, dtype=float), (len(anchors), 1)) for box in taken]
    width, height = picture
    for k, (wide, tall) in enumerate(sizes):
        best: tuple[float, np.ndarray, tuple[float, float]] | None = None
        for rank, (x, y) in enumerate(SIDES):
            offset = (x * height + np.sign(x) * 0.5 * wide, y * height)
            middle = anchors[:, k] + offset
            half = np.array([0.5 * wide, 0.5 * tall])
            box = np.concatenate([middle - half, middle + half], axis=1)
            outside = (box[:, 0] < 0) | (box[:, 1] < 0) | (box[:, 2] > width) | (box[:, 3] > height)
            inside = np.logical_and(busy > box[:, None, :2], busy < box[:, None, 2:]).all(axis=2)
            bad = float(outside.sum()) + sum(float(_overlap(box, other).sum()) for other in placed)
            bad += COVERED * float(np.any(inside, axis=1).sum()) + 1e-3 * rank
            if best is None or bad < best[0]:
                best = (bad, box, offset)
        assert best is not None
        placed.append(best[1])
        chosen.append(best[2])
    return chosen


def _overlap(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 4) meet."""
    apart = (
        (one[:, 2] < other[:, 0]) | (other[:, 2] < one[:, 0]) | (one[:, 3] < other[:, 1]) | (other[:, 3] < one[:, 1])
    )
    return np.asarray(~apart)
