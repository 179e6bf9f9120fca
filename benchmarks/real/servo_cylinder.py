"""Runs of the servo cylinder: strokes out and in at five voltages, means of repeats 1 to 3 (fit), 4 and 5 (held out).

The records have pressure A or pressure B, never both. After alignment at the command's step they repeat within
0.02 MPa, so the mean of some pA records and that of the pB records with the same numbers make one run, in which
F = pA A1 - pB A2 is a measured quantity. Force and pressure count in the inner part of the stroke only, where no stop
holds the piston and its break-away is over; the position counts wherever its sensor reaches.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FILE = "servo_cylinder_16x10_1kHz.npz"
A1, A2 = np.pi / 4 * 16e-3**2, np.pi / 4 * (16e-3**2 - 10e-3**2)
"""Areas of the piston, rod side without the rod [m2]."""

X_PER_VOLT = 0.02
SATURATED = 9.99
"""Position sensor [m/V], and the reading where it ends [V]."""

X_STOPS = {1: 0.00555, -1: 0.20205}
"""Where a stroke begins [m], by direction: the stops, one as measured, the other as found past the sensor's end."""

LEAD = 80
WINDOW = 20
"""Samples (of 1 ms) before the command's step, and in a mean."""

INNER = {1: (0.03, 0.17), -1: (0.055, 0.165)}
"""Where force and pressure count [m], by direction; a run ends where the piston leaves this on the far side."""

REPEATS = {"fit": (1, 2, 3), "holdout": (4, 5)}


def _means(signal: np.ndarray) -> np.ndarray:
    n = signal.shape[-1] // WINDOW
    return signal[..., : n * WINDOW].reshape(*signal.shape[:-1], n, WINDOW).mean(-1)


def _stroke(data: dict[str, np.ndarray], volts: int, direction: int) -> dict[str, np.ndarray]:
    """Position [m] and pressure [Pa] of all records of one stroke, (5, n) each, aligned at the command's step."""
    made: dict[str, np.ndarray] = {}
    for side in "AB":
        records = [data[f"p{side}_{volts}V_{r}"].astype(float) for r in range(1, 6)]
        begins = [int(np.argmax(direction * a[:, 2] > 0.5 * volts)) - LEAD for a in records]
        length = min(len(a) - k for a, k in zip(records, begins, strict=True))
        cut = np.array([a[k : k + length] for a, k in zip(records, begins, strict=True)])
        x = np.where(cut[:, :, 0] > SATURATED, np.nan, cut[:, :, 0])
        made[f"x{side}"], made[f"p{side}"] = _means(x) * X_PER_VOLT, _means(cut[:, :, 1]) * 1e6
    length = min(a.shape[1] for a in made.values())
    return {k: a[:, :length] for k, a in made.items()}


def _free(x: np.ndarray, direction: int) -> np.ndarray:
    """Where force and pressure count, of positions x (n,) [m] of which some are NaN."""
    low, high = INNER[direction]
    return (np.nan_to_num(x) > low) & (np.nan_to_num(x) < high)


def _scatter(stroke: dict[str, np.ndarray], direction: int) -> dict[str, np.ndarray]:
    """Variance over the repeats at each time at which force and pressure count, in SI."""
    x = np.concatenate([stroke["xA"], stroke["xB"]])
    keep = _free(x.mean(0), direction)
    a, b = (stroke[k].var(0, ddof=1)[keep] for k in ("pA", "pB"))
    return {"x": x.var(0, ddof=1)[keep], "pB": b, "F": a * A1**2 + b * A2**2}


def _run(stroke: dict[str, np.ndarray], volts: int, direction: int, use: str) -> Run:
    some = {k: a[[r - 1 for r in REPEATS[use]]] for k, a in stroke.items()}
    x = np.concatenate([some["xA"], some["xB"]]).mean(0)  # NaN as soon as one record saturates
    pA, pB = some["pA"].mean(0), some["pB"].mean(0)
    low, high = INNER[direction]
    end = int(np.argmax(x > high if direction > 0 else x < low))
    before = LEAD // WINDOW - 1  # the last mean before the step
    known, free = np.arange(len(x)) >= before, _free(x, direction)
    t = (np.arange(len(x)) + 0.5) * WINDOW * 1e-3
    columns = {
        "time": t,
        "u": np.where(t < LEAD * 1e-3, 0.0, direction * float(volts)),
        "x": np.where(known, x, np.nan) * 1e3,
        "pA": np.where(free, pA, np.nan) / 1e6,
        "pB": np.where(free, pB, np.nan) / 1e6,
        "F": np.where(free, pA * A1 - pB * A2, np.nan),
    }
    # the step of u happens at one time, which lies on the model's grid
    edge = {"time": [LEAD * 1e-3 - 1e-4, LEAD * 1e-3], "u": [0.0, direction * float(volts)]}
    for name, values in columns.items():
        columns[name] = np.insert(values[:end], before + 1, edge.get(name, [np.nan, np.nan]))
    parameters = {
        "cylinder.x0": X_STOPS[direction],
        "cylinder.pA0": round(float(pA[before]), -3),
        "cylinder.pB0": round(float(pB[before]), -3),
    }
    return Run(f"{volts}V_{'out' if direction > 0 else 'in'}_{use}", columns, parameters, use)


def _disagreement(data: dict[str, np.ndarray]) -> float:
    """RMS difference of the two pressure sensors where both see the supply or both the tank, at the stops [Pa]."""
    differences = []
    for volts in range(1, 6):
        levels = {}
        for side in "AB":
            records = [data[f"p{side}_{volts}V_{r}"].astype(float) for r in range(1, 6)]
            back = [int(np.argmax(-a[:, 2] > 0.5 * volts)) for a in records]
            out = np.mean([a[k - 500 : k - 120, 1].mean() for a, k in zip(records, back, strict=True)])
            levels[side] = np.array([out, np.mean([a[-500:, 1].mean() for a in records])])
        differences.append(levels["A"] - levels["B"][::-1])
    return float(np.sqrt(np.mean(np.square(differences)))) * 1e6


def measured(folder: Path) -> Measured:
    """The runs in the data folder."""
    with np.load(folder / FILE) as archive:
        data = {k: archive[k] for k in archive.files}
    runs, scatter = [], []
    for volts in range(1, 6):
        for direction in (1, -1):
            stroke = _stroke(data, volts, direction)
            runs += [_run(stroke, volts, direction, use) for use in REPEATS]
            scatter.append(_scatter(stroke, direction))
    noise = {k: float(np.sqrt(np.nanmean(np.concatenate([v[k] for v in scatter])))) for k in scatter[0]}
    channels = (
        Channel("u", "cylinder.u", "V", "input"),
        Channel("x", "cylinder.x", "mm", noise_std=noise["x"] * 1e3),
        Channel("pB", "cylinder.pB", "MPa", noise_std=np.hypot(noise["pB"], _disagreement(data)) / 1e6),
        Channel("F", "cylinder.F", "N", noise_std=noise["F"]),
    )
    return Measured("servo_cylinder", "cylinder", 0.01, channels, runs)
