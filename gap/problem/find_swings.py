"""Where a machine swings by itself, and the observations in which such stretches are compared as swings.

It swings where its readings stand out of their own trend by more than the noise, for some periods, at one frequency,
and do not keep pace with the model: what answers to the command keeps pace, however much it lags. What a measured
input drives at that frequency does not swing by itself either, however wrong the model's answer to it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import hilbert

from ..settings import SwingSettings
from .observations import Block, Observations
from .problem import Problem
from .swing import Swing, SwingFeature, crossing_frequency, hann_means, local_lines


class _Stretch(NamedTuple):
    """From when to when a signal stands out of its trend [s], and at which frequency, where it has one."""

    start: float
    end: float
    frequency: float | None

    def meets(self, other: _Stretch) -> bool:
        """Whether both have some time in common."""
        return self.start < other.end and other.start < self.end


Input = tuple[np.ndarray, np.ndarray]
"""Times (n,) [s] and values (n,)."""


def compare_swings(problem: Problem, nominal: np.ndarray) -> Problem:
    """The problem with what swings compared by trend, amplitude and frequency: the same one where nothing does.

    nominal: the prediction of the model as delivered (n,).
    """
    observations = problem.observations
    inputs = [list(r.inputs.values()) for r in problem.runs]
    swings = find_swings(observations, nominal, problem.settings.swings, inputs)
    if not any(swings):
        return problem
    return replace(problem, observations=_with_swings(observations, swings), recorded=observations)


def find_swings(
    observations: Observations, nominal: np.ndarray, settings: SwingSettings,
    inputs: Sequence[Sequence[Input]] = (),
) -> list[list[Swing]]:  # fmt: skip
    """The swings of every block; inputs: what was measured of those that drive each run.

    While one channel of a run swings at a frequency of its own, so does the machine: then others swing, too, that show
    several frequencies.
    """
    blocks = observations.blocks
    stretches = [_stretches(b, nominal[b.place], settings) for b in blocks]
    for b, block_stretches in zip(blocks, stretches, strict=True):
        block_stretches[:] = [
            x for x in block_stretches
            if not any(_drives(i, x, settings) for i in (inputs[b.run] if inputs else ()))
        ]  # fmt: skip
    swings: list[list[Swing]] = []
    for b, block_stretches in zip(blocks, stretches, strict=True):
        plain = [x for c, xs in zip(blocks, stretches, strict=True) if c.run == b.run for x in xs if x.frequency]
        swings.append([])
        for stretch in block_stretches:
            reference = next((x for x in plain if stretch.meets(x)), None)
            if reference is not None:
                swings[-1].append(_swing(observations, b, stretch, reference, settings))
    return swings


def _stretches(block: Block, model: np.ndarray, settings: SwingSettings) -> list[_Stretch]:
    """Where a block stands out of its trend and does not keep pace with the model, which reads (n,)."""
    if not block.is_series or len(block.t) < 3 or not 0.0 < 4.0 * block.interval < settings.window:
        return []
    grid = np.arange(block.t[0], block.t[-1], block.interval)
    trend = local_lines(grid, grid, settings.window)
    swinging = [x - trend @ x for x in (np.interp(grid, block.t, y) for y in (block.y, model))]
    out_of_step = (
        _stands_out(grid, swinging[0], block.noise_std, settings) & ~_keeps_pace(swinging, block.interval, settings)
    )  # fmt: skip
    lasting = _lasting(grid, out_of_step, settings)
    return [_Stretch(a, b, _dominant_frequency(grid, swinging[0], a, b, settings)) for a, b in lasting]


def _stands_out(t: np.ndarray, oscillation: np.ndarray, noise_std: float, settings: SwingSettings) -> np.ndarray:
    """Where the amplitude (n,) is beyond the noise."""
    squared = 2.0 * (hann_means(t, t, settings.window) @ oscillation**2 - noise_std**2)
    return np.asarray(squared > (settings.envelope_from * noise_std) ** 2)


def _keeps_pace(oscillations: Sequence[np.ndarray], interval: float, settings: SwingSettings) -> np.ndarray:
    """Where what swings in the readings does so in the model, with a phase that stays (n,)."""
    measured, model = (hilbert(x) for x in oscillations)
    size = max(1, round(settings.coherence_window / interval))

    def mean(x: np.ndarray) -> np.ndarray:
        return np.asarray(uniform_filter1d(x.real, size) + 1j * uniform_filter1d(x.imag, size))

    measured_power, model_power, cross_power = (
        mean(np.abs(measured) ** 2).real, mean(np.abs(model) ** 2).real, mean(measured * np.conj(model)),
    )  # fmt: skip
    follows = np.abs(cross_power) ** 2 > settings.coherent * measured_power * model_power
    return np.asarray(follows & (model_power > settings.own_share * measured_power))


def _lasting(t: np.ndarray, mask: np.ndarray, settings: SwingSettings) -> list[tuple[float, float]]:
    """From when to when a mask (n,) holds, short pauses closed, short stretches left out."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    spans: list[tuple[float, float]] = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        a, b = float(t[start]), float(t[end - 1])
        if spans and a - spans[-1][1] < settings.gap:
            spans[-1] = (spans[-1][0], b)
        else:
            spans.append((a, b))
    return [(a, b) for a, b in spans if b - a >= settings.least]


def _dominant_frequency(t: np.ndarray, x: np.ndarray, a: float, b: float, settings: SwingSettings) -> float | None:
    """The frequency [1/s] at which what swings, x (n,), does so from a to b; None where it has none of its own."""
    inside = (t >= a) & (t <= b)
    frequency = crossing_frequency(t[inside], x[inside], settings.crossing)
    interval = float(t[1] - t[0])
    if frequency is None or frequency * (b - a) < settings.cycles:
        return None
    if frequency * interval * settings.least_samples > 1.0:
        return None
    spectrum = np.abs(np.fft.rfft(x[inside] * np.hanning(int(inside.sum())))) ** 2
    near = np.abs(np.fft.rfftfreq(int(inside.sum()), interval) / frequency - 1.0) <= settings.narrow
    return frequency if spectrum[near].sum() >= settings.narrow_share * spectrum.sum() else None


def _drives(signal: Input, stretch: _Stretch, settings: SwingSettings) -> bool:
    """Whether an input has more of its energy at the frequency of a stretch, meanwhile, than what noise has there."""
    t, u = signal
    inside = (t >= stretch.start) & (t <= stretch.end)
    if stretch.frequency is None or inside.sum() < settings.cycles:
        return False
    grid = np.linspace(stretch.start, stretch.end, int(inside.sum()))
    x = np.interp(grid, t, u)
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) ** 2
    near = np.abs(np.fft.rfftfreq(len(x), grid[1] - grid[0]) / stretch.frequency - 1.0) <= settings.narrow
    return bool(spectrum[near].sum() > settings.driven_share * spectrum.sum())


def _swing(
    observations: Observations, block: Block, stretch: _Stretch, reference: _Stretch, settings: SwingSettings
) -> Swing:
    """A swing as far as its window looks; reference: a stretch of this or another channel of the run
    that has a single frequency."""
    a, b, frequency = stretch
    assert reference.frequency is not None
    window = min(max(settings.window, settings.periods / (frequency or reference.frequency)), b - a)
    half = 0.5 * window
    a, b = max(float(block.t[0]), a - half), min(float(block.t[-1]), b + half)
    near = (block.t >= a - half) & (block.t <= b + half)
    at = np.linspace(a, b, max(2, 1 + round((b - a) / half)))
    count = np.searchsorted(block.t, at + half, side="right") - np.searchsorted(block.t, at - half)
    density = count / (np.minimum(at + half, block.t[-1]) - np.maximum(at - half, block.t[0]))
    at = at[density >= 0.5 * np.median(density)]  # not in a hole of the readings
    noise = observations.noise_std[block.place][near]
    return Swing(block.t[near], at, window, noise, frequency, settings)


def _with_swings(observations: Observations, swings_of_blocks: Sequence[Sequence[Swing]]) -> Observations:
    """The observations with, of each block, the samples outside its swings, and what describes these."""
    blocks: list[Block] = []
    readings, noises, place = [], [], 0

    def add(block: Block, y: np.ndarray, t: np.ndarray, noise_std: np.ndarray, mask: np.ndarray) -> None:
        nonlocal place
        at = slice(place, place + len(y))
        members = None if block.members is None else block.members[mask]
        blocks.append(replace(block, t=t, y=y, place=at, members=members))
        readings.append(y)
        noises.append(noise_std)
        place = at.stop

    for b, swings in zip(observations.blocks, swings_of_blocks, strict=True):
        noise_std = observations.noise_std[b.place]
        outside = np.ones(len(b.t), bool)
        for swing in swings:
            outside &= (b.t < swing.at[0]) | (b.t > swing.at[-1])
        if outside.any():
            add(b, b.y[outside], b.t[outside], noise_std[outside], outside)
        for swing in swings:
            inside = np.isin(b.t, swing.t)
            y = b.y[inside]
            for quantity in swing.quantities:
                feature = SwingFeature(swing, quantity)
                values, noise = feature.observe(y, noisy=True), swing.noise_of(quantity, y)
                add(replace(b, feature=feature), values, feature.at, noise, inside)
    return replace(
        observations, blocks=tuple(blocks), y=np.concatenate(readings), noise_std=np.concatenate(noises),
        run=np.concatenate([np.full(len(b.t), b.run) for b in blocks]),
        channel=np.concatenate([np.full(len(b.t), b.channel) for b in blocks]),
        time=np.concatenate([b.t for b in blocks]),
    )  # fmt: skip


def as_compared(problem: Problem, samples: np.ndarray) -> np.ndarray:
    """The prediction (n,) of a problem's readings from one of all samples as they were recorded."""
    if problem.recorded is None:
        return samples
    whole = {(b.run, b.channel): b for b in problem.recorded.blocks if b.event is None}
    events = iter([samples[b.place] for b in problem.recorded.blocks if b.event is not None])
    vector = np.empty(len(problem.observations))
    for b in problem.observations.blocks:
        if b.event is not None:
            vector[b.place] = next(events)
            continue
        source = whole[b.run, b.channel]
        times = b.t if b.feature is None else b.feature.swing.t
        read = samples[source.place][np.isin(source.t, times)]
        vector[b.place] = read if b.feature is None else b.feature.observe(read)
    return vector
