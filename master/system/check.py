"""Looks for everything that is wrong with a package, without loading an FMU: schema first, then meaning."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from ...core.errors import CosimError, PackageError, ParameterError
from ...ssp.model import Binding, Component, Linear, SignalDictionaryReference, Type
from ...ssp.model import System as Tree
from ...ssp.wires import Network, Wire, shown_at
from ..algorithms import chosen
from ..coupling.algebraic_loops import loops
from ..engine.program import listed
from ..engine.values import TEXT
from ..options import Options
from ..results.columns import Layout
from ..simulation import stimuli
from ..simulation.plan import check_coupling, check_options, set_substeps, step_remarks
from ..simulation.time_grid import times_of
from ..slaves.base import Slave
from .faults import Faults
from .setup import (
    Value,
    bound_values,
    check_single,
    configure,
    foreign_connectors,
    given_values,
    idle,
    mixed_libraries,
    of_component,
    read_alone,
    read_package,
    resolve,
    with_parameters,
)
from .system import System


@dataclass
class Findings:
    """What was found: errors keep a package from running, warnings do not, notes are worth knowing."""

    errors: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    network: Network | None = None
    system: System | None = None
    incomplete: bool = False
    """Whether parts of the package are not in `network`, for they could not be read or connected."""

    def lines(self) -> list[str]:
        """All of it, a finding a line, the errors first."""
        made = []
        for kind, texts in (("error", self.errors), ("warning", self.warnings), ("note", self.notes)):
            made += [f"{kind}: {text}" for text in dict.fromkeys(texts)]
        return made


def check(package: Path, wanted: Options | None = None) -> Findings:
    """Read a package and everything in it; nothing is raised for what is wrong with it, or with how it is to be run."""
    wanted = wanted or Options()
    found = Findings()
    _try(found, lambda: check_options(wanted))
    method: str | None = None
    before = len(found.errors)
    with ExitStack() as stack:
        network = _try(found, lambda: read_package(package, stack, wanted.variant, found.errors))
        if network is None:
            return found
        parts = found.errors[before:]
        found.incomplete = bool(parts)
        aside = Findings() if parts else found  # what may follow from parts that are missing is not told
        places = {error.partition(": ")[0] for error in parts}
        package_alone = network
        network = _try(aside, lambda: with_parameters(package_alone, wanted.parameters)) or package_alone
        found.network = network
        structure = network.structure
        if not found.errors:
            method = _try(found, lambda: chosen(wanted.method, structure.method))
        if structure.stop_time is not None or wanted.stop_time is not None:
            times = _try(found, lambda: times_of(structure, wanted.stop_time, wanted.step))
        else:
            times = None
            found.notes.append("the package has no stop time; a run needs --stop-time")
        violations = set(network.structure.remarks)
        found.errors += [r for r in network.structure.remarks if r.partition(": ")[0] not in places]
        found.warnings += [r for r in network.remarks if r not in violations]
        slaves: dict[str, Slave] = {}
        for path, part in network.parts.items():
            slave = _try(found, lambda path=path, part=part: of_component(path, part.component))
            if slave is None:
                slave = read_alone(path, part.component)
            if slave is not None:
                slaves[path] = slave
                _connectors(found, part.component, slave, path)
        if len(slaves) == len(network.parts):
            _try(aside, lambda: set_substeps(wanted, slaves))
            if not wanted.isolate:
                _try(found, lambda: check_single(slaves))
                found.warnings += mixed_libraries(slaves)
            if times is not None:
                found.warnings += step_remarks(slaves, *times)
            for path, slave in slaves.items():
                found.warnings += _starts(path, slave)
        own = [c for c in wanted.changes if c[0] in network.inputs or network.connectors.get(c[0])]
        others = [c for c in wanted.changes if c not in own] if len(slaves) == len(network.parts) else []
        network, changes = _try(found, lambda: configure(network, slaves, others)) or (network, others)
        changes = [*own, *changes]
        values: list[Value] = []
        known = [setting for setting in network.settings if setting.component in slaves]
        for _, settings in groupby(known, lambda setting: (setting.where, setting.name)):
            one = Network(network.structure, network.parts, (), (), (), {}, tuple(settings), ())
            values += _try(found, lambda one=one: bound_values(one, slaves, found.warnings.append)) or []
        if len(slaves) == len(network.parts) and slaves:
            system = _try(found, lambda: System(network, slaves, Faults(found.errors)))
            if system is not None:
                found.system = system
                found.warnings += system.remarks
                values += _try(found, lambda: given_values(network, system, found.warnings.append)) or []
                told = Findings() if found.errors else found  # what follows from an error is not told
                layout = _try(told, lambda: Layout(system))
                if layout is not None:
                    _try(aside, lambda: layout.chosen(wanted.record))
                    _try(aside, lambda: layout.chosen(wanted.plot, "--plot"))
                if method is not None:
                    _try(aside, lambda: check_coupling(system, replace(wanted, method=method)))
                for change in changes:
                    values += _try(aside, lambda change=change: resolve([change], slaves, system=system)) or []
                aside.warnings += idle(network, values)
                given = {(v.component, v.variable) for v in values if not v.component}
                _inputs(aside, system, _driven(aside, system, wanted, times) | given)
                _loops(found, system)
        elif not network.parts and not found.errors:
            found.errors.append("the system has no components")
    return found


def _try(found: Findings, make: Callable[[], object]) -> object:
    try:
        return make()
    except CosimError as error:
        found.errors.append(str(error))
        return None


def _connectors(found: Findings, component: Component, slave: Slave, path: str) -> None:
    """Connectors against the FMU's variables: names, kinds and types."""
    found.errors += foreign_connectors(component, slave)
    for c in component.connectors:
        v = slave.variables.get(c.name)
        if v is None:
            continue
        cause = v.causality or "local"
        if c.kind in ("input", "output", "parameter", "calculatedParameter", "structuralParameter") and c.kind != cause:
            found.warnings.append(f"{c.where}: connector '{path}.{c.name}' is of kind {c.kind}, its FMU says {cause}")
        if c.type is not None and not _fits(c.type.kind, v.type):
            found.warnings.append(f"{c.where}: connector '{path}.{c.name}' is {c.type.kind}, its FMU says {v.type}")


def _starts(path: str, slave: Slave) -> list[str]:
    """Start values of the model description that are beyond its own limits."""
    made = []
    for v in slave.description.modelVariables:
        if v.start in (None, "") or v.type not in slave.forms or slave.forms[v.type].family == TEXT or v.dimensions:
            continue
        try:
            slave.checked(v.name, v.start, "")
        except ParameterError as error:
            made.append(f"the model description of '{path}' contradicts itself: {str(error).removeprefix(': ')}")
        except PackageError as error:  # a run may never ask for that limit
            made.append(str(error))
    return made


def _fits(said: str, own: str) -> bool:
    same = {"Real": "Float64", "Integer": "Int32"}
    return same.get(said, said) == same.get(own, own)


def _driven(
    found: Findings, system: System, wanted: Options, times: tuple[float, float, float, int] | None
) -> set[tuple[str, str]]:  # fmt: skip
    """Check what a table drives; the inputs that it drives."""
    if wanted.stimuli is None:
        return set()
    path = wanted.stimuli
    drives = _try(found, lambda: stimuli.read(path, system)) or []
    if times is not None:
        found.warnings += stimuli.remarks(path, drives, system, times[0], times[1])  # type: ignore[arg-type]
    return {(d.signal.component, d.signal.name) for d in drives}  # type: ignore[attr-defined]


def _inputs(found: Findings, system: System, others: set[tuple[str, str]]) -> None:
    driver = system.connections.driver
    driven = {signal.home for end, signal in system.inputs.items() if end in others or driver(end) is not None}
    idle: dict[str, list[str]] = {}
    for (component, name), signal in system.inputs.items():
        if signal.home not in driven:
            idle.setdefault(component, []).append(name)
    for component, names in idle.items():
        if len(names) == 1:
            found.notes.append(f"input '{component}.{names[0]}' is driven by nothing; it keeps its start value")
        else:
            shown = ", ".join(f"'{component}.{name}'" for name in names)
            found.notes.append(f"inputs are driven by nothing and keep their start values: {shown}")
    for name in system.own_inputs:
        if ("", name) not in others:
            found.notes.append(f"the system's input '{name}' is given nothing; what it leads to keeps its start value")


def _loops(found: Findings, system: System) -> None:
    certain = loops(system)
    for loop in certain:
        found.warnings.append(f"algebraic loop: {' -> '.join(loop)}")
    if not certain:
        for loop in loops(system, doubtful=True):
            found.notes.append(
                f"possible algebraic loop, for an FMU does not say what its outputs depend on: {' -> '.join(loop)}"
            )


def tree(network: Network, system: System | None = None) -> str:
    """The system as a tree for people, with its connections."""
    structure = network.structure
    times = f", {structure.start_time:g} s to {structure.stop_time:g} s" if structure.stop_time is not None else ""
    step = f", step {structure.step_size:g} s" if structure.step_size is not None else ""
    lines = [f"{structure.name} (SSP {structure.version}, {structure.file.name}{times}{step})"]
    if len(structure.variants) > 1:
        lines.append(f"variants: {', '.join(structure.variants)}")
    _branch(lines, structure.system, "", network, system)
    lines += ["", "connections"]
    for name, ways in network.connectors.items():
        if "." not in name and name not in network.inputs:  # parameters of the whole system
            for component, variable, hops in ways:
                lines.append(f"  {name} -> {component}.{variable}{_on_the_way(Wire(('', name), ('', ''), hops[1:]))}")
    for wire in (*network.early, *network.wires):
        lines.append(_wire(wire))
    lines += map(_wire, network.outputs)
    return "\n".join(lines)


def _wire(wire: Wire) -> str:
    start, end = (".".join(filter(None, side)) for side in (wire.start, wire.end))
    return f"  {start}{shown_at(wire.start_at)} -> {end}{shown_at(wire.end_at)}{_on_the_way(wire)}"


def _sets(bindings: Iterable[Binding], indent: str) -> list[str]:
    made = []
    for binding in bindings:
        names = [f"{binding.prefix}{p.name} = {_brief(p.value)}{_unit(p.type)}" for p in binding.parameters]
        made.append(f"{indent}sets: {listed(names)}")
    return made


def _unit(type: Type | None) -> str:
    return f" [{type.unit.name}]" if type is not None and type.unit is not None else ""


def _brief(value: object) -> str:
    """A value in a few characters."""
    values = value if isinstance(value, tuple) else (value,)
    shown = [f"{v:g}" if isinstance(v, float) else str(v) for v in values[:4]]
    return " ".join(shown)[:60] + (" ..." if len(values) > 4 else "")


def _on_the_way(wire: Wire) -> str:
    told = []
    for hop in wire.hops:
        t = hop.transformation
        if isinstance(t, Linear):
            told.append(f"{t.factor:g} x {'+' if t.offset >= 0 else '-'} {abs(t.offset):g}")
        elif t is not None:
            told.append(f"{t.kind.lower()}s " + listed([f"{a} -> {b}" for a, b in t.entries.items()]))
        if hop.between:
            told.append(hop.between + _unit(hop.type))
    return f"  ({'; '.join(told)})" if told else ""


def _branch(lines: list[str], tree: Tree, indent: str, network: Network, system: System | None, path: str = "") -> None:
    for kind in dict.fromkeys(c.kind for c in tree.connectors):
        names = [c.name + _unit(c.type) for c in tree.connectors if c.kind == kind]
        lines.append(f"{indent}   {kind}{'' if kind in ('inout', 'unspecified', 'local') else 's'}: {', '.join(names)}")
    lines += _sets(tree.bindings, f"{indent}   ")
    for i, part in enumerate(tree.elements):
        last = i == len(tree.elements) - 1
        stem, more = ("└─ ", "   ") if last else ("├─ ", "│  ")
        if isinstance(part, Component):
            lines.append(f"{indent}{stem}{part.name}: {_about(part, f'{path}{part.name}', system)}")
            lines += _sets(part.bindings, f"{indent}{more}   ")
        elif isinstance(part, SignalDictionaryReference):
            lines.append(f"{indent}{stem}{part.name}: signal dictionary {part.dictionary}")
        else:
            lines.append(f"{indent}{stem}{part.name}: system")
            _branch(lines, part, indent + more, network, system, f"{path}{part.name}.")


def _about(element: Component, path: str, system: System | None) -> str:
    if system is None:
        return element.source.name
    slave = system.slaves[path]
    counts: dict[str, int] = {}
    for v in slave.variables.values():
        counts[v.causality or "local"] = counts.get(v.causality or "local", 0) + 1
    known = ("input", "output", "parameter", "calculatedParameter", "structuralParameter")
    kinds = [f"{counts[k]} {k}{'s' if counts[k] > 1 else ''}" for k in known if k in counts]
    return f"{element.source.name} (FMI {slave.version}; {', '.join(kinds)})"
