"""Other forms of the effects than the plain ones: closed forms, and at its neutral value each is the plain one."""

import numpy as np
import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.hydraulics_fmu import circuit
from deepsea_cosim.hydraulics_fmu.curves import knots, on_curve
from deepsea_cosim.hydraulics_fmu.friction import piston_friction
from deepsea_cosim.hydraulics_fmu.oil import GAP_PRESSURE, gap_flow
from deepsea_cosim.hydraulics_fmu.ports import port_flows
from deepsea_cosim.hydraulics_fmu.valve import land as land_flow_of
from deepsea_cosim.hydraulics_fmu.valve import land_opening, limited, notched, turbulent_share

from .test_effects import Effected

PRESSURES = (3e6, 2.5e6, 0.2e6)
"""Of the ports a and b, and of the tank [Pa]."""


def flows(x_v, **effects):
    """Q_a, Q_b, Q_p, Q_t [m3/s] at a spool position."""
    return np.array(port_flows(x_v, *PRESSURES, np.nan, Effected(**effects).c))


def friction(v, **more):
    return piston_friction(v, 8e6, 6e6, 300.0, 2e-3, 150.0, 0.02, 5e-5, **more)


def test_friction_is_greater_one_way_by_its_share():
    for name, own in (("uneven_c", 300.0), ("uneven_s", 150.0 * np.exp(-2.5)), ("uneven_p", 100.0)):
        out, back = friction(0.05, **{name: 0.4}), -friction(-0.05, **{name: 0.4})
        assert out - friction(0.05) == pytest.approx(0.4 * own, rel=1e-9)
        assert back - friction(0.05) == pytest.approx(-0.4 * own, rel=1e-9)


def test_stribeck_friction_falls_with_a_power_of_the_velocity():
    assert friction(0.05, exponent=2.0) - 400.0 == pytest.approx(150.0 * np.exp(-(2.5**2)), rel=1e-9)
    assert friction(0.05, exponent=1.0) == friction(0.05)
    assert friction(0.0, exponent=0.5) == 0.0


def test_a_gap_is_laminar_turbulent_or_both_and_alike_at_10_mpa():
    for share in (0.0, 0.3, 1.0):
        assert gap_flow(GAP_PRESSURE, 1e-12, share) == pytest.approx(1e-12 * GAP_PRESSURE, rel=1e-6)
        assert gap_flow(-4e6, 1e-12, share) == -gap_flow(4e6, 1e-12, share)
    assert gap_flow(2.5e6, 1e-12, 1.0) == pytest.approx(1e-12 * np.sqrt(2.5e6 * GAP_PRESSURE), rel=1e-4)
    assert gap_flow(0.0, 1e-12, 1.0) == 0.0


def test_a_land_with_underlap_is_open_when_the_spool_is_centred():
    assert land_opening(0.0, -0.1) == pytest.approx(0.1 / 1.1)
    assert land_opening(-0.1, -0.1) == 0.0
    assert land_opening(1.0, -0.1) == 1.0


def test_each_land_has_its_own_overlap():
    """Of two lands that open together the tighter one stays shut longer; the others do not matter."""
    plain = flows(0.03, valve_dead_zone__overlap=0.05)
    assert plain[:2] == pytest.approx([0.0, 0.0])
    half = flows(0.03, valve_dead_zone__overlap=0.05, valve_dead_zone__pa=0.5)
    assert half[0] > 0.0
    assert half[1] == 0.0
    returns = flows(0.03, valve_dead_zone__overlap=0.05, valve_dead_zone__bt=0.5)
    assert (returns[0], returns[2]) == (0.0, 0.0)
    assert returns[1] > 0.0
    assert flows(0.03, valve_dead_zone__overlap=0.05, valve_dead_zone__at=0.5, valve_dead_zone__pb=0.2) == (
        pytest.approx(plain)
    )
    back = flows(-0.03, valve_dead_zone__overlap=0.05, valve_dead_zone__at=0.5)
    assert back[0] < 0.0
    assert back[1] == 0.0


def test_returns_with_underlap_let_both_ports_to_the_tank():
    Q_a, Q_b, Q_p, Q_t = flows(0.0, valve_dead_zone__overlap=0.05, valve_dead_zone__at=-1.0, valve_dead_zone__bt=-1.0)
    assert Q_a < 0.0 < Q_b
    assert Q_t == pytest.approx(Q_b - Q_a)
    assert Q_p == 0.0


def test_flows_balance_whatever_the_lands():
    """What is taken from the supply and from port b is given to port a and to the tank."""
    random = np.random.default_rng(0)
    for x_v in (-0.6, -0.02, 0.0, 0.015, 0.4):
        lands = {f"valve_dead_zone__{x}": float(random.uniform(0.0, 2.0)) for x in ("pa", "at", "pb", "bt")}
        leaks = {f"valve_leakage__{x}": float(random.uniform(0.0, 2.0)) for x in ("pa", "at", "pb", "bt")}
        Q_a, Q_b, Q_p, Q_t = flows(
            x_v, valve_dead_zone__overlap=0.02, valve_leakage__c=1e-13, valve_leakage__turbulent=0.5, **lands, **leaks
        )
        assert Q_p + Q_b == pytest.approx(Q_a + Q_t, abs=1e-18)


def test_each_land_has_its_own_leakage():
    plain = flows(0.0)
    for land, place, sign in (("pa", 0, 1.0), ("at", 0, -1.0), ("pb", 1, -1.0), ("bt", 1, 1.0)):
        others = {f"valve_leakage__{x}": 0.0 for x in ("pa", "at", "pb", "bt") if x != land}
        changed = flows(0.0, valve_leakage__c=1e-13, **others) - plain
        assert sign * changed[place] > 0.0
        assert changed[1 - place] == 0.0


@pytest.mark.parametrize("transition", [-1.0, -0.4, 0.0, 0.4, 1.0])
def test_an_orifice_is_laminar_and_turbulent_at_its_ends_whatever_its_transition(transition):
    x = np.geomspace(1e-3, 1e3, 400)
    share = np.array([turbulent_share(v, transition) for v in x])
    assert share[0] == pytest.approx(x[0], rel=1e-5)
    assert share[-1] == pytest.approx(1.0, rel=1e-5)
    assert np.all(np.diff(share) >= 0.0)
    assert np.all(share <= 1.0)


def test_transitions_of_other_tools():
    """Simscape's orifice, sqrt(dp) replaced by dp/(dp^2 + dp_crit^2)^(1/4), through a land of the machine."""
    c = Effected(orifice_flow_number__transition=-1.0).c
    dp_crit, turbulent = None, Effected(valve__lam_crit=1e-9).c
    for dp in (2e3, 1e5, 4e6):
        flow, full = (land_flow_of(0.3, 1e7 + 0.5 * dp, 1e7 - 0.5 * dp, machine) for machine in (c, turbulent))
        plain = land_flow_of(0.3, 1e7 + 0.5 * dp, 1e7 - 0.5 * dp, Effected().c) / full
        dp_crit = dp / np.arctanh(plain) ** 2
        assert flow / full == pytest.approx(np.sqrt(dp) / (dp**2 + dp_crit**2) ** 0.25, rel=1e-6)
    assert dp_crit > 0.0
    assert turbulent_share(1.0, 1.0) == pytest.approx(np.sqrt(0.5))
    assert turbulent_share(1.0, 0.5) == pytest.approx(0.5 * (np.sqrt(0.5) + np.tanh(1.0)))


def test_notches_are_wrong_up_to_their_end_and_right_in_slope_beyond():
    assert notched(0.1, 0.5, 0.3) == 0.1
    assert notched(0.5, 0.5, 0.3) == pytest.approx(0.3 + 0.2 / 0.5)
    half = {"valve_flow_gain__scale": 0.5}
    at = [flows(x, **half, valve_flow_gain__notch=0.1)[1] for x in (0.05, 0.2, 0.3)]
    right = [flows(x)[1] for x in (0.2, 0.3)]
    assert at[0] == flows(0.05, **half)[1]
    assert at[2] - at[1] == pytest.approx(right[1] - right[0], rel=0.01)  # but for the diameter in the flow number


def test_a_flow_gain_that_is_right_in_retraction():
    apart = {"valve_flow_gain__scale": 0.5, "valve_flow_gain__retraction": 0.0}
    assert flows(0.2, **apart) == pytest.approx(flows(0.2, valve_flow_gain__scale=0.5))
    assert flows(-0.2, **apart) == pytest.approx(flows(-0.2), rel=0.01)


def test_a_spool_takes_its_time_for_a_stroke():
    assert limited(3.0, 0.0) == 3.0
    assert limited(1e6, 0.1) == pytest.approx(10.0, rel=1e-6)
    assert limited(-1e6, 0.1) == pytest.approx(-10.0, rel=1e-6)
    assert limited(1.0, 0.1) == pytest.approx(1.0, rel=1e-3)
    jump = {"command__t_start": 0.0, "command__ramp_time": 1e-3, "valve_dynamics__T": 0.002}
    x_v = Effected(**jump, valve_dynamics__stroke_time=0.2).run(0.06)["x_v"]
    assert np.diff(x_v).max() < 1e-3 / 0.2 * 1.001
    assert np.diff(x_v)[20:40].mean() == pytest.approx(1e-3 / 0.2, rel=0.02)
    assert Effected(**jump).run(0.06)["x_v"][-1] == pytest.approx(1.0, abs=1e-3)


def test_a_worn_seal_is_turbulent_in_what_it_adds_only():
    c = Effected(piston_leakage__scale=3.0, piston_leakage__turbulent=1.0).c
    whole = Effected(piston_leakage__scale=3.0).c
    assert c.cylinder.leak == Effected().c.cylinder.leak
    assert c.cylinder.leak_further == pytest.approx(2.0 * c.cylinder.leak)
    assert (whole.cylinder.leak, whole.cylinder.leak_further) == (pytest.approx(3.0 * c.cylinder.leak), 0.0)


def test_an_overlap_of_the_whole_stroke_is_refused():
    with pytest.raises(ParameterError, match="less than 1"):
        Effected(valve_dead_zone__overlap=0.4, valve_dead_zone__pa=3.0)


def test_a_curve_is_straight_between_its_knots_and_level_beyond():
    values = np.random.default_rng(1).normal(size=10)
    for x in (-0.99, -0.3, -0.031, 0.04, 0.1, 0.7):
        assert on_curve(x, values, 1.0) == pytest.approx(np.interp(x, knots(), values))
    assert on_curve(7.0, values, 1.0) == values[9]
    assert on_curve(-7.0, values, 1.0) == values[0]
    for at_zero in (0.0, 1.0):
        assert on_curve(0.015, values, at_zero) == pytest.approx((0.5 + 0.5 * at_zero) * values[5])
        assert on_curve(-0.015, values, at_zero) == pytest.approx((0.5 + 0.5 * at_zero) * values[4])


def test_a_level_friction_curve_is_coulomb_friction():
    level = {f"cylinder_friction_curve__y{k}": 200.0 for k in range(1, 11)}
    for v in (-0.2, -0.01, 0.0, 3e-4, 0.05):
        forces = []
        for effects in (level, {"cylinder_coulomb_friction__F_c": 200.0}):
            rig, out = Effected(**effects), np.zeros(len(circuit.OUTPUTS))
            circuit.outputs_at(rig.y, rig.c, 0.0, 1e-3, 0.05, v, 0.0, 0.0, 0.0, rig.m, out)
            forces.append(out[0])
        assert forces[0] == pytest.approx(forces[1], abs=1e-9)


def test_a_metering_curve_adds_to_the_opening_and_shuts_a_land_at_most():
    """Lands of 0.95 x + 0.05 x are those of the plain valve; with -x they are shut."""
    at = np.array(knots())
    whole = {f"valve_metering_curve__y{k}": -abs(x) for k, x in enumerate(at, 1)}
    dead = {"valve_dead_zone__overlap": 0.05}
    back = {f"valve_metering_curve__y{k}": abs(x) - max(0.0, abs(x) - 0.05) / 0.95 for k, x in enumerate(at, 1)}
    for x_v in (*at, -0.2, 0.4, 0.6):
        assert flows(x_v, **whole) == pytest.approx(np.zeros(4), abs=1e-12)
        assert flows(x_v, **dead, **back) == pytest.approx(flows(x_v), rel=1e-6)


def test_curves_of_zeros_change_nothing_bit_for_bit():
    plain = Effected().run(0.3)
    with_reference = Effected(cylinder_friction_curve__v_max=0.3).run(0.3)
    for name, values in plain.items():
        np.testing.assert_array_equal(values, with_reference[name])
