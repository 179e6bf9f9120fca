"""Whether probabilities are what they say."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

Pair = tuple[float, bool]
"""A probability, and whether what it is of is true."""

EDGES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
"""Bins of the reliability table: most effects are improbable, so they are narrow at the ends."""


def calibration_error(pairs: Sequence[Pair], bins: int = 10) -> float | None:
    """Expected calibration error: mean gap between probability and frequency, weighted by the bin's number."""
    if not pairs:
        return None
    by_bin: dict[int, list[Pair]] = defaultdict(list)
    for p, hit in pairs:
        by_bin[min(int(p * bins), bins - 1)].append((p, hit))
    total = sum(abs(sum(p for p, _ in members) - sum(hit for _, hit in members)) for members in by_bin.values())
    return total / len(pairs)


def sure_error(probabilities: Sequence[float], draws: int = 2000) -> float | None:
    """Mean calibration error of a tool whose probabilities are right: what so few cases scatter."""
    if not probabilities:
        return None
    lots = np.random.default_rng(0).random((draws, len(probabilities)))
    hits = (lots < np.array(probabilities)).tolist()
    found = [calibration_error(list(zip(probabilities, row, strict=True))) or 0.0 for row in hits]
    return float(np.mean(found))


def relative_brier(pairs: Sequence[Pair]) -> float | None:
    """Brier score over that of always saying how often an effect is there: 0 is perfect, 1 is no better than that."""
    if not pairs:
        return None
    p, hit = (np.array(x, float) for x in zip(*pairs, strict=True))
    base = float(hit.mean())
    spread = base * (1.0 - base)
    return float(np.mean((p - hit) ** 2)) / spread if spread > 0.0 else None


def reliability(pairs: Sequence[Pair]) -> list[dict[str, Any]]:
    """By bin of the probability: how many, their mean, and how often true."""
    made = []
    for low, high in pairwise(EDGES):
        inside = [(p, hit) for p, hit in pairs if low <= p < high or (high == 1.0 and p >= 1.0)]
        if inside:
            mean = sum(p for p, _ in inside) / len(inside)
            often = sum(hit for _, hit in inside) / len(inside)
            made.append({"from": low, "to": high, "effects": len(inside), "mean": mean, "true": often})
    return made
