"""Fits the calibration of the diagnosis on cases whose truth is known, and writes it as JSON.

    python -m benchmarks.blind.calibrate DIR [--diagnoses FOLDER] [--out gap/calibration.json]

Most likely values of the number of independent readings that count, the temperature and the lapse rate, on the cases
with nothing wrong or effects of the catalogue; and a logistic model of "unknown" on all cases. Never use the cases of a
reported score here.
"""

from __future__ import annotations

import argparse
import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.gap.verdict import features

INDEPENDENT = (30.0, 50.0, 75.0, 100.0, 150.0, 200.0, 300.0, 500.0)
TEMPERATURE = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
LAPSE = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3)


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
    return features(null, min(best, null), diagnosis["unexplained"]["predictable_share"])


def unknown(cases: list[tuple[dict[str, Any], dict[str, Any]]]) -> list[float]:
    """Weights of the features of "unknown"."""
    from sklearn.linear_model import LogisticRegression

    X = np.array([features_of(d)[1:] for _, d in cases])
    y = np.array([a["kind"] == "unknown" for a, _ in cases])
    spread = X.std(0) + 1e-9
    model = LogisticRegression(C=1.0).fit(X / spread, y)
    return [float(model.intercept_[0]), *(float(w) for w in model.coef_[0] / spread)]


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.calibrate", description="Fits the diagnosis' calibration.")
    p.add_argument("folder", type=Path)
    p.add_argument("--diagnoses", type=Path)
    p.add_argument("--out", type=Path)
    options = p.parse_args()
    cases = load(options.folder, options.diagnoses or options.folder / "diagnoses")
    known = [(a, d) for a, d in cases if a["kind"] != "unknown"]
    value, n, temperature, lapse = max(
        (likelihood(known, *x), *x) for x in product(INDEPENDENT, TEMPERATURE, LAPSE)
    )  # fmt: skip
    found = {"independent": n, "temperature": temperature, "lapse": lapse, "unknown": unknown(cases)}
    print(f"{len(cases)} cases, mean log probability of the truth {value:.3f}")
    print(json.dumps(found))
    if options.out:
        options.out.write_text(json.dumps(found) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
