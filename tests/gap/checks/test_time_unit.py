"""Times of driven runs in another unit than the campaign says; the machine follows its command in half a second."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.campaign import CampaignError
from deepsea_cosim.gap.checks.time_unit import check_time
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.settings import DEFAULT
from deepsea_cosim.master.parallel.pool import Job
from scipy.signal import lfilter

STEP = 0.01
T = np.arange(0.0, 20.0, 0.05)
COMMAND = np.sign(np.sin(2.0 * np.pi * T / 7.0))


def follow(job: Job, lag: float) -> np.ndarray:
    """Rows of a lag of first order that a job's input drives; without a lag the input itself."""
    t, u = job.inputs["m.u"]
    grid = np.arange(round(job.stop / job.step) + 1) * job.step
    u = np.interp(grid, t, u)
    if lag == 0.0:
        return u[:, None]
    keep = np.exp(-job.step / lag)
    return np.asarray(lfilter([0.0, 1.0 - keep], [1.0, -keep], u))[:, None]


def problem(f: float, lag: float = 0.5, stated: str | None = None, scenario: float | None = None) -> Any:
    """The machine, measured with a lag a tenth longer than the model's; times are taken to be f times what they are."""
    truth = follow(Job(("m.x",), T[-1], STEP, {}, {"m.u": (T, COMMAND)}), 1.1 * lag)[:, 0]
    y = np.interp(T, np.arange(len(truth)) * STEP, truth) + np.random.default_rng(0).normal(0.0, 0.01, len(T))
    t = f * T
    run = SimpleNamespace(name="run01", series={"m.x": (t, y), "m.u": (t, COMMAND)}, time_unit=stated)
    campaign = SimpleNamespace(runs=[run], outputs=[SimpleNamespace(connector="m.x")], file="campaign.toml")
    return SimpleNamespace(
        settings=DEFAULT, campaign=campaign, macro_step=STEP, scenario_stop=scenario, connectors=("m.x",),
        runs=[SimpleNamespace(name="run01", stop=float(t[-1]), inputs={"m.u": (t, COMMAND)})],
        observations=gather([RawBlock(0, 0, "m.x", t, y, 0.01, None, True)]),
        discretisation=SimpleNamespace(method=None), overrides=lambda run, point: {},
        simulator=SimpleNamespace(simulate=lambda jobs: [follow(job, lag) for job in jobs]),
    )  # fmt: skip


@pytest.mark.parametrize(("f", "stated", "better"), [(1e3, None, "ms"), (1e-3, "ms", "s"), (1e3, "ms", "us")])
def test_the_model_follows_the_readings_in_another_unit_only(f: float, stated: str | None, better: str) -> None:
    with pytest.raises(CampaignError, match="run01") as error:
        check_time(problem(f, stated=stated))
    assert f'time_unit = "{better}"' in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("stated", [None, "s", "ms"])
def test_times_as_they_are(stated: str | None) -> None:
    assert check_time(problem(1.0, stated=stated, scenario=0.02)) == []


def test_who_states_seconds_is_only_warned() -> None:
    assert "ms" in check_time(problem(1e3, stated="s"))[0]


def test_a_machine_that_is_the_same_at_any_speed() -> None:
    """Only the scenario's length tells; a slow logger is asked about, no more."""
    (warning,) = check_time(problem(1e3, lag=0.0, scenario=300.0))
    assert 'time_unit = "ms"' in warning
    with pytest.raises(CampaignError, match="scenario"):
        check_time(problem(1e3, lag=0.0, scenario=20.0))


def test_a_slow_machine_that_is_read_seldom() -> None:
    """Readings 5000 macro steps apart of a machine that takes ten minutes."""
    slow = problem(1e3, lag=0.5)
    slow.simulator.simulate = lambda jobs: [follow(job, 500.0) for job in jobs]
    assert check_time(slow) == []
