"""Two axes on one supply, against the whole as one differential equation."""

import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks.two_axes import errors


def test_the_shipped_step_holds_the_displacement_and_nepce_does_at_twice_that(built):
    """Both cylinders run, the second from 0.6 s on; in the scenario they wait for 2 and 4 s."""
    soon = {"first_hydraulics.command.t_start": 0.1, "second_hydraulics.command.t_start": 0.6}
    plain, nepce = errors(built / "two_axes.ssp", 1.4, (("gauss-seidel", 5e-4), ("nepce", 1e-3)), soon)
    for x in (0, 3):
        assert plain[x] < 0.05e-3
        assert nepce[x] < 0.005e-3
    assert plain[6] < 2e3


@pytest.mark.parametrize(("name", "value"), [("relief.override", 0.2), ("filter.dp", 5e5)])
def test_they_start_where_supply_and_valves_agree(built, tmp_path, name, value):
    """Their flows and the pressure that falls with them are an algebraic loop at the start,
    P_s = P_r + p_crack + R Q_rv - F Q_p."""
    options = Options(stop_time=0.05, changes=((f"supply.{name}", str(value)),))
    first = run(built / "two_axes.ssp", tmp_path / "out", options).frame().iloc[0]
    taken, pump = first["first_hydraulics.Qp"] + first["second_hydraulics.Qp"], 8e-6 * 1450 / 60
    override, loss = (value, 0.0) if name == "relief.override" else (0.02, value)
    thicker = np.exp(2.2e-8 * (30e6 + 10e6))
    expected = 20e6 * (1.0 + override * (1.0 - taken / pump)) - loss * thicker * taken / pump
    assert first["supply.P_s"] - first["supply.P_r"] == pytest.approx(expected, rel=1e-6)
