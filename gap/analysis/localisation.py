"""Where the gap lies: shares of the residual's energy by channel and region, frequency bands, change points.

Energy beyond the floor counts: a channel that only shows its noise has no share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..campaign.catalogue import Region
from ..problem.observations import Block
from ..problem.problem import Problem

BANDS = ((0.0, 0.5), (0.5, 5.0), (5.0, 25.0), (25.0, np.inf))
"""Frequency bands [Hz]."""

BINS = 200
"""Stretches of a run among which change points are looked for."""


@dataclass(frozen=True)
class Place:
    """A channel's part of the gap, and the region in which it is densest."""

    subsystem: str
    channel: str
    share: float
    region: str
    bands: dict[str, float]
    changes: tuple[tuple[str, float], ...]
    """(run, time [s]) at which the residual changes its level."""


def excess(residual: np.ndarray) -> np.ndarray:
    """Energy beyond the floor of whitened residuals, entry by entry; it may be negative."""
    return residual**2 - 1.0


def regions(problem: Problem, defined: Sequence[Region], record: Sequence[str], rows: Sequence[np.ndarray], step: float
            ) -> dict[str, np.ndarray]:  # fmt: skip
    """Masks (n,) by name: the regions of the catalogue, and halves of run conditions that differ."""
    obs = problem.obs
    made: dict[str, np.ndarray] = {}
    columns = {name: k for k, name in enumerate(record)}
    for region in defined:
        if region.signal not in columns:
            continue
        mask = np.zeros(len(obs), bool)
        for b in obs.blocks:
            grid = problem.grid(b.run, step)
            x = rows[b.run][:, columns[region.signal]]
            x = np.gradient(x, step) if region.rate else x
            mask[b.place] = region.holds(np.interp(b.t, grid, x))
        made[region.text] = mask
    made.update(_conditions(problem))
    return {name: mask for name, mask in made.items() if 0.02 < mask.mean() < 0.98}


def _conditions(problem: Problem) -> dict[str, np.ndarray]:
    """Runs above and below the middle of each known condition that differs between them."""
    made = {}
    runs = problem.runs
    names = dict.fromkeys(name for info in runs for name in info.changes)
    for name in names:
        values = [info.changes.get(name) for info in runs]
        if any(not isinstance(v, (int, float)) or isinstance(v, bool) for v in values):
            continue
        low, high = min(values), max(values)
        if low == high:
            continue
        middle = 0.5 * (low + high)
        above = np.array([v > middle for v in values])
        made[f"{name} > {middle:g}"] = above[problem.obs.run]
        made[f"{name} < {middle:g}"] = ~above[problem.obs.run]
    return made


def describe(energy: np.ndarray, masks: Mapping[str, np.ndarray], most: int = 3) -> str:
    """The regions, nested, in which energy (n,) is densest."""
    inside = np.ones(len(energy), bool)
    names: list[str] = []
    left = dict(masks)
    whole = max(float(energy.sum()), 0.0)
    while left and len(names) < most and whole > 0.0:
        scored = []
        for name, mask in left.items():
            both = inside & mask
            if both.sum() < 0.03 * len(energy):
                continue
            share = float(energy[both].sum()) / whole
            density = share / (both.sum() / inside.sum())
            if share > 0.6 and density > 1.15:
                scored.append((density * share, name, both, share))
        if not scored:
            break
        _, name, inside, _ = max(scored, key=lambda s: s[0])
        whole = float(energy[inside].sum())
        names.append(name)
        left = {n: m for n, m in left.items() if n != name}
    return ", ".join(names) or "everywhere"


def bands(blocks: Sequence[Block], residual: np.ndarray) -> dict[str, float]:
    """Shares of the residual's energy by frequency band."""
    energy = np.zeros(len(BANDS))
    for b in blocks:
        if b.moment is not None:
            continue
        e = residual[b.place]
        spacing = float(np.median(np.diff(b.t)))
        spectrum = np.abs(np.fft.rfft(e)) ** 2
        f = np.fft.rfftfreq(len(e), spacing)
        for i, (low, high) in enumerate(BANDS):
            energy[i] += spectrum[(f >= low) & (f < high)].sum()
    total = energy.sum() or 1.0
    return {
        f"{low:g}-{high:g} Hz" if np.isfinite(high) else f"> {low:g} Hz": float(e / total)
        for (low, high), e in zip(BANDS, energy, strict=True)
    }


def change_points(block: Block, residual: np.ndarray, most: int = 4) -> list[float]:
    """Times [s] at which the level of a block's residual changes, the clearest first (PELT, Killick 2012)."""
    import ruptures

    if block.moment is not None:
        return []
    e = residual[block.place]
    count = min(BINS, len(block.t) // 4)
    if count < 20 or np.sqrt(np.mean(e**2)) < 1.3:
        return []
    long = (block.t[-1] - block.t[0]) / count
    place = np.minimum(((block.t - block.t[0]) / long).astype(int), count - 1)
    filled = np.bincount(place, minlength=count)
    means = np.bincount(place, e, minlength=count) / np.maximum(filled, 1)
    scale = max(float(np.std(means)), 1e-12)
    found = ruptures.Pelt(model="l2", min_size=5).fit(means / scale).predict(pen=2.0 * np.log(count))[:-1]
    steps = [abs(means[max(0, k - 5) : k].mean() - means[k : k + 5].mean()) for k in found]
    best = sorted(zip(steps, found, strict=True), reverse=True)[:most]
    return sorted(float(block.t[0] + k * long) for _, k in best)


def places(problem: Problem, residual: np.ndarray, masks: Mapping[str, np.ndarray]) -> list[Place]:
    """The channels by their share of the energy beyond the floor; the shares add up to 1."""
    obs = problem.obs
    made, energies = [], []
    for k, label in enumerate(problem.labels):
        mine = obs.channel == k
        if mine.any():
            energies.append(max(0.0, float(excess(residual[mine]).sum())))
            made.append((k, label))
    total = sum(energies)
    found = []
    for (k, label), energy in zip(made, energies, strict=True):
        mine = obs.channel == k
        blocks = [b for b in obs.blocks if b.channel == k]
        share = energy / total if total > 0 else 1.0 / len(made)
        inner = {name: mask[mine] for name, mask in masks.items()}
        region = describe(np.maximum(excess(residual[mine]), 0.0), inner) if energy > 0 else "nowhere"
        changes = [(problem.runs[b.run].name, t) for b in blocks for t in change_points(b, residual)]
        subsystem = label.split(".", 1)[0]
        found.append(Place(subsystem, label, share, region, bands(blocks, residual), tuple(changes)))
    return sorted(found, key=lambda p: -p.share)
