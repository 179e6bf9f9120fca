"""Formulas for the search: effects of a motion, and a round from the model as delivered."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from deepsea_cosim.gap.estimation.fit import Fit
from deepsea_cosim.gap.estimation.linear import profile_nuisances
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter, Point
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.response_bank import ResponseBank, bank_of_usual_sizes, complete_bank
from deepsea_cosim.gap.search.rounds import Round, search_round
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, at_any_step, measured

T = np.linspace(0.0, 10.0, 800)
BASE = (EstimatedParameter("a", "base", 1.0, 0.05, -1.0, 1.0, 0.6),)


def effect(
    name: str, low: float = -8.0, high: float = 8.0, kind: str = "effect", group: str = "", sd: float = 3.0
) -> EffectCandidate:
    """A candidate with one parameter of its name."""
    return EffectCandidate(name, name, group or name, (EstimatedParameter(name, kind, 0.0, 1.0, low, high, sd),))


def pitch(k: int) -> float:
    """Of the oscillation of effect k: they are orthogonal over the run [1/s]."""
    return 2.0 * np.pi * (3 + 2 * k) / 10.0


def moving(laws: Mapping[str, Callable[[float], float]]) -> Callable[[Point], np.ndarray]:
    """A machine to whose motion each effect adds an oscillation of its own, as large as its law says."""
    names = list(laws)

    def machine(p: Point) -> np.ndarray:
        y = (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T)
        for k, name in enumerate(names):
            y = y + laws[name](p.get(name, 0.0)) * np.cos(pitch(k) * T)
        return y

    return machine


def posed(
    machine: Callable[[Point], np.ndarray | None], truth: Point, candidates: Sequence[EffectCandidate],
    base: Sequence[EstimatedParameter] = BASE, noise: float = 0.01,
) -> tuple[FormulaProblem, np.ndarray]:  # fmt: skip
    """The problem of a machine measured at its truth, and its nuisances' columns."""
    observations = measured(machine, truth, T, noise)
    p = FormulaProblem(at_any_step(machine), observations, tuple(base), tuple(candidates))
    return p, nuisance_jacobian_at(p, machine({}))


def first_round(p: FormulaProblem, nuisance_jacobian: np.ndarray) -> Round:
    """A round from the model as delivered."""
    return search_round(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian))


def start(p: FormulaProblem, nuisance_jacobian: np.ndarray, candidates: Sequence[EffectCandidate], point: Point
          ) -> Hypothesis:  # fmt: skip
    """A hypothesis of some effects that stands at a point, without derivatives."""
    parameters = (*p.base, *(x for c in candidates for x in c.parameters))
    u = np.array([point.get(x.name, 0.0) for x in parameters])
    (coarse,), (exact,) = p.evaluate_both([point], [point])
    q, residual = profile_nuisances(p, exact, nuisance_jacobian, 1.0)
    fit = replace(
        simulate_nominal(p, nuisance_jacobian).fit, parameters=parameters, normalised=u, model=exact, residual=residual,
        nuisances=q, correction=exact - coarse, jacobian=np.zeros((len(exact), len(u))),
    )  # fmt: skip
    return Hypothesis(tuple(candidates), fit)


LINEAR = {name: (lambda u: 0.1 * u) for name in ("p", "q")}
P, Q = effect("p"), effect("q")
"""Two effects that act in proportion to their size."""


def bank_at(p: FormulaProblem, fit: Fit) -> ResponseBank:
    """The whole bank at a fit that has no effects."""
    return complete_bank(p, bank_of_usual_sizes(p, fit.point, fit.model - fit.correction, fit.correction))


def moved(p: FormulaProblem, calls: Sequence[int]) -> list[int]:
    """How many runs each of these calls for derivatives had: those with a point for every parameter."""
    return [n for n in calls if n >= len(p.base) + 1]
