"""How evenly a logger's clock ticks."""

from __future__ import annotations

import numpy as np

from ..settings import FILE_LIMITS
from .table import FloatArray


def clock_jitter(seconds: FloatArray) -> float:
    """Standard deviation [s] of times (n,) around an even clock; holes and slow drift do not count."""
    steps = np.diff(seconds)
    usual = np.median(steps)
    near = steps[(steps > 0.5 * usual) & (steps < 1.5 * usual)]
    return float(near.std()) / np.sqrt(2.0) if len(near) > 0.5 * len(steps) else 0.0


def jitters(seconds: FloatArray) -> bool:
    """Whether times (n,) lie so unevenly that differences of readings show it."""
    return bool(clock_jitter(seconds) > FILE_LIMITS.jitter_warning_from * np.median(np.diff(seconds)))
