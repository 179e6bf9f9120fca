"""Runs that somebody else drives: how they end."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.errors import SimulationError, UsageError
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import binding, bindings, component, package, parameter, parameter_set, system
from .parts import two

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("count", [1, 5])
def test_an_fmu_that_ends_the_run_is_heard_in_the_last_step_that_was_asked_for(fmus, tmp_path, version, count):
    with Session(two(tmp_path / "p.ssp", fmus[version], trouble=8.0, when=0.4, step=0.1)) as session:
        run = session.start(["b.y1"])
        for _ in range(5 // count - 1):
            run.step(count=count)
        with pytest.raises(SimulationError, match=r"component 'b' asks to end the simulation at t = 0\.5 s"):
            run.step(count=count)
        assert run.steps == 5
        with pytest.raises(SimulationError, match="this run is over, start another one: component 'b' asks to end"):
            run.step()
        assert run.steps == 5
        assert session.start(["b.y1"]).step() == pytest.approx([0.2])


def test_after_an_error_no_step_is_taken(fmus, tmp_path):
    """The FMU may only be put back or freed; it would have been stepped again from where the run was before."""
    with Session(two(tmp_path / "p.ssp", fmus[2], trouble=1.0, when=0.4, step=0.1)) as session:
        run = session.start(["b.y1"])
        with pytest.raises(SimulationError, match=r"component 'b', doStep at t = 0\.4 s"):
            run.step(count=5)
        with pytest.raises(SimulationError, match="this run is over"):
            run.step()
        assert session.start(["b.y1"]).step() == pytest.approx([0.2])


def whole(tmp_path, fmus, version=2):
    """A component that passes whole numbers on."""
    inside = parameter_set(parameter("D[1,1]", "Real", 1.0))
    one = component("a", "resources/L.fmu", bindings=bindings(binding(inside)))
    return package(tmp_path / "p.ssp", system("root", one), {"resources/L.fmu": fmus[version]}, stop=1.0, step=0.1)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [("integer", 2.7, "'a.integer_in' = 2.7 is not a value of type Integer"),
     ("integer", 1e300, r"'a.integer_in' = 1e\+300 is not a value of type Integer"),
     ("integer", 2**31, r"'a.integer_in' = 2.14748e\+09 is not a value of type Integer"),
     ("integer", float("nan"), "'a.integer_in' = nan is not a value of type Integer"),
     ("boolean", 2, "'a.boolean_in' = 2 is not a value of type Boolean"),
     ("item", 4, "'a.item_in' = 4 is not a value of type Enumeration; known: red, green, blue")],
)  # fmt: skip
def test_an_input_is_driven_with_values_of_its_type(fmus, tmp_path, name, value, told):
    with Session(whole(tmp_path, fmus)) as session:
        run = session.start([f"a.{name}_out"], inputs={f"a.{name}_in": 1})
        with pytest.raises(UsageError, match=told):
            run.step({f"a.{name}_in": value})
        assert run.step() == [1.0]
        with pytest.raises(UsageError):
            session.start([f"a.{name}_out"], inputs={f"a.{name}_in": value})
        with pytest.raises(UsageError):
            session.run([f"a.{name}_out"], 1.0, 0.1, inputs={f"a.{name}_in": ([0.0, 1.0], [1, value])})


def test_whole_numbers_of_a_session_are_held(fmus, tmp_path):
    """As those of a file: on a straight line 29 would be 28 at 0.29 s, by a rounding error."""
    with Session(whole(tmp_path, fmus)) as session:
        series = ([0.0, 0.25, 0.5], [0, 10, 20])
        rows = session.run(["a.integer_in"], 1.0, 0.1, inputs={"a.integer_in": series})[1]
    assert rows[:, 0].tolist() == [0, 0, 0, 10, 10, 20, 20, 20, 20, 20, 20]


def test_large_whole_numbers_come_back_as_they_are(fmus, tmp_path):
    """They lie in slots of 64 bits with a sign."""
    large = 2**63 + 2**20
    with Session(whole(tmp_path, fmus, 3)) as session:
        run = session.start(["a.huge_out"], inputs={"a.huge_in": 1})
        assert run.step({"a.huge_in": large}) == [float(large)]
        for values in ([large, large], np.array([large, large], np.uint64)):
            rows = session.run(["a.huge_in", "a.huge_out"], 1.0, 0.1, inputs={"a.huge_in": ([0.0, 1.0], values)})[1]
            assert (rows[1:] == float(large)).all()
