"""Draws cases: everything comes from one random generator made of (seed, index), so a case is reproducible from these
and the benchmark's edition alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import effect_forms
from .case import BASE, Case, Conditions, Wrong
from .effects import Effect, known, sensors, unknown
from .measure import DELAY_MOST, Channel, draw_channels
from .plant import PlantError
from .ruler import LARGEST, SMALLEST, Ruler

KINDS_OF_CASE = {
    1: {"none": 0.2, "single": 0.4, "pair": 0.2, "unknown": 0.2},
    2: {"none": 0.2, "single": 0.4, "pair": 0.17, "triple": 0.08, "unknown": 0.15},
    3: {"none": 0.2, "single": 0.4, "pair": 0.17, "triple": 0.08, "unknown": 0.15},
}
"""Shares of the kinds by edition: since the second, three effects are among them, and a third of the effects is in
another form than the plain one; since the third, effects that the catalogue has learnt count among its own."""
COUNT = {"none": 0, "single": 1, "pair": 2, "triple": 3, "unknown": 1}
"""Number of effects."""
LATEST = 3
"""The edition that is made unless another one is asked for."""


def draw_conditions(rng: np.random.Generator, rate: float) -> Conditions:
    """Conditions of a run; rounded, as a log of a test would give them."""
    depth = 0.0 if rng.random() < 0.12 else float(np.round(rng.uniform(0.0, 11000.0), -2))
    ramp = round(float(rng.uniform(3.5, 8.0)), 1)
    start = round(float(rng.uniform(1.0, 2.0)), 1)
    hold = round(float(rng.uniform(1.5, min(5.0, 22.5 - start - 2 * ramp))), 1)
    stop = min(24.0, max(18.0, start + 2 * ramp + hold + round(float(rng.uniform(1.0, 3.0)), 1)))
    return Conditions(
        depth,
        round(float(rng.uniform(500.0, 1000.0)), 0),
        round(float(rng.uniform(0.1, 0.9)), 2),
        round(float(rng.uniform(0.1, 0.2)), 3),
        start, ramp, hold, round(stop, 1), rate,
    )  # fmt: skip


def _pick(rng: np.random.Generator, pool: tuple[Effect, ...], channels: tuple[Channel, ...], edition: int) -> Wrong:
    effect = pool[int(rng.integers(len(pool)))]
    sign = effect.draw_sign(rng)
    column = None
    if effect in sensors(edition):
        column = channels[int(rng.integers(len(channels)))].kind.key
    elif effect.knob == "wave":
        column = "x_h"
    shapes = effect.draw_shapes(rng)
    form = effect_forms.draw(rng, effect, sign) if edition > 1 else None
    if form is not None:
        shapes |= form.draw(rng)
    return Wrong(effect, sign, shapes, 0.0, column, form=form)


def _pool(kind: str, edition: int) -> tuple[Effect, ...]:
    return unknown(edition) if kind == "unknown" else tuple(e for e in known(edition) if e.drawn)


def plan(seed: int, index: int, edition: int = LATEST) -> tuple[Case, np.random.Generator]:
    """The case of that index, still without anything wrong, and the generator to go on with."""
    rng = np.random.default_rng([seed, index])
    kinds = KINDS_OF_CASE[edition]
    kind = str(rng.choice(list(kinds), p=list(kinds.values())))
    channels = draw_channels(rng)
    count = int(rng.choice([1, 2, 3, 4], p=[0.35, 0.25, 0.25, 0.15]))
    rate = float(rng.choice([50.0, 100.0, 200.0], p=[0.25, 0.5, 0.25]))
    runs = tuple(draw_conditions(rng, rate) for _ in range(count))
    tolerance = 0.05 if rng.random() < 0.7 else 0.10
    factors = {address: float(1.0 + rng.uniform(-tolerance, tolerance)) for address in BASE}
    delay, stated = float(rng.uniform(0.0, DELAY_MOST)), bool(rng.random() < 0.5)
    case = Case(seed, index, kind, runs, channels, delay, tolerance, factors, stated, edition=edition)
    return case, rng


def draw(seed: int, index: int, refit: bool = True, edition: int = LATEST) -> Case:
    """The case of that index; refit: sizes are what the best refit leaves, else, which takes no time, what a linear one
    does."""
    case, rng = plan(seed, index, edition)
    needed = COUNT[case.kind]
    if needed == 0:
        return case
    ruler = Ruler(case)
    wrong: tuple[Wrong, ...] = ()
    for _ in range(40):
        wanted = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
        trial = _pick(rng, _pool(case.kind, edition), case.channels, edition)
        if any(trial.effect.group == w.effect.group for w in wrong):
            continue
        scaled = _visible(ruler, trial, wanted, refit, case.notes)
        if scaled is None:
            continue
        size = scaled.size_linear
        if wrong:
            try:
                size, _ = ruler.sizes((*wrong, scaled))
            except PlantError:
                case.notes.append(f"{trial.effect.id} stops the machine")
                continue
            if size > 10 * LARGEST:
                continue
        wrong = (*wrong, scaled)
        if len(wrong) == needed:
            return replace(case, wrong=wrong, size_all=size)
    raise PlantError(f"case {index} of seed {seed}: no effect could be made visible")


def _visible(ruler: Ruler, trial: Wrong, wanted: float, refit: bool, notes: list[str]) -> Wrong | None:
    """The effect with its amplitude and sizes; None, and a note, where it is nothing wrong to a refit."""
    scaled = ruler.scaled(trial, wanted)
    if scaled is None:
        notes.append(f"{trial.effect.id} cannot be seen in this case")
        return None
    scaled = replace(scaled, size=ruler.size((scaled,), 0.9 * SMALLEST) if refit else scaled.size_linear)
    if scaled.size <= 0.9 * SMALLEST:
        notes.append(f"{trial.effect.id} is within the tolerance of the base parameters in this case")
        return None
    return scaled
