"""What a campaign states of its clocks and of its base parameters gets into the estimation."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.campaign import FactorTolerance
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.noise import estimate_noise_std
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.problem.step_size import assess_step_error
from deepsea_cosim.gap.result.parameters import moved_base
from deepsea_cosim.gap.search.baseline import refit_base, simulate_nominal
from deepsea_cosim.gap.settings import NoiseSettings
from deepsea_cosim.master.parallel.pool import Pool

from tests.gap.oscillator import campaign, measure

RATE = 100.0
T = np.arange(0.0, 20.0, 1.0 / RATE)
SPEED, NOISE = 0.05, 1e-5


@pytest.mark.parametrize(("stated", "jitter"), [(None, 0.03 / RATE), (2e-3, 2e-3), (0.0, 0.0)])
def test_clock_jitter_makes_noise_of_the_slope(stated: float | None, jitter: float) -> None:
    block = RawBlock(0, 0, "m.x", T, SPEED * T, NOISE, None, True, stated)
    made = gather([block]).with_numerical_error(SPEED * T, np.zeros(len(T)))
    assert made.noise_std == pytest.approx(np.hypot(NOISE, jitter * SPEED), rel=1e-6)


def test_noise_at_uneven_times() -> None:
    """The stamps of a clock that jitters are right: what the machine moved in between is no noise."""
    rng = np.random.default_rng(2)
    t = T + np.r_[0.0, rng.normal(0.0, 0.03 / RATE, len(T) - 1)]
    y = SPEED * t + 0.01 * np.sin(9.0 * t) + rng.normal(0.0, NOISE, len(T))
    assert estimate_noise_std(y, NoiseSettings()) > 1.5 * NOISE
    assert estimate_noise_std(y, NoiseSettings(), t) == pytest.approx(NOISE, rel=0.1)
    assert estimate_noise_std(y, NoiseSettings(), T) == estimate_noise_std(y, NoiseSettings())


def test_a_factor_is_a_logarithmic_scale() -> None:
    x = EstimatedParameter("m.k", "base", 1.0, log(3.0), -1.0, 1.0, 0.6, factor=3.0)
    assert [x.value(u) for u in (-1.0, 0.0, 0.5, 1.0)] == pytest.approx([1 / 3, 1.0, 3.0**0.5, 3.0])
    assert x.tolerance_text == "a factor of 3"
    share = EstimatedParameter("m.k", "base", 1.0, 0.05, -1.0, 1.0, 0.6)
    assert (share.value(1.0), share.tolerance_text) == (1.05, "5%")


@pytest.mark.parametrize("true_stiffness", [78.0 * 2.2, 78.0 / 2.2])
def test_a_stiffness_known_to_a_factor_is_found(toys, tmp_path, true_stiffness) -> None:
    """The machine is far outside any share below 1 on one side; on the way no value becomes negative."""
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0, k=true_stiffness)])
    read_campaign = read(path)
    stated = replace(read_campaign, base={"o.k": FactorTolerance(3.0)})
    catalogue = load(tmp_path / "effects.toml")
    with Pool(stated.system, None, 1) as pool:
        assessed = assess_step_error(build_problem(stated, catalogue, pool))
        problem = assessed.problem
        jacobian = nuisance_jacobian_at(problem, assessed.nominal)
        fit = refit_base(problem, jacobian, simulate_nominal(problem, jacobian)).fit
        moved = moved_base(problem, fit, jacobian)
    delivered = problem.runs[0].values["o.k"]
    assert fit.rms < 1.1
    assert moved["o.k"]["value"] == pytest.approx(true_stiffness, rel=0.03)
    assert moved["o.k"]["change"] == pytest.approx(true_stiffness / delivered - 1.0, rel=0.1)
    assert moved["o.k"]["tolerance_factor"] == 3.0
    assert not moved["o.k"]["at_tolerance"]
    assert "tolerance_factor" not in moved["o.m"]
    assert problem.model_values(0, {"o.k": 1.0})["o.k"] == pytest.approx(3.0 * delivered)
