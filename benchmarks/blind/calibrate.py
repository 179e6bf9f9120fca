"""Fits the calibration of the diagnosis on cases whose truth is known, and writes it as JSON.

    python -m benchmarks.blind.calibrate DIR [--diagnoses FOLDER] [--out gap/calibration.json]

Most likely values of the number of independent readings that count, the temperature and the lapse rate, on the cases
with nothing wrong or effects of the catalogue that are not called unknown; and the weights of "unknown" on all cases.
Never use the cases of a reported score here.
"""

from __future__ import annotations

import argparse
import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.gap.calibration import Calibration
from deepsea_cosim.gap.verdict import features, unknown_probability

INDEPENDENT = (30.0, 50.0, 75.0, 100.0, 150.0, 200.0, 300.0, 500.0)
TEMPERATURE = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
LAPSE = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3)

RIDGE, MISJUDGED = 0.1, 0.03
"""Keeps the weights of "unknown" finite; and a share of cases whose search may have failed."""


def load(folder: Path, diagnoses: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """(answer, diagnosis) of every diagnosed case."""
    made = []
    for path in sorted((folder / "answers").glob("case_*.json")):
        file = diagnoses / path.stem / "diagnosis.json"
        if file.exists():
            made.append((json.loads(path.read_text("utf-8")), json.loads(file.read_text("utf-8"))))
    return made


def likelihood(cases: list[tuple[dict[str, Any], dict[str, Any]]], n: float, temperature: float, lapse: float) -> float:
    """Mean log probability of the truth among the causes that were fitted."""
    total = 0.0
    for answer, diagnosis in cases:
        truth = tuple(sorted(e["id"] for e in answer["effects"]))
        weights: dict[tuple[str, ...], float] = {}
        scores = {}
        for h in diagnosis["evidence"]["hypotheses"]:
            t = h["terms"]
            used = min(n, t.get("available", t["independent"]))
            scores[h["label"]] = (tuple(h["effects"]), used * 2 * np.log(h["held_out_rms"]) + t["penalty"] + t["occam"]
                                  + t["prior"])  # fmt: skip
        low = min(score for _, score in scores.values())
        for key, score in scores.values():
            weights[key] = weights.get(key, 0.0) + float(np.exp(-0.5 * (score - low) / temperature))
        whole = sum(weights.values())
        p = (1.0 - lapse) * weights.get(truth, 0.0) / whole + lapse / len(weights)
        total += np.log(p)
    return total / len(cases)


def features_of(diagnosis: dict[str, Any]) -> np.ndarray:
    """What "unknown" is judged by, from the figures of a diagnosis."""
    tried = diagnosis["evidence"]["hypotheses"]
    null = next(h["held_out_rms"] for h in tried if not h["effects"])
    best = next((h["held_out_rms"] for h in tried if h["effects"]), null)
    return features(null, min(best, null))


def unknown(cases: list[tuple[dict[str, Any], dict[str, Any]]]) -> list[float]:
    """Weights of the features of "unknown"."""
    from scipy.optimize import minimize

    X = np.array([features_of(d) for _, d in cases])
    y = np.array([a["kind"] == "unknown" for a, _ in cases])
    spread = np.where(X.std(0) > 0.0, X.std(0), 1.0)

    def loss(w: np.ndarray) -> float:
        told = Calibration(0.0, 1.0, 0.0, tuple(w / spread), MISJUDGED)
        p = np.array([unknown_probability(told, x) for x in X])
        return float(-np.log(np.where(y, p, 1.0 - p)).sum() + 0.5 * RIDGE * (w[1:] @ w[1:]))

    starts = (np.zeros(X.shape[1]), np.array([-1.0, *np.ones(X.shape[1] - 1)]))
    best = min((minimize(loss, start, method="Nelder-Mead") for start in starts), key=lambda found: found.fun)
    return [float(w) for w in best.x / spread]


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.calibrate", description="Fits the diagnosis' calibration.")
    p.add_argument("folder", type=Path)
    p.add_argument("--diagnoses", type=Path)
    p.add_argument("--out", type=Path)
    options = p.parse_args()
    cases = load(options.folder, options.diagnoses or options.folder / "diagnoses")
    weights = tuple(unknown(cases))
    called = Calibration(0.0, 1.0, 0.0, weights, MISJUDGED)
    known = [
        (a, d) for a, d in cases
        if a["kind"] != "unknown" and unknown_probability(called, features_of(d)) < 0.5
    ]  # fmt: skip
    value, n, temperature, lapse = max(
        (likelihood(known, *x), *x) for x in product(INDEPENDENT, TEMPERATURE, LAPSE)
    )  # fmt: skip
    found = {"independent": n, "temperature": temperature, "lapse": lapse}
    found |= {"unknown": weights, "misjudged": MISJUDGED}
    print(f"{len(cases)} cases, mean log probability of the truth {value:.3f}")
    print(json.dumps(found))
    if options.out:
        options.out.write_text(json.dumps(found) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
