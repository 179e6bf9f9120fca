"""modelDescription.xml (FMI 2.0) and the FMU's README, both from the variable table."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
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


def _variable(variable: Variable, reference: int) -> Element:
    variability = {"parameter": "fixed", "input": "continuous", "output": "continuous"}[variable.causality]
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variability,
    }
    if variable.causality != "input":
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    element = Element("ScalarVariable", attributes)
    SubElement(element, variable.kind, details(variable))
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


def unit_definitions(table: VariableTable, *others: str) -> Element:
    """The units that the variables have, and others."""
    units = Element("UnitDefinitions")
    for unit_name in dict.fromkeys([*(v.unit for v in table if v.unit), *others]):
        u = unit(unit_name)
        base = {key: str(power) for key, power in u.exponents.items()}
        if u.factor != 1.0:
            base["factor"] = number(u.factor)
        if u.offset != 0.0:
            base["offset"] = number(u.offset)
        SubElement(SubElement(units, "Unit", {"name": unit_name}), "BaseUnit", base)
    return units


def default_experiment() -> Element:
    """The default experiment."""
    return Element(
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": number(STOP_TIME),
            "tolerance": number(TOLERANCE),
            "stepSize": number(STEP_SIZE),
        },
    )


def _unknown(table: VariableTable, name: str, knowns: list[str]) -> Element:
    # FMI 2.0 counts variables from 1
    indices = sorted(table.index(known) + 1 for known in set(knowns))
    return Element(
        "Unknown", {"index": str(table.index(name) + 1), "dependencies": " ".join(str(i) for i in indices)}
    )


def model_description(
    name: str, table: VariableTable, guid: str, description: str, options: Mapping[str, str]
) -> Element:
    """The root element fmiModelDescription for the model called `name`."""
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": name,
            "guid": guid,
            "description": description,
            "license": "MIT",
            "generationTool": "deepsea-cosim with pythonfmu",
            "generationDateAndTime": now,
            "variableNamingConvention": "structured",
        },
    )
    SubElement(root, "CoSimulation", {"modelIdentifier": name, **OPTIONS, **options})
    root.append(unit_definitions(table))
    categories = SubElement(root, "LogCategories")
    for category, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": category, "description": text})
    root.append(default_experiment())
    variables = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(table):
        variables.append(_variable(variable, reference))
    structure = SubElement(root, "ModelStructure")
    outputs = SubElement(structure, "Outputs")
    initial = SubElement(structure, "InitialUnknowns")
    parameters = [v.name for v in table.of("parameter")]
    for variable in table.of("output"):
        outputs.append(_unknown(table, variable.name, list(variable.feedthrough)))
        initial.append(
            _unknown(table, variable.name, [*variable.feedthrough, *variable.initial, *parameters])
        )
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
