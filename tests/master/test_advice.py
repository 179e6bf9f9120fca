"""`--check-step` says where the error comes in and what would halve it; both are held against what is true."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import link, package, system
from .parts import linear

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")
STEP = 0.01


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return native.linear(tmp_path_factory.mktemp("fmu"), 2, through=False)


def swing(name, omega):
    """y1 = cos(omega t)."""
    return linear(name, A=[[0.0, 1.0], [-(omega**2), 0.0]], C=[[1.0, 0.0]], x0=[1.0, 0.0])


def two_sources(path, fmu, fast="quick"):
    """A filter that two swings drive, of which one is twenty times as fast."""
    sink = linear("sink", A=[[-1.0]], B=[[1.0, 1.0]], C=[[1.0]])
    rates = {name: 20.0 if name == fast else 1.0 for name in ("quick", "slow")}
    root = system("root", sink, *(swing(name, omega) for name, omega in rates.items()),
                  links=(link("quick.y1", "sink.u1"), link("slow.y1", "sink.u2")))  # fmt: skip
    return package(path, root, {"resources/L.fmu": fmu}, stop=3.0, step=STEP)


def circle(path, fmu):
    """A damped mass, and a spring that integrates its speed."""
    spring = linear("spring", B=[[-100.0]], C=[[1.0]], x0=[-100.0])
    mass = linear("mass", A=[[-0.5]], B=[[1.0]], C=[[1.0]])
    root = system("root", spring, mass, links=(link("spring.y1", "mass.u1"), link("mass.y1", "spring.u1")))
    return package(path, root, {"resources/L.fmu": fmu}, stop=3.0, step=STEP)


def told(path, out, **options):
    return run(path, out, Options(check_step=True, **options)).summary["step_check"]["advice"]


def error(path, out, column, **options):
    """The greatest error of an output, against steps of a hundredth."""
    fine = run(path, out, Options(method="nepce", step=STEP / 64)).frame()[column].to_numpy()
    frame = run(path, out, Options(**options)).frame()
    every = round(options["step"] / (STEP / 64)) if "step" in options else 64
    return np.abs(frame[column].to_numpy()[:-1] - fine[: (len(frame) - 1) * every : every]).max()


@pytest.mark.parametrize("method", ["jacobi", "extrapolation"])
@pytest.mark.parametrize(("fast", "input"), [("quick", "sink.u1"), ("slow", "sink.u2")])
def test_the_faster_source_is_where_the_error_comes_in(tmp_path, fmu, method, fast, input):
    found = told(two_sources(tmp_path / "p.ssp", fmu, fast), tmp_path / "out", method=method)
    assert (found["input"], found["source"]) == (input, f"{fast}.y1")
    order = 1 if method == "jacobi" else 2
    assert found["order"] == pytest.approx(order, abs=0.1)
    # held at its start instead of at its mean, a swing of amplitude 1 is off by omega h / 2 at most, of a range of 2
    if method == "jacobi":
        assert found["off"] == pytest.approx(20.0 * STEP / 2.0 / 2.0, rel=0.05)


@pytest.mark.parametrize("method", ["jacobi", "extrapolation", "nepce"])
def test_what_is_advised_halves_the_error(tmp_path, fmu, method):
    path = circle(tmp_path / "p.ssp", fmu)
    found = told(path, tmp_path / "out", method=method)
    assert found["cost"] == pytest.approx(STEP / found["step"])
    before = error(path, tmp_path / "out", "mass.y1", method=method)
    # steps that divide the reference's: the next shorter one
    step = STEP / 64 * int(64 * found["step"] / STEP + 1e-9)
    after = error(path, tmp_path / "out", "mass.y1", method=found["method"], step=step)
    assert after < 0.55 * before
    assert found["cost"] < (2.0 if method == "jacobi" else 1.5)


def test_a_source_that_bends_within_the_steps_takes_the_order(tmp_path, fmu):
    """A swing of four radians a step is not followed by straight lines."""
    path = two_sources(tmp_path / "p.ssp", fmu)
    summary = run(path, tmp_path / "out", Options(check_step=True, method="nepce", step=0.2, stop_time=60.0)).summary
    assert summary["step_check"]["advice"]["input"] == "sink.u1"
    assert summary["step_check"]["advice"]["order"] < 1.5
    assert sum("does not have its order 2" in text for text in summary["warnings"]) == 1
    fine = run(path, tmp_path / "out", Options(check_step=True, method="nepce")).summary
    assert not [text for text in fine["warnings"] if "does not have its order" in text]


def test_nothing_is_advised_where_nothing_is_connected(tmp_path, fmu):
    root = system("root", swing("a", 1.0))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, stop=1.0, step=STEP)
    assert told(path, tmp_path / "out") is None
