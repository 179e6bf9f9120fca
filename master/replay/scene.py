"""What an FMU carries to be drawn: `resources/replay/scene.xml` (MJCF) and `replay.toml`, how that follows a run.

A scene draws what is there, and computes nothing: joints stand where formulas of the FMU's outputs say, a mocap body
may aim from a site at another, a geom may stretch from a site to another. An attribute of the scene may hold formulas
of parameters, and of measures over the run, in braces.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lxml import etree

from ...core.errors import PackageError, UsageError
from ...core.toml_tables import Tables
from ..simulation.formulas import Formula, FormulaError, number
from .recorded import RecordedRun

FOLDER = "resources/replay/"
SCENE, RULES = "scene.xml", "replay.toml"
LARGEST = 64 << 20
"""Most bytes of a file of a scene."""

PLACE = re.compile(r"\{([^{}]*)\}")
REFUSED = ("include", "extension", "plugin")
"""Elements that would read what the FMU does not carry."""

SIMULATED = ("option", "size", "statistic", "visual", "equality", "actuator", "sensor", "keyframe", "contact")
"""Sections that say nothing of what is seen, or what the stage says."""

FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
FOLDERS = ("meshdir", "texturedir", "assetdir")


@dataclass(frozen=True)
class Aim:
    """A mocap body that stands at a site, its x axis towards another."""

    body: str
    at: str
    towards: str


@dataclass(frozen=True)
class Stretch:
    """A cylinder or capsule that reaches from a site to another."""

    geom: str
    begin: str
    end: str


@dataclass(frozen=True)
class Scene:
    """The scene of a component. `joints`: formulas by joint; `view`: azimuth and elevation [deg]; `files` are those
    that the scene names, by name."""

    component: str
    where: str
    xml: str
    joints: Mapping[str, str]
    aims: tuple[Aim, ...] = ()
    stretches: tuple[Stretch, ...] = ()
    view: tuple[float, float] | None = None
    files: Mapping[str, bytes] | None = None

    def filled(self, run: RecordedRun) -> Scene:
        """With numbers of a run in the place of the formulas."""
        root = etree.fromstring(self.xml.encode(), etree.XMLParser(resolve_entities=False, no_network=True))
        for name in SIMULATED:
            for element in root.findall(name):
                root.remove(element)
        known = run.of(self.component)
        for element in root.iter(etree.Element):
            for name, text in element.attrib.items():
                where = f"{self.where}{SCENE}: line {element.sourceline}, {name}"
                for formula in dict.fromkeys(PLACE.findall(text)):
                    text = text.replace(f"{{{formula}}}", _number(formula, known, run, self, where))
                element.set(name, text)
        return replace(self, xml=etree.tostring(root, encoding="unicode"))


def scene_of(component: str, fmu: Path) -> Scene | None:
    """The scene of a component's FMU; None where that carries none."""
    if not zipfile.is_zipfile(fmu):
        return None
    with zipfile.ZipFile(fmu) as archive:
        names = [i.filename for i in archive.infolist() if i.filename.startswith(FOLDER) and not i.is_dir()]
        if f"{FOLDER}{SCENE}" not in names:
            return None
        where = f"{fmu.name}: {FOLDER}"
        if large := [name for name in names if archive.getinfo(name).file_size > LARGEST]:
            raise PackageError(f"{fmu.name}: {large[0]} is larger than {LARGEST >> 20} MB; refused")
        files = {name.removeprefix(FOLDER): archive.read(name) for name in names}
    try:
        xml, rules = files.pop(SCENE).decode("utf-8-sig"), files.pop(RULES, b"").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise PackageError(f"{where}{SCENE} and {RULES} have to be texts in UTF-8") from None
    return parsed(component, where, xml, rules, files)


def _check(xml: str, where: str, files: Mapping[str, bytes]) -> None:
    """Raise `PackageError` for a scene that would read other files than its own."""
    try:
        root = etree.fromstring(xml.encode(), etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        raise PackageError(f"{where}{SCENE}: {error}") from None
    for element in root.iter(etree.Element):
        line = f"{where}{SCENE}: line {element.sourceline}"
        if element.tag in REFUSED or (element.tag == "model" and element.get("file")):
            raise PackageError(f"{line}: <{element.tag}> is not read: a scene carries all that it needs")
        for name in FOLDERS:
            if element.get(name):
                raise PackageError(f'{line}: {name}="{element.get(name)}": files lie beside the scene')
        for name in FILES:
            if element.get(name) and element.get(name) not in files:
                raise PackageError(f"{line}: '{element.get(name)}' is not in {FOLDER} of the FMU")


def parsed(component: str, where: str, xml: str, rules: str, files: Mapping[str, bytes]) -> Scene:
    """A scene of the texts of its files and the others beside them; raises `PackageError` for what is none."""
    _check(xml, where, files)
    place = f"{where}{RULES}"
    tables = Tables(PackageError)
    data = tables.parse(rules, place)
    tables.reject_unknown_keys(data, ("view", "joints", "aim", "stretch"), place)
    view = tables.numbers(data, place, "view", ())
    if len(view) not in (0, 2):
        raise PackageError(f"{place}: 'view' has to be [azimuth, elevation] in degrees")
    given = tables.get(data, place, "joints", dict, {})
    joints = {name: formula if isinstance(formula, str) else repr(formula) for name, formula in given.items()}

    def texts(key: str, *parts: str) -> list[list[str]]:
        made = []
        for k, table in enumerate(tables.tables(data, place, key), 1):
            tables.reject_unknown_keys(table, parts, f"{place}: {key} {k}")
            made.append([tables.get(table, f"{place}: {key} {k}", part, str) for part in parts])
        return made

    aims = tuple(Aim(*parts) for parts in texts("aim", "body", "at", "towards"))
    stretches = tuple(Stretch(*parts) for parts in texts("stretch", "geom", "from", "to"))
    looks = (view[0], view[1]) if view else None
    return Scene(component, where, xml, joints, aims, stretches, looks, files)


def followed(formula: str, known: Mapping[str, Any], run: RecordedRun, component: str, where: str) -> Any:
    """The value of a formula over the times of a run: (n,), or a number."""
    try:
        parsed = Formula(formula)
        if lacking := [name for name in parsed.names if name not in known]:
            address = f"{component}.{lacking[0]}" if component else lacking[0]
            raise UsageError(
                f"{run.folder}: its record lacks {address}, which {where} follows; run again with --record '{address}' "
                "as well, or without --record"
            )
        return parsed.of(run.times, known)
    except FormulaError as error:
        raise PackageError(f"{where}: {error}") from None


def _number(formula: str, known: Mapping[str, Any], run: RecordedRun, scene: Scene, where: str) -> str:
    try:
        found = number(followed(formula, known, run, scene.component, where))
    except FormulaError as error:
        raise PackageError(f"{where}: '{formula}': {error}") from None
    if found is None:
        raise PackageError(f"{where}: '{formula}' does not exist in {run.folder}")
    return repr(found)
