"""A session gives what a run gives, as often as it is asked."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import SimulationError, UnknownNameError, UsageError
from deepsea_cosim.master.engine.runner import Runner
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.master.slaves import library

from ..toys import package


def test_same_as_a_run_time_after_time(built, tmp_path):
    run(built / "deepsea_6km.ssp", tmp_path, Options(step=2e-3, stop_time=3.0))
    names = (tmp_path / "results.csv").open().readline().strip().split(",")
    table = np.loadtxt(tmp_path / "results.csv", delimiter=",", skiprows=1)
    record = ["arm.x_h", "hydraulics.P1"]
    with Session(built / "deepsea_6km.ssp") as session:
        first = session.run(record, 3.0, 2e-3)[1]
        other = session.run(record, 3.0, 2e-3, {"depth": 11000.0, "arm.load_weight": 1000.0})[1]
        again = session.run(record, 3.0, 2e-3)[1]
    # the last step of a run ends exactly at the stop time, so it may differ in its last digits
    assert first == pytest.approx(table[:, [names.index(n) for n in record]], rel=1e-9, abs=1e-12)
    assert np.array_equal(first, again)
    assert np.abs(other - first).max() > 1.0


def test_driven_inputs(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    series = (np.array([0.0, 1.0]), np.array([0.0, 10.0]))
    with Session(pack) as session:
        t, rows = session.run(["b.u", "b.y"], 1.0, 0.1, inputs={"b.u": series})
        assert rows[:, 0] == pytest.approx(10.0 * t)
        assert rows[1:, 1] == pytest.approx(20.0 * t[:-1] + 1.0)  # what it was given for the step that ends here
        _, rows = session.run(["b.u"], 1.0, 0.1)
        assert (rows == 0.0).all()


def test_failure_does_not_spoil_the_session(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    with Session(pack) as session:
        with pytest.raises(SimulationError, match=r"'b\.x' is not finite at t = 0\.6"):
            session.run(["b.x"], 1.0, 0.1, {"b.t_bomb": 0.55})
        assert session.run(["b.x"], 1.0, 0.1)[1][-1] == pytest.approx(1.0)


def test_a_run_that_failed_is_not_under_way(toys, tmp_path, monkeypatch):
    """What crashes afterwards, as the FMUs are freed, does not crash in a step."""
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    whole = Runner.run

    def fails(*given, **more):
        if " at t = " in session.culprit("{} crashed in {}"):
            raise SimulationError("no")
        return whole(*given, **more)  # before the first step

    with Session(pack) as session:
        session.run(["b.x"], 1.0, 0.1)
        monkeypatch.setattr(Runner, "run", fails)
        with pytest.raises(SimulationError, match="no"):
            session.run(["b.x"], 1.0, 0.1)
        assert session.culprit("{} crashed in {}") == ""


def test_wrong_names(toys, tmp_path):
    fmus = {"spring": toys / "Spring.fmu", "mass": toys / "Mass.fmu"}
    with Session(package(tmp_path / "p.ssp", fmus, ("spring.F -> mass.F",))) as session:
        with pytest.raises(UnknownNameError, match="no connector"):
            session.run(["mass.y"], 1.0, 0.1)
        series = (np.array([0.0]), np.array([1.0]))
        with pytest.raises(UsageError, match="it is connected"):
            session.run(["mass.x"], 1.0, 0.1, inputs={"mass.F": series})
        with pytest.raises(UsageError, match="it is an output"):
            session.run(["mass.x"], 1.0, 0.1, inputs={"mass.x": series})
        with pytest.raises(UsageError, match="later than the start time"):
            session.run(["mass.x"], 0.0, 0.1)


def test_what_is_given_in_the_wrong_form(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"mass": toys / "Mass.fmu"})
    with Session(pack) as session:
        for given, told in (
            ({"stop": "soon"}, "stop: 'soon' is no number"),
            ({"step": True}, "step: True is no number"),
            ({"method": 5}, "method: 5 is no text"),
            ({"record": [5]}, "record: 5 is no text"),
        ):
            with pytest.raises(UsageError, match=re.escape(told)):
                session.run(**({"record": ["mass.x"], "stop": 1.0, "step": 0.1} | given))
        for series, told in (
            (([0.0, 1.0], [1.0]), "as many values as times"),
            (([], []), "as many values as times"),
            (([[0.0], [1.0]], [[1.0], [2.0]]), "as many values as times"),
            (([0.0, 1.0, 0.5], [1.0, 2.0, 3.0]), "time goes back after 1 s"),
            (([0.0, float("nan")], [1.0, 2.0]), "not finite"),
            ("ab", "a pair of times and values"),
            (5.0, "a pair of times and values"),
        ):
            with pytest.raises(UsageError, match=told):
                session.run(["mass.x"], 1.0, 0.1, inputs={"mass.F": series})
        moved = session.run("mass.x", "1", "0.1", inputs={"mass.F": ([0.0, 1.0], [0, 1])})[1]
        assert moved.shape == (11, 1)


def test_outputs_that_nobody_reads_change_nothing(built):
    """The arm's torque answers to the force at once: it is read again only where it is recorded."""
    with Session(built / "deepsea_0km.ssp") as session:
        both = session.run(["arm.x_h", "arm.M_F"], 4.0, 0.004, method="nepce")[1]
        alone = session.run(["arm.x_h"], 4.0, 0.004, method="nepce")[1]
        again = session.run(["arm.M_F"], 4.0, 0.004, method="nepce")[1]
    np.testing.assert_array_equal(both[:, :1], alone)
    np.testing.assert_array_equal(both[:, 1:], again)


QUIET = Path(library.__file__).parents[2] / "fmus" / "_quiet.abi3.so"


@pytest.mark.skipif(not QUIET.is_file(), reason="installed without the front library")
def test_a_script_that_ran_plain_pythonfmu_fmus_ends_well(toys, tmp_path):
    """Their libraries free a part of the heap twice as the process ends, which once in a few times aborted it."""
    pack = package(tmp_path / "p.ssp", {"s": toys / "Spring.fmu", "m": toys / "Mass.fmu"})
    script = f"""if True:
        import ctypes
        from pathlib import Path
        from deepsea_cosim.master.simulation.session import Session
        with Session(Path({str(pack)!r})) as session:
            session.run(["m.v"], 0.1, 0.01)
        assert ctypes.CDLL(None).finalizePythonInterpreter  # the one that does nothing is found before theirs
    """
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")
