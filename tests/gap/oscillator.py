"""Measurements of an oscillator made with scipy, and the campaign that compares them with the toy FMU."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.toys import package

EFFECTS = """
[[base]]
parameter = "o.m"
tolerance = 0.05
[[base]]
parameter = "o.k"
tolerance = 0.05
[[base]]
parameter = "o.d"
tolerance = 0.05

[[effect]]
id = "friction"
text = "the slide rubs"
group = "force"
[[effect.parameter]]
address = "o.F_c"
neutral = 0
bounds = [0, 5]
prior = 0.3

[[effect]]
id = "cubic_spring"
text = "the spring stiffens"
group = "spring"
[[effect.parameter]]
address = "o.k3"
neutral = 0
bounds = [-2000, 2000]
prior = 100

[[effect]]
id = "force_gain"
text = "the force is more or less than commanded"
group = "force"
[[effect.parameter]]
address = "o.gain"
neutral = 1
bounds = [0.5, 1.5]
prior = 0.1

[[sensor]]
id = "sensor_delay"
text = "a sensor's samples arrive late"
group = "timing"
quantity = "delay"
neutral = 0.0
bounds = [0.0, 0.1]
prior = 0.015

[[region]]
text = "moving out"
signal = "o.v"
above = 0.01

[[experiment]]
parameter = "o.m"
values = [1, 4]
"""

FORCE, PLACE = "u", "x"
STOP, RATE = 12.0, 50.0


def pushed(t: np.ndarray, seed: int) -> np.ndarray:
    """A smooth broad-band force [N]."""
    rng = np.random.default_rng(seed)
    f = np.linspace(0.1, 2.0, 14)
    phase = rng.uniform(0, 2 * np.pi, len(f))
    return 1.5 * np.sin(2 * np.pi * f * np.asarray(t)[..., None] + phase).sum(-1)


def measure(
    seed: int, extra: Callable[[float, float, float], float], m: float = 2.05, k: float = 78.0, d: float = 3.1,
    push: Callable[[np.ndarray, int], np.ndarray] = pushed,
) -> np.ndarray:  # fmt: skip
    """Columns time, u, x of a machine whose unmodelled force is extra(t, x, v)."""
    t = np.arange(round(STOP * RATE) + 1) / RATE
    u = push(t, seed)

    def rate(s: float, y: np.ndarray) -> list[float]:
        return [y[1], (np.interp(s, t, u) - k * y[0] - d * y[1] + extra(s, y[0], y[1])) / m]

    y = solve_ivp(rate, (0.0, STOP), [0.0, 0.0], "LSODA", t, rtol=1e-8, atol=1e-10, max_step=0.01).y
    x = y[0] + np.random.default_rng(seed + 100).normal(0.0, 2e-4, len(t))
    return np.column_stack([t, u, x])


def campaign(folder: Path, toys: Path, runs: list[np.ndarray], head: str = "", more: str = "", effects: str = ""
             ) -> Path:  # fmt: skip
    """Write package, catalogue, run files and campaign.toml into the folder; returns the latter."""
    package(folder / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=STOP, step=1e-3)
    (folder / "effects.toml").write_text(EFFECTS + effects)
    text = 'name = "toy"\nsystem = "toy.ssp"\neffects = "effects.toml"\n' + head
    text += '[[channel]]\ncolumn = "u"\nconnector = "o.u"\nunit = "N"\nrole = "input"\n'
    text += '[[channel]]\ncolumn = "x"\nconnector = "o.x"\nunit = "mm"\nnoise_std = 0.2\n'
    for i, run in enumerate(runs):
        table = run * np.array([1.0, 1.0, 1e3])
        np.savetxt(folder / f"run{i}.csv", table, "%.9g", ",", header="time,u,x", comments="")
        text += f'[[run]]\nfile = "run{i}.csv"\n'
    path = folder / "campaign.toml"
    path.write_text(text + more)
    return path
