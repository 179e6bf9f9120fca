"""The scorer's arithmetic on hand-made answers and diagnoses."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from benchmarks.blind import score as module
from benchmarks.blind.records import Record
from benchmarks.blind.run import diagnose
from benchmarks.blind.score import as_csv
from benchmarks.blind.scoring.calibration import calibration_error, relative_brier, reliability, sure_error
from benchmarks.blind.scoring.drawers import drawer
from benchmarks.blind.scoring.names import in_group, plain, same_set
from benchmarks.blind.scoring.outcome import Share, outcomes
from benchmarks.blind.scoring.report import as_markdown, as_text
from benchmarks.blind.scoring.table import quantiles, score
from benchmarks.blind.scoring.true import Truth


def effect(id, *alike, channel=None, form=None, **library):
    made = {"id": id, "alike": [id, *alike], "library": {k.replace("__", "."): v for k, v in library.items()}}
    return made | ({"channel": channel} if channel else {}) | ({"form": form} if form else {})


def answer(kind, *effects, size=5.0, left=None, shares=None):
    """left: RMS that a refit leaves, without noise."""
    made = {"case": 0, "seed": 1, "kind": kind, "effects": list(effects), "size": size}
    if shares is not None or left is not None or len(effects) == 1:
        left = size if left is None else left
        made["budget"] = {"calibrated": (1.0 + left**2) ** 0.5, "shares": shares or [1.0] * len(effects)}
    return made


def part(share, *effects, p=0.9, ci95=None, **parameters):
    kind = "effect" if effects else "unexplained"
    made = {"kind": kind, "share": share, "effects": list(effects), "inclusion_probability": p}
    made["parameters"] = {k.replace("__", "."): {"value": 0.0, "ci95": v} for k, v in parameters.items()}
    return made | ({"ci95": ci95} if ci95 else {})


def diagnosis(effects, *parts, hypotheses=(), wall=10.0, first=5.0):
    """effects: inclusion probabilities; hypotheses: (effects, probability, left)."""
    return {
        "schema": 2,
        "verdict": "explained_in_part",
        "budget": {"noise": 1.0, "delivered": 9.0, "calibrated": 5.0, "explained": 1.1, "parts": list(parts)},
        "effects": {name: {"inclusion_probability": p, "share": 0.0} for name, p in effects.items()},
        "hypotheses": [{"effects": list(e), "probability": p, "left": left} for e, p, left in hypotheses],
        "reduction": {"value": 0.9, "ci95": [0.8, 0.95]},
        "timing": {"wall_s": wall, "first_budget_s": first},
    }


def outcome(a, d, oracle=None, case="case_0000"):
    return outcomes([Record(case, a, d, oracle)])[0]


def fit(effects, left, deviance):
    return {"effects": list(effects), "left": left, "deviance": deviance}


def test_names_with_channels():
    assert plain("sensor_bias(arm.x_h)") == plain("sensor_bias:arm.x_h") == ("sensor_bias", "arm.x_h")
    assert plain("payload_error") == ("payload_error", "")
    assert same_set(("sensor_bias(arm.x_h)",), ("sensor_bias",))
    assert not same_set(("sensor_bias(arm.x_h)",), ("sensor_bias(hydraulics.P1)",))
    assert same_set(("a", "b"), ("b", "a"))
    assert not same_set(("a",), ("a", "b"))
    timing = {"sensor_delay", "sensor_lag", "command_delay"}
    assert in_group("sensor_delay(arm.x_h)", timing, "command_delay")
    assert in_group("sensor_delay(arm.x_h)", timing, "sensor_lag(arm.x_h)")
    assert not in_group("sensor_delay(arm.x_h)", timing, "sensor_lag(arm.v_h)")


def test_one_effect():
    a = answer("single", effect("payload_error", "buoyancy_error"))
    right = outcome(a, diagnosis({"payload_error": 0.9, "viv": 0.1}))
    assert right.exact
    assert [hit for _, hit in right.hits] == [True]
    assert right.rights == [True]
    near = outcome(a, diagnosis({"buoyancy_error": 0.6, "payload_error": 0.4}))
    assert not near.exact
    assert [hit for _, hit in near.hits] == [True]
    assert near.rights == [True]
    both = outcome(a, diagnosis({"payload_error": 0.9, "other": 0.7}))
    assert not both.exact
    assert both.rights == [True, False]
    missed = outcome(a, diagnosis({"payload_error": 0.4}))
    assert [hit for _, hit in missed.hits] == [False]
    assert missed.rights == []


def test_a_group_may_be_said_where_no_member_is():
    a = answer("single", effect("a", "b"))
    o = outcome(a, diagnosis({"a": 0.45, "b": 0.45}, part(0.9, "a", "b", p=0.9), part(0.1)))
    assert o.said.statements == (("a", "b"),)
    assert o.rights == [True]
    assert [hit for _, hit in o.hits] == [True]
    assert not o.exact


def test_what_is_too_small_counts_neither_as_missed_nor_as_false():
    small = answer("pair", effect("a"), effect("b"), left=10.0, shares=[0.95, 0.05])
    o = outcome(small, diagnosis({"a": 0.9}))
    assert o.exact
    assert [e.name for e, _ in o.hits] == ["a"]
    too = outcome(small, diagnosis({"a": 0.9, "b": 0.9}))
    assert too.exact
    assert too.rights == [True]
    assert too.probabilities == [(0.9, True)]
    faint = outcome(answer("single", effect("a"), size=0.4), diagnosis({}))  # 1.08 times the noise
    assert faint.exact
    assert faint.hits == []


def test_without_a_true_budget_sizes_tell_the_shares():
    a = answer("pair", effect("a") | {"size": 9.0, "size_net": 6.0}, effect("b") | {"size": 8.0, "size_net": 1.0})
    o = outcome(a, diagnosis({"a": 0.9}))
    assert [e.name for e, _ in o.hits] == ["a"]
    assert [e.share for e in Truth.of(a).effects] == pytest.approx([36 / 37, 1 / 37])
    without = answer("pair", effect("a"), effect("b"))
    assert [e.share for e in Truth.of(without).effects] == [None, None]


def test_nothing_wrong_and_outside_the_catalogue():
    nothing = answer("none", size=0.0)
    assert outcome(nothing, diagnosis({"a": 0.1})).exact
    assert outcome(nothing, diagnosis({"a": 0.6})).false_alarm
    strange = answer("unknown", effect("viv"))
    o = outcome(strange, diagnosis({"a": 0.2}, part(0.3, "a", p=0.2), part(0.7)))
    assert o.unexplained_largest
    assert o.exact
    assert not outcome(strange, diagnosis({}, part(0.8, "a"), part(0.2))).unexplained_largest
    assert o.shares == [Share(0.0, 0.3), Share(1.0, 0.7)]
    assert o.probabilities == [(0.2, False)]
    # an effect of the same name as one outside the catalogue is no hit
    assert outcome(strange, diagnosis({"viv": 0.9})).rights == [False]


def test_shares_are_compared_up_to_the_group():
    a = answer("pair", effect("a", "b"), effect("c"), left=4.0, shares=[0.7, 0.3])
    o = outcome(a, diagnosis({}, part(0.4, "b"), part(0.2, "a"), part(0.05, "d"), part(0.15, "e"), part(0.2)))
    # a is told in two parts; c not at all; d is small; e is wrong; something is left
    found = sorted(o.shares)
    assert [s.true for s in found] == pytest.approx([0.0, 0.0, 0.3, 0.7])
    assert [s.said for s in found] == pytest.approx([0.15, 0.2, 0.0, 0.6])
    unknown = outcome(answer("pair", effect("a"), effect("b")), diagnosis({}, part(1.0, "a")))
    assert unknown.shares == []


def test_intervals():
    a = answer("single", effect("payload_error", arm__scale=1.2, arm__other=None))
    inside = part(0.9, "payload_error", ci95=[0.85, 1.0], arm__scale=[1.1, 1.25], arm__other=[0, 1])
    outside = part(0.9, "payload_error", ci95=[0.85, 0.95], arm__scale=[1.25, 1.3])
    wrong = part(0.9, "x", arm__scale=[1.25, 1.3])
    made = [outcome(a, diagnosis({"payload_error": 0.9}, p)) for p in (inside, outside, wrong)]
    assert [o.covered for o in made] == [[True], [False], []]
    assert [o.share_covered for o in made] == [[True], [False], []]


def test_calibration():
    assert calibration_error([]) is None
    assert calibration_error([(0.95, True)] * 19 + [(0.95, False)]) == pytest.approx(0.0)
    assert calibration_error([(1.0, False), (1.0, True)]) == pytest.approx(0.5)
    assert calibration_error([(0.15, False), (0.85, True)]) == pytest.approx(0.15)
    assert relative_brier([(0.25, True), *[(0.25, False)] * 3]) == pytest.approx(1.0)
    assert relative_brier([(1.0, True), (0.0, False)]) == 0.0
    assert relative_brier([(0.1, False)]) is None
    rows = reliability([(0.01, False), (0.01, False), (0.97, True), (1.0, True)])
    assert [(r["effects"], r["mean"], r["true"]) for r in rows] == [(2, 0.01, 0.0), (2, pytest.approx(0.985), 1.0)]


def test_an_effect_that_is_not_listed_has_no_probability():
    o = outcome(answer("single", effect("a")), diagnosis({"b": 0.1}))
    assert o.probabilities == [(0.1, False), (0.0, True)]


def test_the_error_that_right_probabilities_would_show():
    """One bin with n answers of p = 1/2: mean |hits / n - 1/2|, about sqrt(1 / (2 pi n))."""
    for n in (25, 400):
        assert sure_error([0.5] * n) == pytest.approx((2.0 * np.pi * n) ** -0.5, rel=0.05)
    assert sure_error([1.0] * 10) == 0.0
    assert sure_error([]) is None


A, B = ("a",), ("b",)


@pytest.mark.parametrize(("drawer_", "said", "true_fit", "said_fit", "hypotheses"), [
    pytest.param("search", {"b": 0.9}, fit(A, 1.0, 100.0), fit(B, 3.0, 900.0), [(B, 0.9, 3.0)], id="not found"),
    pytest.param("search", {"b": 0.9}, fit(A, 1.0, 100.0), fit(B, 3.0, 900.0), [(A, 0.1, 2.0)], id="fitted badly"),
    pytest.param("evidence", {"b": 0.9}, fit(A, 1.0, 100.0), fit(B, 3.0, 900.0), [(A, 0.1, 1.0)], id="judged worse"),
    pytest.param("form", {}, fit(A, 5.0, 100.0), fit(B, 5.1, 900.0), [(A, 0.1, 5.0)], id="found, too much left"),
    pytest.param("form", {"b": 0.9}, fit(A, 5.9, 900.0), fit(B, 1.0, 100.0), [(B, 0.9, 1.0)], id="form"),
    pytest.param("form", {"b": 0.9}, fit(A, 3.0, 100.0), fit(B, 3.0, 104.0), [(B, 0.9, 3.0)], id="both leave much"),
    pytest.param("evidence", {"a": 0.9, "b": 0.9}, fit(A, 1.0, 100.0), fit((*A, *B), 1.0, 98.0), [], id="one more"),
    pytest.param("not identifiable", {"b": 0.9}, fit(A, 1.0, 100.0), fit(B, 1.0, 104.0), [], id="as good"),
    pytest.param("not identifiable", {}, fit(A, 1.0, 100.0), fit((), 1.0, 104.0), [], id="as good without"),
    pytest.param("", {"a": 0.9}, fit(A, 1.0, 100.0), fit(A, 1.0, 100.0), [], id="right"),
])  # fmt: skip
def test_drawers(drawer_, said, true_fit, said_fit, hypotheses):
    told = diagnosis(said, hypotheses=hypotheses)
    o = outcome(answer("single", effect("a")), told, {"true": true_fit, "said": said_fit})
    assert drawer(o) == drawer_
    assert o.search_gap == said_fit["left"] / true_fit["left"]


def test_drawers_of_other_cases():
    assert drawer(outcome(answer("single", effect("a")), diagnosis({}))) == "oracle not asked"
    assert drawer(outcome(answer("single", effect("a")), None)) == "failed"
    assert drawer(outcome(answer("unknown", effect("viv")), diagnosis({"a": 0.9}))) == "outside the catalogue"
    alarm = outcome(
        answer("none", size=0.0), diagnosis({"a": 0.9}), {"true": fit((), 1.2, 300.0), "said": fit(A, 1.0, 100.0)}
    )
    assert drawer(alarm) == "evidence"


def cases():
    known = answer("single", effect("a", "b"), size=3.0)
    small = answer("single", effect("a", "b"), size=0.5)
    strange = answer("unknown", effect("viv"), size=12.0)
    pair = answer("pair", effect("a"), effect("d", form="bent"), size=2.0, left=4.0, shares=[0.55, 0.45])
    right = diagnosis({"a": 0.9, "z": 0.0}, part(0.8, "a"), part(0.2), wall=5.0)
    return [
        outcome(known, right, {"true": fit("a", 1.0, 1.0), "said": fit("a", 1.04, 1.0)}),
        outcome(small, diagnosis({"a": 0.1}, part(1.0), wall=15.0)),
        outcome(pair, diagnosis({"d": 1.0}, part(0.45, "d"), part(0.55))),
        outcome(answer("none", size=0.0), diagnosis({"a": 0.8})),
        outcome(answer("none", size=0.0), diagnosis({"a": 0.1})),
        outcome(strange, diagnosis({}, part(0.1, "a", p=0.1), part(0.9))),
        outcome(answer("unknown", effect("viv"), size=1.0), None, case="case_0009"),
    ]


def test_scores_of_a_set():
    made = cases()
    s = score(made)
    assert (s["cases"], s["failed"]) == (7, 1)
    assert s["recall"] == {"hits": 2, "of": 4, "share": 0.5}
    assert s["precision"] == {"hits": 2, "of": 3, "share": pytest.approx(2 / 3)}
    assert s["precision_known"]["share"] == 1.0
    assert s["exact_single"] == {"hits": 1, "of": 1, "share": 1.0}
    assert s["exact_several"] == {"hits": 0, "of": 1, "share": 0.0}
    assert s["false_alarms"]["share"] == 0.5
    assert s["unexplained_largest"] == {"hits": 1, "of": 1, "share": 1.0}
    assert s["search_gap"] == {"hits": 1, "of": 1, "share": 1.0}
    errors = [0.2, 0.2, 1.0, 1.0, 0.55, 0.0, 0.55, 0.1, 0.1]
    assert s["share_error"] == pytest.approx(np.quantile(errors, (0.5, 0.9)))
    assert s["finished_s"] == pytest.approx(np.quantile([5, 15, 10, 10, 10, 10], (0.5, 0.95)))
    assert s["first_budget_s"][0] == 5.0
    found = {r["what"]: r for r in s["by_effect"]}
    assert found["d"]["exact"] == found["(another form)"]["exact"] == 1.0
    assert found["(plain form)"]["cases"] == 3
    assert [r["of"] for r in s["by_share"]] == [0, 0, 2, 0, 2]
    assert {w["case"] for w in s["wrong"]} == {"case_0000", "case_0009"}
    assert len(s["wrong"]) == 4
    assert quantiles([float("nan")], (0.5,)) is None
    json.dumps(s)
    assert "a 55% + d, bent 45%" in as_text(s)
    assert "| true share | effects | found, up to the group |" in as_markdown(s)
    assert score([])["recall"]["share"] is None
    as_text(score([]))


def test_diagnoses_of_schema_1_are_read_as_history():
    told = {
        "verdict": "explained",
        "causes": [
            {"effects": ["a", "b"], "probability": 0.5, "parameters": {"x.y": {"value": 1.0, "ci95": [0.5, 1.5]}}},
            {"effects": ["a"], "probability": 0.3},
            {"effects": ["unknown"], "probability": 0.2},
        ],
        "gap": {"after_calibration": 8.0, "after": 1.0, "reduction": 0.9},
        "timing": {"wall_s": 31.0},
        "evidence": {"hypotheses": [{"effects": ["a"], "fit_rms": 1.5}]},
    }
    a = answer("pair", effect("a", x__y=1.2), effect("b"), left=5.0, shares=[0.6, 0.4])
    o = outcome(a, told)
    assert o.said.probabilities == {"a": 0.8, "b": 0.5}
    assert o.exact
    assert o.covered == [True]
    assert o.shares == []
    assert o.said.hypotheses[1].left == 1.5
    assert o.said.calibrated == 8.0


def test_channels_of_a_hypothesis_stand_in_its_label():
    told = diagnosis({"sensor_lag": 0.9, "a": 0.8}, hypotheses=[(("a", "sensor_lag"), 0.9, 1.0), ((), 0.1, 3.0)])
    told["hypotheses"][0]["label"] = "sensor_lag(arm.x_h) + a"
    told["hypotheses"][1]["label"] = "refit of the base parameters"
    o = outcome(answer("pair", effect("a"), effect("sensor_lag", channel="arm.x_h"), left=5.0, shares=[0.5, 0.5]), told)
    assert [h.effects for h in o.said.hypotheses] == [("sensor_lag(arm.x_h)", "a"), ()]
    assert o.exact


def test_files(tmp_path, monkeypatch, capsys):
    (tmp_path / "answers").mkdir()
    for k, d in ((0, diagnosis({"a": 0.9})), (1, None)):
        (tmp_path / "answers" / f"case_{k:04d}.json").write_text(json.dumps(answer("single", effect("a"))))
        if d:
            folder = tmp_path / "diagnoses" / f"case_{k:04d}"
            folder.mkdir(parents=True)
            (folder / "diagnosis.json").write_text(json.dumps(d))
    monkeypatch.setattr(sys, "argv", ["score", str(tmp_path), "--json", str(tmp_path / "s.json")])
    module.main()
    assert "recall" in capsys.readouterr().out
    assert json.loads((tmp_path / "s.json").read_text())["exact_single"]["share"] == 1.0


def test_rows_of_cases():
    head, *rows = as_csv(cases()).splitlines()
    found = [dict(zip(head.split(","), row.split(","), strict=True)) for row in rows]
    assert [row["exact"] for row in found] == ["1", "0", "0", "0", "1", "1", "0"]
    assert found[2]["missed"] == "1"
    assert found[3]["false"] == "1"


def test_a_case_that_fails_is_marked(tmp_path):
    case = tmp_path / "case_0000"
    case.mkdir()
    name, _, fault = diagnose([sys.executable], case, tmp_path / "out", 20.0)
    assert name == "case_0000"
    assert fault.startswith("exit code")
    assert (tmp_path / "out" / "failed.txt").read_text().startswith("exit code")
