"""What a campaign says is held against the package before anything is simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load
from deepsea_cosim.gap.cli import main
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.master.parallel.pool import Pool

from tests.gap.oscillator import campaign, measure


def run() -> np.ndarray:
    return measure(1, lambda t, x, v: -300.0 * x**3)


@pytest.mark.parametrize(
    ("factors", "told"),
    [
        ([1e3, 1.0, 1.0], ["run 'run0'", "is time in seconds?", 'time_unit = "ms"']),
        ([1e6, 1.0, 1.0], ["run 'run0'", "is time in seconds?", 'time_unit = "us"']),
        ([1.0 / 60.0, 1.0, 1.0], ["is time in minutes?", "'time_unit'"]),
        ([1e-9, 1.0, 1.0], ["run 'run0' lasts", "less than a step of the model", "'time_unit'"]),
        ([1.0, 1.0, 1.0 / 25.4], ["channel 'x'", "is it in inch?", "'unit'"]),
        ([1.0, 1e-3, 1.0], ["is the input 'u' in kN?", "'unit'"]),
    ],
    ids=["ms", "us", "minutes", "seconds of ns", "inches", "kN"],
)
def test_units_of_a_driven_run(
    toys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], factors: list[float], told: list[str]
) -> None:
    path = campaign(tmp_path, toys, [run() * factors])
    if factors[2] != 1.0:
        path.write_text(path.read_text().replace("noise_std = 0.2\n", "noise_std = 0.01\n"))
    assert main(["diagnose", str(path), "--out", str(tmp_path / "d"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert all(text in error for text in ["campaign.toml", *told])
    assert error.strip().count("\n") == 0


def test_a_boolean_is_no_number(toys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign(tmp_path, toys, [run()])
    path.write_text(path.read_text().replace('file = "run0.csv"', 'file = "run0.csv"\nparameters = { "o.k" = true }'))
    assert main(["diagnose", str(path), "--out", str(tmp_path / "d"), "--quiet"]) == 2
    assert "o.k = True is not a number" in capsys.readouterr().err


def test_an_accepted_effect_is_of_the_catalogue(toys: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign(tmp_path, toys, [run()], head='accept = ["cubic_sprin"]\n')
    assert main(["diagnose", str(path), "--out", str(tmp_path / "d"), "--quiet"]) == 2
    assert "accept: no effect 'cubic_sprin' in the catalogue; did you mean 'cubic_spring'" in capsys.readouterr().err


def test_a_run_lasts_to_its_last_sample_where_means_are_compared(toys: Path, tmp_path: Path) -> None:
    """The last mean ends before that: the model would be held where its run ends."""
    t = np.arange(12001) * 1e-3
    told = read(campaign(tmp_path, toys, [np.column_stack([t, np.zeros(len(t)), 1e-3 * t])]))
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, load(told.effects), pool)
    (block,) = problem.observations.series
    assert block.members is not None
    assert block.members[-1, -1] > block.t[-1]
    assert problem.runs[0].stop >= block.members[-1, -1]
