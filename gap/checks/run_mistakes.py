"""What betrays a run as a whole beside the model as delivered: the file of another run, a wrong condition, a clock at
the wrong rate. No effect of a machine does as much."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.units import unit
from ..problem.noise import rms
from ..problem.observations import Block
from ..problem.problem import Problem
from ..settings import CHECKS
from .shape_mistakes import Finding, in_channel_unit
from .shapes import FloatArray


def check_runs(problem: Problem, nominal: FloatArray) -> list[Finding]:
    """What is told of each run; nominal: the model as delivered (n,). Files and clocks of the first runs only, where
    there are many, for each is compared with all others."""
    first = problem.of_runs(range(min(len(problem.runs), CHECKS.compared_runs)))
    rows = first.rows([{}], problem.fit_step)[0]
    if rows is None:
        return []
    return [*_exchanged(first, rows), *_clock_rates(first, rows), *_levels(problem, nominal)]


def _exchanged(problem: Problem, rows: list[FloatArray]) -> Iterator[Finding]:
    """Runs that the model follows far better in the conditions of another one, in every channel."""
    if len(rows) < 2:
        return
    fits: dict[int, int] = {}
    for r in range(len(rows)):
        blocks = [b for b in problem.observations.series if b.run == r]
        own = _misses(problem, blocks, rows[r])
        if not blocks or rms(np.array(own)) < CHECKS.quiet:
            continue
        of_others = {s: _misses(problem, blocks, rows[s]) for s in range(len(rows)) if s != r}
        s = min(of_others, key=lambda s: rms(np.array(of_others[s])))
        better = all(there <= here for there, here in zip(of_others[s], own, strict=True))
        if better and rms(np.array(of_others[s])) < CHECKS.exchanged * rms(np.array(own)):
            fits[r] = s
    for r, s in fits.items():
        name, other = problem.runs[r].name, problem.runs[s].name
        text = f"its readings fit the conditions of {other} far better than its own: are its conditions wrong?"
        if fits.get(s) == r:
            text = f"its readings fit the conditions of {other}, and those of {other} its own: are the files exchanged?"
        yield Finding(name, "", text)


def _misses(problem: Problem, blocks: list[Block], signals: FloatArray, rate: float = 1.0) -> list[float]:
    """RMS of readings less signals (m, connectors), in noises, of each block over the times that both have; the model
    at `rate` times their time."""
    grid = np.arange(len(signals)) * problem.fit_step
    found = []
    for b in blocks:
        inside = (rate * b.t <= grid[-1]) & (b.t <= b.t[-1] / max(rate, 1.0))
        model = np.interp(rate * b.t[inside], grid, signals[:, problem.connectors.index(b.connector)])
        found.append(rms((b.y[inside] - model) / b.noise_std) if inside.any() else np.inf)
    return found


def _clock_rates(problem: Problem, rows: list[FloatArray]) -> Iterator[Finding]:
    """Runs whose channels all follow the model at another rate of time: wrongly sampled, or a clock that drifts."""
    for r, signals in enumerate(rows):
        of_run = [b for b in problem.observations.series if b.run == r]
        moved = np.ptp(signals, axis=0)
        blocks = [b for b in of_run if moved[problem.connectors.index(b.connector)] > CHECKS.quiet * b.noise_std]
        if problem.runs[r].inputs or len(blocks) < CHECKS.channels_of_rate:
            continue
        here = np.array(_misses(problem, blocks, signals))
        if here.min() < CHECKS.quiet_rate:
            continue
        rate = _best_rate(problem, blocks, signals)
        if np.all(np.array(_misses(problem, blocks, signals, rate)) < CHECKS.rate_gain * here):
            text = f"all channels follow the model at {rate:.4g} times its time"
            remedy = "is the clock's rate right, or the sampling rate that times were made with?"
            yield Finding(problem.runs[r].name, "", f"{text}: {remedy}")


def _best_rate(problem: Problem, blocks: list[Block], signals: FloatArray) -> float:
    """The rate at which the worst of the channels is missed by the smallest share of what it is at rate 1."""
    here = np.maximum(_misses(problem, blocks, signals), 1e-300)

    def left(rate: float) -> float:
        return float((np.array(_misses(problem, blocks, signals, rate)) / here).max())

    coarse = np.geomspace(1.0 / CHECKS.farthest_rate, CHECKS.farthest_rate, CHECKS.tried_rates)
    best = min((1.0, *map(float, coarse)), key=left)
    width = float(coarse[1] / coarse[0])
    while width > 1.0 + CHECKS.rate_within:
        width **= 0.5
        best = min((best / width, best, best * width), key=left)
    return best


def _levels(problem: Problem, nominal: FloatArray) -> Iterator[Finding]:
    for b in problem.observations.series:
        if (text := _level(problem, b, nominal)) is not None:
            yield Finding(problem.runs[b.run].name, problem.campaign.outputs[b.channel].column, text)


def _level(problem: Problem, b: Block, nominal: FloatArray) -> str | None:
    """What is said where readings stand farther from the model than they move, and than that does within any run:
    between runs it may move as far as a depth makes it."""
    away = float(np.median(b.y) - np.median(nominal[b.place]))
    of_channel = [nominal[x.place] for x in problem.observations.series if x.channel == b.channel]
    moves = max(float(np.ptp(x)) for x in (b.y, *of_channel))
    level = CHECKS.off_share * abs(float(np.median(nominal[b.place])))
    if abs(away) < max(CHECKS.off_level * moves, CHECKS.quiet * b.noise_std, level):
        return None
    channel = problem.campaign.outputs[b.channel]
    shown = in_channel_unit(problem, channel, abs(away))
    side = "above" if away > 0.0 else "below"
    zero = " or is its zero another one, as that of a pressure over ambient" if _is_pressure(channel.unit) else ""
    return (
        f"it stands {shown:.3g} {channel.unit} {side} the model, more than it moves: is a condition of the run missing"
        f" or wrong{zero}?"
    )


def _is_pressure(name: str) -> bool:
    return unit(name).same_dimension(unit("Pa"))
