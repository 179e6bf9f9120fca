"""Runs of a servo joint with a weight on a rod: it follows three targets, and falls once with its motor off.

A target is sent some milliseconds before the joint is read, at times that the records do not tell; it was found from
the targets' formulas. The servo holds it until the next one. The joint's reading is one of 4096 a turn. One target asks
for more speed than the motor has; that run is learned from, for no other one shows what the motor does then. Of the
fall, the way to the other side and back is learned from and the swings after it are held out.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from .package import Channel, Measured, Run

FOLDER = "bam_sts3250"
TURNS = 3.0
"""When the falling weight has come to the other side and back, in its record [s]. One of these ways alone does not tell
viscous from dry friction: both take half of the amplitude of the first."""

RECORDS = (
    ("up_and_down", "2024-10-26_12h27m27.json", "fit", (0.0, np.inf)),
    ("sine_of_squared_time", "2024-10-26_12h24m55.json", "fit", (0.0, np.inf)),
    ("fall", "2024-10-26_12h23m42.json", "fit", (0.0, TURNS)),
    ("two_sines", "2024-10-26_12h23m27.json", "holdout", (0.0, np.inf)),
    ("swings_after_fall", "2024-10-26_12h23m42.json", "holdout", (TURNS, np.inf)),
)
"""Name, file, use, and the part of its time in which the joint's readings count [s]."""

SENT = 0.0135
"""How long before a reading its target was sent [s]."""

JITTER = 1e-3
"""How far the time of a reading may be off [s]: the records tell when a reading was asked for, every 15 to 38 ms."""

STEP = 1e-3
"""Macro step [s]."""

TICK = 2.0 * np.pi / 4096
EDGE = 1e-4
"""Time in which a target, or the motor, changes [s]."""


def _run(path: Path, name: str, use: str, part: tuple[float, float]) -> Run:
    record = json.loads(path.read_text())
    if (record["mass"], record["length"]) != (1.13, 0.12):
        raise ValueError(f"{path}: another weight or rod than the model's")
    entries = [e for e in record["entries"] if e["timestamp"] < part[1]]
    read = np.array([e["timestamp"] for e in entries])
    sent = np.round((read - SENT) / STEP) * STEP  # a macro step of any length that divides it meets each target
    goal = np.array([e["goal_position"] for e in entries])
    on = np.array([float(e["torque_enable"]) for e in entries])
    q = np.array([e["position"] if e["timestamp"] >= part[0] else np.nan for e in entries])
    times = np.concatenate([read, sent, sent[1:] - EDGE])
    order = np.argsort(times, kind="stable")
    times = times[order]
    reading = np.concatenate([q, np.full(len(times) - len(q), np.nan)])[order]
    held = np.searchsorted(sent, times + 1e-9, "right") - 1
    columns = {"time": times - times[0], "goal": goal[held], "on": on[held], "q": reading}
    return Run(name, columns, {}, use)


def measured(folder: Path) -> Measured:
    """The runs in the data folder."""
    runs = [_run(folder / FOLDER / file, name, use, part) for name, file, use, part in RECORDS]
    channels = (
        Channel("goal", "joint.goal", "rad", "input"), Channel("on", "joint.on", "1", "input"),
        Channel("q", "joint.q", "rad", noise_std=TICK, clock_jitter=JITTER),
    )  # fmt: skip
    return Measured("servo_joint", "joint", STEP, channels, runs)
