"""Other forms of the effects that are in: a dead zone of four unequal lands, friction that is greater one way.

An effect in a wrong form explains much and leaves much; so forms are tried where something is left, in the best sets of
every size, for a wrong form also makes wrong effects look useful beside it. What a form would do is foretold from runs
at its starts; the most promising ones are fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..estimation.linear import LinearisedModel, profile_nuisances
from ..problem.curves import CurveForm
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EffectForm, EstimatedParameter, Point, penalty
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, penalised_deviance
from .polish import polish
from .response_bank import evaluate_in_batches
from .rounds import best_of_each_set, polish_near, search_cost
from .starts import FitStart, hypotheses_at


class _Option(NamedTuple):
    """An effect of a hypothesis in another form: where it is expected to fit best, and its expected deviance there."""

    base: Hypothesis
    plain: EffectCandidate
    form: EffectForm
    point: Point
    expected: float

    @property
    def starts(self) -> tuple[Point, Point]:
        """Where a fit may begin: there, and where the plain form stands. A machine that hunts about its dead zone is so
        rugged that now the one, now the other leads to the minimum."""
        return self.point, self.base.fit.point

    @property
    def candidates(self) -> tuple[EffectCandidate, ...]:
        """Of the hypothesis, with the effect in that form."""
        return tuple(c.in_form(self.form) if c is self.plain else c for c in self.base.candidates)


class _ParameterResponse(NamedTuple):
    """A parameter of a form, and what it does to the model at the start that serves best: a value, and the change."""

    parameter: EstimatedParameter
    value: float
    change: np.ndarray


def try_forms(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray, curves: bool = False
) -> list[Hypothesis]:
    """With effects of the best sets in other forms, those that come near fitted to the end; curves: as free curves, not
    in forms that have a formula."""
    settings = problem.settings.search
    known_keys = {h.key for h in hypotheses}
    leaders = _leaders([h for h in hypotheses if _forms_to_try(h, curves)], settings.form_leaders)
    best = min(hypotheses, key=search_cost)
    if best.fit.rms < settings.little_left:
        leaders = [h for h in leaders if h.fit.rms < settings.max_form_ratio * best.fit.rms]
    options = [o for h in leaders for o in _options(problem, h, curves, nuisance_jacobian)]
    options = [o for o in options if _parts(o) not in known_keys]
    if problem.stop_requested:
        return list(hypotheses)
    chosen = sorted(options, key=lambda o: o.expected)[: settings.forms_fitted]
    starts = [FitStart(o.candidates, p, o.base.fit.correction, o.base.fit) for o in chosen for p in o.starts]
    started = [h for h in hypotheses_at(problem, starts, nuisance_jacobian) if h is not None]
    polished = polish(problem, started, nuisance_jacobian, settings.form_polish_rounds, derivatives_known=not curves)
    fitted = best_of_each_set(polished)
    least = min((search_cost(h) for h in (*hypotheses, *fitted)), default=0.0)
    return best_of_each_set([*hypotheses, *polish_near(problem, fitted, least, nuisance_jacobian)])


def adopt_forms(problem: Problem, best: Hypothesis) -> Problem:
    """The problem in which every effect of a hypothesis has the form that it has there, wherever it is tried from now
    on."""
    with_form = {c.label: c for c in best.candidates if c.form is not None}
    if not with_form:
        return problem
    return replace(problem, candidates=tuple(with_form.get(c.label, c) for c in problem.candidates))


def any_forms_left(hypotheses: Sequence[Hypothesis], curves: bool = False) -> bool:
    """Whether an effect of any of these could be in another form; curves: as a free curve."""
    return any(_forms_to_try(h, curves) for h in hypotheses)


def _forms_to_try(h: Hypothesis, curves: bool) -> list[tuple[EffectCandidate, EffectForm]]:
    """The effects in the plain form with those that are to be tried; a curve's values are there once."""
    used_curves = {c.form.id for c in h.candidates if isinstance(c.form, CurveForm)}
    return [
        (c, f) for c in h.candidates if c.form is None for f in c.forms
        if isinstance(f, CurveForm) is curves and f.id not in used_curves
    ]  # fmt: skip


def _parts(o: _Option) -> frozenset[str]:
    return frozenset(x for c in o.candidates for x in c.key)


def _leaders(hypotheses: Sequence[Hypothesis], most: int) -> list[Hypothesis]:
    """The best, and the best of each size: beside a wrong form, others would come first among all."""
    ordered = sorted((h for h in hypotheses if h.candidates), key=search_cost)
    leaders = ordered[:most]
    for size in sorted({len(h.candidates) for h in ordered}):
        best = next(h for h in ordered if len(h.candidates) == size)
        leaders += [best] if best not in leaders else []
    return leaders


def _options(problem: Problem, h: Hypothesis, curves: bool, nuisance_jacobian: np.ndarray) -> list[_Option]:
    """Every form of every effect that is in its plain one, foretold."""
    pairs = _forms_to_try(h, curves)
    trials = [(c, f, x, v) for c, f in pairs for x in f.parameters for v in x.starts]
    points = [{**h.fit.point, x.name: v} for _, _, x, v in trials]
    coarse = h.fit.model - h.fit.correction
    responses: dict[tuple[str, str], dict[str, list[_ParameterResponse]]] = {}
    for (c, f, x, v), model in zip(trials, evaluate_in_batches(problem, points), strict=True):
        if model is not None and np.any(model != coarse):
            responses.setdefault((c.label, f.id), {}).setdefault(x.name, []).append(
                _ParameterResponse(x, v, model - coarse)
            )
    options = []
    for c, f in pairs:
        if (of_form := responses.get((c.label, f.id))) is not None:
            best = [
                min(xs, key=lambda x: _rms_left(problem, h, x.change, nuisance_jacobian)) for xs in of_form.values()
            ]
            options.append(_predict(problem, h, c, f, best, nuisance_jacobian))
    return options


def _rms_left(problem: Problem, h: Hypothesis, change: np.ndarray, nuisance_jacobian: np.ndarray) -> float:
    return rms(profile_nuisances(problem, h.fit.model + change, nuisance_jacobian, 1.0).residual)


def _predict(
    problem: Problem, h: Hypothesis, plain: EffectCandidate, form: EffectForm, responses: Sequence[_ParameterResponse],
    nuisance_jacobian: np.ndarray,
) -> _Option:  # fmt: skip
    """Where a form is expected to fit best: linear in what was tried of its parameters, the others moving with them."""
    fit, settings = h.fit, problem.settings.search
    parameters = (*fit.parameters, *(t.parameter for t in responses))
    u = np.concatenate([fit.normalised, np.zeros(len(responses))])
    jacobian = np.column_stack([fit.jacobian, *(t.change / t.value for t in responses)])
    linearised = LinearisedModel.around(problem, u, fit.model, jacobian, nuisance_jacobian)
    reach = [np.inf if x.kind == "base" else settings.initial_trust_radius * max(settings.min_trust_scale, abs(v))
             for x, v in zip(fit.parameters, fit.normalised, strict=True)]  # fmt: skip
    reach += [settings.form_beyond * abs(t.value) for t in responses]
    step = linearised.step(parameters, fit.dispersion, np.array(reach))
    u_expected = u + step.d
    channels = len(problem.observations.span)
    expected = penalised_deviance(
        rms(linearised.predicted_residual(step)), penalty(parameters, u_expected, step.q[:channels])
    )  # fmt: skip
    return _Option(h, plain, form, {x.name: float(v) for x, v in zip(parameters, u_expected, strict=True)}, expected)
