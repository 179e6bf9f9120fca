"""Do the sensors agree with each other? Relations that hold in the model whatever its parameters are tried on the data.

Found in the model itself: a signal that is the rate of another one (speed and position), and one that is a fixed linear
combination of others of its component (force from pressures and areas).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..problem.noise import rms
from ..problem.observations import Block
from ..problem.problem import Problem
from ..problem.signals import rate_pairs, smooth


def check_sensors(problem: Problem, nominal: np.ndarray) -> list[str]:
    """Warnings about sensors that contradict each other; nominal: the model as delivered (n,)."""
    return [*_check_rates(problem), *_check_sums(problem, nominal)]


def _check_rates(problem: Problem) -> list[str]:
    rows = problem.rows([{}], problem.fit_step)[0]
    if rows is None:
        return []
    warnings = []
    for a, b in rate_pairs(problem.connectors, rows[0], problem.fit_step):
        for r, conditions in enumerate(problem.runs):
            blocks = problem.samples.of_run(r)
            if a not in blocks or b not in blocks:
                continue
            scale = _rate_scale(problem, blocks[a], blocks[b])
            if scale is not None:
                warnings.append(f"{conditions.name}: {a} reads {scale:.3f} times the rate of {b}: one scale is wrong")
                break
    return warnings


def _rate_scale(problem: Problem, rate_block: Block, block: Block) -> float | None:
    """How many times the rate of a block another one reads, where that is plain and not 1."""
    kernel, settings = problem.settings.analysis.replay_kernel, problem.settings.sanity
    t = rate_block.t
    t = t[(t > block.t[0]) & (t < block.t[-1])]
    read = smooth(rate_block.t, rate_block.y, t, kernel).value
    rate = smooth(block.t, block.y, t, kernel).slope
    scale = float(rate @ read / max(rate @ rate, 1e-300))
    unexplained = rms(read - scale * rate) / max(float(np.std(read)), 1e-300)
    return scale if abs(scale - 1.0) > settings.rate_scale and unexplained < settings.rate_left else None


def _check_sums(problem: Problem, nominal: np.ndarray) -> list[str]:
    for r in range(len(problem.runs)):
        blocks = problem.samples.of_run(r)
        warnings = [_contradiction(problem, nominal, r, target, blocks) for target in blocks]
        if any(warnings):
            return [text for text in warnings if text is not None]
    return []


def _contradiction(
    problem: Problem, nominal: np.ndarray, run: int, target: str, blocks: Mapping[str, Block]
) -> str | None:
    """What is wrong where a signal is a sum of others of its component in the model and not in the readings."""
    settings, block = problem.settings.sanity, blocks[target]
    component = target.split(".", 1)[0]
    terms = [c for c in blocks if c != target and c.split(".", 1)[0] == component and len(blocks[c].t) == len(block.t)]
    if len(terms) < 2:
        return None
    model = np.stack([nominal[blocks[c].place] for c in terms] + [np.ones(len(block.t))], axis=1)
    y = nominal[block.place]
    scale = np.maximum(np.abs(model).max(0), 1e-300)
    coefficients = np.linalg.lstsq(model / scale, y, rcond=None)[0] / scale
    if np.std(y - model @ coefficients) > settings.identity * np.std(y) or np.std(y) == 0.0:
        return None
    measured = np.stack([blocks[c].y for c in terms] + [np.ones(len(block.t))], axis=1)
    gap = block.y - measured @ coefficients
    parts = list(zip(terms, coefficients, strict=False))
    noise = np.sqrt(block.noise_std**2 + sum((k * blocks[c].noise_std) ** 2 for c, k in parts))
    used = [c for c, k in parts if abs(k) * np.ptp(nominal[blocks[c].place]) > settings.least_part * np.ptp(y)]
    contradiction = rms(gap) / noise
    if contradiction <= settings.contradiction or not used:
        return None
    unit = problem.units.get(target, "")
    return (
        f"{problem.runs[run].name}: {target} and {', '.join(used)} contradict each other by {contradiction:.1f} noise "
        f"floors (mean {np.mean(gap):.4g} {unit})"
    )
