"""The line against Eq. 22, Poiseuille, and its own wave speed."""

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu.line import mean_viscosity, poiseuille_resistance, steady_loss
from deepsea_cosim.study.table1 import BASE, ROWS, line_response, table

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
