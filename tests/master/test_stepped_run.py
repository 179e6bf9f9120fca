"""Runs that somebody else drives: how they end."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

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
