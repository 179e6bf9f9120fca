"""A diagnosis of every verdict, made by hand after the contract of diagnosis.json, and signals that go with it."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from math import sqrt
from typing import Any

import numpy as np
from deepsea_cosim.gap.report.signals import (
    Channel,
    Condition,
    Dependence,
    InputTrace,
    MeanCurve,
    RunSignals,
    Signals,
    Trace,
)

VERDICTS = ("explained", "explained_in_part", "no_significant_gap", "unexplained")

NASTY = 'pool <script>alert("1")</script> & \x1b[31m \u202e test'


def effect(group: str, effects: dict[str, float], share: float, **more: Any) -> dict[str, Any]:
    """A part of the budget."""
    name = next(iter(effects))
    ids = [e for e in effects if effects[e] >= 0.1]
    return {
        "kind": "effect", "group": group, "effects": ids, "text": {e: f"text of {e}" for e in ids}, "share": share,
        "ci95": [max(0.0, share - 0.06), min(1.0, share + 0.04)], "inclusion_probability": 0.99, "minor": share < 0.05,
        "within_group": effects, "form": None,
        "parameters": {f"hydraulics.effect.{name}.F_extra": parameter(510.0, 430.0, 600.0)},
        **more,
    }  # fmt: skip


def parameter(value: float, low: float, high: float, unit: str = "N", at_bound: bool = False) -> dict[str, Any]:
    """A fitted parameter of an effect."""
    return {"value": value, "ci95": [low, high], "unit": unit, "at_bound": at_bound}


def unexplained(share: float, rms: float) -> dict[str, Any]:
    """The part that no effect of the catalogue explains."""
    said = "mostly in arm.x_h (71 %), while the cylinder extends; varies most with the pressure P1; 2 to 5 Hz"
    return {
        "kind": "unexplained", "share": share, "ci95": [0.9 * share, min(1.0, 1.1 * share)], "rms": rms,
        "character": said, "nearest": ["valve_leakage"],
    }  # fmt: skip


DRIFT = {"id": "drift", "share": 0.05, "inclusion_probability": 0.9}
LANDS = {"id": "unequal_lands", "share": 0.09, "inclusion_probability": 0.93}
FRICTION = {"cylinder_stribeck_friction": 0.81, "cylinder_coulomb_friction": 0.18}
PARTS = {
    "explained": [
        effect("friction", FRICTION, 0.70),
        effect("timing", {"sensor_delay": 1.0}, 0.27, form=DRIFT),
        effect("supply", {"supply_droop": 1.0}, 0.03),
    ],
    "explained_in_part": [
        effect("friction", FRICTION, 0.62),
        effect("spool", {"valve_dead_zone": 1.0}, 0.21, form=LANDS),
        effect("timing", {"sensor_delay": 1.0}, 0.03),
        unexplained(0.14, 3.7),
    ],
    "no_significant_gap": [],
    "unexplained": [unexplained(1.0, 9.7)],
}  # fmt: skip

LEVELS = {
    "explained": (23.4, 8.9, 1.0),
    "explained_in_part": (14.2, 9.7, 3.7),
    "no_significant_gap": (6.2, 1.02, 1.02),
    "unexplained": (14.2, 9.7, 9.7),
}

HEADLINES = {
    "explained": "The stroke takes 2.6 s longer than the model says; friction of the piston makes 2.1 s of that.",
    "explained_in_part": "Calibration within the tolerances brings the gap from 14.2 to 9.7 times the noise; of that, "
    "friction of the piston makes 62 % (56 to 66 %), 14 % is in no effect of the catalogue.",
    "no_significant_gap": "Calibration within the tolerances explains the gap: 6.2 to 1.02 times the noise.",
    "unexplained": "No effect of the catalogue explains what calibration leaves: 9.7 times the noise.",
}


def levels(verdict: str, noise: float = 1.0) -> dict[str, float]:
    """RMS of noise, delivered, calibrated, explained in a unit in which the noise is that."""
    delivered, calibrated, explained = (noise * x for x in LEVELS[verdict])
    return {"noise": noise, "delivered": delivered, "calibrated": calibrated, "explained": explained}


SCALE = {"arm.x_h": ("m", 3e-5, 1.3), "hydraulics.P1": ("Pa", 2e4, 0.6), "hydraulics.P2": ("Pa", 2e4, 0.5)}
"""Unit, noise and part in what is left of the channels."""


def budget(verdict: str, names: Sequence[str]) -> dict[str, Any]:
    """The budget of these runs."""
    parts = deepcopy(PARTS[verdict])
    small = [{k: p[k] for k in ("kind", "group", "share") if k in p} for p in parts]
    return {
        "metric": "share of what a refit within the tolerances leaves: squared normalised residual above the noise, "
        "held-out data",
        "held_out": "stretches of time predicted from the rest", **levels(verdict), "parts": parts,
        "per_channel": {
            name: {"unit": unit, **levels(verdict, noise), "parts": small} for name, (unit, noise, _) in SCALE.items()
        },
        "per_run": {n: {**levels(verdict), "foretold_by_others": 3.9, "parts": small} for n in names},
        "per_region": {
            "extending": {"delivered": 15.1, "calibrated": 11.0, "explained": 4.1},
            "retracting": {"delivered": 9.1, "calibrated": 5.0, "explained": 2.1},
        },
    }  # fmt: skip


def diagnosis(verdict: str = "explained_in_part", runs: int = 3, **changes: Any) -> dict[str, Any]:
    """The contents of diagnosis.json."""
    names = [f"run{k + 1:02}" for k in range(runs)]
    data = {
        "schema": 2, "campaign": "pool test 3", "verdict": verdict, "headline": HEADLINES[verdict],
        "cautions": [], "finished": True, "unfinished_stage": "",
        "budget": budget(verdict, names),
        "calibration": {
            "moved": {
                "hydraulics.oil.nu0": moved(2.2e-5, 0.031, 0.05, "m2/s"),
                "arm.payload": moved(1050.0, 0.05, 0.05, "kg", at_tolerance=verdict == "unexplained"),
                "hydraulics.line.length": moved(10.1, 0.01, 0.02, "m"),
            }
        },
        "effects": {
            "cylinder_stribeck_friction": {"inclusion_probability": 0.81, "share": 0.50, "group": "friction"},
            "cylinder_coulomb_friction": {"inclusion_probability": 0.18, "share": 0.12, "group": "friction"},
            "valve_dead_zone": {"inclusion_probability": 0.95, "share": 0.21, "group": "spool"},
            **{f"other_{k}": {"inclusion_probability": 0.001, "share": 0.0, "group": "other"} for k in range(27)},
        },
        "hypotheses": [
            {"effects": ["cylinder_stribeck_friction", "valve_dead_zone"], "probability": 0.64, "left": 3.7,
             "status": "converged", "parameters": PARTS["explained"][0]["parameters"]},
            {"effects": ["cylinder_coulomb_friction"], "probability": 0.30, "left": 4.1, "status": "at_bound",
             "parameters": {}},
            {"effects": [], "probability": 0.001, "left": 9.7, "status": "converged", "parameters": {}},
        ],
        "reduction": {"value": 0.74, "ci95": [0.70, 0.77], "how": "stretches of time predicted from the rest"},
        "observations": [{"run": n, "channel": c, "as": "samples"} for n in names for c in SCALE],
        "where": [
            {"subsystem": c.partition(".")[0], "channel": c, "share": s / 2.4, "region": "extending",
             "bands": {"0-0.5 Hz": 0.8, "> 5 Hz": 0.2}, "change_points": [{"run": "run01", "time": 3.2}]}
            for c, (_, _, s) in SCALE.items()
        ],
        "replay": [
            {"component": "arm", "driven_by": ["hydraulics.P1"], "assumed": [], "rms": {"arm.x_h": 3.1},
             "noise_amplification": {"arm.x_h": 0.2}}
        ],
        "curves": [],
        "next_experiment": {"change": {"depth": 6000.0}, "separates": [["friction"], []], "expected_separation": 6.1,
                            "expected_probability": {"now": 0.58, "then": 0.97}},
        "next_channel": {
            "change": {"channel": "hydraulics.Q1"}, "separates": [["a"], ["b"]], "expected_separation": 0.4,
            "expected_probability": {"now": 0.58, "then": 0.6},
        },
        "numerics": {
            "method": "nepce", "step": 0.002, "step_error": 0.38, "fit_step": 0.008, "package_step": 0.002,
            "richardson_order": 2,
        },
        "warnings": ["run02: the clock is 3 % off", "run02: the clock is 3 % off"],
        "timing": {"wall_s": 41.0, "simulations": 900, "stages": {"comparing": 12.0, "judging": 20.0}},
        "settings": {}, "evidence": {},
    }  # fmt: skip
    return {**data, **changes}


def moved(value: float, change: float, tolerance: float, unit: str, at_tolerance: bool = False) -> dict[str, Any]:
    """A base parameter after calibration."""
    ends = [value * 0.99, value * 1.01]
    made = {"value": value, "ci95": ends, "unit": unit, "change": change, "tolerance": tolerance}
    return {**made, "at_tolerance": at_tolerance}


def signals(verdict: str = "explained_in_part", runs: int = 3, n: int = 2200) -> Signals:
    """Three channels in some runs, with a hole in the second run; the last run is held out."""
    random = np.random.default_rng(1)
    channels = (
        Channel("arm.x_h", "x", "mm", 1e3),
        Channel("hydraulics.P1", "P1", "bar", 1e-5),
        Channel("hydraulics.P2", "P2", "bar", 1e-5),
    )
    size = {"arm.x_h": (300.0, 0.03), "hydraulics.P1": (80.0, 0.2), "hydraulics.P2": (1100.0, 0.2)}
    off = [sqrt(max(0.0, x**2 - 1.0)) for x in LEVELS[verdict]]
    made = []
    for k in range(runs):
        t = np.linspace(0.0, 22.0, n)
        t = t[(t < 9.0) | (t > 10.0)] if k == 1 else t
        traces = []
        for c in channels:
            span, noise = size[c.label]
            truth = span * (1.0 + 0.1 * np.sin(0.7 * t + k)) + 0.02 * span * np.tanh(np.sin(2.0 * t) * 5.0)
            wave = noise * np.sin(3.0 * t + k) * sqrt(2.0)
            models = [truth + x * wave for x in off]
            y = truth + random.normal(0.0, noise, len(t))
            last = models[2] if verdict.startswith("explained") else None
            traces.append(Trace(c.label, t, y, models[0], models[1], last, np.full(len(t), noise)))
        command = InputTrace("command", "mA", t, 10.0 * np.sign(np.sin(0.7 * t)))
        conditions = (Condition("depth", 11000.0 - 1000.0 * k, "m"), Condition("arm.payload", 1000.0, "kg"))
        made.append(RunSignals(f"run{k + 1:02}", k == runs - 1, 22.0, conditions, tuple(traces), (command,)))
    x = random.uniform(60.0, 100.0, 3000)
    residual = 0.1 * np.sin(0.3 * x) + random.normal(0.0, 0.03, len(x))
    grid = np.linspace(60.0, 100.0, 48)
    found = Dependence(
        "arm.x_h", "P1", "bar", x, residual, 0.03, 0.8, MeanCurve(grid, 0.1 * np.sin(0.3 * grid))
    )
    units = {"hydraulics.depth": "m", "arm.depth": "m"}
    neutral = {"hydraulics.effect.cylinder_stribeck_friction.F_extra": 0.0}
    dependences = (found,) if verdict in ("explained_in_part", "unexplained") else ()
    return Signals("deepsea_11km.ssp", channels, tuple(made), dependences, units, neutral)
