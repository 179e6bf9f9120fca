"""The blind benchmark's plant: the same as the reference monolith without effects, and each effect does something."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import blind
from benchmarks.blind.effects import CATALOGUE, NEW, UNKNOWN, by_id, walther_temperature
from benchmarks.blind.forms import opening, turn
from benchmarks.blind.lines import held_back, rougher
from benchmarks.blind.machine import Machine, constants, mixed, vogel
from benchmarks.blind.plant import column, rest_state, simulate
from benchmarks.blind.supply import compensated, filtered, relief_flow
from tests.reference import monolith

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

GRID = np.arange(0.0, 22.0005, 1e-3)
COARSE = np.arange(0.0, 12.0, 0.01)
SHALLOW = Machine(depth=500.0, ramp_time=3.5, hold_time=1.5)
OF_THE_PLANT = [e for e in (*CATALOGUE, *(e for e in NEW if e.drawn), *UNKNOWN) if e.knob != "wave"]


@pytest.fixture(scope="module")
def plain():
    return simulate(SHALLOW, COARSE)


@pytest.mark.parametrize("depth", [0.0, 11.0])
def test_without_effects_it_is_the_monolith(depth):
    mine = simulate(Machine(depth=1e3 * depth), GRID)
    truth = monolith.solve(monolith.Machine(depth=depth), GRID)
    calm = np.all([(c - 1e-9 > GRID) | (c + 0.02 < GRID) for c in (2.0, 7.0, 12.0, 17.0)], axis=0)
    assert np.abs(column(mine, "x_h") - truth["x_h"]).max() < 2e-6
    for key in ("P1", "P2", "Pa", "Pb", "Pp", "Pt"):
        assert np.abs(column(mine, key) - truth[key])[calm].max() < 2e3
    for key, most in (("v_h", 1e-5), ("F_h", 5.0), ("theta", 1e-5), ("x_v", 1e-4)):
        assert np.abs(column(mine, key) - truth[key])[calm].max() < most


def test_a_looser_tolerance_changes_little(plain):
    loose = simulate(SHALLOW, COARSE, rtol=1e-5, atol_scale=10.0)
    assert np.abs(column(loose, "x_h") - column(plain, "x_h")).max() < 2e-6


@pytest.mark.parametrize("effect", OF_THE_PLANT, ids=lambda e: e.id)
def test_an_effect_is_absent_at_its_neutral_value_and_seen_beyond(effect, plain):
    middle = {name: 0.5 * (low + high) for name, (low, high) in effect.shapes.items()}
    machine = replace(SHALLOW, **effect.plant(1.0, 0.0, middle))
    assert np.array_equal(simulate(machine, COARSE), plain)
    amplitude = effect.most_up if effect.id == "pump_slip" else 0.5 * effect.most_up
    machine = replace(SHALLOW, **effect.plant(1.0, amplitude, middle))
    changed = simulate(machine, COARSE) - plain
    assert np.abs(column(changed, "x_h")).max() > 1e-8
    assert np.abs(column(changed, "P1")).max() > 1.0


@pytest.mark.parametrize("effect", [e for e in OF_THE_PLANT if not e.shapes], ids=lambda e: e.id)
def test_the_machine_starts_at_rest_with_an_effect(effect):
    machine = replace(SHALLOW, **effect.plant(effect.draw_sign(np.random.default_rng(1)), 0.3 * effect.usual, {}))
    start = simulate(machine, np.array([0.0, 0.5]))
    assert np.abs(column(start, "v_h")).max() < 2e-5
    assert abs(column(start, "x_h")[0]) < 1e-12


def test_delay():
    out = simulate(replace(SHALLOW, delay=0.02), GRID[:8000])
    u, x_v = column(out, "u") / 10.0, column(out, "x_v")
    late = np.abs(x_v[120:] - u[100:-20])
    assert late.max() < 0.02  # at the corners of the command
    assert np.sqrt(np.mean(late**2)) < 1e-3


def test_sampling_holds_the_controller():
    out = simulate(replace(SHALLOW, sampling=0.05), GRID[:6000])
    assert np.unique(np.round(column(out, "x_v"), 9)).size <= 6000 / 50 + 2


def test_spool_follows_late():
    out = simulate(replace(SHALLOW, spool_time=0.01), GRID[:8000])
    u, x_v = column(out, "u") / 10.0, column(out, "x_v")
    late = 16  # 2 damping T
    assert np.abs(x_v[2500:5000] - u[2500 - late : 5000 - late]).max() < 0.02


def test_forms():
    assert turn(-0.1, 1.5e-3) == pytest.approx(-1.0)
    assert turn(1e-6, 1e-3) == -turn(-1e-6, 1e-3) == pytest.approx(1e-3, rel=1e-3)
    c = constants(Machine(overlap=0.1, override=1e10))
    assert opening(c, 0.0) == 0.0
    assert opening(c, 1.0) == pytest.approx(1.0, abs=3e-3)
    assert opening(c, -0.55) == pytest.approx(-0.5, abs=3e-3)
    assert relief_flow(c, 1e10 * c["q_pump"]) == pytest.approx(c["q_pump"], rel=0.01)
    assert relief_flow(c, 0.0) < 0.01 * c["q_pump"]
    assert vogel(313.15) == 1.0
    assert 22.0 * vogel(373.15) == pytest.approx(4.3)
    assert walther_temperature(1.0) == pytest.approx(313.15)
    assert walther_temperature(vogel(283.15)) == pytest.approx(283.15, abs=1.0)


def test_rest_state_is_found_in_all_depths():
    for depth in (0.0, 4000.0, 11000.0):
        state = rest_state(replace(SHALLOW, depth=depth, valve_leak=2e-13, null_shift=0.05))
        assert np.isfinite(state).all()


def test_effects_are_found_by_id():
    assert by_id("viv").knob == "viv"


def test_the_benchmark_shares_no_code_with_the_project():
    """But for what judges finished cases and diagnoses: the fit of their calibration, and of the true set by the
    library, and whether a machine swings."""
    for path in Path(next(iter(blind.__path__))).rglob("*.py"):
        if path.stem in ("calibrate", "swinging") or path.parent.name == "oracle":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level < 2:
                names = [node.module or ""]
            assert not any(n.split(".")[0] in ("deepsea_cosim", "tests", "gap", "mechanics") for n in names)


def test_turbulence_is_laminar_below_and_that_of_smooth_pipes_above():
    c = constants(Machine(turbulence=1.0))
    per_re = np.pi * c["pipe_diameter"] * 0.0187 / (4 * c["rho"])
    assert rougher(c, 0.0187, 500 * per_re) == pytest.approx(1.0, abs=1e-6)
    for re in (1e4, 5e4):
        assert rougher(c, 0.0187, re * per_re) * 64 / re == pytest.approx(0.3164 * re**-0.25, rel=0.04)


def test_a_filter_takes_its_loss_at_the_pumps_flow():
    m = Machine(filter=1e6)
    c = constants(m)
    assert filtered(c, m.rho * m.nu0, 1e6) == pytest.approx(c["q_pump"])
    assert filtered(c, m.rho * m.nu0, -1e6) == pytest.approx(-c["q_pump"])
    assert filtered(c, 2 * m.rho * m.nu0, 1.8e6) == pytest.approx(c["q_pump"])


def test_a_compensated_pump_gives_all_below_its_band_and_nothing_above():
    c = constants(Machine(pump_time=0.1, pump_band=0.1))
    assert compensated(c, 15e6) == pytest.approx(c["q_pump"], rel=1e-3)
    assert compensated(c, 19e6) == pytest.approx(0.5 * c["q_pump"])
    assert compensated(c, 24e6) < 1e-3 * c["q_pump"]


def test_a_counterbalance_valve_holds_until_load_and_pilot_open_it():
    c = constants(Machine(hold_set=20e6, hold_ratio=4.0))
    wide = 0.4e6 / c["rated_flow"] ** 2
    at = c["p_am"]
    assert held_back(c, at + 8e6, at + 4e6) == pytest.approx(wide)
    assert held_back(c, at + 8e6, at + 2e6) == pytest.approx(wide * 500.0**2)


def test_water_makes_the_oil_thicker_heavier_and_stiffer():
    m, wet = Machine(), mixed(Machine(water=0.1))
    assert wet.nu0 * wet.rho == pytest.approx(m.nu0 * m.rho * np.exp(0.28))
    assert wet.rho == pytest.approx(0.9 * 850 + 100)
    assert 1 / wet.beta == pytest.approx(0.9 / 1.4e9 + 0.1 / 2.15e9)


def test_a_null_shift_shows_from_the_start_where_the_controller_does_not_know_it():
    hidden, shown = (simulate(replace(SHALLOW, null_shift=0.05, null_shows=s), COARSE) for s in (0.0, 1.0))
    before = SHALLOW.t_start > COARSE
    assert np.abs(column(hidden, "x_h")[before]).max() < 1e-6
    # the proportional part makes up for the shift: 5 % of 10 mA at 2.5 mA/mm
    assert column(shown, "x_h")[before][-1] == pytest.approx(0.2e-3, rel=0.05)


def test_a_loose_rod_is_ahead_of_its_eye_by_half_the_clearance():
    from benchmarks.blind.system import ROD

    y = rest_state(replace(SHALLOW, clearance=4e-4))
    assert 2e-4 < y[ROD] < 2.7e-4
