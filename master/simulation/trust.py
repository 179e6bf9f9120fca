"""One line on how far the numbers of a run can be trusted, from its summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..accuracy.step_error import worst


def trust(summary: Mapping[str, Any], connected: bool, where: str = "above") -> str:
    """The line; connected: whether anything drives anything, where: on which side of it the warnings stand."""
    if warnings := summary["warnings"]:
        what = "a warning" if len(warnings) == 1 else f"{len(warnings)} warnings"
        return f"Trust: see {what} {where} before you use the numbers."
    if (errors := summary.get("step_check", {}).get("errors")) and (top := worst(errors)) is not None:
        share = 100 * top[1]["relative"]
        return f"Trust: no warning; the step's error is {share:.2g} % of a signal's range at the most ({top[0]})."
    shares = [bond["relative"] for bond in summary["coupling"] if bond["relative"] is not None]
    if shares:
        return (
            f"Trust: no warning; the coupling's numerical error is {100 * max(shares):.2g} % of the energy exchanged. "
            "--check-step estimates the error of every signal."
        )
    if connected:
        return "Trust: no warning; nothing says how large the coupling's error is, but --check-step estimates it."
    return "Trust: no warning."
