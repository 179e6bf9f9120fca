"""The verdict: what a diagnosis says in one word."""

from __future__ import annotations

from collections.abc import Mapping

from ..settings import BudgetSettings, PosteriorSettings
from .budget import Budget

EXPLAINED = "explained"
IN_PART = "explained_in_part"
NO_GAP = "no_significant_gap"
UNEXPLAINED = "unexplained"


def verdict(
    budget: Budget, inclusion: Mapping[str, float], groups: Mapping[str, float], baseline_is_adequate: bool,
    stated_scatter: float, posterior: PosteriorSettings, settings: BudgetSettings,
) -> str:  # fmt: skip
    """explained, explained_in_part, no_significant_gap or unexplained.

    inclusion: of every effect; groups: of every group; stated_scatter: mean square of the stated scatter of the model's
    form, in noise; baseline_is_adequate: a refit within the tolerances leaves nothing to explain.
    """
    named = max([*inclusion.values(), *groups.values()], default=0.0) >= posterior.named
    allowed = settings.adequate_excess + stated_scatter
    if not named:
        no_gap = baseline_is_adequate or budget.calibrated**2 - 1.0 <= allowed
        return NO_GAP if no_gap else UNEXPLAINED
    return EXPLAINED if budget.explained**2 - 1.0 <= allowed else IN_PART
