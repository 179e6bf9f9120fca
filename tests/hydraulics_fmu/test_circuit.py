"""The circuit as a whole: its solver, its state at rest, and what it conserves."""

import numpy as np
import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.hydraulics_fmu import circuit, integrator, states, tableau
from deepsea_cosim.hydraulics_fmu.bordered import Factors, Jacobian, factorise, solve
from deepsea_cosim.hydraulics_fmu.constants import by_name, constants
from deepsea_cosim.hydraulics_fmu.memory import new_memory, remembering
from deepsea_cosim.hydraulics_fmu.steady import steady_state
from deepsea_cosim.hydraulics_fmu.valve import settle
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.hydraulics_fmu.workspace import new_workspace
from scipy.integrate import solve_ivp


def border_of(y, c):
    """The border's states in y by name; a compiled function would give Python a copy of them."""
    return states.border.py_func(y, c)


class Rig:
    """The circuit on its own, moved along x_0 + v t."""

    def __init__(self, F_hold=6632.0, **changes):
        self.p = HYDRAULICS.parameters({name.replace("__", "."): value for name, value in changes.items()})
        self.numbers = constants(self.p)
        self.c = by_name(self.numbers)
        self.scale = states.state_scales(self.c)
        self.y, self.held = steady_state(self.numbers, F_hold)
        self.w = new_workspace(self.c)
        self.m = remembering.py_func(new_memory())
        settle.py_func(self.border.integral, self.c, self.m)

    @property
    def border(self):
        return border_of(self.y, self.c)

    def step(self, t, h, x=0.0, v=0.0, ref=0.0, ref_rate=0.0):
        status = integrator.advance(self.y, self.w, self.c, self.scale, t, h, x, v, ref, ref_rate, self.m)
        assert status == integrator.OK

    def outputs(self, x=0.0, v=0.0, x_cmd=0.0, v_cmd=0.0):
        out = np.zeros(len(circuit.OUTPUTS))
        circuit.outputs(self.y, self.c, x, v, x_cmd, v_cmd, np.nan, self.m, out)
        return dict(zip(circuit.OUTPUTS, out, strict=True))

    def rate(self, x=0.0, v=0.0, x_cmd=0.0, v_cmd=0.0, y=None):
        f = np.empty_like(self.y)
        y = self.y if y is None else np.array(y)
        circuit.derivatives(y, self.c, x, v, x_cmd, v_cmd, np.nan, self.m, f)
        return f


def test_bordered_solver_against_numpy():
    rng = np.random.default_rng(1)
    nc, m, sigma = 18, 8, 3.0
    sub, dia, sup = rng.normal(size=(3, nc))
    sub[0] = sup[-1] = 0.0
    B, D, feed = rng.normal(size=(nc, m)), rng.normal(size=(m, m)), rng.normal(size=4)
    dia -= 4.0
    port = (0, 8, 9, 17)
    J = np.zeros((nc + m, nc + m))
    J[:nc, :nc] = np.diag(dia) + np.diag(sub[1:], -1) + np.diag(sup[:-1], 1)
    J[:nc, nc:], J[nc:, nc:] = B, D
    for i, column in enumerate(port):
        J[nc + i, column] = feed[i]
    parts = Jacobian(sub, dia, sup, B, port, feed, D, np.zeros(0), np.zeros(0))
    factors = Factors(np.zeros(nc), np.zeros((nc, m)), np.zeros((m, m)), np.zeros(m))
    factorise(parts, sigma, factors)
    r = rng.normal(size=nc + m)
    u = r.copy()
    solve(parts, sigma, factors, u)
    assert np.allclose(u, np.linalg.solve(sigma * np.eye(nc + m) - J, r), rtol=1e-10)


@pytest.mark.parametrize("exact", [True, False], ids=["jacobian", "wrong jacobian"])
def test_tableau_has_order_three(exact):
    """y' = a y + nonlinear, also with a wrong Jacobian, as a W-method promises."""

    def f(y):
        return np.array([y[1], -4.0 * np.sin(y[0]) - 0.3 * y[1] ** 3])

    def J(y):
        if not exact:
            return np.array([[-1.0, 0.5], [2.0, -3.0]])
        return np.array([[0.0, 1.0], [-4.0 * np.cos(y[0]), -0.9 * y[1] ** 2]])

    def integrate(n):
        h, y = 1.0 / n, np.array([1.0, 0.5])
        for _ in range(n):
            A = np.eye(2) / (h * tableau.GAMMA) - J(y)
            u = []
            for i in range(4):
                yi = y + sum((tableau.A[i, j] * u[j] for j in range(i)), np.zeros(2))
                u.append(np.linalg.solve(A, f(yi) + sum((tableau.C[i, j] / h * u[j] for j in range(i)), np.zeros(2))))
            y = y + sum(m * ui for m, ui in zip(tableau.M, u, strict=True))
        return y

    exact_y = solve_ivp(lambda _, y: f(y), (0, 1), [1.0, 0.5], "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    errors = [np.abs(integrate(n) - exact_y).max() for n in (40, 80, 160)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(3.0, abs=0.15)


@pytest.mark.parametrize("depth", [0.0, 3000.0, 6000.0, 9000.0, 11000.0])
@pytest.mark.parametrize("F_hold", [-3000.0, 0.0, 6632.0, 10000.0])
def test_state_at_rest_holds_the_force_and_stands_still(depth, F_hold):
    rig = Rig(F_hold, depth=depth)
    assert np.abs(rig.rate() / rig.scale).max() < 1e-5  # in units of the scale, per second
    assert rig.outputs()["F_h"] == pytest.approx(F_hold, abs=1e-6)
    before = rig.y.copy()
    for k in range(100):
        rig.step(k * 1e-3, 1e-3)
    assert np.abs((rig.y - before) / rig.scale).max() < 1e-6


@pytest.mark.parametrize("F_hold", np.arange(-20000.0, 30001.0, 1000.0))
def test_held_or_not_the_state_says_so(F_hold):
    """Every load: either all is at rest, or the valve is shut and the state says that it could not be held."""
    rig = Rig(F_hold)
    assert rig.outputs()["F_h"] == pytest.approx(F_hold, abs=1e-6)
    if rig.held:
        assert np.abs(rig.rate() / rig.scale).max() < 1e-5
        assert abs(rig.outputs()["x_v"]) < 1.0
    else:
        assert rig.outputs()["x_v"] == 0.0


@pytest.mark.parametrize("F_hold", [15000.0, 60000.0, -60000.0])
def test_a_load_that_the_supply_cannot_hold_starts_behind_the_closed_valve(F_hold):
    rig = Rig(F_hold)
    out = rig.outputs()
    assert not rig.held
    assert out["F_h"] == pytest.approx(F_hold)
    assert out["x_v"] == 0.0
    assert min(out["P1"], out["P2"]) >= out["Pt"] - 1e-3
    for k in range(100):
        rig.step(k * 1e-3, 1e-3)
    assert np.isfinite(rig.y).all()


def drive(h, stop=0.4, **changes):
    """The circuit while the rod moves at constant speed and the built-in command rises from 0.1 s on."""
    rig = Rig(command__t_start=0.1, **changes)
    n = round(stop / h)
    for k in range(n):
        t = k * h
        rig.step(t, h, 0.02 * t, 0.02)
    return rig


@pytest.mark.parametrize("depth", [0.0, 11000.0])
def test_any_communication_step_gives_the_same_answer(depth):
    runs = [drive(h, depth=depth).y for h in (1e-4, 1e-3, 1e-2, 5e-2)]
    scale = drive(0.4, depth=depth).scale
    for y in runs[1:]:
        assert np.abs((y - runs[0]) / scale).max() < 2e-4


@pytest.mark.parametrize(
    "changes",
    [
        {"depth": 0.0},
        {"depth": 11000.0},
        {"depth": 11000.0, "line__variable_viscosity": False},
        {"depth": 0.0, "valve__lam_crit": 0.0},
        {"depth": 6000.0, "line__segments": 12},
    ],
    ids=lambda c: " ".join(f"{k}={v}" for k, v in c.items()),
)
def test_against_scipy(changes):
    """The same equations with another solver: only the integration can differ."""
    rig = drive(1e-3, solver__rtol=1e-7, **changes)
    other = Rig(command__t_start=0.1, **changes)
    target, ramp = 0.2, 5.0
    y = other.y
    for a, b, rate in ((0.0, 0.1, 0.0), (0.1, 0.4, target / ramp)):
        solution = solve_ivp(
            lambda t, y, rate=rate: other.rate(0.02 * t, 0.02, rate * (t - 0.1), rate, y),
            (a, b), y, "Radau", rtol=1e-9, atol=1e-9 * other.scale,
        )  # fmt: skip
        y = solution.y[:, -1]
    assert np.abs((rig.y - y) / rig.scale).max() < 2e-6


@pytest.mark.parametrize(("t_0", "h"), [(1e5, 1e-8), (1e9, 1e-4), (10.0, 1e-12), (-50.0, 1e-3), (0.0, 1e5)])
def test_any_time_and_any_step(t_0, h):
    """Late, early, tiny and huge steps: the state moves by h times its rate, or stays at rest."""
    rig = Rig(command__t_start=1e6)
    rig.border.p_t += 1e4
    rate = border_of(rig.rate(), rig.c).v_c
    before = rig.border.v_c
    rig.step(t_0, h)
    moved = rig.border.v_c - before
    if h < 1e-7:
        assert moved == pytest.approx(h * rate, rel=1e-2)
    else:
        assert np.isfinite(rig.y).all()
        assert moved != 0.0


def test_a_failed_step_leaves_the_state_as_it_was():
    rig = Rig()
    rig.step(0.0, 1e-3)
    before = rig.y.copy()
    status = integrator.advance(rig.y, rig.w, rig.c, rig.scale, 1e-3, 1e-3, 0.0, float("nan"), 0.0, 0.0, rig.m)
    assert status != integrator.OK
    assert (rig.y == before).all()
    rig.step(1e-3, 1e-3)
    assert np.abs((rig.y - before) / rig.scale).max() < 1e-6


def test_tolerance_controls_the_error():
    exact = drive(1e-3, depth=0.0, solver__rtol=1e-9)
    runs = [drive(1e-2, depth=0.0, solver__rtol=rtol) for rtol in (1e-3, 1e-5, 1e-7)]
    errors = [np.abs((run.y - exact.y) / exact.scale).max() for run in runs]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-6


def oil_volume(rig, x):
    """Oil in lines and chambers, and in tank and compensator, referred to zero pressure [m3]."""
    c, y, s = rig.c, rig.y, rig.border
    chain = states.chain_length(c) // 2
    segment = 2 * c.line.half_segment
    beta = c.oil.beta_e
    V_1 = c.cylinder.dead_volume + c.cylinder.area_1 * x + c.line.half_segment
    V_2 = c.cylinder.dead_volume + c.cylinder.area_2 * (c.cylinder.stroke - x) + c.line.half_segment
    V_tank = c.tank.volume + c.compensator.area * (c.compensator.length - s.x_c)
    # a volume V at pressure p holds V exp(p/beta), because the chambers' equation is dp = beta dV_in/V
    total = sum(segment * np.exp(y[first + k] / beta) for first in (0, chain) for k in range(1, chain, 2))
    total += c.line.half_segment * (np.exp(s.p_a / beta) + np.exp(s.p_b / beta))
    total += V_1 * np.exp(s.p_1 / beta) + V_2 * np.exp(s.p_2 / beta)
    return total, V_tank


def test_closed_valve_traps_the_oil():
    """With the spool shut and no leakage the piston side is an oil spring: dP = beta ln(V0/V)."""
    rig = Rig(controller__kp=0.0, controller__ki=0.0, controller__kd=0.0, cylinder__c_l=0.0, depth=0.0)
    V = rig.p["cylinder.dead_volume"] + 4.0 * np.pi * 4e-3**2 / 4
    before = rig.outputs()
    v, n = -1e-4, 2000
    for k in range(n):
        rig.step(k * 1e-3, 1e-3, v * k * 1e-3, v)
    for k in range(n, 2 * n):  # let the lines settle
        rig.step(k * 1e-3, 1e-3, v * n * 1e-3, 0.0)
    after = rig.outputs(v * n * 1e-3)
    A_1 = rig.c.cylinder.area_1
    expected = 1.4e9 * np.log(V / (V + A_1 * v * n * 1e-3))
    assert after["P1"] - before["P1"] == pytest.approx(expected, rel=5e-3)
    assert after["Pa"] == pytest.approx(after["P1"], rel=1e-6)


def test_oil_cavitates_and_comes_back():
    """Pull the piston away from a closed line: pressure stays positive, and the same oil is there afterwards.

    Not exactly the same: Eqs. 14 and 23 conserve volume, and oil that flows from one pressure to another changes it.
    """
    rig = Rig(0.0, controller__kp=0.0, controller__ki=0.0, controller__kd=0.0, cylinder__c_l=0.0, depth=0.0)
    before, _ = oil_volume(rig, 0.0)
    start = rig.outputs()["P1"]
    lowest, x, v = np.inf, 0.0, 0.05
    for k in range(80):
        speed = v if k < 40 else -v
        rig.step(k * 1e-3, 1e-3, x, speed)
        x += speed * 1e-3
        lowest = min(lowest, rig.outputs(x)["P1"])
    for k in range(80, 2080):
        rig.step(k * 1e-3, 1e-3, x, 0.0)
    assert 0.0 < lowest < 3000.0
    after, _ = oil_volume(rig, x)
    assert after == pytest.approx(before, rel=1e-4)
    assert rig.outputs(x)["P1"] == pytest.approx(start, rel=0.1)


def test_the_pump_delivers_no_more_than_it_can():
    rig = Rig(depth=0.0, valve__q_rated=50e-3 / 60, line__diameter=10e-3, command__t_start=0.0, command__ramp_time=1e-3)
    for k in range(300):
        rig.step(k * 1e-3, 1e-3, 0.09 * k * 1e-3, 0.09)
    out = rig.outputs(0.027, 0.09, 0.2)
    Q_pump = 6e-6 * 1450 / 60
    assert out["Qa"] == pytest.approx(Q_pump)
    assert out["Qrv"] == 0.0
    assert out["Pp"] < out["Pt"] + 20e6
    assert out["Pa"] < out["Pp"]


def test_rod_thicker_than_the_piston_is_refused():
    with pytest.raises(ParameterError, match=r"cylinder\.d_h"):
        constants(HYDRAULICS.parameters({"cylinder.d_h": 0.05}))
