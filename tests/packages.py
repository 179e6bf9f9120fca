"""SSP packages written for tests, element by element."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

SPACES = (
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" '
    'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"'
)


def attributes(given: Mapping[str, object]) -> str:
    """Attributes of an element; None leaves one out."""
    return "".join(f' {k}="{v}"' for k, v in given.items() if v is not None)


def connector(
    name: str, kind: str, type: str | None = "Real", unit: str | None = None, enumeration: str | None = None,
    sizes: tuple[int, ...] = (),
) -> str:  # fmt: skip
    """A connector, e.g. connector("u", "input", "Real", "mm"); sizes are those of an array (SSP 2.0)."""
    inside = f"<ssc:{type}{attributes({'unit': unit, 'name': enumeration})}/>" if type else ""
    inside += "".join(f'<ssc:Dimension size="{size}"/>' for size in sizes)
    return f'<ssd:Connector name="{name}" kind="{kind}">{inside}</ssd:Connector>'


def connectors(*made: str) -> str:
    return f"<ssd:Connectors>{''.join(made)}</ssd:Connectors>" if made else ""


def component(name: str, source: str, *made: str, bindings: str = "", **other: object) -> str:
    """A component with its connectors."""
    given = attributes({"name": name, "source": source, **other})
    return f"<ssd:Component{given}>{connectors(*made)}{bindings}</ssd:Component>"


def system(
    name: str, *elements: str, made: tuple[str, ...] = (), links: tuple[str, ...] = (), bindings: str = "",
    dictionaries: str = "", **other: object,
) -> str:  # fmt: skip
    """A system: its elements, connectors, connections, bindings."""
    inside = f"<ssd:Elements>{''.join(elements)}</ssd:Elements>" if elements else ""
    wires = f"<ssd:Connections>{''.join(links)}</ssd:Connections>" if links else ""
    return (
        f'<ssd:System name="{name}"{attributes(other)}>{connectors(*made)}{bindings}{inside}{wires}{dictionaries}'
        "</ssd:System>"
    )


def link(start: str, end: str, inside: str = "", **other: object) -> str:
    """A connection; "a.y" names an element's connector, "y" one of the system itself."""
    given: dict[str, object] = {}
    for side, text in (("start", start), ("end", end)):
        element, dot, name = text.partition(".")
        if dot:
            given[f"{side}Element"] = element
        given[f"{side}Connector"] = name if dot else element
    return f"<ssd:Connection{attributes({**given, **other})}>{inside}</ssd:Connection>"


def parameter_set(*parameters: str, units: str = "", version: str = "1.0") -> str:
    """A parameter set; parameters as made by `parameter`."""
    return (
        f'<ssv:ParameterSet {SPACES} version="{version}" name="set"><ssv:Parameters>{"".join(parameters)}'
        f"</ssv:Parameters>{units}</ssv:ParameterSet>"
    )


def parameter(name: str, type: str, value: object, **other: object) -> str:
    """One parameter of a set."""
    return f'<ssv:Parameter name="{name}"><ssv:{type} value="{value}"{attributes(other)}/></ssv:Parameter>'


def values(given: Mapping[str, float]) -> str:
    """A parameter set of reals."""
    return parameter_set(*(parameter(name, "Real", value) for name, value in given.items()))


def binding(inline: str = "", mapping: str = "", **other: object) -> str:
    """One parameter binding."""
    inside = f"<ssd:ParameterValues>{inline}</ssd:ParameterValues>" if inline else ""
    return f"<ssd:ParameterBinding{attributes(other)}>{inside}{mapping}</ssd:ParameterBinding>"


def bindings(*made: str) -> str:
    return f"<ssd:ParameterBindings>{''.join(made)}</ssd:ParameterBindings>"


def mapping_file(*entries: str) -> str:
    """A parameter mapping."""
    return f'<ssm:ParameterMapping {SPACES} version="1.0">{"".join(entries)}</ssm:ParameterMapping>'


def entry(source: str, target: str, inside: str = "", **other: object) -> str:
    return f'<ssm:MappingEntry source="{source}" target="{target}"{attributes(other)}>{inside}</ssm:MappingEntry>'


def unit(name: str, space: str = "ssc", **base: object) -> str:
    return f'<ssc:Unit name="{name}"><ssc:BaseUnit{attributes(base)}/></ssc:Unit>'


def description(
    root: str, version: str = "1.0", after: str = "", stop: float | None = 1.0, step: float = 0.1, answers: str = ""
) -> str:
    """A whole system structure description; `after` are enumerations and units, `answers` <Value> and <Say>."""
    experiment = ""
    if answers:
        answers = f'<ssc:Annotation type="org.deepsea-cosim.answers"><Answers>{answers}</Answers></ssc:Annotation>'
    if stop is not None:
        experiment = (
            f'<ssd:DefaultExperiment startTime="0" stopTime="{stop}"><ssd:Annotations><ssc:Annotation '
            f'type="org.deepsea-cosim.master"><Master stepSize="{step}"/></ssc:Annotation>{answers}</ssd:Annotations>'
            "</ssd:DefaultExperiment>"
        )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription {SPACES} version="{version}" '
        'name="test">'
        f"{root}{after}{experiment}</ssd:SystemStructureDescription>"
    )


def pack(path: Path, files: Mapping[str, str | bytes | Path]) -> Path:
    """A package of files by name: texts, bytes, or paths of files."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            if isinstance(content, Path):
                archive.write(content, name)
            else:
                archive.writestr(name, content)
    return path


def package(path: Path, root: str, files: Mapping[str, str | bytes | Path], **options: object) -> Path:
    """A package with one description."""
    return pack(path, {"SystemStructure.ssd": description(root, **options), **files})  # type: ignore[arg-type]
