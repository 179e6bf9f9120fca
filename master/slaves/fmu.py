"""An FMU file as an instance: read once per process, and examined before anything of it is loaded."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...core.errors import PackageError
from ...core.files import changed
from .base import FmuInstance
from .description import description_tree, read_description
from .fmi1 import Fmi1Instance
from .fmi2 import Fmi2Instance
from .fmi3 import Fmi3Instance
from .unpacked import unpack

VERSIONS: dict[str, type[FmuInstance]] = {"1.0": Fmi1Instance, "2.0": Fmi2Instance, "3.0": Fmi3Instance}


def _tree(folder: Path, shown: str) -> Any:
    from lxml import etree

    try:
        tree = description_tree(folder)
    except OSError:
        raise PackageError(f"{shown}: holds no modelDescription.xml") from None
    except etree.XMLSyntaxError as error:
        told = " ".join(str(error.msg).split())
        raise PackageError(f"{shown}: modelDescription.xml is not well-formed ({told})") from None
    if tree.docinfo.doctype:
        raise PackageError(f"{shown}: modelDescription.xml has a document type declaration (DOCTYPE); refused")
    return tree


def platform_folder(version: str) -> str:
    """The folder in `binaries` of this platform's libraries."""
    from fmpy import platform, platform_tuple

    name: str = platform_tuple if version == "3.0" else platform
    return name


def describe(name: str, fmu: Path, library: bool = True) -> FmuInstance:
    """An instance, not loaded yet, from an FMU; `library`: it has to have one for this platform."""
    return describe_folder(name, unpack(fmu), fmu.name, library)


def describe_folder(name: str, folder: Path, shown: str = "FMU", library: bool = True) -> FmuInstance:
    """An instance, not loaded yet, from an FMU that has been unpacked; `shown` is its name in messages."""
    kind, description, twins = _examined(folder, changed(folder / "modelDescription.xml"), shown)
    if library:
        _check_library(folder, description, kind.version, shown)
    made = kind(name, folder, description)
    made.ambiguous = twins
    return made


def _check_library(folder: Path, description: Any, version: str, shown: str) -> None:
    """Raise `PackageError` where an FMU has no library for this platform."""
    from fmpy import sharedLibraryExtension

    here, wanted = platform_folder(version), f"{description.coSimulation.modelIdentifier}{sharedLibraryExtension}"
    if (folder / "binaries" / here / wanted).is_file():
        return
    if found := sorted(p.name for p in (folder / "binaries" / here).glob(f"*{sharedLibraryExtension}")):
        told = f"binaries/{here} has no {wanted}, which is its modelIdentifier; it has {', '.join(found)}"
        raise PackageError(f"{shown}: {told}")
    there = sorted(p.name for p in (folder / "binaries").glob("*") if p.is_dir())
    raise PackageError(f"{shown}: has no library for this platform ({here}); it has {', '.join(there) or 'none'}")


def _set_aside_twins(description: Any, shown: str) -> frozenset[str]:
    """Take internal variables of one name out of the description, and give the names: which of them is meant matters
    only to who names them."""
    by_name: dict[str, list[Any]] = {}
    for v in description.modelVariables:
        by_name.setdefault(v.name or "", []).append(v)
    twins = {name for name, found in by_name.items() if len(found) > 1 or not name}
    for name in twins:
        if not name or any(v.causality not in ("local", None) for v in by_name[name]):
            raise PackageError(f"{shown}: modelDescription.xml has two variables '{name}'")
    description.modelVariables = [v for v in description.modelVariables if v.name not in twins]
    return frozenset(twins)


@lru_cache(maxsize=64)
def _examined(folder: Path, when: int, shown: str) -> tuple[type[FmuInstance], Any, frozenset[str]]:
    """The FMI version's instance, the model description and names of several internal variables, read once for many
    components of one FMU."""
    tree = _tree(folder, shown)
    version = tree.getroot().get("fmiVersion", "?")
    known = next((v for v in VERSIONS if version == v or (v == "3.0" and version.startswith("3."))), None)
    if known is None:
        raise PackageError(f"{shown}: FMI {version} is not supported; known: {', '.join(VERSIONS)}")
    try:
        description = read_description(folder, tree)
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise PackageError(f"{shown}: modelDescription.xml cannot be read ({reason})") from None
    if description.coSimulation is None:
        raise PackageError(f"{shown}: has no co-simulation interface")
    identifier = description.coSimulation.modelIdentifier or ""
    if not identifier or re.search(r"[/\\\0]|\.\.|.{201}", identifier):
        raise PackageError(f"{shown}: modelIdentifier '{identifier[:60]}' is not a name")
    twins = _set_aside_twins(description, shown)
    for v in description.modelVariables:
        if not 0 <= int(v.valueReference) < 2**32:
            raise PackageError(f"{shown}: '{v.name}' has the valueReference {v.valueReference}; it has to fit 32 bits")
    return VERSIONS[known], description, twins
