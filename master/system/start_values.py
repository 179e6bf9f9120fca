"""Start values and parameters: what the package binds and what the user changes, in the variables' units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from ...core.errors import ParameterError, UnknownNameError, UsageError, first_few
from ...ssp.flat_system import BoundParameter, FlatSystem, Hop
from ...ssp.model import Table
from ..engine.values import TEXT
from ..slaves.base import FmuInstance
from .addresses import ending_in, targets
from .findings import Findings
from .number_with_unit import in_unit_of
from .sizes import Extent, check_sizes, stated
from .system import System
from .value_conversion import Quantity, converted, parsed, quantity_at

PACKAGE, MAPPING, COMMAND = "package", "mapping", "command line"


@dataclass(frozen=True)
class StartValue:
    """A checked value, in the variable's type and unit; component '' is an input of the whole system."""

    component: str
    variable: str
    value: Any
    where: str
    by: str = COMMAND
    """What gives it: PACKAGE, MAPPING or COMMAND."""
    mapped: str = ""
    """The place of the mapping, where that is what gives it."""


def resolve(
    changes: Iterable[tuple[str, Any]],
    instances: Mapping[str, FmuInstance],
    prefix: str = "--set ",
    system: System | None = None,
    connectors: Iterable[str] = (),
) -> list[StartValue]:
    """Checked values of (address, value) pairs; a bare name applies to every component that has it.

    With `system`, the name of one of its own inputs means that input; `connectors` are such names to hint at.
    """
    values = []
    for address, value in changes if system is None else expanded(changes, system.network, instances, prefix):
        where = f"{prefix}{address}={value}"
        meant = targets(address, instances, system)
        if not meant:
            near = hint(address, instances, connectors=connectors)
            raise UnknownNameError(f"{where}: no component has a parameter '{address}'{near}")
        for component, name in meant:
            if component and name not in instances[component].variables:
                has = f"component '{component}' has no parameter '{name}'"
                raise UnknownNameError(f"{where}: {has}{hint(name, instances, component)}")
            if component:
                instance = instances[component]
                given = in_unit_of(value, _of_instance(instance, name), _is_array(instance, name), where)
                values.append(_checked(instance, name, given, where))
            elif system is not None:
                quantity = system.quantities.input_quantity(name)
                given = in_unit_of(value, quantity, system.system_inputs[name].size > 1, where)
                values.append(_input_value(system, name, given, where))
    return values


def _of_instance(instance: FmuInstance, name: str) -> Quantity:
    """What an FMU says of its variable."""
    kind, shown = instance.variables[name].type, f"'{instance.name}.{name}'"
    return Quantity(kind, instance.unit(name), instance.items(name), shown, instance.relative(name))


def _is_array(instance: FmuInstance, name: str) -> bool:
    return bool(instance.variables[name].dimensions)


def hint(name: str, instances: Mapping[str, FmuInstance], component: str = "", connectors: Iterable[str] = ()) -> str:
    """What may be meant by a name that a component has not, or none where that is '', and who has it.

    connectors: names of the system's own, which may be meant where no component is named.
    """
    ending = [] if component else [f"'{c}.{n}'" for c, n in ending_in(name, instances)]
    if len(ending) > 1:
        return f"; it may be {first_few(ending, MAX_OWNERS)}"
    names = {c: [n for n in instance.variables if instance.settable(n)] for c, instance in instances.items()}
    everywhere = list(dict.fromkeys(n for of_component in names.values() for n in of_component))
    if component and name not in everywhere and (near := _nearest(name, names[component])):
        return f"; did you mean '{near}'?"
    addresses = (
        [] if component else [*connectors, *(f"{c}.{n}" for c, of_component in names.items() for n in of_component)]
    )
    near = name if name in everywhere else _nearest(name, [*addresses, *everywhere])
    owners = [c for c, of_component in names.items() if near in of_component]
    whose = first_few(map(repr, owners), MAX_OWNERS)
    if near == name and owners:
        return f"; '{near}' is a parameter of {whose}"
    return f"; did you mean '{near}'{f' of {whose}' if owners else ''}?" if near else ""


def _nearest(name: str, names: Sequence[str]) -> str:
    """The known name that is most like one, or that it has a unit behind: name_kg, name [kg]; '' if there is none."""
    if close := get_close_matches(name, names, n=1, cutoff=0.6):
        return close[0]
    begins = [n for n in names if name.startswith(n) and name[len(n) : len(n) + 1] in tuple(" _[(")]
    return max(begins, key=len, default="")


def expanded(
    changes: Iterable[tuple[str, Any]],
    network: FlatSystem,
    instances: Mapping[str, FmuInstance],
    prefix: str = "--set ",
) -> Iterator[tuple[str, Any]]:
    """The changes with those of connectors of systems replaced by what these lead to."""
    for address, value in changes:
        if address in network.cut:
            continue
        if address in network.inputs or not network.connectors.get(address):
            yield address, value
            continue
        for component, name, hops in network.connectors[address]:
            instance, reached = instances[component], value
            where = f"{prefix}{address}={value}"
            instance.variable(name)
            at = quantity_at(hops[0]) if hops else None
            if at is not None or any(hop.transformation is not None for hop in hops):
                target = _target(network, instance, name)
                tables = (h.transformation for h in hops if isinstance(h.transformation, Table))
                named = next((table.entries for table in tables if table.kind == "Enumeration"), None)
                known_items = target.items if named is None else None
                if named is None and at is not None:
                    as_is = at.unit is None and not any(hop.transformation for hop in hops)
                    own, is_array = replace(at, unit=target.unit) if as_is else at, _is_array(instance, name)
                    at = replace(at, unit=None, items=at.items or known_items)
                    parts = _parts(in_unit_of(value, own, is_array, where), is_array and at.family != TEXT)
                    values = [parsed(part, at, at.shown, where) for part in parts]
                    start = tuple(values) if len(values) > 1 or is_array else values[0]
                elif named is None:
                    start = instance.checked(name, value, where, limited=False)
                elif (start := _item(hops, value)) not in {*named, *(target.items or {})}:  # mapped by its name
                    item_names = ", ".join(map(str, named))
                    raise UsageError(f"{where}: '{address}' is mapped by the names of its items: {item_names}")
                kind = target.type if named is None else "Enumeration"
                source = at if named is None and at is not None else Quantity(kind, None, known_items)
                reached = converted(start, source, hops, target, where)
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


def _checked(instance: FmuInstance, name: str, value: Any, where: str) -> StartValue:
    if not instance.settable(name):
        raise UnknownNameError(_not_settable(instance, name, where))
    return StartValue(instance.name, name, instance.checked(name, value, where), where)


def _not_settable(instance: FmuInstance, name: str, where: str) -> str:
    v = instance.variables[name]
    kind = f"its causality is '{v.causality}', its variability '{v.variability}'"
    return f"{where}: '{instance.name}.{name}' cannot be set: {kind}"


MAX_OWNERS = 5
"""Components that a hint names."""

HINTS = 5
"""Names without a variable for which a similar one is looked for: a set of parameters may be meant for many FMUs."""


def bound_values(network: FlatSystem, instances: Mapping[str, FmuInstance], findings: Findings) -> list[StartValue]:
    """Values of the package's parameter bindings, in the variables' units. What cannot be set is remarked.

    Those of components that are not among the instances are left out.
    """
    bound: list[StartValue] = []
    hints = HINTS
    bound_parameters = [s for s in network.bound_parameters if s.component in instances]
    existing = {(s.where, s.name) for s in bound_parameters if s.variable in instances[s.component].variables}
    wrong: set[tuple[str, str]] = set()
    for s in bound_parameters:
        instance = instances[s.component]
        if (s.where, s.name) in wrong:
            continue
        if s.variable not in instance.variables:
            if s.name and (s.where, s.name) in existing:
                continue  # the name means another variable
            meant = hint(s.variable, instances, s.component) if hints > 0 else ""
            hints -= 1
            findings.warnings.append(
                f"{s.where}: component '{s.component}' has no variable '{s.variable}'; the value is ignored{meant}"
            )
            continue
        value = findings.attempt(_bound, network, instance, s, findings.warnings)
        if value is not None:
            bound.append(value)
        elif instance.settable(s.variable) or instance.variables[s.variable].type not in instance.types:
            wrong.add((s.where, s.name))
    return bound


def _bound(network: FlatSystem, instance: FmuInstance, s: BoundParameter, remarks: list[str]) -> StartValue | None:
    """The checked value of a binding; None, with a remark, where it cannot be set."""
    if instance.variables[s.variable].type not in instance.types:
        kind = instance.variables[s.variable].type
        raise ParameterError(f"{s.where}: '{s.component}.{s.variable}': type {kind} is not supported")
    if not instance.settable(s.variable):
        remarks.append(f"{_not_settable(instance, s.variable, s.where)}; the value is ignored")
        return None
    target = _target(network, instance, s.variable)
    extent, size = stated(s.type, f"the value of '{s.name or s.variable}'"), instance.size(s.variable)
    if extent is not None and extent.count == size:
        check_sizes(extent, s.hops, Extent(target.shown, size, instance.shape(s.variable)), s.where)
    value = converted(s.value, _quantity(s), s.hops, target, s.where, remarks.append)
    return _from(s, _checked(instance, s.variable, value, s.where))


def _from(s: BoundParameter, value: StartValue) -> StartValue:
    """The value with what gives it."""
    if s.by_user:
        return value
    return replace(value, by=MAPPING if s.mapped else PACKAGE, mapped=s.mapped)


def idle(network: FlatSystem, values: Iterable[StartValue]) -> list[str]:
    """Remarks on inputs at the end of ways that nothing drives and that have not been given a value."""
    with_values = {(v.component, v.variable) for v in values}
    return [text for end, text in network.undriven.items() if end not in with_values]


def _target(network: FlatSystem, instance: FmuInstance, name: str) -> Quantity:
    """What a component's variable is; a unit that its connector states counts before the FMU's."""
    connectors = network.components[instance.name].component.connectors
    type = next((c.type for c in connectors if c.name == name), None)
    unit = instance.meant(type.unit if type is not None else None, name)
    shown = f"'{instance.name}.{name}'"
    return Quantity(instance.variables[name].type, unit, instance.items(name), shown, instance.relative(name))


def _quantity(s: BoundParameter) -> Quantity:
    return Quantity(s.type.kind, s.type.unit, s.type.enumeration, f"'{s.variable}'")


def bound_input_values(
    network: FlatSystem, system: System, remark: Callable[[str], None] = lambda _: None
) -> list[StartValue]:
    """Values that the package binds to inputs of the whole system."""
    values = []
    for s in network.bound_inputs:
        value = converted(s.value, _quantity(s), s.hops, system.quantities.input_quantity(s.variable), s.where, remark)
        values.append(_from(s, _input_value(system, s.variable, value, s.where)))
    return values


def _input_value(system: System, name: str, value: Any, where: str) -> StartValue:
    """The checked value of an input of the whole system."""
    checked = system.values.checked_input(name, value, where)
    system.values.check_reached(name, checked, where)
    return StartValue("", name, checked, where)
