"""Fits of the true set and of what a diagnosis said, alike: same problem, same steps, several starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.gap.campaign import read_catalogue as catalogues
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.estimation.linear import profile_nuisances
from deepsea_cosim.gap.estimation.scheduler import run_fits
from deepsea_cosim.gap.pipeline.preparation import assess_steps, prepare_fits
from deepsea_cosim.gap.pipeline.state import State, initial_state
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.parameters import penalty
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.selection.hypothesis import Hypothesis, penalised_deviance
from deepsea_cosim.master.parallel.pool import Pool

from ..scoring.names import same_set
from ..scoring.said import Hypothesis as SaidHypothesis
from ..scoring.said import Said, said
from ..scoring.true import UNKNOWN, Truth
from .gauss_newton import fit
from .starts import Start, candidates_of, known_values, looked_for, rated, start_at

STARTS = 3
"""Fits that are begun for a set of effects."""

FIRST, MOST = 3, 12
"""Iterations after which all but the best fit are left, and most of that."""


def judge(case: Path, answer: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """What the true set leaves when it is fitted from the truth, and what the best hypothesis of a diagnosis does.

    case: folder with campaign.toml. Empty for a case whose effect the catalogue does not have.
    """
    truth, told = Truth.of(dict(answer)), said(dict(diagnosis))
    if truth.kind == UNKNOWN:
        return {}
    campaign = read(case / "campaign.toml")
    catalogue = catalogues.load(campaign.effects) if campaign.effects else catalogues.load_from_package(campaign.system)
    with Pool(campaign.system, None, 1) as pool:
        state = _prepared(initial_state(campaign, catalogue, pool, StopToken()), diagnosis.get("numerics", {}))
        names = tuple(e.name for e in truth.effects)
        best = best_hypothesis(told)
        true = _best_fit(state, true_starts(state, names, answer, best))
        other = true if same_set(names, best.effects) else _best_fit(state, said_starts(state, best))
        d = state.problem.discretisation
        return {
            "true": _figures(state, true), "said": _figures(state, other),
            "numerics": {"method": d.method, "step": d.macro_step, "richardson_order": d.richardson_order},
            "simulations": pool.count,
        }  # fmt: skip


def best_hypothesis(told: Said) -> SaidHypothesis:
    """The most probable hypothesis of a diagnosis; none of its effects where it sees no gap."""
    nothing = SaidHypothesis((), 1.0, told.calibrated)
    if told.verdict == "no_significant_gap":
        return nothing
    return max(told.hypotheses, key=lambda h: h.probability, default=nothing)


def _prepared(state: State, numerics: Mapping[str, Any]) -> State:
    """With the discretisation of the diagnosis: its stages before the search, and the step that it ended with."""
    state = assess_steps(state)
    steps = {key: numerics[key] for key in ("method",) if key in numerics}
    if "step" in numerics:
        steps["macro_step"] = min(float(numerics["step"]), state.problem.macro_step)
    problem = state.problem.with_discretisation(**steps)
    return prepare_fits(replace(state, problem=problem))


def true_starts(state: State, names: Sequence[str], answer: Mapping[str, Any], best: SaidHypothesis) -> list[Start]:
    """Starts of the true set: true base parameters and values, what responds like the rest, and the diagnosis' own."""
    problem, N, known = state.problem, state.nuisance_jacobian, known_values(answer)
    candidates = candidates_of(problem, names)
    start = start_at(problem, candidates, answer["base"], known)
    found = looked_for(problem, start, known, N, STARTS - 1)
    # the library's base machine is not the plant's: base parameters as stated may be nearer
    found += rated(problem, [start_at(problem, candidates, {}, _values(found[0]))], N)
    if best.parameters and same_set(names, best.effects):
        found += rated(problem, [start_at(problem, candidates, answer["base"], best.parameters)], N)
    return found


def said_starts(state: State, best: SaidHypothesis) -> list[Start]:
    """Starts of what was said: at its parameters where they are told, and at the best sizes."""
    problem, N = state.problem, state.nuisance_jacobian
    candidates = candidates_of(problem, best.effects)
    start = start_at(problem, candidates, {}, best.parameters)
    return [*rated(problem, [start], N), *looked_for(problem, start, {}, N, STARTS - 1)]


def _values(start: Start) -> dict[str, float]:
    pairs = zip(start.parameters, start.u.tolist(), strict=True)
    return {x.name: x.start + x.scale * v for x, v in pairs if x.kind != "base"}


def _best_fit(state: State, starts: Sequence[Start]) -> Hypothesis:
    """The best fit from some starts; raises `RuntimeError` where none of them can be simulated."""
    problem, N = state.problem, state.nuisance_jacobian
    begun = run_fits(problem, [fit(problem, s.parameters, s.u, N, FIRST) for s in starts])
    made = [Hypothesis(s.candidates, f) for s, f in zip(starts, begun, strict=True) if f is not None]
    if not made:
        raise RuntimeError(f"no start can be simulated: {problem.simulator.failure}")
    best = min(made, key=lambda h: h.penalised_deviance)
    last = run_fits(problem, [fit(problem, best.fit.parameters, best.fit.normalised, N, MOST, resumed=best.fit)])[0]
    ended = [best] if last is None else [best, Hypothesis(best.candidates, last)]
    return min(ended, key=lambda h: h.penalised_deviance)


def _figures(state: State, h: Hypothesis) -> dict[str, Any]:
    """What a fit leaves when it is run exactly, and where it stands."""
    problem = state.problem
    model = problem.exact([h.fit.point])[0]
    residual, q = h.fit.residual, h.fit.nuisances
    if model is not None:
        q, residual = profile_nuisances(problem, model, state.nuisance_jacobian, h.fit.dispersion)
    strain = penalty(h.fit.parameters, h.fit.normalised) + float(np.sum(q[: h.fit.channels] ** 2))
    values = {x.name: x.value(v) for x, v in zip(h.fit.parameters, h.fit.normalised.tolist(), strict=True)}
    return {
        "effects": [c.label for c in h.candidates], "left": rms(residual), "status": h.fit.status,
        "deviance": penalised_deviance(rms(residual), strain), "values": values,
    }  # fmt: skip
