"""Free curves for what no formula fits: friction over velocity, the valve's opening over the spool's position.

A curve is given at ten knots, five to each side of zero, as shares of a reference, and is straight between them.
"""

from __future__ import annotations

from ..core.jit import kernel

KNOTS = (0.03, 0.1, 0.25, 0.5, 1.0)
"""Distance of the knots from zero, to either side."""

SIDE = len(KNOTS)
"""Knots to a side: a curve is 2 * SIDE values, from -1 to 1."""


def knots() -> tuple[float, ...]:
    """All knots in the order of a curve's values."""
    return (*(-k for k in reversed(KNOTS)), *KNOTS)


@kernel
def on_curve(x: float, values: object, at_zero: float) -> float:
    """The curve at x (share of the reference) with these values at its knots; as far as its last knot beyond it.
    Towards zero it goes to `at_zero` times its value at the first knot of that side."""
    at, i, way = abs(x), SIDE, 1
    if x < 0.0:
        i, way = SIDE - 1, -1
    low, y_low = 0.0, at_zero * values[i]
    for k in range(SIDE):
        high, y_high = KNOTS[k], values[i]
        if at <= high:
            return y_low + (y_high - y_low) * (at - low) / (high - low)
        low, y_low = high, y_high
        i += way
    return y_low
