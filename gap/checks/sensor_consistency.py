"""Do the sensors agree with each other? Relations that hold in the model whatever its parameters are tried on the data.

Found in the model itself: a signal that is the rate of another one (speed and position), and one that is a fixed linear
combination of others of its component (force from pressures and areas).
"""

from __future__ import annotations

import numpy as np

from ..analysis.component_replay import rate_pairs, smooth
from ..problem.noise import rms
from ..problem.problem import Problem

EXACT = 1e-4
"""Share of a signal's spread that an identity of the model may miss."""


def check(problem: Problem, delivered: np.ndarray) -> list[str]:
    """Warnings about sensors that contradict each other."""
    return [*_rates(problem), *_sums(problem, delivered)]


def _rates(problem: Problem) -> list[str]:
    rows = problem.rows([{}], problem.coarse)[0]
    if rows is None:
        return []
    told = []
    for a, b in rate_pairs(problem.connectors, rows[0], problem.coarse):
        for r, info in enumerate(problem.runs):
            blocks = problem.obs.of_run(r)
            if a not in blocks or b not in blocks:
                continue
            t = blocks[a].t
            t = t[(t > blocks[b].t[0]) & (t < blocks[b].t[-1])]
            read, _ = smooth(blocks[a].t, blocks[a].y, t)
            rate = smooth(blocks[b].t, blocks[b].y, t)[1]
            scale = float(rate @ read / max(rate @ rate, 1e-300))
            left = rms(read - scale * rate) / max(float(np.std(read)), 1e-300)
            if abs(scale - 1.0) > 0.03 and left < 0.5:
                told.append(f"{info.name}: {a} reads {scale:.3f} times the rate of {b}: one scale is wrong")
                break
    return told


def _sums(problem: Problem, delivered: np.ndarray) -> list[str]:
    told = []
    obs = problem.obs
    for r in range(len(problem.runs)):
        blocks = obs.of_run(r)
        for target, block in blocks.items():
            others = [
                c for c in blocks
                if c != target and c.split(".", 1)[0] == target.split(".", 1)[0] and len(blocks[c].t) == len(block.t)
            ]  # fmt: skip
            if len(others) < 2:
                continue
            model = np.stack([delivered[blocks[c].place] for c in others] + [np.ones(len(block.t))], axis=1)
            y = delivered[block.place]
            scale = np.maximum(np.abs(model).max(0), 1e-300)
            coefficients = np.linalg.lstsq(model / scale, y, rcond=None)[0] / scale
            if np.std(y - model @ coefficients) > EXACT * np.std(y) or np.std(y) == 0.0:
                continue
            measured = np.stack([blocks[c].y for c in others] + [np.ones(len(block.t))], axis=1)
            gap = block.y - measured @ coefficients
            floor = np.sqrt(
                block.floor**2 + sum((k * blocks[c].floor) ** 2 for k, c in zip(coefficients, others, strict=False))
            )
            off = rms(gap) / floor
            parts = {c: abs(k) * np.ptp(delivered[blocks[c].place]) for k, c in zip(coefficients, others, strict=False)}
            used = [c for c, part in parts.items() if part > 0.01 * np.ptp(y)]
            if off > 3.0 and used:
                told.append(
                    f"{problem.runs[r].name}: {target} and {', '.join(used)} contradict each other by "
                    f"{off:.1f} noise floors (mean {np.mean(gap):.4g} {problem.units.get(target, '')})"
                )
        if told:
            break
    return told
