"""Section "where": channels, regions of the motion, frequencies, times of change, components alone."""

from __future__ import annotations

from ..result.numbers import listed, multiple, percent
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Signals


def context(data: Data, signals: Signals) -> Context | None:
    """Tables of places, regions and components; None where nothing is known."""
    regions = data["budget"].get("per_region") or {}
    if not (data["where"] or regions or data["replay"]):
        return None
    return {
        "places": [_place(w, signals) for w in data["where"][: SHOWN.channels]],
        "more": max(0, len(data["where"]) - SHOWN.channels),
        "regions": _regions(regions),
        "replays": [_replay(r, signals) for r in data["replay"]],
    }


def band_name(band: str) -> str:
    """A frequency band with a dash."""
    return band.replace("-", "–").replace("> ", "above ")


def _place(place: Data, signals: Signals) -> Context:
    c = signals.channel(place["channel"])
    bands = place["bands"] or {}
    top = max(bands, key=lambda b: bands[b], default="")
    times: dict[str, list[str]] = {}
    for p in place["change_points"]:
        times.setdefault(p["run"], []).append(f"{p['time']:.1f}")
    changes = [f"{run}: {listed(t, 5)} s" for run, t in times.items()]
    return {
        "column": c.column, "label": c.label if c.label != c.column else "", "subsystem": place["subsystem"],
        "share": percent(place["share"]), "width": 100.0 * min(1.0, max(0.0, place["share"])),
        "region": place["region"], "band": f"{band_name(top)} ({percent(bands[top])})" if top else "–",
        "changes": "; ".join(changes[:2]) + (f"; {len(changes) - 2} more runs" if len(changes) > 2 else ""),
    }  # fmt: skip


def _regions(regions: Data) -> list[Context]:
    keys = ("delivered", "calibrated", "explained")
    order = sorted(regions, key=lambda r: -regions[r]["calibrated"])[: SHOWN.regions]
    most = max((regions[r][k] for r in order for k in keys), default=1.0) or 1.0
    return [
        {
            "name": name,
            "cells": [{"text": multiple(regions[name][k]), "heat": regions[name][k] / most} for k in keys],
        }
        for name in order
    ]


def _replay(r: Data, signals: Signals) -> Context:
    amplified = r["noise_amplification"]
    return {
        "component": r["component"],
        "driven_by": listed([signals.channel(c).column for c in r["driven_by"]], 6),
        "assumed": listed(list(r["assumed"]), 6),
        "rows": [
            {
                "column": signals.channel(name).column, "rms": multiple(x), "misses": x > SHOWN.component_misses,
                "noise": multiple(amplified[name]) if name in amplified else "–",
            }
            for name, x in r["rms"].items()
        ],
    }  # fmt: skip


SECTION = Section("where", "Where the gap lies", context)
