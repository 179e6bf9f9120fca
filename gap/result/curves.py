"""The free curves of the most probable hypothesis that has one, with their bands, as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..campaign.catalogue import Curve
from ..estimation.uncertainty import data_covariance
from ..pipeline.state import State
from ..problem.curves import CurveForm, formula_over, knots_of
from ..problem.parameters import EffectCandidate, Point
from ..selection.evidence import RankedHypothesis


def curves(s: State) -> list[dict[str, Any]]:
    """Each curve once, of the most probable hypothesis that has it, where that effect is named and the curve not
    improbable."""
    first_with: dict[str, tuple[RankedHypothesis, EffectCandidate, CurveForm]] = {}
    least = s.problem.settings.curves.told
    for r in s.ranked:
        for c in r.hypothesis.candidates:
            if isinstance(c.form, CurveForm) and s.is_named(c.id):
                first_with.setdefault(c.form.id, (r, c, c.form))
    return [_curve(s, r, c, form) for r, c, form in first_with.values() if _probability(s, c) >= least]


def _curve(s: State, r: RankedHypothesis, c: EffectCandidate, form: CurveForm) -> dict[str, Any]:
    """Points of the curve with what the formulas make of it, their 95 % band, and the same effects' plain forms, all at
    the same x. The band is that of the whole, for level and curve stand in for each other, and of what is smooth in a
    machine where this curve has corners."""
    fit, problem = r.hypothesis.fit, s.problem
    knots = knots_of(form.curve, _values(s, fit.point))
    x = _drawn_at(knots, problem.settings.curves.drawn)

    def whole(point: Point) -> np.ndarray:
        values = formula_over(form.curve, _values(s, point), x) + np.interp(x, knots, form.values(point))
        return np.asarray(values, float)

    total, step = whole(fit.point), problem.settings.curves.step
    effects = {x.name for c in r.hypothesis.candidates for x in c.parameters}
    effect_columns = [k for k, p in enumerate(fit.parameters) if p.name in effects]
    points = [{**fit.point, fit.parameters[k].name: float(fit.normalised[k]) + step} for k in effect_columns]
    J = np.stack([(whole(point) - total) / step for point in points], axis=1)
    settings = problem.settings.uncertainty
    C = data_covariance(problem, fit, s.nuisance_jacobian, settings.form_energy)[np.ix_(effect_columns, effect_columns)]
    reach = settings.width * np.sqrt(np.einsum("ij,jk,ik->i", J, C, J))
    reach = np.hypot(reach, np.interp(x, knots, smoothed_away(knots, form.values(fit.point))))
    plain = _plain(s, r, c)
    return {
        "id": form.id, "what": form.text, "effect": c.id, "x": form.curve.x, "y": form.curve.y,
        "probability": _probability(s, c), "points": _pairs(x, total), "band95": _pairs(total - reach, total + reach),
        "knots": _pairs(knots, form.values(fit.point)),
        "plain": [] if plain is None else _pairs(x, _formula(s, plain, form.curve, x)),
    }  # fmt: skip


def smoothed_away(knots: np.ndarray, values: np.ndarray) -> np.ndarray:
    """How far (knots,) straight lines that fit a smooth curve best are from it: a twelfth of the square of the distance
    between knots times its second derivative, here that of the parabola through each three of them."""
    if knots.size < 3:
        return np.zeros(knots.size)
    h, slope = np.diff(knots), np.diff(values) / np.diff(knots)
    bent = np.abs(np.diff(slope)) / (h[:-1] + h[1:]) * 2.0
    wide = np.maximum(h[:-1], h[1:])
    return np.pad(bent * wide**2 / 12.0, 1, mode="edge")


def _drawn_at(knots: np.ndarray, between: int) -> np.ndarray:
    """Places at which a curve is drawn: its knots, and so many between two of them."""
    steps = np.linspace(0.0, 1.0, between + 1, endpoint=False)
    return np.append((knots[:-1, None] + np.diff(knots)[:, None] * steps).ravel(), knots[-1])


def _plain(s: State, r: RankedHypothesis, c: EffectCandidate) -> RankedHypothesis | None:
    """The same effects without the curve, where they were fitted."""
    plain_key = r.hypothesis.key - {c.name} | {c.label}
    return next((other for other in s.ranked if other.hypothesis.key == plain_key), None)


def _formula(s: State, r: RankedHypothesis, curve: Curve, x: np.ndarray) -> np.ndarray:
    return formula_over(curve, _values(s, r.hypothesis.fit.point), x)


def _values(s: State, point: Point) -> Mapping[str, Any]:
    return {**s.problem.runs[0].values, **s.problem.model_values(0, point)}


def _probability(s: State, c: EffectCandidate) -> float:
    return sum(p for r, p in zip(s.ranked, s.probabilities, strict=True) if c.name in r.hypothesis.key)


def _pairs(a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray) -> list[list[float]]:
    return np.stack([a, b], axis=1).tolist()  # type: ignore[no-any-return]
