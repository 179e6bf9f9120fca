"""Whether a signal has run away: grown beyond all measure, and by doubling over and over.

What is merely large has grown in another way: an integral grows twofold in the second half of a run, a t^3 eightfold.
What a coupling (or the system itself) makes unstable grows as an exponential, and there by orders of magnitude.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

MIN_GROWTH = 1e9
"""Multiple of what a signal began with, or of its nominal value, beyond which nothing physical goes."""
DOUBLINGS = 12
"""Doublings in the second half of a run that nothing but an exponential makes."""
SEEN = 1e3
"""Multiple at which the growth shows, whose time is told."""


def divergence(names: Sequence[str], nominals: Sequence[float], t: np.ndarray, y: np.ndarray) -> list[str]:
    """What to say of the signal that has run away furthest; nothing where none has.

    names, nominals: of the signals, and their usual sizes; t, y: times (n,) and values (n, signals).
    """
    if len(t) < 4 or not names:
        return []
    with np.errstate(invalid="ignore"):
        size = np.where(np.isfinite(y), np.abs(y), 0.0)
    began, most = np.maximum(nominals, size[0]), size.max(axis=0)
    half = size[: len(t) // 2].max(axis=0)
    away = (most >= MIN_GROWTH * began) & (most >= 2.0**DOUBLINGS * half)
    if not away.any():
        return []
    k = int(np.argmax(np.where(away, most / began, 0.0)))
    first = float(t[np.argmax(size[:, k] > SEEN * began[k])])
    return [
        f"'{names[k]}' runs away: it reaches {most[k]:.2g}, {most[k] / began[k]:.1g} times what it began with, and has "
        f"doubled over and over from t = {first:.4g} s on; do not trust this run: the coupling is unstable with this "
        "method and step, or the system itself is (a shorter --step tells)"
    ]
