"""How far a coupled run is from the monolith."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

CORNERS = (2.0, 7.0, 12.0, 17.0)
"""Corners of the command [s]."""

PRESSURES = ("P1", "P2", "Pa", "Pb")


def deviation(
    coupled: Mapping[str, np.ndarray], truth: Mapping[str, np.ndarray], stride: int = 1,
    corners: Sequence[float] = CORNERS,
) -> tuple[float, float, float]:  # fmt: skip
    """Largest differences of x_h [m], v_h [m/s], and of the pressures [Pa] outside 50 ms after a corner.

    `coupled` has the columns of a run, every `stride`-th point of the solution `truth`.
    """
    t = truth["time"][::stride]
    calm = np.all([(t < corner - 1e-9) | (t > corner + 0.05) for corner in corners], axis=0)
    p = max(np.abs(coupled[f"hydraulics.{n}"] - truth[n][::stride])[calm].max() for n in PRESSURES)
    x, v = (np.abs(coupled[f"arm.{n}"] - truth[n][::stride]).max() for n in ("x_h", "v_h"))
    return x, v, p
