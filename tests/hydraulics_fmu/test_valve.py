from math import inf, sqrt

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu.supply import limited_by_pump, port_pressure
from deepsea_cosim.hydraulics_fmu.valve import flow_gain, land, land_diameter, land_flow

from .test_circuit import Rig

RHO, ETA0, ALPHA = 850.0, 850 * 22e-6, 2.2e-8
K_Q = flow_gain(5e-3 / 60, 3.5e6)
D = land_diameter(5e-3 / 60, 3.5e6, RHO)


def flow(opening, P_from, P_to, lam_crit=1000.0):
    return land_flow(opening, P_from, P_to, K_Q, D, lam_crit, RHO, ETA0, ALPHA)


def test_rated_point_of_the_printed_equation():
    assert flow(1.0, 3.5e6, 0.0, lam_crit=0.0) == pytest.approx(5e-3 / 60, rel=1e-9)


def test_printed_equation_is_a_square_root():
    for dp in (1e5, 1e6, 2e7):
        assert flow(0.3, 1e8 + dp, 1e8, lam_crit=0.0) == pytest.approx(0.3 * K_Q * sqrt(dp), rel=1e-6)


def test_flow_number_transition_tends_to_the_printed_equation():
    thin = land_flow(1.0, 2e7, 0.0, K_Q, D, 1000.0, RHO, 1e-9, 0.0)
    assert thin == pytest.approx(K_Q * sqrt(2e7), rel=1e-12)
    assert flow(1.0, 2e7, 0.0, lam_crit=1e-9) == pytest.approx(K_Q * sqrt(2e7), rel=1e-12)


def test_small_drops_are_laminar():
    """For lam << lam_crit the flow is linear in dp and inverse to the viscosity."""
    q1, q2 = flow(0.1, 100.0, 0.0), flow(0.1, 200.0, 0.0)
    assert q2 / q1 == pytest.approx(2.0, rel=1e-3)
    deep = flow(0.1, 110e6 + 100.0, 110e6)
    assert q1 / deep == pytest.approx(np.exp(ALPHA * 110e6), rel=2e-3)


def test_published_flow_number_at_11_km():
    """At 11 km a full land at 3.5 MPa has lam of about 452 and passes tanh(2*452/1000) of the turbulent flow."""
    nu = ETA0 * np.exp(ALPHA * (110e6 + 1.75e6)) / RHO
    lam = D / nu * sqrt(2 * 3.5e6 / RHO)
    assert lam == pytest.approx(452, rel=0.01)
    assert flow(1.0, 110e6 + 3.5e6, 110e6) == pytest.approx(5e-3 / 60 * np.tanh(2 * lam / 1000), rel=1e-12)


@pytest.mark.parametrize("lam_crit", [0.0, 1000.0])
def test_odd_monotonic_and_closed(lam_crit):
    drops = np.linspace(-2e7, 2e7, 401)
    flows = np.array([flow(0.5, 5e7 + dp / 2, 5e7 - dp / 2, lam_crit) for dp in drops])
    assert np.allclose(flows, -flows[::-1], rtol=1e-12)
    assert (np.diff(flows) > 0).all()
    assert flow(0.0, 2e7, 0.0, lam_crit) == 0.0
    assert flow(0.5, 1e7, 1e7, lam_crit) == 0.0


def test_relief_pressure_holds_while_the_pump_suffices():
    c = Rig(depth=0.0).c
    assert port_pressure(0.2, 1e7, 1e7, 1e5, c) == 1e5 + 20e6
    assert limited_by_pump(1e-4, 1.45e-4) == 1e-4
    assert limited_by_pump(-1e-4, 1.45e-4) == -1e-4


def test_pressure_falls_when_the_demand_exceeds_the_pump():
    c = Rig(depth=0.0, pump__speed=5e-5 / 6e-6).c
    Q_pump = c.pump.flow
    P = port_pressure(1.0, 1e6, 1e6, 1e5, c)
    assert 1e6 < P < 2e7
    assert land(1.0, P, 1e6, c) == pytest.approx(Q_pump, rel=1e-9)
    assert limited_by_pump(inf, Q_pump) == Q_pump
