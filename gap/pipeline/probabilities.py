"""Stages after the search: probabilities of hypotheses and effects, and the budget of the gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.errors import SimulationError
from ..analysis.budget import Alternative, budget
from ..problem.stop import StopRequested
from ..search.subsets import complete_subsets
from ..selection.evidence import RankedHypothesis
from ..selection.posterior import Evidence, apply_doubts, inclusions, posterior_of
from ..selection.probability_calibration import ProbabilityCalibration
from .absorbed_bias import absorbed_bias, energies_without_bias
from .state import Inclusion, State


def weigh_hypotheses(state: State) -> State:
    """Probabilities of all hypotheses that were looked at, and of every effect and group."""
    problem = state.problem
    ranked = [replace(r, without_bias=energies_without_bias(problem, r, state.ranked)) for r in state.ranked]
    evidence = [_evidence(r) for r in ranked]
    posterior = posterior_of(evidence, ProbabilityCalibration.load(), len(problem.observations))
    groups = {c.id: c.group for c in problem.candidates}
    effects, of_groups = inclusions(posterior, groups)
    order = np.argsort(-posterior.probability, kind="stable")
    state = replace(
        state, ranked=tuple(ranked[k] for k in order),
        probabilities=tuple(float(posterior.probability[k]) for k in order),
    )  # fmt: skip
    tempered = {id: apply_doubts(p, _doubts(state, frozenset([id]))) for id, p in effects.items()}
    members = {g: frozenset(id for id, group in groups.items() if group == g) for g in of_groups}
    of_each_group = {
        g: max([apply_doubts(p, _doubts(state, members[g])), *(tempered[id] for id in members[g])])
        for g, p in of_groups.items()
    }
    return replace(state, inclusion=Inclusion(tempered, of_each_group, groups))


def _evidence(r: RankedHypothesis) -> Evidence:
    return Evidence(r.hypothesis.ids, r.structured_energy, r.terms["prior"], r.curvature, r.without_bias)


def _doubts(state: State, members: frozenset[str]) -> list[float]:
    """What the odds of effects are multiplied by: their best fit stands at a bound, the search was cut off."""
    settings = state.problem.settings.posterior
    factors = [settings.unfinished] if state.unfinished else []
    best_with = next((r for r in state.ranked if members & set(r.hypothesis.ids)), None)
    if best_with is not None and at_bound(best_with, members):
        factors.append(settings.at_bound)
    return factors


def at_bound(r: RankedHypothesis, members: frozenset[str]) -> list[str]:
    """Parameters of some effects that stand at an end of their range in a hypothesis."""
    fit = r.hypothesis.fit
    names = {x.name for c in r.hypothesis.candidates if c.id in members for x in c.parameters if not x.shape}
    return [x.name for x, end in zip(fit.parameters, fit.at_bound, strict=True) if end and x.name in names]


def share_gap(state: State) -> State:
    """The budget, averaged over the plausible hypotheses, each with all subsets of its effects refitted."""
    settings = state.problem.settings.budget
    if state.unfinished:  # the held-out runs would have to be simulated
        state = replace(state, holdout=None)
    least = settings.least_probability * state.probabilities[0]
    plausible = [(r, p) for r, p in zip(state.ranked, state.probabilities, strict=True) if p >= least]
    state, alternatives = _divided(state, plausible[: settings.alternatives])
    if not alternatives:
        alternatives.append(Alternative(1.0, {frozenset(): state.residual_of(state.ranked_baseline)}))
    total = sum(a.probability for a in alternatives)
    alternatives = [replace(a, probability=a.probability / total) for a in alternatives]
    groups = {c.label: c.group for c in state.problem.candidates}
    gap_budget = budget(state.scoring.observations, alternatives, groups, state.problem.settings.bootstrap)
    return replace(state, alternatives=tuple(alternatives), budget=gap_budget)


def _divided(
    state: State, plausible: Sequence[tuple[RankedHypothesis, float]]
) -> tuple[State, list[Alternative]]:
    """`_alternatives` on the held-out runs, or on what was learned from if there is no time for these or calibration
    itself makes them impossible: all residuals have to be of the same runs."""
    if state.holdout is not None:
        try:
            return _alternatives(state, plausible)
        except StopRequested:
            pass
        except SimulationError as error:
            state = replace(state, warnings=(*state.warnings, f"{state.ranked_baseline.hypothesis.label}: {error}"))
        state = replace(state, holdout=None)
    try:
        return _alternatives(state, plausible)
    except StopRequested:  # now that it has been asked, subsets are foretold and no longer fitted
        return _alternatives(state, plausible)


def _alternatives(
    state: State, plausible: Sequence[tuple[RankedHypothesis, float]]
) -> tuple[State, list[Alternative]]:
    """Hypotheses with their probabilities and what each subset of their effects leaves, without those that the held-out
    runs cannot be simulated with, which are told; what is reported is simulated there, too."""
    state.residual_of(state.ranked_baseline)
    alternatives, fitted = list[Alternative](), list(state.ranked)
    for r, p in plausible:
        try:
            alternatives.append(Alternative(p, _residuals(state, r, fitted)))
        except SimulationError as error:  # of one of its subsets, perhaps
            state = replace(state, warnings=(*state.warnings, f"{r.hypothesis.label} is not shared out: {error}"))
    while True:
        try:
            state.residual_of(state.reported)
        except SimulationError as error:
            r = state.reported
            warnings = (*state.warnings, f"{r.hypothesis.label} is not reported: {error}")
            state = replace(state, not_held_out=(*state.not_held_out, r), warnings=warnings)
        else:
            return state, alternatives


def _residuals(
    state: State, r: RankedHypothesis, fitted: list[RankedHypothesis]
) -> dict[frozenset[str], np.ndarray]:
    """fitted: what was, to which subsets that had to be are added, for alternatives share them."""
    subsets = complete_subsets(state.problem, fitted, r, state.nuisance_jacobian)
    fitted += [subset for subset in subsets.values() if subset not in fitted]
    return {
        labels: state.residual_of(subset) + absorbed_bias(state.problem, state.scoring.observations, r, subset)
        for labels, subset in subsets.items()
    }
