"""Checks of a finished FMU: does its description hold to the standard, does it load, initialise and step."""

from __future__ import annotations

import zipfile
from math import prod
from pathlib import Path
from typing import Any

from ..core.errors import PackageError
from ..core.scratch import scratch

STEP = 1e-3
"""Step [s] where the FMU suggests none."""


def faults(fmu: Path) -> list[str]:
    """What is wrong with an FMU, first by its description, then in a short run; empty where nothing is."""
    if fmu.is_dir():
        raise PackageError(f"{fmu}: is a folder; an FMU is a zip archive")
    if not fmu.is_file():
        raise PackageError(f"{fmu}: no such file")
    if not zipfile.is_zipfile(fmu):
        return ["not a zip archive or damaged"]
    with zipfile.ZipFile(fmu) as archive:
        if "modelDescription.xml" not in archive.namelist():
            package = any(name.endswith(".ssd") for name in archive.namelist())
            remedy = f"; a package is checked by: cosim-master {fmu} --check" if package else ""
            return [f"is no FMU: it holds no modelDescription.xml{remedy}"]
    if found := problems(fmu):
        return found
    try:
        exercise(fmu)
    except PackageError as error:
        return [str(error)]
    except Exception as error:
        return [f"does not run: {error}"]
    return []


def exercise(fmu: str | Path, steps: int = 3) -> None:
    """Load the FMU, initialise it with its defaults, take a few steps, read all outputs, put a state back, free it.

    Start and step are those of its DefaultExperiment, else 0 and 1 ms. Raises what goes wrong.
    """
    from fmpy import extract, read_model_description

    description = read_model_description(str(fmu), validate=False)
    if description.coSimulation is None:
        raise PackageError("no FMU for co-simulation")
    told = description.defaultExperiment
    start, end, step = (float(getattr(told, name, None) or 0) for name in ("startTime", "stopTime", "stepSize"))
    step, stop = step or STEP, end if end > start else None
    with scratch("check") as folder:
        slave = _begun(description, extract(str(fmu), str(folder)), start, stop)
        outputs = [v for v in description.modelVariables if v.causality == "output"]
        for k in range(steps):
            slave.doStep(start + k * step, step)
            for variable in outputs:
                _read(slave, description, variable)
        _restore(slave, description)
        slave.terminate()
        slave.freeInstance()


def _begun(description: Any, folder: str, start: float, stop: float | None) -> Any:
    """fmpy's object of the FMU, initialised."""
    from fmpy.fmi1 import FMU1Slave
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    version = description.fmiVersion[0]
    slave = {"1": FMU1Slave, "2": FMU2Slave, "3": FMU3Slave}[version](
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="check",
    )
    slave.instantiate(loggingOn=True)
    if version == "1":
        slave.initialize(tStart=start, stopTime=stop)
        return slave
    if version == "2":
        slave.setupExperiment(startTime=start, stopTime=stop)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(startTime=start, stopTime=stop)
    slave.exitInitializationMode()
    return slave


def _read(slave: Any, description: Any, variable: Any) -> None:
    """Read an output by the function of its type; sizes of arrays are those that they start with."""
    three = description.fmiVersion.startswith("3")
    kind = {"Enumeration": "Int64" if three else "Integer"}.get(variable.type, variable.type)
    if kind == "Clock":
        return
    count = prod(int(d.start if d.start is not None else d.variable.start) for d in variable.dimensions or ())
    try:
        getattr(slave, f"get{kind}")([variable.valueReference], *([count] if three else []))
    except Exception as error:
        raise PackageError(f"reading '{variable.name}' ({variable.type}): {error}") from None


def _restore(slave: Any, description: Any) -> None:
    """Take a state and put it back, where the FMU says that it can."""
    it, state = description.coSimulation, "State" if description.fmiVersion.startswith("3") else "state"
    if getattr(it, "canGetAndSetFMUstate", False):
        kept = getattr(slave, f"getFMU{state}")()
        getattr(slave, f"setFMU{state}")(kept)
        getattr(slave, f"freeFMU{state}")(kept)


def problems(fmu: Path) -> list[str]:
    """What FMPy's validation finds wrong with the FMU."""
    from fmpy.validation import validate_fmu

    return [str(problem) for problem in validate_fmu(str(fmu))]
