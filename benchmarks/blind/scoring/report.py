"""The scores as text and as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .drawers import DRAWERS

SHARES = (
    ("false_alarms", "false alarms: an effect is said where nothing is", "<= 3 %"),
    ("recall", "recall: effects of 10 % and more, up to the group", ">= 95 %"),
    ("recall_swinging", "  of these where the machine swings", ">= 95 %"),
    ("precision", "precision: effects said, up to the group", ">= 90 %"),
    ("precision_known", "  of these where the catalogue has the effects", ""),
    ("exact_single", "exact set, one effect of 2 floors or more", ">= 85 %"),
    ("exact_several", "exact set, two or three of 2 floors or more", ">= 70 %"),
    ("exact_swinging", "exact set of 2 floors or more where the machine swings", ">= 85, 70 %"),
    ("unexplained_largest", "outside the catalogue: unexplained is the largest part", ">= 90 %"),
    ("named_outside", "  of these with an effect said", ""),
    ("coverage", "95 % intervals of parameters that cover", "90 to 98 %"),
    ("coverage_shares", "95 % intervals of shares that cover", "90 to 98 %"),
    ("search_gap", "search gap of 1.05 at the most", ">= 95 %"),
)
NUMBERS = (
    ("calibration_error", "inclusion probabilities: calibration error", "<= 0.05"),
    ("calibration_error_sure", "  what it would be for right ones, so few cases", ""),
    ("relative_brier", "  Brier, against always saying the base rate", "<= 0.4"),
)
QUANTILES = (
    ("share_error", "error of the shares, median and 90th percentile", "<= 5, 15 points", 100.0, "points"),
    ("first_budget_s", "first budget, median and 95 %", "<= 20 s", 1.0, "s"),
    ("finished_s", "finished, median and 95 %", "<= 60 s, 180 s", 1.0, "s"),
)
Rows = list[tuple[str, ...]]


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.0f} %"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def rows(result: dict[str, Any]) -> Rows:
    """What, value, target."""
    made: Rows = [("cases, of these failed", f"{result['cases']}, {result['failed']}", "")]
    for key, text, target in SHARES:
        s = result[key]
        made.append((text, f"{_percent(s['share'])} ({s['hits']}/{s['of']})" if s["of"] else "-", target))
    made += [(text, _number(result[key]), target) for key, text, target in NUMBERS]
    for key, text, target, factor, unit in QUANTILES:
        values = result[key]
        made.append((text, " and ".join(f"{factor * v:.1f}" for v in values) + f" {unit}" if values else "-", target))
    return made


def tables(result: dict[str, Any]) -> list[Rows]:
    """Further tables, each with its head: by share, by effect, reliability, drawers, wrong cases."""
    by_share: Rows = [("true share", "effects", "found, up to the group")]
    for r in result["by_share"]:
        between = f"{100 * max(r['from'], 0):.0f} to {100 * min(r['to'], 1):.0f} %"
        by_share.append((between, str(r["of"]), _percent(r["share"])))
    by_effect: Rows = [("effect", "cases", "exact", "group")]
    by_effect += [(r["what"], str(r["cases"]), _percent(r["exact"]), _percent(r["group"])) for r in result["by_effect"]]
    sure: Rows = [("inclusion probability", "effects", "mean", "there")]
    for r in result["reliability"]:
        between = f"{100 * r['from']:.0f} to {100 * r['to']:.0f} %"
        sure.append((between, str(r["effects"]), f"{100 * r['mean']:.1f} %", f"{100 * r['true']:.1f} %"))
    found = result["drawers"]
    drawers: Rows = [("drawer", "wrong cases")]
    drawers += [(d, str(found.get(d, 0))) for d in (*DRAWERS, *(d for d in found if d not in DRAWERS))]
    wrong: Rows = [("wrong case", "true", "size", "said", "left: true set, said", "drawer")]
    for w in result["wrong"]:
        left = ", ".join(f"{v:.2f}" for v in w["left"].values()) or "-"
        wrong.append((w["case"], w["true"], f"{w['size']:.2g}", w["said"], left, w["drawer"]))
    return [by_share, by_effect, sure, drawers, wrong]


def _columns(table: Rows) -> list[str]:
    widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
    return ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]


def _pipes(table: Rows) -> list[str]:
    lines = [f"| {' | '.join(row)} |" for row in table]
    return [lines[0], "|" + "---|" * len(table[0]), *lines[1:]]


def _pages(result: dict[str, Any], draw: Callable[[Rows], list[str]]) -> str:
    first: Rows = [("score", "value", "target"), *rows(result)]
    parts: Sequence[list[str]] = [draw(t) for t in (first, *tables(result)) if len(t) > 1]
    return "\n\n".join("\n".join(lines) for lines in parts) + "\n"


def as_text(result: dict[str, Any]) -> str:
    """For the terminal."""
    return _pages(result, _columns)


def as_markdown(result: dict[str, Any]) -> str:
    """For a page."""
    return _pages(result, _pipes)
