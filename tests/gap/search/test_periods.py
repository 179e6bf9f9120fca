"""Periods, found over growing stretches of a run: what is late in it is a turn off where they are a trifle wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.search.periods import find_period
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.relatives import swap_relatives
from deepsea_cosim.gap.search.widening import widen_derivatives
from deepsea_cosim.gap.selection.evidence import curvature
from deepsea_cosim.gap.selection.hypothesis import is_adequate

from .made import T, posed, start

END = float(T[-1])
TRUE = 0.0813


def period(name="held", low=0.0, high=0.3):
    """Of a controller that acts at intervals, in hundredths of a second."""
    return EstimatedParameter(name, "effect", 0.0, 0.01, low / 0.01, high / 0.01, 3.0, longest_run=END)


HELD = EffectCandidate("held", "held", "timing", (period(),))
LATE = EffectCandidate(
    "late", "late", "timing", (EstimatedParameter("late", "effect", 0.0, 0.01, 0.0, 20.0, 3.0),)
)  # fmt: skip


def machine(p):
    """A motion that is followed late, or by steps."""
    held, late = 0.01 * p.get("held", 0.0), 0.01 * p.get("late", 0.0)
    t = np.floor(T / held) * held if held > 0.0 else T - late
    moving = np.clip(t - 1.0, 0.0, None)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(1.3 * moving)


@pytest.mark.parametrize("beside", [-0.2, -0.04, 0.0, 0.11, 0.25])
def test_a_period_is_found_from_beside_it(beside):
    p, _ = posed(machine, {"held": 100.0 * TRUE, "a": 0.2}, [HELD], noise=0.005)
    point = {"a": 0.2, "held": 100.0 * TRUE * (1.0 + beside)}
    u = find_period(p, HELD.main, point)
    assert abs(0.01 * u - TRUE) < TRUE**2 / END / 16.0, "a sixteenth of a turn at the end of the run"


@pytest.mark.parametrize("high", [0.002, 0.02])
def test_a_short_period_takes_no_more_trials_than_a_long_one(high):
    """It comes again so often that its minima are a ten-thousandth apart: hours, for what a delay does as well."""
    tried = []

    def counted(p):
        tried.append(p)
        return machine(p)

    short = EffectCandidate("held", "held", "timing", (period(high=high),))
    p, _ = posed(counted, {"late": 0.3, "a": 0.2}, [short, LATE], noise=0.005)
    tried.clear()
    find_period(p, short.main, {"a": 0.2, "held": 10.0 * high})
    assert 100 < len(tried) < 1.3 * p.settings.search.period_trials


def test_a_fit_does_not_find_it_from_there():
    """Why it is looked for: pits lie 0.8 % apart."""
    p, columns = posed(machine, {"held": 100.0 * TRUE}, [HELD], noise=0.005)
    (found,) = polish(p, [start(p, columns, [HELD], {"held": 95.0 * TRUE})], columns, 5)
    assert abs(0.01 * found.fit.point["held"] - TRUE) > TRUE**2 / END


def test_a_delay_gives_way_to_the_sampling_that_it_resembles():
    """From the size of the grid that serves best, a usual one of 0.09 s."""
    usual = EstimatedParameter("held", "effect", 0.0, 0.09, 0.0, 4.0, 3.0, longest_run=END)
    sampled = EffectCandidate("held", "held", "timing", (usual,))

    def by_steps(p):
        return machine({**p, "held": 9.0 * p.get("held", 0.0)})

    p, columns = posed(by_steps, {"held": TRUE / 0.09, "a": 0.2}, [sampled, LATE], noise=0.005)
    (late,) = polish(p, [start(p, columns, [LATE], {"late": 50.0 * TRUE})], columns, 4)
    found = swap_relatives(p, [late], columns)
    assert late.fit.rms > 4.0
    assert found[0].ids == ("held",)
    assert found[0].fit.rms < 1.2, "1.0 but for the sixteenth of a turn"
    assert 0.09 * found[0].fit.point["held"] == pytest.approx(TRUE, abs=TRUE**2 / END / 16.0)


def test_a_difference_by_a_period_shifts_the_end_by_a_part_of_a_turn_only():
    x = period()
    h = x.longest_difference(8.0, 0.1)
    turns = END / x.value(8.0) - END / x.value(8.0 + h)
    assert turns == pytest.approx(0.1, rel=0.01)
    assert x.longest_difference(0.0, 0.1) == np.inf, "nothing comes again"
    assert replace(x, longest_run=0.0).longest_difference(8.0, 0.1) == np.inf


def test_a_period_is_looked_for_though_a_delay_does_as_well():
    """Both leave the noise: they share what is said, which a wrong period would not."""
    p, columns = posed(machine, {"held": 100.0 * TRUE, "a": 0.2}, [HELD, LATE], noise=0.06)
    (late,) = polish(p, [start(p, columns, [LATE], {"late": 50.0 * TRUE})], columns, 4)
    assert is_adequate(p, late.fit)
    (found,) = [h for h in swap_relatives(p, [late], columns) if h.ids == ("held",)]
    assert 0.01 * found.fit.point["held"] == pytest.approx(TRUE, abs=TRUE**2 / END / 4.0)
    assert found.fit.rms < late.fit.rms


def test_evidence_rules_out_by_what_a_period_does_over_many_turns():
    """What is left with a wrong one does not grow for ever, as its derivative says: it is the height of the steps."""
    p, columns = posed(machine, {"held": 100.0 * TRUE, "a": 0.2}, [HELD, LATE], noise=0.005)
    (held,) = polish(p, [start(p, columns, [HELD], {"held": 100.0 * TRUE, "a": 0.2})], columns, 2)
    (widened,) = widen_derivatives(p, [held], columns)
    u, share = widened.fit.point["held"], p.settings.search.period_average
    less, more = (machine({**widened.fit.point, "held": u * (1.0 + s)}) for s in (-share, share))
    assert widened.fit.averaged["held"] == pytest.approx((more - less) / (2.0 * share * u))
    own = replace(widened.fit, averaged={})
    energies = [max(curvature(p, fit, columns).energy) for fit in (widened.fit, own)]
    assert energies[0] < 0.2 * energies[1]


def test_where_moments_alone_were_measured_a_period_stays():
    p, _ = posed(machine, {"held": 8.0}, [HELD])
    assert find_period(replace(p, observations=p.observations.until(-1.0)), HELD.main, {"held": 7.0}) == 7.0
