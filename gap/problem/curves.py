"""Free curves as forms of effects: values at knots as sums of a few smooth shapes, whose sizes are estimated.

The values have a Gaussian prior whose covariance falls with the distance of two knots; its leading eigenvectors, scaled
by the usual size, are the shapes (Rasmussen and Williams 2006, section 4.3). So neighbouring knots move together where
the data do not tell them apart, and a curve costs fewer parameters than it has knots.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..campaign.catalogue import Curve
from ..settings import CurveSettings
from .parameters import EffectForm, EstimatedParameter


@dataclass(frozen=True, eq=False)
class CurveForm(EffectForm):
    """The form of an effect that has the curve in the place of a formula."""

    curve: Curve

    def values(self, point: Mapping[str, float]) -> np.ndarray:
        """What a point adds at the knots (knots,)."""
        added = sum(np.array(x.weights) * x.value(point.get(x.name, 0.0)) for x in self.parameters)
        return np.asarray(added, float)


def curve_form(curve: Curve, settings: CurveSettings) -> CurveForm:
    """The curve as a form, all of whose parameters are 0 where nothing is added."""
    shapes = smooth_shapes(np.array(curve.knots), settings) * curve.prior
    parameters = tuple(
        EstimatedParameter(
            f"curve.{curve.id}.{k}", "effect", 0.0, 1.0, -settings.reach, settings.reach, settings.std,
            curve.parameters, shape=True, starts=(settings.start,), weights=tuple(shape.tolist()),
        )
        for k, shape in enumerate(shapes, 1)
    )  # fmt: skip
    return CurveForm(curve.id, curve.text, parameters, curve)


def smooth_shapes(knots: np.ndarray, settings: CurveSettings) -> np.ndarray:
    """Shapes (shapes, knots) whose sum with independent N(0, 1) factors has the prior's covariance but for what
    little is cut off. Distances count in knots from zero; those at either side of it resemble their mirror images."""
    size = np.abs(knots)
    place = np.searchsorted(np.unique(size), size).astype(float)
    distance = (place[:, None] - place[None, :]) / settings.length
    other_side = (knots[:, None] < 0.0) != (knots[None, :] < 0.0)
    covariance = np.exp(-0.5 * distance**2) * np.where(other_side, settings.mirror, 1.0)
    energy, vectors = np.linalg.eigh(covariance)
    leading = [k for k in np.argsort(-energy) if energy[k] > settings.least_energy * energy.max()]
    return np.array([vectors[:, k] * np.sqrt(energy[k]) for k in leading])


def knots_of(curve: Curve, values: Mapping[str, Any]) -> np.ndarray:
    """The knots (knots,) in the unit of x."""
    return np.array(curve.knots) * (float(values[curve.knots_of]) if curve.knots_of else 1.0)


def formula_over(curve: Curve, values: Mapping[str, Any], x: np.ndarray) -> np.ndarray:
    """What a curve's formula gives at x (n,), with the parameters' values by address; 0 where it has none. Raises
    ValueError where it cannot be computed."""
    if not curve.formula:
        return np.zeros(len(x))
    from simpleeval import InvalidExpression, SimpleEval  # only a curve with a formula needs it

    constants = {name: float(values[address]) for name, address in curve.names.items()}
    functions = {"tanh": np.tanh, "exp": np.exp, "sqrt": np.sqrt, "sign": np.sign, "abs": abs, "min": min, "max": max}
    results = []
    for at in x.tolist():
        try:
            with np.errstate(all="ignore"):
                value = float(SimpleEval(names={**constants, "x": at}, functions=functions).eval(curve.formula))
            if not np.isfinite(value):
                raise ValueError(f"it gives {value:g}")
            results.append(value)
        except (InvalidExpression, SyntaxError, ArithmeticError, TypeError, ValueError) as error:
            raise ValueError(f"'{curve.formula}' at x = {at:g}: {error}") from None
    return np.array(results)
