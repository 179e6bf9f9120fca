"""The form that an effect of a part of the budget is in, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..pipeline.state import State


def form(s: State, ids: Sequence[str]) -> dict[str, Any] | None:
    """The form of one of some effects in the most probable hypothesis that has them; None where it is the plain one."""
    best = next((r for r in s.ranked if set(ids) & set(r.hypothesis.ids)), None)
    candidates = [f for f in s.effects_in_form if f.hypothesis is best and f.effect.id in ids]
    if not candidates:
        return None
    chosen = max(candidates, key=lambda f: f.probability)
    assert chosen.effect.form is not None
    return {"id": chosen.effect.form.id, "effect": chosen.effect.id, "text": chosen.effect.form.text,
            "inclusion_probability": chosen.probability, "share": chosen.share}  # fmt: skip
