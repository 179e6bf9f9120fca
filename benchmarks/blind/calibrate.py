"""Fits the calibration of the inclusion probabilities on cases whose truth is known, and writes it as JSON.

    python -m benchmarks.blind.calibrate DIR|RECORDS... [--out gap/selection/probability_calibration.json] [--folds 10]
                                         [--independent 30 --form-error 0.04 --scatter 0.3 --temperature 1]

Every effect that a case's diagnosis looked at is one observation: whether it was in the machine, and the features that
`gap/selection/posterior.py` judges it by. The weights are those of a logistic regression; independent pieces, form
error, scatter and temperature are those with the least cross-validated log loss, unless they are given: where the data
do not tell settings apart, which the standard error of the difference by case says, milder ones than the least are the
wiser choice. With --folds the calibration error, the Brier score
and precision and recall on the cases that a fit has not seen are printed. A score that is reported is never one of a
calibration that has seen its cases.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from deepsea_cosim.gap.selection.posterior import Evidence, inclusion, inclusion_features, posterior_of
from deepsea_cosim.gap.selection.probability_calibration import Curvature, ProbabilityCalibration
from deepsea_cosim.gap.settings import PosteriorSettings

from .records import Record, load
from .scoring.names import plain
from .scoring.true import LEAST_GAP, Truth

INDEPENDENT = (10.0, 15.0, 20.0, 30.0, 45.0, 70.0, 100.0, 150.0)
SCATTER = (0.0, 0.1, 0.3)  # with more a form loses that leaves a fifth
TEMPERATURE = (1.0, 2.0, 3.0, 5.0, 8.0)
FORM_ERROR = (0.0, 0.02, 0.04, 0.07)
"""What is tried."""

RIDGE = 1e-4
"""Keeps the weights finite, per observation."""

BIAS = "sensor_bias"
"""An effect that diagnoses before 30 November 2026 do not tell enough of to be judged anew: what calibration's own
biases take over of it (`without_bias`)."""

EFFECTS = 34
"""Effects of the catalogue: those that a diagnosis did not look at have probability 0."""


class Case(NamedTuple):
    """What a diagnosis looked at, and which effects were true; none where the cause is in no catalogue."""

    evidence: tuple[Evidence, ...]
    readings: int
    true: frozenset[str]
    kind: str
    uncounted: frozenset[str] = frozenset()
    """Effects that are there but too small to be found: they count neither as true nor as false."""


class Observations(NamedTuple):
    """Of every effect that was looked at: features (n, k), whether it was true (n,), and its case (n,); and how many
    true ones were not looked at."""

    features: np.ndarray
    true: np.ndarray
    case: np.ndarray
    missed: int


def cases_of(places: Iterable[Path]) -> list[Case]:
    """The diagnosed cases of some places; of one that is in several, the first counts."""
    made: dict[tuple[Any, Any], Case] = {}
    for place in places:
        for record in load(place):
            if record.diagnosis is not None and judged_alike(record.diagnosis):
                key = (record.answer.get("seed"), record.name)
                made.setdefault(key, case_of(record.answer, record.diagnosis))
    return list(made.values())


def judged_alike(diagnosis: dict[str, Any]) -> bool:
    """Whether a diagnosis tells what its hypotheses are judged by today: those of earlier methods do not."""
    return all("curvature" in h for h in diagnosis.get("evidence", {}).get("hypotheses", [{}]))


def case_of(answer: dict[str, Any], diagnosis: dict[str, Any]) -> Case:
    """A case from its answer and diagnosis."""
    found = diagnosis["evidence"]
    evidence = tuple(
        Evidence(
            tuple(h["effects"]), h["structured_energy"], h["terms"]["prior"],
            Curvature(*(tuple(h["curvature"][key]) for key in Curvature._fields)),
            {tuple(w["effects"]): w["energy"] for w in h.get("without_bias", ())},
        )
        for h in found["hypotheses"]
    )  # fmt: skip
    unjudged = _unjudged(diagnosis)
    if "size" not in answer:  # of real measurements
        true = frozenset(e["id"] for e in answer["effects"]) if answer["kind"] != "unknown" else frozenset()
        return Case(evidence, found["readings"], true - unjudged, answer["kind"], unjudged)
    truth = Truth.of(answer)
    true = frozenset(plain(e.name)[0] for e in truth.wanted)
    if "budget" not in answer and diagnosis["budget"]["calibrated"] < LEAST_GAP:
        true = frozenset()  # a linear size is what a linear refit leaves; the whole one takes this up
    there = frozenset(plain(e.name)[0] for e in truth.effects if truth.known)
    return Case(evidence, found["readings"], true - unjudged, answer["kind"], (there - true) | unjudged)


def _unjudged(diagnosis: dict[str, Any]) -> frozenset[str]:
    """Effects of which a diagnosis does not tell enough."""
    tells = any("without_bias" in h for h in diagnosis["evidence"]["hypotheses"])
    return frozenset() if tells else frozenset({BIAS})


def observe(cases: Sequence[Case], calibration: ProbabilityCalibration) -> Observations:
    """All effects that were looked at."""
    features, true, place, missed = [], [], [], 0
    for k, case in enumerate(cases):
        posterior = posterior_of(case.evidence, calibration, case.readings)
        looked_at = sorted({id for e in case.evidence for id in e.ids})
        for id in looked_at:
            if id in case.uncounted:
                continue
            features.append(inclusion_features(posterior, frozenset([id])))
            true.append(id in case.true)
            place.append(k)
        missed += len(case.true - set(looked_at))
    return Observations(np.array(features), np.array(true), np.array(place), missed)


def logistic(features: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Weights (k,) of a logistic regression."""
    from scipy.optimize import minimize

    spread = np.where(features.std(0) > 0.0, features.std(0), 1.0)
    scaled = features / spread

    def loss(w: np.ndarray) -> tuple[float, np.ndarray]:
        margin = scaled @ w
        p = 1.0 / (1.0 + np.exp(-np.clip(margin, -50, 50)))
        ridge = RIDGE * len(true)
        value = np.logaddexp(0.0, np.where(true, -margin, margin)).sum() + 0.5 * ridge * float(w[1:] @ w[1:])
        return float(value), scaled.T @ (p - true) + ridge * np.concatenate([[0.0], w[1:]])

    found = minimize(loss, np.zeros(features.shape[1]), jac=True)
    return np.asarray(found.x / spread)


def cross_validated(o: Observations, count: int, folds: int) -> np.ndarray:
    """Probability (n,) of every observation with weights that have not seen its case."""
    order = np.random.default_rng(0).permutation(count)
    fold = np.empty(count, dtype=int)
    fold[order] = np.arange(count) % folds
    made = np.zeros(len(o.true))
    for k in range(folds):
        held = fold[o.case] == k
        weights = logistic(o.features[~held], o.true[~held])
        made[held] = 1.0 / (1.0 + np.exp(-np.clip(o.features[held] @ weights, -30, 30)))
    return made


def log_loss(p: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Negative log probability (n,) of what was so."""
    return np.asarray(-np.log(np.clip(np.where(true, p, 1.0 - p), 1e-9, 1.0)))


class Tried(NamedTuple):
    """A calibration, the probabilities (n,) that it tells with weights that have not seen the case, and its loss (k,)
    summed by case."""

    calibration: ProbabilityCalibration
    observations: Observations
    told: np.ndarray
    loss: np.ndarray


def tried(cases: Sequence[Case], calibration: ProbabilityCalibration, folds: int) -> Tried:
    """A calibration of these settings with the weights that serve best."""
    o = observe(cases, calibration)
    told = cross_validated(o, len(cases), folds)
    by_case = np.bincount(o.case, log_loss(told, o.true), minlength=len(cases))
    return Tried(replace(calibration, inclusion=tuple(logistic(o.features, o.true))), o, told, by_case)


class Reliability(NamedTuple):
    """Of one range of probabilities: how many, what was said, what was so."""

    low: float
    count: int
    said: float
    was: float


def reliability(p: np.ndarray, true: np.ndarray) -> list[Reliability]:
    """By tenths."""
    made = []
    for low in np.arange(10) / 10.0:
        inside = (p >= low) & (p < low + 0.1 + (low > 0.85))
        if inside.any():
            made.append(Reliability(float(low), int(inside.sum()), float(p[inside].mean()), float(true[inside].mean())))
    return made


def calibration_error(p: np.ndarray, true: np.ndarray) -> float:
    """Expected calibration error over tenths."""
    return float(sum(r.count * abs(r.said - r.was) for r in reliability(p, true)) / max(1, len(p)))


def summary(cases: Sequence[Case], o: Observations, p: np.ndarray) -> list[str]:
    """What the cross-validation says, line by line."""
    every = EFFECTS * len(cases)
    base = (o.true.sum() + o.missed) / every
    brier = float(((p - o.true) ** 2).sum() + o.missed) / every
    told = p >= PosteriorSettings().named
    most = {k: float(p[o.case == k].max(initial=0.0)) for k in range(len(cases))}
    lines = [
        f"{len(cases)} cases, {len(p)} effects looked at, {int(o.true.sum())} of them true, {o.missed} true ones not",
        f"calibration error {calibration_error(p, o.true):.3f}, of those with 5 % and more "
        f"{calibration_error(p[p >= 0.05], o.true[p >= 0.05]):.3f}; "
        f"Brier over that of the base rate {brier / (base * (1.0 - base)):.2f}",
        f"named: precision {o.true[told].mean():.0%}, recall {told[o.true].sum() / (o.true.sum() + o.missed):.0%}",
    ]
    for kind, what in (("none", "false alarms where nothing is"), ("unknown", "named where the cause is unknown")):
        alarms = [most[k] >= 0.5 for k, case in enumerate(cases) if case.kind == kind]
        if alarms:
            lines.append(f"{what}: {np.mean(alarms):.1%} of {len(alarms)}")
    return lines + [f"  {r.low:.1f}: {r.count:5d}  said {r.said:.3f}  was {r.was:.3f}" for r in reliability(p, o.true)]


def recalibrated(record: Record) -> Record:
    """A case with the inclusion probabilities of the shipped calibration in place of its own, where it can be judged
    anew."""
    if record.diagnosis is None or not judged_alike(record.diagnosis):
        return record
    calibration, case = ProbabilityCalibration.load(), case_of(record.answer, record.diagnosis)
    posterior = posterior_of(case.evidence, calibration, case.readings)
    ids = sorted({id for e in case.evidence for id in e.ids})
    told = {id: inclusion(posterior, frozenset([id])) for id in ids}
    own = record.diagnosis["effects"]
    effects = own | {id: {**own.get(id, {}), "inclusion_probability": p} for id, p in told.items()}
    effects |= {id: own[id] for id in _unjudged(record.diagnosis) & own.keys()}
    return record._replace(diagnosis={**record.diagnosis, "effects": effects})


def settings(c: ProbabilityCalibration) -> str:
    """What is tried of a calibration, in words."""
    return f"{c.independent:g} pieces, form error {c.form_error:g}, scatter {c.scatter:g}, T {c.temperature:g}"


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.calibrate", description="Fits the diagnosis' calibration.")
    p.add_argument("places", type=Path, nargs="+", help="folders of cases with their diagnoses, or files of records")
    p.add_argument("--out", type=Path, help="the calibration as JSON")
    p.add_argument("--folds", type=int, default=10, metavar="N", help="parts that are left out in turn (default: 10)")
    p.add_argument("--independent", type=float, help="independent pieces (default: those with the least loss)")
    p.add_argument("--form-error", type=float, help="what right effects of another form miss (the same)")
    p.add_argument("--scatter", type=float, help="scatter of the model's form (the same)")
    p.add_argument("--temperature", type=float, help="temperature (the same)")
    options = p.parse_args()
    cases = cases_of(options.places)
    names = ("independent", "form_error", "scatter", "temperature")
    grid = [tried(cases, replace(ProbabilityCalibration.load(), **dict(zip(names, values, strict=True))), options.folds)
            for values in product(INDEPENDENT, FORM_ERROR, SCATTER, TEMPERATURE)]  # fmt: skip
    least = min(grid, key=lambda x: float(x.loss.sum()))
    asked = {k: v for k in names if (v := getattr(options, k)) is not None}
    taken = tried(cases, replace(least.calibration, **asked), options.folds) if asked else least
    made, worse = taken.calibration, taken.loss - least.loss
    print(f"log loss {taken.loss.sum() / len(taken.told):.4f} with {settings(made)}")
    if asked:
        error = float(worse.std() * np.sqrt(len(worse)))
        print(f"least with {settings(least.calibration)}: {worse.sum():.1f} +- {error:.1f} less over all cases")
    print("\n".join(summary(cases, taken.observations, taken.told)))
    data = {**asdict(made), "inclusion": [float(f"{w:.6g}") for w in made.inclusion]}
    print(json.dumps(data))
    if options.out:
        options.out.write_text(json.dumps(data) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
