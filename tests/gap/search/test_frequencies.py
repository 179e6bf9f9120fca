"""Frequencies between the starts of an effect that swings the machine."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.frequencies import add_frequencies
from deepsea_cosim.gap.search.response_bank import wide_step
from deepsea_cosim.gap.search.sets import Projection
from deepsea_cosim.gap.search.sizes import frequency_of

from .made import T, bank_at, effect, first_round, posed

FREQUENCY = EstimatedParameter(
    "f", "effect", 2.0, 0.5, -3.0, 4.0, 2.0, shape=True, starts=tuple((v - 2.0) / 0.5 for v in (1.0, 1.5, 2.2, 3.2)),
    frequency=True,
)
PHASE = EstimatedParameter("phase", "effect", 0.0, 1.0, -3.2, 3.2, 2.0, shape=True, starts=(0.0, np.pi / 2))
(SIZE,) = effect("p", 0.0, 8.0).parameters
SWAY = EffectCandidate("p", "p", "p", (SIZE, FREQUENCY, PHASE))


def machine(p):
    f = FREQUENCY.value(p.get("f", 0.0))
    sway = np.sin(2.0 * np.pi * f * T + p.get("phase", 0.0)) - np.sin(p.get("phase", 0.0))
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.1 * p.get("p", 0.0) * sway


def normalised(hz):
    return (hz - 2.0) / 0.5


@pytest.mark.parametrize("hz", [1.22, 1.87, 2.9])
def test_a_frequency_far_from_all_starts_is_run_and_fitted(hz):
    """Over ten seconds the nearest start is 2.8 to 3.3 turns off at the end."""
    truth = {"p": 0.8, "f": normalised(hz), "phase": 0.7, "a": 0.3}
    p, columns = posed(machine, truth, [SWAY])
    bank = bank_at(p, simulate_nominal(p, columns).fit)
    with_frequencies = add_frequencies(p, bank, Projection.of_all(p, bank, columns))
    run = [x for x in with_frequencies.responses if x not in bank.responses]
    near = min(run, key=lambda x: abs(FREQUENCY.value(x.values["f"]) - hz))
    assert FREQUENCY.value(near.values["f"]) == pytest.approx(hz, abs=0.02)
    best = first_round(p, columns).hypotheses[0]
    assert best.candidates == (SWAY,)
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)
    assert FREQUENCY.value(best.fit.point["f"]) == pytest.approx(hz, abs=1e-3)


def test_what_the_catalogue_does_not_name_one_is_no_frequency():
    assert frequency_of(SWAY) is FREQUENCY
    assert frequency_of(effect("q")) is None
    assert frequency_of(EffectCandidate("p", "p", "p", (SIZE, PHASE))) is None


def test_a_derivative_by_a_frequency_takes_a_small_step():
    settings = posed(machine, {}, [SWAY])[0].settings.search
    assert wide_step(FREQUENCY, 0.5, settings) < 0.1 * wide_step(PHASE, 0.5, settings)
