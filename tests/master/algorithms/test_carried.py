"""An input whose rate is another input is handed over as it is at the step's start: the FMU carries it on itself."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run
from scipy.integrate import solve_ivp

from ...reference import monolith
from ...reference.compare import deviation
from ...toys import package
from ..parts import redescribed

LINKS = ("spring.F -> mass.F", "mass.x -> spring.x", "mass.v -> spring.v")
RATE = ('<Real start="0"/>\n\t\t</ScalarVariable>\n\t\t<ScalarVariable name="F"',
        '<Real start="0" derivative="1"/>\n\t\t</ScalarVariable>\n\t\t<ScalarVariable name="F"')  # fmt: skip


@pytest.mark.parametrize("order", [("spring", "mass"), ("mass", "spring")], ids=" before ".join)
@pytest.mark.parametrize("method", ["extrapolation", "nepce"])
def test_order_two_on_a_spring_that_carries_its_input_on(toys, tmp_path, method, order):
    carried = redescribed(toys / "Hardening.fmu", tmp_path / "Carried.fmu", RATE)
    fmus = {"spring": carried, "mass": toys / "Mass.fmu"}
    path = package(tmp_path / "p.ssp", {name: fmus[name] for name in order}, LINKS, stop=1.0)
    true = solve_ivp(
        lambda t, y: (y[1], -(100.0 * y[0] + 200.0 * y[0] ** 3)), (0, 1), (1.0, 0.0), rtol=1e-11, atol=1e-12
    ).y[0, -1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        frame = run(path, tmp_path / f"{step}", Options(step=step, method=method)).frame()
        errors.append(abs(frame["mass.x"].iloc[-1] - true))
    assert np.log2(errors[1] / errors[2]) > 1.8, errors
    assert errors[2] < 1e-3


@cache
def true():
    return monolith.solve(monolith.Machine(depth=11.0), np.arange(11001) * 2e-3, rtol=1e-9)


@pytest.mark.parametrize("method", ["extrapolation", "nepce", "interface-jacobian"])
def test_the_machine_is_followed_more_closely_than_by_methods_of_first_order(built, tmp_path, method):
    """Gauss-Seidel is 0.038 mm off with this step (docs/accuracy.md, which has the other depths, too)."""
    frame = run(built / "deepsea_11km.ssp", tmp_path, Options(step=2e-3, method=method)).frame()
    x, _, _ = deviation({name: frame[name].to_numpy() for name in frame}, true())
    assert x < 2e-5
