"""The parts of a guess: headings, numbers in files' names, likeness of shapes, texts of TOML."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.checks.shapes import Signal, compare
from deepsea_cosim.gap.onboarding.clock import Clock
from deepsea_cosim.gap.onboarding.columns import Match
from deepsea_cosim.gap.onboarding.conditions import is_held_out, stated_in
from deepsea_cosim.gap.onboarding.guess import _aligned
from deepsea_cosim.gap.onboarding.headings import is_time_heading, likeness, readings, time_unit, words
from deepsea_cosim.gap.onboarding.toml_text import value


@pytest.mark.parametrize(
    ("heading", "stated", "unit"),
    [
        ("x [mm]", None, "mm"), ("x (mm)", None, "mm"), ("x_mm", None, "mm"), ("x/mm", None, "mm"),
        ("p, bar", None, "bar"), ("v_mm/s", None, "mm/s"), ("v_mm_s", None, "mm/s"), ("T [°C]", None, "degC"),
        ("x", "mm", "mm"), ("spool", None, None), ("P1", None, None), ("torque_Nm", None, "N.m"),
    ],
)  # fmt: skip
def test_units_in_headings(heading, stated, unit):
    assert unit in [r.unit for r in readings(heading, stated)]


def test_a_name_may_look_like_a_unit():
    assert [(r.words, r.unit) for r in readings("x_h", None)] == [(("x", "h"), None), (("x",), "h")]


@pytest.mark.parametrize(
    ("column", "connector", "description", "at_least", "below"),
    [
        ("x_h", "arm.x_h", "", 1.0, 1.1),
        ("P1", "hydraulics.P1", "pressure", 1.0, 1.1),
        ("P1", "hydraulics.P2", "pressure", 0.0, 0.45),
        ("pos", "slide.position", "position of the slide [m]", 0.5, 0.9),
        ("Druck A", "cylinder.pA", "pressure A [Pa]", 0.5, 0.9),
        ("temperature", "arm.x_h", "extension", 0.0, 0.4),
    ],
)
def test_likeness_of_names(column, connector, description, at_least, below):
    assert at_least <= likeness(words(column), connector, description) < below


def test_time_is_known_by_its_name():
    assert all(map(is_time_heading, ("time", "Time [ms]", "t", "Zeit/s", "time_ms", "timestamp")))
    assert not any(map(is_time_heading, ("x", "torque", "temp", "tank")))
    assert (time_unit("time_ms", None), time_unit("Zeit [s]", None), time_unit("t", None)) == ("ms", "s", None)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("depth=3000", [("depth", 3000.0, "")]),
        ("run_3km", [("", 3.0, "km")]),
        ("run01", []),
        ("test_2_depth6000m", [("depth", 6000.0, "m")]),
        ("5V_out_2", [("", 5.0, "V"), ("out", 2.0, "")]),
        ("load=2,5kg", [("load", 2.5, "kg")]),
        ("slide", []),
    ],
)
def test_numbers_in_names(name, found):
    assert [(s.key, s.value, s.unit) for s in stated_in(name)] == found


def test_runs_that_are_held_out():
    assert is_held_out("run_3_validation")
    assert is_held_out("cascaded_tanks_Val")
    assert not is_held_out("interval")


def test_likeness_of_shapes():
    t = np.linspace(0.0, 10.0, 1001)
    model = Signal(t, np.exp(-((t - 4.0) ** 2)))
    late = compare(Signal(t, -3.0 * np.exp(-((t - 4.7) ** 2)) + 8.0), model, 2000, 0.3)
    assert late.shift == pytest.approx(0.7, abs=0.01)
    assert late.shifted == pytest.approx(-1.0, abs=1e-3)
    assert late.ratio == pytest.approx(3.0, rel=1e-3)
    assert compare(Signal(t, 0.0 * t), model, 2000, 0.3).correlation == 0.0
    assert compare(Signal(t + 100.0, t), model, 2000, 0.3).correlation == 0.0


def test_values_in_toml():
    values = {"a.b": True, "c": 'say "so"\\', "d": [1, 2.5], "e": {"x y": -1e-9}}
    assert tomllib.loads(f"t = {value(values)}")["t"] == values


def test_a_clock_that_is_shifted_far_into_a_file_keeps_its_digits():
    match = Match("x", SimpleNamespace(address="o.x", is_input=False), "mm", "name")
    t = np.arange(0.0, 20.0, 0.02)
    y = np.interp(t, [5.0, 6.0, 8.0, 9.0], [0.0, 1.0, 1.0, 0.0])
    column = SimpleNamespace(name="x", signals={0: Signal(t, np.interp(t - 2.8, t, y))})
    matched = SimpleNamespace(matches=[match], nominal={0: {"o.x": Signal(t, y)}})
    moved = _aligned(Clock("s", False, 86410.0), 0, [column], matched)
    assert moved.start == pytest.approx(86412.8, abs=0.05)
