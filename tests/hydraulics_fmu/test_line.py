"""The line against Eq. 22, Poiseuille, and its own wave speed."""

import numpy as np
import pytest
from deepsea_cosim.core.sea import ambient_pressure
from deepsea_cosim.hydraulics_fmu.line import mean_viscosity, poiseuille_resistance, steady_loss
from deepsea_cosim.study.characteristics import line_transient
from deepsea_cosim.study.table1 import BASE, BETA, P_VAPOUR, RHO, ROWS, line_response, table

ETA0, ALPHA = 850 * 22e-6, 2.2e-8


@pytest.mark.parametrize(("P_o", "dP"), [(1e5, 1e3), (60e6, 2e6), (110e6, 7e6), (110e6, 60e6), (30e6, -5e6)])
def test_mean_viscosity_is_eq_22(P_o, dP):
    low, high = sorted((P_o, P_o + dP))
    exact = ALPHA * ETA0 * (high - low) / (np.exp(-ALPHA * low) - np.exp(-ALPHA * high))
    assert mean_viscosity(P_o + dP, P_o, ETA0, ALPHA) == pytest.approx(exact, rel=1e-9)


def test_mean_viscosity_is_symmetric_and_continuous_where_the_series_ends():
    dP = 2 * 0.1 / ALPHA
    assert mean_viscosity(5e7, 5e7 + dP, ETA0, ALPHA) == mean_viscosity(5e7 + dP, 5e7, ETA0, ALPHA)
    just_below = mean_viscosity(5e7 + dP * (1 - 1e-12), 5e7, ETA0, ALPHA)
    just_above = mean_viscosity(5e7 + dP * (1 + 1e-12), 5e7, ETA0, ALPHA)
    assert just_below == pytest.approx(just_above, rel=1e-10)


def test_eq_22_tends_to_poiseuille():
    Q = 5e-5
    poiseuille = poiseuille_resistance(ETA0, 4.0, 4e-3) * Q
    assert steady_loss(Q, 0.0, ETA0, 1e-14, 4.0, 4e-3) == pytest.approx(poiseuille, rel=1e-6)
    assert steady_loss(Q, 0.0, ETA0, 0.0, 4.0, 4e-3) == poiseuille
    assert steady_loss(1e-2, 110e6, ETA0, ALPHA, 4.0, 4e-3) == np.inf


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.label)
def test_table_1_from_the_dynamic_line(row):
    dynamic = table([row])[0].dynamic
    assert dynamic == pytest.approx(row.eq22, rel=2e-4)


def test_printed_theory_where_it_is_no_misprint():
    for row in ROWS:
        if not row.misprint:
            assert row.eq22 / 1e6 == pytest.approx(row.theoretical, abs=6e-5)


def test_variable_against_constant_viscosity_at_11_km():
    case = {**BASE, "depth": 11000.0}
    variable, constant = (line_response(**case, variable=v)[1][-1] for v in (True, False))
    assert constant == pytest.approx(poiseuille_resistance(ETA0 * np.exp(2.42), 4.0, 4e-3) * 5e-5, rel=1e-3)
    assert variable / constant - 1 == pytest.approx(0.0822, abs=2e-3)  # the paper's 8.22 %


def test_a_step_of_flow_travels_at_the_speed_of_sound():
    speed = np.sqrt(1.4e9 / 850)
    t, P = line_response(**{**BASE, "depth": 0.0, "nu0": 1e-7}, segments=80, stop=4.0 / speed * 2.2, points=2000)
    # Joukowsky: the inlet rises by rho c Q/A at once and stays until the reflection from the open end comes back
    joukowsky = 850 * speed * BASE["Q"] / (np.pi * 4e-3**2 / 4)
    early = (t > 0.4 * 4.0 / speed) & (t < 1.6 * 4.0 / speed)
    assert P[early].mean() == pytest.approx(joukowsky, rel=0.03)
    assert abs(P[t > 2.1 * 4.0 / speed].mean()) < 0.35 * joukowsky


@pytest.mark.parametrize("depth", [1000.0, 3000.0])
def test_segments_carry_the_waves_that_a_valve_makes(depth):
    """Against the method of characteristics, RMS of the first 100 ms: a flow that rises in 5 ms, as behind a servo
    valve. A step would not converge in segments."""
    case = {**BASE, "depth": depth}
    t, exact = line_transient(**case, rise=5e-3, stop=0.1)
    off = []
    for n in (5, 10, 20):
        times, loss = line_response(**case, segments=n, rise=5e-3, stop=0.1, points=2001)
        apart = loss - np.interp(times, t, exact)
        off.append(np.sqrt(np.mean(apart**2) / np.mean(exact**2)))
    assert off[0] < 0.085
    assert off[1] < 0.04
    assert off[0] > 1.9 * off[1] > 1.9 * 1.3 * off[2]


def test_characteristics_end_in_the_steady_loss_and_begin_with_joukowsky():
    P_out = ambient_pressure(BASE["depth"])
    t, loss = line_transient(**BASE)
    assert loss[-1] == pytest.approx(steady_loss(BASE["Q"], P_out, ETA0, 2.2e-8, 4.0, 4e-3), rel=1e-3)
    speed = np.sqrt(BETA / RHO)
    assert loss[1] == pytest.approx(RHO * speed * BASE["Q"] / (np.pi * 4e-3**2 / 4), rel=0.01)
    before = loss[t < 7.9 / speed]
    assert (np.diff(before) >= 0.0).all(), "friction alone until the open end answers"
    assert loss[np.searchsorted(t, 8.1 / speed)] < 0.5 * before[-1]


def test_a_void_opens_where_the_oil_would_tear_and_closes_again():
    """At the surface the wave that the open end sends back is below zero pressure; volume is not lost by it."""
    P_out = ambient_pressure(0.0)
    _, loss = line_transient(**{**BASE, "depth": 0.0}, stop=1.0)
    assert loss.min() == pytest.approx(P_VAPOUR - P_out)
    assert loss[-1] == pytest.approx(steady_loss(BASE["Q"], P_out, ETA0, 2.2e-8, 4.0, 4e-3), rel=1e-3)
