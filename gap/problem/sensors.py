"""The measurement model: what a channel reads when the model's signal is given.

    y(t) = scale * z + curvature * (z - middle)^2 + bias + drift * t,   z(t): x delayed by `delay`, and lagged

The lag is of first order with the time constant `lag`; of second order are two of them in turn, which share it out:
`split` is twice the second one's part. Bias is in units of the channel, drift in these per second, the curvature in
one over them, the other quantities as in the catalogue. With neutral values y = x, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensor:
    """Errors of one channel: bias [SI], scale [1], lag [s], delay [s], drift [SI/s], curvature [1/SI] about `middle`
    [SI], split of the lag [1]."""

    bias: float = 0.0
    scale: float = 1.0
    lag: float = 0.0
    delay: float = 0.0
    drift: float = 0.0
    curvature: float = 0.0
    middle: float = 0.0
    split: float = 0.0

    def observe(self, t: np.ndarray, x: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Readings at the times `at` [s] of the signal x (n,) known at the increasing times t (n,)."""
        if self.lag > 0.0:
            for part in (1.0 - 0.5 * self.split, 0.5 * self.split):
                x = first_order_lag(t, x, part * self.lag) if part > 0.0 else x
        y = np.interp(at - self.delay, t, x)
        read: np.ndarray = y if self.scale == 1.0 and self.bias == 0.0 else self.scale * y + self.bias
        if self.curvature != 0.0:
            read = read + self.curvature * (y - self.middle) ** 2
        return read if self.drift == 0.0 else read + self.drift * at


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
