"""Every algorithm on a mass against a spring, split at force and speed: order, damping and stability in closed form.

The spring's force is a state, F' = -k v, so a held speed is answered by a straight line. With held inputs that makes
the discrete map of each method known: Gauss-Seidel is symplectic (no damping, stable to omega h = 2), Jacobi has the
damping ratio -omega h / 2, the straight line in the middle of the step -(omega h)^3 / 4, and where inputs are the mean
of what drives them (interface Jacobian, fixed point) it is the implicit midpoint rule: no damping, no limit.
"""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.algorithms import NAMES, method_named
from deepsea_cosim.master.coupling.residual_energy import CouplingOscillation
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ...packages import binding, bindings, component, connector, link, package, system, values

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

OMEGA = 10.0
BETTER = {"gauss-seidel": 2}
"""Orders here where they are better than the method's: taking turns is symplectic."""
CAUSES = {"u1": "N", "y2": "m/s"}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {
        "resources/mass.fmu": native.linear(folder, 2, "mass", through=False, units={"u1": "N", "y2": "m/s"}),
        "resources/spring.fmu": native.linear(folder, 3, "spring", through=False, units={"u1": "m/s", "y1": "N"}),
    }


def oscillator(path, fmus, stop=2.0, damping=0.0):
    """x = cos(omega t), without damping."""
    k = OMEGA**2
    parts = {"spring": {"A": [[0]], "B": [[-k]], "C": [[1]], "x0": [-k]},
             "mass": {"A": [[0, 1], [0, -2 * damping * OMEGA]], "B": [[0], [1]], "C": [[1, 0], [0, 1]],
                      "x0": [1, 0]}}  # fmt: skip
    sets = {a: v for name, m in parts.items() for a, v in native.values(name, **m).items()}
    elements = [component(name, f"resources/{name}.fmu", connector("u1", "input"), connector("y1", "output"),
                          connector("y2", "output")) for name in parts]  # fmt: skip
    root = system("root", *elements, links=(link("spring.y1", "mass.u1"), link("mass.y2", "spring.u1")),
                  bindings=bindings(binding(values(sets))))  # fmt: skip
    return package(path, root, fmus, stop=stop, step=1e-3)


def growth(frame):
    """Damping ratio of the numerical solution, from its energy."""
    energy = 0.5 * frame["mass.y2"] ** 2 + 0.5 * (frame["spring.y1"] / OMEGA) ** 2
    return -np.polyfit(frame["time"][10:], np.log(energy[10:]), 1)[0] / (2.0 * OMEGA)


@pytest.mark.parametrize("method", NAMES)
def test_order_where_a_table_drives_the_system(fmus, tmp_path, method):
    """x'' = -omega^2 x + sin(nu t) from rest; what a table gives counts with the mean over a step, as all inputs do."""
    k, nu = OMEGA**2, 3.0
    spring = native.values("spring", A=[[0]], B=[[-k]], C=[[1]], x0=[0])
    mass = native.values("mass", A=[[0, 1], [0, 0]], B=[[0, 0], [1, 1]], C=[[1, 0], [0, 1]], x0=[0, 0])
    both = connector("u1", "input"), connector("y1", "output")
    root = system("root", component("spring", "resources/spring.fmu", *both),
                  component("mass", "resources/mass.fmu", *both, connector("u2", "input"), connector("y2", "output")),
                  links=(link("spring.y1", "mass.u1"), link("mass.y2", "spring.u1")),
                  bindings=bindings(binding(values({**spring, **mass}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, fmus, stop=2.0, step=1e-3)
    rows = [f"{t},{np.sin(nu * t)}" for t in np.linspace(0.0, 2.0, 2001)]
    (tmp_path / "s.csv").write_text("\n".join(["time,mass.u2", *rows]))
    errors = []
    for h in (8e-3, 4e-3, 2e-3):
        frame = run(path, tmp_path / "out", Options(step=h, method=method, stimuli=tmp_path / "s.csv")).frame()
        exact = (np.sin(nu * frame["time"]) - nu / OMEGA * np.sin(OMEGA * frame["time"])) / (k - nu**2)
        errors.append(np.abs(frame["mass.y1"] - exact).max())
    assert np.log2(errors[1] / errors[2]) == pytest.approx(method_named(method).order, abs=0.2)


@pytest.mark.parametrize("method", NAMES)
def test_order(fmus, tmp_path, method):
    path = oscillator(tmp_path / "p.ssp", fmus)
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        frame = run(path, tmp_path / "out", Options(step=h, method=method)).frame()
        errors.append(np.abs(frame["mass.y1"] - np.cos(OMEGA * frame["time"])).max())
    orders, stated = np.log2(np.array(errors[:-1]) / errors[1:]), method_named(method).order
    if method in BETTER or stated == 2:
        assert orders == pytest.approx(BETTER.get(method, stated), abs=0.15)
    assert np.all(orders > stated - 0.15)


@pytest.mark.parametrize(
    ("method", "ratio"),
    [
        ("gauss-seidel", lambda z: 0.0),
        ("jacobi", lambda z: -z / 2.0),
        ("extrapolation", lambda z: -(z**3) / 4.0),
        ("interface-jacobian", lambda z: 0.0),
        ("fixed-point", lambda z: 0.0),
    ],
)
def test_numerical_damping(fmus, tmp_path, method, ratio):
    path = oscillator(tmp_path / "p.ssp", fmus, stop=20.0)
    h = 8e-3
    result = run(path, tmp_path / "out", Options(step=h, method=method))
    assert growth(result.frame()) == pytest.approx(ratio(OMEGA * h), abs=2e-5, rel=0.02)
    told = result.summary["coupling"][0]
    assert told["omega_h"] == pytest.approx(OMEGA * h, rel=1e-6)
    assert told["numerical_damping"] == pytest.approx(ratio(OMEGA * h), abs=1e-3, rel=0.02)


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_a_mass_that_rests_raises_no_alarm(fmus, tmp_path, method):
    """What is left of the weights' sum is rounding, and so is all that moves."""
    k = OMEGA**2
    spring = native.values("spring", A=[[0]], B=[[-k]], C=[[1]], x0=[7000.0])
    mass = native.values("mass", A=[[0, 1], [0, 0]], B=[[0, 0], [1e-3, -1e-3]], C=[[1, 0], [0, 1]], x0=[0, 1e-16])
    both = connector("u1", "input"), connector("y1", "output")
    root = system("root", component("spring", "resources/spring.fmu", *both),
                  component("mass", "resources/mass.fmu", *both, connector("u2", "input"), connector("y2", "output")),
                  links=(link("spring.y1", "mass.u1"), link("mass.y2", "spring.u1")),
                  bindings=bindings(binding(values({**spring, **mass}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, fmus, stop=1.0, step=0.05)
    (tmp_path / "s.csv").write_text("time,mass.u2\n0,7000\n1,7000\n")
    result = run(path, tmp_path / "out", Options(method=method, stimuli=tmp_path / "s.csv"))
    assert 0.0 < result.summary["coupling"][0]["exchanged_energy_J"] < 1e-9
    assert result.summary["coupling"][0]["relative"] == 0.0
    assert result.summary["warnings"] == []


def test_nepce_damps_less_than_the_straight_line(fmus, tmp_path):
    path = oscillator(tmp_path / "p.ssp", fmus, stop=20.0)
    found = {
        m: growth(run(path, tmp_path / "out", Options(step=8e-3, method=m)).frame()) for m in ("nepce", "extrapolation")
    }
    assert abs(found["nepce"]) < 0.6 * abs(found["extrapolation"])


@pytest.mark.parametrize("method", ["interface-jacobian", "fixed-point"])
def test_stable_far_beyond_the_explicit_limit(fmus, tmp_path, method):
    path = oscillator(tmp_path / "p.ssp", fmus, stop=100.0)
    h = 0.5 if method == "interface-jacobian" else 0.25
    frame = run(path, tmp_path / "out", Options(step=h, method=method)).frame()
    energy = 0.5 * frame["mass.y2"] ** 2 + 0.5 * (frame["spring.y1"] / OMEGA) ** 2
    assert energy.iloc[2:].to_numpy() == pytest.approx(energy.iloc[2], rel=1e-5)
    # and an explicit one is not, and says so
    stepped = run(path, tmp_path / "out", Options(step=h, method="gauss-seidel", stop_time=4.0)).summary
    assert any("do not trust" in text or "too long" in text for text in stepped["warnings"])


def test_methods_that_go_back_refuse_fmus_that_cannot(tmp_path, fmus):
    first = native.linear(tmp_path / "one", 1)
    files = dict.fromkeys(fmus, first)
    path = oscillator(tmp_path / "p.ssp", files)
    with pytest.raises(CosimError, match=r"--method fixed-point: component 'spring' cannot restore its state"):
        run(path, tmp_path / "out", Options(method="fixed-point"))


def test_a_damper_is_a_loss_that_halving_the_step_confirms(fmus, tmp_path):
    """The error that --check-step foretells is that against the closed form."""
    path = oscillator(tmp_path / "p.ssp", fmus)
    result = run(path, tmp_path / "out", Options(step=4e-3, method="nepce", check_step=True))
    frame = result.frame()
    true = np.abs(frame["mass.y1"] - np.cos(OMEGA * frame["time"])).max()
    assert result.summary["step_check"]["errors"]["mass.y1"]["error"] == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize("version", [1, 2])
def test_a_straight_line_reaches_an_fmu_that_takes_slopes(tmp_path, version):
    """x'' = t: with the line's mean alone x would lag; the first step, which knows no slope yet, is what is missing."""
    clock = native.linear(tmp_path / "f", 2, "clock", through=False)
    mass = native.linear(tmp_path / "f", version, "mass", through=False, slopes=True)
    ramp = component("ramp", "resources/clock.fmu", connector("y1", "output"))
    body = component("body", "resources/mass.fmu", connector("u1", "input"), connector("y1", "output"))
    parts = {"ramp": {"A": [[0, 1], [0, 0]], "C": [[1, 0]], "x0": [0, 1]},
             "body": {"A": [[0, 1], [0, 0]], "B": [[0], [1]], "C": [[1, 0]]}}  # fmt: skip
    sets = {a: v for name, m in parts.items() for a, v in native.values(name, **m).items()}
    root = system("root", ramp, body, links=(link("ramp.y1", "body.u1"),), bindings=bindings(binding(values(sets))))
    path = package(tmp_path / "p.ssp", root, {"resources/clock.fmu": clock, "resources/mass.fmu": mass}, step=0.1)
    h = 0.1
    x = run(path, tmp_path / "out", Options(method="extrapolation")).frame()["body.y1"].iloc[-1]
    assert x == pytest.approx(1.0 / 6.0 - h**3 / 6.0 - h**2 / 2.0 * (1.0 - h), rel=1e-12)
    with_mean = run(path, tmp_path / "out", Options(method="extrapolation", substeps=(("body", 2),)))
    assert with_mean.frame()["body.y1"].iloc[-1] != pytest.approx(x, rel=1e-6)


@pytest.mark.parametrize(
    ("method", "h", "stop"),
    [("extrapolation", 0.03, 20.0), ("nepce", 0.03, 20.0), ("jacobi", 2e-3, 20.0), ("jacobi", 2e-3, 200.0),
     ("jacobi", 2e-3, 3.9), ("jacobi", 2e-3, 4.1)],
)  # fmt: skip
def test_a_swing_that_the_coupling_drives_is_warned_of(fmus, tmp_path, method, h, stop):
    """Its energy grows like exp(2 |zeta| omega t), between the run's first and last quarters for 3 / 4 of its time."""
    result = run(oscillator(tmp_path / "p.ssp", fmus, stop=stop), tmp_path / "out", Options(step=h, method=method))
    told = result.summary["coupling"][0]
    exponent = -2.0 * growth(result.frame()) * OMEGA * 0.75 * stop
    assert np.log(told["energy_ratio"]) == pytest.approx(exponent, rel=0.1)
    assert np.log(told["energy_ratio_by_coupling"]) == pytest.approx(exponent, rel=0.15)
    assert "grows" in " ".join(result.summary["warnings"])


@pytest.mark.parametrize("method", ["jacobi", "extrapolation", "interface-jacobian", "fixed-point"])
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_what_the_machine_does_itself_is_not_warned_of(fmus, tmp_path, method, damping):
    """A machine whose own damping is more than what the coupling drives, and one whose coupling hardly adds any."""
    if method == "jacobi" and not damping:
        pytest.skip("this one grows")
    path = oscillator(tmp_path / "p.ssp", fmus, stop=5.0, damping=damping)
    result = run(path, tmp_path / "out", Options(step=2e-3, method=method))
    assert not [w for w in result.summary["warnings"] if "grows" in w or "shrinks" in w]


def swing(y_a, u_a, u_b, y_b, h, slopes=(0.0, 0.0)):
    """The sums over a run that is given as a record."""
    made = CouplingOscillation(feedthrough_slopes=slopes)
    mean_a, mean_b = (0.5 * (y[1:] + y[:-1]) for y in (y_a, y_b))
    lost = (mean_a * u_a[:-1] - u_b[:-1] * mean_b) * h
    drift = (mean_a - u_b[:-1]) * h, (u_a[:-1] - mean_b) * h
    made.add(np.full(len(y_a) - 1, h), (y_a, y_b), (u_a, u_b), lost, drift)
    return made.summary()


@pytest.mark.parametrize("load", [0.0, 1e3])
def test_a_load_does_not_hide_a_swing(load):
    """Jacobi on a unit mass and a spring that carries a load: damping -omega h / 2, whatever the load."""
    h, omega, n = 0.002, OMEGA, 20000
    v, F = np.zeros(n), np.zeros(n)
    v[0] = 0.01
    for k in range(n - 1):  # the force is a state of the spring: F' = -omega^2 v
        v[k + 1], F[k + 1] = v[k] + h * F[k], F[k] - h * omega**2 * v[k]
    told = swing(v, F + load, v, F + load, h)
    assert told["numerical_damping"] == pytest.approx(-0.5 * omega * h, rel=0.05)
    assert np.log(told["energy_ratio"]) == pytest.approx(omega**2 * h * 0.75 * n * h, rel=0.05)


@pytest.mark.parametrize("slopes", [(np.nan, 0.0), (0.0, np.nan)])
def test_damping_is_not_told_where_it_is_not_known_what_answers_at_once(slopes):
    t = np.arange(4000) * 2e-3
    v, F = np.sin(OMEGA * t), OMEGA * np.cos(OMEGA * t)
    assert swing(v, F, v, F, 2e-3)["numerical_damping"] is not None
    assert swing(v, F, v, F, 2e-3, slopes)["numerical_damping"] is None


def test_a_swing_that_comes_to_rest_is_told_without_an_error():
    """A brake: both outputs are zero from the middle on."""
    t = np.arange(4000) * 2e-3
    v, F = np.sin(OMEGA * t), OMEGA * np.cos(OMEGA * t)
    v[2000:], F[2000:] = 0.0, 0.0
    assert swing(v, F, v, F, 2e-3)["energy_ratio"] is None
