"""Each FMU through several importers against the model without FMI, after the rules of the FMI Cross-Check.

Per FMU: inputs, reference (the Python class itself, no FMI in between), options, README, and what each importer makes
of it. Inputs are set before a step and held; outputs are read after it.
"""

from __future__ import annotations

import ctypes
import json
import math
import shutil
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..core.errors import PackageError
from ..core.files import make_folder, replacing, write_together
from ..core.scratch import scratch
from .arm_case import arm_in
from .build import CONTAINER, HERE, MODELS, PLATFORM, c_compiler, interpreter

STEP, STOP = 1e-3, 4.0  # the machine begins to move at 2 s
WRITTEN = 4
"""Steps between the rows of files with outputs: the rules want them below a megabyte."""

TOLERANCE = 1e-6
"""Greatest deviation from the reference, relative to an output's largest value."""


def _arm(t: float) -> dict[str, float]:
    return {"F_h": 6882.6 + 400.0 * math.cos(2.0 * math.pi * t)}  # by a sine the beam would drift to its dead centre


def _hydraulics(t: float) -> dict[str, float]:
    w = 2.0 * math.pi
    return {"x_h": 5e-4 * (1.0 - math.cos(w * t)), "v_h": 5e-4 * w * math.sin(w * t)}


def _supply(t: float) -> dict[str, float]:
    return {"Qp[1]": 4e-5 * (1.0 - math.cos(2.0 * math.pi * t)), "Qt[1]": 3e-5 * (1.0 - math.cos(2.0 * math.pi * t))}


Inputs = Callable[[float], dict[str, float]]

INPUTS: dict[str, Inputs] = {
    "DeepseaHydraulics": _hydraulics, "DeepseaArm": _arm, "DeepseaSupply": _supply,
    "DeepseaMachine": lambda _t: {},
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """What is run: the FMU's name and Python class; times of the steps' starts and ends (n + 1,), inputs held in each
    step (n, inputs)."""

    name: str
    kind: Any
    names: tuple[str, ...]
    outputs: tuple[str, ...]
    times: np.ndarray
    inputs: np.ndarray


@dataclass
class Outcome:
    """What an importer made of an FMU: outputs (n + 1, outputs), or n of one that tells none at the start; or why there
    are none at all."""

    values: np.ndarray | None = None
    remark: str = ""
    deviation: float = math.nan
    absent: bool = False
    """The importer is not on this machine."""

    @property
    def agrees(self) -> bool:
        """Whether the FMU ran, and as the reference does."""
        return self.values is not None and self.deviation <= TOLERANCE


def _description(fmu: Path) -> ElementTree.Element:
    try:
        with zipfile.ZipFile(fmu) as archive:
            return ElementTree.fromstring(archive.read("modelDescription.xml"))  # noqa: S314  of FMUs of ours
    except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError) as error:
        raise PackageError(f"{fmu}: is no FMU ({error})") from None


def _references(fmu: Path, names: Sequence[str]) -> list[int]:
    root = _description(fmu)
    known = {v.get("name"): int(v.get("valueReference", "0")) for v in root.iter("ScalarVariable")}
    return [known[name] for name in names]


def case(fmu: Path) -> Case:
    """The case of an FMU of this project, a user's arm among them. Raises `PackageError` for others."""
    known = {model.name: model for model in (*MODELS, CONTAINER)}
    root = _description(fmu)
    name = root.get("modelName", "")
    if root.get("fmiVersion") == "2.0" and name in known:
        kind, inputs = getattr(import_module(f"{__package__}.{known[name].modules[0]}"), name), INPUTS[name]
    elif root.get("fmiVersion") == "2.0" and (arm := arm_in(fmu)) is not None:
        kind, inputs = arm
    else:
        raise PackageError(
            f"{fmu}: is none of this project's FMUs of FMI 2.0 ({', '.join(known)}, or by cosim-fmus arm)"
        )
    n = round(STOP / STEP)
    start = {v.name: v.start for v in kind.table.of("input")}
    rows = [{**start, **inputs(k * STEP)} for k in range(n)]
    names = tuple(start)
    outputs = tuple(v.name for v in kind.table.of("output"))
    held = np.array([[row[x] for x in names] for row in rows])
    return Case(name, kind, names, outputs, np.arange(n + 1) * STEP, held)


def _number(text: str) -> float:
    return float({"true": "1", "false": "0"}.get(text, text))


def reference(c: Case, fmu: Path) -> np.ndarray:
    """Outputs (n + 1, outputs) of the model's Python class, with the FMU's parameters."""
    slave = c.kind(instance_name="reference", resources="", visible=False, logger=0)
    for v in _description(fmu).iter("ScalarVariable"):
        start = v[0].get("start")
        if v.get("causality") == "parameter" and start is not None:
            slave.values[int(v.get("valueReference", "0"))] = _number(start)
    inputs, outputs = ([slave.table.index(x) for x in names] for names in (c.names, c.outputs))
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.set_real(inputs, c.inputs[0].tolist())
    slave.exit_initialization_mode()
    made = [slave.get_real(outputs)]
    for t, u in zip(c.times[:-1].tolist(), c.inputs, strict=True):
        slave.set_real(inputs, u.tolist())
        slave.do_step(t, STEP)
        made.append(slave.get_real(outputs))
    return np.array(made)


def through_fmpy(fmu: Path, c: Case, _folder: Path) -> Outcome:
    """FMPy's simulate_fmu."""
    from fmpy import simulate_fmu

    # FMPy joins inputs by straight lines and takes their value at the start of a step
    signals = np.array(
        [(t, *u) for t, u in zip(c.times.tolist(), [*c.inputs.tolist(), c.inputs[-1].tolist()], strict=True)],
        dtype=[(name, np.float64) for name in ("time", *c.names)],
    )
    result = simulate_fmu(
        str(fmu), stop_time=STOP, step_size=STEP, output_interval=STEP, input=signals, output=list(c.outputs)
    )
    return Outcome(np.array([[row[name] for name in c.outputs] for row in result]))


def through_c(fmu: Path, c: Case, folder: Path) -> Outcome:
    """The importer in C (`importer/importer.c`), in an empty environment."""
    compiler = c_compiler()
    if compiler is None or sys.platform != "linux":
        return Outcome(remark="needs Linux and a C compiler", absent=True)
    program = folder / "importer"
    source = HERE / "importer" / "importer.c"
    subprocess.run([compiler, "-O2", str(source), "-o", str(program), "-ldl"], check=True, capture_output=True)
    place = folder / f"{fmu.stem} unpacked"  # a blank, to see that it is no matter
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(place)
    plain = not (place / "resources" / "python.txt").exists()
    if plain:
        (place / "resources" / "python.txt").write_text(interpreter())
    guid = _description(fmu).get("guid", "")
    rows = [f"{len(c.names)} {' '.join(map(str, _references(fmu, c.names)))}"]
    rows += [" ".join(f"{x!r}" for x in u) for u in c.inputs.tolist()]
    (folder / "inputs.txt").write_text("\n".join(rows) + "\n")
    library = place / "binaries" / PLATFORM / f"{c.name}.so"
    outputs = map(str, _references(fmu, c.outputs))
    command = [str(program), str(library), (place / "resources").as_uri(), guid, repr(STEP), str(len(c.inputs)),
               str(folder / "inputs.txt"), *outputs]  # fmt: skip
    done = subprocess.run(command, env={}, cwd="/", capture_output=True, text=True)
    told = done.stderr.strip().splitlines() or ["no message"]
    if done.returncode:
        return Outcome(remark=f"exit code {done.returncode}: {told[0]}")
    table = np.array([[float(x) for x in line.split(",")] for line in done.stdout.splitlines()])
    return Outcome(table[:, 1:], told[-1] + ("; made as by --portable, for it was not built so" if plain else ""))


def ecos() -> Any:
    """The module ecospy with the library that it needs (pip install ecospy tbb), or None where it is not installed."""
    for library in Path(sys.prefix, "lib").glob("libtbb.so.*"):  # where the wheel puts it, not where ecos looks
        ctypes.CDLL(str(library))
    try:
        import ecospy
    except (ImportError, OSError):
        return None
    return ecospy


_ECOS = """
import json, sys
from %s import ecos
ecospy = ecos()
if ecospy is None:
    sys.exit("ecospy cannot be loaded: pip install ecospy tbb")
order = json.load(open(sys.argv[1]))
structure = ecospy.EcosSimulationStructure()
structure.add_model("fmu", order["fmu"])
with ecospy.EcosSimulation(order["step"], structure=structure) as simulation:
    for name, value in zip(order["names"], order["inputs"][0]):
        simulation.set_real(f"fmu::{name}", value)
    simulation.init()
    rows = [[simulation.get_real(f"fmu::{name}") for name in order["outputs"]]]
    for row in order["inputs"]:
        for name, value in zip(order["names"], row):
            simulation.set_real(f"fmu::{name}", value)
        simulation.step(1)
        rows.append([simulation.get_real(f"fmu::{name}") for name in order["outputs"]])
    json.dump(rows, open(sys.argv[2], "w"))
""" % __name__  # noqa: UP031


_LIBCOSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
order = json.load(open(sys.argv[1]))
execution = CosimExecution.from_step_size(step_size=round(1e9 * order["step"]))
index = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=order["fmu"], instance_name="fmu"))
observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
execution.add_observer(observer=observer)
execution.add_manipulator(manipulator=manipulator)
rows = []
for row in order["inputs"]:
    if order["names"]:
        manipulator.slave_real_values(slave_index=index, variable_references=order["taken"], values=row)
    execution.step()
    rows.append(observer.last_real_values(slave_index=index, variable_references=order["given"]))
json.dump(rows, open(sys.argv[2], "w"))
"""


def through_ecos(fmu: Path, c: Case, folder: Path) -> Outcome:
    """ecos (Open Simulation Platform), through ecospy, in a process of its own."""
    if find_spec("ecospy") is None:
        return Outcome(remark="not installed: pip install ecospy tbb", absent=True)
    return _by_script(_ECOS, fmu, c, folder)


def through_libcosim(fmu: Path, c: Case, folder: Path) -> Outcome:
    """libcosim (Open Simulation Platform), through libcosimpy, in a process of its own."""
    if find_spec("libcosimpy") is None:
        return Outcome(remark="not installed: pip install libcosimpy", absent=True)
    found = _by_script(_LIBCOSIM, fmu, c, folder)
    return found if found.values is None else replace(found, remark="tells no outputs at the start")


def _by_script(script: str, fmu: Path, c: Case, folder: Path) -> Outcome:
    """What a script writes that is told the case in a file and its own in another."""
    order = {
        "fmu": str(fmu.resolve()), "step": STEP, "names": c.names, "outputs": c.outputs, "inputs": c.inputs.tolist(),
        "taken": _references(fmu, c.names), "given": _references(fmu, c.outputs),
    }  # fmt: skip
    (folder / "order.json").write_text(json.dumps(order))
    target = folder / "rows.json"
    command = [sys.executable, "-c", script, str(folder / "order.json"), str(target)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    if not target.exists():
        told = done.stderr.strip().splitlines() or ["no message"]
        return Outcome(remark=f"exit code {done.returncode}: {told[-1]}")
    return Outcome(np.array(json.loads(target.read_text())))


IMPORTERS: dict[str, Callable[[Path, Case, Path], Outcome]] = {
    "FMPy": through_fmpy, "C importer, empty environment": through_c, "ecos": through_ecos,
    "libcosim": through_libcosim,
}  # fmt: skip


def deviation(values: np.ndarray, truth: np.ndarray) -> float:
    """Largest difference of an output relative to its largest value; the start counts where it is told."""
    if len(values) == len(truth) - 1:
        truth = truth[1:]
    if values.shape != truth.shape or not np.isfinite(values).all():
        return math.inf
    size = np.maximum(np.abs(truth).max(axis=0), 1e-12)
    return float((np.abs(values - truth) / size).max())


def cross_check(fmus: Sequence[Path], out: Path) -> dict[str, dict[str, Outcome]]:
    """Run FMUs of this project through all importers; files go to a folder per FMU below `out`."""
    found: dict[str, dict[str, Outcome]] = {}
    for name, count in Counter(fmu.stem for fmu in fmus).items():
        if count > 1:
            raise PackageError(f"{count} FMUs are called {name}, and so would be their files: check one at a time")
    for fmu in fmus:
        if not fmu.is_file():
            raise PackageError(f"{fmu}: no such file")
        c = case(fmu)
        truth = reference(c, fmu)
        folder = out / fmu.stem
        make_folder(folder)
        with replacing(folder / fmu.name) as part:
            shutil.copyfile(fmu, part)
        held = np.concatenate([c.inputs, c.inputs[-1:]])
        _write(folder / f"{fmu.stem}_in.csv", ("time", *c.names), np.column_stack([c.times, held]))
        _write(folder / f"{fmu.stem}_ref.csv", ("time", *c.outputs), np.column_stack([c.times, truth])[::WRITTEN])
        options = (
            f"StartTime, 0\nStopTime, {STOP:g}\nStepSize, {STEP:g}\nRelTol, {TOLERANCE:g}\nOutputIntervalLength, "
            f"{WRITTEN * STEP:g}\n"
        )
        write_together(folder, {f"{fmu.stem}_ref.opt": options, "README.md": _readme(fmu.stem)})
        found[fmu.stem] = {}
        for name, run in IMPORTERS.items():
            with scratch("cross-check") as place:
                try:
                    outcome = run(fmu, c, place)
                except Exception as error:  # whatever an importer says of an FMU that it cannot run
                    outcome = Outcome(remark=f"{type(error).__name__}: {' '.join(str(error).split())}")
            if outcome.values is not None:
                outcome.deviation = deviation(outcome.values, truth)
                file = folder / f"{fmu.stem}_{name.split()[0].lower()}.csv"
                if len(c.times) - len(outcome.values) in (0, 1):
                    first = len(c.times) - len(outcome.values)
                    rows = np.column_stack([c.times[first:], outcome.values])
                    _write(file, ("time", *c.outputs), rows[(WRITTEN - 1) * first :: WRITTEN])
            found[fmu.stem][name] = outcome
    return found


def _write(path: Path, names: Sequence[str], rows: np.ndarray) -> None:
    lines = [",".join(f'"{name}"' for name in names), *(",".join(f"{x!r}" for x in row) for row in rows.tolist())]
    with replacing(path) as part:
        part.write_text("\n".join(lines) + "\n")


def _readme(name: str) -> str:
    return (
        f"# {name}\n\n`{name}_in.csv`: inputs, set at the time of a row and held for {STEP:g} s. `{name}_ref.csv`: "
        f"outputs at the start and after every {WRITTEN} steps, from the model's Python class without FMI. All "
        "parameters have their start values. The other files are what importers made of it.\n\nThe FMU needs Python "
        "with the packages of its `resources/requirements.txt`, unless it was built with `--standalone`.\n"
    )


def table(found: dict[str, dict[str, Outcome]]) -> str:
    """The outcome as a table in Markdown."""
    lines = ["| FMU | importer | runs | max relative deviation | |", "| --- | --- | --- | --- | --- |"]
    for fmu, outcomes in found.items():
        for name, o in outcomes.items():
            runs = "not tried" if o.absent else "no" if o.values is None else "yes" if o.agrees else "differs"
            shown = "" if o.values is None else f"{o.deviation:.1e}"
            lines.append(f"| {fmu} | {name} | {runs} | {shown} | {o.remark} |")
    return "\n".join(lines)


def summary(found: dict[str, dict[str, Outcome]]) -> dict[str, dict[str, dict[str, Any]]]:
    """The outcome for programs, by FMU and importer."""
    return {
        fmu: {
            name: {"tried": not o.absent, "agrees": o.agrees, "deviation": o.deviation, "remark": o.remark}
            for name, o in outcomes.items()
        }
        for fmu, outcomes in found.items()
    }
