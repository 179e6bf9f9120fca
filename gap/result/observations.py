"""What the channels were compared as: samples, measured moments, and what describes a swing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..pipeline.state import State
from ..problem.observations import Block
from ..problem.problem import Problem
from ..problem.swing import AMPLITUDE, FREQUENCY


def observations(s: State) -> list[dict[str, Any]]:
    """One entry for each channel of a run, and one for each of its swings, with its share in the metric: of the squared
    normalised residual that calibration leaves."""
    calibrated, chosen = s.ranked_baseline.hypothesis, s.reported.hypothesis
    models = {"model": calibrated.fit.model}
    if chosen.candidates:
        models["explained"] = chosen.fit.model
    entries = list(_of(s.problem, models, calibrated.fit.residual))
    if s.holdout is not None:
        entries += _of(s.holdout.problem, {}, s.residual_of(s.ranked_baseline))
    return entries


def _of(problem: Problem, models: dict[str, np.ndarray], residual: np.ndarray) -> Iterator[dict[str, Any]]:
    whole = max(float(residual @ residual), 1e-300)
    swings: dict[int, list[Block]] = {}
    for b in problem.observations.blocks:
        if b.feature is not None:
            swings.setdefault(id(b.feature.swing), []).append(b)
            continue
        yield _named(problem, b) | {"as": "samples" if b.event is None else "event"}
    for blocks in swings.values():
        energy = sum(float(residual[b.place] @ residual[b.place]) for b in blocks)
        yield _named(problem, blocks[0]) | {"as": "swing", "share": energy / whole, "swing": _swing(blocks, models)}


def _named(problem: Problem, block: Block) -> dict[str, Any]:
    return {"run": problem.runs[block.run].name, "channel": problem.labels[block.channel]}


def _swing(blocks: Sequence[Block], models: dict[str, np.ndarray]) -> dict[str, Any]:
    """When [s], and frequency [1/s] and amplitude [unit of the FMU's variable] as measured and of the models; a
    frequency is None where a signal has none of its own, or hardly stands out of the noise."""
    feature = blocks[0].feature
    assert feature is not None
    at = feature.swing.at
    entry = {"from": float(at[0]), "to": float(at[-1]), **_described(blocks, None)}
    return entry | {name: _described(blocks, model) for name, model in models.items()}


def _described(blocks: Sequence[Block], model: np.ndarray | None) -> dict[str, Any]:
    """Frequency, and the amplitude's middle without the noise's part; model: a prediction (n,), None for readings."""
    description: dict[str, Any] = {"swings": False, "frequency": None, "amplitude": 0.0}
    for b in blocks:
        assert b.feature is not None
        read = b.y if model is None else model[b.place]
        if b.feature.quantity == AMPLITUDE:
            squared = np.exp(2.0 * read) - b.feature.swing.noise_energy
            description["amplitude"] = float(np.sqrt(max(float(np.median(squared)), 0.0)))
            description["swings"] = bool(np.median(squared) > b.feature.swing.least_energy)
        elif b.feature.quantity == FREQUENCY and description["swings"]:
            description["frequency"] = float(np.exp(read[0]))
    return description
