"""Section "where" of the page: shares, regions, frequencies, components alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.component_replay import Replay
from ..analysis.localisation import describe, excess_energy
from ..pipeline.diagnosis import Diagnosis
from ..pipeline.state import State
from ..problem.noise import rms
from . import series
from .numbers import floors, percent, short

MOST = 14
"""Most regions that are shown, those with the largest gaps."""

NOISE = 1.1
"""A gap below this, in floors, is hardly more than noise."""

NOTHING = 0.01
"""A gap, in floors, that is drawn at the left end: limits that are kept leave none at all."""


def calibrated(d: Diagnosis) -> bool:
    """Whether the refit alone leaves hardly more than noise."""
    return d.state.verdict == "no_significant_gap" or d.state.gap(d.state.ranked_baseline) < NOISE


def where(d: Diagnosis) -> dict[str, Any]:
    """Shares by channel: of what the refit leaves; where that is noise, of what the model as delivered missed."""
    s = d.state
    problem = s.scoring
    known = series.quantities(problem)
    if not calibrated(d):
        rows = [(p.channel, p.share, p.region, p.changes) for p in d.state.places]
        return {"rows": [_place(known[r[0]], *r[1:]) for r in rows], "of": "refitted"}
    rows = []
    for k, label in enumerate(known):
        mine = problem.observations.channel == k
        if mine.any():
            e = excess_energy(s.before[mine])
            inner = {name: mask[mine] for name, mask in d.state.masks.items()}
            region = describe(np.maximum(e, 0.0), inner) if e.sum() > 0 else "nowhere"
            rows.append((label, max(0.0, float(e.sum())), region, ()))
    total = sum(r[1] for r in rows) or 1.0
    rows = sorted(((c, e / total, region, t) for c, e, region, t in rows), key=lambda r: -r[1])
    return {"rows": [_place(known[r[0]], *r[1:]) for r in rows], "of": "delivered"}


def _place(c: series.Quantity, share: float, region: str, changes: Any) -> dict[str, Any]:
    times: dict[str, list[str]] = {}
    for run, t in changes:
        times.setdefault(run, []).append(f"{t:.1f}")
    said = "; ".join(f"{run}: {', '.join(x)} s" for run, x in list(times.items())[:2])
    if len(times) > 2:
        said += f"; and in {len(times) - 2} more {'runs' if len(times) > 3 else 'run'}"
    return {
        "column": c.name, "connector": c.connector, "share": percent(share), "width": 100.0 * share,
        "region": region, "changes": said,
    }  # fmt: skip


def regions(d: Diagnosis, best_name: str | None) -> dict[str, Any] | None:
    """Gaps by region on one logarithmic axis; regions of the same samples are one row."""
    s = d.state
    beyond = best_name is not None
    if not d.state.masks:
        return None
    residuals = [("delivered", "as delivered", s.before)]
    if beyond:
        residuals.append(("refitted", "refitted", s.after(s.ranked_baseline)))
    residuals.append(("best", best_name or "refitted", s.after(d.state.chosen)))
    groups: list[tuple[list[str], np.ndarray]] = []
    for name, mask in d.state.masks.items():
        same = next((g for g in groups if np.array_equal(g[1], mask)), None)
        if same is not None:
            same[0].append(name)
        else:
            groups.append(([name], mask))
    rows = [
        (names, mask, [(c, said, max(rms(e[mask]), NOTHING)) for c, said, e in residuals]) for names, mask in groups
    ]  # fmt: skip
    values = [g for _, _, gaps in rows for _, _, g in gaps]
    low, high = np.log10(min(0.8, *values) * 0.85), np.log10(max(2.0, *values) * 1.15)

    def place(x: float) -> float:
        return float(100.0 * (np.log10(max(x, 1e-9)) - low) / (high - low))

    ticks = [t for t in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10000) if low < np.log10(t) < high]
    if len(ticks) > 7:
        ticks = [t for t in ticks if np.log10(t) % 1 == 0]
    made = []
    for names, mask, gaps in sorted(rows, key=lambda r: -r[2][1][2] if beyond else -r[2][0][2]):
        made.append(
            {
                "name": names[0], "same": names[1:], "share": percent(float(mask.mean())), "runs": _whole_runs(s, mask),
                "dots": [{"colour": c, "said": said, "x": place(g), "text": floors(g)} for c, said, g in gaps],
                "from": min(place(g) for _, _, g in gaps), "to": max(place(g) for _, _, g in gaps),
            }
        )  # fmt: skip
    return {
        "rows": made[:MOST], "more": len(made[MOST:]), "floor": place(1.0),
        "ticks": [{"x": place(t), "text": f"{t:g}"} for t in ticks],
        "columns": [{"colour": c, "said": said} for c, said, _ in residuals],
    }  # fmt: skip


def _whole_runs(s: State, mask: np.ndarray) -> str:
    """The runs that a region consists of; empty when it is only a part of some."""
    parts = [mask[s.scoring.observations.run == r] for r in range(len(s.scoring.runs))]
    if any(p.any() and not p.all() for p in parts):
        return ""
    return ", ".join(info.name for info, p in zip(s.scoring.runs, parts, strict=True) if p.any())


def bands(d: Diagnosis) -> dict[str, Any] | None:
    rows = [p for p in d.state.places if p.share >= 0.01 and p.region != "nowhere" and sum(p.bands.values()) > 0.5]
    if calibrated(d) or not rows:
        return None
    known = series.quantities(d.state.scoring)
    names = [n.replace("-", "–").replace("> ", "above ") for n in rows[0].bands]
    return {
        "names": names,
        "rows": [
            {"column": known[p.channel].name, "cells": [{"text": percent(v), "value": v} for v in p.bands.values()]}
            for p in rows
        ],
    }  # fmt: skip


def replays(d: Diagnosis) -> list[dict[str, Any]]:
    s = d.state
    observations = s.problem.observations
    residual = s.refit.fit.residual
    whole = {
        c: rms(residual[observations.channel == k])
        for k, c in enumerate(s.problem.labels)
        if (observations.channel == k).any()
    }
    made = []
    for r in d.state.replays:
        misses = sorted(r.rms.items(), key=lambda x: -x[1])
        made.append(
            {
                "component": r.component, "driven_by": ", ".join(r.driven_by), "assumed": ", ".join(r.assumed) or "–",
                "said": _replayed(r, *misses[0], whole[misses[0][0]]),
                "misses": [
                    {"channel": c, "text": floors(v), "whole": floors(whole[c]), "noise": _times(r.amplification[c])}
                    for c, v in misses
                ],
            }
        )  # fmt: skip
    return made


def _times(x: float) -> str:
    return short(x, 2) if x > 0.05 else "0"


def _replayed(r: Replay, worst: str, size: float, whole: float) -> str:
    """What a replay says, in a sentence: it misses `worst` by `size`, the whole model by `whole` floors."""
    fed = f"Fed with what was measured, {r.component} alone"
    if size < 1.5:
        return f"{fed} gives what was measured: the gap is not inside it, it only passes on what comes in."
    passed = r.amplification[worst]
    if passed > 3.0:
        return (
            f"{fed} misses {worst} by {floors(size)} floors, but the noise of what drives it comes through "
            f"{passed:.0f}-fold: this says little."
        )
    if size > 3.0 * max(whole, 1.0):
        assumed = f"; {' and '.join(r.assumed)} from the model" if r.assumed else ""
        return (
            f"{fed} misses {worst} by {floors(size)} floors, the whole model only by {floors(whole)}. So what drives "
            f"it (measured {' and '.join(r.driven_by)}{assumed}) is off, or changes faster than the smoothing of the "
            "replay follows; whether the gap is inside it stays open."
        )
    where = f", or comes from {' and '.join(r.assumed)}, which nobody measured" if r.assumed else ""
    return f"{fed} misses {worst} by {floors(size)} floors: a part of the gap is inside it{where}."
