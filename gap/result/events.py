"""Measured events beside the model's, and differences between runs, as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..pipeline.state import State
from ..problem.problem import Problem


def has_events(state: State) -> bool:
    """Whether the campaign has measured events."""
    return any(b.event is not None for b in state.problem.observations.blocks)


def events(state: State) -> list[dict[str, Any]]:
    """Measured events beside those of the model as delivered, calibrated, and with the effects [s]."""
    problem = state.problem
    fits = {"calibrated": state.ranked_baseline.hypothesis.fit, "explained": state.reported.hypothesis.fit}
    entries = []
    for b in problem.observations.blocks:
        if b.event is None:
            continue
        limit = "at most" if np.isfinite(b.event.low) else "at least" if np.isfinite(b.event.high) else ""
        entries.append(
            {"run": problem.runs[b.run].name, "event": problem.labels[b.channel], "limit": limit,
             "measured": float(b.y[0]), "std": b.noise_std, "delivered": float(state.nominal[b.place][0]),
             **{name: float(fit.model[b.place][0]) for name, fit in fits.items()}}
        )  # fmt: skip
    return entries


def contrasts(problem: Problem, event_list: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """How much longer an event took in one run than in another that differs in one stated condition only [s].

    What such runs share, errors of the base parameters above all, cancels in the difference.
    """
    stated = {run.name: run.parameters for run in problem.campaign.runs}
    keys = ("measured", "delivered", "calibrated", "explained")
    entries = []
    for i, a in enumerate(event_list):
        for b in event_list[i + 1 :]:
            ours, theirs = stated[a["run"]], stated[b["run"]]
            changed = [k for k in {**ours, **theirs} if ours.get(k) != theirs.get(k)]
            if a["event"] == b["event"] and len(changed) == 1 and not (a["limit"] or b["limit"]):
                levels = {k: a[k] - b[k] for k in keys}
                std = float(np.hypot(a["std"], b["std"]))
                entries.append(
                    {"runs": [a["run"], b["run"]], "event": a["event"], "changed": changed[0], **levels, "std": std}
                )
    return entries
