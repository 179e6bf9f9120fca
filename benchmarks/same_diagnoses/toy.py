"""Campaigns of an oscillator, an FMU of plain pythonfmu; scipy makes the measurements. See tests/gap/oscillator.py."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.gap import oscillator

from .made import Made, edit

Array = NDArray[np.float64]
Force = Callable[[float, float, float], float]
"""An unmodelled force [N] from t [s], x [m], v [m/s]."""

SAMPLES = 251
"""Samples of a run: 5 s are enough, and twelve take long."""

DAMPER = """id = "damper"
text = "the damper has lost its oil"
group = "force"
[[effect.parameter]]
address = "o.d"
neutral = {d!r}
bounds = [0, 30]
prior = {prior!r}
"""
"""An effect in place of force_gain."""


def rubs(t: float, x: float, v: float) -> float:
    """Friction, as small as what a refit of the base parameters leaves."""
    return float(-0.06 * np.tanh(v / 0.01))


def nothing(t: float, x: float, v: float) -> float:
    """No force beyond the model's."""
    return 0.0


def knocks(t: float, x: float, v: float) -> float:
    """A force at one place, which the catalogue does not know."""
    return -2.0 if 0.01 < x < 0.02 else 0.0


def friction(folder: Path, made: Made) -> None:
    """Two runs of a machine that rubs and whose base parameters are far off: fits from the delivered model, too."""
    runs = [oscillator.measure(seed, rubs, m=1.92, k=83.5, d=2.87)[:SAMPLES] for seed in (12, 13)]
    oscillator.campaign(folder, made.toys, runs)


def no_effect(folder: Path, made: Made) -> None:
    """Two runs that a refit of the base parameters explains."""
    oscillator.campaign(folder, made.toys, [oscillator.measure(seed, nothing)[:SAMPLES] for seed in (3, 4)])


def unknown(folder: Path, made: Made) -> None:
    """What the catalogue does not know."""
    oscillator.campaign(folder, made.toys, [oscillator.measure(seed, knocks)[:SAMPLES] for seed in (5, 6)])


def late_sensor(folder: Path, made: Made) -> None:
    """A sensor that is late, and whose noise is not stated."""
    run = oscillator.measure(9, nothing)[:SAMPLES]
    run[:, 2] = np.interp(run[:, 0] - 0.02, run[:, 0], run[:, 2])
    path = oscillator.campaign(folder, made.toys, [run])
    edit(path, ("noise_std = 0.2\n", ""))


def _noisy(run: Array, seed: int, noise: float) -> Array:
    """A run with more noise [mm]."""
    spread = np.random.default_rng(seed).normal(0.0, 1e-3 * noise, len(run))
    return run + np.outer(spread, [0.0, 0.0, 1.0])


def _damped(folder: Path, made: Made, runs: Sequence[Array], known: str, noise: float, d: float, prior: float) -> None:
    """A campaign whose last run is held out; its catalogue knows a lost damper, and no tolerance of `o.d` [N s/m]."""
    stated = f"parameters = {{ {known} }}\n"
    path = oscillator.campaign(folder, made.toys, list(runs), more=f'use = "holdout"\n{stated}')
    edit(path, ("noise_std = 0.2", f"noise_std = {noise}"), ('file = "run0.csv"\n', f'file = "run0.csv"\n{stated}'))
    catalogue = oscillator.EFFECTS.split("[[effect]]\n")
    known_effects = [part for part in catalogue[1:] if not part.startswith('id = "force_gain"')]
    tail = "[[sensor]]" + catalogue[-1].partition("[[sensor]]")[2]
    head = catalogue[0].replace('[[base]]\nparameter = "o.d"\ntolerance = 0.05\n', "")
    effects = [*known_effects, DAMPER.format(d=d, prior=prior) + tail]
    (folder / "effects.toml").write_text("[[effect]]\n".join([head, *effects]), encoding="utf-8")


def holdout(folder: Path, made: Made) -> None:
    """A damper without oil: the machine swings where it did not, so fits take shorter macro steps than the model."""
    runs = [oscillator.measure(seed, lambda t, x, v: 19.9 * v, m=2.0, k=80.0, d=20.0) for seed in (11, 14)]
    noisy = [_noisy(run, seed, 1.4) for seed, run in enumerate(runs)]
    _damped(folder, made, noisy, '"o.d" = 20.0', 1.4, 20.0, 5.0)


def large(folder: Path, made: Made) -> None:
    """A large effect beside an unknown one, four times as fast, for a long macro step to be too long for it."""

    def force(t: float, x: float, v: float) -> float:
        return 16.0 * v - (2.0 if 0.02 < x < 0.03 else 0.0)

    runs = [oscillator.measure(seed, force, m=2.0, k=200.0, d=20.0) for seed in (11, 14)]
    fast = [_noisy(run, seed, 1.2) * [0.25, 1.0, 1.0] for seed, run in enumerate(runs)]
    _damped(folder, made, fast, '"o.m" = 0.125, "o.d" = 5.0, "o.k" = 200.0', 1.2, 5.0, 0.5)
