"""From an extracted package to a system of slaves that is ready to run: descriptions, values, initialisation.

Everything that can be wrong with values is found here before anything is loaded.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..core.errors import PackageError, SimulationError, UnknownNameError, did_you_mean
from ..ssp.archive import extract
from ..ssp.model import SystemStructure
from .slave import Slave
from .system import System

Value = tuple[str, str, Any, str]
"""(component, variable, value in the variable's type, where it was given)."""


def resolve(changes: Iterable[tuple[str, Any]], slaves: Mapping[str, Slave], prefix: str = "--set ") -> list[Value]:
    """Checked values of (address, value) pairs; a bare name applies to every component that has it."""
    made = []
    for address, value in changes:
        where = f"{prefix}{address}={value}"
        component, _, name = address.partition(".")
        if component in slaves and name:
            targets = [(component, name)]
        else:
            targets = [(c, address) for c, slave in slaves.items() if settable(slave, address)]
            if not targets:
                known = [f"{c}.{n}" for c, slave in slaves.items() for n in slave.variables if settable(slave, n)]
                hint = did_you_mean(address, known)
                raise UnknownNameError(f"{where}: no component has a parameter '{address}'{hint}")
        for component, name in targets:
            made.append(_checked(slaves[component], name, value, where))
    return made


def settable(slave: Slave, name: str) -> bool:
    variable = slave.variables.get(name)
    return variable is not None and (variable.causality in ("parameter", "input") or variable.initial == "exact")


def _checked(slave: Slave, name: str, value: Any, where: str) -> Value:
    if not settable(slave, name):
        known = [n for n in slave.variables if settable(slave, n)]
        hint = did_you_mean(name, known)
        raise UnknownNameError(f"{where}: component '{slave.name}' has no parameter '{name}'{hint}")
    return slave.name, name, slave.checked(name, value, where), where


def bound_values(structure: SystemStructure, slaves: Mapping[str, Slave]) -> list[Value]:
    """Values of the package's parameter bindings: those of a component first, those of the system override them."""
    made = []
    for component in structure.components:
        for p in component.parameters:
            made.append(_checked(slaves[component.name], p.name, p.value, p.where))
    for p in structure.parameters:
        component, _, name = p.name.partition(".")
        if component not in slaves or not name:
            known = [f"{c}.{n}" for c, slave in slaves.items() for n in slave.variables]
            raise UnknownNameError(f"{p.where}: no component for parameter '{p.name}'{did_you_mean(p.name, known)}")
        made.append(_checked(slaves[component], name, p.value, p.where))
    return made


def load_descriptions(structure: SystemStructure, scratch: Path) -> dict[str, Slave]:
    """Slaves by component name, not loaded yet, from the package's FMUs unpacked into `scratch`."""
    from fmpy import read_model_description

    slaves: dict[str, Slave] = {}
    unpacked: dict[str, Path] = {}
    for component in structure.components:
        if component.source not in unpacked:
            unpacked[component.source] = extract(
                structure.folder / component.source, scratch / f"fmu{len(unpacked)}_{_plain(component.name)}"
            )
        folder = unpacked[component.source]
        try:
            description = read_model_description(str(folder), validate=False)
        except Exception as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise PackageError(f"{component.source}: modelDescription.xml cannot be read ({reason})") from None
        if description.fmiVersion != "2.0":
            raise PackageError(f"{component.source}: FMI {description.fmiVersion} is not supported yet, only 2.0")
        if description.coSimulation is None:
            raise PackageError(f"{component.source}: has no co-simulation interface")
        slaves[component.name] = Slave(component.name, folder, description)
    if not slaves:
        raise PackageError("the system has no components")
    return slaves


def _plain(name: str) -> str:
    return re.sub(r"\W", "_", name)


def initialise(system: System, values: Iterable[Value], start: float, stop: float) -> None:
    """Set start values, run the initialisation mode, and leave all signals in agreement at the start."""
    for component, name, value, where in values:
        try:
            system.slaves[component].set_start(name, value)
        except SimulationError as error:
            raise SimulationError(f"{where}: {error}") from None
        if system.slaves[component].variables[name].causality == "input":
            system.set_input(component, name, value)
    for slave in system.slaves.values():
        slave.initialise_begin(start, stop)
    system.propagate()
    for slave in system.slaves.values():
        slave.initialise_end()
    system.sweep(system.order)
