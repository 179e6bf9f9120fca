"""Compensator, cylinder and controller against closed forms."""

from math import pi

import numpy as np
import pytest
from deepsea_cosim.core.sea import ambient_pressure
from deepsea_cosim.hydraulics_fmu.compensator import piston_acceleration, tank_pressure_rate
from deepsea_cosim.hydraulics_fmu.controller import integral_rate, pid_output, ramp_command
from deepsea_cosim.hydraulics_fmu.cylinder import areas, chamber_volume, end_stop_force, rod_force

A_C = pi * 0.25**2 / 4


def test_ambient_pressure():
    assert ambient_pressure(11000.0) == 110e6
    assert ambient_pressure(0.0) == 101300.0


def test_spring_holds_the_tank_18_kpa_above_ambient():
    over = 3000 * 0.3 / A_C
    assert over == pytest.approx(18.3e3, rel=2e-3)
    piston = (110e6, A_C, 1.0, 1000.0, 3000.0, 0.3)
    assert piston_acceleration(110e6 + over, 0.0, 0.0, *piston) == pytest.approx(0, abs=1e-6)
    assert piston_acceleration(110e6 + over + 1, 0.0, 0.0, *piston) < 0


def test_tank_continuity():
    assert tank_pressure_rate(1e-4, 1e-4, 0.0, 0.0, A_C, 0.1, 0.25, 1.4e9) == 0.0
    rate = tank_pressure_rate(2e-4, 1e-4, 0.0, 0.0, A_C, 0.1, 0.25, 1.4e9)
    assert rate == pytest.approx(1.4e9 / (0.1 + 0.25 * A_C) * 1e-4)
    # a piston that follows the surplus keeps the pressure
    assert tank_pressure_rate(1e-4, 2e-4, 1e-4 / A_C, 0.0, A_C, 0.1, 0.25, 1.4e9) == pytest.approx(0, abs=1e-3)


def test_ambient_pressure_cancels_on_the_rod():
    A_1, A_2 = areas(0.045, 0.025)
    assert pytest.approx(pi * 0.025**2 / 4) == A_1 - A_2
    shallow = rod_force(1e5 + 5e6, 1e5 + 2e6, 0.0, 1e5, A_1, A_2, 1000.0)
    deep = rod_force(1.1e8 + 5e6, 1.1e8 + 2e6, 0.0, 1.1e8, A_1, A_2, 1000.0)
    assert deep == pytest.approx(shallow, rel=1e-12)
    absolute = 1.15e8 * A_1 - 1.12e8 * A_2 - 1.1e8 * pi * 0.025**2 / 4  # Eqs. 26, 27 as printed
    assert deep == pytest.approx(absolute, rel=1e-10)
    assert rod_force(1e8, 1e8, 0.04, 1e8, A_1, A_2, 1000.0) == pytest.approx(-40.0)


def test_chamber_volume_stays_positive():
    assert chamber_volume(20e-6, 1.6e-3, 0.1) == pytest.approx(1.8e-4)
    assert chamber_volume(20e-6, 1.6e-3, -1.0) > 0


def test_end_stops_push_only_and_without_a_jump():
    def force(x, v):
        return end_stop_force(x, v, 0.25, 1e-3, 2e7, 1e5)

    assert force(0.0, -1.0) == force(0.25, 1.0) == force(-0.001, 0.0) == 0.0
    assert force(-0.002, 0.0) == pytest.approx(2e4)
    assert force(0.252, 0.0) == pytest.approx(-2e4)
    assert force(-0.002, 10.0) == 0.0  # leaving fast: no pull
    assert force(0.252, -10.0) == 0.0
    assert abs(force(-0.001 - 1e-9, -1.0)) < 2.0


def test_ramp():
    times = np.array([0, 2, 4.5, 7, 9, 12, 14.5, 17, 20.0])
    values = [ramp_command(t, 0.2, 2.0, 5.0, 5.0) for t in times]
    assert values == pytest.approx([0, 0, 0.1, 0.2, 0.2, 0.2, 0.1, 0, 0])


def test_pid_saturates_and_does_not_wind_up():
    assert pid_output(1.0, 0.0, 0.0, 2.5, 0.001, 10.0) == 2.5
    assert pid_output(1.0, 40.0, 0.5, 2.5, 0.001, 10.0) == pytest.approx(3.04)
    assert pid_output(100.0, 0.0, 0.0, 2.5, 0.001, 10.0) == 10.0
    assert pid_output(-100.0, 0.0, 0.0, 2.5, 0.001, 10.0) == -10.0
    assert integral_rate(2.0, 5.0, 0.001, 10.0) == 0.002
    assert integral_rate(2.0, 10.0, 0.001, 10.0) == 0.0
    assert integral_rate(-2.0, 10.0, 0.001, 10.0) == -0.002  # it may come back
    assert integral_rate(-2.0, -10.0, 0.001, 10.0) == 0.0
