"""The coupled machine: against the monolithic reference, the paper's times, and itself."""

from __future__ import annotations

from itertools import pairwise

import fmpy
import numpy as np
import pytest
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.study.calibrate import travel_times
from fmpy.fmi2 import FMU2Slave

from ..reference import monolith
from ..reference.compare import deviation


def times(columns):
    """Extension and retraction time of a run [s]."""
    return travel_times(columns["time"], columns["arm.x_h"])


@pytest.fixture(scope="module")
def reference():
    """Solutions of the monolith on the 1 ms grid."""
    t = np.arange(22001) * 1e-3
    return {
        depth: monolith.solve(monolith.Machine(depth=depth), t, rtol=1e-9) for depth in (0.0, 11.0)
    }


@pytest.mark.parametrize("depth", [0.0, 11.0])
def test_coupled_run_against_the_monolith(deepsea_run, reference, depth):
    """22 s at 1 ms: x_h within 0.05 mm, pressures within 0.5 % of 20 MPa."""
    x, _, p = deviation(deepsea_run(f"deepsea_{depth:.0f}km"), reference[depth])
    assert x <= 0.05e-3
    assert p <= 0.005 * 20e6


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_error_falls_with_the_step(deepsea_run, reference, method):
    """First order at least in displacement, for both methods."""
    errors = []
    for ms in (4, 2, 1):
        errors.append(deviation(deepsea_run("deepsea_11km", step=ms * 1e-3, method=method), reference[11.0], ms)[0])
    assert all(coarse / fine > 1.7 for coarse, fine in pairwise(errors))


def test_published_times(deepsea_run):
    """Within 1 % at 11 km, both line models; the five geometry numbers behind them are fitted (docs/calibration.md)."""
    variable = times(deepsea_run("deepsea_11km"))
    constant = times(deepsea_run("deepsea_11km_constant_viscosity"))
    assert variable == pytest.approx((7.625, 7.156), rel=0.01)
    assert constant == pytest.approx((7.178, 6.779), rel=0.01)


@pytest.mark.parametrize("km", [0, 3, 6, 9, 10])
def test_no_delay_down_to_9_km_and_delay_at_10_km(deepsea_run, km):
    delays = np.array(times(deepsea_run(f"deepsea_{km}km"))) - 5.0
    assert (delays > 0.5).all() if km == 10 else (delays < 0.1).all()


@pytest.mark.parametrize("km", [0, 3, 6, 9, 10, 11])
def test_no_bounce_before_the_command(deepsea_run, km):
    c = deepsea_run(f"deepsea_{km}km")
    before = c["time"] <= 2.0
    assert np.abs(c["arm.v_h"][before]).max() < 1e-4
    assert np.abs(c["arm.x_h"][before]).max() < 1e-6


def test_residual_energy_is_reported_and_small(built, tmp_path):
    shares = []
    for step in (2e-3, 1e-3):
        result = run(built / "deepsea_11km.ssp", tmp_path / str(step), Options(step=step, stop_time=5.0))
        bonds = result.summary["coupling"]
        assert [bond["bond"] for bond in bonds] == ["hydraulics.F_h x arm.v_h"]
        shares.append(bonds[0]["relative"])
    assert shares[1] < 0.01
    assert shares[0] / shares[1] == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize(("component", "model"), [("hydraulics", "DeepseaHydraulics"), ("arm", "DeepseaArm")])
def test_jacobi_replays_with_the_inputs_of_each_row(built, deepsea_run, component, model, tmp_path):
    """An FMU that gets the inputs of a row has the outputs of that row, to 1e-9, at once where it answers at once."""
    c = deepsea_run("deepsea_11km", stop_time=4.0, method="jacobi")
    path = built / f"{model}.fmu"
    description = fmpy.read_model_description(str(path))
    places = {v.name: v.valueReference for v in description.modelVariables}
    names = {kind: [v.name for v in description.modelVariables if v.causality == kind] for kind in ("input", "output")}
    inputs, outputs = ([places[name] for name in names[kind]] for kind in ("input", "output"))
    given, told = (np.stack([c[f"{component}.{n}"] for n in names[kind]], axis=1) for kind in ("input", "output"))
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path), str(tmp_path)),
                    modelIdentifier=model, instanceName=component)  # fmt: skip
    fmu.instantiate()
    fmu.setReal([places["depth"]], [11000.0])
    fmu.setReal(inputs, given[0].tolist())
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    made = []
    for t, row in zip(c["time"].tolist(), given.tolist(), strict=True):
        fmu.setReal(inputs, row)
        made.append(fmu.getReal(outputs))
        fmu.doStep(t, 1e-3)
    fmu.terminate()
    fmu.freeInstance()
    scale = np.maximum(np.abs(told).max(axis=0), 1e-12)
    assert (np.abs(np.array(made) - told) / scale).max() <= 1e-9


@pytest.mark.parametrize(("component", "model"), [("hydraulics", "DeepseaHydraulics"), ("arm", "DeepseaArm")])
def test_same_results_through_fmpy_alone(built, deepsea_run, component, model):
    """Each FMU by fmpy.simulate_fmu with the recorded inputs gives the recorded outputs to 1e-9."""
    c = deepsea_run("deepsea_11km", stop_time=4.0, method="gauss-seidel")
    description = fmpy.read_model_description(str(built / f"{model}.fmu"))
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    signals = np.zeros(len(c["time"]), dtype=[("time", float)] + [(name, float) for name in inputs])
    signals["time"] = c["time"]
    for name in inputs:
        signals[name] = c[f"{component}.{name}"]
    alone = fmpy.simulate_fmu(
        str(built / f"{model}.fmu"), stop_time=4.0, step_size=1e-3, output_interval=1e-3, input=signals,
        output=outputs, start_values={"depth": 11000.0},
    )  # fmt: skip
    assert len(alone) == len(c["time"])
    # the first row of simulate_fmu shows the outputs before the inputs were applied
    for name in outputs:
        expected = c[f"{component}.{name}"][1:]
        scale = np.abs(expected).max()
        assert np.abs(alone[name][1:] - expected).max() <= 1e-9 * max(scale, 1e-12), name
