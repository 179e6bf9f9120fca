"""True budgets: shares of what a refit leaves, on numbers made by hand and on a small case."""

from __future__ import annotations

import json
import sys

import pytest

from benchmarks.blind import readings, truth
from benchmarks.blind.draw import draw
from benchmarks.blind.generate import answer
from benchmarks.blind.records import Record, load, merge
from benchmarks.blind.ruler import Ruler
from benchmarks.blind.truth import budget, case_of, complete, left_by_subset, shapley, subsets, told

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

PAIR = 10
"""A small case of seed 1 with two effects."""


def test_subsets():
    assert subsets(0) == []
    assert subsets(1) == [()]
    assert subsets(2) == [(), (0,), (1,)]
    assert len(subsets(3)) == 7


def test_shares_of_effects_that_do_not_meet_are_their_squares():
    left = {(): 5.0, (0,): 4.0, (1,): 3.0}
    assert shapley(left, 2) == pytest.approx([9.0 / 25.0, 16.0 / 25.0])


def test_what_two_effects_do_alike_is_halved():
    """Each alone explains all: a refit with one of them has no need of the other."""
    assert shapley({(): 5.0, (0,): 0.0, (1,): 0.0}, 2) == pytest.approx([0.5, 0.5])


def test_shares_add_up_to_one_even_where_an_effect_hides_another():
    left = {(): 2.0, (0,): 3.0, (1,): 1.0, (2,): 2.0, (0, 1): 0.5, (0, 2): 2.5, (1, 2): 0.0}
    shares = shapley(left, 3)
    assert sum(shares) == pytest.approx(1.0)
    # effect 1 by its place in the six orders: first twice, after 0, after 2, last twice
    gain = (2 * (4 - 1) + (4 - 0.25) + (4 - 0) + 2 * 4) / 6 / 4
    assert shares[1] == pytest.approx(gain)
    assert min(shares) >= 0.0
    assert shapley({(): 2.0, (0,): 3.0, (1,): 0.0}, 2) == [0.0, 1.0]


def test_nothing_wrong_has_no_budget():
    assert budget({}, 0) == {"calibrated": 1.0, "shares": [], "subsets": []}
    assert shapley({(): 0.0}, 1) == [0.0]


def test_one_effect_is_the_whole_budget():
    single = sealed(2)
    found = complete(single)["budget"]
    assert found["shares"] == [1.0]
    assert found["calibrated"] == pytest.approx((1.0 + single["size"] ** 2) ** 0.5)


def sealed(index):
    case = draw(1, index, refit=False, edition=1)
    spans = Ruler(case).spans if case.wrong else {}
    return json.loads(json.dumps(answer(case, spans, 1.0)))


def test_a_case_is_rebuilt_from_its_answer():
    case = draw(1, PAIR, refit=False, edition=1)
    again = case_of(sealed(PAIR))
    assert (again.runs, again.factors, again.tolerance) == (case.runs, case.factors, case.tolerance)
    for a, b in zip(again.channels, case.channels, strict=True):
        assert (a.kind, a.noise, a.bias) == (b.kind, pytest.approx(b.noise), pytest.approx(b.bias))
    for a, b in zip(again.wrong, case.wrong, strict=True):
        assert (a.effect, a.column, a.form) == (b.effect, b.column, b.form)
        assert a.plant == pytest.approx(b.plant, rel=1e-12)


def test_a_case_of_the_second_edition_keeps_its_forms():
    entry = {"id": "valve_dynamics", "plant": {"spool_time": 0.01, "spool_rate": 5.0}, "size": 3, "form": "rate_limit"}
    wrong = truth._wrong(entry, {})
    assert wrong.form is not None
    assert wrong.form.id == "rate_limit"
    assert wrong.plant == entry["plant"]


def test_budget_of_a_pair(monkeypatch):
    """With the cheapest refit: the point where the base parameters truly are."""
    points = []

    def at_the_truth(model, target, start, tolerance, parts, enough, scan):
        points.append(start)
        return float(((target - model(start)) ** 2).mean() ** 0.5)

    monkeypatch.setattr(readings, "left_by_refit", at_the_truth)
    answer_ = sealed(PAIR)
    case = case_of(answer_)
    left = left_by_subset(case)
    ruler = Ruler(case)
    total = ruler.change(case.wrong)
    assert left[()] == pytest.approx((total**2).mean() ** 0.5, rel=1e-6)
    first = total - ruler.change(case.wrong[:1])
    assert left[(0,)] == pytest.approx((first**2).mean() ** 0.5, rel=1e-6)
    assert len(points) == 3
    assert left_by_subset(case, left) == left
    assert sum(complete(answer_)["budget"]["shares"]) == pytest.approx(1.0)


def test_command_completes_answers_and_goes_on(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "answers"
    folder.mkdir()
    (folder / "case_0002.json").write_text(json.dumps(sealed(2)))
    (folder / "case_0003.json").write_text(json.dumps(sealed(3)))
    monkeypatch.setattr(sys, "argv", ["truth", str(tmp_path)])
    truth.main()
    assert "2 answers, 0 with their budget" in capsys.readouterr().out
    assert json.loads((folder / "case_0002.json").read_text())["budget"]["shares"] == [1.0]
    assert json.loads((folder / "case_0003.json").read_text())["budget"]["shares"] == []
    record = {"case": 2, "seed": 1, "kind": "single", "size": 5.0, "effects": []}
    merge(tmp_path / "r.jsonl", [Record("case_0002", record, None), Record("case_0009", record | {"case": 9}, None)])
    monkeypatch.setattr(sys, "argv", ["truth", str(tmp_path), "--records", str(tmp_path / "r.jsonl")])
    truth.main()
    assert "2 answers, 2 with their budget" in capsys.readouterr().out
    first, other = load(tmp_path / "r.jsonl")
    assert first.answer["budget"]["shares"] == [1.0]
    assert "budget" not in other.answer
    assert told({"effects": []}) == {}
