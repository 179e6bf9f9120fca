"""A package from FMUs, the connections between them and values, without a line of XML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, count
from pathlib import Path
from typing import Any

from lxml import etree

from ..core.errors import PackageError, did_you_mean
from .annotations import STEP_ANNOTATION
from .document import SSC, SSD, SSV
from .packer import TYPES, add_connectors, add_units, description_of, write

FMU_TYPE = "application/x-fmu-sharedlibrary"
ENDS = {"start": ("output", "calculatedParameter", "parameter"), "end": ("input", "parameter")}
"""Causalities that a connection may begin and end at."""


def compose(
    target: Path, fmus: Mapping[str, Path], links: Sequence[tuple[str, str]], values: Mapping[str, Any] | None = None,
    stop: float = 10.0, step: float | None = None, method: str | None = None, extra: Mapping[str, Path] | None = None,
) -> Path:  # fmt: skip
    """Write an .ssp.

    fmus: by the name of the component; links: ("component.output", "component.input"); values: parameters and start
    values by component.variable, in the FMU's units; stop, step [s] and method: how it is meant to be run; extra:
    further files by their path in the package, e.g. {"resources/effects.toml": Path("effects.toml")}.

    Raises `PackageError` that names the component or variable that is not there.
    """
    if target.suffix.lower() != ".ssp":
        raise PackageError(f"{target}: a package is a file.ssp")
    known: dict[str, _Known] = {}
    for name, path in fmus.items():
        taken = {one.source for one in known.values() if one.path != path}
        names = chain((path.name, f"{name}.fmu"), (f"{name}_{k}.fmu" for k in count(2)))
        known[name] = _Known(path, next(source for n in names if (source := f"resources/{n}") not in taken))
    root = etree.Element(f"{SSD}SystemStructureDescription", nsmap=_SPACES, version="1.0", name=target.stem)
    system = etree.SubElement(root, f"{SSD}System", name="system")
    if values:
        _bind(system, known, values)
    elements = etree.SubElement(system, f"{SSD}Elements")
    for name, one in known.items():
        component = etree.SubElement(
            elements, f"{SSD}Component", name=name, type=FMU_TYPE, source=one.source, implementation="CoSimulation"
        )
        add_connectors(component, one.description)
    connections = etree.SubElement(system, f"{SSD}Connections")
    for start, end in links:
        places: dict[str, str] = {}
        for side, address in (("start", start), ("end", end)):
            owner, variable = _found(known, address, ENDS[side])
            places |= {f"{side}Element": owner, f"{side}Connector": variable}
        etree.SubElement(connections, f"{SSD}Connection", places)
    if not links:
        system.remove(connections)
    _experiment(root, stop, step, method)
    add_units(root, [one.description for one in known.values()])
    return write(root, target, {**{one.source: one.path for one in known.values()}, **(extra or {})})


_SPACES = {"ssd": SSD[1:-1], "ssc": SSC[1:-1], "ssv": SSV[1:-1]}


class _Known:
    """An FMU, its place in the package, and the variables that its description has."""

    def __init__(self, path: Path, source: str):
        self.path, self.source = path, source
        self.description = description_of(path)
        self.variables = {v.get("name"): v for v in self.description.iterfind("ModelVariables/*")}

    def type_of(self, variable: str) -> str:
        """The type in SSP 1.0."""
        v = self.variables[variable]
        return next((TYPES[e.tag] for e in (v, *v) if e.tag in TYPES), "Real")


def _found(known: Mapping[str, _Known], address: str, causalities: Sequence[str] = ()) -> tuple[str, str]:
    """(component, variable) of an address; raises `PackageError` for one that leads nowhere."""
    component = max((name for name in known if address.startswith(f"{name}.")), key=len, default=None)
    if component is None:
        hint = did_you_mean(address.partition(".")[0], list(known))
        raise PackageError(f"'{address}': there is no component of that name{hint}; expected component.variable")
    variable, variables = address[len(component) + 1 :], known[component].variables
    if variable not in variables:
        hint = did_you_mean(variable, list(variables))
        raise PackageError(f"'{address}': {known[component].path.name} has no variable '{variable}'{hint}")
    causality = variables[variable].get("causality") or "local"
    if causalities and causality not in causalities:
        raise PackageError(f"'{address}' is of causality {causality}; expected {' or '.join(causalities)}")
    return component, variable


def _bind(system: etree._Element, known: Mapping[str, _Known], values: Mapping[str, Any]) -> None:
    bindings = etree.SubElement(system, f"{SSD}ParameterBindings")
    inside = etree.SubElement(etree.SubElement(bindings, f"{SSD}ParameterBinding"), f"{SSD}ParameterValues")
    made = etree.SubElement(inside, f"{SSV}ParameterSet", version="1.0", name="values")
    parameters = etree.SubElement(made, f"{SSV}Parameters")
    for address, value in values.items():
        component, variable = _found(known, address)
        shown = str(value).lower() if isinstance(value, bool) else str(value)
        parameter = etree.SubElement(parameters, f"{SSV}Parameter", name=address)
        etree.SubElement(parameter, f"{SSV}{known[component].type_of(variable)}", value=shown)


def _experiment(root: etree._Element, stop: float, step: float | None, method: str | None) -> None:
    experiment = etree.SubElement(root, f"{SSD}DefaultExperiment", startTime="0", stopTime=repr(float(stop)))
    if step is None and method is None:
        return
    suggested = {"stepSize": None if step is None else repr(float(step)), "method": method}
    annotations = etree.SubElement(experiment, f"{SSD}Annotations")
    annotation = etree.SubElement(annotations, f"{SSC}Annotation", type=STEP_ANNOTATION)
    etree.SubElement(annotation, "Master", {k: v for k, v in suggested.items() if v is not None})
