"""The scores as text and as Markdown."""

from __future__ import annotations

from typing import Any

LINES = (
    ("all_exact", "right answer, all cases", ""),
    ("exact_top1", "exact top-1, cases with effects of the catalogue", ""),
    ("group_top1", "top-1 up to the ambiguity group", ""),
    ("exact_top1_clear", "exact top-1, size >= 2 floors", ">= 75 %"),
    ("group_top1_clear", "group top-1, size >= 2 floors", ">= 90 %"),
    ("single_exact", "exact, one effect", ""),
    ("pair_exact", "exact, two effects", ""),
    ("pair_partial", "at least one of two effects", ""),
    ("false_alarms", "false alarms, nothing wrong", "<= 5 %"),
    ("unknown_recall", "unknown effects recognised", ">= 80 %"),
    ("unknown_recall_clear", "unknown effects recognised, size >= 2 floors", ""),
    ("unknown_false", "said unknown though it was not", ""),
    ("coverage", "95 % intervals that hold the true value", "90-98 %"),
)
NUMBERS = (
    ("brier", "Brier score", ""),
    ("calibration_error", "expected calibration error", "<= 0.05"),
    ("calibration_error_sure", "what it would be for right probabilities, so few cases", ""),
    ("said_top", "mean probability of the top answer", ""),
    ("right_top", "how often the top answer is right", ""),
    ("calibration_error_group", "expected calibration error, group counted as right", ""),
    ("reduction", "mean reduction of the gap, effects of the catalogue", ""),
    ("explainable_reduction", "mean explainable reduction", ""),
)
COLUMNS = ("exact", "group", "said none")


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.0f} %"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def rows(result: dict[str, Any]) -> list[tuple[str, str, str]]:
    """What, value, target."""
    made = [("cases, of these failed", f"{result['cases']}, {result['failed']}", "")]
    for key, text, target in LINES:
        s = result[key]
        made.append((text, f"{_percent(s['share'])} ({s['hits']}/{s['of']})", target))
    made += [(text, _number(result[key]), target) for key, text, target in NUMBERS]
    wall = result["wall_s"]
    times = ", ".join(f"{k} {v:.1f}" for k, v in wall.items() if v is not None)
    return [*made, ("wall time of a case, s", times or "-", "")]


def as_text(result: dict[str, Any]) -> str:
    """For the terminal."""
    lines = [f"{text:<52}{value:<22}{target}" for text, value, target in rows(result)]
    for key, head in (("by_size", "size, floors"), ("by_effect", "effect")):
        lines += ["", f"{head:<30}{'cases':>7}" + "".join(f"{c:>11}" for c in COLUMNS)]
        for r in result[key]:
            lines.append(f"{r['what']:<30}{r['cases']:>7}" + "".join(f"{_percent(r[c]):>11}" for c in COLUMNS))
    lines += ["", "wrong: true -> said"]
    lines += [f"{c['cases']:>3}  {c['true']}  ->  {c['said']}" for c in result["confusions"]]
    return "\n".join(lines)


def as_markdown(result: dict[str, Any]) -> str:
    """For a page."""
    lines = ["| score | value | target |", "|---|---|---|"]
    lines += [f"| {a} | {b} | {c} |" for a, b, c in rows(result)]
    for key, head in (("by_size", "size, floors"), ("by_effect", "effect")):
        lines += ["", f"| {head} | cases | {' | '.join(COLUMNS)} |", "|---|" + "---|" * (len(COLUMNS) + 1)]
        lines += [
            f"| {r['what']} | {r['cases']} | {' | '.join(_percent(r[c]) for c in COLUMNS)} |" for r in result[key]
        ]
    lines += ["", "| true | said | cases |", "|---|---|---|"]
    lines += [f"| {c['true']} | {c['said']} | {c['cases']} |" for c in result["confusions"]]
    return "\n".join(lines) + "\n"
