"""The form that an effect of a part of the budget is in, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..pipeline.state import State
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate
from ..selection.evidence import RankedHypothesis


def form(s: State, ids: Sequence[str]) -> dict[str, Any] | None:
    """The form of one of some effects in the most probable hypothesis that has them; None where it is the plain one.

    Its share is what the same effects in their plain forms leave more, of what calibration leaves; its probability is
    its share among the hypotheses that have the effect.
    """
    best = next((r for r in s.ranked if set(ids) & set(r.hypothesis.ids)), None)
    if best is None:
        return None
    formed = [c for c in best.hypothesis.candidates if c.id in ids and c.form is not None]
    if not formed:
        return None
    made = max(formed, key=lambda c: _probability(s, c))
    assert made.form is not None
    return {"id": made.form.id, "effect": made.id, "text": made.form.text,
            "inclusion_probability": _probability(s, made), "share": _share(s, best, made)}  # fmt: skip


def _probability(s: State, c: EffectCandidate) -> float:
    having = [(r, p) for r, p in zip(s.ranked, s.probabilities, strict=True) if c.label in r.hypothesis.labels]
    return sum(p for r, p in having if c.name in r.hypothesis.parts) / max(sum(p for _, p in having), 1e-300)


def _share(s: State, best: RankedHypothesis, c: EffectCandidate) -> float:
    """On the runs that are learned from, for held-out ones would have to be simulated, and the processes that do are
    gone when results are written; 0 where the same effects were not fitted in the plain form."""
    parts = best.hypothesis.parts - {c.name} | {c.label}
    plain = next((r for r in s.ranked if r.hypothesis.parts == parts), None)
    gap = rms(s.ranked_baseline.held_out) ** 2 - 1.0
    if plain is None or gap <= 0.0:
        return 0.0
    return min(1.0, max(0.0, (rms(plain.held_out) ** 2 - rms(best.held_out) ** 2) / gap))
