"""The FMUs as an importer sees them, through fmpy."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import zipfile
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
import pytest
from deepsea_cosim.fmus.build import HERE
from deepsea_cosim.fmus.readme import table_of
from fmpy import calloc, free
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.validation import validate_fmu

MODELS = ("DeepseaHydraulics", "DeepseaArm", "DeepseaSupply")


class Instance:
    """An FMU instance with its log and variables by name; all other calls are fmpy's."""

    def __init__(self, fmu: Path, folder: Path, name: str = "it", logging: bool = True):
        self.description = fmpy.read_model_description(str(fmu), validate=False)
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.log: list[tuple[int, str]] = []
        self.vr = {v.name: v.valueReference for v in self.description.modelVariables}
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(
            lambda _env, _name, status, _category, message: self.log.append((status, message.decode()))
        )
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.fmu.instantiate(callbacks=callbacks, loggingOn=logging)

    def __getattr__(self, name: str):
        return getattr(self.fmu, name)

    def start(self, **parameters: float) -> Instance:
        for name, value in parameters.items():
            self.set(name, value)
        self.setupExperiment(startTime=0.0)
        self.enterInitializationMode()
        self.exitInitializationMode()
        return self

    def set(self, name: str, value: float) -> None:
        self.setReal([self.vr[name.replace("__", ".")]], [value])

    def get(self, *names: str) -> list[float]:
        return self.getReal([self.vr[name] for name in names])

    def all_outputs(self) -> list[float]:
        return self.getReal([v.valueReference for v in self.description.modelVariables if v.causality == "output"])


@pytest.fixture
def instance(built, tmp_path):
    """Maker of instances that are freed at the end."""
    made = []

    def make(model: str, **kwargs) -> Instance:
        fmu = built / f"{model}.fmu"
        folder = tmp_path / model
        if not folder.exists():
            fmpy.extract(str(fmu), str(folder))
        made.append(Instance(fmu, folder, **kwargs))
        return made[-1]

    yield make
    for it in made:
        it.freeInstance()


def set_moving_inputs(it: Instance, model: str, k: int) -> None:
    """The inputs of a step of a run in which they move."""
    if model == "DeepseaArm":
        it.set("F_h", 7000.0 + 10.0 * k)
    elif model == "DeepseaSupply":
        it.set("Qp[1]", 1e-6 * k)
        it.set("Qt[2]", 8e-7 * k)
    else:
        it.set("x_h", 1e-5 * k)
        it.set("v_h", 0.01)


@contextmanager
def fails(it: Instance, *parts: str):
    """The block must end in fmi2Error, with all parts in the last log message."""
    with pytest.raises(FMICallException) as caught:
        yield
    assert caught.value.status == 3
    status, text = it.log[-1]
    assert status == 3
    for part in parts:
        assert part in text


@pytest.mark.parametrize("model", MODELS)
def test_validation_finds_nothing(built, model):
    assert validate_fmu(str(built / f"{model}.fmu")) == []


@pytest.mark.parametrize("model", MODELS)
def test_every_variable_says_what_it_is(built, model):
    description = fmpy.read_model_description(str(built / f"{model}.fmu"))
    for v in description.modelVariables:
        assert v.description
        if v.type == "Real":
            assert v.unit
        if v.causality in ("parameter", "input") and v.type != "Boolean":
            assert v.min is not None
            assert v.max is not None
            assert float(v.min) <= float(v.start) <= float(v.max)
    assert {u.variable.name for u in description.initialUnknowns} == {u.variable.name for u in description.outputs}


@pytest.mark.parametrize("model", MODELS)
def test_readme_has_the_present_variables(built, model):
    """The README that travels in the FMU has the equations and every variable."""
    with zipfile.ZipFile(built / f"{model}.fmu") as archive:
        text = archive.read("documentation/README.md").decode()
        page = archive.read("documentation/index.html").decode()
    assert "## Equations" in text
    assert "<h2>Equations</h2>" in page
    for v in table_of(model):
        assert f"`{v.name}`" in text
        assert f"<code>{v.name}</code>" in page


@pytest.mark.parametrize(("value", "shown"), [(-1.0, "-1"), (float("nan"), "nan"), (float("inf"), "inf")])
def test_parameter_out_of_range_is_an_error_that_names_it(instance, value, shown):
    it = instance("DeepseaHydraulics")
    with fails(it, "oil.nu0", shown, "1e-07", "0.01"):
        it.set("oil.nu0", value)
    it.start()  # the instance lives on with the old value
    assert it.get("oil.nu0") == [22e-6]


@pytest.mark.parametrize(("model", "name"), [("DeepseaHydraulics", "v_h"), ("DeepseaArm", "F_h")])
def test_input_that_is_not_finite_is_an_error(instance, model, name):
    it = instance(model).start()
    before = it.get(name)
    with fails(it, name, "not finite"):
        it.set(name, float("nan"))
    assert it.get(name) == before
    it.doStep(0.0, 1e-3)
    assert np.isfinite(it.all_outputs()).all()


def test_errors_are_logged_without_debug_logging(instance):
    it = instance("DeepseaArm", logging=False)
    with fails(it, "beam_mass"):
        it.set("beam_mass", -1.0)


def test_contradicting_parameters(instance):
    it = instance("DeepseaHydraulics")
    it.set("cylinder.d_h", 0.05)
    with fails(it, "cylinder.d_h", "cylinder.D_h"):
        it.start()


def test_fixed_parameter_and_output_cannot_be_set(instance):
    it = instance("DeepseaArm").start()
    with fails(it, "load_weight", "fixed"):
        it.set("load_weight", 900.0)
    with fails(it, "theta", "cannot be set"):
        it.set("theta", 0.1)


def test_step_size_must_be_positive(instance):
    it = instance("DeepseaArm").start()
    with fails(it, "step"):
        it.doStep(0.0, 0.0)


def test_faults_of_our_own_are_logged_with_a_traceback(instance):
    it = instance("DeepseaHydraulics").start()
    for k in range(50):
        it.doStep(1e-3 * k, 1e-3)
    whole = it.getFMUstate()
    outputs = [v.valueReference for v in it.description.modelVariables if v.causality == "output"]
    before = it.getReal(outputs)
    short = it.deSerializeFMUstate(re.sub(rb', "model": .*', b"}", it.serializeFMUstate(whole)))
    with pytest.raises(FMICallException):
        it.setFMUstate(short)
    assert it.log[-1][0] == 3
    assert "Traceback" in it.log[-1][1]
    assert "KeyError" in it.log[-1][1]
    assert it.getReal(outputs) == before  # it is where it was
    it.doStep(0.05, 1e-3)


def test_references_of_nothing_or_of_another_type_are_told(instance):
    it = instance("DeepseaHydraulics").start()
    for get in (it.getReal, it.getInteger, it.getBoolean):
        with fails(it, "value reference 99999", "there is no variable"):
            get([99999])
    with fails(it, "is of type Real, not Integer"):
        it.getInteger([0])
    with fails(it, "is of type Real, not Boolean"):
        it.getBoolean([0])


def test_percent_signs_are_escaped_for_printf(monkeypatch):
    """FMI hands log texts to printf."""
    from deepsea_cosim.fmus.arm import DeepseaArm

    arm = DeepseaArm(instance_name="a", resources=None)
    try:
        raise ValueError("100 %s")
    except ValueError as error:
        arm.log_error(error)
    assert arm.log_queue[-1].msg.endswith("100 %%s")


def test_a_refused_set_changes_nothing(instance):
    it = instance("DeepseaHydraulics").start()
    before = it.get("v_h", "x_h", "F_h")
    with fails(it, "x_h", "not finite"):
        it.setReal([it.vr["v_h"], it.vr["x_h"]], [0.01, float("nan")])
    assert it.get("v_h", "x_h", "F_h") == before


def test_types_are_held(instance):
    it = instance("DeepseaHydraulics")
    with fails(it, "line.variable_viscosity", "Boolean"):
        it.setReal([it.vr["line.variable_viscosity"]], [0.5])
    with fails(it, "oil.nu0", "Real"):
        it.setInteger([it.vr["oil.nu0"]], [1])


@pytest.mark.parametrize("t", [5.0, -1.0, float("nan")])
def test_step_must_start_where_the_fmu_is(instance, t):
    it = instance("DeepseaHydraulics").start()
    it.doStep(0.0, 1e-3)
    with fails(it, "the FMU is at t = 0.001"):
        it.doStep(t, 1e-3)
    it.doStep(1e-3, 1e-3)


def test_state_of_an_instance_that_cannot_start(instance):
    it = instance("DeepseaHydraulics")
    it.set("cylinder.d_h", 0.05)
    state = it.getFMUstate()
    it.set("cylinder.d_h", 0.025)
    it.setFMUstate(state)
    assert it.get("cylinder.d_h") == [0.05]
    it.freeFMUstate(state)
    it.set("cylinder.d_h", 0.025)
    it.start()


def test_bytes_that_are_no_state(instance):
    it = instance("DeepseaArm").start()
    for data in (b"nonsense", b"[1]", b'{"model_name": "other"}'):
        state = it.deSerializeFMUstate(data)
        with fails(it, "not a state of DeepseaArm"):
            it.setFMUstate(state)
        it.freeFMUstate(state)
    it.doStep(0.0, 1e-3)


def test_load_that_cannot_be_held_is_a_warning(instance):
    it = instance("DeepseaHydraulics")
    it.set("F_hold", 60000.0)
    it.start()
    assert any(status == 1 and "F_hold" in text for status, text in it.log)


def test_a_restored_state_is_no_start(instance):
    """Where F_hold is at that moment is of no matter to a run."""
    it = instance("DeepseaHydraulics").start()
    it.doStep(0.0, 1e-3)
    it.set("F_hold", 60000.0)
    state = it.getFMUstate()
    it.doStep(1e-3, 1e-3)
    it.setFMUstate(state)
    it.freeFMUstate(state)
    assert it.log == []


@pytest.mark.parametrize("use", [False, True])
def test_a_command_that_is_not_followed_is_a_warning(instance, use):
    it = instance("DeepseaHydraulics")
    it.setBoolean([it.vr["command.use_input"]], [use])
    it.start()
    for k in range(3):
        it.set("x_ref", 1e-4 * k)
        it.doStep(k * 1e-3, 1e-3)
    told = [text for status, text in it.log if status == 1]
    assert told == ([] if use else ["the input x_ref changes but is not followed: command.use_input is false"])


@pytest.mark.parametrize("model", MODELS)
def test_state_goes_back_bitwise(instance, model):
    it = instance(model).start()

    def go(k0, n):
        rows = []
        for k in range(k0, k0 + n):
            set_moving_inputs(it, model, k)
            it.doStep(k * 1e-3, 1e-3)
            rows.append(it.all_outputs())
        return rows

    go(0, 30)
    state = it.getFMUstate()
    data = it.serializeFMUstate(state)
    first = go(30, 50)
    it.setFMUstate(state)
    assert go(30, 50) == first
    again = it.deSerializeFMUstate(data)
    it.setFMUstate(again)
    assert go(30, 50) == first
    it.freeFMUstate(state)
    it.freeFMUstate(again)

    other = instance(model, name="other").start()
    copy = other.deSerializeFMUstate(data)
    other.setFMUstate(copy)
    it = other
    assert go(30, 50) == first
    other.freeFMUstate(copy)


@pytest.mark.parametrize("model", MODELS)
def test_a_start_that_is_gone_back_to_is_a_start(instance, model):
    """Nothing is set in between: yet the model has moved on, and is built anew."""
    it = instance(model)
    it.setupExperiment(startTime=0.0)
    it.enterInitializationMode()
    at_start, state = it.all_outputs(), it.getFMUstate()
    it.exitInitializationMode()
    for k in range(100):
        set_moving_inputs(it, model, k)
        it.doStep(k * 1e-3, 1e-3)
    assert it.all_outputs() != at_start
    it.setFMUstate(state)
    it.exitInitializationMode()
    assert it.all_outputs() == at_start


def test_reset_is_a_new_start(instance):
    it = instance("DeepseaArm").start(load_weight=1200.0)
    it.doStep(0.0, 0.1)
    it.reset()
    it.start()
    assert it.get("load_weight") == [800.0]
    fresh = instance("DeepseaArm", name="fresh").start()
    assert it.all_outputs() == fresh.all_outputs()


def test_outputs_follow_the_inputs_before_the_step(instance):
    it = instance("DeepseaHydraulics").start()
    still = it.get("F_h")[0]
    it.set("v_h", 0.01)
    assert it.get("F_h")[0] == pytest.approx(still - 1000.0 * 0.01)


def test_initial_pressures_follow_the_holding_force(instance):
    it = instance("DeepseaHydraulics")
    it.setupExperiment(startTime=0.0)
    it.enterInitializationMode()
    for force in (1000.0, 5000.0):
        it.set("F_hold", force)
        assert it.get("F_h")[0] == pytest.approx(force)


def test_command_input_is_continued_within_a_step(instance):
    """x_ref as a ramp gives the same answer at 1 ms and 20 ms as the built-in ramp, because its slope is continued."""
    ends = {}
    for name, h in (("built-in", 1e-3), ("input", 1e-3), ("input", 2e-2)):
        it = instance("DeepseaHydraulics", name=f"{name}{h}")
        it.set("command.t_start", 0.0)
        if name == "input":
            it.setBoolean([it.vr["command.use_input"]], [True])
        it.start()
        for k in range(round(0.4 / h)):
            if name == "input":
                it.set("x_ref", 0.04 * k * h)
            it.doStep(k * h, h)
        ends[name, h] = it.get("x_v", "P1", "Pa")
    assert ends["input", 1e-3] == pytest.approx(ends["built-in", 1e-3], rel=2e-3)
    assert ends["input", 2e-2] == pytest.approx(ends["built-in", 1e-3], rel=2e-2)


def test_two_instances_do_not_touch_each_other(instance):
    alone = instance("DeepseaArm", name="alone").start()
    for k in range(20):
        alone.set("F_h", 9000.0)
        alone.doStep(k * 1e-3, 1e-3)
    a = instance("DeepseaArm", name="a").start()
    b = instance("DeepseaArm", name="b").start(load_weight=100.0)
    for k in range(20):
        for it, force in ((a, 9000.0), (b, 1.0)):
            it.set("F_h", force)
            it.doStep(k * 1e-3, 1e-3)
    assert a.all_outputs() == alone.all_outputs()
    assert b.all_outputs() != alone.all_outputs()


def test_process_ends_cleanly_after_an_error_and_without_freeing(built):
    script = f"""
import fmpy
from fmpy.fmi2 import FMU2Slave
fmu = {str(built / "DeepseaArm.fmu")!r}
d = fmpy.read_model_description(fmu)
it = FMU2Slave(guid=d.guid, unzipDirectory=fmpy.extract(fmu), modelIdentifier="DeepseaArm", instanceName="a")
it.instantiate()
try:
    it.setReal([d.modelVariables[0].valueReference], [float("nan")])
except Exception as error:
    print(error)
it.setupExperiment()
it.enterInitializationMode()
it.exitInitializationMode()
it.doStep(0.0, 0.001)
print("end")
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "status 3 (error)" in run.stdout
    assert "end" in run.stdout


@pytest.mark.parametrize("model", MODELS)
def test_freed_right_after_instantiation(built, model):
    script = f"""
import fmpy
from fmpy.fmi2 import FMU2Slave
fmu = {str(built / f"{model}.fmu")!r}
d = fmpy.read_model_description(fmu)
for _ in range(3):
    it = FMU2Slave(guid=d.guid, unzipDirectory=fmpy.extract(fmu), modelIdentifier="{model}", instanceName="a")
    it.instantiate(loggingOn=True)
    it.freeInstance()
print("end")
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (0, "end\n"), run.stderr


def test_many_lives(instance):
    """Instantiate, run and reset over and over: pythonfmu alone loses the script's globals here."""
    for _ in range(30):
        it = instance("DeepseaArm", name="x").start()
        it.doStep(0.0, 1e-3)
    assert np.isfinite(it.all_outputs()).all()


# what an importer may ask, and when


def test_a_refused_step_is_not_counted(instance):
    """fmi2LastSuccessfulTime (2) and fmi2Terminated (3) after a step that is refused and a state that is restored."""
    it = instance("DeepseaArm").start()
    assert it.getRealStatus(2) == 0.0
    it.doStep(0.0, 0.001)
    state = it.getFMUstate()
    it.doStep(0.001, 0.001)
    with fails(it, "but the FMU is at"):
        it.doStep(0.5, 0.001)
    assert it.getRealStatus(2) == 0.002
    assert it.getBooleanStatus(3) is False
    it.setFMUstate(state)
    assert it.getRealStatus(2) == 0.001
    it.freeFMUstate(state)


def test_nothing_is_set_after_terminate(instance):
    it = instance("DeepseaArm").start()
    it.set("F_h", 1.0)
    it.terminate()
    with fails(it, "nothing can be set after terminate"):
        it.set("F_h", 2.0)
    assert it.get("F_h") == [1.0]
    it.reset()
    it.start()
    it.set("F_h", 3.0)
    assert it.get("F_h") == [3.0]


@pytest.mark.parametrize(
    ("asked", "told"), [([], True), (["logStatusWarning"], True), (["logAll"], True), (["logStatusFatal"], False)]
)
def test_log_categories_that_are_asked_for(instance, asked, told):
    it = instance("DeepseaHydraulics", logging=False)
    with fails(it, "there is no log category 'logStatusNothing'"):
        it.setDebugLogging(True, ["logStatusNothing"])
    it.setDebugLogging(True, asked)
    it.set("F_hold", 60000.0)
    it.start()
    assert any(status == 1 and "F_hold" in text for status, text in it.log) == told
    it.setDebugLogging(False, [])
    with fails(it, "out of range"):  # errors are always told
        it.set("F_hold", 1e300)


def test_a_system_without_a_folder_for_temporary_files(tmp_path, monkeypatch):
    """Where the code is unpacked does not depend on it."""

    def none():
        raise FileNotFoundError(2, "No usable temporary directory found")

    space = {"__file__": str(tmp_path / "script.py")}
    exec((HERE / "entry.py.in").read_text().partition("# pythonfmu 0.7.0 runs")[0], space)
    monkeypatch.setattr("tempfile.gettempdir", none)
    monkeypatch.setenv("DEEPSEA_COSIM_CACHE", str(tmp_path / "cache"))
    assert space["cache_folders"]() == [tmp_path / "cache" / "deepsea-cosim", tmp_path]


def test_modules_are_counted_while_another_thread_imports():
    """FMUs that begin in two threads import at the same time."""
    space = {"__file__": "script.py"}
    exec((HERE / "entry.py.in").read_text().partition("# pythonfmu 0.7.0 runs")[0], space)
    stop, begun = threading.Event(), threading.Event()

    def importing():
        while not stop.is_set():
            for k in range(500):
                sys.modules[f"not_there_{k}"] = sys
            begun.set()
            for k in range(500):
                del sys.modules[f"not_there_{k}"]

    before, thread = sys.getswitchinterval(), threading.Thread(target=importing)
    sys.setswitchinterval(1e-6)
    thread.start()
    try:
        begun.wait()
        for _ in range(300):
            assert "pytest" in space["names_of"]("pytest")
    finally:
        stop.set()
        thread.join()
        sys.setswitchinterval(before)
