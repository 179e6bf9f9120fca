"""What diagnoses of schema 1 said, of which records are kept: one winning cause, and probabilities of all causes.

An effect's inclusion probability is the sum over the causes that contain it. There were no shares.
"""

from __future__ import annotations

from typing import Any

from .said import NAN, Hypothesis, Part, Said, values

NO_EFFECT = ("none", "unknown")


def said_of_causes(diagnosis: dict[str, Any]) -> Said:
    """From the contents of a diagnosis.json of schema 1."""
    causes = [c for c in diagnosis["causes"] if not set(c["effects"]) & set(NO_EFFECT)]
    probabilities: dict[str, float] = {}
    for cause in causes:
        for name in cause["effects"]:
            probabilities[name] = probabilities.get(name, 0.0) + float(cause["probability"])
    fits = {tuple(h["effects"]): float(h["fit_rms"]) for h in diagnosis.get("evidence", {}).get("hypotheses", [])}
    hypotheses = tuple(
        Hypothesis(tuple(c["effects"]), float(c["probability"]), fits.get(tuple(c["effects"]), NAN), values(c))
        for c in causes
    )
    gap = diagnosis.get("gap", {})
    return Said(
        diagnosis["verdict"], probabilities, _intervals(causes), hypotheses,
        float(gap.get("after_calibration", NAN)), float(gap.get("after", NAN)), float(gap.get("reduction", NAN)),
        NAN, float(diagnosis.get("timing", {}).get("wall_s", NAN)),
    )  # fmt: skip


def _intervals(causes: list[dict[str, Any]]) -> tuple[Part, ...]:
    """The first cause as a part without a share, for the intervals of its parameters."""
    for cause in causes[:1]:
        told = cause.get("parameters", {})
        spans = {a: (float(p["ci95"][0]), float(p["ci95"][1])) for a, p in told.items() if p.get("ci95")}
        if spans:
            return (Part(tuple(cause["effects"]), NAN, None, float(cause["probability"]), spans),)
    return ()
