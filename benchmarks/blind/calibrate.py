"""Fits the calibration of the diagnosis on cases whose truth is known, and writes it as JSON.

    python -m benchmarks.blind.calibrate DIR|RECORDS... [--out gap/calibration.json]

Most likely values of the number of independent pieces, the discrepancy, the temperature and the lapse, on the
cases with nothing wrong or effects of the catalogue that are not called unknown; and the weights of "unknown" on all of
them. Never use the cases of a reported score here.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.gap.calibration import Calibration
from deepsea_cosim.gap.verdict import features, unknown_probability

from .records import load

INDEPENDENT = (5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 75.0, 100.0)
DISCREPANCY = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1)
TEMPERATURE = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
LAPSE = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2)

RIDGE, MISJUDGED, STUCK = 0.01, 0.03, 0.12
"""Keeps the weights of "unknown" finite; least probability of "unknown", and of its opposite: a search may be stuck."""


def scores(diagnosis: dict[str, Any], calibration: Calibration) -> list[float]:
    """The scores of a diagnosis' hypotheses with that calibration."""
    evidence = diagnosis["evidence"]
    return [
        calibration.weight(h["held_out_shared"], evidence["readings"])
        + sum(h["terms"][key] for key in ("penalty", "occam", "prior"))
        for h in evidence["hypotheses"]
    ]


def _null(diagnosis: dict[str, Any]) -> float:
    """The energy that the refit of the base parameters leaves."""
    return float(next(h["held_out_shared"] for h in diagnosis["evidence"]["hypotheses"] if not h["effects"]))


def likelihood(cases: list[tuple[dict[str, Any], dict[str, Any]]], calibration: Calibration) -> float:
    """Mean log probability of the truth among the causes that were fitted."""
    total = 0.0
    for answer, diagnosis in cases:
        truth = tuple(sorted(e["id"] for e in answer["effects"]))
        found = scores(diagnosis, calibration)
        weights: dict[tuple[str, ...], float] = {}
        for h, score in zip(diagnosis["evidence"]["hypotheses"], found, strict=True):
            key = tuple(h["effects"])
            weight = float(np.exp(-0.5 * (score - min(found)) / calibration.temperature))
            weights[key] = weights.get(key, 0.0) + weight
        p = (1.0 - calibration.lapse) * weights.get(truth, 0.0) / sum(weights.values())
        total += np.log(p + calibration.lapse / len(weights))
    return total / len(cases)


def features_of(diagnosis: dict[str, Any], calibration: Calibration) -> np.ndarray:
    """What "unknown" is judged by, from the figures of a diagnosis."""
    tried, readings = diagnosis["evidence"]["hypotheses"], diagnosis["evidence"]["readings"]
    best = tried[int(np.argmin(scores(diagnosis, calibration)))]
    return features(calibration, _null(diagnosis), best["held_out_shared"], readings)


def unknown(cases: list[tuple[dict[str, Any], dict[str, Any]]], calibration: Calibration) -> list[float]:
    """Weights of the features of "unknown"."""
    from scipy.optimize import minimize

    X = np.array([features_of(d, calibration) for _, d in cases])
    y = np.array([a["kind"] == "unknown" for a, _ in cases])
    spread = np.where(X.std(0) > 0.0, X.std(0), 1.0)

    def loss(w: np.ndarray) -> float:
        told = replace(calibration, unknown=tuple(w / spread))
        p = np.array([unknown_probability(told, x) for x in X])
        return float(-np.log(np.where(y, p, 1.0 - p)).sum() + 0.5 * RIDGE * (w[1:] @ w[1:]))

    # the more is left, the more likely it is unknown: no weight but the constant is negative
    bounds = [(None, None), *[(0.0, None)] * (X.shape[1] - 1)]
    starts = (np.zeros(X.shape[1]), np.array([-1.0, *np.ones(X.shape[1] - 1)]))
    options = {"maxiter": 4000, "xatol": 1e-6, "fatol": 1e-9}
    found = [minimize(loss, start, method="Nelder-Mead", bounds=bounds, options=options) for start in starts]
    best = min(found, key=lambda f: f.fun)
    return [float(w) for w in best.x / spread]


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.calibrate", description="Fits the diagnosis' calibration.")
    p.add_argument("places", type=Path, nargs="+", help="folders of cases with their diagnoses, or files of records")
    p.add_argument("--out", type=Path)
    options = p.parse_args()
    every = (case for place in options.places for case in load(place))
    cases = [(case.answer, case.diagnosis) for case in every if case.diagnosis is not None]
    made = Calibration.load()
    for _ in range(3):  # which cases are called unknown depends on the scores, and these on which cases are known
        made = replace(made, unknown=tuple(unknown(cases, made)), misjudged=MISJUDGED, stuck=STUCK)
        known = [
            (a, d) for a, d in cases
            if a["kind"] != "unknown" and unknown_probability(made, features_of(d, made)) < 0.5
        ]  # fmt: skip
        options_of = (replace(made, independent=n, discrepancy=e, temperature=t, lapse=p)
                      for n, e, t, p in product(INDEPENDENT, DISCREPANCY, TEMPERATURE, LAPSE))  # fmt: skip
        value, made = max(((likelihood(known, c), c) for c in options_of), key=lambda entry: entry[0])
    print(f"{len(cases)} cases, {len(known)} of them judged known; their mean log probability of the truth {value:.3f}")
    print(json.dumps(asdict(made)))
    if options.out:
        options.out.write_text(json.dumps(asdict(made)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
