"""Reads an SSP package into the records of `model`. What is not supported is refused by name, never skipped."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

from lxml import etree

from ..core.errors import PackageError
from .archive import extract
from .model import Component, Connection, Connector, Parameter, SystemStructure

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
SSC = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"

FMU_TYPES = ("application/x-fmu-sharedlibrary",)
SSV_TYPES = ("application/x-ssp-parameter-set",)


class _File:
    """One XML file of the package, with the errors that can name it."""

    def __init__(self, path: Path, shown: str):
        self.shown = shown
        try:
            parser = etree.XMLParser(
                resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True
            )
            self.root = etree.parse(str(path), parser).getroot()
        except OSError:
            raise PackageError(f"{shown}: missing in the package") from None
        except etree.XMLSyntaxError as error:
            raise PackageError(f"{shown}: not well-formed XML ({error.msg})") from None

    def error(self, element: etree._Element, text: str) -> PackageError:
        return PackageError(f"{self.shown}, line {element.sourceline}: {text}")

    def attribute(self, element: etree._Element, name: str) -> str:
        value = element.get(name)
        if value is None:
            raise self.error(element, f"<{etree.QName(element).localname}> lacks the attribute '{name}'")
        return value

    def number(self, element: etree._Element, name: str) -> float | None:
        text = element.get(name)
        if text is None:
            return None
        try:
            return float(text)
        except ValueError:
            raise self.error(element, f"{name}=\"{text}\" is not a number") from None


def _value(file: _File, element: etree._Element) -> float | int | bool | str:
    kind = etree.QName(element).localname
    text = file.attribute(element, "value")
    try:
        if kind == "Real":
            return float(text)
        if kind == "Integer":
            return int(text)
        if kind == "Boolean":
            return {"true": True, "1": True, "false": False, "0": False}[text.strip()]
    except (ValueError, KeyError):
        raise file.error(element, f"'{text}' is not a value of type {kind}") from None
    if kind in ("String", "Enumeration"):
        return text
    raise file.error(element, f"parameters of type {kind} are not supported")


def _parameter_set(file: _File, root: etree._Element, prefix: str) -> list[Parameter]:
    if root.tag != f"{SSV}ParameterSet":
        raise file.error(root, f"<{etree.QName(root).localname}> is not a ParameterSet of SSP 1.0")
    parameters: list[Parameter] = []
    for element in root.iterfind(f"{SSV}Parameters/{SSV}Parameter"):
        name = prefix + file.attribute(element, "name")
        if any(p.name == name for p in parameters):
            raise file.error(element, f"parameter '{name}' is given twice")
        if len(element) == 0:
            raise file.error(element, f"parameter '{name}' has no value")
        typed = element[0]
        parameters.append(
            Parameter(name, _value(file, typed), typed.get("unit"), f"{file.shown}, line {element.sourceline}")
        )
    return parameters


def _bindings(file: _File, owner: etree._Element, folder: Path) -> list[Parameter]:
    parameters: list[Parameter] = []
    for binding in owner.iterfind(f"{SSD}ParameterBindings/{SSD}ParameterBinding"):
        if binding.find(f"{SSD}ParameterMapping") is not None:
            raise file.error(binding, "parameter mappings (.ssm) are not supported yet")
        kind = binding.get("type", SSV_TYPES[0])
        if kind not in SSV_TYPES:
            raise file.error(binding, f"parameter bindings of type '{kind}' are not supported")
        prefix = binding.get("prefix", "")
        if binding.get("sourceBase", "SSD") != "SSD":
            raise file.error(binding, f"sourceBase '{binding.get('sourceBase')}' is not supported yet")
        source = unquote(binding.get("source")) if binding.get("source") is not None else None
        if source is not None:
            if not (folder / source).resolve().is_relative_to(folder.resolve()):
                raise file.error(binding, f"source '{source}' leaves the package")
            values = _File(folder / source, source)
            parameters += _parameter_set(values, values.root, prefix)
        else:
            inline = binding.find(f"{SSD}ParameterValues/{SSV}ParameterSet")
            if inline is None:
                raise file.error(binding, "a parameter binding needs a source or ParameterValues")
            parameters += _parameter_set(file, inline, prefix)
    return parameters


def _connectors(file: _File, owner: etree._Element) -> tuple[Connector, ...]:
    connectors = []
    for element in owner.iterfind(f"{SSD}Connectors/{SSD}Connector"):
        typed = next((e for e in element if etree.QName(e).namespace == SSC[1:-1]), None)
        connectors.append(
            Connector(
                file.attribute(element, "name"),
                file.attribute(element, "kind"),
                etree.QName(typed).localname if typed is not None else None,
                typed.get("unit") if typed is not None else None,
            )
        )
    return tuple(connectors)


def _component(file: _File, element: etree._Element, folder: Path) -> Component:
    name = file.attribute(element, "name")
    kind = element.get("type", FMU_TYPES[0])
    if kind not in FMU_TYPES:
        raise file.error(element, f"component '{name}' has type '{kind}'; only FMUs are supported yet")
    implementation = element.get("implementation", "any")
    if implementation not in ("any", "CoSimulation"):
        raise file.error(element, f"component '{name}' asks for {implementation}; only CoSimulation is supported")
    source = unquote(file.attribute(element, "source"))
    if not (folder / source).resolve().is_relative_to(folder.resolve()):
        raise file.error(element, f"source '{source}' of component '{name}' leaves the package")
    if not (folder / source).is_file():
        raise file.error(element, f"component '{name}' needs '{source}', which is missing in the package")
    return Component(
        name, source, _connectors(file, element), tuple(_bindings(file, element, folder)), element.sourceline
    )


def read(package: Path, folder: Path) -> SystemStructure:
    """Extract the SSP file `package` into `folder` and read its system.

    Raises `PackageError` naming file, line and remedy when the package is damaged or uses what is not supported.
    """
    extract(package, folder)
    return read_folder(folder)


def read_folder(folder: Path) -> SystemStructure:
    """Read the system of an extracted package."""
    if not (folder / "SystemStructure.ssd").is_file():
        raise PackageError("SystemStructure.ssd is missing: this is not an SSP package")
    file = _File(folder / "SystemStructure.ssd", "SystemStructure.ssd")
    if file.root.tag != f"{SSD}SystemStructureDescription":
        raise file.error(file.root, f"root element {file.root.tag} is not that of SSP 1.0")
    system = file.root.find(f"{SSD}System")
    if system is None:
        raise file.error(file.root, "no <System>")
    for feature in ("SignalDictionaries", "Connectors"):
        if system.find(f"{SSD}{feature}") is not None:
            raise file.error(system.find(f"{SSD}{feature}"), f"{feature} of a system are not supported yet")
    components = []
    for element in system.iterfind(f"{SSD}Elements/*"):
        if element.tag != f"{SSD}Component":
            kind = etree.QName(element).localname
            raise file.error(element, f"<{kind}> inside a system is not supported yet")
        components.append(_component(file, element, folder))
    names = [c.name for c in components]
    for element in components:
        if names.count(element.name) > 1:
            raise PackageError(f"SystemStructure.ssd, line {element.line}: two components are called '{element.name}'")
    connections = []
    for element in system.iterfind(f"{SSD}Connections/{SSD}Connection"):
        if len(element) and any(etree.QName(e).localname.endswith("Transformation") for e in element):
            raise file.error(element, "connection transformations are not supported yet")
        ends = []
        for side in ("start", "end"):
            if element.get(f"{side}Element") is None:
                raise file.error(element, "connections to the system's own connectors are not supported yet")
            ends.append((file.attribute(element, f"{side}Element"), file.attribute(element, f"{side}Connector")))
        connections.append(Connection(ends[0], ends[1], element.sourceline))
    experiment = file.root.find(f"{SSD}DefaultExperiment")
    start = stop = step = None
    if experiment is not None:
        start, stop = file.number(experiment, "startTime"), file.number(experiment, "stopTime")
        for annotation in experiment.iterfind(f"{SSD}Annotations/{SSC}Annotation"):
            if annotation.get("type") == STEP_ANNOTATION and len(annotation):
                step = file.number(annotation[0], "stepSize")
    return SystemStructure(
        system.get("name") or file.root.get("name") or "system",
        folder,
        tuple(components),
        tuple(connections),
        tuple(_bindings(file, system, folder)),
        start or 0.0,
        stop,
        step,
    )


STEP_ANNOTATION = "org.deepsea-cosim.master"
"""Annotation of DefaultExperiment whose <Master stepSize="..."/> suggests the macro step [s]."""
