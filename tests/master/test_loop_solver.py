"""Outputs that depend on inputs at once: chains are up to date after every step, loops are solved or refused."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.coupling.loop_solver import AlgebraicLoop
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import component, connector, link, package, system
from .parts import gain, linear, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return {"resources/L.fmu": native.linear(tmp_path_factory.mktemp("fmus"), 2)}


@pytest.mark.parametrize("method", NAMES)
def test_a_chain_of_gains_is_up_to_date(fmu, tmp_path, method):
    """The package lists the chain from its end: 2 * 3 * 5 * t, with t the state of a clock."""
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    chain = [linear(n, D=[[g]]) for n, g in (("c", 5.0), ("b", 3.0), ("a", 2.0))]
    root = system("root", *chain, clock, links=(link("clock.y1", "a.u1"), link("a.y1", "b.u1"), link("b.y1", "c.u1")))
    frame = run(package(tmp_path / "p.ssp", root, fmu), tmp_path / "out", Options(method=method)).frame()
    assert frame["c.y1"].tolist() == pytest.approx((30.0 * frame["time"]).tolist())


@pytest.mark.parametrize("through", [True, None])
@pytest.mark.parametrize("listed", list(permutations(("m", "a", "b"))), ids="".join)
def test_a_chain_in_a_circle_is_a_step_old_at_most(tmp_path, through, listed):
    """A mass whose position goes through two gains and comes back as force: whatever the package lists first, a step
    holds the force that belongs to its start, as x += v h + F h^2 / 2, v += F h with F = -100 x does."""
    parts = {
        "m": linear("m", A=[[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]], x0=[1, 0]),
        "a": linear("a", D=[[2.0]]), "b": linear("b", D=[[-50.0]]),
    }  # fmt: skip
    links = (link("m.y1", "a.u1"), link("a.y1", "b.u1"), link("b.y1", "m.u1"))
    fmu = {"resources/L.fmu": native.linear(tmp_path, 2, through=through)}
    path = package(tmp_path / "p.ssp", system("root", *(parts[n] for n in listed), links=links), fmu, step=0.02)
    found = run(path, tmp_path / "out").frame()["m.y1"].to_numpy()
    x, v, h, expected = 1.0, 0.0, 0.02, []
    for _ in found:
        expected.append(x)
        x, v = x + v * h - 50.0 * x * h * h, v - 100.0 * x * h
    assert found == pytest.approx(np.array(expected))


def test_a_chain_through_elements_of_an_array_is_a_step_old_at_most(tmp_path):
    """The same by way of the first elements of two arrays, while something else drives another element."""
    said = '<Output valueReference="701" dependencies="700"/>'
    native_fmu = native.linear(tmp_path, 3, through=False)
    fmu = redescribed(native_fmu, tmp_path / "L.fmu", ('<Output valueReference="701"/>', said))
    both = [connector(f"array_{way}", f"{way}put", "Float64", sizes=(3,)) for way in ("in", "out")]
    a, b = (component(name, "resources/L.fmu", *both) for name in "ab")
    m = linear("m", A=[[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]], x0=[1, 0])
    links = (
        link("m.y1", "a.array_in", endIndices="1"),
        link("a.array_out", "b.array_in", startIndices="1", endIndices="1"),
        link("b.array_out", "m.u1", '<ssc:LinearTransformation factor="-100"/>', startIndices="1"),
        link("m.y1", "b.array_in", endIndices="3"),
    )
    root = system("root", m, b, a, links=links)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, version="2.0")
    assert run(path, tmp_path / "out").summary["order"] == ["m", "a", "b"]


def loop(gain, offset=1.0):
    """y_a = gain y_b, y_b = y_a + offset: y_a = gain offset / (1 - gain)."""
    one = linear("one", C=[[1]], x0=[offset])
    a, b = linear("a", D=[[gain]]), linear("b", D=[[1.0, 1.0]])
    links = (link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("one.y1", "b.u2"))
    return system("root", one, a, b, links=links)


@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("gain", [0.5, -3.0])
@pytest.mark.parametrize("offset", [1.0, 1e-10, 1e8])
def test_a_loop_is_solved_in_every_step(fmu, tmp_path, method, gain, offset):
    """Whatever its size: an integrator behind it sees the right value too."""
    behind = linear("i", A=[[0]], B=[[1]], C=[[1]])
    root = loop(gain, offset).replace("</ssd:Elements>", f"{behind}</ssd:Elements>")
    root = root.replace("</ssd:Connections>", f"{link('a.y1', 'i.u1')}</ssd:Connections>")
    frame = run(package(tmp_path / "p.ssp", root, fmu), tmp_path / "out", Options(method=method)).frame()
    exact = gain * offset / (1.0 - gain)
    assert (frame["a.y1"] / exact).tolist() == pytest.approx([1.0] * len(frame), rel=1e-7)
    assert frame["i.y1"].iloc[-1] / exact == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("method", NAMES)
def test_a_loop_is_found_where_the_fmus_do_not_say(tmp_path, version, method):
    """What answers at once is measured, so the loop counts in every step and what is no loop is not taken for one."""
    silent = {"resources/L.fmu": native.linear(tmp_path, version, through=None)}
    clock = linear("clock", A=[[0, 1], [0, 0]], B=[[0], [0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("a", D=[[-3.0]]), linear("b", D=[[1.0, 1.0]]), links=(
        link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("clock.y1", "b.u2"), link("a.y1", "clock.u1")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, silent)
    frame = run(path, tmp_path / "out", Options(method=method)).frame()
    assert frame["a.y1"].tolist() == pytest.approx((-0.75 * frame["time"]).tolist(), abs=1e-12)


@pytest.mark.parametrize("gain", [0.5, 0.9, -3.0])
def test_a_loop_that_goes_on_from_step_to_step_is_learned(fmu, tmp_path, monkeypatch, gain):
    """Its slopes are kept, so few sweeps are made in all; y_a = gain (y_a + cos 3 t)."""
    sweeps, whole = [], AlgebraicLoop.sweep
    monkeypatch.setattr(AlgebraicLoop, "sweep", lambda self: (sweeps.append(0), whole(self))[1])
    clock = linear("clock", A=[[0, -3], [3, 0]], C=[[1, 0]], x0=[1, 0])
    root = system("root", clock, linear("a", D=[[gain]]), linear("b", D=[[1.0, 1.0]]),
                  links=(link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("clock.y1", "b.u2")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, fmu, step=0.01)
    first = run(path, tmp_path / "out").frame()
    assert first["a.y1"].to_numpy() == pytest.approx(gain / (1.0 - gain) * np.cos(3.0 * first["time"].to_numpy()))
    assert len(sweeps) < 800  # it was 40 to 200 a step
    with Session(path) as session:  # of which nothing is left in the next run
        runs = [session.run(["a.y1"], 1.0, 0.01)[1] for _ in range(2)]
    assert np.array_equal(*runs)


@pytest.mark.parametrize("gain", [0.5, -3.0], ids=["learned", "by Newton's method"])
def test_what_is_zero_beside_a_loop_of_large_values_stays_in_its_range(fmu, tmp_path, monkeypatch, gain):
    """A displacement of 0 m that is handed over beside pressures of 1e8 Pa is tried in its own size, to the side that
    its FMU allows."""
    tried, whole = [], AlgebraicLoop._round_trip
    monkeypatch.setattr(AlgebraicLoop, "_round_trip", lambda self, x: (tried.append(x.copy()), whole(self, x))[1])
    u1 = '<ScalarVariable name="u1" valueReference="0" causality="input" variability="continuous"><Real start="0"'
    ranged = redescribed(fmu["resources/L.fmu"], tmp_path / "S.fmu", (u1, f'{u1} min="-1" max="0" nominal="0.1"'))
    root = loop(gain, 1e8).replace("</ssd:Elements>", linear("rest", C=[[1]]) + linear(
        "arm", source="resources/S.fmu", D=[[1.0]]) + "</ssd:Elements>")  # fmt: skip
    root = root.replace("</ssd:Connections>", f"{link('rest.y1', 'arm.u1')}</ssd:Connections>")
    fmus = {**fmu, "resources/S.fmu": ranged}
    frame = run(package(tmp_path / "p.ssp", root, fmus), tmp_path / "out").frame()
    assert (frame["a.y1"] * (1.0 - gain) / (gain * 1e8)).tolist() == pytest.approx([1.0] * len(frame))
    least = np.min([np.where(np.abs(x) < 1e6, x, 0.0) for x in tried])
    assert -1e-6 <= least < 0.0


def test_a_loop_in_which_whole_numbers_flip_for_ever_is_refused(fmu, tmp_path):
    swap = '<ssc:IntegerMappingTransformation><ssc:MapEntry source="0" target="1"/><ssc:MapEntry source="1" ' \
        'target="0"/></ssc:IntegerMappingTransformation>'  # fmt: skip
    pair = connector("integer_in", "input", "Integer"), connector("integer_out", "output", "Integer")
    a, b = (gain(name, g, *pair) for name, g in (("a", -3.0), ("b", 1.0)))
    root = system("root", a, b, links=(
        link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("a.integer_out", "b.integer_in", swap),
        link("b.integer_out", "a.integer_in")))  # fmt: skip
    with pytest.raises(CosimError, match="whole numbers"):
        run(package(tmp_path / "p.ssp", root, fmu), tmp_path / "out")


def test_a_loop_without_a_solution_is_refused(fmu, tmp_path):
    with pytest.raises(CosimError, match="the algebraic loop at the start does not settle"):
        run(package(tmp_path / "p.ssp", loop(1.0), fmu), tmp_path / "out")


@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("zero", [0.1, 0.3, 0.7])
@pytest.mark.parametrize("gains", [(2.0, 3.0), (2.0, -3.0), (10.0, 0.3)])
def test_a_loop_whose_values_pass_zero(fmu, tmp_path, method, zero, gains):
    """What is 1e-16 of rounding in a step is not small: y_a = p y_b + t - t0, y_b = q y_a - (t - t0)."""
    p, q = gains
    ramp = {"A": [[0, 1], [0, 0]], "C": [[1, 0]]}
    a, b = linear("a", **ramp, D=[[p]], x0=[-zero, 1.0]), linear("b", **ramp, D=[[q]], x0=[zero, -1.0])
    path = package(tmp_path / "p.ssp", system("root", a, b, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1"))), fmu)
    frame = run(path, tmp_path / "out", Options(method=method)).frame()
    t = frame["time"].to_numpy() - zero
    assert frame["a.y1"].to_numpy() == pytest.approx(t * (1.0 - p) / (1.0 - p * q), abs=1e-10)


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "nepce", "fixed-point"])
def test_a_loop_that_has_no_solution_later_on_names_one_time(fmu, tmp_path, method):
    """y_a = y_a + t: every value solves it at t = 0, none does later; the message tells the start of that step."""
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    a, b = linear("a", D=[[1.0, 1.0]]), linear("b", D=[[1.0]])
    links = (link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("clock.y1", "a.u2"))
    path = package(tmp_path / "p.ssp", system("root", clock, a, b, links=links), fmu)
    with pytest.raises(CosimError, match="the algebraic loop does not settle") as error:
        run(path, tmp_path / "out", Options(method=method))
    assert str(error.value).count(" at t = ") == 1
    assert str(error.value).endswith("at t = 0 s")


def test_the_inputs_in_the_record_are_those_that_were_held(fmu, tmp_path):
    """Jacobi: a step holds what the source was at its start, also where outputs are read again with newer inputs."""
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("a", D=[[2.0]]), linear("b", D=[[1.0]]),
                  links=(link("clock.y1", "a.u1"), link("a.y1", "b.u1")))  # fmt: skip
    frame = run(package(tmp_path / "p.ssp", root, fmu), tmp_path / "out", Options(method="jacobi")).frame()
    assert frame["a.u1"].tolist() == pytest.approx(frame["time"].tolist())
    assert frame["a.y1"].tolist() == pytest.approx((2.0 * frame["time"]).tolist())


def test_what_cannot_be_found_out_is_told(tmp_path):
    """An FMU that does not say, and whose gain is zero at the start; nothing is told where the FMUs say it."""
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("a", D=[[0.0]]), linear("b", D=[[1.0]]),
                  links=(link("clock.y1", "a.u1"), link("a.y1", "b.u1")))  # fmt: skip
    for through, told in ((None, 1), (True, 0)):
        silent = {"resources/L.fmu": native.linear(tmp_path, 2, through=through)}
        path = package(tmp_path / "p.ssp", root, silent)
        for method, most in (("jacobi", told), ("nepce", told), ("gauss-seidel", 0)):
            warnings = run(path, tmp_path / "out", Options(method=method)).summary["warnings"]
            assert len([w for w in warnings if w.startswith("component 'a': no output dependencies")]) == most


@pytest.mark.parametrize("method", ["jacobi", "nepce", "interface-jacobian"])
def test_a_session_looks_anew_at_what_answers_at_once(tmp_path, method):
    """Where the FMUs do not say: a gain that is zero in the first run answers in the second."""
    silent = {"resources/L.fmu": native.linear(tmp_path, 2, through=None)}
    clock = linear("clock", A=[[0, 1], [0, 0]], B=[[0], [0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("a", D=[[0.0]]), linear("i", A=[[0]], B=[[1]], C=[[1]]),
                  links=(link("clock.y1", "a.u1"), link("a.y1", "i.u1")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, silent)
    gain = {"a.D[1,1]": 2.0}
    with Session(path) as fresh, Session(path) as used:
        used.run(["i.y1"], 1.0, 0.1, {"a.D[1,1]": 0.0}, method=method)
        t, rows = used.run(["a.y1", "i.y1"], 1.0, 0.1, gain, method=method)
        assert np.array_equal(rows, fresh.run(["a.y1", "i.y1"], 1.0, 0.1, gain, method=method)[1])
    assert rows[:, 0].tolist() == pytest.approx((2.0 * t).tolist())


def test_a_session_looks_anew_for_loops(tmp_path):
    """Where the FMUs do not say: gains that make no loop in the first run make one in the second, (1 + t) / (1 + 3)."""
    path = package(tmp_path / "p.ssp", loop(-3.0), {"resources/L.fmu": native.linear(tmp_path, 2, through=None)})
    ramp = {"one.A[1,2]": 1.0, "one.x0[2]": 1.0}
    with Session(path) as used:
        used.run(["a.y1"], 1.0, 0.1, {**ramp, "a.D[1,1]": 0.0})
        for _ in range(2):
            t, rows = used.run(["b.y1"], 1.0, 0.1, ramp)
            assert rows[:, 0].tolist() == pytest.approx((0.25 + 0.25 * t).tolist())


def test_a_session_begins_every_run_in_the_same_order(tmp_path):
    """Where the FMUs do not say, the first run finds out that a comes before b; a loop behind them starts as before."""
    parts = (
        linear("m", A=[[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]], x0=[1.37, 0]), linear("b", D=[[-50.1]]),
        linear("a", D=[[2.3]]), linear("p", D=[[0.7, 1.1]]), linear("q", D=[[1.0]]),
    )  # fmt: skip
    ways = ("m.y1 a.u1", "a.y1 b.u1", "b.y1 m.u1", "b.y1 p.u2", "q.y1 p.u1", "p.y1 q.u1")
    root = system("root", *parts, links=tuple(link(*way.split()) for way in ways))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 2, through=None)})
    with Session(path) as session:
        first, second = (session.run(["p.y1", "m.y1"], 0.2, 0.01)[1] for _ in range(2))
        assert session.system.order == ["m", "a", "b", "p", "q"]
    assert np.array_equal(first, second)


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize(
    ("start", "root"), [(2.1, 2.0), (-1.2, -1.0), (-0.7, -1.0), (9.0, 2.0), (0.6, 2.0), (-3.0, -1.0)]
)
def test_of_two_solutions_the_one_nearer_to_the_start_counts(tmp_path, version, start, root):
    """x = x^2 - 2 has the roots 2 and -1, and repetition finds neither."""
    fmu = {"resources/L.fmu": native.linear(tmp_path, version)}
    path = package(tmp_path / "p.ssp", system("root", linear("a", C=[[1]], x0=[-2.0]), linear("b", D=[[1.0]]),
                   links=(link("a.y1", "b.u1"), link("b.y1", "a.u1"))), fmu)  # fmt: skip
    frame = run(path, tmp_path / "out", Options(changes={"a.square": 1.0, "a.u1": start})).frame()
    assert frame["a.y1"].tolist() == pytest.approx([root] * len(frame), rel=1e-9)


@pytest.mark.parametrize(
    ("start", "root", "told"), [(0.1, 0.0, False), (0.51, 1.0, True), (0.95, 1.0, False), (1.3, 1.0, False)]
)
def test_a_solution_that_repetition_leaves_is_found_from_near_it(tmp_path, start, root, told):
    """x = x^2 has the roots 0 and 1; from the middle repetition comes to 0, but 1 is nearer."""
    fmu = {"resources/L.fmu": native.linear(tmp_path, 2)}
    path = package(tmp_path / "p.ssp", system("root", linear("a"), linear("b", D=[[1.0]]),
                   links=(link("a.y1", "b.u1"), link("b.y1", "a.u1"))), fmu)  # fmt: skip
    given = {"a.square": 1.0, "a.u1": start, "b.u1": start}
    result = run(path, tmp_path / "out", Options(changes=given))
    assert result.frame()["a.y1"].iloc[0] == pytest.approx(root, abs=1e-9)
    assert any("more than one solution" in text for text in result.summary["warnings"]) == told
