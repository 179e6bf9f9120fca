"""The public door: its names, that it is light, and that each function does what its command does."""

import re
import subprocess
import sys

import deepsea_cosim
import numpy as np
import pytest
from deepsea_cosim import CosimError, Session, check, simulate, sweep
from deepsea_cosim.core.errors import UsageError

from benchmarks import native

from ..master.parts import linear, two
from ..packages import connector, link, package, system

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

NAMES = {
    "Campaign", "CosimError", "Diagnosed", "Result", "Session", "Sweep", "build_fmus", "check", "compose",
    "diagnose", "read_campaign", "simulate", "sweep", "write_page",
}  # fmt: skip


def test_its_names():
    assert set(deepsea_cosim.__all__) == NAMES
    assert set(dir(deepsea_cosim)) >= NAMES
    for name in NAMES:
        assert getattr(deepsea_cosim, name).__doc__
    with pytest.raises(AttributeError, match="has no attribute 'simulat'"):
        deepsea_cosim.simulat  # noqa: B018


def test_it_imports_nothing_heavy():
    light = "import sys; from deepsea_cosim import simulate, sweep, diagnose, build_fmus, check; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", light], check=True, capture_output=True, text=True).stdout.split()
    assert not {"numpy", "numba", "pandas", "fmpy", "mujoco", "scipy", "matplotlib", "lxml"} & {*loaded}


def test_a_run_and_its_frame_and_figure(fmus, tmp_path):
    told = []
    path = two(tmp_path / "p.ssp", fmus[2])
    result = simulate(path, tmp_path / "out", progress=lambda done, total: told.append((done, total)), step=0.05)
    frame = result.frame()
    assert frame["a.y1"].to_numpy() == pytest.approx(frame["time"].to_numpy())
    assert frame.attrs["units"] == {}  # the FMU states none
    assert told[0] == (0, 20)
    assert told[-1] == (20, 20)
    assert len(result.plot("a.*").axes) == 1
    with pytest.raises(UsageError, match="no signal matches 'c"):
        result.plot("c.*")
    assert not check(path).errors
    assert check(path, step=5.0).errors


def test_what_is_wrong_is_one_line(tmp_path):
    with pytest.raises(CosimError, match="no option 'stepp'; did you mean 'step'"):
        simulate(tmp_path / "p.ssp", stepp=3)
    with pytest.raises(CosimError, match="no option 'stop'; did you mean 'step'"):
        sweep(tmp_path / "p.ssp", {"a": [1]}, stop=3)


def test_a_sweep(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2])
    found = sweep(path, {"b.D[1,1]": [1, 2.0]}, {"end": "final(b.y1)"}, tmp_path / "out", processes=1,
                  fixed={"a.trouble": 0})  # fmt: skip
    frame = found.frame()
    assert frame["end"].tolist() == pytest.approx([1.0, 2.0])
    assert frame.index.tolist() == [0, 1]
    assert found.summary["set"] == ["a.trouble=0"]
    assert found.plot("end").axes
    with pytest.raises(UsageError, match="no metric 'ende'; did you mean 'end'"):
        found.plot("ende")


@pytest.fixture
def driven(fmus, tmp_path):
    """y = the integral of u."""
    one = linear("a", A=[[0.0]], B=[[1.0]], C=[[1.0]], x0=[0.0])
    root = system("root", one, made=(connector("u", "input"),), links=(link("u", "a.u1"),))
    return package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]}, step=0.1)


def test_a_run_that_is_driven_step_by_step(driven):
    with Session(str(driven)) as session:
        run = session.start(["a.y1"], inputs={"u": 1.0})
        assert run.values() == [0.0]
        assert run.step() == pytest.approx([0.1])
        assert run.step({"u": -2.0}, count=3) == pytest.approx([0.1 - 0.6])
        assert run.step() == pytest.approx([0.1 - 0.8])
        assert (run.steps, run.time) == (5, pytest.approx(0.5))
        with pytest.raises(UsageError, match="'v' is not driven"):
            run.step({"v": 1.0})
        with pytest.raises(UsageError, match="is not finite"):
            run.step({"u": float("nan")})
        session.run(["a.y1"], 1.0, 0.1)
        with pytest.raises(UsageError, match="this run is over"):
            run.step()
        again = session.start(["a.y1"], step=0.2, inputs={"u": 1.0})
        assert again.step() == pytest.approx([0.2])
    with pytest.raises(UsageError, match="this run is over"):
        again.step()
    with pytest.raises(UsageError, match="the session is closed"):
        session.start(["a.y1"])


@pytest.mark.parametrize(("arguments", "told"), [
    ((None,), "vary has to give values by the names"), (({"a.x": 5},), "'a.x' = 5 has to be a list of values"),
    (({"a.x": [1]}, 5), "metrics has to be a list of texts"), (({"a.x": [1]}, "max(a.y)"), "metrics has to be a list"),
    (({"a.x": range(200_000)},), "has 200000 values; 100000 cases are taken at most"),
])  # fmt: skip
def test_sweeps_of_nothing_that_can_be_varied(tmp_path, arguments, told):
    with pytest.raises(CosimError, match=re.escape(told)):
        sweep(tmp_path / "none.ssp", *arguments)


def test_steps_are_whole_numbers(driven):
    with Session(driven) as session:
        taken = session.start(["a.y1"], inputs={"u": 1.0})
        for count in (-1, 1.5, True, "1", None):
            with pytest.raises(CosimError, match="has to be a whole number of steps"):
                taken.step(count=count)
        with pytest.raises(CosimError, match="inputs have to be values by address"):
            taken.step(5)
        taken.step(count=0)
        assert taken.steps == 0
        taken.step(count=5000)
        assert taken.steps == 5000


@pytest.mark.parametrize("method", ["gauss-seidel", "nepce", "extrapolation"])
def test_whole_numbers_and_reals_are_driven_together(fmus, tmp_path, method):
    """A method that holds means over a step has a column more for each of them."""
    one = linear("a", A=[[0.0]], B=[[1.0]], C=[[1.0]], x0=[0.0])
    path = package(tmp_path / "p.ssp", system("root", one), {"resources/L.fmu": fmus[2]}, step=0.1)
    with Session(path) as session:
        run = session.start(["a.y1", "a.integer_out"], inputs={"a.integer_in": 2, "a.u1": 1.0}, method=method)
        assert run.step({"a.integer_in": 7, "a.u1": 3.0}) == pytest.approx([0.3, 7.0])
        assert run.step(count=2) == pytest.approx([0.9, 7.0])


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "extrapolation", "nepce", "interface-jacobian"])
def test_steps_are_those_of_a_run(built, method):
    """To the last bit, taken one by one or some at a time."""
    record, h = ["arm.x_h", "hydraulics.P1"], 2e-3
    changes = {"hydraulics.command.t_start": 0.01}
    with Session(built / "deepsea_3km.ssp") as session:
        _, rows = session.run(record, 0.2, h, changes, method=method)
        run = session.start(record, h, changes=changes, method=method)
        ones = [run.values(), *(run.step() for _ in range(60)), run.step(count=40)]
    assert np.array_equal(np.array(ones[:-1]), rows[:61])
    assert np.array_equal(ones[-1], rows[-1])


def test_an_environment_of_gymnasium(driven):
    pytest.importorskip("gymnasium")
    from deepsea_cosim.gym import CosimEnv

    env = CosimEnv(driven, ["a.y1"], {"u": (-1.0, 3.0)}, lambda seen, given: seen["a.y1"] - given["u"], 0.2,
                   ends=lambda seen: seen["a.y1"] > 0.9)  # fmt: skip
    seen, info = env.reset(seed=1)
    assert (seen.tolist(), info) == ([0.0], {"time": 0.0})
    seen, reward, terminated, truncated, info = env.step(np.array([2.0]))
    assert seen == pytest.approx([0.4])
    assert reward == pytest.approx(0.4 - 2.0)
    assert (terminated, truncated, info["time"]) == (False, False, pytest.approx(0.2))
    assert env.step(np.array([3.0]))[2]
    env.reset()
    outcomes = [env.step(np.array([0.0]))[3] for _ in range(5)]
    assert outcomes == [False, False, False, False, True]  # at the package's stop time
    env.close()
    with pytest.raises(UsageError, match="no whole number of macro steps"):
        CosimEnv(driven, ["a.y1"], {}, lambda seen, given: 0.0, 0.15)
