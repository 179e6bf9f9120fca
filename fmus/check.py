"""Checks of a finished FMU: does its description hold to the standard, does it load, initialise and step."""

from __future__ import annotations

import zipfile
from pathlib import Path

from ..core.errors import PackageError


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


def exercise(fmu: str | Path, steps: int = 3, step: float = 1e-3) -> None:
    """Load the FMU, initialise it with its defaults, take a few steps, free it. Raises what goes wrong."""
    import shutil

    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    description = read_model_description(str(fmu), validate=False)
    if description.coSimulation is None or description.fmiVersion[:1] not in ("2", "3"):
        raise PackageError(f"{fmu}: no FMU for co-simulation of FMI 2.0 or 3.0")
    three = description.fmiVersion.startswith("3")
    folder = extract(str(fmu))
    try:
        slave = (FMU3Slave if three else FMU2Slave)(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="check",
        )
        slave.instantiate(loggingOn=True)
        if not three:
            slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        references = [v.valueReference for v in description.modelVariables if v.causality == "output"]
        read = slave.getFloat64 if three else slave.getReal
        get, put, drop = (
            getattr(slave, f"{verb}FMU{'State' if three else 'state'}") for verb in ("get", "set", "free")
        )
        for k in range(steps):
            slave.doStep(k * step, step)
            read(references)
        state = get()
        put(state)
        drop(state)
        slave.terminate()
        slave.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def problems(fmu: Path) -> list[str]:
    """What FMPy's validation finds wrong with the FMU."""
    from fmpy.validation import validate_fmu

    return [str(problem) for problem in validate_fmu(str(fmu))]
