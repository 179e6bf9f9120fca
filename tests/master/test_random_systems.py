"""Random graphs of linear FMUs against the exact solution of the same linear system, written with matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

STATES, PORTS = 2, 2
H, STEPS = 0.05, 12


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {version: native.linear(folder, version, through=False) for version in (1, 2, 3)}


@dataclass
class Part:
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    x0: np.ndarray
    version: int
    nested: bool


@dataclass
class Wire:
    """u[target] = factor y[source] + offset; (part, port) each."""

    source: tuple[int, int]
    target: tuple[int, int]
    factor: float
    offset: float


numbers = st.integers(-8, 8).map(lambda n: n / 4.0)


@st.composite
def graphs(draw):
    """(parts, wires): every input has one driver at most."""

    def matrix(rows, columns):
        return np.array(draw(st.lists(numbers, min_size=rows * columns, max_size=rows * columns))).reshape(
            rows, columns
        )

    parts = [
        Part(matrix(STATES, STATES), matrix(STATES, PORTS), matrix(PORTS, STATES), matrix(1, STATES)[0],
             draw(st.sampled_from((1, 2, 3))), draw(st.booleans()))
        for _ in range(draw(st.integers(2, 4)))
    ]  # fmt: skip
    wires = []
    for i in range(len(parts)):
        for port in range(PORTS):
            if draw(st.booleans()):
                source = draw(st.integers(0, len(parts) - 1)), draw(st.integers(0, PORTS - 1))
                wires.append(Wire(source, (i, port), draw(numbers), draw(numbers)))
    return parts, wires


def ssp(path, fmus, parts, wires):
    """The graph as a package; nested parts stand in a system of their own, with connectors of its own."""
    elements, links, sets = [], [], {}
    for i, part in enumerate(parts):
        ports = [connector(f"u{k + 1}", "input") for k in range(PORTS)]
        ports += [connector(f"y{k + 1}", "output") for k in range(PORTS)]
        own = native.values("", A=part.A, B=part.B, C=part.C, x0=part.x0)
        one = component("c", f"resources/L{part.version}.fmu", *ports)
        if part.nested:
            inner = [link(f"in{k + 1}", f"c.u{k + 1}") for k in range(PORTS)]
            inner += [link(f"c.y{k + 1}", f"out{k + 1}") for k in range(PORTS)]
            outside = [connector(f"in{k + 1}", "input") for k in range(PORTS)]
            outside += [connector(f"out{k + 1}", "output") for k in range(PORTS)]
            elements.append(system(f"p{i}", one, made=tuple(outside), links=tuple(inner)))
            sets |= {f"p{i}.c{name}": v for name, v in own.items()}
        else:
            elements.append(one.replace('name="c"', f'name="p{i}"', 1))
            sets |= {f"p{i}{name}": v for name, v in own.items()}
    for w in wires:
        (a, i), (b, k) = w.source, w.target
        start = f"p{a}.{'out' if parts[a].nested else 'y'}{i + 1}"
        end = f"p{b}.{'in' if parts[b].nested else 'u'}{k + 1}"
        links.append(link(start, end, f'<ssc:LinearTransformation factor="{w.factor}" offset="{w.offset}"/>'))
    root = system("root", *elements, links=tuple(links), bindings=bindings(binding(values(sets))))
    files = {f"resources/L{v}.fmu": fmus[v] for v in (1, 2, 3)}
    return package(path, root, files, stop=H * STEPS, step=H)


def name(parts, i):
    return f"p{i}.c" if parts[i].nested else f"p{i}"


def exact(parts, wires, order, jacobi):
    """Outputs (steps + 1, parts, ports) of the same algorithm with the matrix exponential."""
    held = []
    for part in parts:
        whole = np.zeros((STATES + PORTS, STATES + PORTS))
        whole[:STATES, :STATES], whole[:STATES, STATES:] = part.A, part.B
        e = expm(whole * H)
        held.append((e[:STATES, :STATES], e[:STATES, STATES:]))
    x = [part.x0.copy() for part in parts]
    y = np.array([part.C @ s for part, s in zip(parts, x, strict=True)])
    rows = [y.copy()]
    for _ in range(STEPS):
        snapshot = y.copy()
        for i in order:
            u = np.zeros(PORTS)
            for w in wires:
                if w.target[0] == i:
                    u[w.target[1]] = w.factor * (snapshot if jacobi else y)[w.source] + w.offset
            x[i] = held[i][0] @ x[i] + held[i][1] @ u
            y[i] = parts[i].C @ x[i]
        rows.append(y.copy())
    return np.array(rows)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(graph=graphs(), method=st.sampled_from(("gauss-seidel", "jacobi")))
def test_outputs_are_those_of_the_matrices(fmus, tmp_path_factory, graph, method):
    parts, wires = graph
    folder = tmp_path_factory.mktemp("random")
    result = run(ssp(folder / "p.ssp", fmus, parts, wires), folder / "out", Options(method=method))
    names = {name(parts, i): i for i in range(len(parts))}
    expected = exact(parts, wires, [names[n] for n in result.summary["order"]], method == "jacobi")
    frame = result.frame()
    for i in range(len(parts)):
        for k in range(PORTS):
            found = frame[f"{name(parts, i)}.y{k + 1}"].to_numpy()
            assert found == pytest.approx(expected[:, i, k], rel=1e-9, abs=1e-9)


def coupled(parts, wires, stop):
    """Outputs (parts, ports) at the end of the coupled system, as one matrix exponential."""
    n = len(parts) * STATES
    whole = np.zeros((n + 1, n + 1))  # the last state is 1, for the offsets
    for i, part in enumerate(parts):
        whole[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = part.A
    for w in wires:
        (a, i), (t, k) = w.source, w.target
        whole[2 * t : 2 * t + 2, 2 * a : 2 * a + 2] += np.outer(parts[t].B[:, k], w.factor * parts[a].C[i])
        whole[2 * t : 2 * t + 2, n] += parts[t].B[:, k] * w.offset
    x = expm(whole * stop) @ np.append(np.concatenate([part.x0 for part in parts]), 1.0)
    return np.array([part.C @ x[2 * i : 2 * i + 2] for i, part in enumerate(parts)])


@settings(
    max_examples=24, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(graph=graphs(), method=st.sampled_from(("extrapolation", "nepce", "interface-jacobian", "fixed-point")))
def test_methods_of_second_order_come_to_the_coupled_system(fmus, tmp_path_factory, graph, method):
    """Half the step, a quarter of the error, on any graph; some need FMUs that restore their state."""
    parts, wires = graph
    for part in parts:
        part.version = max(part.version, 2)
    folder = tmp_path_factory.mktemp("random")
    path = ssp(folder / "p.ssp", fmus, parts, wires)
    truth = coupled(parts, wires, H * STEPS)
    errors = []
    for h in (H / 16, H / 32):
        frame = run(path, folder / "out", Options(method=method, step=h)).frame()
        found = [[frame[f"{name(parts, i)}.y{k + 1}"].iloc[-1] for k in range(PORTS)] for i in range(len(parts))]
        errors.append(np.abs(np.array(found) - truth).max())
    assert errors[1] <= 0.3 * errors[0] + 1e-6 * max(1.0, np.abs(truth).max()), errors


def test_methods_converge_to_the_coupled_system(fmus, tmp_path):
    """The coupled system as one matrix; the error at the end falls as the method's order says."""
    rng = np.random.default_rng(3)
    parts = [Part(rng.normal(size=(2, 2)) - 2.0 * np.eye(2), rng.normal(size=(2, 2)), rng.normal(size=(2, 2)),
                  rng.normal(size=2), 2, False) for _ in range(3)]  # fmt: skip
    wires = [Wire((i, k), ((i + 1 + k) % 3, k), 0.5, 0.1) for i in range(3) for k in range(2)]
    truth = coupled(parts, wires, H * STEPS)
    path = ssp(tmp_path / "p.ssp", fmus, parts, wires)
    for method, order in (("jacobi", 1), ("gauss-seidel", 1), ("extrapolation", 2), ("interface-jacobian", 2),
                          ("fixed-point", 2)):  # fmt: skip
        errors = []
        for h in (H / 4, H / 8, H / 16):
            frame = run(path, tmp_path / "out", Options(method=method, step=h)).frame()
            found = np.array([[frame[f"p{i}.y{k + 1}"].iloc[-1] for k in range(2)] for i in range(3)])
            errors.append(np.abs(found - truth).max())
        assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(order, abs=0.2), method
