"""The machine in one FMU computes what the master computes with two."""

from __future__ import annotations

import gc
import io
import weakref
import zipfile

import numpy as np
import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.fmus import check, cross_check
from deepsea_cosim.fmus.container import container, starts_of
from deepsea_cosim.fmus.machine import DeepseaMachine
from deepsea_cosim.master.simulation.run import Options, run
from fmpy.validation import validate_fmu

from ..toys import package

OUTPUTS = [v.name for v in DeepseaMachine.table.of("output")]
CHANGES = {"arm.load_weight": 900.0, "hydraulics.oil.nu0": 3e-5}


@pytest.fixture(scope="module")
def machine(built, tmp_path_factory):
    return container(built / "deepsea_6km.ssp", tmp_path_factory.mktemp("one"))


@pytest.fixture(scope="module")
def coupled(built, tmp_path_factory):
    """The run of the two FMUs, with parameters set, and with the arm's beginning of the stroke."""
    changes = tuple((name, f"{value!r}") for name, value in CHANGES.items())
    folder = tmp_path_factory.mktemp("two")
    found = run(built / "deepsea_6km.ssp", folder, Options(stop_time=3.0, changes=changes)).frame()
    assert np.ptp(found["arm.x_h"]) > 0.01
    return found[OUTPUTS].to_numpy()


def stepped(changes, step, stop):
    """Outputs (n + 1, outputs) of the class that the FMU consists of, without FMI."""
    it = DeepseaMachine(instance_name="it", resources="", visible=False, logger=0)
    for name, value in changes.items():
        it.values[it.table.index(name)] = value
    places = [it.table.index(name) for name in OUTPUTS]
    it.setup_experiment(0.0)
    it.enter_initialization_mode()
    it.exit_initialization_mode()
    rows = [it.get_real(places)]
    for k in range(round(stop / step)):
        assert it.do_step(k * step, step)
        rows.append(it.get_real(places))
    return np.array(rows)


def test_its_class_is_bitwise_the_coupled_run(coupled, built):
    starts = starts_of(built / "deepsea_6km.ssp", DeepseaMachine.table)
    assert np.array_equal(stepped({**starts, **CHANGES}, 1e-3, 3.0), coupled)


def test_a_longer_step_is_cut():
    soon = {"hydraulics.command.t_start": 0.0}
    fine, long = stepped(soon, 1e-3, 2.0), stepped(soon, 1e-2, 2.0)
    place = OUTPUTS.index("arm.x_h")
    assert np.ptp(fine[:, place]) > 0.01
    assert long[:, place] == pytest.approx(fine[::10, place], abs=1e-12)


@pytest.mark.slow
def test_validation_finds_nothing(machine):
    assert [str(problem) for problem in validate_fmu(str(machine))] == []
    check.exercise(machine)


@pytest.mark.slow
def test_the_fmu_is_bitwise_the_coupled_run(machine, coupled, tmp_path):
    path = package(tmp_path / "p.ssp", {"m": machine}, stop=3.0, step=1e-3)
    changes = tuple((f"m.{name}", f"{value!r}") for name, value in CHANGES.items())
    one = run(path, tmp_path / "one", Options(changes=changes)).frame()
    for name, values in zip(OUTPUTS, coupled.T, strict=True):
        assert np.array_equal(one[f"m.{name}"], values), name


def test_a_freed_machine_is_gone_at_once():
    """Not only when Python looks for cycles: 200 lives would grow by some 20 MB until it does."""
    gc.disable()
    try:
        it = DeepseaMachine(instance_name="it", resources="", visible=False, logger=0)
        gone = weakref.ref(it)
        del it
        assert gone() is None
    finally:
        gc.enable()


def test_start_values_are_those_of_the_scenario(built):
    found = starts_of(built / "deepsea_11km.ssp", DeepseaMachine.table)
    assert found["hydraulics.depth"] == found["arm.depth"] == 11000.0


@pytest.mark.slow
def test_importers_compute_the_same(machine, tmp_path, monkeypatch):
    monkeypatch.setattr(cross_check, "STOP", 3.0)  # it begins to move at 2 s
    outcomes = cross_check.cross_check([machine], tmp_path)[machine.stem]
    ran = [o for o in outcomes.values() if o.values is not None]
    assert ran
    assert max(o.deviation for o in ran) <= 1e-9
    place = OUTPUTS.index("arm.x_h")
    assert np.ptp(ran[0].values[:, place]) > 0.01  # it does move


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (' startConnector="v_h" endElement="hydraulics" endConnector="v_h"',
         ' startConnector="x_h" endElement="hydraulics" endConnector="v_h"', "not driven by 'arm.v_h'"),
        ('<ssd:Connection startElement="arm" startConnector="F_hold" endElement="hydraulics" endConnector="F_hold"/>',
         "", "'hydraulics.F_hold' is not driven by 'arm.F_hold'"),
        ('endConnector="x_h"/>', 'endConnector="x_h"><ssc:LinearTransformation factor="2"/></ssd:Connection>',
         "is transformed"),
        ('endElement="hydraulics" endConnector="v_h"/>', 'endElement="hydraulics" endConnector="v_h"/><ssd:Connection '
         'startElement="arm" startConnector="x_h" endElement="hydraulics" endConnector="x_ref"/>', "is driven, which"),
    ],
)  # fmt: skip
def test_a_machine_that_is_coupled_otherwise_is_refused(built, tmp_path, old, new, why):
    other = tmp_path / "other.ssp"
    with zipfile.ZipFile(built / "deepsea_6km.ssp") as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "SystemStructure.ssd":
                assert content.count(old.encode()) == 1
                content = content.replace(old.encode(), new.encode())
            target.writestr(name, content)
    with pytest.raises(PackageError, match=why):
        starts_of(other, DeepseaMachine.table)


def test_fmus_of_other_code_are_refused(built, tmp_path):
    """The arm as it was in another version: a digit in its code differs."""
    old = tmp_path / "old.ssp"
    with zipfile.ZipFile(built / "deepsea_6km.ssp") as source, zipfile.ZipFile(old, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            target.writestr(name, _other_code(content) if name.endswith("DeepseaArm.fmu") else content)
    with pytest.raises(PackageError, match=r"DeepseaArm\.fmu has not the code that is installed here"):
        starts_of(old, DeepseaMachine.table)


def _other_code(content):
    if not zipfile.is_zipfile(io.BytesIO(content)):
        return content + b"\n# other"
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(made, "w") as target:
        for name in source.namelist():
            inside = source.read(name)
            target.writestr(name, _other_code(inside) if name.endswith(("code.zip", "mechanics/loads.py")) else inside)
    return made.getvalue()


def test_another_package_is_refused(toys, tmp_path):
    other = package(tmp_path / "toy.ssp", {"mass": toys / "Mass.fmu"})
    with pytest.raises(PackageError, match=r"toy\.ssp: is no scenario of the deep-sea machine"):
        starts_of(other, DeepseaMachine.table)


def test_a_package_is_no_fmu_and_is_told_who_checks_it(built):
    (told,) = check.faults(built / "deepsea_11km.ssp")
    assert told.startswith("is no FMU: it holds no modelDescription.xml; a package is checked by: cosim-master ")
