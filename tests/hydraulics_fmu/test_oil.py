from math import exp

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu import oil
from deepsea_cosim.hydraulics_fmu.oil import effective_bulk_modulus, pressure, viscosity
from deepsea_cosim.hydraulics_fmu.supply import pump_flow


def test_barus():
    assert viscosity(110e6, 850 * 22e-6, 2.2e-8) == pytest.approx(850 * 22e-6 * exp(2.42), rel=1e-14)


def test_moduli_in_series():
    assert effective_bulk_modulus(1.4e9, 1.4e9) == pytest.approx(0.7e9)
    assert effective_bulk_modulus(1.4e9, 1e18) == pytest.approx(1.4e9, rel=2e-9)


def test_liquid_is_untouched_bit_for_bit():
    for p in (3000.0, 3000.1, 1e5, 1.2e8):
        assert pressure(p, 3000.0) == p


def test_cavity_is_positive_monotonic_and_smooth():
    states = np.linspace(-2e5, 6e3, 40000)
    values = np.array([pressure(p, 3000.0) for p in states])
    assert (values > 0).all()
    assert (np.diff(values) > 0).all()
    slope = np.diff(values) / np.diff(states)
    assert np.abs(np.diff(slope)).max() < 0.004  # no jump of the slope at the vapour pressure
    assert pressure(-1e9, 3000.0) > 0


def test_roelands_law_is_barus_at_the_surface_and_less_in_the_deep():
    """The published form, evaluated by hand: ln eta = ln eta0 + (ln eta0 + 9.67)((1 + 5.1e-9 P)^Z - 1)."""
    eta0, alpha = 850 * 22e-6, 2.2e-8
    z = alpha / (5.1e-9 * (np.log(eta0) + 9.67))
    assert 0.5 < z < 0.8  # the range that the literature gives for mineral oils
    for P in (0.0, 1e7, 1.1e8):
        by_hand = np.exp(np.log(eta0) + (np.log(eta0) + 9.67) * ((1 + 5.1e-9 * P) ** z - 1))
        assert oil.viscosity(P, eta0, alpha, 1.0) == pytest.approx(by_hand, rel=1e-12)
    slope = (oil.viscosity(1e4, eta0, alpha, 1.0) / eta0 - 1) / 1e4
    assert slope == pytest.approx(alpha, rel=1e-3)
    assert oil.viscosity(1.1e8, eta0, alpha, 1.0) < oil.viscosity(1.1e8, eta0, alpha)
    assert oil.viscosity(1.1e8, eta0, alpha, 0.0) == oil.viscosity(1.1e8, eta0, alpha)


def test_slip_is_what_a_gap_of_constant_width_lets_through():
    assert pump_flow(2e-4, 0.0, 3.0) == 2e-4
    assert pump_flow(2e-4, 0.1, 1.0) == pytest.approx(1.8e-4)
    assert pump_flow(2e-4, 0.1, 10.0) == pytest.approx(1.98e-4)
