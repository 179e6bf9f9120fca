from math import exp

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu.oil import effective_bulk_modulus, pressure, viscosity


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
