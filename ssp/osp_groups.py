"""Groups of variables of an FMU, as its OspModelDescription.xml says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from ..core.errors import PackageError
from .document import Document, local


@dataclass(frozen=True)
class VariableGroup:
    """A group: its variables, and groups inside it, in their order."""

    name: str
    kind: str
    """What it is in OSP's words, as Force or LinearMechanicalPort; empty for a function's."""
    variables: tuple[str, ...]
    inner: tuple[VariableGroup, ...] = ()

    def all(self) -> Iterator[VariableGroup]:
        """This group and all inside it."""
        yield self
        for group in self.inner:
            yield from group.all()


def groups_of(
    fmu: Path, folder: Path, model_name: str | None, element: etree._Element, asking: Document
) -> dict[str, VariableGroup]:
    """The groups of an FMU by name, those inside others too.

    They stand in <model name>_OspModelDescription.xml beside the FMU, or in the folder of the structure. `element` of
    the document `asking` is what asks for one.
    """
    name = f"{model_name}_OspModelDescription.xml"
    path = next((p for p in (fmu.parent / name, folder / name) if p.is_file()), None)
    if path is None:
        raise asking.error(element, f"a group of variables needs {name}, neither beside {fmu.name} nor here")
    document = Document(path, path.name)
    if local(document.root) != "OspModelDescription":
        raise document.error(document.root, f"<{local(document.root)}> is no OspModelDescription")
    sections = [e for e in document.root if local(e) == "VariableGroups"]
    top_level = [_group(document, e) for section in sections for e in section]
    outer = {g.name: g for g in top_level}
    return {g.name: g for top in top_level for g in top.all()} | outer


def _group(document: Document, element: etree._Element) -> VariableGroup:
    variables, inner = [], []
    for child in element:
        if local(child) == "Variable":
            variables.append(child.get("ref") or document.name(child))
        else:
            inner.append(_group(document, child))
    return VariableGroup(document.name(element), local(element), tuple(variables), tuple(inner))


def paired(first: VariableGroup, second: VariableGroup, where: str, notes: list[str]) -> list[tuple[str, str]]:
    """The variables of two groups that belong together: by their order, those of groups inside likewise."""
    if len(first.variables) != len(second.variables) or len(first.inner) != len(second.inner):
        sizes = [f"'{g.name}' has {len(g.variables)} variables and {len(g.inner)} groups" for g in (first, second)]
        raise PackageError(f"{where}: the groups do not fit: {', '.join(sizes)}")
    if first.kind and second.kind and first.kind != second.kind:
        notes.append(f"{where}: '{first.name}' is a {first.kind}, '{second.name}' a {second.kind}")
    pairs = list(zip(first.variables, second.variables, strict=True))
    for a, b in zip(first.inner, second.inner, strict=True):
        pairs += paired(a, b, where, notes)
    return pairs
