"""An XML file of a package: read without entities or network, with errors that name file and line."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from copy import deepcopy
from functools import lru_cache
from importlib.resources import files
from io import BytesIO
from pathlib import Path

from lxml import etree

from ..core.errors import PackageError, did_you_mean
from ..core.plain_numbers import plain_number
from .encoding import as_utf8

SPACE = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSV, SSM, SSB, SSC = (
    f"{{{SPACE}{name}}}"
    for name in ("Description", "ParameterValues", "ParameterMapping", "SignalDictionary", "Common")
)
SHORT = {SSD: "ssd:", SSV: "ssv:", SSM: "ssm:", SSB: "ssb:", SSC: "ssc:"}

VERSIONS = ("1.0", "2.0")

HARMLESS = frozenset(
    f"{space}{name}"
    for space in (SSD, SSV, SSM, SSB, SSC)
    for name in (
        "Annotations", "MetaData", "Signature", "ElementGeometry", "ConnectorGeometry", "ConnectionGeometry",
        "SystemGeometry", "GraphicalElements",
    )
)  # fmt: skip
"""Elements that do not change what is computed."""

MAX_XML = 256 * 1024**2
"""Largest XML file that is read [bytes]."""


def local(element: etree._Element) -> str:
    """The element's name without its namespace."""
    name: str = etree.QName(element).localname
    return name


class Document:
    """One XML file of a package, with errors that can name it."""

    def __init__(self, path: Path | BytesIO, shown: str):
        self.path, self.shown = path, shown
        try:
            if isinstance(path, Path) and path.stat().st_size > MAX_XML:
                raise PackageError(f"{shown}: larger than {MAX_XML // 1024**2} MB; refused")
            data, self.encoding = as_utf8(path.read_bytes() if isinstance(path, Path) else path.getvalue())
            parser = etree.XMLParser(
                resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True,
                huge_tree=True,  # its size is bounded above
                encoding="utf-8",
            )
            tree = etree.parse(BytesIO(data), parser)
        except OSError:
            raise PackageError(f"{shown}: missing in the package") from None
        except etree.XMLSyntaxError as error:
            raise PackageError(f"{shown}: not well-formed XML ({' '.join(str(error.msg).split())})") from None
        if tree.docinfo.doctype:
            raise PackageError(f"{shown}: has a document type declaration (DOCTYPE); refused")
        self.root = tree.getroot()

    def where(self, element: etree._Element) -> str:
        """The place of an element, for messages."""
        return f"{self.shown}, line {element.sourceline}"

    def error(self, element: etree._Element, text: str) -> PackageError:
        """An error at an element."""
        return PackageError(f"{self.where(element)}: {text}")

    def attribute(self, element: etree._Element, name: str) -> str:
        """A mandatory attribute."""
        value: str | None = element.get(name)
        if value is None:
            raise self.error(element, f"<{local(element)}> lacks the attribute '{name}'")
        return value

    def name(self, element: etree._Element, name: str = "name") -> str:
        """A mandatory attribute that is not empty."""
        value = self.attribute(element, name)
        if not value:
            raise self.error(element, f"<{local(element)}> has an empty attribute '{name}'")
        return value

    def number(self, element: etree._Element, name: str, default: float | None = None) -> float | None:
        """A finite number, or the default where there is none."""
        text = element.get(name)
        if text is None:
            return default
        try:
            value = plain_number(text)
        except ValueError:
            raise self.error(element, f'{name}="{text}" is not a number') from None
        if not math.isfinite(value):
            raise self.error(element, f'{name}="{text}" is not finite')
        return value

    def truth(self, element: etree._Element, name: str, default: bool = False) -> bool:
        """An xs:boolean, or the default."""
        text = element.get(name)
        if text is None:
            return default
        value = truth(text)
        if value is None:
            raise self.error(element, f'{name}="{text}" is neither true nor false')
        return value

    def children(self, element: etree._Element, tags: Collection[str]) -> Iterator[etree._Element]:
        """The children with one of the known tags. One of no known meaning is refused by name, never skipped."""
        for child in element:
            if child.tag in tags:
                yield child
            elif child.tag not in HARMLESS:
                names = {local_of(tag): tag for tag in tags}
                meant = names.get(local(child))
                if meant is not None:
                    hint = f"; it belongs to the namespace {meant[1:].partition('}')[0]}"
                else:
                    hint = did_you_mean(local(child), list(names))
                raise self.error(child, f"<{local(child)}> inside <{local(element)}> is not supported{hint}")

    def child(self, element: etree._Element, tag: str) -> etree._Element | None:
        """The only child with a tag, or None."""
        children = element.findall(tag)
        if len(children) > 1:
            raise self.error(children[1], f"<{local(children[1])}> stands twice in <{local(element)}>")
        return children[0] if children else None


def local_of(tag: str) -> str:
    """A tag's name without its namespace."""
    return tag.rpartition("}")[2]


def truth(text: str) -> bool | None:
    """An xs:boolean, or what Python and others write for one, which the schema tells; None if it is none."""
    return {"true": True, "1": True, "false": False, "0": False}.get(text.strip().lower())


def version(document: Document, root: etree._Element) -> str:
    """The version of a root element: 1.0 or 2.0; drafts of a version count as that version, none as the first."""
    text = root.get("version", VERSIONS[0])
    for supported in VERSIONS:
        if text == supported or text.startswith((f"{supported}-", f"{supported}.")) or text == supported[:1]:
            return supported
    if text.startswith(("Draft", "1.0")):
        return "1.0"
    raise document.error(root, f"version {text} of <{local(root)}> is not supported; known: {', '.join(VERSIONS)}")


@lru_cache
def _schema(tag: str, of: str) -> etree.XMLSchema:
    name = tag[1:].partition("}")[0].removeprefix("http://ssp-standard.org/SSP1/")
    path = files(__package__).joinpath("schema", of, f"{name}.xsd")
    return etree.XMLSchema(etree.parse(str(path)))


def violations(document: Document, root: etree._Element, of: str) -> list[str]:
    """What a root element (of a file, or inline) has that the standard's schema does not allow, with its place."""
    schema = _schema(root.tag, of)
    lines = []
    if document.encoding and root.getparent() is None:
        lines.append(f"{document.shown}, line 1: is not in the encoding that it declares; read as {document.encoding}")
    if schema.validate(root if root.getparent() is None else deepcopy(root)):  # the schema knows it as a root only
        return lines
    for entry in schema.error_log:
        text = entry.message
        for tag, short in SHORT.items():
            text = text.replace(tag, short)
        lines.append(f"{document.shown}, line {entry.line}: {text}")
    return lines
