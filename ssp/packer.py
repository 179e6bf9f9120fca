"""Packs a system folder, a parameter set and FMUs into an .ssp; connectors and units come from the FMUs themselves."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from lxml import etree

from ..core.errors import PackageError
from .document import SSC, SSD

_TYPES = {
    **{name: name for name in ("Real", "Integer", "Boolean", "String", "Enumeration")},
    **{f"Float{bits}": "Real" for bits in (32, 64)},
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
"""Types of FMI 2.0 and 3.0 in SSP 1.0."""
_KINDS = ("input", "output", "parameter")


def _description(fmu: Path) -> etree._Element:
    try:
        with zipfile.ZipFile(fmu) as archive:
            return etree.fromstring(archive.read("modelDescription.xml"))
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise PackageError(f"{fmu}: not an FMU ({error})") from None


def _add_connectors(component: etree._Element, description: etree._Element) -> None:
    connectors = etree.SubElement(component, f"{SSD}Connectors")
    for variable in description.iterfind("ModelVariables/*"):
        kind = variable.get("causality")
        typed = next((e for e in (variable, *variable) if e.tag in _TYPES), None)  # FMI 3.0 has the type outside
        if kind not in _KINDS or typed is None:
            continue
        connector = etree.SubElement(connectors, f"{SSD}Connector", name=variable.get("name"), kind=kind)
        element = etree.SubElement(connector, f"{SSC}{_TYPES[typed.tag]}")
        if typed.get("unit"):
            element.set("unit", typed.get("unit"))


def _add_units(root: etree._Element, descriptions: list[etree._Element]) -> None:
    units = etree.Element(f"{SSD}Units")
    names = set()
    for description in descriptions:
        for unit in description.iterfind("UnitDefinitions/Unit"):
            if unit.get("name") not in names:
                names.add(unit.get("name"))
                element = etree.SubElement(units, f"{SSC}Unit", name=unit.get("name"))
                base = unit.find("BaseUnit")
                etree.SubElement(element, f"{SSC}BaseUnit", dict(base.attrib) if base is not None else {})
    place = root.find(f"{SSD}DefaultExperiment")
    place.addprevious(units) if place is not None else root.append(units)


def pack(
    system: Path, parameters: Path, fmus: Mapping[str, Path], target: Path, extra: Mapping[str, Path] | None = None
) -> Path:
    """Write `target` from a SystemStructure.ssd whose components have no connectors yet, an .ssv and the FMUs.

    `fmus` maps the sources named in the .ssd to files; `extra` further package paths to files. The .ssv becomes
    resources/parameters.ssv, to which the .ssd refers.
    """
    root = etree.parse(str(system)).getroot()
    etree.cleanup_namespaces(root)
    descriptions = {source: _description(path) for source, path in fmus.items()}
    for component in root.iterfind(f".//{SSD}Component"):
        source = component.get("source")
        if source not in descriptions:
            raise PackageError(f"{system}, line {component.sourceline}: no FMU was given for '{source}'")
        _add_connectors(component, descriptions[source])
    _add_units(root, list(descriptions.values()))
    root.set("name", target.stem)
    etree.indent(root, "  ")
    text = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_suffix(".part")
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("SystemStructure.ssd", text)
        package.write(parameters, "resources/parameters.ssv")
        for name, path in {**fmus, **(extra or {})}.items():
            package.write(path, name, zipfile.ZIP_STORED)
    part.replace(target)
    return target
