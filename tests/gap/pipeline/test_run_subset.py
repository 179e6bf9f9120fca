"""Campaigns of many runs, whose search begins on some of them."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.pipeline import run_subset
from deepsea_cosim.gap.pipeline.run_subset import choose_runs
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.result.document import document
from deepsea_cosim.gap.settings import DEFAULT
from deepsea_cosim.master.parallel.pool import Pool

from tests.gap.oscillator import campaign, measure, pushed

FEW = replace(DEFAULT, search=replace(DEFAULT.search, many_runs=1, some_runs=1))


def rubs(t, x, v):
    return -0.4 * np.tanh(v / 0.01)


def stiffens(t, x, v):
    return -300.0 * x**3


@pytest.fixture
def posed(toys, tmp_path):
    """Three runs, the last under another load, of which two state their mass."""
    path = campaign(tmp_path, toys, [measure(seed, rubs) for seed in (1, 2, 3)])
    runs = path.read_text().split("[[run]]\n")
    stated = [runs[1], *(run + f"[run.parameters]\n'o.m' = {m}\n" for run, m in zip(runs[2:], (2.0, 4.0), strict=True))]
    path.write_text("[[run]]\n".join([runs[0], *stated]))
    told = read(path)
    with Pool(told.system, processes=1) as pool:
        yield build_problem(told, load(told.effects), pool)


def test_a_part_of_a_problem_answers_as_the_whole_does_there(posed):
    part = posed.of_runs([0, 2])
    at = posed.observations.entries([0, 2])
    point = {"o.m": 0.5}
    whole = posed.evaluate([point])[0]
    np.testing.assert_array_equal(part.evaluate([point])[0], whole[at])
    np.testing.assert_array_equal(part.observations.whiten(whole[at]), posed.observations.whiten(whole)[at])
    assert [b.run for b in part.observations.blocks] == [0, 1]
    assert set(part.observations.run) == {0, 1}
    np.testing.assert_array_equal(part.observations.span, posed.observations.span)
    assert [r.name for r in part.campaign.runs] == [r.name for r in part.runs] == [posed.runs[k].name for k in (0, 2)]


def test_the_runs_to_begin_with_are_missed_most_and_differ(posed):
    residual = np.ones(len(posed.observations))
    residual[posed.observations.run == 1] = 3.0
    assert choose_runs(posed, residual, 1) == [1]
    assert choose_runs(posed, residual, 2) == [1, 2], "the first has the same mass as the second"
    residual[posed.observations.run == 0] = 30.0
    assert choose_runs(posed, residual, 3) == [0, 1, 2]


def test_what_is_found_on_some_runs_is_fitted_to_all(toys, tmp_path):
    told = read(campaign(tmp_path, toys, [measure(seed, rubs) for seed in (1, 2)]))
    stages, known = [], []
    data = document(diagnose(told, processes=1, settings=FEW, on_stage=stages.append, on_finding=known.append))
    assert "fitting the best sets to all runs" in stages
    assert "on 1 of 2 runs" in known[0]
    assert "of 2 runs" not in known[-1]
    assert data["verdict"] == "explained"
    assert len(data["budget"]["per_run"]) == 2
    assert data["budget"]["explained"] < 1.15
    assert data["hypotheses"][0]["parameters"]["o.F_c"]["value"] == pytest.approx(0.4, rel=0.02)


def test_what_shows_in_other_runs_only_is_found_on_these(toys, tmp_path, monkeypatch):
    small = measure(1, stiffens, push=lambda t, s: 0.05 * pushed(t, s))
    told = read(campaign(tmp_path, toys, [small, measure(3, stiffens)]))
    asked = []

    def first_small(problem, residual, count):
        asked.append(choose_runs(problem, residual, count))
        return [0] if len(asked) == 1 else asked[-1]

    monkeypatch.setattr(run_subset, "choose_runs", first_small)
    blind = replace(FEW, search=replace(FEW.search, fitted_to_all=1))  # to noise one effect is as good as another
    found = document(diagnose(told, processes=1, settings=blind))
    assert asked[1:] == [[1]]
    assert found["hypotheses"][0]["effects"] == ["cubic_spring"]
    assert found["budget"]["explained"] < 1.1


def test_a_diagnosis_that_is_stopped_on_some_runs_says_so(toys, tmp_path):
    told = read(campaign(tmp_path, toys, [measure(seed, rubs) for seed in (1, 2)]))
    known = []
    made = diagnose(told, processes=1, settings=FEW, stop=StopToken(lambda: bool(known)), on_finding=known.append)
    assert any("found on 1 of 2 runs" in w for w in document(made)["warnings"])
