"""The error that the macro step makes, estimated from a second run with half of it.

With an error that falls as h^p, what halving the step changes is (1 - 2^-p) of the error.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..coupling.residual_energy import STILL


def estimate(
    order: int, names: list[str], coarse: np.ndarray, fine: np.ndarray
) -> dict[str, dict[str, float | None]]:
    """Estimated greatest error of each signal over the run, in its unit and relative to its range.

    order: of the method; coarse, fine: samples (n, columns) with the time in the first; only times that both have
    count.
    """
    scale = max(1e-300, float(np.abs(coarse[:, 0]).max()))
    at = np.searchsorted(fine[:, 0], coarse[:, 0] - 1e-9 * scale)
    at = np.clip(at, 0, len(fine) - 1)
    in_both = np.abs(fine[at, 0] - coarse[:, 0]) < 1e-6 * scale
    errors: dict[str, dict[str, float | None]] = {}
    for j, name in enumerate(names):
        if j == 0:
            continue
        a, b = coarse[in_both, j], fine[at[in_both], j]
        if not np.isfinite(a).all() or not np.isfinite(b).all():
            continue
        error = float(np.abs(a - b).max(initial=0.0) / (1.0 - 0.5**order))
        span = float(np.ptp(b)) if len(b) else 0.0
        if span <= STILL * np.abs(b).max(initial=0.0):  # at rest but for rounding
            span = 0.0
        errors[name] = {"error": error, "relative": error / span if span > 0.0 else None}
    return errors


def worst(errors: dict[str, dict[str, Any]]) -> tuple[str, dict[str, Any]] | None:
    """The signal with the greatest relative error."""
    with_range = {name: e for name, e in errors.items() if e["relative"] is not None}
    if not with_range:
        return None
    name = max(with_range, key=lambda n: with_range[n]["relative"])
    return name, with_range[name]
