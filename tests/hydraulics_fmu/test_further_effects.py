"""Effects of oil, lines, cylinder and tank beyond the first ones: closed forms, limits, other solvers."""

import numpy as np
import pytest
from deepsea_cosim.fmus.hydraulics import DeepseaHydraulics
from deepsea_cosim.hydraulics_fmu.bordered import Factors, Jacobian, factorise, flow_of, solve
from deepsea_cosim.hydraulics_fmu.compensator import gas_softening
from deepsea_cosim.hydraulics_fmu.constants import WARM_STEPS, by_name, constants, warmed, warming
from deepsea_cosim.hydraulics_fmu.cylinder import CREEP, cushion_loss, outward_leaks, piston_leak, viscous
from deepsea_cosim.hydraulics_fmu.friction import bristle
from deepsea_cosim.hydraulics_fmu.line import LAG_RATES, LAG_WEIGHTS, LAGS, fittings, half_at_chamber, turbulence
from deepsea_cosim.hydraulics_fmu.moving_supply import characteristic, pressure_at_rest
from deepsea_cosim.hydraulics_fmu.oil import emulsion, heavier, line_factor, modulus_factor
from deepsea_cosim.hydraulics_fmu.states import border_length, chain_length
from deepsea_cosim.hydraulics_fmu.supply import pump_flow, relief_pressure, return_pressure, sunk
from deepsea_cosim.hydraulics_fmu.valve import counterbalance_loss, held_back, land
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from scipy.integrate import solve_ivp
from scipy.special import ive

from .test_circuit import Rig
from .test_effects import Effected


def test_modulus_grows_with_pressure_and_walls_do_not():
    c = Effected(bulk_modulus_pressure__m=10.0).c
    assert 1.4e9 * modulus_factor(5e7, 1.4e9, c) == pytest.approx(1.4e9 + 10.0 * 5e7)
    with_walls = 1.0 / (1 / 1.4e9 + 1 / 0.7e9)
    assert 1 / (with_walls * modulus_factor(5e7, with_walls, c)) == pytest.approx(1 / 1.9e9 + 1 / 0.7e9)


def test_air_dissolves():
    free, half = (Effected(entrained_air__fraction=0.02, entrained_air__dissolving=d).c for d in (0.0, 1 / 2e6))
    P = 2e6 + 101300.0
    soft = [1 / (1.4e9 * modulus_factor(P, 1.4e9, c)) - 1 / 1.4e9 for c in (free, half)]
    assert soft[1] / soft[0] == pytest.approx(0.5)


def test_hoses_get_stiffer_as_they_fill_and_are_alike_at_10_mpa():
    hose = {"depth": 0.0, "hose_compliance__compliance": 2e-9}
    c, plain = Effected(**hose, hose_compliance__stiffening=1.0).c, Effected(**hose).c
    at_10, at_30 = c.sea.p_am + 10e6, c.sea.p_am + 30e6
    assert line_factor(at_10, c) == pytest.approx(1.0)
    assert half_at_chamber(at_10, c) == pytest.approx(plain.line.half_at_chamber)
    assert 1 / (c.line.beta * line_factor(at_30, c)) == pytest.approx(1 / 1.4e9 + 2e-9 * 2 / 4)
    walls = plain.line.half_at_chamber - plain.line.half_segment
    assert half_at_chamber(at_30, c) == pytest.approx(plain.line.half_segment + walls / 2)


def test_a_bent_relief_valve_and_a_supply_that_sinks_slowly():
    c = Effected(relief_override__R=2e10, relief_override__power=0.6, depth=0.0).c
    P = relief_pressure(0.4, 5e6, 5e6, 1e5, c)
    rest = 1.45e-4 - land(0.4, P, 5e6, c)
    assert pytest.approx(1e5 + 20e6 + 2e10 * 1.45e-4 * (rest / 1.45e-4) ** 0.6, rel=1e-6) == P
    c = Effected(supply_droop__droop=0.2, supply_droop__time=3.0).c
    assert c.relief.p_set == 20e6
    assert sunk(3.0, c) == pytest.approx(20e6 * (1 - 0.2 * (1 - np.exp(-1))))


def test_heavy_oil_flows_slower():
    c, plain = Effected(density_pressure__share=1.0).c, Effected().c
    assert heavier(1.1e8, c) == pytest.approx(1.0 + 110 / 1400)
    turbulent = {"valve__lam_crit": 0.0}
    c, plain = Effected(density_pressure__share=1.0, **turbulent).c, Effected(**turbulent).c
    assert land(0.5, 1.1e8, 1.0e8, c) / land(0.5, 1.1e8, 1.0e8, plain) == pytest.approx(1 / np.sqrt(1 + 105 / 1400))


def test_water_in_oil_makes_it_thick_heavy_and_hardly_stiffer():
    assert emulsion(0.02, 850.0, 1.4e9, 0.0) == (0.02, 850.0, 1.4e9)
    eta, rho, beta = emulsion(0.02, 850.0, 1.4e9, 0.1)
    assert eta == pytest.approx(0.02 * 0.9**-2.5)
    assert rho == pytest.approx(0.9 * 850 + 99.8)
    assert 1 / beta == pytest.approx(0.9 / 1.4e9 + 0.1 / 2.2e9)
    wet, dry = Effected(water_in_oil__share=0.1).c, Effected().c
    assert wet.oil.alpha == dry.oil.alpha
    assert wet.oil.eta0 / dry.oil.eta0 == pytest.approx(0.9**-2.5)


def test_turbulence_is_blasius_beyond_the_transition_and_nothing_before():
    c = Effected(line_turbulence__share=1.0).c
    eta = 850 * 5e-6

    def flow(reynolds):
        return reynolds * np.pi * 4e-3 * eta / (4 * 850.0)

    assert turbulence(flow(2200.0), eta, c) == 1.0
    for reynolds in (4000.0, 2e4):
        assert turbulence(-flow(reynolds), eta, c) == pytest.approx(0.3164 * reynolds**-0.25 / (64 / reynolds))
    assert turbulence(flow(3450.0 - 1e-6), eta, c) == pytest.approx(turbulence(flow(3450.0 + 1e-6), eta, c), rel=1e-6)
    assert 1.0 < turbulence(flow(2600.0), eta, c) < turbulence(flow(3000.0), eta, c)


def test_fittings_differ_by_line_and_by_direction():
    c = Effected(line_minor_losses__K=40.0, line_minor_losses__line_b=0.5, line_minor_losses__backward=3.0).c
    K = c.line.minor
    assert [fittings(Q, second, c) for second in (False, True) for Q in (1e-5, -1e-5)] == [K, 3 * K, K / 2, 1.5 * K]


def test_lags_are_eliminated_as_a_dense_solver_would():
    rng = np.random.default_rng(4)
    n, m, sigma = 5, 10, 40.0
    nc = 2 * (2 * n - 1)
    nl = 2 * n * LAGS
    sub, dia, sup = rng.normal(size=(3, nc))
    sub[0] = sup[-1] = sub[nc // 2] = sup[nc // 2 - 1] = 0.0
    B, D, feed = rng.normal(size=(nc, m)), rng.normal(size=(m, m)), rng.normal(size=4)
    dia -= 4.0
    pull, follow = rng.uniform(0.5, 5.0, nl), rng.uniform(1.0, 100.0, nl)
    port = (0, nc // 2 - 1, nc // 2, nc - 1)
    J = np.zeros((nc + m + nl, nc + m + nl))
    J[:nc, :nc] = np.diag(dia) + np.diag(sub[1:], -1) + np.diag(sup[:-1], 1)
    J[:nc, nc : nc + m], J[nc : nc + m, nc : nc + m] = B, D
    for i, column in enumerate(port):
        J[nc + i, column] = feed[i]
    flows = [*range(0, nc // 2, 2), *range(nc // 2, nc, 2)]
    for i in range(nl):
        k, w = flows[i // LAGS], nc + m + i
        assert flow_of(i // LAGS, nc) == k
        J[k, w], J[w, k], J[w, w] = pull[i], follow[i], -follow[i]
    parts = Jacobian(sub, dia, sup, B, port, feed, D, pull, follow)
    factors = Factors(np.zeros(nc), np.zeros((nc, m)), np.zeros((m, m)), np.zeros(m))
    factorise(parts, sigma, factors)
    r = rng.normal(size=nc + m + nl)
    u = r.copy()
    solve(parts, sigma, factors, u)
    assert np.allclose(u, np.linalg.solve(sigma * np.eye(len(J)) - J, r), rtol=1e-9)


def test_unsteady_friction_is_zielkes():
    """The loss of a swinging flow over its laminar one, against the exact profile of a swinging laminar flow.

    With s = i omega R^2/nu the exact one is s/8 1/(1 - 2 I1(q)/(q I0(q))), q = sqrt(s); without the inertia s/8.
    """
    for s in 1j * np.array([1.0, 10.0, 100.0, 1000.0]):
        q = np.sqrt(s)
        exact = s / 8 / (1 - 2 * ive(1, q) / (q * ive(0, q))) - s / 8
        three = 1.0 + 0.5 * sum(m * s / (s + n) for m, n in zip(LAG_WEIGHTS, LAG_RATES, strict=True))
        assert abs(three - exact) < 0.05 * abs(exact)


def test_lags_follow_their_flow_and_cost_half_the_laminar_loss():
    rig, plain = Effected(unsteady_line_friction__share=1.0), Effected()
    b, first = chain_length(rig.c), chain_length(rig.c) + border_length(rig.c)
    y = rig.y.copy()
    y[: b // 2 : 2] = 4e-5
    y[first:] = 1e-5
    f, without = rig.rate(y=y), plain.rate(y=y[:first])
    loss = (without[0] - f[0]) * rig.c.line.inertance
    eta = loss / (0.5 * rig.c.line.resistance * sum(LAG_WEIGHTS) * 3e-5)
    assert eta == pytest.approx(850 * 22e-6 * np.exp(2.2e-8 * rig.outputs()["Pa"]), rel=0.01)
    assert f[first] == pytest.approx(LAG_RATES[0] * eta / (850.0 * 2e-3**2) * 3e-5, rel=1e-9)
    still = rig.y.copy()
    still[first:] = 0.0
    assert np.abs(rig.rate(y=rig.y)[:first] - plain.rate(y=plain.y)).max() == 0.0


@pytest.mark.parametrize("changes", [
    {"unsteady_line_friction__share": 1.0, "depth": 0.0},
    {"unsteady_line_friction__share": 1.0, "line__segments": 9, "joint_clearance__gap": 2e-4},
    {"pump_dynamics__T": 0.05, "umbilical_supply__length": 60.0},
    {"umbilical_supply__length": 300.0, "counterbalance_valve__p_set": 8e6},
    {"pump_dynamics__T": 0.02, "filter_clogging__dp": 5e5, "filter_clogging__back": 0.4},
    {"pump_dynamics__T": 0.02, "pump_dynamics__power": 0.5},
    {"pump_dynamics__T": 0.02, "pump_dynamics__roundness": 0.2},
], ids=lambda c: " ".join(c))  # fmt: skip
def test_against_scipy(changes):
    """The same equations with another solver: only the integration can differ."""
    rig = Effected(**{"depth": 3000.0, "command__t_start": 0.1, "solver__rtol": 1e-7, **changes})
    other = Effected(**{"depth": 3000.0, "command__t_start": 0.1, **changes})
    x, v = (lambda t: 0.01 * t), 0.01
    for k in range(300):
        rig.step(k * 1e-3, 1e-3, x(k * 1e-3), v)
    y = other.y
    for a, b, rate in ((0.0, 0.1, 0.0), (0.1, 0.3, 0.04)):
        found = solve_ivp(
            lambda t, y, rate=rate: other.rate(x(t), v, rate * (t - 0.1), rate, y),
            (a, b), y, "Radau", rtol=1e-9, atol=1e-9 * other.scale,
        )  # fmt: skip
        y = found.y[:, -1]
    assert np.abs((rig.y - y) / rig.scale).max() < 2e-5


def test_a_cushion_is_its_orifice():
    c = Effected(end_cushion__length=0.02, end_cushion__area=1e-6).c
    Q = 6e-5
    whole = 425.0 * (Q / (0.7 * 1e-6)) ** 2
    for way, expected in ((0.0, whole), (-1e-3, whole), (0.01, whole / 4), (0.021, 0.0)):
        assert cushion_loss(Q, way, c.sea.p_am, c) == pytest.approx(expected)


@pytest.mark.parametrize("side", [0, 1], ids=["piston side", "rod side"])
def test_a_cushion_brakes_what_leaves_its_chamber(side):
    rigs = [Effected(depth=0.0, **effect) for effect in ({}, {"end_cushion__length": 0.02, "end_cushion__area": 2e-6})]
    middle, c = chain_length(rigs[0].c) // 2, rigs[0].c
    k, out = (middle - 1, -5e-5) if side == 0 else (middle, 5e-5)
    near, loss = 0.004 if side == 0 else c.cylinder.stroke - 0.004, 425.0 * (5e-5 * 0.8 / (0.7 * 2e-6)) ** 2
    for Q, x, expected in ((out, near, loss), (-out, near, 0.0), (out, 0.1, 0.0)):
        y = rigs[0].y.copy()
        y[k] = Q
        plain, braked = (rig.rate(x=x, y=y)[k] for rig in rigs)
        assert (braked - plain) * c.line.inertance == pytest.approx(-np.sign(Q) * expected, rel=1e-6, abs=1e-3)


def test_a_cushion_raises_the_pressure_of_its_chamber():
    """Steadily retracting, by what the orifice takes; the loss of the line, which is laminar, falls with the flow."""

    def flow(**effect):
        rig = Effected(depth=0.0, **effect)
        for k in range(500):
            rig.step(k * 1e-3, 1e-3, 0.004, -0.03, ref=-0.3)  # the valve opens wide
        return rig.outputs()

    plain, braked = flow(), flow(end_cushion__length=0.02, end_cushion__area=2e-6)
    raised = braked["P1"] - braked["Pa"] - braked["Q1"] / plain["Q1"] * (plain["P1"] - plain["Pa"])
    assert raised == pytest.approx(425.0 * (braked["Q1"] * 0.8 / (0.7 * 2e-6)) ** 2, rel=0.01)


def test_a_loose_rod_crosses_its_clearance_without_force():
    gap = 4e-4
    rig = Effected(joint_clearance__gap=gap, depth=0.0)
    first = rig.outputs()
    assert first["F_h"] == pytest.approx(6632.0, abs=1.0)
    x, F = 0.0, []
    for k in range(400):  # the arm runs ahead of the rod and comes back
        v = 4e-3 if k < 200 else -4e-3
        rig.step(k * 1e-3, 1e-3, x, v)
        x += v * 1e-3
        F.append(rig.out[0])
    F = np.array(F)
    assert (F == 0.0).sum() > 20
    plain = Effected(depth=0.0)
    assert first["u"] == pytest.approx(plain.outputs()["u"], abs=1e-9)  # where it rests the controller is content
    assert Effected(joint_clearance__gap=1e-9).outputs()["F_h"] == pytest.approx(plain.outputs()["F_h"], rel=1e-4)


def test_leaks_into_the_sea_are_balanced_by_what_flows_in():
    rig = Effected(external_leakage__c=2e-14, external_leakage__piston_side=1.0, depth=0.0)
    out = rig.outputs()
    p_am = rig.c.sea.p_am
    assert outward_leaks(out["P1"], out["P2"], rig.c) == pytest.approx(
        (2e-14 * (out["P1"] - p_am), 2e-14 * (out["P2"] - p_am))
    )
    assert rig.held
    drift = rig.rate() / rig.scale
    drift[chain_length(rig.c) + 4] = 0.0  # the tank empties
    assert np.abs(drift).max() < 1e-5
    assert out["Q1"] - out["Q2"] == pytest.approx(2e-14 * (out["P1"] + out["P2"] - 2 * p_am), rel=1e-3)


def test_trapped_air_is_a_spring_of_what_the_sea_has_left_of_it():
    assert gas_softening(1e6, 0.1, 1.4e9, 0.0) == 1.0
    volume, P, gas = 0.1, 2e5, 0.1013e6 * 1e-3
    K = 1.4e9 / volume * gas_softening(P, volume, 1.4e9, gas)
    assert pytest.approx(volume / 1.4e9 + gas / P / (1.2 * P)) == 1 / K
    rig = Effected(compensator_trapped_air__volume=2e-3, depth=3000.0)
    assert rig.border.x_c == pytest.approx(2e-3 * (1 - 0.1013 / 30) / rig.c.compensator.area)
    assert rig.border.p_t == pytest.approx(3e7 + 3000.0 * (0.3 - rig.border.x_c) / rig.c.compensator.area)
    assert np.abs(rig.rate() / rig.scale).max() < 1e-5


def test_a_short_compensator_stops():
    rig = Effected(compensator_travel__missing=0.6, depth=0.0)
    travel = 0.4 * (rig.c.cylinder.area_1 - rig.c.cylinder.area_2) * 0.25 / rig.c.compensator.area
    assert rig.c.compensator.travel == pytest.approx(travel)
    free = Effected(depth=0.0)
    for it in (rig, free):
        it.border.x_c = 1.001 * travel
    push = rig.rate()[chain_length(rig.c) + 6] - free.rate()[chain_length(rig.c) + 6]
    assert push == pytest.approx(-1e8 * 1e-3 * travel)


def test_a_compensator_without_travel_takes_nothing_up():
    """All of it missing is the end of a way, not a compensator without end."""
    travels = [Effected(compensator_travel__missing=m, depth=0.0).c.compensator.travel for m in (0.9, 0.999, 1.0)]
    assert travels[0] > travels[1] > travels[2] > 0.0
    assert travels[2] < 1e-3 * travels[1]


def test_bristles_are_a_spring_and_then_slide():
    z = 0.0
    for _ in range(10):
        z = bristle(z, 1e-4, 1e-3, 300.0, 1e6)
    assert 1e6 * z == pytest.approx(1.0, rel=0.01)  # 1 um of 300 um
    for _ in range(100):
        z = bristle(z, 0.05, 1e-3, 300.0, 1e6)
    assert 1e6 * z == pytest.approx(300.0)
    assert bristle(z, 0.0, 1.0, 300.0, 1e6) == z
    half = bristle(z, -0.02, 1e-3, 300.0, 1e6)
    assert bristle(half, -0.02, 1e-3, 300.0, 1e6) == pytest.approx(bristle(z, -0.02, 2e-3, 300.0, 1e6), rel=1e-12)
    assert 1e6 * bristle(z, -1.0, 1.0, 300.0, 1e6) == pytest.approx(-300.0)


@pytest.mark.parametrize("changes", [
    {"cylinder_presliding__F_c": 300.0},
    {"cylinder_coulomb_friction__F_c": 300.0, "cylinder_coulomb_friction__sigma0": 1e6},
], ids=["presliding", "coulomb"])  # fmt: skip
def test_friction_before_sliding_hangs_on_the_way(changes):
    rig, plain = Effected(**changes), Effected()
    way = []
    for it in (rig, plain):
        for k in range(100):
            it.step(k * 1e-3, 1e-3, 1e-6 * k, 1e-3)
        way.append(it.out[0])
    assert way[1] - way[0] == pytest.approx(300.0 * (1 - np.exp(-1e6 * 1e-4 / 300.0)), rel=1e-6)


def test_stiction_grows_with_rest_and_is_lost_on_the_way():
    rig = Effected(
        cylinder_stribeck_friction__F_extra=200.0, cylinder_stribeck_friction__rest_time=2.0,
        cylinder_stribeck_friction__v_s=0.5,
    )  # fmt: skip
    assert rig.m.rest == 1.0
    for k in range(1000):
        rig.step(k * 1e-3, 1e-3, 0.05 * k * 1e-3, 0.05)
    assert rig.m.rest == pytest.approx(0.5 / 50.5)
    for k in range(2000):
        rig.step(1.0 + k * 1e-3, 1e-3, 0.05, 0.0)
    assert rig.m.rest == pytest.approx(1 - np.exp(-1.0) * (1 - 0.5 / 50.5))


def test_viscous_friction_with_a_power_and_with_the_oils_viscosity():
    c = Effected(cylinder_viscous_error__power=1.6).c
    assert viscous(CREEP, 1e7, 1e7, c) == pytest.approx(1000.0)
    assert viscous(2 * CREEP, 1e7, 1e7, c) == pytest.approx(1000.0 * 2**0.6)
    c = Effected(cylinder_viscous_error__thickening=0.5).c
    assert viscous(0.1, 1.2e8, 1e8, c) == pytest.approx(1000.0 * (1 + 0.5 * (np.exp(2.2e-8 * 1.1e8) - 1)))


def test_a_leak_that_pressure_opens():
    c = Effected(piston_leakage__scale=3.0, piston_leakage__opening=1e-7).c
    assert piston_leak(3e7, 2e7, c) == pytest.approx(5e-12 * 1e7 * (1 + 2 * (1 + 1e-7 * 1e7)))


def test_slip_that_the_viscosity_does_not_lessen():
    assert pump_flow(1e-4, 0.1, 4.0, 0.3) == pytest.approx(1e-4 * (1 - 0.1 * (0.7 / 4 + 0.3)))


def test_the_temperatures_of_lines_and_cylinder():
    cold = Effected(oil_temperature__T=293.15).c
    lines, cylinder = (Effected(oil_temperature__T=293.15, **{f"oil_temperature__{place}": 0.0}).c
                       for place in ("lines", "cylinder"))  # fmt: skip
    at_40 = Effected().c
    assert (lines.line.eta0, lines.oil.eta0) == (at_40.line.eta0, cold.oil.eta0)
    assert (cylinder.cylinder.thinner, cylinder.oil.thinner) == (1.0, cold.oil.thinner)
    sea = Effected(line_thermal__colder=20.0).c
    assert sea.line.eta0 == pytest.approx(cold.line.eta0, rel=1e-12)
    assert sea.oil.eta0 == at_40.oil.eta0


def test_a_warm_up_passes_through_the_temperatures():
    p = HYDRAULICS.parameters({"effect.oil_warm_up.rise": 25.0, "effect.oil_warm_up.time": 60.0})
    row, table = constants(p), warming(p)
    assert len(table) == (WARM_STEPS + 1) * len(row)
    for t in (0.0, 10.0, 300.0):
        warmed(t, row, table, by_name(row))
        exact = by_name(constants({**p, "effect.oil_temperature.T": 313.15 + 25.0 * (1 - np.exp(-t / 60.0))}))
        assert by_name(row).oil.eta0 == pytest.approx(exact.oil.eta0, rel=2e-4)
        assert by_name(row).line.stiffness == pytest.approx(exact.line.stiffness, rel=2e-4)


def test_a_filter_takes_from_supply_and_return():
    c = Effected(filter_clogging__dp=4e5, filter_clogging__back=0.25, depth=0.0).c
    thicker = np.exp(2.2e-8 * (0.1013e6 + 1e7))
    P = relief_pressure(0.4, 5e6, 5e6, 1e5, c)
    assert pytest.approx(1e5 + 20e6 - 0.75 * 4e5 * thicker * land(0.4, P, 5e6, c) / 1.45e-4, rel=1e-9) == P
    P = return_pressure(0.4, 0.0, 5e6, 5e6, 1e5, c)
    assert pytest.approx(1e5 + 0.25 * 4e5 * thicker * land(0.4, 5e6, P, c) / 1.45e-4, rel=1e-9) == P
    assert return_pressure(0.4, 0.0, 5e6, 5e6, 1e5, Rig().c) == 1e5


def demanded(rig, seconds, v=0.03):
    """Outputs after so long a stroke at constant speed, the command far ahead."""
    for k in range(round(seconds * 1e3)):
        rig.step(k * 1e-3, 1e-3, v * k * 1e-3, v)
    return rig.outputs(v * seconds, v, 0.2, 0.0)


def test_a_compensated_pump_droops_and_lags():
    pump = {"pump_dynamics__T": 0.1, "pump_dynamics__droop": 0.1}
    jump = {"depth": 0.0, "command__t_start": 0.0, "command__ramp_time": 0.01}
    rig = Effected(**pump, **jump)
    full = rig.outputs()["Pp"]
    out = demanded(rig, 3.0)
    assert out["Qrv"] == 0.0
    Q = out["Qa"]
    assert 2e-5 < Q < 1.4e-4
    assert out["Pp"] == pytest.approx(out["Pt"] + 20e6 * (1 - 0.1 * Q / 1.45e-4), rel=1e-3)
    lowest = min(demanded(Effected(**pump, **jump), 1e-2 * n)["Pp"] for n in range(1, 12))
    assert lowest < out["Pp"] < full  # it sags before the pump has come up


@pytest.mark.parametrize("power", [0.5, 1.6])
def test_the_pressure_of_a_compensated_pump_falls_with_a_power_of_its_flow(power):
    pump = {"pump_dynamics__T": 0.02, "pump_dynamics__droop": 0.1, "pump_dynamics__power": power}
    out = demanded(Effected(**pump, depth=0.0, command__t_start=0.0, command__ramp_time=0.01), 3.0)
    Q = out["Qa"]
    assert 2e-5 < Q < 1.4e-4
    assert out["Pp"] == pytest.approx(out["Pt"] + 20e6 * (1 - 0.1 * (Q / 1.45e-4) ** power), rel=1e-3)


def test_round_knees_of_a_compensated_pump():
    """Flow over pressure is the straight line averaged over a logistic distribution of its knees: far from these it is
    that line, and its slope is steepest, tanh(1/(4 r)), in the middle, where half of the flow is given."""
    x, r = np.linspace(-2.0, 3.0, 501), 0.15
    share = np.array([characteristic(v, 1.0, r) for v in x])
    width, density = 1e-3, lambda z: 1.0 / (4.0 * r * np.cosh(z / (2.0 * r)) ** 2)
    knees = np.arange(-20.0 * r, 20.0 * r, width) + 0.5 * width
    averaged = [np.sum(np.clip(v - knees, 0.0, 1.0) * density(knees)) * width for v in x]
    assert share == pytest.approx(averaged, abs=1e-5)
    assert characteristic(0.5, 1.0, r) == pytest.approx(0.5, abs=1e-12)
    slope = (characteristic(0.5 + 1e-4, 1.0, r) - characteristic(0.5 - 1e-4, 1.0, r)) / 2e-4
    assert slope == pytest.approx(np.tanh(1.0 / (4.0 * r)), rel=1e-6)
    assert [characteristic(v, 1.0, 1e-3) for v in (-1.0, 0.25, 2.0)] == pytest.approx([0.0, 0.25, 1.0], abs=1e-12)


@pytest.mark.parametrize("taken", [0.0, 1e-8, 1e-6, 1e-4, 1.4e-4])
def test_a_compensated_pump_with_round_knees_rests_where_it_gives_what_is_taken(taken):
    c = Effected(pump_dynamics__T=0.05, pump_dynamics__roundness=0.3, pump_dynamics__power=0.8).c
    x = (20e6 - pressure_at_rest(taken, c)) / (0.05 * 20e6)
    given = c.pump.flow * characteristic(x, 0.8, 0.3)
    back = c.pump.flow * max((1.0 - 0.05 * x) - 1.1, 0.0) / 0.05
    assert given - back == pytest.approx(taken, rel=1e-6, abs=1e-9)


def test_a_long_hose_loses_its_poiseuille_share():
    rig = Effected(umbilical_supply__length=100.0, depth=0.0, command__t_start=0.0, command__ramp_time=0.01)
    out = demanded(rig, 4.0)
    eta = 850 * 22e-6 * np.exp(2.2e-8 * out["Pp"])
    loss = 128 * eta * 100.0 / (np.pi * 0.012**4) * out["Qa"]
    assert out["Pt"] + 20e6 - out["Pp"] == pytest.approx(loss, rel=1e-2)
    assert out["Qrv"] == pytest.approx(1.45e-4 - out["Qa"], rel=1e-2)


def test_a_counterbalance_valve_holds_until_load_or_pilot_open_it():
    c = Effected(counterbalance_valve__p_set=10e6, counterbalance_valve__ratio=4.0, depth=0.0).c
    p = c.sea.p_am
    wide = counterbalance_loss(-5e-3 / 60, p + 5e6, p + 3e6, c)
    assert wide == pytest.approx(0.5e6)
    half = counterbalance_loss(-5e-3 / 60, p + 11e6, p, c)
    assert half == pytest.approx(4 * 0.5e6)
    shut = counterbalance_loss(-1e-7, p + 5e6, p, c)
    assert shut == pytest.approx(0.5e6 * (1e-7 / (1e-3 * 5e-3 / 60)) ** 2)


def test_a_spool_with_play_lags_by_half_of_it_either_way():
    assert [held_back(x, 0.1, 0.02) for x in (0.11, 0.2, 0.0)] == [0.1, pytest.approx(0.18), pytest.approx(0.02)]
    rig = Effected(valve_hysteresis__width=0.06, controller__ki=0.0, controller__kd=0.0, command__use_input=True)
    up, down = [], []
    for k in range(800):
        t, rate = k * 1e-3, 2e-3 if k < 400 else -2e-3
        ref = 2e-3 * t if k < 400 else 2e-3 * (0.8 - t)
        rig.step(t, 1e-3, 0.0, 0.0, ref, rate)
        u, x_v = rig.out[13], rig.out[12]
        (up if k < 400 else down).append(x_v - u / 10.0)
    assert up[-1] == pytest.approx(-0.03)
    assert down[-1] == pytest.approx(0.03)
    assert up[0] == pytest.approx(0.0, abs=1e-3)  # it begins in the middle
    assert all(-0.03 - 1e-12 <= x <= 0.03 + 1e-12 for x in (*up, *down))


def test_a_silted_spool_needs_a_push_and_is_free_then():
    rig = Effected(silt_lock__force=0.05, silt_lock__time=10.0, controller__ki=0.0, controller__kd=0.0,
                   command__use_input=True)  # fmt: skip
    stood = rig.m.spool
    stuck = []
    for k in range(600):
        ref = 1e-4 * k * 1e-3 * 10
        rig.step(k * 1e-3, 1e-3, 0.0, 0.0, ref, 1e-3)
        stuck.append(rig.out[12])
    u = 2.5 * 1e3 * 1e-3 * np.arange(1, 601) * 1e-3 / 10.0
    first = np.flatnonzero(np.array(stuck) > stood + 1e-3)[0]
    assert u[first] == pytest.approx(0.05, abs=3e-3)
    assert stuck[first + 5] - stood == pytest.approx(u[first + 5], abs=2e-3)
    assert rig.m.silt < 0.1


@pytest.mark.parametrize(("missing", "cavitates"), [(1.0, True), (0.0, False)])
def test_a_tank_that_cannot_breathe_is_drawn_empty_at_the_surface_and_says_so(missing, cavitates):
    """What the rod displaces, 98 ml of a stroke of 0.2 m, takes more than an atmosphere from 112 l without a
    compensator."""
    it, told = DeepseaHydraulics(instance_name="it", resources="", visible=False, logger=0), []
    it._tell = lambda text, status: told.append(text)
    given = {"depth": 0.0, "effect.compensator_travel.missing": missing}
    for name, value in {**given, "command.t_start": 0.0, "command.ramp_time": 20.0}.items():
        it.values[HYDRAULICS.index(name)] = value
    it.setup_experiment(0.0)
    it.enter_initialization_mode()
    it.exit_initialization_mode()
    for k in range(2000):  # as the command has it
        it.values[HYDRAULICS.index("x_h")], it.values[HYDRAULICS.index("v_h")] = 1e-4 * k, 1e-2
        it.do_step(k * 1e-2, 1e-2)
    assert (it.values[HYDRAULICS.index("Pt")] < 3000.0) == cavitates
    assert ["Pt has fallen below its vapour pressure" in text for text in told] == [True] * cavitates
