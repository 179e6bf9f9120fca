"""modelDescription.xml (FMI 3.0) from the variable table."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

from ..core.variables import Variable, VariableTable
from .description import LOG_CATEGORIES, default_experiment, details, unit_definitions

OPTIONS = {
    "needsExecutionTool": "true",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "canHandleVariableCommunicationStepSize": "true",
}

KINDS = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}


def _variable(variable: Variable, reference: int) -> Element:
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": "fixed" if variable.causality == "parameter" else "continuous",
    }
    if variable.causality != "input":
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    return Element(KINDS[variable.kind], {**attributes, **details(variable)})


def model_description(
    name: str, table: VariableTable, token: str, description: str, options: Mapping[str, str]
) -> Element:
    """The root element fmiModelDescription for the model called `name`; time comes after the table's variables."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": name,
            "instantiationToken": token,
            "description": description,
            "license": "MIT",
            "generationTool": "deepsea-cosim with pythonfmu3",
            "generationDateAndTime": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "variableNamingConvention": "structured",
        },
    )
    SubElement(root, "CoSimulation", {"modelIdentifier": name, **OPTIONS, **options})
    root.append(unit_definitions(table, "s"))
    categories = SubElement(root, "LogCategories")
    for category, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": category, "description": text})
    root.append(default_experiment())
    variables = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(table):
        variables.append(_variable(variable, reference))
    SubElement(variables, "Float64", {
        "name": "time", "valueReference": str(len(table)), "causality": "independent", "variability": "continuous",
        "unit": "s",
    })  # fmt: skip
    structure = SubElement(root, "ModelStructure")
    parameters = [v.name for v in table.of("parameter")]
    for tag in ("Output", "InitialUnknown"):
        for variable in table.of("output"):
            knowns = [*variable.feedthrough, *((*variable.initial, *parameters) if tag == "InitialUnknown" else ())]
            references = sorted(table.index(known) for known in set(knowns))
            SubElement(structure, tag, {
                "valueReference": str(table.index(variable.name)), "dependencies": " ".join(map(str, references)),
            })  # fmt: skip
    return root
