"""Fits the calibration of the diagnosis on cases whose truth is known, and writes it as JSON.

    python -m benchmarks.blind.calibrate DIR|RECORDS... [--seen DIR|RECORDS...] [--out gap/selection/calibration.json]

Most likely values of the number of independent pieces and the temperature, on the cases with nothing wrong or effects
of the catalogue that are not called unknown; and the weights of "unknown" on all; both for every discrepancy, of
which the smallest is taken that is hardly less likely on all cases than the best: it sees the smallest effects. A score
that is reported is never one of a calibration that has seen its cases.

How often the tool lapses, and how sure it may be of its first answer, show only on cases on which the method was not
developed: where it was, it is right more often. So those (--seen) do not count for that.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.gap.selection import posterior as judgement
from deepsea_cosim.gap.selection.calibration import Calibration
from deepsea_cosim.gap.selection.posterior import features, unknown_probability

from .records import NONE, UNKNOWN, Record, load
from .score import calibration_error, sure_error

INDEPENDENT = (5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 75.0, 100.0)
DISCREPANCY = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1)
TEMPERATURE = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
LAPSE = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2)

HARDLY = 0.005
"""Difference of the mean log probability that does not tell discrepancies apart."""

RIDGE, MISJUDGED, STUCK = 0.01, 0.03, 0.1
"""Keeps the weights of "unknown" finite; least probability of "unknown", and of its opposite: a search may be stuck."""


Case = tuple[dict[str, Any], dict[str, Any]]
"""Answer and diagnosis."""


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


def probabilities(diagnosis: dict[str, Any], calibration: Calibration) -> dict[tuple[str, ...], float]:
    """Probability of every cause with that calibration, "none" and "unknown" among them, from the evidence alone."""
    ids = (tuple(h["effects"]) for h in diagnosis["evidence"]["hypotheses"])
    scored = zip(ids, scores(diagnosis, calibration), strict=True)
    return judgement.probabilities(scored, calibration, features_of(diagnosis, calibration))


def recalibrated(record: Record, calibration: Calibration | None = None) -> Record:
    """A case as that calibration, else the shipped one, would have judged it; parameters stay where they were given."""
    if record.diagnosis is None:
        return record
    calibration = calibration or Calibration.load()
    told = {tuple(c["effects"]): c for c in record.diagnosis["causes"]}
    found = sorted(probabilities(record.diagnosis, calibration).items(), key=lambda item: -item[1])
    causes = [{**told.get(names, {}), "effects": list(names), "probability": p} for names, p in found]
    verdict = {NONE: "no_significant_gap", UNKNOWN: "unknown_effect"}.get(found[0][0], "explained")
    return record._replace(diagnosis={**record.diagnosis, "verdict": verdict, "causes": causes, "probabilities": {}})


def _truth(answer: dict[str, Any]) -> tuple[str, ...]:
    """What a diagnosis should name."""
    return UNKNOWN if answer["kind"] == "unknown" else tuple(sorted(e["id"] for e in answer["effects"])) or NONE


def _told(answer: dict[str, Any], diagnosis: dict[str, Any], calibration: Calibration) -> tuple[float, float]:
    """Probability of the truth, and that it is not unknown."""
    found = probabilities(diagnosis, calibration)
    known = 1.0 - found[UNKNOWN]
    truth = _truth(answer)
    return found.get(truth, calibration.lapse / len(found) * known), known


def likelihood(cases: list[Case], calibration: Calibration) -> float:
    """Mean log probability of the truth among the causes that were fitted."""
    return float(np.mean([np.log(p / known) for p, known in (_told(*case, calibration) for case in cases)]))


def overall(cases: list[Case], calibration: Calibration) -> float:
    """Mean log probability of the truth, which may be that it is unknown."""
    return float(np.mean([np.log(_told(*case, calibration)[0]) for case in cases]))


def features_of(diagnosis: dict[str, Any], calibration: Calibration) -> np.ndarray:
    """What "unknown" is judged by, from the figures of a diagnosis."""
    tried, readings = diagnosis["evidence"]["hypotheses"], diagnosis["evidence"]["readings"]
    best = tried[int(np.argmin(scores(diagnosis, calibration)))]
    return features(calibration, _null(diagnosis), best["held_out_shared"], readings)


def unknown(cases: list[Case], calibration: Calibration) -> list[float]:
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


def _known(cases: list[Case], calibration: Calibration) -> list[Case]:
    """Cases whose cause is in the catalogue, and which are not called unknown."""
    return [
        (a, d) for a, d in cases
        if a["kind"] != "unknown" and unknown_probability(calibration, features_of(d, calibration)) < 0.5
    ]  # fmt: skip


def _best(cases: list[Case], calibrations: Iterable[Calibration]) -> Calibration:
    return max(calibrations, key=lambda c: likelihood(cases, c))


def sureness(cases: list[Case], calibration: Calibration) -> Calibration:
    """With the slope and the shift that make right and wrong answers most likely."""
    from scipy.optimize import minimize

    plain = replace(calibration, slope=1.0, shift=0.0)
    told = [(_truth(answer), list(probabilities(diagnosis, plain).items())) for answer, diagnosis in cases]
    hit = np.array([truth == found[0][0] for truth, found in told])
    pairs = [(found[0][1], found[1][1]) for _, found in told]

    def loss(x: np.ndarray) -> float:
        one = replace(plain, slope=float(x[0]), shift=float(x[1]))
        p = np.array([one.confident(*pair) for pair in pairs])
        return float(-np.log(np.where(hit, p, 1.0 - p)).mean())

    best = minimize(loss, (1.0, 0.0), method="Nelder-Mead", bounds=[(0.0, None), (None, None)]).x
    return replace(plain, slope=float(best[0]), shift=float(best[1]))


def fitted(cases: list[Case], seen: list[Case], made: Calibration) -> Calibration:
    """The most likely calibration with the discrepancy of the one given, which is where it starts."""
    made = replace(made, slope=1.0, shift=0.0)
    for _ in range(3):  # which cases are called unknown depends on the scores, and these on which cases are known
        made = replace(made, unknown=tuple(unknown(cases + seen, made)), misjudged=MISJUDGED, stuck=STUCK)
        known = _known(cases, made)
        every = known + _known(seen, made)
        made = _best(every, (replace(made, independent=n, temperature=t)
                             for n, t in product(INDEPENDENT, TEMPERATURE)))  # fmt: skip
        made = _best(known, (replace(made, lapse=p) for p in LAPSE))
    return sureness(cases, made)


def _cases(places: Iterable[Path]) -> list[Case]:
    """The diagnosed cases of some places; of one that is in several, the first counts."""
    made: dict[tuple[Any, Any], Case] = {}
    for place in places:
        for record in load(place):
            if record.diagnosis is not None:
                made.setdefault((record.answer.get("seed"), record.name), (record.answer, record.diagnosis))
    return list(made.values())


def left_out(cases: list[Case], seen: list[Case], made: Calibration, folds: int) -> list[tuple[float, bool]]:
    """Probability of every case's first answer, and whether that is right, with a calibration fitted without it."""
    pairs = []
    order = np.random.default_rng(0).permutation(len(cases))
    for k in range(folds):
        mine = set(order[k::folds].tolist())
        one = fitted([case for i, case in enumerate(cases) if i not in mine], seen, made)
        for answer, diagnosis in (cases[i] for i in sorted(mine)):
            first, p = next(iter(probabilities(diagnosis, one).items()))
            pairs.append((p, first == _truth(answer)))
    return pairs


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.calibrate", description="Fits the diagnosis' calibration.")
    p.add_argument("places", type=Path, nargs="+", help="folders of cases with their diagnoses, or files of records")
    p.add_argument("--seen", type=Path, nargs="+", default=[], help="cases on which the method was developed")
    p.add_argument("--out", type=Path)
    p.add_argument("--folds", type=int, default=0, metavar="N",
                   help="also fit without a part of the cases, N times, and print the calibration error on that part")
    options = p.parse_args()
    cases, seen = (_cases(places) for places in (options.places, options.seen))
    tried = []
    for discrepancy in DISCREPANCY:
        one = fitted(cases, seen, replace(Calibration.load(), discrepancy=discrepancy))
        tried.append((overall(cases + seen, one), one))
        print(f"discrepancy {discrepancy:g}: mean log probability of the truth {tried[-1][0]:.3f}", flush=True)
    most = max(value for value, _ in tried)
    value, made = next((v, c) for v, c in tried if v > most - HARDLY)
    known = _known(cases, made)
    print(f"{len(cases)} cases, {len(known)} of them judged known; their mean log probability of the truth "
          f"{likelihood(known, made):.3f}, of all {value:.3f}")  # fmt: skip
    if options.folds > 1:
        pairs = left_out(cases, seen, made, options.folds)
        print(f"left out in {options.folds} parts: calibration error {calibration_error(pairs):.3f}; "
              f"{sure_error([p for p, _ in pairs]):.3f} if the probabilities were right")  # fmt: skip
    print(json.dumps(asdict(made)))
    if options.out:
        options.out.write_text(json.dumps(asdict(made)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
