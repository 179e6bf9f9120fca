"""modelDescription.xml (FMI 3.0) from the variable table."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

from ..core.variables import VariableTable
from .description import attributes, details, knowns, opening, units_of

OPTIONS = {
    "needsExecutionTool": "true",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "canHandleVariableCommunicationStepSize": "true",
}

KINDS = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}


def model_description(
    name: str, table: VariableTable, token: str, description: str, options: Mapping[str, str]
) -> Element:
    """The root element fmiModelDescription for the model called `name`; time comes after the table's variables."""
    identity = {"fmiVersion": "3.0", "modelName": name, "instantiationToken": token}
    capabilities = {"modelIdentifier": name, **OPTIONS, **options}
    root = opening(identity, description, "pythonfmu3", capabilities, [*units_of(table), "s"])
    variables = SubElement(root, "ModelVariables")
    for reference, v in enumerate(table):
        rate = {} if v.rate_of is None else {"derivative": str(table.index(v.rate_of))}
        SubElement(variables, KINDS[v.kind], {**attributes(v, reference), **details(v), **rate})
    SubElement(variables, "Float64", {
        "name": "time", "valueReference": str(len(table)), "causality": "independent", "variability": "continuous",
        "unit": "s",
    })  # fmt: skip
    structure = SubElement(root, "ModelStructure")
    for place, tag in enumerate(("Output", "InitialUnknown")):
        for v in table.of("output"):
            SubElement(structure, tag, {
                "valueReference": str(table.index(v.name)), "dependencies": " ".join(map(str, knowns(table, v)[place])),
            })  # fmt: skip
    return root
