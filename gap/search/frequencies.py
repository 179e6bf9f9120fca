"""Frequencies that suit what is left, where an effect swings the machine at one of its own.

Over a run of many cycles a start that is off by a hundredth is a quarter of a turn late at the end, and what the effect
does there is no longer like what is left; starts that close would be too many to run. But what it does at one frequency
is, stretched in time, nearly what it does at a lower one, so those between two starts are tried without running them,
and the best of them is run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ..problem.parameters import EffectCandidate, EstimatedParameter
from ..problem.problem import Problem
from .response_bank import Response, ResponseBank, Variant, add_responses
from .sets import Projection
from .sizes import frequency_of

_Trial = tuple[float, float]
"""A frequency, in the parameter's unit, and the squares that it takes of what is left."""


def add_frequencies(problem: Problem, bank: ResponseBank, projection: Projection) -> ResponseBank:
    """The bank with effects at the usual size and the frequencies that suit best what is left."""
    return add_responses(problem, bank, _variants(problem, bank, projection))


def _variants(problem: Problem, bank: ResponseBank, projection: Projection) -> list[Variant]:
    """Effects with frequencies, at the usual size and the frequencies that take most of what is left."""
    settings, labels = problem.settings.search, {c.label for c in bank.candidates}
    variants: list[Variant] = []
    for c in problem.candidates:
        x = frequency_of(c)
        if x is None or c.label in labels:
            continue
        trials = sorted(_trials(problem, bank, projection, c, x))
        peaks = [
            here for before, here, after in zip(trials, trials[1:], trials[2:], strict=False)
            if here[1] > before[1] and here[1] >= after[1]
        ]  # fmt: skip
        other_shapes = {tuple((k, v) for k, v in y.values.items() if k != x.name) for y in _responses(bank, c)}
        for value, _ in sorted(peaks, key=lambda p: -p[1])[: settings.frequencies_run]:
            variants += [(c, {**dict(rest), x.name: (value - x.start) / x.scale}) for rest in sorted(other_shapes)]
    return variants


def _responses(bank: ResponseBank, c: EffectCandidate) -> list[Response]:
    return [y for y in bank.responses if y.candidate.label == c.label and not y.is_removal]


def _trials(
    problem: Problem, bank: ResponseBank, projection: Projection, c: EffectCandidate, x: EstimatedParameter
) -> Iterator[_Trial]:
    """Frequencies between neighbouring starts, so close that the end of a run shifts by a part of a turn from one to
    the next, and what they take: in any phase, for the responses to all other shapes may be mixed."""
    settings, blocks = problem.settings.search, _blocks(problem, bank)
    if not blocks:  # moments alone were measured
        return
    by_value: dict[float, list[np.ndarray]] = {}
    for y in _responses(bank, c):
        by_value.setdefault(x.value(y.values[x.name]), []).append(y.change)
    for low, high in pairwise(sorted(by_value)):
        if low <= 0.0:
            continue
        cycles = max(_cycles(change[k]) for change in by_value[high] for k, _ in blocks)
        count = int(np.ceil(np.log(high / low) * max(cycles, 1.0) / settings.frequency_spacing))
        for value in high * (low / high) ** np.linspace(0.0, 1.0, min(count, settings.frequency_trials) + 1):
            stretched = [_stretched(change, blocks, value / high) for change in by_value[high]]
            yield float(value), projection.taken_by(np.stack(stretched, axis=1))


def _blocks(problem: Problem, bank: ResponseBank) -> list[tuple[np.ndarray, np.ndarray]]:
    """Places among the bank's rows of the samples of each run and channel, and their times [s]."""
    o, rows = problem.observations, bank.rows
    series = np.concatenate([np.full(len(b.t), b.is_series) for b in o.blocks])[rows]
    code = (o.run * (o.channel.max() + 1) + o.channel)[rows]
    places = [np.flatnonzero(series & (code == k)) for k in np.unique(code)]
    return [(k, o.time[rows][k]) for k in places if len(k) > 2]


def _cycles(change: np.ndarray) -> float:
    """Half of how often it crosses its mean."""
    above = change > change.mean()
    return 0.5 * float(np.count_nonzero(above[1:] != above[:-1]))


def _stretched(change: np.ndarray, blocks: Sequence[tuple[np.ndarray, np.ndarray]], share: float) -> np.ndarray:
    """What happens at t, of each run and channel, at t over the share."""
    stretched = np.zeros_like(change)
    for k, t in blocks:
        stretched[k] = np.interp(t * share, t, change[k])
    return stretched
