"""Where fits of a set of effects begin: at the truth where the library can say it, else at what responds like it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from deepsea_cosim.gap.estimation.linear import profile_nuisances
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter, penalty, point_of
from deepsea_cosim.gap.problem.problem import Problem
from deepsea_cosim.gap.selection.hypothesis import penalised_deviance

from ..scoring.names import same_effect

SIZES = (0.01, 0.03, 0.07, 0.13, 0.22, 0.35, 0.5, 0.7, 0.85, 1.0)
"""Shares of its range at which an effect without a known value is run, on each side."""

SHAPES = 12
"""Most combinations of further parameters that are run at each size."""

ROUNDS = 2
"""How often several effects without a known value are looked for in turn, each with the others at their best."""


@dataclass(frozen=True, eq=False)
class Start:
    """Normalised values u (k,) of the base parameters and of the effects' parameters, and the deviance there."""

    candidates: tuple[EffectCandidate, ...]
    parameters: tuple[EstimatedParameter, ...]
    u: np.ndarray
    deviance: float = np.inf


def candidates_of(problem: Problem, names: Sequence[str]) -> tuple[EffectCandidate, ...]:
    """The candidates of a problem with those names; raises `LookupError` where one is missing."""
    found = []
    for name in names:
        met = [c for c in problem.candidates if same_effect(c.label, name)]
        if not met:
            raise LookupError(f"the catalogue of the campaign has no effect '{name}'")
        found.append(met[0])
    return tuple(found)


def start_at(
    problem: Problem, candidates: tuple[EffectCandidate, ...], base: Mapping[str, float], values: Mapping[str, float]
) -> Start:
    """A start with base parameters (factors) and parameters of effects (values) by name; what is missing is neutral."""
    parameters = (*problem.base, *(x for c in candidates for x in c.parameters))
    u = []
    for x in parameters:
        given = base.get(x.name) if x.kind == "base" else values.get(x.name)
        u.append(0.0 if given is None else float(np.clip((given - x.start) / x.scale, x.low, x.high)))
    return Start(candidates, parameters, np.array(u))


def known_values(answer: Mapping[str, Any]) -> dict[str, float]:
    """Values of the library's parameters that mean exactly what is true, by address."""
    return {a: float(v) for e in answer["effects"] for a, v in e["library"].items() if v is not None}


def looked_for(
    problem: Problem, start: Start, known: Mapping[str, float], nuisance_jacobian: np.ndarray, best: int
) -> list[Start]:
    """Starts at the best sizes and shapes of the effects without a known value, the best first; `best` of them.

    Each such effect is run over its range with everything else as it is in the start.
    """
    open_ = [c for c in start.candidates if c.parameters[0].name not in known]
    found = [rated(problem, [start], nuisance_jacobian)[0]]
    for _ in range(ROUNDS if len(open_) > 1 else 1):
        for candidate in open_:
            tried = list(_sizes(found[0], candidate))
            found = sorted([*found, *rated(problem, tried, nuisance_jacobian)], key=lambda s: s.deviance)[:best]
    return found


def _sizes(start: Start, candidate: EffectCandidate) -> Iterator[Start]:
    first, shapes = candidate.parameters[0], candidate.parameters[1:]
    names = [x.name for x in start.parameters]
    sizes = [s * end for end in (first.low, first.high) if end for s in SIZES]
    grids = [tuple(dict.fromkeys((0.0, *x.starts))) for x in shapes]
    combinations = list(product(*grids))
    step = -(-len(combinations) // SHAPES)
    for size, shape in product(sizes, combinations[::step]):
        u = start.u.copy()
        u[names.index(first.name)] = size
        for x, v in zip(shapes, shape, strict=True):
            u[names.index(x.name)] = v
        yield replace(start, u=u)


def rated(problem: Problem, starts: Sequence[Start], nuisance_jacobian: np.ndarray) -> list[Start]:
    """The starts with their deviance, at the fit's step; infinite where the model does not run."""
    models = problem.evaluate([point_of(s.parameters, s.u) for s in starts])
    made = []
    for s, model in zip(starts, models, strict=True):
        if model is None:
            made.append(replace(s, deviance=np.inf))
            continue
        q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
        strain = penalty(s.parameters, s.u, q[: len(problem.observations.span)])
        made.append(replace(s, deviance=penalised_deviance(rms(residual), strain)))
    return made
