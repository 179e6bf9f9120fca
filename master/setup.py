"""From an extracted package to a system of slaves that is ready to run: descriptions, values, initialisation.

Everything that can be wrong with values is found here before anything is loaded.
"""

from __future__ import annotations

import atexit
import hashlib
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ..core.errors import PackageError, ParameterError, SimulationError, UnknownNameError, UsageError, did_you_mean
from ..core.units import convert
from ..ssp.archive import extract
from ..ssp.model import Parameter, SystemStructure
from ..ssp.reader import read
from .slave import Slave
from .system import KINDS, System

Value = tuple[str, str, Any, str]
"""(component, variable, value in the variable's type, where it was given)."""


def split(address: str, slaves: Mapping[str, Slave]) -> tuple[str, str]:
    """(component, name) of an address; component names may hold dots, so the longest counts. ('', address) if none."""
    for component in sorted(slaves, key=len, reverse=True):
        if address.startswith(f"{component}.") and len(address) > len(component) + 1:
            return component, address[len(component) + 1 :]
    return "", address


def resolve(changes: Iterable[tuple[str, Any]], slaves: Mapping[str, Slave], prefix: str = "--set ") -> list[Value]:
    """Checked values of (address, value) pairs; a bare name applies to every component that has it."""
    made = []
    for address, value in changes:
        where = f"{prefix}{address}={value}"
        component, name = split(address, slaves)
        if component:
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


def _in_unit_of(slave: Slave, p: Parameter, name: str) -> Any:
    """The value of a package's parameter in the unit of the FMU's variable."""
    own = slave.unit(name) if name in slave.variables else None
    if p.unit is None or own is None or p.unit == own:
        return p.value
    try:
        return convert(p.value, p.unit, own)
    except UsageError as error:
        raise ParameterError(f"{p.where}: {slave.name}.{name}: {error}") from None


def bound_values(structure: SystemStructure, slaves: Mapping[str, Slave]) -> list[Value]:
    """Values of the package's parameter bindings: those of a component first, those of the system override them."""
    made = []
    for component in structure.components:
        for p in component.parameters:
            slave = slaves[component.name]
            made.append(_checked(slave, p.name, _in_unit_of(slave, p, p.name), p.where))
    for p in structure.parameters:
        component, name = split(p.name, slaves)
        if not component:
            known = [f"{c}.{n}" for c, slave in slaves.items() for n in slave.variables]
            raise UnknownNameError(f"{p.where}: no component for parameter '{p.name}'{did_you_mean(p.name, known)}")
        made.append(_checked(slaves[component], name, _in_unit_of(slaves[component], p, name), p.where))
    return made


_unpacked: dict[str, Path] = {}
"""Where this process has unpacked FMUs, by the hash of their content."""


def unpack(fmu: Path) -> Path:
    """Unpack an FMU once per process and content, and return its folder.

    A library that is loaded from ever new places stays in memory each time (many libraries cannot be unloaded), so a
    process that runs a package a thousand times would grow. `forget_unpacked` removes the folders.
    """
    content = hashlib.sha256(fmu.read_bytes()).hexdigest()
    if content not in _unpacked or not _unpacked[content].is_dir():
        folder = Path(tempfile.mkdtemp(prefix=f"fmu_{_plain(fmu.stem)}_"))
        try:
            extract(fmu, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        _unpacked[content] = folder
    return _unpacked[content]


@atexit.register
def forget_unpacked() -> None:
    """Remove the folders of unpacked FMUs; called when Python shuts down, and by whoever ends the process sooner."""
    while _unpacked:
        shutil.rmtree(_unpacked.popitem()[1], ignore_errors=True)


def read_package(package: Path, stack: ExitStack) -> SystemStructure:
    """Read an SSP file unpacked into a folder that lives as long as `stack`."""
    scratch = stack.enter_context(tempfile.TemporaryDirectory(prefix="cosim_", ignore_cleanup_errors=True))
    return read(package, Path(scratch) / "ssp")


def load_slaves(slaves: Mapping[str, Slave], stack: ExitStack, log: Callable[[str, str, str], None]) -> None:
    """Instantiate all slaves; `stack` frees them. A slave keeps its own messages, `log` gets those of all."""

    def on_log(component: str, status: str, text: str) -> None:
        if component in slaves:
            slaves[component].messages.append((status, text))
        log(component, status, text)

    for slave in slaves.values():
        stack.callback(slave.free)
        slave.load(on_log)


def _fmi_version(path: Path, shown: str) -> str:
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    try:
        return etree.parse(str(path), parser).getroot().get("fmiVersion", "?")
    except OSError:
        raise PackageError(f"{shown}: holds no modelDescription.xml") from None
    except etree.XMLSyntaxError as error:
        raise PackageError(f"{shown}: modelDescription.xml is not well-formed ({error.msg})") from None


def load_descriptions(structure: SystemStructure) -> dict[str, Slave]:
    """Slaves by component name, not loaded yet, from the package's FMUs."""
    from fmpy import read_model_description

    slaves: dict[str, Slave] = {}
    for component in structure.components:
        folder = unpack(structure.folder / component.source)
        version = _fmi_version(folder / "modelDescription.xml", component.source)
        if version != "2.0":
            raise PackageError(f"{component.source}: FMI {version} is not supported yet, only 2.0")
        try:
            description = read_model_description(str(folder), validate=False)
        except Exception as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise PackageError(f"{component.source}: modelDescription.xml cannot be read ({reason})") from None
        if description.coSimulation is None:
            raise PackageError(f"{component.source}: has no co-simulation interface")
        known = {v.name for v in description.modelVariables}
        for connector in component.connectors:
            if connector.name not in known:
                hint = did_you_mean(connector.name, sorted(known))
                raise PackageError(
                    f"SystemStructure.ssd, line {component.line}: component '{component.name}' has a connector "
                    f"'{connector.name}' that its FMU does not have{hint}"
                )
        slaves[component.name] = Slave(component.name, folder, description)
    if not slaves:
        raise PackageError("the system has no components")
    return slaves


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "_", name)[:40]


def check_connections(structure: SystemStructure, slaves: Mapping[str, Slave]) -> None:
    """Raise `PackageError` for a connection that dangles, drives an input twice, or joins units that differ."""
    driven: dict[tuple[str, str], int] = {}
    for c in structure.connections:
        where = f"SystemStructure.ssd, line {c.line}"
        ends = []
        for (component, connector), causality in ((c.start, "output"), (c.end, "input")):
            if component not in slaves:
                raise PackageError(f"{where}: there is no component '{component}'")
            variable = slaves[component].variables.get(connector)
            if variable is None:
                raise PackageError(f"{where}: component '{component}' has no variable '{connector}'")
            if variable.causality != causality:
                raise PackageError(
                    f"{where}: '{component}.{connector}' is not an {causality}, its causality is "
                    f"'{variable.causality}'"
                )
            if variable.type not in KINDS:
                raise PackageError(f"{where}: '{component}.{connector}': type {variable.type} is not supported yet")
            ends.append(slaves[component].unit(connector))
        if c.end in driven:
            line = driven[c.end]
            end = ".".join(c.end)
            raise PackageError(f"{where}: input '{end}' is already driven by the connection in line {line}")
        driven[c.end] = c.line
        if None not in ends and ends[0] != ends[1]:
            raise PackageError(
                f"{where}: '{'.'.join(c.start)}' is in {ends[0]} and '{'.'.join(c.end)}' in {ends[1]}; "
                "unit conversion is not supported yet"
            )


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
