"""What betrays a campaign that was written down wrongly, when it is held against the model as delivered.

Units, columns, times and marks for missing values: each is told in one line before anything is searched for, for no
effect of a machine is as large as such a slip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np

from ...core.units import convert, unit
from ...master.parallel.pool import Failure, Job
from ..campaign.campaign import CampaignError, Channel
from ..measurements.missing_marks import is_mark
from ..problem.noise import rms
from ..problem.observations import Block
from ..problem.problem import Problem
from .unit_mistakes import check_units


def check_campaign(problem: Problem, nominal: np.ndarray) -> list[str]:
    """Raise `CampaignError` for what cannot be meant; returns warnings. nominal: the model as delivered (n,)."""
    return [warning for check in CHECKS for warning in check(problem, nominal)]


def _impossible(where: str, unit: str, t: float, bad: float, least: float, most: float) -> CampaignError:
    return CampaignError(
        f"{where}: {bad:.6g} {unit} at {t:g} s is impossible beside {least:.4g} to {most:.4g} {unit}; leave empty what "
        "was not measured"
    )


def _check_marks(problem: Problem, _: np.ndarray) -> list[str]:
    """No value of a measured input is a usual mark for a missing one, far from all others; a pulse may be far, too."""
    settings = problem.settings.sanity
    for conditions in problem.runs:
        for c in problem.campaign.inputs:
            if c.connector not in conditions.inputs:
                continue
            t, x = conditions.inputs[c.connector]
            read = convert(x, problem.units[c.connector], c.unit) / c.scale
            marked = is_mark(read, settings.missing_marks)
            rest = read[~marked]
            if (
                not marked.any()
                or not len(rest)
                or np.abs(rest).max() * settings.impossible_spans > np.abs(read[marked]).min()
            ):
                continue
            k = int(np.argmax(marked))
            where = f"run '{conditions.name}', input '{c.column}'"
            raise _impossible(where, c.unit, t[k], read[k], rest.min(), rest.max())
    return []


def _check_all_readings(problem: Problem, nominal: np.ndarray) -> list[str]:
    for k, c in enumerate(problem.campaign.outputs):
        parts = [b for b in problem.observations.blocks if b.channel == k]
        if parts:
            _check_readings(problem, c, parts, nominal)
    return []


def _check_readings(problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray) -> None:
    """No reading is far from the model and from nearly all others: it would be a mark for a missing value."""
    y = np.concatenate([b.y for b in parts])
    model = np.concatenate([nominal[b.place] for b in parts])
    usual = float(np.subtract(*np.percentile(y, [97.0, 3.0])))
    span = max(usual, float(np.ptp(model)), max(b.noise_std for b in parts))
    low, high = min(model.min(), np.percentile(y, 3.0)), max(model.max(), np.percentile(y, 97.0))
    reach = problem.settings.sanity.impossible_spans * span
    for b in parts:
        far = (b.y < low - reach) | (b.y > high + reach)
        if far.any():
            k, fmu_unit = int(np.argmax(far)), problem.units[c.connector]
            bad, least, most = (float(convert(np.array([v]), fmu_unit, c.unit)[0]) for v in (b.y[k], low, high))
            where = f"run '{problem.runs[b.run].name}', channel '{c.column}'"
            raise _impossible(where, c.unit, b.t[k], bad, least, most)


def _check_swapped(problem: Problem, nominal: np.ndarray) -> list[str]:
    """Two columns that each fit the other's model far better than their own have changed places."""
    for (i, a), (j, b) in combinations(enumerate(problem.campaign.outputs), 2):
        units = problem.units[a.connector], problem.units[b.connector]
        if not unit(units[0]).same_dimension(unit(units[1])):
            continue
        pairs = list(_block_pairs(problem, i, j))
        if not pairs or any(len(x.y) != len(y.y) for x, y in pairs):
            continue
        straight: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        crossed: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        for x, y in pairs:
            for k, (block, partner) in enumerate(((x, y), (y, x))):
                read = convert(partner.y, *(units if partner is x else units[::-1]))
                straight[k].append((block.y - nominal[block.place]) / block.noise_std)
                crossed[k].append((read - nominal[block.place]) / block.noise_std)
        direct, swapped = ([rms(np.concatenate(parts)) for parts in pair] for pair in (straight, crossed))
        # a wrong unit makes one of both better only
        each_better = all(after < before for before, after in zip(direct, swapped, strict=True))
        if each_better and rms(np.array(swapped)) < problem.settings.sanity.swapped * rms(np.array(direct)) - 1.0:
            names = f"'{a.column}' and '{b.column}'"
            raise CampaignError(f"the columns {names} seem to be swapped: each fits the other's connector better")
    return []


def _block_pairs(problem: Problem, i: int, j: int) -> Iterator[tuple[Block, Block]]:
    for x in problem.observations.blocks:
        for y in problem.observations.blocks:
            if (x.channel, y.channel, x.run) == (i, j, y.run):
                yield x, y


def _check_inputs(problem: Problem, _: np.ndarray) -> list[str]:
    """Measured inputs that move have to move something in the model; warns of those that do so in other runs only."""
    record, step = problem.connectors, problem.fit_step
    nominal = problem.rows([{}], step)[0]
    if nominal is None:
        return []
    unused: dict[str, list[str]] = {}
    for r, conditions in enumerate(problem.runs):
        moving = [c for c, (_, x) in conditions.inputs.items() if np.ptp(x) > 0.0]
        if not moving:
            continue
        stop = problem.grid(r, step)[-1]
        changes = problem.overrides(r, {})
        held = {c: {**conditions.inputs, c: (conditions.inputs[c][0][:1], conditions.inputs[c][1][:1])} for c in moving}
        jobs = [
            Job(record, stop, step, changes, inputs, method=problem.discretisation.method) for inputs in held.values()
        ]
        outcomes = problem.simulator.simulate(jobs)
        idle = [
            c for c, rows in zip(moving, outcomes, strict=True)
            if not isinstance(rows, Failure) and np.array_equal(rows, nominal[r])
        ]  # fmt: skip
        if idle == moving:
            raise CampaignError(
                f"run '{conditions.name}': the input '{idle[0]}' changes nothing in the model; is there a parameter "
                'that has it followed? (The deep-sea machine needs "hydraulics.command.use_input" = true)'
            )
        for c in idle:
            unused.setdefault(c, []).append(conditions.name)
    # an effect may need it, as a friction that grows with pressure does
    remarks = ((c, "" if len(runs) == len(problem.runs) else f" in {', '.join(runs)}") for c, runs in unused.items())
    return [f"the input '{c}' changes nothing in the model as delivered{in_runs}" for c, in_runs in remarks]


CHECKS: tuple[Callable[[Problem, np.ndarray], list[str]], ...] = (
    _check_marks, _check_inputs, _check_swapped, _check_all_readings, check_units,
)  # fmt: skip
"""Each raises `CampaignError` for what cannot be meant and returns warnings; the model as delivered is (n,)."""
