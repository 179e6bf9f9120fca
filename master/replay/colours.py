"""Colours that stand for values, as a package asks for them: scales, and which part of which scene has the colour of
what.

What an annotation asks for and the run or the scene does not have is left out with a remark: the motion is there
without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import CosimError, did_you_mean
from ...ssp.model import ReplayAsked, ReplayScale
from ..simulation.formulas import Formula, FormulaError, number
from .film import Film
from .motion import names
from .recorded import RecordedRun
from .stage import Stage

RAMP = np.array([
    (0.12, 0.26, 0.78), (0.30, 0.66, 0.92), (0.99, 0.92, 0.52), (0.97, 0.52, 0.20), (0.78, 0.06, 0.10),
])  # fmt: skip
"""From the least to the greatest value: blue, as the return line is drawn, to red, as the pressure line is; told apart
by those who do not see red and green."""


@dataclass(frozen=True)
class Scale:
    """A range of values and its name; the colours between are those of `RAMP`."""

    name: str
    text: str
    unit: str
    least: float
    greatest: float

    def rgba(self, values: np.ndarray) -> np.ndarray:
        """Colours (n, 4) of values (n,); beyond the ends they are those of the ends."""
        width = self.greatest - self.least
        share = np.clip((values - self.least) / (width if width else 1.0), 0.0, 1.0)
        at = np.linspace(0.0, 1.0, len(RAMP))
        rgb = [np.interp(share, at, RAMP[:, k]) for k in range(3)]
        return np.stack([*rgb, np.ones_like(share)], axis=-1)


@dataclass(frozen=True)
class Coloured:
    """A geom of the model that is coloured by values over the times of its run."""

    geom: int
    scale: Scale
    run: RecordedRun
    values: np.ndarray


def colours(asked: ReplayAsked, stage: Stage) -> tuple[tuple[Scale, ...], tuple[Coloured, ...], list[str]]:
    """Scales and coloured geoms of the parts that are no ghosts, and remarks on what is left out."""
    remarks: list[str] = []
    geoms, parts = names(stage.model, "geom"), {p.prefix: p for p in stage.parts}
    found: list[tuple[int, str, RecordedRun, np.ndarray]] = []
    for colour in asked.colours:
        part = parts.get(f"{colour.component}/")
        name = f"{colour.component}/{colour.geom}"
        if part is None or name not in geoms:
            own = [n.removeprefix(f"{colour.component}/") for n in geoms if n.startswith(f"{colour.component}/")]
            remarks.append(
                f"{colour.where}: not coloured: there is no geom '{colour.geom}' in a scene of '{colour.component}'"
                + did_you_mean(colour.geom, own)
            )
            continue
        try:
            found.append((geoms[name], colour.scale, part.run, values(colour.formula, part.run)))
        except CosimError as error:
            remarks.append(f"{colour.where}: '{name}' is not coloured: {error}")
    scales = {}
    for told in asked.scales:
        own_values = [x for _, name, _, x in found if name == told.name]
        if own_values:
            run = next(run for _, name, run, _ in found if name == told.name)
            scales[told.name] = _scale(told, run, own_values, remarks)
    made = tuple(Coloured(geom, scales[name], run, x) for geom, name, run, x in found)
    return tuple(scales.values()), made, remarks


def values(formula: str, run: RecordedRun) -> np.ndarray:
    """A formula of addresses over the times of a run, (n,); NaN where it does not exist."""
    parsed, known = Formula(formula), run.everything()
    if lacking := [name for name in parsed.names if name not in known]:
        raise FormulaError(f"the run recorded no '{lacking[0]}'{did_you_mean(lacking[0], list(known))}")
    found = parsed.of(run.times, known)
    return np.broadcast_to(np.nan if found is None else np.asarray(found, dtype=float), run.times.shape)


def _scale(told: ReplayScale, run: RecordedRun, coloured: Sequence[np.ndarray], remarks: list[str]) -> Scale:
    """A scale with its ends; one that nobody states, or that cannot be computed, is that of the values."""
    finite = np.concatenate([x[np.isfinite(x)] for x in coloured])
    ends = [float(finite.min()), float(finite.max())] if len(finite) else [0.0, 1.0]
    for k, formula in enumerate((told.least, told.greatest)):
        try:
            if formula and (end := number(Formula(formula).of(run.times, run.everything()))) is not None:
                ends[k] = end
        except FormulaError as error:
            remarks.append(f"{told.where}: scale '{told.name}': {error}; what the run had counts")
    return Scale(told.name, told.text, told.unit, *ends)


def coloured_film(shot: Film, coloured: Sequence[Coloured], times: np.ndarray) -> Film:
    """A film with these colours at its times (n,) [s]."""
    rgba = np.zeros((len(shot), len(coloured), 4))
    for k, c in enumerate(coloured):
        rgba[:, k] = c.scale.rgba(np.interp(times, c.run.times, c.values))
    rgba[np.isnan(rgba)] = 0.5
    return replace(shot, coloured=np.array([c.geom for c in coloured], dtype=int), rgba=rgba)
