"""An FMU's model description, read by fmpy: what fmpy stumbles over is put right before, what it leaves out after."""

from __future__ import annotations

from inspect import signature
from io import BytesIO
from pathlib import Path
from typing import Any

from ...core.scratch import scratch
from ...ssp.encoding import as_utf8

LISTS = ("dependencies", "dependenciesKind", "clocks")
"""Attributes that are lists; fmpy takes one blank between the entries."""


def description_tree(folder: Path) -> Any:
    """The XML of an FMU's model description, as lxml reads it from a stranger: no entities, no network.

    Raises `OSError` and `lxml.etree.XMLSyntaxError`.
    """
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, encoding="utf-8")
    return etree.parse(BytesIO(as_utf8((folder / "modelDescription.xml").read_bytes())[0]), parser)


def read_description(folder: Path, tree: Any) -> Any:
    """fmpy's record of the model description in the folder; `tree` is its XML, which is put right.

    Raises what fmpy raises.
    """
    from fmpy import read_model_description

    data = (folder / "modelDescription.xml").read_bytes()
    recoded, told = as_utf8(data)
    if _put_right(tree) or told or recoded is not data:
        with scratch("description") as place:
            with (place / "modelDescription.xml").open("wb") as file:  # lxml takes names of files for addresses
                tree.write(file, encoding="UTF-8")
            description = read_model_description(str(place), validate=False)
    else:
        description = read_model_description(str(folder), validate=False)
    _complete(description, tree)
    return description


def _put_right(tree: Any) -> bool:
    """Whether something had to be put right in the tree: what is valid but more than fmpy reads."""
    from fmpy.model_description import SimpleType

    root = tree.getroot()
    changed = False
    for name in LISTS:
        for element in root.iterfind(f".//*[@{name}]"):
            plain = " ".join(element.get(name).split())
            if plain != element.get(name):
                element.set(name, plain)
                changed = True
    known = signature(SimpleType).parameters.keys() - {"type", "items"}
    clocks = set()
    for element in root.iterfind("TypeDefinitions/*"):
        if element.tag == "ClockType":
            clocks.add(element.get("name"))
        for comment in [c for c in element if not isinstance(c.tag, str)]:
            element.remove(comment)
            changed = True
        for typed in (element, *element) if isinstance(element.tag, str) and element.tag != "ClockType" else ():
            if typed.tag not in ("Item", "Annotations"):
                for attribute in set(typed.attrib) - known:
                    del typed.attrib[attribute]
                    changed = True
    for element in root.iterfind("ModelVariables/Clock[@declaredType]"):
        if element.get("declaredType") in clocks:
            del element.attrib["declaredType"]
            changed = True
    return changed


def _complete(description: Any, tree: Any) -> None:
    """Fill in what fmpy leaves out: differences, ranges of unsigned numbers, arrays of texts, FMI 3's derivatives."""
    root = tree.getroot()
    for element in root.iterfind("CoSimulation[@providesDirectionalDerivatives]"):
        told = element.get("providesDirectionalDerivatives") in ("true", "1")
        description.coSimulation.providesDirectionalDerivative = told
    own = getattr(description.coSimulation, "fixedInternalStepSize", None)
    if own is not None and not float(own) > 0.0:
        raise ValueError(f'fixedInternalStepSize="{own}" is not a step')
    variables = {v.name: v for v in description.modelVariables}
    for element in root.iterfind("ModelVariables/*"):
        variable = variables.get(element.get("name"))
        typed = element if element.tag != "ScalarVariable" else next(element.iterchildren("Real"), None)
        if variable is None or typed is None:
            continue
        if typed.get("relativeQuantity") is not None:
            variable.relativeQuantity = typed.get("relativeQuantity") in ("true", "1")
        if str(typed.tag).startswith("UInt"):
            variable.min, variable.max = typed.get("min"), typed.get("max")
        starts = element.findall("Start")
        if len(starts) > 1:
            variable.start = tuple(start.get("value") for start in starts)
