"""Section "signals": the measured and modelled signals as the page's script draws them."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np

from ..result.numbers import listed, multiple, pretty
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Array, InputTrace, RunSignals, Signals, Trace

CURVES = (
    ("measured", "measured", "#111111"),
    ("delivered", "as delivered", "#d55e00"),
    ("calibrated", "calibrated", "#e69f00"),
    ("explained", "with the effects", "#0072b2"),
)
"""Name, label and colour of the curves, in the order in which they are drawn."""


def context(data: Data, signals: Signals) -> Context | None:
    """The embedded series and what the selectors offer; None without series."""
    runs = [r for r in signals.runs if r.traces]
    if not runs:
        return None
    embedded = embed(data, signals)
    explained = any(t.explained is not None for r in runs for t in r.traces)
    return {
        "json": json.dumps(embedded, separators=(",", ":")).replace("<", "\\u003c"),
        "runs": [r["name"] + (" (held out)" if r["held_out"] else "") for r in embedded["runs"]],
        "first": embedded["first"],
        "curves": [c for c in CURVES if explained or c[0] != "explained"],
        "names": listed([r.name for r in runs]),
    }


def embed(data: Data, signals: Signals) -> dict[str, Any]:
    """What the script reads: channels, curves, runs with series as base64, and the run to begin with."""
    runs = [r for r in signals.runs if r.traces]
    most = int(
        np.clip(SHOWN.all_points // max(1, sum(len(r.traces) for r in runs)), SHOWN.fewest_points, SHOWN.trace_points)
    )
    changes: dict[tuple[str, str], list[float]] = {}
    for w in data["where"]:
        for p in w["change_points"]:
            changes.setdefault((p["run"], w["channel"]), []).append(float(p["time"]))
    size = [max(deviation(t) for t in r.traces) for r in runs]
    return {
        "curves": [{"key": k, "name": name, "colour": colour} for k, name, colour in CURVES],
        "first": int(np.argmax(size)) if size else 0,
        "runs": [_run(r, signals, most, changes) for r in runs],
    }


def deviation(t: Trace, model: str = "calibrated") -> float:
    """RMS of measured minus a model, as a multiple of the noise."""
    e = (t.measured - getattr(t, model)) / np.maximum(t.noise, 1e-300)
    e = e[np.isfinite(e)]  # of a swing that there was no time to simulate
    return float(np.sqrt(np.mean(e**2))) if len(e) else 0.0


def keep_peaks(t: Array, lines: list[Array], most: int) -> np.ndarray:
    """Places (k,) of at most about `most` points that keep every line's peaks: of each stretch of time the least and
    the largest of every line."""
    if len(t) <= most:
        return np.arange(len(t))
    stretches = max(1, most // (2 * len(lines)))
    size = -(-len(t) // stretches)
    n = len(t) // size * size
    start = np.arange(n // size) * size
    keep = [np.array([0, len(t) - 1])]
    for y in lines:
        parts = y[:n].reshape(-1, size)
        rest = [n + k(y[n:]) for k in (np.argmin, np.argmax)] if n < len(t) else []
        keep += [start + parts.argmin(1), start + parts.argmax(1), np.array(rest, int)]
    return np.unique(np.concatenate(keep))


def holes(t: Array) -> Array:
    """Times in the middle of the holes of a measurement, where no line is to be drawn."""
    if len(t) < 3:
        return np.zeros(0)
    step = np.diff(t)
    at = np.flatnonzero(step > SHOWN.hole * np.median(step))
    return 0.5 * (t[at] + t[at + 1])


def encoded(x: Array, kind: str) -> str:
    """Little-endian numbers as base64."""
    return base64.b64encode(np.asarray(x).astype(kind).tobytes()).decode("ascii")


def _run(run: RunSignals, signals: Signals, most: int, changes: dict[tuple[str, str], list[float]]) -> dict[str, Any]:
    traces = sorted(run.traces, key=lambda t: -deviation(t))
    return {
        "name": run.name, "held_out": run.held_out,
        "traces": [_trace(t, signals, most, changes.get((run.name, t.channel), [])) for t in traces],
        "inputs": [_input(i, most) for i in run.inputs],
    }  # fmt: skip


def _trace(trace: Trace, signals: Signals, most: int, changes: list[float]) -> dict[str, Any]:
    c = signals.channel(trace.channel)
    lines = {k: y for k, _, _ in CURVES if (y := getattr(trace, k)) is not None}
    keep = keep_peaks(trace.t, list(lines.values()), most)
    breaks = holes(trace.t)
    at = np.searchsorted(trace.t[keep], breaks)
    middle = float(np.median(trace.measured)) if len(trace.measured) else 0.0
    entry: dict[str, Any] = {
        "name": c.column, "connector": c.label, "unit": pretty(c.unit), "changes": changes,
        "off": [multiple(deviation(trace, k)) for k in lines if k != "measured"], "middle": middle,
        "t": encoded(np.insert(trace.t[keep], at, breaks), "<f8"),
        "noise": encoded(np.insert(trace.noise[keep], at, np.nan), "<f4"),
    }  # fmt: skip
    # less the middle: the seven digits of four bytes are few for a small swing about a large pressure
    return entry | {k: encoded(np.insert(y[keep] - middle, at, np.nan), "<f4") for k, y in lines.items()}


def _input(i: InputTrace, most: int) -> dict[str, Any]:
    keep = keep_peaks(i.t, [i.measured], most // 2)
    return {
        "name": i.column, "unit": pretty(i.unit), "t": encoded(i.t[keep], "<f8"),
        "measured": encoded(i.measured[keep], "<f4"), "middle": 0.0,
    }  # fmt: skip


SECTION = Section("signals", "Measured and modelled signals", context)
