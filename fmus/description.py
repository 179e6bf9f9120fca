"""modelDescription.xml (FMI 2.0) and the FMU's README, both from the variable table."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement

from ..core.units import unit
from ..core.variables import Variable, VariableTable

STEP_SIZE, STOP_TIME, TOLERANCE = 1e-3, 22.0, 1e-5
"""Default experiment of the deep-sea machine [s, s, 1]."""

OPTIONS = {
    "needsExecutionTool": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}

LOG_CATEGORIES = {
    "logStatusWarning": "Warnings",
    "logStatusError": "Errors: a value out of range, a step that failed",
    "logStatusFatal": "Faults after which the instance is lost",
    "logAll": "All messages",
}


def number(value: float) -> str:
    """Shortest text that gives the same double back."""
    return repr(float(value)) if not float(value).is_integer() or abs(value) >= 1e16 else repr(int(value))


def _text(variable: Variable, value: float) -> str:
    if variable.kind == "Boolean":
        return "true" if value else "false"
    return str(int(value)) if variable.kind == "Integer" else number(value)


def attributes(variable: Variable, reference: int) -> dict[str, str]:
    """What a variable is, as attributes."""
    made = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": "fixed" if variable.causality == "parameter" else "continuous",
    }
    if variable.causality != "input":
        made["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    return made


def _variable(table: VariableTable, variable: Variable, reference: int) -> Element:
    element = Element("ScalarVariable", attributes(variable, reference))
    rate = {} if variable.rate_of is None else {"derivative": str(table.index(variable.rate_of) + 1)}  # counted from 1
    SubElement(element, variable.kind, {**details(variable), **rate})
    return element


def details(variable: Variable) -> dict[str, str]:
    """Unit, range, nominal and start value of a variable, as attributes."""
    made = {}
    if variable.unit is not None:
        made["unit"] = variable.unit
    for key in ("min", "max"):
        if (bound := getattr(variable, key)) is not None:
            made[key] = _text(variable, bound)
    if variable.nominal is not None:
        made["nominal"] = number(variable.nominal)
    if variable.start is not None:
        made["start"] = _text(variable, variable.start)
    return made


def _unit_definitions(names: Iterable[str]) -> Element:
    units = Element("UnitDefinitions")
    for unit_name in dict.fromkeys(names):
        u = unit(unit_name)
        base = {key: str(power) for key, power in u.exponents.items()}
        if u.factor != 1.0:
            base["factor"] = number(u.factor)
        if u.offset != 0.0:
            base["offset"] = number(u.offset)
        SubElement(SubElement(units, "Unit", {"name": unit_name}), "BaseUnit", base)
    return units


def opening(
    identity: Mapping[str, str], description: str, tool: str, capabilities: Mapping[str, str], units: Iterable[str]
) -> Element:
    """The root element with everything before the variables.

    identity: FMI version, model name and what identifies the FMU; capabilities: the attributes of CoSimulation.
    """
    root = Element(
        "fmiModelDescription",
        {
            **identity,
            "description": description,
            "license": "MIT",
            "generationTool": f"deepsea-cosim with {tool}",
            "generationDateAndTime": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "variableNamingConvention": "structured",
        },
    )
    SubElement(root, "CoSimulation", dict(capabilities))
    root.append(_unit_definitions(units))
    categories = SubElement(root, "LogCategories")
    for category, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": category, "description": text})
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": number(STOP_TIME),
            "tolerance": number(TOLERANCE),
            "stepSize": number(STEP_SIZE),
        },
    )
    return root


def units_of(table: VariableTable) -> list[str]:
    """The names of the units that the variables have."""
    return [v.unit for v in table if v.unit]


def knowns(table: VariableTable, variable: Variable) -> tuple[list[int], list[int]]:
    """References of what an output depends on at once, and of what its initial value depends on."""
    at_once = list(variable.feedthrough)
    initial = [*at_once, *variable.initial, *(v.name for v in table.of("parameter"))]
    return tuple(sorted(table.index(name) for name in set(names)) for names in (at_once, initial))  # type: ignore[return-value]


def _unknown(reference: int, known: list[int]) -> Element:
    # FMI 2.0 counts variables from 1
    return Element("Unknown", {"index": str(reference + 1), "dependencies": " ".join(str(i + 1) for i in known)})


def model_description(
    name: str, table: VariableTable, guid: str, description: str, options: Mapping[str, str]
) -> Element:
    """The root element fmiModelDescription for the model called `name`."""
    identity = {"fmiVersion": "2.0", "modelName": name, "guid": guid}
    capabilities = {"modelIdentifier": name, **OPTIONS, **options}
    root = opening(identity, description, "pythonfmu", capabilities, units_of(table))
    variables = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(table):
        variables.append(_variable(table, variable, reference))
    structure = SubElement(root, "ModelStructure")
    outputs = SubElement(structure, "Outputs")
    initial = SubElement(structure, "InitialUnknowns")
    for variable in table.of("output"):
        for section, known in zip((outputs, initial), knowns(table, variable), strict=True):
            section.append(_unknown(table.index(variable.name), known))
    return root


def variable_tables(table: VariableTable) -> str:
    """The variables as Markdown tables, for the FMU's README."""
    lines = []
    for causality in ("input", "output", "parameter"):
        lines += [f"## {causality.capitalize()}s", "", "| name | unit | start | min | max | description |"]
        lines += ["| --- | --- | --- | --- | --- | --- |"]
        for v in table.of(causality):
            cells = ["" if x is None else _text(v, x) for x in (v.start, v.min, v.max)]
            lines.append(f"| `{v.name}` | {v.unit or ''} | {' | '.join(cells)} | {v.description} |")
        lines.append("")
    return "\n".join(lines)
