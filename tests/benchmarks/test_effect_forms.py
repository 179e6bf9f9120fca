"""Other forms of the plant's effects: neutral ones are the plain effect, and each keeps what physics keeps."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.integrate import quad

from benchmarks.blind.effect_forms import FORMS
from benchmarks.blind.effects import CATALOGUE, SENSORS, by_id
from benchmarks.blind.forms import (
    bristle_force,
    bristle_rate,
    directed,
    edge,
    friction,
    friction_level,
    lands,
    leak,
    oil_compliance,
    opening,
    piston_leak,
    wall_compliance,
)
from benchmarks.blind.machine import Machine, constants
from benchmarks.blind.measure import KINDS, Channel, ideal, scatter
from benchmarks.blind.plant import simulate
from benchmarks.blind.supply import pump_flow, relief_flow, relief_pressure
from benchmarks.blind.system import KEYS, valve
from benchmarks.blind.water import arm, beam_drag, uneven_arm

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

TIMES = np.arange(0.0, 8.0, 0.01)
MACHINE = Machine(depth=500.0, ramp_time=3.0, hold_time=0.5, t_start=1.0)
OF_THE_PLANT = [f for f in FORMS if by_id(f.effect) not in SENSORS]
NEUTRAL = {f.name: f.default for f in fields(Machine)}
P_A, P_B, P_T, P_P = 12e6, 9e6, 5e6, 25e6


def named(form):
    return f"{form.effect}-{form.id}"


def with_form(form, amplitude, shape=None):
    """The machine with an effect in a form; shape: values of the form's parameters, default the ranges' upper ends."""
    effect = by_id(form.effect)
    shapes = {name: 0.5 * (low + high) for name, (low, high) in effect.shapes.items()}
    shape = shape or {name: high for name, (_, high) in form.ranges.items()}
    return replace(MACHINE, **effect.plant(1.0, amplitude, shapes | shape))


@pytest.fixture(scope="module")
def plain():
    return simulate(MACHINE, TIMES)


@pytest.mark.parametrize("form", OF_THE_PLANT, ids=named)
def test_a_form_of_an_absent_effect_is_nothing(form, plain):
    assert np.array_equal(simulate(with_form(form, 0.0), TIMES), plain)


@pytest.mark.parametrize("form", OF_THE_PLANT, ids=named)
def test_a_neutral_form_is_the_plain_effect_and_another_is_not(form):
    effect = by_id(form.effect)
    amplitude = effect.most_up if effect.id == "pump_slip" else 0.25 * effect.most_up
    neutral = simulate(with_form(form, amplitude, {name: NEUTRAL[name] for name in form.ranges}), TIMES)
    assert np.array_equal(neutral, simulate(with_form(form, amplitude, {"friction_uneven": 0.0}), TIMES))
    shape = {name: low + (0.3 + 0.2 * i) * (high - low) for i, (name, (low, high)) in enumerate(form.ranges.items())}
    other = simulate(with_form(form, amplitude, shape), TIMES) - neutral
    assert np.abs(other[:, KEYS.index("P1")]).max() > 10.0


def test_forms_are_of_effects_that_exist():
    known = {e.id for e in (*CATALOGUE, *SENSORS)}
    assert {f.effect for f in FORMS} <= known
    assert len({named(f) for f in FORMS}) == len(FORMS)
    for f in FORMS:
        assert all(low <= high for low, high in f.ranges.values())
        if by_id(f.effect) not in SENSORS:
            assert f.ranges.keys() <= NEUTRAL.keys()


def test_equal_lands_are_the_plain_dead_zone():
    c = constants(Machine(overlap=0.1))
    nearly = constants(Machine(overlap=0.1, overlap_pa=1.0 + 1e-12))
    for x in np.linspace(-1.0, 1.0, 41):
        s = opening(c, x)
        assert lands(c, x) == (max(s, 0.0), max(-s, 0.0), max(-s, 0.0), max(s, 0.0))
        assert lands(nearly, x) == pytest.approx(lands(c, x), abs=1e-9)
    assert edge(0.0, -0.1) > 0.05
    assert edge(1.0, -0.1) == pytest.approx(1.0, abs=1e-3)
    assert edge(0.0, 0.1) == 0.0


@pytest.mark.parametrize("x_v", [-0.6, -0.03, 0.0, 0.02, 0.7])
def test_no_oil_is_lost_in_an_uneven_valve(x_v):
    shape = {"overlap_pa": 0.5, "overlap_at": -0.4, "overlap_pb": 1.5, "overlap_bt": -0.2, "leak_at": 1.7,
             "leak_pb": 0.3, "leak_turbulent": 0.6}  # fmt: skip
    c = constants(Machine(overlap=0.1, valve_leak=5e-13, **shape))
    q_a, q_b, q_p, q_t, _ = valve(c, c["eta0"], x_v, P_A, P_B, P_T, P_P, P_P)
    assert q_p + q_b == pytest.approx(q_a + q_t, abs=1e-15)
    power = q_p * P_P + q_b * P_B - q_a * P_A - q_t * P_T
    assert power > 0.0


def test_turbulent_leakage():
    assert leak(1e-12, 10e6, 0.7) == pytest.approx(1e-5, rel=1e-4)
    assert leak(1e-12, 3e6, 0.0) == 3e-6
    assert leak(1e-12, 2.5e6, 1.0) == pytest.approx(0.5e-5, rel=1e-3)
    for dp in (-20e6, -1e3, 1e3, 20e6):
        assert leak(1e-12, dp, 0.9) * dp > 0.0
    c = constants(Machine(leakage_scale=5.0, piston_opening=1.0))
    assert piston_leak(c, 10e6) == pytest.approx(5e-12 * 10e6 * (1.0 + 4.0 * 2.0))


def test_bristles_slide_at_the_level_of_friction():
    c = constants(Machine(coulomb=800.0, stribeck=400.0, presliding=1e-4, friction_uneven=0.3))
    for v in (0.01, -0.03):
        z = 0.0
        for _ in range(20000):
            z += 1e-5 * bristle_rate(c, P_A, P_B, 0.1, v, z)
        level = directed(c, friction_level(c, P_A, P_B, 0.1, v), v)
        assert friction(c, P_A, P_B, 0.1, v, z) == pytest.approx(np.sign(v) * level, rel=1e-3)


@pytest.mark.parametrize("amplitude", [2e-5, 1e-3])
def test_bristles_take_energy(amplitude):
    c = constants(Machine(coulomb=800.0, stribeck=400.0, presliding=2e-4, friction_uneven=0.4))
    z, work, h, w = 0.0, 0.0, 5e-5, 2.0 * np.pi * 2.0
    for k in range(20000):
        v = amplitude * w * np.cos(w * k * h)
        force = bristle_force(c, P_A, P_B, 0.1, v, z)
        z += h * bristle_rate(c, P_A, P_B, 0.1, v, z)
        work += force * v * h if k >= 10000 else 0.0
    assert work > 0.0


def test_short_bristles_are_the_plain_friction():
    c, short = (constants(Machine(coulomb=800.0, presliding=length)) for length in (0.0, 1e-7))
    z = 0.0
    for _ in range(1000):
        z += 1e-7 * bristle_rate(short, P_A, P_B, 0.1, 0.02, z)
    assert friction(short, P_A, P_B, 0.1, 0.02, z) == pytest.approx(friction(c, P_A, P_B, 0.1, 0.02, 0.0), rel=1e-3)


@pytest.mark.parametrize(("outer_from", "shear"), [(0.4, 0.0), (0.0, 0.8), (0.0, 0.0)])
def test_drag_of_the_beam_is_the_integral_over_its_strips(outer_from, shear):
    m = Machine(growth=0.03, drag_scale=1.5, current_offset=0.6, current_shear=shear, outer_from=outer_from)
    c = constants(m)
    theta, omega = 0.7, 0.1
    u = -(m.current + m.current_offset) * np.sin(theta)

    def strip(x):
        there = u - m.current_offset * shear * (2.0 * x / m.beam_length - 1.0) * np.sin(theta)
        outer = x >= outer_from * m.beam_length
        width = m.beam_diameter + (2.0 * m.growth if outer else 0.0)
        factor = c["drag_factor"] if outer else m.drag_coefficient
        r = there - omega * x
        return 512.5 * factor * width * r * abs(r) * x

    expected = quad(strip, 0.0, m.beam_length, points=[outer_from * m.beam_length], limit=200)[0]
    assert 512.5 * c["drag_factor"] * beam_drag(c, theta, u, omega) == pytest.approx(expected, rel=1e-6)


def test_a_load_nearer_to_the_pivot_weighs_by_its_lever_and_moves_by_its_square():
    bare, end, middle = (
        constants(Machine(payload_scale=k, load_place=place)) for k, place in ((1.0, 1.0), (1.8, 1.0), (1.8, 0.5))
    )
    found = [
        np.add(arm(c, 0.6, 0.0, 0.0, 0.0, c["load"]), uneven_arm(c, 0.6, 0.0, 0.0, 0.0)) for c in (bare, end, middle)
    ]
    (inertia, torque), (inertia_end, torque_end), (inertia_middle, torque_middle) = found
    assert torque_middle - torque == pytest.approx(0.5 * (torque_end - torque))
    assert inertia_middle - inertia == pytest.approx(0.25 * (inertia_end - inertia))


def test_components_at_their_limits():
    assert wall_compliance(constants(Machine(hose=1e-9, hose_fade=1.0)), 10e6 + 101300.0) == pytest.approx(1e-9)
    air = constants(Machine(air=0.02, air_half=1e6))
    free = constants(Machine(air=0.02, air_half=1e12))
    assert oil_compliance(air, 101300.0 + 1e6) - 1 / 1.4e9 == pytest.approx(
        0.5 * (oil_compliance(free, 101300.0 + 1e6) - 1 / 1.4e9), rel=1e-5
    )
    c = constants(Machine(override=1e10, override_bend=0.8))
    assert relief_flow(c, 1e10 * c["q_pump"]) == pytest.approx(c["q_pump"], rel=0.02)
    slow = constants(Machine(droop=0.2, droop_time=2.0))
    assert relief_pressure(slow, 0.0, 0.0) == 20e6
    assert relief_pressure(slow, 100.0, 0.0) == pytest.approx(16e6)
    slip = constants(Machine(slip=0.3, slip_turbulent=1.0))
    assert pump_flow(slip, slip["eta0"], 20e6, 0.0) == pytest.approx(0.7 * slip["q_pump"], rel=1e-3)


def test_forms_of_sensors():
    grid = np.arange(0.0, 2.0, 1e-3)
    signals = np.zeros((grid.size, len(KEYS)))
    signals[1:, 0] = 1.0
    at = np.array([0.05, 0.1, 0.3])
    second = ideal(Channel(KINDS[0], 1e-4, 0.0, {"lag": 0.1, "order": 2.0}), grid, signals, at)
    x = at / 0.05
    assert second == pytest.approx(1.0 - (1.0 + x) * np.exp(-x), abs=2e-2)
    signals[:, 0] = grid
    times = np.arange(0.5, 1.9, 1e-2)
    late = times - ideal(Channel(KINDS[0], 1e-4, 0.0, {"delay": 0.05, "jitter": 0.4}), grid, signals, times)
    assert late.mean() == pytest.approx(0.05, abs=2e-3)
    assert late.min() > 0.05 * 0.6 - 1e-6
    assert late.max() < 0.05 * 1.4 + 1e-6
    assert late.std() > 0.005
    assert np.abs(scatter(2000)).max() <= 1.0
