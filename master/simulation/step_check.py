"""What a repetition with half the step tells of a run (`--check-step`), for its summary."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from ...core.errors import CosimError, Interrupted
from ..accuracy.advice import advice
from ..accuracy.doubt import IN_DOUBT, warning
from ..accuracy.step_error import estimate, worst
from ..algorithms import method_named
from ..coupling.residual_energy import TRUSTED
from .result import Result


def add_failure(result: Result, step: float, error: CosimError) -> None:
    """The repetition, with a step in s, did not come to its end."""
    ended = "interrupted" if isinstance(error, Interrupted) else "failed"
    result.summary["step_check"] = {"step_s": step, "errors": {}, "status": ended, "error": str(error)}
    result.summary["warnings"].append(
        f"--check-step: the run is complete; its repetition with half the step, {step:g} s, {ended}: {error}"
    )


def add_estimate(result: Result, again: Result) -> None:
    """Put estimated errors, advice and warnings into the summary; `again` is the repetition."""
    assert result.sample is not None
    assert again.sample is not None
    assert result.held is not None
    assert again.held is not None
    summary, name = result.summary, result.summary["method"]
    method = method_named(name)
    errors = estimate(method.order, result.names, result.sample, again.sample)
    told = advice(name, method, summary["step_s"], result.held, again.held)
    outputs = set(result.outputs)  # an input that is held belongs to no point in time
    summary["step_check"] = {
        "step_s": again.summary["step_s"], "errors": {n: e for n, e in errors.items() if n in outputs}, "status": "ok",
        "advice": asdict(told) if told is not None else None,
    }  # fmt: skip
    _withdraw_doubt_warning(summary, method.order, errors)
    summary["warnings"] += told.warning(name, method.order) if told is not None else []
    found = worst(summary["step_check"]["errors"])
    if found is not None and found[1]["relative"] > TRUSTED:
        summary["warnings"].append(
            f"--check-step: '{found[0]}' is off by about {found[1]['relative']:.0%} of its range: do not trust this "
            "run; take a shorter step"
        )


def _withdraw_doubt_warning(summary: dict[str, Any], order: int, errors: dict[str, dict[str, float | None]]) -> None:
    """Take the warning of a doubt back that the repetition did not bear out; the doubt itself stays in the summary."""
    told = summary["doubt"]
    off = errors.get(told["signal"], {}).get("relative") if told else None
    if off is not None and off <= IN_DOUBT:
        lines = warning(told, order, summary["step_s"])
        summary["warnings"] = [text for text in summary["warnings"] if text not in lines]
