"""The stage that says of effects in other forms than the plain one how sure the form is, and what it is worth."""

from __future__ import annotations

from dataclasses import replace

from ...core.errors import SimulationError
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate
from ..problem.stop import StopRequested
from ..selection.evidence import RankedHypothesis
from .state import EffectInForm, State


def has_other_forms(state: State) -> bool:
    """Whether any effect was fitted in another form than the plain one."""
    return any(c.form is not None for r in state.ranked for c in r.hypothesis.candidates)


def assess_forms(state: State) -> State:
    """The form of every effect in the most probable hypothesis that has it, where that is not the plain one.

    On the scoring data, as the budget: the plain form is simulated there, so this comes before results are written.
    """
    first_with: dict[str, RankedHypothesis] = {}
    for r in state.ranked:
        for c in r.hypothesis.candidates:
            first_with.setdefault(c.label, r)
    in_form = []
    for label, r in first_with.items():
        c = next(c for c in r.hypothesis.candidates if c.label == label)
        if c.form is not None:
            in_form.append(EffectInForm(c, r, _probability(state, c), _share(state, r, c)))
    return replace(state, effects_in_form=tuple(in_form))


def _probability(s: State, c: EffectCandidate) -> float:
    """Of the form among the hypotheses that have the effect."""
    with_effect = [(r, p) for r, p in zip(s.ranked, s.probabilities, strict=True) if c.label in r.hypothesis.labels]
    return sum(p for r, p in with_effect if c.name in r.hypothesis.key) / max(sum(p for _, p in with_effect), 1e-300)


def _share(s: State, best: RankedHypothesis, c: EffectCandidate) -> float:
    """What the same effects leave more with this one in its plain form, of what calibration leaves; 0 where these were
    not fitted, or there is no time to simulate them."""
    plain_key = best.hypothesis.key - {c.name} | {c.label}
    plain = next((r for r in s.ranked if r.hypothesis.key == plain_key), None)
    gap = s.required_budget.calibrated**2 - 1.0
    if plain is None or gap <= 0.0:
        return 0.0
    try:
        plain_excess, form_excess = (max(rms(s.residual_of(r)) ** 2 - 1.0, 0.0) for r in (plain, best))
    except (SimulationError, StopRequested):
        return 0.0
    return min(1.0, max(0.0, (plain_excess - form_excess) / gap))
