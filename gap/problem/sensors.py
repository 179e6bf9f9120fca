"""The measurement model: what a channel reads when the model's signal is given.

    y(t) = scale * (x delayed by `delay`, followed by a first-order lag of time constant `lag`) + bias

Bias is in units of the channel, the other quantities as in the catalogue. With neutral values y = x, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensor:
    """Errors of one channel: bias [SI], scale [1], lag [s], delay [s]."""

    bias: float = 0.0
    scale: float = 1.0
    lag: float = 0.0
    delay: float = 0.0

    def read(self, t: np.ndarray, x: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Readings at the times `at` [s] of the signal x (n,) known at the increasing times t (n,)."""
        if self.lag > 0.0:
            x = first_order_lag(t, x, self.lag)
        y = np.interp(at - self.delay, t, x)
        read: np.ndarray = y if self.scale == 1.0 and self.bias == 0.0 else self.scale * y + self.bias
        return read


def first_order_lag(t: np.ndarray, x: np.ndarray, tau: float) -> np.ndarray:
    """y with tau y' + y = x and y(t_0) = x(t_0), exact for x joined by straight lines."""
    y = np.empty_like(x)
    y[0] = x[0]
    h = np.diff(t)
    decay = np.exp(-h / tau)
    slope = np.diff(x) / h
    for k in range(len(h)):
        # particular solution x - tau x', homogeneous part decays
        y[k + 1] = x[k + 1] - tau * slope[k] + (y[k] - x[k] + tau * slope[k]) * decay[k]
    return y
