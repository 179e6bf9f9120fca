"""What to measure next: distances that no refit closes, on signals whose answer is known in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.analysis import experiment_design as design
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.settings import Settings

N, NOISE = 200, 0.1
T = np.linspace(0.0, 2.0, N)
OBSERVATIONS = gather([RawBlock(0, 0, "m.x", T, np.zeros(N), NOISE, None, True)])
PROBLEM = SimpleNamespace(
    settings=Settings(), observations=OBSERVATIONS, samples=OBSERVATIONS, runs=(None,), candidates=(),
)  # fmt: skip
SHAPE = np.sin(3.0 * T)[:, None]


def ranked(*ids, names=(), energy=0.0):
    fit = SimpleNamespace(parameters=tuple(SimpleNamespace(name=n) for n in names))
    return SimpleNamespace(hypothesis=SimpleNamespace(ids=ids, fit=fit), structured_energy=energy)


def apart(difference, slopes, spread, added=False):
    """Per reading [times the noise], of two models whose parameters p move them by the slopes."""
    two = (ranked("a", names=["p"]), ranked("b", names=["p"]))
    rest = 5.0 + 0.0 * SHAPE  # at rest: neither a clock nor a span
    signals = design._Signals((rest + difference, rest), {(0, "p"): slopes}, float(T[1]))
    squared, count = design._separation(PROBLEM, two, signals, [spread, 0.0 * spread], ("m.x",), {"m.x": NOISE}, added)
    return np.sqrt(squared / count)


def test_what_no_parameter_can_take_up_separates_in_full():
    rms = 0.3 * np.sqrt(np.mean(SHAPE**2)) / NOISE
    assert apart(0.3 * SHAPE, 0.0 * SHAPE, np.eye(1)) == pytest.approx(rms, rel=1e-3)
    assert apart(0.3 * SHAPE, np.cos(3.0 * T)[:, None], 1e3 * np.eye(1)) == pytest.approx(rms, rel=0.05)


@pytest.mark.parametrize("std", [0.01, 0.1, 1.0])
def test_what_a_parameter_may_be_off_by_takes_up_its_part(std):
    """Along one direction d = s x, of prior variance v: d^2 / (1 + v x^2)."""
    x2 = float(np.sum((SHAPE / NOISE) ** 2))
    expected = np.sqrt(0.3**2 * x2 / (1.0 + std**2 * x2) / N)
    assert apart(0.3 * SHAPE, SHAPE, std * np.eye(1)) == pytest.approx(expected, rel=1e-3)


def test_a_clock_that_is_off_is_no_difference():
    moving = SimpleNamespace(**{**vars(PROBLEM)})
    two = (ranked("a"), ranked("b"))
    late = design._Signals((SHAPE, np.sin(3.0 * (T - 2e-4))[:, None]), {}, float(T[1]))
    squared, count = design._separation(moving, two, late, [], ("m.x",), {"m.x": 1e-5}, False)
    assert np.sqrt(squared / count) < 0.3 * np.sqrt(np.mean((late.both[0] - late.both[1]) ** 2)) / 1e-5


def test_the_right_one_is_expected_to_become_surer_the_further_the_two_are_apart():
    two = (ranked("a", energy=0.1), ranked("b", energy=0.12))
    said = [design._expected_probabilities(PROBLEM, two, 1.5, 0.0, s) for s in (0.0, 0.5, 2.0, 20.0)]
    assert [now for now, _ in said] == [pytest.approx(0.6**2 + 0.4**2)] * 4
    then = [p for _, p in said]
    assert then[0] == pytest.approx(said[0][0], abs=0.02)
    assert then == sorted(then)
    assert then[-1] > 0.99


def test_the_question_is_between_hypotheses_about_something_else():
    groups = {"a": "friction", "b": "friction", "c": "leakage"}
    candidates = tuple(SimpleNamespace(id=k, group=v) for k, v in groups.items())
    problem = SimpleNamespace(settings=Settings(), candidates=candidates)
    found = [ranked("a"), ranked("b"), ranked("c"), ranked()]
    assert design.rival(found, [0.5, 0.3, 0.15, 0.05], problem) == 2
    assert design.rival(found, [0.68, 0.3, 0.01, 0.01], problem) == 1
    assert design.rival(found[:1], [1.0], problem) is None


def test_what_a_run_does_not_state_it_has_had_as_the_package_says():
    experiment = SimpleNamespace(parameter="depth", values=(0.0, 3000.0, 6000.0))
    runs = [SimpleNamespace(values={"m.depth": d}) for d in (3000.0, 0.0)]
    problem = SimpleNamespace(runs=runs, catalogue=SimpleNamespace(experiments=[experiment]))
    assert design._changes(problem) == [{}, {"depth": 6000.0}]
