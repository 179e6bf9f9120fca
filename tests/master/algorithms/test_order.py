"""Order of convergence of every algorithm on linear systems with feed-through, whatever the order of their components.

The exact solution is that of the same system written as one: with y = C x + D u and u = F y,
x' = (A + B F (1 - D F)^-1 C) x.
"""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.algorithms import NAMES, method_named
from deepsea_cosim.master.simulation.run import Options, run
from scipy.linalg import block_diag, expm

from benchmarks import native

from ...packages import binding, bindings, component, connector, link, package, system, values

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

MASS = {"A": [[0, 1], [0, 0]], "B": [[0], [1]], "C": [[1, 0], [0, 1]], "D": [[0], [0]], "x0": [1, 0]}
SPRING = {"A": np.zeros((0, 0)), "B": np.zeros((0, 2)), "C": np.zeros((1, 0)), "D": [[-100, -2]], "x0": []}


def lag(a, b, d=0.0, x0=0.0):
    return {"A": [[-a]], "B": [[b]], "C": [[1]], "D": [[d]], "x0": [x0]}


def gain(*D):
    return {"A": np.zeros((0, 0)), "B": np.zeros((0, len(D))), "C": np.zeros((1, 0)), "D": [list(D)], "x0": []}


TIES = [("mass", 1, "spring", 1), ("mass", 2, "spring", 2), ("spring", 1, "mass", 1)]
CHAIN = [("mass", 1, "a", 1), ("a", 1, "b", 1), ("b", 1, "lag", 1), ("lag", 1, "mass", 1)]
RING = [("a", 1, "b", 1), ("b", 1, "c", 1), ("c", 1, "a", 1)]
LOOP = [("lag", 1, "a", 1), ("a", 1, "b", 1), ("b", 1, "a", 2), ("b", 1, "lag", 1)]
RING_PARTS = {"a": lag(1, 1, 0.5, 1.0), "b": lag(2, -1, 0.3), "c": lag(3, 2)}
SYSTEMS = {
    "spring with feed-through behind its mass": ({"mass": MASS, "spring": SPRING}, TIES),
    "spring with feed-through before its mass": ({"spring": SPRING, "mass": MASS}, TIES),
    "chain of gains": ({"mass": MASS, "a": gain(-2), "b": gain(3), "lag": lag(20, 20, 0.0, -6.0)}, CHAIN),
    "ring": (RING_PARTS, RING),
    "ring against the flow": (dict(reversed(RING_PARTS.items())), RING),
    "algebraic loop": ({"lag": lag(1, -1, 0.0, 1.0), "a": gain(1, -3), "b": gain(1)}, LOOP),
}


def exact(parts, wires, t):
    """Outputs (times, ports) of all components in a row."""
    A, B, C, D = (block_diag(*(np.asarray(p[k], float) for p in parts.values())) for k in "ABCD")
    shapes = {name: np.shape(p["D"]) for name, p in parts.items()}
    sums = np.cumsum([[0, 0], *shapes.values()], axis=0)
    first = dict(zip(shapes, sums[:-1], strict=True))
    F = np.zeros(sums[-1][::-1])
    for giver, i, taker, j in wires:
        F[first[taker][1] + j - 1, first[giver][0] + i - 1] = 1.0
    G = np.linalg.solve(np.eye(len(D)) - D @ F, C)
    x0 = np.concatenate([p["x0"] for p in parts.values()])
    return np.array([G @ (expm((A + B @ F @ G) * s) @ x0) for s in t])


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {f"resources/{through}.fmu": native.linear(folder, 2, str(through), through=through)
            for through in (True, False)}  # fmt: skip


def written(path, fmus, parts, wires):
    """The package: an FMU says that outputs depend on inputs where they do."""
    elements = []
    for name, p in parts.items():
        outputs, inputs = np.shape(p["D"])
        ports = [connector(f"u{i + 1}", "input") for i in range(inputs)]
        ports += [connector(f"y{i + 1}", "output") for i in range(outputs)]
        given = native.values(name, **{k: v for k, v in p.items() if np.size(v)})
        sets = bindings(binding(values({k.removeprefix(f"{name}."): v for k, v in given.items()})))
        elements.append(component(name, f"resources/{bool(np.any(p['D']))}.fmu", *ports, bindings=sets))
    links = tuple(link(f"{a}.y{i}", f"{b}.u{j}") for a, i, b, j in wires)
    return package(path, system("root", *elements, links=links), fmus, stop=2.0, step=0.01)


@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("name", SYSTEMS)
def test_order(fmus, tmp_path, name, method):
    parts, wires = SYSTEMS[name]
    path = written(tmp_path / "p.ssp", fmus, parts, wires)
    columns = [f"{part}.y{i + 1}" for part, p in parts.items() for i in range(len(p["D"]))]
    errors = []
    for h in (0.01, 0.005):
        frame = run(path, tmp_path / "out", Options(step=h, method=method)).frame()
        errors.append(np.abs(frame[columns] - exact(parts, wires, frame["time"])).max().max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(method_named(method).order, abs=0.2)


def test_the_interface_jacobian_knows_that_an_inputs_effect_fades(fmus, tmp_path):
    """Of second order also where a lag of 50 ms settles within some steps: taken to go on, its answers to the last
    changes of its input would count twice (order 1.7 at these steps)."""
    parts, wires = SYSTEMS["chain of gains"]
    path = written(tmp_path / "p.ssp", fmus, parts, wires)
    errors = []
    for h in (0.04, 0.02):
        frame = run(path, tmp_path / "out", Options(step=h, method="interface-jacobian")).frame()
        errors.append(np.abs(frame["mass.y1"] - exact(parts, wires, frame["time"])[:, 0]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)


SERIES = {
    "a jump at the end of a step": ("0,0\n.5,0\n.5,1\n1,1\n", 0.5),
    "a jump within a step": ("0,0\n.53,0\n.53,1\n1,1\n", 0.47),
    "a pulse within a step": ("0,0\n.52,0\n.52,10\n.54,10\n.54,0\n1,0\n", 0.2),
    "a kink within a step": ("0,0\n.53,0\n1,.47\n", 0.5 * 0.47**2),
}


@pytest.mark.parametrize("method", [name for name in NAMES if method_named(name).order == 2])
@pytest.mark.parametrize("name", SERIES)
def test_the_integral_of_a_table_is_exact(fmus, tmp_path, name, method):
    """Held inputs are the table's mean over the step, wherever it jumps."""
    rows, integral = SERIES[name]
    part = component("a", "resources/False.fmu", connector("u1", "input"), connector("y1", "output"),
                     bindings=bindings(binding(values({"B[1,1]": 1.0, "C[1,1]": 1.0}))))  # fmt: skip
    root = system("root", part, made=(connector("in", "input"),), links=(link("in", "a.u1"),))
    (tmp_path / "s.csv").write_text(f"time,in\n{rows}")
    path = package(tmp_path / "p.ssp", root, fmus, stop=1.0, step=0.1)
    frame = run(path, tmp_path / "out", Options(method=method, stimuli=tmp_path / "s.csv")).frame()
    assert frame["a.y1"].iloc[-1] == pytest.approx(integral, rel=1e-12)


@pytest.mark.parametrize("method", NAMES)
def test_order_behind_a_gain_that_a_table_drives(fmus, tmp_path, method):
    """x' = -x + 3 t: x = 3 (t - 1 + exp(-t)); the gain's output is that of the point in time, not of the step."""
    both = connector("u1", "input"), connector("y1", "output")
    a = component("a", "resources/True.fmu", *both, bindings=bindings(binding(values({"D[1,1]": 3.0}))))
    sets = values({"A[1,1]": -1.0, "B[1,1]": 1.0, "C[1,1]": 1.0})
    b = component("b", "resources/False.fmu", *both, bindings=bindings(binding(sets)))
    root = system("root", a, b, made=(connector("in", "input"),), links=(link("in", "a.u1"), link("a.y1", "b.u1")))
    (tmp_path / "s.csv").write_text("time,in\n0,0\n1,1\n")
    path = package(tmp_path / "p.ssp", root, fmus, stop=1.0, step=0.1)
    errors = []
    for h in (0.05, 0.025):
        frame = run(path, tmp_path / "out", Options(step=h, method=method, stimuli=tmp_path / "s.csv")).frame()
        t = frame["time"]
        errors.append(np.abs(frame["b.y1"] - 3.0 * (t - 1.0 + np.exp(-t))).max())
        if method != "gauss-seidel":  # where a component's output belongs to its step
            assert frame["a.y1"].tolist() == pytest.approx((3.0 * t).tolist())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(method_named(method).order, abs=0.2)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["chain of gains", "algebraic loop"])
def test_the_interface_jacobian_takes_what_fmus_say_of_their_derivatives(tmp_path, name, version):
    """The same as measured; measured where they fail; and wrong where they are wrong: they are really taken."""
    parts, wires = SYSTEMS[name]
    made = {}
    for says in (False, True):
        folder = tmp_path / str(says)
        files = {f"resources/{through}.fmu": native.linear(folder, version, str(through), through=through,
                                                           derivatives=says) for through in (True, False)}  # fmt: skip
        path = written(folder / "p.ssp", files, parts, wires)
        for trouble in (0, 11, 12) if says else (0,):
            options = Options(step=0.01, method="interface-jacobian", changes=(("trouble", str(trouble)),))
            made[says, trouble] = run(path, folder / "out", options).frame()["lag.y1"].to_numpy()
    assert made[True, 0] == pytest.approx(made[False, 0], abs=1e-10)
    assert np.array_equal(made[True, 11], made[False, 0])
    assert np.abs(made[True, 12] - made[False, 0]).max() > 1e-8
