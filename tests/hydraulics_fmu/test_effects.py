"""The effects of the hydraulics: each against a closed form or a limit, and exactly absent by default."""

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu import circuit, march
from deepsea_cosim.hydraulics_fmu.constants import SHORTEST
from deepsea_cosim.hydraulics_fmu.cylinder import piston_leak
from deepsea_cosim.hydraulics_fmu.friction import piston_friction
from deepsea_cosim.hydraulics_fmu.march import remembered
from deepsea_cosim.hydraulics_fmu.memory import new_memory, remembering
from deepsea_cosim.hydraulics_fmu.oil import air_softening, temperature_factor
from deepsea_cosim.hydraulics_fmu.ports import port_flows
from deepsea_cosim.hydraulics_fmu.states import BORDER
from deepsea_cosim.hydraulics_fmu.supply import relief_pressure
from deepsea_cosim.hydraulics_fmu.valve import land, land_flow, land_opening
from deepsea_cosim.hydraulics_fmu.variables import EFFECTS, HYDRAULICS

from .test_circuit import Rig, border_of


class Effected(Rig):
    """The rig with the controller's history, as the FMU runs it."""

    def __init__(self, F_hold=6632.0, **changes):
        names = {k.replace("__", "."): v for k, v in changes.items()}
        effects = {f"effect.{k}": v for k, v in names.items() if f"effect.{k}" in {e.name for e in EFFECTS}}
        plain = {k.replace(".", "__"): v for k, v in names.items() if f"effect.{k}" not in effects}
        super().__init__(F_hold, **plain, **{k.replace(".", "__"): v for k, v in effects.items()})

    def step(self, t, h, x=0.0, v=0.0, ref=0.0, ref_rate=0.0):
        self.out = np.zeros(len(circuit.OUTPUTS))
        assert march.step(self.y, self.w, self.m, self.c, self.scale, t, h, x, v, ref, ref_rate, self.out) == 0

    def run(self, seconds, h=1e-3, x=lambda t: 0.0, v=0.0):
        rows = []
        for k in range(round(seconds / h)):
            t = k * h
            self.step(t, h, x(t), v)
            rows.append(self.out)
        return dict(zip(circuit.OUTPUTS, np.array(rows).T, strict=True))


def test_all_effects_are_absent_bit_for_bit():
    """Neutral effects leave the derivatives those of the bare components, bit by bit, over random states."""
    rig = Rig(depth=6000.0)
    rng = np.random.default_rng(3)
    from deepsea_cosim.hydraulics_fmu.compensator import tank_pressure_rate
    from deepsea_cosim.hydraulics_fmu.controller import pid_output

    c = rig.c
    for _ in range(50):
        y = rig.y * (1 + 0.01 * rng.normal(size=len(rig.y)))
        border = border_of(y, c)
        border.spool = border.spool_rate = 0.0
        f = rig.rate(0.1, 0.03, 0.1 + 1e-3 * rng.normal(), 0.04, y)
        b, chain = len(y) - BORDER, (len(y) - BORDER) // 2
        Pa, P1, P2, Pb, Pt = y[b : b + 5]
        x_cmd = 0.1
        f = rig.rate(0.1, 0.03, x_cmd, 0.04, y)
        error_rate = c.sensor.gain * (0.04 - 0.03)
        u = pid_output(0.0, error_rate, border.integral, c.controller.kp, c.controller.kd, 10.0)
        x_v = u / c.valve.i_rated
        lands = (c.valve.k_q, c.valve.land_diameter, c.valve.lam_crit, c.oil.rho, c.oil.eta0, c.oil.alpha)
        if x_v >= 0:
            Qp, Qt = land_flow(x_v, Pt + c.relief.p_set, Pa, *lands), land_flow(x_v, Pb, Pt, *lands)
            Qa, Qb = Qp, Qt
        else:
            Qp, Qt = land_flow(-x_v, Pt + c.relief.p_set, Pb, *lands), land_flow(-x_v, Pa, Pt, *lands)
            Qa, Qb = -Qt, -Qp
        k = c.oil.beta_e / c.line.half_segment
        assert f[b] == k * (Qa - y[0])
        assert f[b + 3] == k * (y[b - 1] - Qb)
        V_1 = c.cylinder.dead_volume + c.cylinder.area_1 * 0.1 + c.line.half_segment
        leak = c.cylinder.leak * (P1 - P2)
        assert f[b + 1] == c.oil.beta_e / V_1 * (y[chain - 1] - c.cylinder.area_1 * 0.03 - leak)
        tank = tank_pressure_rate(
            Qt + c.pump.flow - Qp, c.pump.flow, border.v_c, border.x_c,
            c.compensator.area, c.tank.volume, c.compensator.length, c.oil.beta,
        )  # fmt: skip
        assert f[b + 4] == tank


def test_neutral_values_lie_in_their_ranges_and_switch_off():
    assert len({e.name for e in EFFECTS}) == len(EFFECTS)
    p = HYDRAULICS.parameters()
    for name in ("cylinder_coulomb_friction.F_c", "entrained_air.fraction", "command_delay.tau", "valve_dynamics.T"):
        assert p[f"effect.{name}"] == 0.0


def test_friction_is_odd_and_bounded():
    v = np.linspace(-0.2, 0.2, 401)
    F = np.array([piston_friction(s, 1.2e8, 1.1e8, 300.0, 2e-3, 150.0, 0.02, 5e-6) for s in v])
    assert np.allclose(F, -F[::-1])
    assert F[-1] == pytest.approx(300.0 + 150.0 * np.exp(-10) + 5e-6 * 1e7, rel=1e-9)
    assert F[205] > F[250] > F[-1] - 1e-9  # Stribeck: less friction at higher speed
    assert piston_friction(0.04, 1.2e8, 1.1e8, 0.0, 2e-3, 0.0, 0.02, 0.0) == 0.0


def test_friction_acts_on_the_force_of_the_cylinder():
    plain, rough = Effected(), Effected(cylinder_coulomb_friction__F_c=400.0, cylinder_viscous_error__scale=3.0)
    difference = plain.outputs(v=0.04)["F_h"] - rough.outputs(v=0.04)["F_h"]
    assert difference == pytest.approx(400.0 + 2.0 * 1000.0 * 0.04, rel=1e-9)


def test_air_softens_shallow_oil_only():
    assert air_softening(1e6, 1.4e9, 0.0, 1.2) == 1.0
    at_1_bar = air_softening(101300.0, 1.4e9, 0.02, 1.0)
    assert 1.4e9 * at_1_bar == pytest.approx(1 / (1 / 1.4e9 + 0.02 / 101300.0))
    assert air_softening(110e6, 1.4e9, 0.03, 1.2) > 0.99


def test_air_is_the_wood_limit_of_an_isothermal_bubble():
    """dV/V of the air part under a small dP is a p0/P dP/P for n = 1."""
    P, dP, a = 5e5, 1.0, 0.01
    K = 1.4e9 * air_softening(P, 1.4e9, a, 1.0)
    bubble = lambda p: a * 101300.0 / p  # noqa: E731
    expected = (bubble(P) - bubble(P + dP)) / dP + 1 / 1.4e9
    assert pytest.approx(expected, rel=1e-5) == 1 / K


def test_hoses_are_softer_at_every_depth():
    for depth in (0.0, 11000.0):
        rig = Effected(depth=depth, hose_compliance__compliance=1 / 0.5e9)
        assert rig.c.line.beta == pytest.approx(1 / (1 / 1.4e9 + 1 / 0.5e9))
        assert rig.c.line.half_at_chamber / rig.c.line.half_segment == pytest.approx(1 + 1.4 / 0.5)


def test_temperature_by_walther():
    assert temperature_factor(313.15, 22e-6) == temperature_factor(313.15, 46e-6) == 1.0
    assert 22 * temperature_factor(373.15, 22e-6) == pytest.approx(4.3, rel=1e-12)
    assert 150 < 22 * temperature_factor(275.15, 22e-6) < 300  # a VG 22 oil near freezing
    assert temperature_factor(290.0, 22e-6) > temperature_factor(300.0, 22e-6) > 1.0
    assert temperature_factor(343.15, 1e-7) == temperature_factor(343.15, 2e-6) < 1.0  # below the law's range


@pytest.mark.parametrize(("nu_40", "nu_100"), [(19.37, 4.0), (28.49, 5.0), (48.57, 7.0), (71.10, 9.0)])
def test_oil_of_another_grade_keeps_its_viscosity_index(nu_40, nu_100):
    """Oils of the index 100 (ASTM D2270, its table of H), of which thicker ones thicken more in the cold."""
    c = Effected(oil__nu0=1e-6 * nu_40, oil_temperature__T=373.15).c
    assert 1e6 * c.oil.eta0 / c.oil.rho == pytest.approx(nu_100, rel=0.08)


def test_all_that_depends_on_the_oils_temperature_moves_together():
    cold, warm = (Effected(oil_temperature__T=T, valve_leakage__c=2e-13).c for T in (313.15, 353.15))
    nu = 22e-6 * temperature_factor(353.15, 22e-6)
    assert warm.oil.rho == pytest.approx(850.0 / 1.032)
    assert warm.oil.eta0 == pytest.approx(850.0 / 1.032 * nu)
    assert warm.oil.beta == pytest.approx(1.4e9 * np.exp(-0.26))
    assert warm.oil.alpha / cold.oil.alpha == pytest.approx(
        (0.6 + 0.965 * np.log10(1e3 * warm.oil.eta0)) / (0.6 + 0.965 * np.log10(18.7))
    )
    assert warm.line.beta == pytest.approx(warm.oil.beta, rel=1e-6)
    assert warm.line.stiffness / cold.line.stiffness == pytest.approx(np.exp(-0.26))
    assert warm.line.inertance / cold.line.inertance == pytest.approx(1 / 1.032)
    assert warm.valve.k_q / cold.valve.k_q == pytest.approx(np.sqrt(1.032))
    assert warm.oil.thinner == pytest.approx(cold.oil.eta0 / warm.oil.eta0)


def test_leakages_are_in_proportion_to_how_thin_the_oil_is():
    """Past the piston and past the lands of the shut valve."""
    cold, warm = (Effected(oil_temperature__T=T, valve_leakage__c=2e-13) for T in (313.15, 353.15))
    thinner = warm.c.oil.thinner
    assert 2.5 < thinner < 5.0
    assert piston_leak(3e7, 2e7, warm.c) == pytest.approx(thinner * piston_leak(3e7, 2e7, cold.c))
    pressures = (1.2e8, 1.15e8, 1.1e8)
    both = (port_flows(0.0, *pressures, np.nan, rig.c) for rig in (warm, cold))
    for one, two in zip(*both, strict=True):
        assert one == pytest.approx(thinner * two, rel=1e-9)
    worn = {"piston_leakage__scale": 3.0, "piston_leakage__turbulent": 1.0}
    cold, warm = (Effected(oil_temperature__T=T, **worn) for T in (313.15, 353.15))
    laminar = 5e-12 * 1e7
    turbulent = piston_leak(3e7, 2e7, cold.c) - laminar
    assert piston_leak(3e7, 2e7, warm.c) == pytest.approx(thinner * laminar + turbulent)


def test_stribeck_friction_is_exact_from_a_tenth_of_its_velocity_on_and_keeps_its_force():
    for v_s in (0.003, 0.02, 0.06):
        v = np.linspace(0.0, 5.0 * v_s, 2001)[1:]
        F = np.array([piston_friction(x, 0.0, 0.0, 0.0, 2e-3, 500.0, v_s, 0.0) for x in v])
        beyond = v >= 0.1 * v_s
        assert F[beyond] == pytest.approx(500.0 * np.exp(-v[beyond] / v_s), rel=1e-12)
        assert F.max() > 0.9 * 500.0
        assert piston_friction(-v[7], 0.0, 0.0, 0.0, 2e-3, 500.0, v_s, 0.0) == -F[7]


def test_dead_zone():
    assert land_opening(0.04, 0.05) == 0.0
    assert land_opening(1.0, 0.05) == 1.0
    assert land_opening(0.525, 0.05) == pytest.approx(0.5)
    assert land_opening(-0.525, 0.05) == 0.0
    assert land_opening(0.3, 0.0) == 0.3


def test_spool_dynamics_follow_the_closed_form():
    """Step of the command to full stroke: the second-order step response, damped."""
    T, zeta = 0.01, 0.5
    rig = Effected(valve_dynamics__T=T, valve_dynamics__damping=zeta, command__t_start=0.0, command__ramp_time=1e-3)
    start = rig.outputs()["x_v"]
    c = rig.run(0.08)
    t = np.arange(1, 81) * 1e-3 - 0.5e-3  # the ramp to saturation takes the first fractions of a millisecond
    w, wd = 1 / T, np.sqrt(1 - zeta**2) / T
    step = 1 - np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t))
    expected = np.minimum(start + (1 - start) * step, 1.0)
    assert np.abs(c["x_v"] - expected)[5:].max() < 0.04
    assert c["x_v"][0] < 0.3


def test_fast_spool_tends_to_no_dynamics():
    ends = [Effected(valve_dynamics__T=T, command__t_start=0.0).run(0.1)["P1"][-1] for T in (0.0, 1e-4)]
    assert ends[1] == pytest.approx(ends[0], abs=2e3)


def test_command_delay_shifts_the_controller_output():
    tau = 0.0123
    plain = Effected(command__t_start=0.02).run(0.2)
    late = Effected(command__t_start=0.02, command_delay__tau=tau).run(0.2)
    t = np.arange(1, 201) * 1e-3
    u = np.interp(t - tau, t, plain["u"], left=plain["u"][0])
    assert np.abs(late["u"] - u).max() < 0.05  # the rod stands still, so the controller sees the same error


def test_delay_does_not_depend_on_the_communication_step():
    changes = {"command__t_start": 0.0, "command_delay__tau": 8e-3}
    a, b = (Effected(**changes).run(0.2, h)["P1"][-1] for h in (1e-3, 2e-2))
    assert a == pytest.approx(b, abs=5e3)


def test_history_interpolates_holds_its_beginning_and_goes_on_to_the_limit():
    memory = remembering.py_func(new_memory())
    memory.count = 3
    memory.times[:3] = [0.0, 1.0, 2.0]
    memory.outputs[:3] = [5.0, 7.0, 6.0]
    assert [remembered(t, memory, 10.0) for t in (-1.0, 0.5, 1.75, 2.0, 2.5)] == [5.0, 6.0, 6.25, 6.0, 5.5]
    assert remembered(99.0, memory, 10.0) == -10.0
    memory.times[1] = memory.times[2]  # two entries at one time
    assert remembered(2.5, memory, 10.0) == 6.0


@pytest.mark.parametrize("name", ["command_delay__tau", "controller_sampling__period"])
def test_short_delays_and_periods_cost_no_more_and_tend_to_none(name):
    """32 ns of delay once made a run of 32 ns long slices."""
    def run(**changes):
        rig = Effected(command__t_start=0.0, **changes)
        return rig, rig.run(0.05)["P1"]

    _, plain = run()
    gaps = []
    for size in (2e-4, 5e-5, 3e-8):
        rig, P1 = run(**{name: size})
        assert rig.m.count <= 0.05 / SHORTEST + 2
        gaps.append(np.abs(P1 - plain).max())
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 1e-3 * np.ptp(plain)


def test_a_short_period_is_the_delay_of_its_half():
    a, b = (Effected(command__t_start=0.0, **c).run(0.05)["P1"]
            for c in ({"controller_sampling__period": 2e-4}, {"command_delay__tau": 1e-4}))  # fmt: skip
    np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("changes", [{}, {"command_delay__tau": 5e-3}], ids=["plain", "delayed"])
def test_no_step_vanishes_however_late_or_short(changes):
    rig = Effected(command__t_start=1e6, **changes)
    rig.border.p_t += 1e4
    before, rate = rig.border.v_c, border_of(rig.rate(), rig.c).v_c
    rig.step(1e5, 1e-12)
    assert rig.border.v_c - before == pytest.approx(1e-12 * rate, rel=1e-2)


def test_sampling_holds_between_its_ticks():
    c = Effected(command__t_start=0.0, controller_sampling__period=0.01).run(0.1)
    changes = np.flatnonzero(np.abs(np.diff(c["u"])) > 1e-12)
    assert len(changes) > 3
    assert np.all((changes + 1) % 10 == 0)


def test_a_null_shift_shows_where_the_controller_is_switched_on_at_rest():
    """It moves the spool until the controller's error has made up for it: shift i_rated/(kp gain)."""
    plain, shifted = Effected(), Effected(valve_null_shift__shift=0.03)
    assert shifted.outputs()["x_v"] == pytest.approx(plain.outputs()["x_v"] + 0.03, abs=1e-12)
    assert shifted.outputs()["u"] == plain.outputs()["u"]
    off = 0.03 * 10.0 / (2.5 * 1000.0)
    assert shifted.outputs(x=off)["x_v"] == pytest.approx(plain.outputs()["x_v"], abs=1e-9)


def test_a_controller_long_at_work_has_made_up_for_a_null_shift():
    plain = Effected()
    shifted = Effected(valve_null_shift__shift=0.03, controller__integral_start=-0.3)
    assert shifted.outputs()["x_v"] == pytest.approx(plain.outputs()["x_v"], abs=1e-12)
    assert shifted.outputs()["u"] == pytest.approx(plain.outputs()["u"] - 0.3, abs=1e-12)


@pytest.mark.parametrize(
    "changes",
    [
        {"valve_leakage__c": 2e-13},
        {"valve_dead_zone__overlap": 0.1},
        {"valve_null_shift__shift": -0.05, "controller__integral_start": 0.5},
        {"relief_override__R": 1.5e10},
        {"supply_droop__droop": 0.1},
        {"valve_dynamics__T": 0.005},
        {"piston_leakage__scale": 0.1},
        {"oil_temperature__T": 283.15},
        {"ambient_pressure_error__scale": 1.05},
        {"entrained_air__fraction": 0.02},
        {"umbilical_supply__length": 200.0},
        {"pump_dynamics__T": 0.05, "pump_dynamics__droop": 0.15},
        {"pump_dynamics__T": 0.05, "pump_dynamics__power": 0.5},
        {"pump_dynamics__T": 0.05, "pump_dynamics__roundness": 0.2},
        {"pump_dynamics__T": 0.05, "pump_dynamics__roundness": 0.6, "pump_dynamics__droop": 0.3},
        {"pump_dynamics__T": 0.05, "umbilical_supply__length": 200.0},
    ],
    ids=lambda c: " ".join(c),
)
@pytest.mark.parametrize("depth", [0.0, 9000.0])
def test_rest_stays_rest_with_every_effect(depth, changes):
    rig = Effected(depth=depth, **changes)
    assert np.abs(rig.rate() / rig.scale).max() < 1e-4
    before = rig.y.copy()
    rig.run(0.1)
    assert np.abs((rig.y - before) / rig.scale).max() < 1e-5


def test_valve_leakage_raises_the_pump_share_and_conserves_flow():
    rig = Effected(valve_leakage__c=3e-13)
    Qa, Qb, Qp, Qt = port_flows(0.0, 1.2e8, 1.15e8, 1.1e8, np.nan, rig.c)
    assert Qp > 0
    assert Qp - Qt == pytest.approx(Qa - Qb, rel=1e-12)
    assert Qa == pytest.approx(3e-13 * ((1.1e8 + 20e6 - 1.2e8) - (1.2e8 - 1.1e8)))


def test_relief_override_closes_the_balance():
    R, Pt = 2e10, 1e5
    c = Effected(relief_override__R=R).c
    Q_pump = c.pump.flow
    P = relief_pressure(0.4, 5e6, 5e6, Pt, c)
    assert pytest.approx(Pt + 20e6 + R * (Q_pump - land(0.4, P, 5e6, c)), rel=1e-9) == P
    assert relief_pressure(0.0, 5e6, 5e6, Pt, c) == pytest.approx(Pt + 20e6 + R * Q_pump)


def test_supply_droop_lowers_the_supply():
    full, low = Effected(), Effected(supply_droop__droop=0.1)
    assert full.outputs()["Pp"] - low.outputs()["Pp"] == pytest.approx(2e6)


def test_scaled_parameters():
    rig = Effected(
        valve_flow_gain__scale=0.7, piston_leakage__scale=4.0, line_diameter_error__scale=0.9,
        ambient_pressure_error__scale=1.02,
    )  # fmt: skip
    plain = Rig()
    assert rig.c.valve.k_q / plain.c.valve.k_q == pytest.approx(0.7)
    assert rig.c.cylinder.leak / plain.c.cylinder.leak == pytest.approx(4.0)
    assert rig.c.line.resistance / plain.c.line.resistance == pytest.approx(0.9**-4)
    assert rig.c.sea.p_am / plain.c.sea.p_am == pytest.approx(1.02)


def test_minor_losses_in_steady_flow():
    """K rho v^2/2 of the whole line, whatever the number of segments."""
    for n in (5, 10):
        rig = Effected(line_minor_losses__K=20.0, line__segments=n)
        Q = 5e-5
        v = Q / (np.pi * 4e-3**2 / 4)
        assert n * rig.c.line.minor * Q * Q == pytest.approx(20.0 * 850.0 * v**2 / 2)
