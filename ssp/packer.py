"""Packs a system folder, a parameter set and FMUs into an .ssp; connectors and units come from the FMUs themselves."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from lxml import etree

from ..core.errors import PackageError
from ..core.files import replacing
from ..core.plain_numbers import plain_number
from ..core.zips import add, new_archive
from .document import SSC, SSD

TYPES = {
    **{name: name for name in ("Real", "Integer", "Boolean", "String", "Enumeration")},
    **{f"Float{bits}": "Real" for bits in (32, 64)},
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
"""Types of FMI 2.0 and 3.0 in SSP 1.0."""
_KINDS = ("input", "output", "parameter")


def description_of(fmu: Path) -> etree._Element:
    """The root of an FMU's model description; raises `PackageError` where it is none."""
    try:
        with zipfile.ZipFile(fmu) as archive:
            return etree.fromstring(archive.read("modelDescription.xml"))
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise PackageError(f"{fmu}: not an FMU ({error})") from None


def add_connectors(component: etree._Element, description: etree._Element) -> None:
    """Give a component the inputs, outputs and parameters of its FMU as connectors."""
    connectors = etree.SubElement(component, f"{SSD}Connectors")
    for variable in description.iterfind("ModelVariables/*"):
        kind = variable.get("causality")
        typed = next((e for e in (variable, *variable) if e.tag in TYPES), None)  # FMI 3.0 has the type outside
        if kind not in _KINDS or typed is None:
            continue
        connector = etree.SubElement(connectors, f"{SSD}Connector", name=variable.get("name"), kind=kind)
        if TYPES[typed.tag] == "Enumeration":  # whose items the FMU knows; SSP would want them defined anew
            continue
        element = etree.SubElement(connector, f"{SSC}{TYPES[typed.tag]}")
        if typed.get("unit"):
            element.set("unit", typed.get("unit"))


def add_units(root: etree._Element, descriptions: list[etree._Element]) -> None:
    """Give a system structure the units that its FMUs define, each once.

    What a package defines counts before what an FMU does. So a name that FMUs define in two ways is left out, and one
    that an FMU does not say what it means, which would be a plain number here.
    """
    defined: dict[str, dict[frozenset[tuple[str, float | str]], dict[str, str]]] = {}
    for description in descriptions:
        for unit in description.iterfind("UnitDefinitions/Unit"):
            if (base := unit.find("BaseUnit")) is not None:
                defined.setdefault(unit.get("name"), {}).setdefault(_meaning(base), dict(base.attrib))
    units = etree.Element(f"{SSD}Units")
    for name, ways in defined.items():
        if len(ways) == 1:
            element = etree.SubElement(units, f"{SSC}Unit", name=name)
            etree.SubElement(element, f"{SSC}BaseUnit", *ways.values())
    if not len(units):
        return
    place = root.find(f"{SSD}DefaultExperiment")
    place.addprevious(units) if place is not None else root.append(units)


def _meaning(base: etree._Element) -> frozenset[tuple[str, float | str]]:
    """What a BaseUnit says, however it is written."""
    said: dict[str, float | str] = {}
    for key, text in base.attrib.items():
        try:
            said[key] = plain_number(text)
        except ValueError:
            said[key] = text
    return frozenset((key, value) for key, value in said.items() if value != (1.0 if key == "factor" else 0.0))


def pack(
    system: Path, parameters: Path, fmus: Mapping[str, Path], target: Path, extra: Mapping[str, Path] | None = None
) -> Path:
    """Write `target` from a SystemStructure.ssd whose components have no connectors yet, an .ssv and the FMUs.

    `fmus` maps the sources named in the .ssd to files; `extra` further package paths to files. The .ssv becomes
    resources/parameters.ssv, to which the .ssd refers.
    """
    root = etree.parse(str(system)).getroot()
    etree.cleanup_namespaces(root)
    descriptions = {source: description_of(path) for source, path in fmus.items()}
    for component in root.iterfind(f".//{SSD}Component"):
        source = component.get("source")
        if source not in descriptions:
            raise PackageError(f"{system}, line {component.sourceline}: no FMU was given for '{source}'")
        add_connectors(component, descriptions[source])
    add_units(root, list(descriptions.values()))
    return write(root, target, {"resources/parameters.ssv": parameters, **fmus, **(extra or {})})


def write(root: etree._Element, target: Path, files: Mapping[str, Path]) -> Path:
    """Write a package of a whole system structure and the files that it refers to, by their path in it."""
    root.set("name", target.stem)
    etree.indent(root, "  ")
    text = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    target.parent.mkdir(parents=True, exist_ok=True)
    with replacing(target) as part, new_archive(part) as package:
        add(package, "SystemStructure.ssd", text)
        for name, path in files.items():
            stored = path.suffix == ".fmu" or name.endswith(".toml")
            package.write(path, name, zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED)
    return target
