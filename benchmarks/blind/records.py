"""Cases with their answers and diagnoses, from a folder or from a file of records.

A file of records (JSON lines) holds of every case what scoring, baselines and calibration read, so that a published
score can be recomputed without the hours of the diagnoses, and a benchmark may be run in parts on several machines.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

ANSWER = ("case", "seed", "edition", "kind", "size", "swinging")
EFFECT = ("id", "group", "alike", "channel", "form", "size", "size_net", "library")
BUDGET = ("calibrated", "shares")
HYPOTHESIS = ("effects", "held_out_shared", "fit_rms", "unknowns")
PART = ("kind", "group", "effects", "share", "ci95", "inclusion_probability", "within_group", "form", "rms")
PARAMETER = ("value", "ci95", "at_bound")
FIT = ("effects", "left", "deviance")
TRIED = ("effects", "structured_energy", "fit_rms", "status", "curvature", "without_bias")
TERMS = ("penalty", "occam", "prior")
NONE, UNKNOWN = ("none",), ("unknown",)
"""What a diagnosis names where it names no effect."""

DIGITS = 5
"""Significant digits that are kept."""


class Record(NamedTuple):
    """A case: its name, the answer, the diagnosis, None where that failed or is missing, and what the oracle found."""

    name: str
    answer: dict[str, Any]
    diagnosis: dict[str, Any] | None
    oracle: dict[str, Any] | None = None


def load(place: Path, diagnoses: Path | None = None, missing: bool = False) -> list[Record]:
    """The cases of a folder, or of a file of records, that were diagnosed or failed; with `missing` all others, too.

    diagnoses: folder of the diagnoses (default: `diagnoses` in the folder).
    """
    if place.is_file():
        rows = [json.loads(line) for line in place.read_text("utf-8").splitlines()]
        return [Record(row["case"], row["answer"], row["diagnosis"], row.get("oracle")) for row in rows]
    made = []
    for path in sorted((place / "answers").glob("case_*.json")):
        told = (diagnoses or place / "diagnoses") / path.stem
        if missing or (told / "diagnosis.json").exists() or (told / "failed.txt").exists():
            made.append(one(path, told))
    return made


def load_all(places: Iterable[Path], diagnoses: Path | None = None, missing: bool = False) -> list[Record]:
    """The same of several; of a case that is in more than one, the first that is diagnosed counts."""
    every: dict[tuple[str, str], Record] = {}
    for record in (record for place in places for record in load(place, diagnoses, missing)):
        if every.setdefault(_key(record), record).diagnosis is None:
            every[_key(record)] = record
    return list(every.values())


def _key(record: Record) -> tuple[str, str]:
    return str(record.answer.get("seed")), record.name


def one(answer: Path, told: Path) -> Record:
    """A case by the file of its answer and the folder of its diagnosis."""
    sealed = json.loads(answer.read_text("utf-8"))
    return Record(answer.stem, sealed, _read(told / "diagnosis.json"), _read(told / "oracle.json"))


def _read(file: Path) -> Any:
    """The contents of a file of JSON, None where there is none."""
    return json.loads(file.read_text("utf-8")) if file.exists() else None


def merge(file: Path, fresh: Iterable[Record]) -> None:
    """Put cases into a file of records, which may exist; a fresh one takes the place of an old one of its seed and
    name."""
    rows = {_key(record): record for record in [*(load(file) if file.exists() else []), *fresh]}
    lines = []
    for _, record in sorted(rows.items()):
        row = {"case": record.name, "answer": _answer(record.answer), "diagnosis": _diagnosis(record.diagnosis)}
        if record.oracle is not None:
            row["oracle"] = {key: _some(record.oracle[key], FIT) for key in ("true", "said") if key in record.oracle}
        lines.append(json.dumps(_rounded(row), separators=(",", ":")))
    fresh_file = file.with_name(f"{file.name}.new")  # hours stand in the old one, and this may be killed
    fresh_file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    os.replace(fresh_file, file)


def _some(entry: dict[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    return {key: entry[key] for key in keys if key in entry}


def _answer(answer: dict[str, Any]) -> dict[str, Any]:
    kept = {**_some(answer, ANSWER), "effects": [_some(e, EFFECT) for e in answer["effects"]]}
    return kept | ({"budget": _some(answer["budget"], BUDGET)} if "budget" in answer else {})


def _diagnosis(diagnosis: dict[str, Any] | None) -> dict[str, Any] | None:
    if diagnosis is None:
        return None
    return _causes(diagnosis) if "causes" in diagnosis else _budget(diagnosis)


def _budget(diagnosis: dict[str, Any]) -> dict[str, Any]:
    """Of a diagnosis of schema 2: the budget, every effect, every hypothesis with its plain numbers, times."""
    made = _some(diagnosis, ("schema", "verdict", "finished", "effects", "numerics", "timing", "reduction", "warnings"))
    budget = diagnosis["budget"]
    made["budget"] = {**_some(budget, ("noise", "delivered", "calibrated", "explained")), "parts": []}
    for part in budget["parts"]:
        kept = _some(part, PART)
        if "parameters" in part:
            kept["parameters"] = {a: _some(p, PARAMETER) for a, p in part["parameters"].items()}
        made["budget"]["parts"].append(kept)
    if evidence := diagnosis.get("evidence"):
        tried = [{**_some(h, TRIED), "terms": _some(h["terms"], TERMS)} for h in evidence["hypotheses"]]
        made["evidence"] = {"readings": evidence["readings"], "hypotheses": tried}
    made["hypotheses"] = [
        {k: v for k, v in h.items() if k == "effects" or isinstance(v, (bool, int, float, str))}
        for h in diagnosis.get("hypotheses", [])
    ]
    return made


def _causes(diagnosis: dict[str, Any]) -> dict[str, Any]:
    """Of a diagnosis of schema 1: the causes and the evidence."""
    causes = [_some(c, ("effects", "probability")) for c in diagnosis["causes"]]
    named = [k for k, c in enumerate(causes) if tuple(c["effects"]) not in (NONE, UNKNOWN)]
    for k in named[:1]:  # of the others nobody asks more than the probability
        told = diagnosis["causes"][k]
        causes[k] |= _some(told, ("ambiguous_with",))
        causes[k]["parameters"] = {a: _some(p, ("value", "ci95")) for a, p in told.get("parameters", {}).items()}
    made = {**_some(diagnosis, ("verdict", "probabilities", "gap")), "causes": causes}
    if "gap" in made:
        keys = ("before", "after_calibration", "after", "reduction", "explainable_reduction")
        made["gap"] = _some(made["gap"], keys)
    made["timing"] = _some(diagnosis.get("timing", {}), ("wall_s",))
    if evidence := diagnosis.get("evidence"):
        made["evidence"] = {
            "readings": evidence["readings"],
            "hypotheses": [
                {**_some(h, HYPOTHESIS), "terms": _some(h["terms"], TERMS)} for h in evidence["hypotheses"]
            ],
            "screening": [_some(s, ("effect",)) for s in evidence["screening"][:1]],
        }
    return made


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _rounded(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_rounded(v) for v in value]
    return value
