"""FMUs as other tools write them: they keep to the letter of the standard, or leave unsaid what it lets them."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import gain, linear, redescribed, rewritten

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

METHODS = ["gauss-seidel", "jacobi", "extrapolation", "nepce"]
APART = [*((m, False) for m in METHODS), ("gauss-seidel", True)]
"""Methods, and one with FMUs in processes of their own, which take a second each to start."""
RAMP = {"A": [[0, 1], [0, 0]], "C": [[1, 0]], "x0": [0, 1]}


def lag_of(tmp_path, fmus, version, trouble):
    """A ramp drives a lag, x' = u - x from 0.5, that drives a gain; the lag is the FMU with a trouble."""
    given = {"trouble": trouble, "A[1,1]": -1.0, "B[1,1]": 1.0, "C[1,1]": 1.0, "x0[1]": 0.5}
    lag = component("lag", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"),
                    bindings=bindings(binding(values(given))))  # fmt: skip
    root = system("root", linear("ramp", **RAMP), lag, gain("twice", 2.0),
                  links=(link("ramp.y1", "lag.u1"), link("lag.y1", "twice.u1")))  # fmt: skip
    return package(tmp_path / f"p{trouble:g}.ssp", root, {"resources/L.fmu": fmus[version]}, stop=1.0, step=0.1)


@pytest.mark.parametrize(("method", "isolate"), APART)
@pytest.mark.parametrize(("version", "trouble", "start"), [
    (1, 14.0, 0.5), (2, 14.0, 0.5), (3, 14.0, 0.5), (1, 15.0, 0.0), (2, 15.0, 0.0), (3, 15.0, 0.0)])  # fmt: skip
def test_an_fmu_that_cannot_be_read_before_it_steps(fmus, tmp_path, version, trouble, start, method, isolate):
    """Between steps FMI 2.0 lets it refuse that (14); some do so from the first value on that is set (15)."""
    kinds = {trouble: Options(method=method, isolate=isolate), 0.0: Options(method=method)}
    runs = [run(lag_of(tmp_path, fmus, version, t), tmp_path / f"out{t:g}", options) for t, options in kinds.items()]
    strict, lenient = (r.frame()["lag.y1"].to_numpy() for r in runs)
    assert strict[0] == start
    assert strict[1:] == pytest.approx(lenient[1:], abs=1e-12)
    told = [text for text in runs[0].summary["warnings"] if "'lag' refuses getXXX" in text]
    assert len(told) == 1
    assert ("as their starts, else 0" in told[0]) == (start == 0.0)
    assert not any("refuses getXXX" in text for text in runs[1].summary["warnings"])


def test_a_session_runs_such_an_fmu_again(fmus, tmp_path):
    runs = []
    for kind in (15.0, 0.0):
        with Session(lag_of(tmp_path, fmus, 2, kind)) as session:
            runs.append([session.run(["lag.y1"], 1.0, 0.1, {"lag.x0[1]": x})[1][:, 0] for x in (0.5, 0.5, 2.0)])
    assert np.array(runs[0])[:, 1:] == pytest.approx(np.array(runs[1])[:, 1:], abs=1e-12)


def test_an_fmu_that_never_lets_itself_be_read_is_an_error(tmp_path):
    from deepsea_cosim.core.errors import SimulationError

    fmu = rewritten(tmp_path, 2, ("if (!m->entered) return 3;", "return 3;"))
    path = package(tmp_path / "p.ssp", system("root", linear("mute", **RAMP)), {"resources/L.fmu": fmu})
    with pytest.raises(SimulationError, match="component 'mute', reading the outputs"):
        run(path, tmp_path / "out", Options())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("version", "through", "right", "told"), [
    (2, True, 1.0, False), (2, None, 1.0, False), (3, True, 1.0, False), (3, None, 1.0, False), (1, None, 0.9, True)])
def test_a_component_that_drives_itself(tmp_path, version, through, right, told, method):  # fmt: skip
    """y1 = t drives u2, and y2 = u2 answers at once: no order of the components brings it up to date."""
    given = {"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0, "D[2,2]": 1.0}
    own = component("own", "resources/L.fmu", connector("u2", "input"), connector("y1", "output"),
                    connector("y2", "output"), bindings=bindings(binding(values(given))))  # fmt: skip
    fmu = native.linear(tmp_path, version, through=through)
    root = system("root", own, links=(link("own.y1", "own.u2"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, stop=1.0, step=0.1)
    result = run(path, tmp_path / "out", Options(method=method))
    late = 0.5 * (1.0 - right) if method in ("extrapolation", "nepce") else 1.0 - right
    assert result.frame()["own.y2"].iloc[-1] == pytest.approx(1.0 - late, abs=1e-12)
    assert any("component 'own'" in text and "a step late" in text for text in result.summary["warnings"]) == told


@pytest.mark.parametrize(("method", "isolate"), [("gauss-seidel", False), ("jacobi", False), ("gauss-seidel", True)])
@pytest.mark.parametrize(("version", "through", "late", "right"), [
    (2, None, False, True), (2, True, True, True), (2, None, True, False), (1, None, False, False),
    (2, False, False, False), (3, False, True, False),
])  # fmt: skip
def test_a_loop_that_nothing_tells_of_is_solved_or_told(tmp_path, version, through, late, right, method, isolate):
    """y_a = -3 y_b, y_b = y_a + t, which is -0.75 at the end: unsaid, denied, and begun in the middle of the run."""
    clock, a, b = ({**given, "trouble": 20.0 * late, "when": 0.5} for given in (
        {"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}, {"D[1,1]": -3.0}, {"D[1,1]": 1.0, "D[1,2]": 1.0}))  # fmt: skip
    ports = connector("u1", "input"), connector("u2", "input"), connector("y1", "output")
    parts = [component(name, "resources/L.fmu", *ports, bindings=bindings(binding(values(given))))
             for name, given in (("clock", clock), ("a", a), ("b", b))]  # fmt: skip
    root = system("root", *parts, links=(link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("clock.y1", "b.u2")))
    fmu = native.linear(tmp_path, version, through=through)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, stop=1.0, step=0.1)
    result = run(path, tmp_path / "out", Options(method=method, isolate=isolate))
    assert (result.frame()["a.y1"].iloc[-1] == pytest.approx(-0.75, abs=1e-12)) == right
    told = [text for text in result.summary["warnings"] if "an algebraic loop that the FMUs do not declare" in text]
    assert len(told) == (not right)
    assert all(text.startswith("a.u1 -> a.y1 -> b.u1 -> b.y1 -> a.u1:") for text in told)


@pytest.mark.parametrize("variability", ["parameter", "discrete", "continuous"])
def test_any_variable_of_fmi_1_with_a_start_takes_a_value(fmus, tmp_path, variability):
    """FMI 1.0 has no parameters among its causalities; here internal variables are some."""
    old = ('name="D[1,1]" valueReference="400" causality="internal" variability="parameter"',
           f'name="D[1,1]" valueReference="400" causality="internal" variability="{variability}"')  # fmt: skip
    fmu = redescribed(fmus[1], tmp_path / "L.fmu", old)
    root = system("root", gain("twice", 2.0), linear("ramp", **RAMP), links=(link("ramp.y1", "twice.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, stop=1.0, step=0.1)
    result = run(path, tmp_path / "out", Options())
    assert result.frame()["twice.y1"].iloc[-1] == pytest.approx(2.0)
    assert result.summary["parameters"]["twice.D[1,1]"]["value"] == 2.0
