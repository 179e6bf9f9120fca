"""Held-out runs that differ from those learned from: a channel is missing, the motion is smaller, a reading is none."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.gap.campaign import read_catalogue
from deepsea_cosim.gap.campaign.read import CampaignError, read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.estimation.nuisances import usual_bias
from deepsea_cosim.gap.pipeline import holdout, probabilities
from deepsea_cosim.gap.pipeline.holdout import HoldoutRuns, build_holdout
from deepsea_cosim.gap.pipeline.preparation import assess_steps, build_held_out_runs
from deepsea_cosim.gap.pipeline.state import initial_state
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.stop import StopRequested, StopToken
from deepsea_cosim.gap.result.document import document
from deepsea_cosim.master.parallel.pool import Pool

from tests.gap.oscillator import STOP, campaign, measure

SPEED = '[[channel]]\ncolumn = "v"\nconnector = "o.v"\nunit = "m/s"\nnoise_std = 0.02\n'


def uneven_campaign(toys, folder):
    """Two runs with position and speed; the second, held out, has no speed and less of the motion."""
    stiff = [measure(seed, lambda t, x, v: -300.0 * x**3) for seed in (7, 8)]
    path = campaign(folder, toys, stiff)
    text = path.read_text().replace('file = "run1.csv"', 'file = "run1.csv"\nuse = "holdout"')
    path.write_text(text.replace("[[run]]", SPEED + "[[run]]", 1))
    for i, run in enumerate(stiff):
        v = np.gradient(run[:, 2], run[:, 0])
        speed = ["" if i else f"{w:.9g}" for w in v]
        lines = [f"{t:.9g},{u:.9g},{1e3 * x:.9g},{w}" for (t, u, x), w in zip(run, speed, strict=True)]
        keep = lines if i == 0 else lines[: round(0.4 * len(lines))]
        (folder / f"run{i}.csv").write_text("\n".join(["time,u,x,v", *keep]) + "\n")
    return path


@pytest.fixture
def uneven(toys, tmp_path):
    return uneven_campaign(toys, tmp_path)


def test_a_channel_that_the_held_out_run_lacks(uneven):
    d = diagnose(read(uneven), processes=1)
    data = document(d)
    assert data["hypotheses"][0]["effects"] == ["cubic_spring"]
    assert set(data["budget"]["per_channel"]) == {"o.x"}
    assert data["budget"]["explained"] < 1.3
    held, problem = d.state.holdout, d.state.problem
    fit = d.state.reported.hypothesis.fit
    moved = replace(fit, nuisances=fit.nuisances + np.eye(len(fit.nuisances))[0])
    shift = held.residual_of(moved, problem) - held.residual_of(fit, problem)
    x = held.problem.observations
    # the sensor is the one of the learned runs, whose span says what its usual bias is; the clock takes next to nothing
    assert np.median(-shift * x.noise_std) == pytest.approx(usual_bias(problem, 0), rel=0.05)


def test_a_mark_for_a_missing_value_in_a_held_out_run(uneven):
    table = (uneven.parent / "run1.csv").read_text().splitlines()
    cells = table[100].split(",")
    table[100] = ",".join([*cells[:2], "-9999", cells[3]])
    (uneven.parent / "run1.csv").write_text("\n".join(table) + "\n")
    with pytest.raises(CampaignError, match=r"-9999 mm at .* is impossible"):
        diagnose(read(uneven), processes=1)


def test_the_parameter_of_a_held_out_run_may_be_what_a_base_parameter_scales(uneven):
    """With o.d = 0 there is nothing to scale in that run, but the others refit it."""
    uneven.write_text(uneven.read_text().replace('use = "holdout"', 'use = "holdout"\nparameters = { "o.d" = 0.0 }'))
    c = read(uneven)
    with Pool(c.system, None, 1) as pool:
        learned = build_problem(replace(c, runs=c.runs[:1]), read_catalogue.load(c.effects), pool)
        held = build_holdout(learned, replace(c, runs=c.runs[1:]))
        assert {x.name for x in held.problem.base} == {"o.m", "o.k", "o.d"}
        assert held.problem.exact([{"o.d": 0.5, "o.m": 0.1}])[0] is not None
    assert held.problem.runs[0].stop <= STOP


def test_what_is_noticed_about_held_out_runs_is_told(uneven, monkeypatch):
    monkeypatch.setattr(holdout, "check_campaign", lambda *_: ["odd"])
    c = read(uneven)
    with Pool(c.system, None, 1) as pool:
        state = assess_steps(initial_state(c, read_catalogue.load(c.effects), pool, StopToken()))
        assert "odd" not in state.warnings
        assert "odd" in build_held_out_runs(state).warnings


@pytest.fixture(scope="module")
def diagnosed(toys, tmp_path_factory):
    """A diagnosis with a held-out run, its processes ended."""
    return diagnose(read(uneven_campaign(toys, tmp_path_factory.mktemp("uneven"))), processes=1)


def raising(error, when=lambda fit: True):
    """In the place of the simulation of held-out runs: one that fails for some fits."""
    simulated = HoldoutRuns._simulated_residual

    def residual(self, fit, training):
        if when(fit):
            raise error
        return simulated(self, fit, training)

    return residual


def anew(state):
    """Without what was remembered of the held-out runs."""
    return replace(state, holdout=replace(state.holdout, residuals={}))


def test_what_was_simulated_of_held_out_runs_is_told_when_nothing_can_be_any_more(diagnosed):
    """Points that memory does not hold would have to be simulated again, after the processes have ended."""
    diagnosed.state.holdout.problem.simulator._cache.clear()
    assert document(diagnosed)["budget"]["held_out"].startswith("runs")


IMPOSSIBLE = SimulationError("the held-out runs cannot be simulated")


def test_a_set_that_the_held_out_runs_cannot_be_simulated_with_is_not_reported(diagnosed, monkeypatch):
    assert diagnosed.state.reported.hypothesis.candidates
    with_effects = raising(IMPOSSIBLE, lambda fit: any(x.kind != "base" for x in fit.parameters))
    known = {k: v for k, v in diagnosed.state.holdout.residuals.items() if b"k3" not in k}
    monkeypatch.setattr(HoldoutRuns, "_simulated_residual", with_effects)
    holdout = replace(diagnosed.state.holdout, residuals=known)
    shared = probabilities.share_gap(replace(diagnosed.state, holdout=holdout))
    assert not shared.reported.hypothesis.candidates
    assert any("cubic_spring is not reported" in w for w in shared.warnings)
    assert shared.holdout is not None


def test_where_calibration_makes_the_held_out_runs_impossible_the_others_serve(diagnosed, monkeypatch):
    monkeypatch.setattr(HoldoutRuns, "_simulated_residual", raising(IMPOSSIBLE))
    shared = probabilities.share_gap(anew(diagnosed.state))
    assert shared.held_out_how.startswith("stretches")
    assert any("cannot be simulated" in w for w in shared.warnings)


def test_a_set_of_which_a_part_cannot_be_simulated_is_reported_all_the_same(diagnosed, monkeypatch):
    def never(*arguments):
        raise IMPOSSIBLE

    monkeypatch.setattr(probabilities, "_residuals", never)
    shared = probabilities.share_gap(diagnosed.state)
    assert shared.reported is diagnosed.state.reported
    assert any("is not shared out" in w for w in shared.warnings)


@pytest.mark.parametrize("held_out", [True, False])
def test_a_stop_at_a_later_alternative_leaves_a_budget_of_the_same_runs(diagnosed, monkeypatch, held_out):
    state = diagnosed.state if held_out else replace(diagnosed.state, holdout=None)
    every, equal = len(state.ranked), 1.0 / len(state.ranked)
    assert every > 1
    state = replace(state, probabilities=(equal,) * every)
    residuals, calls = probabilities._residuals, []

    def stopped_at_the_second(at, *arguments):
        calls.append(at.holdout)
        if len(calls) == 2:
            raise StopRequested
        return residuals(at, *arguments)

    monkeypatch.setattr(probabilities, "_residuals", stopped_at_the_second)
    shared = probabilities.share_gap(state)
    assert calls[:2] == [state.holdout] * 2
    assert set(map(bool, calls[2:])) == {False}
    assert sum(shared.budget.effects.values()) + shared.budget.unexplained.share == pytest.approx(1.0)
