"""What is wrong with readings themselves: clipped, too slow for what the model does, noisier than stated; no gap."""

from __future__ import annotations

import numpy as np

from ...core.units import unit
from ..campaign.campaign import Channel
from ..problem.noise import estimate_channel_noise, rms
from ..problem.observations import average_neighbours
from ..problem.problem import Problem
from ..settings import CHECKS, DEFAULT
from .shape_mistakes import Finding, in_channel_unit


def check_readings(problem: Problem, nominal: np.ndarray) -> list[Finding]:
    """What is told of the readings; nominal: the model as delivered (n,)."""
    rows = problem.rows([{}], problem.macro_step)[0]
    found: list[Finding] = []
    for b in problem.observations.series:
        channel, run = problem.campaign.outputs[b.channel], problem.campaign.runs[b.run]
        t, y = run.series[b.connector]
        y = _in_fmu_unit(problem, channel, y)
        if rows is None:
            continue
        grid, model = problem.grid(b.run, problem.macro_step), rows[b.run][:, problem.connectors.index(b.connector)]
        found += [Finding(run.name, channel.column, text) for text in _averaged(t, y)]
        at = np.interp(t, grid, model)
        texts = (
            _clipped(y, at), _slow(t, grid, model), _noisier(problem, channel, t, y, at), _held(t, y),
            _jump(problem, channel, t, y, at),
        )  # fmt: skip
        found += [Finding(run.name, channel.column, text) for text in texts if text is not None]
    return [*found, *_below_noise(problem, nominal)]


def _in_fmu_unit(problem: Problem, channel: Channel, y: np.ndarray) -> np.ndarray:
    u = unit(problem.units[channel.connector])
    return np.asarray((y - u.offset) / u.factor)


def _clipped(y: np.ndarray, model: np.ndarray) -> str | None:
    """Where readings stand at their highest or lowest value and the model goes on."""
    span = float(np.ptp(y))
    if span == 0.0:  # a dead sensor, which is told by its shape
        return None
    for end, beyond, word in ((y.max(), model - y.max(), "highest"), (y.min(), y.min() - model, "lowest")):
        at_end = y == end
        if at_end.mean() < CHECKS.clipped_share or _longest(at_end) < CHECKS.clipped_samples:
            continue
        if float(beyond[at_end].max()) > CHECKS.clipped_beyond * span:
            share = at_end.mean()
            return f"{share:.0%} of its readings are at its {word} value, where the model goes on: is it clipped?"
    return None


def _held(t: np.ndarray, y: np.ndarray) -> str | None:
    """Where each reading is repeated so many times, as a logger does that is faster than its sensor."""
    lengths = np.diff(np.flatnonzero(np.diff(y) != 0.0))
    if len(lengths) < CHECKS.held_values:
        return None
    usual = float(np.median(lengths))
    if usual < CHECKS.held_rows or np.mean(np.abs(lengths - usual) <= 1.0) < CHECKS.held_share:
        return None
    apart = usual * float(np.median(np.diff(t)))
    return (
        f"it is new in every {usual:.0f}th row only, {apart:.3g} s apart, and repeated between: leave those rows "
        "empty, for a repeated reading is late"
    )


def _jump(problem: Problem, channel: Channel, t: np.ndarray, y: np.ndarray, model: np.ndarray) -> str | None:
    """Where readings are suddenly elsewhere, and neither they nor the model come near such a step otherwise."""
    apart = np.diff(t)
    steps = np.where(apart < CHECKS.hole * np.median(apart), np.abs(np.diff(y)), 0.0)
    k = int(np.argmax(steps))
    others = np.delete(steps, np.arange(max(k - 1, 0), min(k + 2, len(steps))))
    if not len(others) or not np.any(others):
        return None
    usual = max(float(np.abs(np.diff(model)).max()), float(np.percentile(others, 99.0)))
    least = CHECKS.jump_of_span * float(np.subtract(*np.percentile(y, CHECKS.tails)))
    if steps[k] < max(least, CHECKS.jump_over_steps * usual):
        return None
    after = y[k + 1 : k + 1 + CHECKS.jump_stays]
    if np.abs(after - y[k]).min() < 0.5 * steps[k]:  # a pulse
        return None
    shown = in_channel_unit(problem, channel, float(steps[k]))
    return (
        f"it jumps by {shown:.3g} {channel.unit} from one reading to the next at {t[k + 1]:.4g} s, where neither it "
        "nor the model moves so fast otherwise: were readings lost, or was the sensor stuck before?"
    )


def _longest(mask: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _slow(t: np.ndarray, grid: np.ndarray, model: np.ndarray) -> str | None:
    """Where the model does something between two readings."""
    span = float(np.ptp(model))
    interval = float(np.median(np.diff(t)))
    if span == 0.0 or interval <= 2.0 * float(grid[1] - grid[0]):
        return None
    inside = (grid >= t[0]) & (grid <= t[-1])
    missed = np.abs(model - np.interp(grid, t, np.interp(t, grid, model)))[inside]
    which = np.searchsorted(t, grid[inside], side="right")
    holes = np.diff(t)[np.clip(which - 1, 0, len(t) - 2)] > CHECKS.hole * interval
    affected = np.unique(which[(missed > CHECKS.slow_share * span) & ~holes])
    if len(affected) < max(CHECKS.slow_readings * len(t), 2.0):
        return None
    return (
        f"{len(affected)} times the model moves by more than {CHECKS.slow_share:.0%} of its span between two readings, "
        f"{interval:.3g} s apart: sampling is too slow for it"
    )


def _averaged(t: np.ndarray, y: np.ndarray) -> list[str]:
    """Where the diagnosis takes means over neighbours and loses what the channel does meanwhile."""
    most = DEFAULT.noise.max_samples
    times, means = average_neighbours(t, y, most)
    if len(means) == len(y):
        return []
    lost = y - np.interp(t, times.mean(1), means)
    noise = estimate_channel_noise(y, DEFAULT.noise, t)
    if rms(lost) < max(CHECKS.lost_by_averaging * float(y.std()), CHECKS.within_noise * noise):
        return []
    return [
        f"{len(y)} readings, of which the diagnosis takes {len(means)} means: they lose what it does; cut shorter runs"
    ]


def _noisier(problem: Problem, channel: Channel, t: np.ndarray, y: np.ndarray, model: np.ndarray) -> str | None:
    """Where a stated noise is far less than that of the readings, and a rough motion is not taken for noise."""
    if channel.noise_std is None:
        return None
    stated = channel.noise_std / unit(problem.units[channel.connector]).factor
    found = estimate_channel_noise(y, DEFAULT.noise, t)
    rough = estimate_channel_noise(model, DEFAULT.noise, t)
    if found < CHECKS.noisier_than_stated * np.hypot(stated, rough):
        return None
    shown = in_channel_unit(problem, channel, found)
    return f"its readings scatter by {shown:.3g} {channel.unit}, more than noise_std says"


def gaps(problem: Problem, nominal: np.ndarray) -> dict[int, float]:
    """RMS of the gap of each output, in noise standard deviations, by its number among the outputs."""
    made = {}
    for k in range(len(problem.campaign.outputs)):
        parts = [(b.y - nominal[b.place]) / b.noise_std for b in problem.observations.series if b.channel == k]
        if parts:
            made[k] = rms(np.concatenate(parts))
    return made


def _below_noise(problem: Problem, nominal: np.ndarray) -> list[Finding]:
    found = gaps(problem, nominal)
    if not found or any(x > CHECKS.below_noise for x in found.values()):
        return []
    return [Finding("", "", "the model as delivered misses nothing beyond the noise: there is no gap to diagnose")]
