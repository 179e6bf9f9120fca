"""The effects of the arm, each against a closed form, and exactly absent by default."""

import numpy as np
import pytest
from deepsea_cosim.core.sea import GRAVITY
from deepsea_cosim.mechanics import loads
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.effects import EFFECTS, pivot_friction
from deepsea_cosim.mechanics.variables import ARM

THETA = ARM["theta0"].start
LENGTH = ARM["beam_length"].start


def arm(**effects):
    return Arm(ARM.parameters({f"effect.{name.replace('__', '.')}": value for name, value in effects.items()}))


def moment(a):
    """Holding torque about the pivot [N m]."""
    return a.F_hold * a.projection[loads.LEVER]


def test_effects_are_absent_bit_for_bit():
    a, b = arm(), arm(**{e.name.removeprefix("effect.").replace(".", "__"): e.start for e in EFFECTS})
    for x in (a, b):
        for k in range(50):
            x.step(k * 1e-3, 1e-3, 8000.0)
    assert (a.out == b.out).all()
    assert a.c.grown.beam == ARM["beam_diameter"].start
    assert ARM["C_D"].start == a.c.C_D
    assert a.c.current_speed == ARM["current_speed"].start


def test_payload_is_weight_and_inertia():
    plain, heavy = arm(), arm(payload_error__scale=1.3)
    assert moment(heavy) - moment(plain) == pytest.approx(0.3 * 800.0 * LENGTH * np.cos(THETA), rel=1e-9)
    inertia = 0.3 * 800.0 / GRAVITY * LENGTH**2
    assert heavy.projection[loads.MASS] - plain.projection[loads.MASS] == pytest.approx(inertia, rel=1e-9)


def test_buoyancy_lifts_the_middle():
    difference = moment(arm()) - moment(arm(buoyancy_error__force=50.0))
    assert difference == pytest.approx(50.0 * LENGTH / 2 * np.cos(THETA), rel=1e-9)


def test_marine_growth_adds_drag_and_water_but_no_weight():
    clean, grown = arm(current_error__offset=-0.5), arm(current_error__offset=-0.5, marine_growth__thickness=0.02)
    assert moment(grown) == pytest.approx(moment(clean), rel=1e-12)  # no current, no drag: the same weight
    water = 1025 * 2.0 * np.pi / 12 * LENGTH**3 * (0.14**2 - 0.10**2)
    assert grown.projection[loads.MASS] - clean.projection[loads.MASS] == pytest.approx(water, rel=0.01)
    assert arm(marine_growth__thickness=0.02).c.grown.beam == pytest.approx(0.14)


def test_drag_scales_with_its_coefficient_and_the_square_of_the_current():
    none = moment(arm(current_error__offset=-0.5))
    drags = [moment(a) - none for a in (arm(), arm(drag_coefficient__scale=2.0), arm(current_error__offset=0.5))]
    assert drags[1] / drags[0] == pytest.approx(2.0)
    assert drags[2] / drags[0] == pytest.approx(4.0)


def test_pivot_friction_opposes_the_motion():
    c = arm(joint_friction__tau_c=30.0, joint_friction__viscous=10.0).c
    assert pivot_friction(0.2, c) == pytest.approx(32.0)
    assert pivot_friction(-0.2, c) == pytest.approx(-32.0)
    assert pivot_friction(0.0, c) == 0.0
    assert pivot_friction(0.2, arm().c) == 0.0
    uneven = arm(joint_friction__tau_c=30.0, joint_friction__uneven=0.4).c
    assert pivot_friction(0.2, uneven) == pytest.approx(42.0)
    assert pivot_friction(-0.2, uneven) == pytest.approx(-18.0)


def test_unsteady_current_adds_to_the_steady_one():
    a = arm(current_unsteady__amplitude=0.2, current_unsteady__frequency=0.25, current_unsteady__phase=0.5)
    v, acceleration = loads.current(1.0, a.c)
    assert v == pytest.approx(0.5 + 0.2 * np.sin(np.pi / 2 + 0.5))
    assert acceleration == pytest.approx(0.2 * np.pi / 2 * np.cos(np.pi / 2 + 0.5))


def test_unsteady_current_has_a_second_harmonic():
    swing = {"current_unsteady__amplitude": 0.2, "current_unsteady__frequency": 0.25, "current_unsteady__phase": 0.5}
    plain, more = arm(**swing), arm(**swing, current_unsteady__harmonic=0.5)
    (v_1, a_1), (v_2, a_2) = (loads.current(1.0, a.c) for a in (plain, more))
    assert v_2 - v_1 == pytest.approx(0.1 * np.sin(np.pi + 1.0))
    assert a_2 - a_1 == pytest.approx(0.1 * np.pi * np.cos(np.pi + 1.0))


def test_ambient_pressure():
    assert arm(ambient_pressure_error__scale=1.03).P_am == pytest.approx(1.03 * 110e6)
