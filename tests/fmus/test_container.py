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


@pytest.fixture(scope="module")
def machine(built, tmp_path_factory):
    return container(built / "deepsea_6km.ssp", tmp_path_factory.mktemp("one"))


def test_validation_finds_nothing(machine):
    assert [str(problem) for problem in validate_fmu(str(machine))] == []
    check.exercise(machine)


def test_it_is_bitwise_the_coupled_run(machine, built, tmp_path):
    """Also with parameters set, and the arm's beginning of the stroke."""
    change = (("arm.load_weight", "900"), ("hydraulics.oil.nu0", "3e-5"))
    coupled = run(built / "deepsea_6km.ssp", tmp_path / "two", Options(stop_time=3.0, changes=change)).frame()
    path = package(tmp_path / "p.ssp", {"m": machine}, stop=3.0, step=1e-3)
    one = run(path, tmp_path / "one", Options(changes=tuple((f"m.{name}", value) for name, value in change))).frame()
    names = [v.name for v in DeepseaMachine.table.of("output")]
    assert np.ptp(coupled["arm.x_h"]) > 0.01
    for name in names:
        assert np.array_equal(one[f"m.{name}"], coupled[name]), name


def test_a_longer_step_is_cut(machine, tmp_path):
    soon = Options(changes=(("m.hydraulics.command.t_start", "0"),))
    fine = run(package(tmp_path / "a.ssp", {"m": machine}, stop=2.0, step=1e-3), tmp_path / "a", soon).frame()
    long = run(package(tmp_path / "b.ssp", {"m": machine}, stop=2.0, step=1e-2), tmp_path / "b", soon).frame()
    assert np.ptp(fine["m.arm.x_h"]) > 0.01
    assert long["m.arm.x_h"].to_numpy() == pytest.approx(fine["m.arm.x_h"].to_numpy()[::10], abs=1e-12)


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
    place = [v.name for v in DeepseaMachine.table.of("output")].index("arm.x_h")
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
