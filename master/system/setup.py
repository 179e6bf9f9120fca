"""From a package to a system of slaves that is ready to run: descriptions, connections, values.

Everything that can be wrong with a package is found here before anything is loaded.
"""

from __future__ import annotations

import filecmp
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...core.errors import CosimError, PackageError, ParameterError, UnknownNameError, UsageError, did_you_mean
from ...ssp.model import Component, Table
from ...ssp.network import flatten
from ...ssp.parameters import read_set
from ...ssp.reader import read
from ...ssp.wires import Hop, Network, Setting
from ..engine.values import TEXT
from ..slaves.base import Log, Slave
from ..slaves.fmu import also_forget, describe, platform_folder
from .sizes import Extent, check_sizes, stated
from .system import System
from .value_conversion import Quantity, between, converted, parsed


@dataclass(frozen=True)
class Value:
    """A checked value, in the variable's type and unit; component '' is an input of the whole system."""

    component: str
    variable: str
    value: Any
    where: str


def split(address: str, slaves: Mapping[str, Any]) -> tuple[str, str]:
    """(component, name) of an address; component names may hold dots, so the longest counts. ('', address) if none."""
    return max(splits(address, slaves), key=lambda found: len(found[0]), default=("", address))


def splits(address: str, slaves: Iterable[str]) -> list[tuple[str, str]]:
    """Every (component, name) that an address may mean."""
    begins = [c for c in slaves if address.startswith(f"{c}.") and len(address) > len(c) + 1]
    return [(c, address[len(c) + 1 :]) for c in begins]


def targets(address: str, slaves: Mapping[str, Slave], system: System | None = None) -> list[tuple[str, str]]:
    """(component, variable) of all that an address means: a bare name, every component's that has it to be set.

    With `system`, the name of one of its own inputs means that input, of component ''.
    """
    if system is not None and address in system.own_inputs:
        return [("", address)]
    if system is not None and address in system.network.connectors:
        return [(component, name) for component, name, _ in system.network.connectors[address]]
    component, name = split(address, slaves)
    if component:
        return [(component, name)]
    return [(c, address) for c, slave in slaves.items() if slave.settable(address)]


def resolve(
    changes: Iterable[tuple[str, Any]],
    slaves: Mapping[str, Slave],
    prefix: str = "--set ",
    system: System | None = None,
) -> list[Value]:
    """Checked values of (address, value) pairs; a bare name applies to every component that has it.

    With `system`, the name of one of its own inputs means that input.
    """
    made = []
    for address, value in changes if system is None else expanded(changes, system.network, slaves, prefix):
        where = f"{prefix}{address}={value}"
        meant = targets(address, slaves, system)
        if not meant:
            known = [(c, n) for c, slave in slaves.items() for n in slave.variables if slave.settable(n)]
            hint = did_you_mean(address, [f"{c}.{n}" for c, n in known] + sorted({n for _, n in known}))
            raise UnknownNameError(f"{where}: no component has a parameter '{address}'{hint}")
        for component, name in meant:
            if component:
                made.append(_checked(slaves[component], name, value, where))
            elif system is not None:
                made.append(_own(system, name, value, where))
    return made


def expanded(
    changes: Iterable[tuple[str, Any]], network: Network, slaves: Mapping[str, Slave], prefix: str = "--set "
) -> Iterator[tuple[str, Any]]:
    """The changes with those of connectors of systems replaced by what these lead to."""
    for address, value in changes:
        if address in network.inputs or not network.connectors.get(address):
            yield address, value
            continue
        for component, name, hops in network.connectors[address]:
            slave, reached = slaves[component], value
            where = f"{prefix}{address}={value}"
            slave.variable(name)
            at = between(hops[0]) if hops else None
            if at is not None or any(hop.transformation is not None for hop in hops):
                target = _target(network, slave, name)
                tables = (h.transformation for h in hops if isinstance(h.transformation, Table))
                named = next((table.entries for table in tables if table.kind == "Enumeration"), None)
                known_items = target.items if named is None else None
                if named is None and at is not None:
                    at = replace(at, unit=None, items=at.items or known_items)
                    parts = _parts(value, bool(slave.variables[name].dimensions) and at.family != TEXT)
                    values = [parsed(part, at, at.shown, where) for part in parts]
                    given = tuple(values) if len(values) > 1 or slave.variables[name].dimensions else values[0]
                elif named is None:
                    given = slave.checked(name, value, where, limited=False)
                elif (given := _item(hops, value)) not in {**named, **(target.items or {})}:  # mapped by its name
                    known = ", ".join(map(str, named))
                    raise UsageError(f"{where}: '{address}' is mapped by the names of its items: {known}")
                kind = target.type if named is None else "Enumeration"
                source = at if named is None and at is not None else Quantity(kind, None, known_items)
                reached = converted(given, source, hops, target, where)
            yield f"{component}.{name}", reached


def _parts(value: Any, is_array: bool) -> Sequence[Any]:
    """The values of an array, which a text has one after the other."""
    if isinstance(value, str) and is_array:
        return value.replace(",", " ").split()
    return value if isinstance(value, (tuple, list)) else (value,)


def _item(hops: Sequence[Hop], value: Any) -> str:
    """The name of an item of the connector where the hops begin; it may be given by its number."""
    numbers = {str(number): name for name, number in (hops[0].enumeration or {}).items()}
    return numbers.get(str(value), str(value))


def _checked(slave: Slave, name: str, value: Any, where: str) -> Value:
    if not slave.settable(name):
        if name in slave.variables:
            raise UnknownNameError(_not_settable(slave, name, where))
        known = [n for n in slave.variables if slave.settable(n)]
        hint = did_you_mean(name, known)
        raise UnknownNameError(f"{where}: component '{slave.name}' has no parameter '{name}'{hint}")
    return Value(slave.name, name, slave.checked(name, value, where), where)


def _not_settable(slave: Slave, name: str, where: str) -> str:
    v = slave.variables[name]
    kind = f"its causality is '{v.causality}', its variability '{v.variability}'"
    return f"{where}: '{slave.name}.{name}' cannot be set: {kind}"


HINTS = 5
"""Names without a variable for which a similar one is looked for: a set of parameters may be meant for many FMUs."""


def bound_values(
    network: Network, slaves: Mapping[str, Slave], remark: Callable[[str], None] = lambda _: None
) -> list[Value]:
    """Values of the package's parameter bindings, in the variables' units. What cannot be set is remarked."""
    made: list[Value] = []
    hints = HINTS
    found = {(s.where, s.name) for s in network.settings if s.variable in slaves[s.component].variables}
    for s in network.settings:
        slave = slaves[s.component]
        if s.variable not in slave.variables:
            if s.name and (s.where, s.name) in found:
                continue  # the name means another variable
            hint = did_you_mean(s.variable, [n for n in slave.variables if slave.settable(n)]) if hints > 0 else ""
            hints -= 1
            remark(f"{s.where}: component '{s.component}' has no variable '{s.variable}'; the value is ignored{hint}")
            continue
        if s.variable in slave.variables and slave.variables[s.variable].type not in slave.forms:
            kind = slave.variables[s.variable].type
            raise ParameterError(f"{s.where}: '{s.component}.{s.variable}': type {kind} is not supported")
        if not slave.settable(s.variable):
            remark(f"{_not_settable(slave, s.variable, s.where)}; the value is ignored")
            continue
        target = _target(network, slave, s.variable)
        given, size = stated(s.type, f"the value of '{s.name or s.variable}'"), slave.size(s.variable)
        if given is not None and given.count == size:
            check_sizes(given, s.hops, Extent(target.shown, size, slave.shape(s.variable)), s.where)
        value = converted(s.value, _quantity(s), s.hops, target, s.where, remark)
        made.append(_checked(slave, s.variable, value, s.where))
    return made


def idle(network: Network, values: Iterable[Value]) -> list[str]:
    """Remarks on inputs at the end of ways that nothing drives and that have not been given a value."""
    given = {(v.component, v.variable) for v in values}
    return [told for end, told in network.idle.items() if end not in given]


def _target(network: Network, slave: Slave, name: str) -> Quantity:
    """What a component's variable is; a unit that its connector states counts before the FMU's."""
    connectors = network.parts[slave.name].component.connectors
    type = next((c.type for c in connectors if c.name == name), None)
    unit = slave.meant(type.unit if type is not None else None, name)
    shown = f"'{slave.name}.{name}'"
    return Quantity(slave.variables[name].type, unit, slave.items(name), shown, slave.relative(name))


def _quantity(s: Setting) -> Quantity:
    return Quantity(s.type.kind, s.type.unit, s.type.enumeration, f"'{s.variable}'")


def given_values(
    network: Network, system: System, remark: Callable[[str], None] = lambda _: None
) -> list[Value]:
    """Values that the package binds to inputs of the whole system."""
    made = []
    for s in network.given:
        value = converted(s.value, _quantity(s), s.hops, system.quantities.input_quantity(s.variable), s.where, remark)
        made.append(_own(system, s.variable, value, s.where))
    return made


def _own(system: System, name: str, value: Any, where: str) -> Value:
    """The checked value of an input of the whole system."""
    checked = system.values.checked_input(name, value, where)
    system.values.check_reached(name, checked, where)
    return Value("", name, checked, where)


def read_package(
    package: Path, stack: ExitStack, variant: str | None = None, wrong: list[str] | None = None
) -> Network:  # fmt: skip
    """The network of an SSP file, unpacked into a folder that lives as long as `stack`.

    With a list `wrong`, what is wrong with some of its parts goes there instead of being raised.
    """
    scratch = stack.enter_context(tempfile.TemporaryDirectory(prefix="cosim_", ignore_cleanup_errors=True))
    stack.callback(also_forget(Path(scratch)))
    return flatten(read(package, Path(scratch) / "ssp", variant, wrong), causality, wrong)


def causality(component: Component, name: str) -> str | None:
    """What a component's FMU says of a variable; None where it has no such variable or cannot be read."""
    try:
        variable = describe(component.name, component.source, library=False).variables.get(name)
    except CosimError:  # told where all FMUs are read
        return None
    return variable.causality if variable is not None else None


def with_parameters(network: Network, files: Iterable[Path]) -> Network:
    """The network with parameter sets (.ssv) of the user's, named like --set, which win over the package's bindings."""
    settings, given, remarks = list(network.settings), list(network.given), list(network.remarks)
    for file in files:
        for p in read_set(file, remarks.append):
            if p.name in network.inputs:
                given.append(Setting("", p.name, p.value, p.type, (), p.where))
                continue
            if network.connectors.get(p.name):
                settings += [Setting(c, v, p.value, p.type, h, p.where) for c, v, h in network.connectors[p.name]]
                continue
            meant = splits(p.name, network.parts)
            if not meant:
                hint = did_you_mean(p.name.partition(".")[0], list(network.parts))
                raise UnknownNameError(f"{p.where}: '{p.name}' names no component of the package{hint}")
            settings += [Setting(c, v, p.value, p.type, (), p.where, p.name) for c, v in meant]
    return replace(network, settings=tuple(settings), given=tuple(given), remarks=tuple(remarks))


def load_slaves(slaves: Mapping[str, Slave], stack: ExitStack, log: Log) -> None:
    """Instantiate all slaves; `stack` frees them. A slave keeps its own messages, `log` gets those of all."""

    def on_log(component: str, status: str, text: str) -> None:
        if component in slaves:
            slaves[component].take(status, text)
        log(component, status, text)

    for slave in slaves.values():
        stack.callback(slave.free)
        slave.load(on_log)


def of_component(path: str, component: Component) -> Slave:
    """The slave of a component; what is wrong with its FMU is told with the place that asks for it."""
    try:
        return describe(path, component.source)
    except PackageError as error:
        text = str(error).replace(str(component.source), component.source.name)
        raise PackageError(f"{component.where}: component '{path}': {text}") from None


def read_alone(path: str, component: Component) -> Slave | None:
    """The slave of a component whose FMU may lack a library for this platform, to look at; None if it is unreadable."""
    try:
        return describe(path, component.source, library=False)
    except CosimError:
        return None


def foreign_connectors(component: Component, slave: Slave) -> Iterator[str]:
    """What is wrong with the connectors that a component has and its FMU has not."""
    for connector in component.connectors:
        if connector.name not in slave.variables:
            yield (
                f"{connector.where}: component '{slave.name}' has a connector '{connector.name}' that its FMU does not "
                f"have{did_you_mean(connector.name, sorted(slave.variables))}"
            )


def load_descriptions(network: Network) -> dict[str, Slave]:
    """Slaves by component path, not loaded yet, from the package's FMUs."""
    slaves: dict[str, Slave] = {}
    for path, part in network.parts.items():
        component = part.component
        slave = of_component(path, component)
        for fault in foreign_connectors(component, slave):
            raise PackageError(fault)
        slaves[path] = slave
    if not slaves:
        raise PackageError("the system has no components")
    return slaves


def check_single(slaves: Mapping[str, Slave]) -> None:
    """FMUs that can be instantiated only once per process are there only once."""
    single: dict[Path, str] = {}
    for path, slave in slaves.items():
        once = getattr(slave.description.coSimulation, "canBeInstantiatedOnlyOncePerProcess", False)
        if once and slave.folder in single:
            raise PackageError(
                f"components '{single[slave.folder]}' and '{path}' are the same FMU, which can be instantiated only "
                "once per process; --isolate gives each a process of its own"
            )
        single[slave.folder] = path


def mixed_libraries(slaves: Mapping[str, Slave]) -> Iterator[str]:
    """Libraries beside those of the FMUs that have one name and different contents: a process loads the first only."""
    first: dict[str, tuple[str, Path]] = {}
    folders: dict[Path, str] = {}
    for path, slave in slaves.items():
        folders.setdefault(slave.folder, path)
    for folder, path in folders.items():
        own = slaves[path].description.coSimulation.modelIdentifier
        for file in sorted((folder / "binaries" / platform_folder(slaves[path].version)).glob("*")):
            if file.stem == own or not file.is_file() or not re.search(r"\.(so|dll|dylib)(\.|$)", file.name):
                continue
            other, twin = first.setdefault(file.name, (path, file))
            if not filecmp.cmp(file, twin, shallow=False):
                yield (
                    f"components '{path}' and '{other}' bring different libraries '{file.name}', and one process uses "
                    "the same for both: --isolate keeps them apart"
                )


def configure(
    network: Network, slaves: Mapping[str, Slave], changes: Iterable[tuple[str, Any]] = ()
) -> tuple[Network, list[tuple[str, Any]]]:
    """Hand structural parameters to the slaves, before sizes are asked for; what the network and the changes have left.

    They have to come before all others, for arrays are checked against the sizes they give.
    """

    def structural(component: str, name: str) -> bool:
        slave = slaves.get(component)
        variable = slave.variables.get(name) if slave is not None else None
        return variable is not None and variable.causality == "structuralParameter"

    sizes = [s for s in network.settings if structural(s.component, s.variable)]
    values = bound_values(replace(network, settings=tuple(sizes)), slaves)
    left = []
    for address, value in changes:
        component, name = split(address, slaves)
        if any(structural(c, name) for c in ([component] if component else slaves)):
            found = resolve([(address, value)], slaves)
            values += [v for v in found if structural(v.component, v.variable)]
            left += [(f"{v.component}.{v.variable}", value) for v in found if not structural(v.component, v.variable)]
        else:
            left.append((address, value))
    for v in values:
        slaves[v.component].configure(v.variable, v.value)
    others = [s for s in network.settings if not structural(s.component, s.variable)]
    return replace(network, settings=tuple(_in_force(others, slaves, left))), left


def _in_force(
    settings: Sequence[Setting], slaves: Mapping[str, Slave], changes: Iterable[tuple[str, Any]]
) -> Iterator[Setting]:
    """The settings without those of arrays that others win over, which may be of a size that is not theirs any more."""
    changed = {split(address, slaves) for address, _ in changes}
    winning = {(s.component, s.variable): s for s in settings}
    for s in settings:
        end = s.component, s.variable
        variable = slaves[s.component].variables.get(s.variable) if s.component in slaves else None
        if variable is None or not variable.dimensions or (winning[end] is s and end not in changed):
            yield s
