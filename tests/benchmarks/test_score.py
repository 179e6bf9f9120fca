"""The scorer's arithmetic on hand-made answers and diagnoses."""

import json
import sys

import numpy as np
import pytest

from benchmarks.blind import score as module
from benchmarks.blind.report import as_markdown, as_text
from benchmarks.blind.run import diagnose
from benchmarks.blind.score import Outcome, Said, Truth, as_csv, calibration_error, plain, same, score, sure_error


def answer(kind, *effects, size=5.0):
    made = [
        {"id": id, "alike": alike, "channel": channel, "library": library} for id, alike, channel, library in effects
    ]
    return {"kind": kind, "effects": made, "size": size}


def effect(id, *alike, channel=None, **library):
    return id, [id, *alike], channel, {k.replace("__", "."): v for k, v in library.items()}


def diagnosis(verdict, *causes, probabilities=None, wall=10.0):
    listed = []
    for names, probability, *more in causes:
        entry = {"effects": names, "probability": probability}
        listed.append(entry | (more[0] if more else {}))
    made = {"verdict": verdict, "causes": listed, "gap": {"reduction": 0.9}, "timing": {"wall_s": wall}}
    return made | ({"probabilities": probabilities} if probabilities else {})


def outcome(a, d, case="case_0000"):
    return Outcome(case, Truth.of(a), Said.of(d))


def test_names_with_channels():
    assert plain("sensor_bias(arm.x_h)") == plain("sensor_bias:arm.x_h") == ("sensor_bias", "arm.x_h")
    assert plain("payload_error") == ("payload_error", "")
    assert same(("sensor_bias(arm.x_h)",), ("sensor_bias",))
    assert not same(("sensor_bias(arm.x_h)",), ("sensor_bias(hydraulics.P1)",))
    assert same(("a", "b"), ("b", "a"))
    assert not same(("a",), ("a", "b"))


def test_single_effect():
    a = answer("single", effect("payload_error", "buoyancy_error"))
    right = outcome(a, diagnosis("explained", (["payload_error"], 0.8), (["none"], 0.2)))
    assert right.exact
    assert right.grouped
    assert right.brier() == pytest.approx(0.2**2 + 0.2**2)
    near = outcome(a, diagnosis("explained", (["buoyancy_error"], 0.6), (["payload_error"], 0.4)))
    assert not near.exact
    assert near.grouped
    assert near.brier() == pytest.approx(0.6**2 + 0.6**2)
    called = outcome(a, diagnosis("explained", (["x"], 1.0, {"ambiguous_with": ["y", "payload_error"]})))
    assert called.grouped
    assert not called.exact
    missed = outcome(a, diagnosis("no_significant_gap", (["payload_error"], 0.1), probabilities={"none": 0.9}))
    assert missed.said.names == ("none",)
    assert not missed.grouped
    assert missed.said.top == (("none",), 0.9)
    too_many = outcome(a, diagnosis("explained", (["payload_error", "x"], 1.0)))
    assert not too_many.exact
    assert not too_many.grouped
    assert too_many.partial


def test_pair():
    a = answer("pair", effect("a", "c"), effect("b", "d"))
    both = outcome(a, diagnosis("explained", (["b", "a"], 1.0)))
    assert both.exact
    assert both.brier() == 0.0
    alike = outcome(a, diagnosis("explained", (["d", "a"], 1.0)))
    assert alike.grouped
    assert alike.partial
    assert not alike.exact
    crossed = outcome(a, diagnosis("explained", (["a", "c"], 1.0)))
    assert not crossed.grouped
    one = outcome(a, diagnosis("explained", (["a"], 1.0)))
    assert one.partial
    assert not one.grouped


def test_none_and_unknown():
    nothing = answer("none", size=0.0)
    assert outcome(nothing, diagnosis("no_significant_gap", (["none"], 1.0))).exact
    assert not outcome(nothing, diagnosis("explained", (["x"], 1.0))).exact
    strange = answer("unknown", effect("viv"))
    assert outcome(strange, diagnosis("unknown_effect", (["unknown"], 0.7), (["x"], 0.3))).exact
    assert not outcome(strange, diagnosis("explained", (["x"], 1.0))).grouped


def test_coverage_counts_intervals_of_exact_causes_only():
    a = answer("single", effect("payload_error", arm__scale=1.2, arm__other=None))
    inside = {"parameters": {"arm.scale": {"value": 1.19, "ci95": [1.1, 1.25]}, "arm.other": {"ci95": [0, 1]}}}
    outside = {"parameters": {"arm.scale": {"value": 1.3, "ci95": [1.25, 1.35]}}}
    made = [
        outcome(a, diagnosis("explained", (["payload_error"], 1.0, inside))),
        outcome(a, diagnosis("explained", (["payload_error"], 1.0, outside))),
        outcome(a, diagnosis("explained", (["x"], 1.0, outside))),
    ]
    assert score(made)["coverage"] == {"hits": 1, "of": 2, "share": 0.5}


def test_calibration_error():
    assert calibration_error([]) is None
    assert calibration_error([(0.95, True)] * 19 + [(0.95, False)]) == pytest.approx(0.0)
    assert calibration_error([(1.0, False), (1.0, True)]) == pytest.approx(0.5)
    assert calibration_error([(0.15, False), (0.85, True)]) == pytest.approx(0.15)


def test_scores_of_a_set():
    known = answer("single", effect("a", "b"), size=3.0)
    small = answer("single", effect("a", "b"), size=0.5)
    made = [
        outcome(known, diagnosis("explained", (["a"], 1.0), wall=5.0)),
        outcome(small, diagnosis("no_significant_gap", (["none"], 1.0), wall=15.0)),
        outcome(answer("pair", effect("a"), effect("d"), size=2.0), diagnosis("explained", (["d"], 1.0))),
        outcome(answer("none", size=0.0), diagnosis("explained", (["a"], 1.0))),
        outcome(answer("none", size=0.0), diagnosis("no_significant_gap", (["none"], 1.0))),
        outcome(answer("unknown", effect("viv"), size=12.0), diagnosis("unknown_effect", (["unknown"], 1.0))),
        outcome(answer("unknown", effect("viv"), size=1.0), None, case="case_0009"),
    ]
    s = score(made, {"case_0009": ("[viv]",)})
    assert (s["cases"], s["failed"]) == (7, 1)
    assert s["exact_top1"] == {"hits": 1, "of": 3, "share": pytest.approx(1 / 3)}
    assert s["exact_top1_clear"]["share"] == 0.5
    assert s["pair_partial"]["share"] == 1.0
    assert s["false_alarms"]["share"] == 0.5
    assert s["unknown_recall"]["share"] == 0.5
    assert s["unknown_recall_clear"]["share"] == 1.0
    assert s["unknown_false"]["hits"] == 0
    assert s["brier"] == pytest.approx((0 + 2 + 2 + 2 + 0 + 0) / 6)
    assert s["calibration_error"] == pytest.approx(3 / 6)
    assert s["wall_s"]["most"] == 15.0
    sizes = {r["what"]: r for r in s["by_size"]}
    assert sizes["2-5"]["cases"] == 2
    assert sizes["2-5"]["exact"] == 0.5
    assert sizes["0.3-1"]["said none"] == 1.0
    assert {"true": "a + d", "said": "d", "cases": 1} in s["confusions"]
    assert {"true": "[viv]", "said": "failed", "cases": 1} in s["confusions"]
    json.dumps(s)
    assert "a + d  ->  d" in as_text(s)
    assert "| a + d | d | 1 |" in as_markdown(s)


def test_files(tmp_path, monkeypatch, capsys):
    (tmp_path / "answers").mkdir()
    for k, d in ((0, diagnosis("explained", (["a"], 1.0))), (1, None)):
        (tmp_path / "answers" / f"case_{k:04d}.json").write_text(json.dumps(answer("single", effect("a"))))
        if d:
            folder = tmp_path / "diagnoses" / f"case_{k:04d}"
            folder.mkdir(parents=True)
            (folder / "diagnosis.json").write_text(json.dumps(d))
    monkeypatch.setattr(sys, "argv", ["score", str(tmp_path), "--json", str(tmp_path / "s.json")])
    module.main()
    assert "exact top-1" in capsys.readouterr().out
    assert json.loads((tmp_path / "s.json").read_text())["exact_top1"]["share"] == 1.0


def test_rows_of_cases():
    a = answer("single", effect("payload_error", "buoyancy_error"))
    text = as_csv([outcome(a, diagnosis("explained", (["payload_error"], 0.8), (["none"], 0.2)))], {})
    head, row = text.splitlines()
    assert dict(zip(head.split(","), row.split(","), strict=True))["right"] == "1"


def test_a_case_that_fails_is_marked(tmp_path):
    case = tmp_path / "case_0000"
    case.mkdir()
    name, _, fault = diagnose([sys.executable], case, tmp_path / "out", 20.0)
    assert name == "case_0000"
    assert fault.startswith("exit code")
    assert (tmp_path / "out" / "failed.txt").read_text().startswith("exit code")


def test_the_error_that_right_probabilities_would_show():
    """One bin with n answers of p = 1/2: mean |hits / n - 1/2|, about sqrt(1 / (2 pi n))."""
    for n in (25, 400):
        assert sure_error([0.5] * n) == pytest.approx((2.0 * np.pi * n) ** -0.5, rel=0.05)
    assert sure_error([1.0] * 10) == 0.0
    assert sure_error([]) is None
