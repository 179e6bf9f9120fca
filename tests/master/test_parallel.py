"""`--parallel`: what does not depend on each other steps side by side, with the same results to the last bit."""

from __future__ import annotations

from contextlib import ExitStack

import numpy as np
import pytest
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.master.engine import loop, runner, step_threads
from deepsea_cosim.master.options import Options
from deepsea_cosim.master.simulation.interrupts import Interrupts
from deepsea_cosim.master.simulation.plan import make_plan
from deepsea_cosim.master.simulation.run import run

from benchmarks import native
from benchmarks.parallel import circle, python_fmu, row

from ..packages import binding, bindings, component, connector, package, system, values
from .parts import rewritten
from .test_lost import FATAL_STEP, FREE, WATCH

needs_compiler = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")
needs_threads = pytest.mark.skipif(not step_threads.supported(), reason="no threads are woken here for a step")
STATE = {"A[1,1]": -1.0, "A[1,2]": 1.0, "A[2,1]": -2.0, "B[1,1]": 1.0, "B[1,2]": 0.5, "C[1,1]": 1.0, "x0[1]": 1.0}


@pytest.fixture
def always(monkeypatch):
    """Three threads that take every step, however fast it is; gives them."""
    made = []
    begin = step_threads.StepThreads.begin

    def kept(self, *arguments):
        begin(self, *arguments)
        made.append(self)

    monkeypatch.setattr(step_threads, "cores", lambda: 3)
    monkeypatch.setattr(runner, "_clock", lambda: 0)
    monkeypatch.setattr(step_threads.StepThreads, "begin", kept)
    return made


def taken(threads):
    """Whether threads had something to do."""
    return any(c.control[loop.THREADS] > 0 and c.control[loop.NEXT] > 0 for c in threads)


@needs_compiler
@needs_threads
@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("method", ["jacobi", "extrapolation", "gauss-seidel", "nepce", "interface-jacobian"])
def test_threads_give_the_same_to_the_last_bit(tmp_path, always, method, version):
    if version == 1 and method == "interface-jacobian":
        pytest.skip("FMUs of FMI 1.0 cannot be taken back")
    fmu = native.linear(tmp_path, version, through=False)
    paths = row(tmp_path / "row", fmu, 400, **STATE), circle(tmp_path / "c", fmu, 400, **STATE)
    for number, path in enumerate(paths):
        folders = [tmp_path / f"{number}{parallel}" for parallel in (False, True)]
        before = run(path, folders[0], Options(method=method))
        always.clear()
        after = run(path, folders[1], Options(method=method, parallel=True))
        assert (folders[0] / "results.csv").read_bytes() == (folders[1] / "results.csv").read_bytes()
        assert np.ptp(before.frame()["b.y1"]) > 0.1
        assert after.summary["steps"] == 400
        if number == 0 or method not in ("gauss-seidel", "nepce"):  # of a circle, one has to wait for the other
            assert taken(always)


@needs_compiler
@needs_threads
@pytest.mark.parametrize("clock", [True, False])
def test_slow_fmus_really_are_in_their_steps_at_once(tmp_path, monkeypatch, clock):
    """Each comes back only once the other has been called, too."""
    monkeypatch.setattr(step_threads, "cores", lambda: 2)
    if not clock:
        monkeypatch.setattr(runner, "_clock", lambda: 0)
    fmu = native.linear(tmp_path, 2, through=False)
    meeting = circle(tmp_path / "m", fmu, 20, **STATE, trouble=22.0, when=0.0)
    if clock:  # until it is known how long they take, they step one after the other
        with pytest.raises(SimulationError, match="doStep at t = 0 s"):
            run(meeting, tmp_path / "out", Options(method="jacobi", parallel=True))
        return
    assert run(meeting, tmp_path / "out", Options(method="jacobi", parallel=True)).summary["steps"] == 20
    with pytest.raises(SimulationError):
        run(meeting, tmp_path / "out", Options(method="jacobi"))


@needs_compiler
@needs_threads
def test_threads_are_woken_once_fmus_have_turned_out_to_be_slow(tmp_path, monkeypatch):
    made = []
    begin = step_threads.StepThreads.begin
    monkeypatch.setattr(step_threads, "cores", lambda: 2)
    monkeypatch.setattr(step_threads.StepThreads, "begin", lambda self, *a: (begin(self, *a), made.append(self)))
    fmu = native.linear(tmp_path, 2, through=False)
    fast = circle(tmp_path / "fast", fmu, 50, **STATE)
    run(fast, tmp_path / "out", Options(method="jacobi", parallel=True))
    assert not taken(made)
    made.clear()
    slow = circle(tmp_path / "slow", fmu, 20, **STATE, trouble=21.0, when=0.0)
    run(slow, tmp_path / "out", Options(method="jacobi", parallel=True))
    assert taken(made)


@needs_compiler
@needs_threads
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(("trouble", "status"), [(1.0, "failed"), (8.0, "ended"), (13.0, "ok")])
def test_what_goes_wrong_in_a_thread_is_told_as_ever(tmp_path, always, trouble, status, version):
    fmu = native.linear(tmp_path, version, through=False)
    path = row(tmp_path / "row", fmu, 50, **STATE, trouble=trouble, when=0.02)
    told = []
    for parallel in (False, True):
        try:
            summary = run(path, tmp_path / str(parallel), Options(method="jacobi", parallel=parallel)).summary
            told.append((summary["status"], summary["steps"], summary["warnings"]))
        except SimulationError as error:
            told.append(("failed", error.time, str(error)))
    assert told[0] == told[1]
    assert told[0][0] == status
    assert taken(always)
    rows = [(tmp_path / str(parallel) / "results.csv").read_bytes() for parallel in (False, True)]
    assert rows[0] == rows[1]


@needs_compiler
def test_levels_keep_what_each_gets(tmp_path):
    fmu = native.linear(tmp_path, 2, through=False)
    with ExitStack() as stack:
        made = make_plan(row(tmp_path / "row", fmu, 5, **STATE), Options(), stack, Interrupts())
        levels = made.system.writer.levels
        assert levels(["a", "b", "c", "d"]) == [["a"], ["b", "c"], ["d"]]
        assert levels(["d", "c", "b", "a"]) == [["d", "c", "b", "a"]]  # each takes what there was before the step
        assert levels(["b", "a", "c", "d"]) == [["b", "a"], ["c"], ["d"]]


def test_fmus_that_run_in_python_get_processes(tmp_path):
    pytest.importorskip("pythonfmu")
    path = circle(tmp_path / "c", python_fmu(tmp_path / "fmu"), 20)
    results = []
    for parallel in (False, True):
        run(path, tmp_path / str(parallel), Options(method="jacobi", parallel=parallel))
        results.append((tmp_path / str(parallel) / "results.csv").read_bytes())
        with ExitStack() as stack:
            instances = make_plan(path, Options(method="jacobi", parallel=parallel), stack, Interrupts()).instances
            assert all((type(s).__name__ == "IsolatedInstance") == parallel for s in instances.values())
    assert results[0] == results[1]
    assert len(results[0].splitlines()) == 22


@needs_compiler
@needs_threads
def test_all_that_fail_side_by_side_are_known_to_have_failed(tmp_path, always):
    """The first one's error is told; the second one is lost in the same step, so it is not even freed."""
    deadly = rewritten(tmp_path, 2, FREE, FATAL_STEP, before=WATCH.replace("MARK", str(tmp_path / "called")))
    broken = bindings(binding(values({"trouble": 1.0, "when": 0.05})))
    parts = (
        component("a", "resources/L.fmu", connector("y1", "output"), bindings=broken),
        component("b", "resources/D.fmu", connector("y1", "output")),
    )
    files = {"resources/L.fmu": native.linear(tmp_path, 2), "resources/D.fmu": deadly}
    path = package(tmp_path / "p.ssp", system("root", *parts), files)
    with pytest.raises(SimulationError, match="component 'a', doStep"):
        run(path, tmp_path / "out", Options(method="jacobi", parallel=True))
    assert taken(always)
    assert not (tmp_path / "called").exists()
