"""What the shape of a channel betrays beside the model as delivered: sign, clock, another column, no motion."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from ...core.units import unit
from ..campaign.campaign import Channel
from ..measurements.read_table import read_table
from ..measurements.table import MeasurementError
from ..problem.observations import Block
from ..problem.problem import Problem
from ..settings import CHECKS, ONBOARDING
from .shapes import Likeness, Signal, compare

Columns = Callable[[int], Mapping[str, Signal]]
"""The columns of a run's file, by its place."""


@dataclass(frozen=True)
class Finding:
    """What looks wrong, of which run and channel; "" for all of them."""

    run: str
    channel: str
    text: str

    @property
    def in_one_line(self) -> str:
        """With its place before it."""
        return ": ".join(part for part in (self.run, self.channel, self.text) if part)


def in_channel_unit(problem: Problem, channel: Channel, size: float) -> float:
    """A difference in the FMU's unit in that of the channel."""
    return size * unit(problem.units[channel.connector]).factor / unit(channel.unit).factor


def check_shapes(problem: Problem, nominal: np.ndarray, known: Collection[str] = ()) -> list[Finding]:
    """What is told of each channel in each run; nominal: the model as delivered (n,).

    known: channels of which something is told already, so that their size and level are no news.
    """
    found: list[Finding] = []
    late: dict[int, list[tuple[str, float]]] = {}
    columns_of = cache(partial(_columns_of, problem))  # a large file takes seconds, and each of its channels may ask
    for b in problem.observations.series:
        name, run = problem.campaign.outputs[b.channel].column, problem.runs[b.run].name
        model = nominal[b.place]
        if (text := _rests(b, model) or _size(b, model)) is not None:
            if name not in known:
                found.append(Finding(run, name, text))
            continue
        alike = compare(Signal(b.t, b.y), Signal(b.t, model), ONBOARDING.points, ONBOARDING.longest_shift)
        if _is_late(b, model, alike):
            late.setdefault(b.run, []).append((name, alike.shift))
        elif alike.correlation < CHECKS.against:
            whose = "its sign or that of what drives it" if problem.runs[b.run].inputs else "its sign"
            text = f"it moves against the model (correlation {alike.correlation:.2f}); scale = -1 turns {whose}"
            found.append(Finding(run, name, text))
        elif alike.correlation < CHECKS.follows_not:
            found += [Finding(run, name, text) for text in _other_places(problem, b, columns_of)]
    for r, shifts in late.items():
        found.append(_shifted(problem, r, shifts))
    return found


def _rests(b: Block, model: np.ndarray) -> str | None:
    """What is said where readings rest and the model moves, or the other way round."""
    read, modelled, noise = float(np.ptp(b.y)), float(np.ptp(model)), b.noise_std
    if modelled > CHECKS.quiet * noise and read < CHECKS.unlike_rest * modelled + CHECKS.within_noise * noise:
        return "it does not move where the model does: a dead sensor, or another column?"
    if read > CHECKS.quiet * noise and modelled < CHECKS.unlike_rest * read:
        return "it moves where the model rests: is an input or a condition missing?"
    return None


def _size(b: Block, model: np.ndarray) -> str | None:
    """What is said where readings move far more or less than the model."""
    read, modelled = (float(np.subtract(*np.percentile(x, CHECKS.tails))) for x in (b.y, model))
    if min(read, modelled) <= 0.0 or max(read, modelled) <= CHECKS.quiet * b.noise_std:
        return None
    if 1.0 / CHECKS.off_size < read / modelled < CHECKS.off_size:
        return None
    return f"it moves {read / modelled:.3g} times as much as the model: is it that connector, and in that unit?"


def _is_late(b: Block, model: np.ndarray, alike: Likeness) -> bool:
    interval, length = float(np.median(np.diff(b.t))), float(np.ptp(b.t))
    if alike.shifted < CHECKS.follows or abs(alike.shift) < max(
        CHECKS.least_shift * interval, CHECKS.shift_of_run * length
    ):
        return False
    missed, left = 1.0 - alike.correlation**2, 1.0 - alike.shifted**2
    moved = abs(alike.shift) * float(np.std(np.gradient(model, b.t)))
    return left < CHECKS.shift_gain**2 * missed and moved > CHECKS.shift_missed * b.noise_std


def _shifted(problem: Problem, r: int, shifts: list[tuple[str, float]]) -> Finding:
    measured = sum(b.run == r for b in problem.observations.series)
    shift = float(np.median([s for _, s in shifts]))
    word = "late" if shift > 0.0 else "early"
    amount = f"{abs(shift):.3g} s {word}"
    if len(shifts) == measured and not problem.runs[r].inputs:
        sign = "after" if shift > 0.0 else "before"
        text = f"all channels come {amount}: 'start' {abs(shift):.3g} s {sign} where it is sets the clock right"
        return Finding(problem.runs[r].name, "", text)
    names = ", ".join(name for name, _ in shifts)
    return Finding(problem.runs[r].name, names, f"follows the model {amount}: is its clock another one?")


def _other_places(problem: Problem, b: Block, columns_of: Columns) -> Iterator[str]:
    """Another connector that the readings follow, another column that follows the model's; else that nothing does."""
    step, channel = problem.macro_step, problem.campaign.outputs[b.channel]
    taken = {c.connector for c in problem.campaign.channels}
    record = sorted(s for s in problem.signals if s.partition(".")[0] and s not in taken)
    t = problem.grid(b.run, step)
    rows = problem.of_runs([b.run]).rows([{}], step, [*record, b.connector])[0] if record else None
    if rows is not None:
        scores = {a: _follows(Signal(b.t, b.y), Signal(t, rows[0][:, k])) for k, a in enumerate(record)}
        best = max(scores, key=scores.__getitem__)
        if scores[best] > CHECKS.follows:
            yield f"it moves like {best} (correlation {scores[best]:.2f}), not like {b.connector}: another connector?"
            return
        own = Signal(t, rows[0][:, -1])
        known = {c.column for c in problem.campaign.inputs}  # what drives the model is like what that does
        others = {n: s for n, s in columns_of(b.run).items() if n not in {channel.column, *known}}
        columns = {n: _follows(s, own) for n, s in others.items()}
        name = max(columns, key=columns.__getitem__, default="")
        if name and columns[name] > CHECKS.follows:
            yield f"the column '{name}' moves like {b.connector} (correlation {columns[name]:.2f}), this one does not"


def _follows(read: Signal, model: Signal) -> float:
    return compare(read, model, ONBOARDING.points, 0.0).correlation


def _columns_of(problem: Problem, r: int) -> Mapping[str, Signal]:
    """The columns of a run's file on the model's clock, where their times can be taken as they stand."""
    run = problem.campaign.runs[r]
    if run.file is None:
        return {}
    try:
        table = read_table(run.file)
    except MeasurementError:  # written in a way that the campaign knows
        return {}
    used = {c.name: c for c in table.columns.values()}
    times = next(iter(run.series.values()))[0]
    signals = {}
    for name, c in used.items():
        known = np.isfinite(c.values)
        if known.sum() == len(c.time) and len(c.time) == len(times):
            signals[name] = Signal(times, c.values)
    return signals
