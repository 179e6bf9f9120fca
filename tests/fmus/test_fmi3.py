"""The FMUs as FMI 3.0: the same numbers, a complete model description, states."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.fmus import build, check
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.mechanics.variables import ARM
from deepsea_cosim.ssp.packer import pack
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from lxml import etree

from ..toys import package

pytest.importorskip("pythonfmu3")

MODEL = next(m for m in build.MODELS if m.name == "DeepseaArm")


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return build.build_fmu(MODEL, tmp_path_factory.mktemp("three"), way=build.Way(fmi=3))


def test_validation_finds_nothing(arm):
    assert [str(problem) for problem in validate_fmu(str(arm))] == []
    check.exercise(arm)


def test_a_packed_system_has_the_same_connectors_as_with_fmi_2(arm, built, tmp_path):
    """Only the arm is of FMI 3.0; the check of the master finds nothing wrong."""
    scenarios = Path(build.__file__).parents[1] / "ssp" / "scenarios" / "deepsea"
    sources = {"resources/DeepseaArm.fmu": arm, "resources/DeepseaHydraulics.fmu": built / "DeepseaHydraulics.fmu"}
    path = pack(scenarios / "SystemStructure.ssd", next(scenarios.glob("*_0km.ssv")), sources, tmp_path / "p.ssp")

    def connectors(package):
        with zipfile.ZipFile(package) as archive:
            root = etree.fromstring(archive.read("SystemStructure.ssd"))
        return [(c.get("name"), c.get("kind"), c[0].tag, c[0].get("unit")) for c in root.iter("{*}Connector")]

    assert connectors(path) == connectors(built / "deepsea_0km.ssp")
    assert main([str(path), "--check", "--quiet"]) == 0


def test_units_and_ranges_are_those_of_the_table(arm):
    description = fmpy.read_model_description(str(arm))
    assert description.fmiVersion == "3.0"
    known = {v.name: v for v in description.modelVariables}
    for v in ARM:
        assert known[v.name].unit == v.unit
        for bound in ("min", "max"):
            mine, told = getattr(v, bound), getattr(known[v.name], bound)
            assert (told is None) if mine is None else (float(told) == mine)
    assert known["time"].causality == "independent"
    assert {u.variable.name for u in description.outputs} == {v.name for v in ARM.of("output")}


def test_both_versions_compute_the_same(arm, built, tmp_path):
    """Both in one process, each with its own copy of the code."""
    fmus = {"two": built / "DeepseaArm.fmu", "three": arm.rename(arm.with_name("Three.fmu"))}
    path = package(tmp_path / "p.ssp", fmus, stop=0.5, step=1e-3)
    frame = run(path, tmp_path / "out", Options(changes=(("two.F_h", "6800"), ("three.F_h", "6800")))).frame()
    names = [v.name for v in ARM.of("output")]
    a, b = (frame[[f"{which}.{name}" for name in names]].to_numpy() for which in ("two", "three"))
    assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()
    assert np.ptp(frame["three.x_h"]) > 1e-3
    fmus["three"].rename(arm)


def test_a_run_may_start_later(arm):
    """pythonfmu3 does not hand on the start time: that of the first step counts."""
    result = fmpy.simulate_fmu(str(arm), start_time=1.0, stop_time=1.1, output_interval=0.01, output=["x_h", "time"])
    assert len(result) == 11
    assert np.ptp(result["x_h"]) > 0.0
    with pytest.raises(Exception, match="fmi3"):  # what it is not at later is refused as before
        _jumping(arm)


def _jumping(arm):
    folder = fmpy.extract(str(arm))
    slave = FMU3Slave(guid=fmpy.read_model_description(str(arm)).guid, unzipDirectory=folder,
                      modelIdentifier="DeepseaArm", instanceName="a")  # fmt: skip
    slave.instantiate()
    slave.enterInitializationMode(startTime=1.0)
    slave.exitInitializationMode()
    slave.doStep(1.0, 1e-3)
    slave.doStep(5.0, 1e-3)


def test_state_goes_back_bitwise(arm, tmp_path):
    description = fmpy.read_model_description(str(arm))
    folder = fmpy.extract(str(arm), str(tmp_path))
    slave = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier="DeepseaArm", instanceName="a")
    slave.instantiate()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    slave.doStep(0.0, 1e-3)
    state = slave.getFMUState()
    runs = []
    for _ in range(2):
        for k in range(20):
            slave.doStep(1e-3 + k * 1e-3, 1e-3)
        runs.append(list(slave.getFloat64(outputs)))
        slave.setFMUState(state)
    slave.freeFMUState(state)
    slave.terminate()
    slave.freeInstance()
    assert runs[0] == runs[1]


def test_portable_is_for_fmi_2():
    with pytest.raises(UsageError, match=r"--portable: only FMUs of FMI 2\.0"):
        build.Way(portable=True, fmi=3)
