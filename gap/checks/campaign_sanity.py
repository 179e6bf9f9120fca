"""What betrays a campaign that was written down wrongly, when it is held against the model as delivered.

Units, columns, times and marks for missing values: each is told in one line before anything is searched for, for no
effect of a machine is as large as such a slip.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ...core.units import convert, unit
from ...master.pool import Failure, Job
from ..campaign.read import CampaignError, Channel
from ..problem.noise import rms
from ..problem.observations import Block
from ..problem.problem import Problem
from . import unit_mistakes as mistaken_units

SPANS = 20.0
"""Spans of model and readings that a reading may lie beyond both."""

MARKS = (999.0, 9999.0, 99999.0, 999999.0)
"""What is written, or its negative, where there was no reading."""

SWAPPED = 0.3
"""Share of the gap that two columns leave, each taken for the other, when they are swapped."""


def check(problem: Problem, delivered: np.ndarray) -> None:
    """Raise `CampaignError` for what cannot be meant; `delivered` is the model's long vector (n,)."""
    _check_marks(problem)
    _check_inputs(problem)
    _check_swapped(problem, delivered)
    for k, c in enumerate(problem.campaign.outputs):
        parts = [b for b in problem.obs.blocks if b.channel == k]
        if parts:
            _check_readings(problem, c, parts, delivered)
    mistaken_units.check(problem, delivered)


def _impossible(where: str, unit: str, t: float, bad: float, least: float, most: float) -> CampaignError:
    return CampaignError(
        f"{where}: {bad:.6g} {unit} at {t:g} s is impossible beside {least:.4g} to {most:.4g} {unit}; leave empty what "
        "was not measured"
    )


def _check_marks(problem: Problem) -> None:
    """No value of a measured input is a usual mark for a missing one, far from all others; a pulse may be far, too."""
    for info in problem.runs:
        for c in problem.campaign.inputs:
            if c.connector not in info.inputs:
                continue
            t, x = info.inputs[c.connector]
            read = convert(x, problem.units[c.connector], c.unit)
            marked = np.isin(np.abs(np.round(read, 6)), MARKS)
            rest = read[~marked]
            if not marked.any() or not len(rest) or np.abs(rest).max() * SPANS > np.abs(read[marked]).min():
                continue
            k = int(np.argmax(marked))
            raise _impossible(f"run '{info.name}', input '{c.column}'", c.unit, t[k], read[k], rest.min(), rest.max())


def _check_readings(problem: Problem, c: Channel, parts: list[Block], delivered: np.ndarray) -> None:
    """No reading is far from the model and from nearly all others: it would be a mark for a missing value."""
    y = np.concatenate([b.y for b in parts])
    model = np.concatenate([delivered[b.place] for b in parts])
    usual = float(np.subtract(*np.percentile(y, [97.0, 3.0])))
    span = max(usual, float(np.ptp(model)), max(b.floor for b in parts))
    low, high = min(model.min(), np.percentile(y, 3.0)), max(model.max(), np.percentile(y, 97.0))
    for b in parts:
        far = (b.y < low - SPANS * span) | (b.y > high + SPANS * span)
        if far.any():
            k, own = int(np.argmax(far)), problem.units[c.connector]
            bad, least, most = (float(convert(np.array([v]), own, c.unit)[0]) for v in (b.y[k], low, high))
            where = f"run '{problem.runs[b.run].name}', channel '{c.column}'"
            raise _impossible(where, c.unit, b.t[k], bad, least, most)


def _check_swapped(problem: Problem, delivered: np.ndarray) -> None:
    """Two columns that each fit the other's model far better than their own have changed places."""
    for (i, a), (j, b) in combinations(enumerate(problem.campaign.outputs), 2):
        units = problem.units[a.connector], problem.units[b.connector]
        if not unit(units[0]).same_dimension(unit(units[1])):
            continue
        pairs = list(_pairs(problem, i, j))
        if not pairs or any(len(x.y) != len(y.y) for x, y in pairs):
            continue
        straight, crossed = [], []
        for x, y in pairs:
            for mine, other, floor in ((x, y, x.floor), (y, x, y.floor)):
                read = convert(other.y, *(units if other is x else units[::-1]))
                straight.append((mine.y - delivered[mine.place]) / floor)
                crossed.append((read - delivered[mine.place]) / floor)
        if rms(np.concatenate(crossed)) < SWAPPED * rms(np.concatenate(straight)) - 1.0:
            names = f"'{a.column}' and '{b.column}'"
            raise CampaignError(f"the columns {names} seem to be swapped: each fits the other's connector better")


def _pairs(problem: Problem, i: int, j: int) -> Iterator[tuple[Block, Block]]:
    for x in problem.obs.blocks:
        for y in problem.obs.blocks:
            if (x.channel, y.channel, x.run) == (i, j, y.run):
                yield x, y


def _check_inputs(problem: Problem) -> None:
    """Measured inputs that move have to move something in the model."""
    record, step = tuple(problem.connectors), problem.coarse
    delivered = problem.rows([{}], step)[0]
    if delivered is None:
        return
    unused: dict[str, list[str]] = {}
    for r, info in enumerate(problem.runs):
        moving = [c for c, (_, x) in info.inputs.items() if np.ptp(x) > 0.0]
        if not moving:
            continue
        stop = problem.grid(r, step)[-1]
        changes = problem.changes(r, {})
        still = {c: {**info.inputs, c: (info.inputs[c][0][:1], info.inputs[c][1][:1])} for c in moving}
        jobs = [Job(record, stop, step, changes, given, method=problem.method) for given in still.values()]
        found = problem.pool.run(jobs)
        idle = [
            c for c, rows in zip(moving, found, strict=True)
            if not isinstance(rows, Failure) and np.array_equal(rows, delivered[r])
        ]  # fmt: skip
        if idle == moving:
            raise CampaignError(
                f"run '{info.name}': the input '{idle[0]}' changes nothing in the model; is there a parameter that has "
                'it followed? (The deep-sea machine needs "hydraulics.command.use_input" = true)'
            )
        for c in idle:
            unused.setdefault(c, []).append(info.name)
    for c, runs in unused.items():  # an effect may need it, a friction that grows with pressure
        where = "" if len(runs) == len(problem.runs) else f" in {', '.join(runs)}"
        problem.warnings.append(f"the input '{c}' changes nothing in the model as delivered{where}")
