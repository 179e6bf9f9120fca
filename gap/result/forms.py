"""The form that an effect of a part of the budget is in, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..pipeline.state import State


def form(s: State, ids: Sequence[str]) -> dict[str, Any] | None:
    """The form of one of some effects in the most probable hypothesis that has them; None where it is the plain one."""
    best = next((r for r in s.ranked if set(ids) & set(r.hypothesis.ids)), None)
    own = [f for f in s.effects_in_form if f.hypothesis is best and f.effect.id in ids]
    if not own:
        return None
    made = max(own, key=lambda f: f.probability)
    assert made.effect.form is not None
    return {"id": made.effect.form.id, "effect": made.effect.id, "text": made.effect.form.text,
            "inclusion_probability": made.probability, "share": made.share}  # fmt: skip
