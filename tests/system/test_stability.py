"""The gain at which the linearised machine swings up is the one at which the simulated machine does."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.fmus.data_sheet import _load_at_rod
from deepsea_cosim.hydraulics_fmu.stability import critical_gain
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.master.simulation.session import Session


@pytest.mark.parametrize(("x", "depth"), [(0.1, 0.0), (0.2, 0.0), (0.1, 3000.0)])
def test_the_critical_gain_is_between_swings_that_fade_and_swings_that_grow(built, x, depth):
    """Held at x after a short ramp: ripple of the cylinder's force in two seconds and in the two after them."""
    critical = critical_gain(HYDRAULICS.parameters({"depth": depth}), x, *_load_at_rod({}, x))
    command = {"target": x, "t_start": 0.2, "ramp_time": 10.0 * x, "hold_time": 20.0}
    end = 0.2 + 10.0 * x + 6.0
    growth = []
    with Session(built / "deepsea_0km.ssp") as session:
        for gain in (0.8, 1.25):
            changes = {f"hydraulics.command.{name}": value for name, value in command.items()}
            changes |= {"hydraulics.controller.kp": gain * critical, "depth": depth}
            t, rows = session.run(["hydraulics.F_h"], end, 1e-3, changes, method="nepce")
            F = rows[:, 0]
            early, late = (np.ptp(F[(t > end - back) & (t <= end - back + 2.0)]) for back in (4.0, 2.0))
            growth.append(late / early)
    assert growth[0] < 0.9
    assert growth[1] > 0.98
    assert late > 1000.0  # in a cycle as wide as the valve lets it be
