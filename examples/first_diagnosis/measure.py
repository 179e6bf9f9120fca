"""Stands in for the test rig: three runs of a slide that rubs, as a logger would leave them in data/.

    python measure.py

The slide is a little heavier and softer than its model says, and dry friction of 0.4 N holds it, which the model knows
nothing of. Its equations are here, apart from the FMU's.
"""

from pathlib import Path

import numpy as np

MASS, STIFFNESS, DAMPING, FRICTION = 2.05, 78.5, 3.06, 0.4
NOISE, RATE, LENGTH = 0.2e-3, 50, 12.0
"""Of the position sensor [m]; readings a second; length of a run [s]."""


def push(t, seed):
    """A force [N] of fourteen frequencies up to 2 Hz."""
    rng = np.random.default_rng(seed)
    frequency = np.linspace(0.1, 2.0, 14)
    return 1.5 * np.sin(2.0 * np.pi * frequency * t[..., None] + rng.uniform(0.0, 2.0 * np.pi, 14)).sum(-1)


def run(payload, seed):
    """Times [s], forces [N] and positions [m] as they are read."""
    t = np.arange(round(LENGTH * RATE) + 1) / RATE
    force = push(t, seed)
    fine, x, v, position = 200, 0.0, 0.0, [0.0]
    h = 1.0 / RATE / fine
    for k in range(len(t) - 1):
        for i in range(fine):
            f = force[k] + (force[k + 1] - force[k]) * i / fine - STIFFNESS * x - DAMPING * v
            moved = v + h * f / (MASS + payload)
            slowed = h * FRICTION / (MASS + payload)  # dry friction stops it, and no more
            v = np.sign(moved) * max(abs(moved) - slowed, 0.0)
            x += h * v
        position.append(x)
    noise = np.random.default_rng(seed + 100).normal(0.0, NOISE, len(t))
    return t, force, np.array(position) + noise


if __name__ == "__main__":
    folder = Path("data")
    folder.mkdir(exist_ok=True)
    for seed, payload in enumerate((0, 1, 2), 1):
        t, force, position = run(float(payload), seed)
        table = np.column_stack([1e3 * t, force, 1e3 * position])
        target = folder / f"slide_payload={payload}kg.csv"
        np.savetxt(target, table, "%.6g", ",", header="Time [ms],Force [N],Pos [mm]", comments="")
        print(target)
