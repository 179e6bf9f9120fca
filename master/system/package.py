"""A package as a network of components, unpacked into a folder of its own."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from ...core.errors import PackageError, UnknownNameError, UsageError, did_you_mean
from ...core.scratch import scratch
from ...core.units import Unit
from ...ssp.flat_system import BoundParameter, FlatSystem
from ...ssp.flatten import flatten
from ...ssp.model import Component, Connection, Connector, LinearFunction, System, SystemStructure
from ...ssp.osp import OSP_FILE, read_osp
from ...ssp.parameters import read_set
from ...ssp.reader import read, read_folder
from ..slaves.base import FmuInstance
from ..slaves.fmu import describe
from .addresses import splits
from .instances import read_alone


def read_package(
    package: Path, stack: ExitStack, variant: str | None = None, errors: list[str] | None = None
) -> FlatSystem:  # fmt: skip
    """The network of an SSP file, a folder like one, a system structure description (.ssd), an FMU or a system
    structure of the Open Simulation Platform (.xml, or a folder that holds one).

    What has to be unpacked lives as long as `stack`. With a list `errors`, what is wrong with some of its parts goes
    there instead of being raised.
    """
    place = stack.enter_context(scratch("package"))
    fmus = _Fmus()
    return flatten(_structure(package, place, variant, errors, fmus), fmus.causality, errors)


def _structure(
    package: Path, place: Path, variant: str | None, errors: list[str] | None, fmus: _Fmus
) -> SystemStructure:  # fmt: skip
    kind = package.suffix.lower()
    if package.is_dir() and not any(package.glob("*.ssd")) and (package / OSP_FILE).is_file():
        package, kind = package / OSP_FILE, ".xml"
    if kind == ".xml":
        if variant is not None:
            raise UsageError(f"--variant {variant}: {package.name} is one system structure")
        return read_osp(package, fmus, errors)
    if package.is_dir():
        return read_folder(package, place, variant, errors)
    if kind == ".ssd":
        if variant is not None:
            raise UsageError(f"--variant {variant}: {package.name} is one description; give the folder or the package")
        return read_folder(package.parent, place, package.name, errors)
    if kind == ".fmu":
        return alone(package)
    return read(package, place / "ssp", variant, errors)


def alone(fmu: Path) -> SystemStructure:
    """A system of one FMU, whose inputs are the system's, with the times that it suggests."""
    try:
        instance = describe(fmu.stem, fmu)
    except PackageError as error:
        raise PackageError(str(error).replace(fmu.name, str(fmu), 1)) from None
    inputs = [v.name for v in instance.variables.values() if v.causality == "input" and v.type in instance.types]
    links = tuple(Connection((None, name), (fmu.stem, name), where=fmu.name) for name in inputs)
    connectors = tuple(Connector(name, "input", None, where=fmu.name) for name in inputs)
    component = Component(fmu.stem, fmu, connectors=connectors, where=fmu.name)
    start, stop = instance.suggested("startTime"), instance.suggested("stopTime")
    system = System(fmu.stem, connectors, (component,), links, where=fmu.name)
    return SystemStructure(fmu.stem, "", fmu, system, start or 0.0, stop)


class _Fmus:
    """What FMUs say while a package is read, each looked at once; nothing of those that cannot be read, which is told
    where all are."""

    def __init__(self) -> None:
        self._known: dict[tuple[Path, LinearFunction | None], FmuInstance | None] = {}

    def _instance(self, component: Component) -> FmuInstance | None:
        key = component.source, component.function
        if key not in self._known:
            self._known[key] = read_alone(component.name, component)
        return self._known[key]

    def causality(self, component: Component, name: str) -> str | None:
        """What a component's FMU says of a variable; None where it has no such variable."""
        instance = self._instance(component)
        variable = instance.variables.get(name) if instance is not None else None
        return variable.causality if variable is not None else None

    def model_name(self, source: Path) -> str | None:
        """Name of the model."""
        instance = self._instance(Component(source.stem, source))
        return instance.description.modelName if instance is not None else None

    def variable(self, source: Path, name: str) -> tuple[str | None, Unit | None] | None:
        """Causality and unit of a variable; None where there is none."""
        instance = self._instance(Component(source.stem, source))
        if instance is None or name not in instance.variables:
            return None
        return instance.variables[name].causality, instance.unit(name)


def with_parameters(network: FlatSystem, files: Iterable[Path]) -> FlatSystem:
    """The network with parameter sets (.ssv) of the user's, named like --set, which win over the package's bindings."""
    bound_parameters, bound_inputs, remarks = (
        list(network.bound_parameters),
        list(network.bound_inputs),
        list(network.remarks),
    )
    for file in files:
        for p in read_set(file, remarks.append):
            if p.name in network.inputs:
                bound_inputs.append(BoundParameter("", p.name, p.value, p.type, (), p.where, by_user=True))
                continue
            if network.connectors.get(p.name):
                reached = network.connectors[p.name]
                bound_parameters += [
                    BoundParameter(c, v, p.value, p.type, h, p.where, by_user=True) for c, v, h in reached
                ]
                continue
            meant = splits(p.name, network.components)
            if not meant:
                hint = did_you_mean(p.name.partition(".")[0], list(network.components))
                raise UnknownNameError(f"{p.where}: '{p.name}' names no component of the package{hint}")
            bound_parameters += [
                BoundParameter(c, v, p.value, p.type, (), p.where, p.name, by_user=True) for c, v in meant
            ]
    return replace(
        network, bound_parameters=tuple(bound_parameters), bound_inputs=tuple(bound_inputs), remarks=tuple(remarks)
    )
