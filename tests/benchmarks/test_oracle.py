"""The oracle on a toy: measurements from scipy of a slide that rubs, the model an FMU with its own catalogue."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from benchmarks.blind.oracle import __main__ as command
from benchmarks.blind.oracle.fits import best_hypothesis
from benchmarks.blind.records import load
from benchmarks.blind.scoring.drawers import drawer
from benchmarks.blind.scoring.outcome import outcomes
from benchmarks.blind.scoring.said import said
from tests.gap.oscillator import campaign, measure

BASE = {"o.m": 2.05 / 2.0, "o.k": 78.0 / 80.0, "o.d": 3.1 / 3.0}


def answer(kind, *effects):
    entries = [{"id": id, "alike": [id], "library": library} for id, library in effects]
    return {"case": 0, "seed": 1, "kind": kind, "effects": entries, "size": 5.0, "base": BASE}


def diagnosis(*hypotheses, verdict="explained_in_part"):
    """Hypotheses: effects, probability, parameters."""
    return {
        "schema": 2, "verdict": verdict, "budget": {"calibrated": 4.0, "explained": 3.0, "parts": []},
        "effects": {name: {"inclusion_probability": p, "share": 0.5} for names, p, _ in hypotheses for name in names},
        "hypotheses": [{"effects": e, "probability": p, "left": 3.0, "parameters": v} for e, p, v in hypotheses],
    }  # fmt: skip


@pytest.fixture(scope="module")
def folder(toys, tmp_path_factory):
    """A case as the benchmark lays it out: a run of a slide with Coulomb friction of 0.4 N."""
    folder = tmp_path_factory.mktemp("oracle")
    (folder / "case_0000").mkdir()
    campaign(folder / "case_0000", toys, [measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))])
    (folder / "answers").mkdir()
    (folder / "diagnoses" / "case_0000").mkdir(parents=True)
    return folder


def asked(folder, monkeypatch, sealed, told):
    (folder / "answers" / "case_0000.json").write_text(json.dumps(sealed))
    place = folder / "diagnoses" / "case_0000"
    (place / "diagnosis.json").write_text(json.dumps(told))
    (place / "oracle.json").unlink(missing_ok=True)
    monkeypatch.setattr(sys, "argv", ["oracle", str(folder)])
    command.main()
    return json.loads((place / "oracle.json").read_text())


def test_an_effect_without_a_known_value_is_looked_for_and_fitted(folder, monkeypatch, capsys):
    told = diagnosis((["cubic_spring"], 0.9, {"o.k3": 120.0}))
    found = asked(folder, monkeypatch, answer("single", ("friction", {})), told)
    true, other = found["true"], found["said"]
    assert true["effects"] == ["friction"]
    assert true["values"]["o.F_c"] == pytest.approx(0.4, rel=0.1)
    assert true["left"] < 1.1
    assert other["effects"] == ["cubic_spring"]
    assert other["left"] > 2.0 * true["left"]
    assert other["deviance"] > true["deviance"] + 50.0
    (o,) = outcomes(load(folder))
    assert o.search_gap == pytest.approx(other["left"] / true["left"])
    assert drawer(o) == "search"
    command.main()
    assert "1 asked about already" in capsys.readouterr().out


def test_what_was_said_rightly_is_fitted_once(folder, monkeypatch):
    told = diagnosis((["friction"], 0.9, {"o.F_c": {"value": 0.41}}), (["cubic_spring"], 0.1, {}))
    found = asked(folder, monkeypatch, answer("single", ("friction", {"o.F_c": 0.4})), told)
    assert found["said"] == found["true"]
    assert found["true"]["status"] == "converged"


def test_outside_the_catalogue_there_is_nothing_to_fit(folder, monkeypatch):
    found = asked(folder, monkeypatch, answer("unknown", ("viv", {})), diagnosis((["friction"], 0.9, {})))
    assert "true" not in found


def test_the_best_hypothesis():
    told = diagnosis((["a"], 0.3, {}), (["b"], 0.6, {"x": 1.0}))
    assert best_hypothesis(said(told)).effects == ("b",)
    assert best_hypothesis(said(told | {"verdict": "no_significant_gap"})).effects == ()
    assert best_hypothesis(said(diagnosis())).effects == ()
