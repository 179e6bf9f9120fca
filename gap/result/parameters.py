"""Parameters of a fit with intervals, units and whether they stand at a bound, as JSON."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..estimation.fit import Fit
from ..estimation.uncertainty import parameter_std
from ..problem.parameters import EstimatedParameter, sensor_quantity
from ..problem.problem import Problem


def parameters(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray, kinds: tuple[str, ...]) -> dict[str, Any]:
    """Value, 95 % interval, unit and whether it is at a bound, of a fit's parameters of these kinds, by name."""
    std, width = parameter_std(problem, fit, nuisance_jacobian), problem.settings.uncertainty.width
    by_name = {}
    for x, u, s, end in zip(fit.parameters, fit.normalised, std, fit.at_bound, strict=True):
        if x.kind not in kinds or x.weights:  # a curve's are told as the curve
            continue
        low, high = max(x.low, u - width * s), min(x.high, u + width * s)
        factor, unit = shown_scale(problem, x)
        ends = sorted((x.value(low) * factor, x.value(high) * factor))
        by_name[x.name] = {"value": x.value(u) * factor, "ci95": ends, "unit": unit, "at_bound": end}
    return by_name


def moved_base(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> dict[str, Any]:
    """The base parameters of a fit, with their change as a share of what is stated and of which tolerance that is.

    A tolerance that is a factor is told as the largest change that it allows, and as the factor beside it.
    """
    by_name = parameters(problem, fit, nuisance_jacobian, ("base",))
    for x, u in zip(fit.parameters, fit.normalised, strict=True):
        if x.kind == "base":
            tolerance = x.scale if x.factor is None else x.factor - 1.0
            move = {"change": x.value(u) - 1.0, "tolerance": tolerance, "at_tolerance": by_name[x.name].pop("at_bound")}
            by_name[x.name] |= move
            if x.factor is not None:
                by_name[x.name]["tolerance_factor"] = x.factor
    return by_name


class Scale(NamedTuple):
    """Factor from a parameter's value to the shown one, and its unit."""

    factor: float
    unit: str


def shown_scale(problem: Problem, x: EstimatedParameter) -> Scale:
    """How a parameter is shown: base parameters are factors of the delivered value."""
    if x.kind == "base":
        values = [conditions.values[x.name] for conditions in problem.runs]
        if not any(values):  # shared by several components, of which this one has none
            return Scale(1.0, "of the stated value")
        if all(v == values[0] for v in values):
            return Scale(float(values[0]), problem.parameter_units.get(x.name, "1"))
        return Scale(1.0, "of the stated value")
    if x.kind == "sensor":
        connector, quantity = sensor_quantity(x.name)
        unit = problem.units.get(connector, "1")
        units = {"bias": unit, "drift": f"{unit}/s", "curvature": f"1/({unit})", "lag": "s", "delay": "s"}
        return Scale(1.0, units.get(quantity, "1"))
    return Scale(1.0, problem.parameter_units.get(x.name, "1"))
