"""The table of the contract from the outcomes of cases."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from . import calibration
from .drawers import drawer
from .names import plain
from .outcome import Outcome
from .true import UNKNOWN

CLEAR = 2.0
"""Size of the smallest effect, in noise, from which the exact set is asked for."""

CLOSE = 1.05
"""Search gap that counts as none."""

BINS = ((-np.inf, 0.1), (0.1, 0.3), (0.3, 0.6), (0.6, 0.9), (0.9, np.inf))
"""Bins of the true share."""


def share(values: Iterable[bool]) -> dict[str, Any]:
    """Number of hits, of cases, and their ratio."""
    hits = list(values)
    return {"hits": sum(hits), "of": len(hits), "share": sum(hits) / len(hits) if hits else None}


def quantiles(values: Iterable[float], at: Sequence[float]) -> list[float] | None:
    """Quantiles of those values that are numbers; None where there are none."""
    there = [v for v in values if v == v]
    return [float(q) for q in np.quantile(there, at)] if there else None


def score(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """All scores; what has no cases is None."""
    known = [o for o in outcomes if o.true.known]
    none = [o for o in outcomes if o.true.kind == "none"]
    unknown = [o for o in outcomes if o.true.kind == UNKNOWN and o.true.visible]
    budgets = [o for o in unknown if o.said.unexplained == o.said.unexplained]
    clear = [o for o in known if o.true.size >= CLEAR]
    pairs = [pair for o in outcomes for pair in o.probabilities]
    gaps = [gap for o in known if (gap := o.search_gap) is not None]
    swinging = [o for o in known if o.true.swinging]
    return {
        "cases": len(outcomes),
        "failed": sum(o.said.failed for o in outcomes),
        "false_alarms": share(o.false_alarm for o in none),
        "recall": share(hit for o in known for _, hit in o.hits),
        "recall_swinging": share(hit for o in swinging for _, hit in o.hits),
        "precision": share(right for o in outcomes for right in o.rights),
        "precision_known": share(right for o in known for right in o.rights),
        "exact_single": share(o.exact for o in clear if len(o.true.effects) == 1),
        "exact_swinging": share(o.exact for o in swinging if o.true.size >= CLEAR),
        "exact_several": share(o.exact for o in clear if len(o.true.effects) > 1),
        "share_error": quantiles([abs(s.said - s.true) for o in outcomes for s in o.shares], (0.5, 0.9)),
        "unexplained_largest": share(o.unexplained_largest for o in budgets),
        "named_outside": share(o.false_alarm for o in unknown),
        "calibration_error": calibration.calibration_error(pairs),
        "calibration_error_sure": calibration.sure_error([p for p, _ in pairs]),
        "relative_brier": calibration.relative_brier(pairs),
        "reliability": calibration.reliability(pairs),
        "coverage": share(c for o in known for c in o.covered),
        "coverage_shares": share(c for o in known for c in o.share_covered),
        "search_gap": share(gap <= CLOSE for gap in gaps),
        "first_budget_s": quantiles([o.said.first_budget for o in outcomes], (0.5, 0.95)),
        "finished_s": quantiles([o.said.finished for o in outcomes], (0.5, 0.95)),
        "by_share": by_share(known),
        "by_effect": by_effect(known),
        "drawers": dict(Counter(d for o in outcomes if (d := drawer(o)))),
        "wrong": [wrong(o) for o in outcomes if not o.exact],
    }


def by_share(known: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Effects found up to the group by bin of their true share, those that do not count in the first bin."""
    made = []
    for low, high in BINS:
        rows = [
            any(o.meets(e, s) for s in o.said.statements)
            for o in known for e in o.true.effects if e.share is not None and low <= e.share < high
        ]  # fmt: skip
        made.append({"from": low, "to": high, **share(rows)})
    return made


def by_effect(known: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Effects that are to be found, by their id and by their form: how many, found exactly, and up to the group."""
    rows: dict[str, list[tuple[bool, bool]]] = defaultdict(list)
    for o in known:
        ids = {plain(n)[0] for n in o.said.named}
        for effect, hit in o.hits:
            id = plain(effect.name)[0]
            rows[id].append((id in ids, hit))
            rows["(another form)" if effect.form else "(plain form)"].append((id in ids, hit))
    return [
        {"what": id, "cases": len(hits), "exact": share(a for a, _ in hits)["share"],
         "group": share(b for _, b in hits)["share"]}
        for id, hits in sorted(rows.items())
    ]  # fmt: skip


def wrong(o: Outcome) -> dict[str, Any]:
    """A wrong case in a line: truth with shares, what was said, how much the oracle leaves, and the drawer."""
    effects = []
    for e in o.true.effects:
        name = e.name if o.true.known else f"[{e.name}]"
        form = f", {e.form}" if e.form else ""
        part = f" {e.share:.0%}" if e.share is not None and len(o.true.effects) > 1 else ""
        effects.append(name + form + part)
    named = ["failed"] if o.said.failed else [" or ".join(s) for s in o.said.statements]
    oracle = {k: o.oracle[k]["left"] for k in ("true", "said") if k in o.oracle}
    return {
        "case": o.case, "true": " + ".join(effects) or "-", "size": o.true.size, "said": " + ".join(named) or "-",
        "left": oracle, "drawer": drawer(o),
    }  # fmt: skip


