"""Where the gap lies: shares of the residual's energy by channel and region, frequency bands, change points.

Energy beyond the noise counts: a channel that only shows its noise has no share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..campaign.catalogue import Region
from ..problem.observations import Block
from ..problem.problem import Problem
from ..settings import AnalysisSettings


@dataclass(frozen=True)
class GapLocation:
    """A channel's part of the gap, and the region in which it is densest."""

    subsystem: str
    channel: str
    share: float
    region: str
    bands: dict[str, float]
    change_points: tuple[tuple[str, float], ...]
    """(run, time [s]) at which the residual changes its level."""


def excess_energy(residual: np.ndarray) -> np.ndarray:
    """Energy beyond the noise of normalised residuals, entry by entry; it may be negative."""
    return residual**2 - 1.0


def regions(
    problem: Problem, defined: Sequence[Region], record: Sequence[str], rows: Sequence[np.ndarray], step: float
) -> dict[str, np.ndarray]:
    """Masks (n,) by name: the regions of the catalogue, and halves of run conditions that differ."""
    observations = problem.observations
    masks: dict[str, np.ndarray] = {}
    columns = {name: k for k, name in enumerate(record)}
    for region in defined:
        if region.signal not in columns:
            continue
        mask = np.zeros(len(observations), bool)
        for b in observations.blocks:
            grid = problem.grid(b.run, step)
            x = rows[b.run][:, columns[region.signal]]
            x = np.gradient(x, step) if region.rate else x
            mask[b.place] = region.holds(np.interp(b.t, grid, x))
        masks[region.text] = mask
    masks.update(_conditions(problem))
    least = problem.settings.analysis.least_region
    return {name: mask for name, mask in masks.items() if least < mask.mean() < 1.0 - least}


def _conditions(problem: Problem) -> dict[str, np.ndarray]:
    """Runs above and below the middle of each known condition that differs between them."""
    masks = {}
    runs = problem.runs
    names = dict.fromkeys(name for conditions in runs for name in conditions.stated)
    for name in names:
        stated = [conditions.stated.get(name) for conditions in runs]
        values = [v for v in stated if isinstance(v, (int, float)) and not isinstance(v, bool)]
        if len(values) < len(stated):
            continue
        low, high = min(values), max(values)
        if low == high:
            continue
        middle = 0.5 * (low + high)
        above = np.array([v > middle for v in values])
        masks[f"{name} > {middle:g}"] = above[problem.observations.run]
        masks[f"{name} < {middle:g}"] = ~above[problem.observations.run]
    return masks


def describe(energy: np.ndarray, masks: Mapping[str, np.ndarray], settings: AnalysisSettings) -> str:
    """The regions, nested, in which energy (n,) is densest."""
    inside = np.ones(len(energy), bool)
    names: list[str] = []
    remaining = dict(masks)
    whole = max(float(energy.sum()), 0.0)
    while remaining and len(names) < settings.nested_regions and whole > 0.0:
        scored = []
        for name, mask in remaining.items():
            nested = inside & mask
            if nested.sum() < settings.least_nested * len(energy):
                continue
            share = float(energy[nested].sum()) / whole
            density = share / (nested.sum() / inside.sum())
            if share > settings.region_share and density > settings.region_density:
                scored.append((density * share, name, nested, share))
        if not scored:
            break
        _, name, inside, _ = max(scored, key=lambda s: s[0])
        whole = float(energy[inside].sum())
        names.append(name)
        remaining = {n: m for n, m in remaining.items() if n != name}
    return ", ".join(names) or "everywhere"


def bands(blocks: Sequence[Block], residual: np.ndarray, edges: Sequence[float]) -> dict[str, float]:
    """Shares of the residual's energy by frequency band; edges [Hz]."""
    limits = list(pairwise(edges))
    energy = np.zeros(len(limits))
    for b in blocks:
        if not b.is_series:
            continue
        e = residual[b.place]
        spacing = float(np.median(np.diff(b.t)))
        spectrum = np.abs(np.fft.rfft(e)) ** 2
        f = np.fft.rfftfreq(len(e), spacing)
        for i, (low, high) in enumerate(limits):
            energy[i] += spectrum[(f >= low) & (f < high)].sum()
    total = energy.sum() or 1.0
    return {
        f"{low:g}-{high:g} Hz" if np.isfinite(high) else f"> {low:g} Hz": float(e / total)
        for (low, high), e in zip(limits, energy, strict=True)
    }


def change_points(block: Block, residual: np.ndarray, settings: AnalysisSettings) -> list[float]:
    """Times [s] at which the level of a block's residual changes, the clearest first (PELT, Killick 2012)."""
    import ruptures

    if not block.is_series:
        return []
    e = residual[block.place]
    count = min(settings.change_point_bins, len(block.t) // 4)
    if count < settings.least_bins or np.sqrt(np.mean(e**2)) < settings.change_point_rms:
        return []
    length = (block.t[-1] - block.t[0]) / count
    place = np.minimum(((block.t - block.t[0]) / length).astype(int), count - 1)
    filled = np.bincount(place, minlength=count)
    means = np.bincount(place, e, minlength=count) / np.maximum(filled, 1)
    scale = max(float(np.std(means)), 1e-12)
    breaks = ruptures.Pelt(model="l2", min_size=5).fit(means / scale).predict(pen=2.0 * np.log(count))[:-1]
    steps = [abs(means[max(0, k - 5) : k].mean() - means[k : k + 5].mean()) for k in breaks]
    best = sorted(zip(steps, breaks, strict=True), reverse=True)[: settings.change_points]
    return sorted(float(block.t[0] + k * length) for _, k in best)


def localise(problem: Problem, residual: np.ndarray, masks: Mapping[str, np.ndarray]) -> list[GapLocation]:
    """The channels by their share of the energy beyond the noise; the shares add up to 1."""
    observations, settings = problem.observations, problem.settings.analysis
    measured, energies = [], []
    for k, label in enumerate(problem.labels):
        in_channel = observations.channel == k
        if in_channel.any():
            energies.append(max(0.0, float(excess_energy(residual[in_channel]).sum())))
            measured.append((k, label))
    total = sum(energies)
    locations = []
    for (k, label), energy in zip(measured, energies, strict=True):
        in_channel = observations.channel == k
        blocks = [b for b in observations.blocks if b.channel == k]
        share = energy / total if total > 0 else 1.0 / len(measured)
        inner = {name: mask[in_channel] for name, mask in masks.items()}
        region = (
            describe(np.maximum(excess_energy(residual[in_channel]), 0.0), inner, settings) if energy > 0 else "nowhere"
        )
        changes = [(problem.runs[b.run].name, t) for b in blocks for t in change_points(b, residual, settings)]
        subsystem = label.split(".", 1)[0]
        locations.append(
            GapLocation(subsystem, label, share, region, bands(blocks, residual, settings.bands), tuple(changes))
        )
    return sorted(locations, key=lambda p: -p.share)
