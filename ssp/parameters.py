"""Parameter sets (.ssv), parameter mappings (.ssm) and the bindings that apply them to an element."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from posixpath import normpath
from unicodedata import normalize
from urllib.parse import unquote, urlsplit

from lxml import etree

from ..core.errors import PackageError, did_you_mean
from .annotations import Unused
from .document import MAX_XML, SSC, SSD, SSM, SSV, Document, version, violations
from .encoding import encoding_of, name_in
from .model import TYPE_KINDS, Binding, MappingEntry, Parameter
from .values import TRANSFORMATIONS, Definitions, transformation_of, typed_as, value_of

SSV_TYPE = "application/x-ssp-parameter-set"
SSM_TYPE = "application/x-ssp-parameter-mapping"

Remark = Callable[[str], None]
"""Is told of what deviates from the schema."""


def inside(document: Document, element: etree._Element, source: str, base: Path, root: Path) -> tuple[Path, str]:
    """(path, fragment) of a relative URI, which has to stay in the package."""
    try:
        parts = urlsplit(source)
    except ValueError as error:
        raise document.error(element, f"source '{source}' is not a URI ({error})") from None
    if parts.scheme or parts.netloc or parts.query:
        raise document.error(
            element, f"source '{source}' is not a file of the package; only relative paths are supported"
        )
    path = base / unquote(parts.path)
    try:
        if not path.exists():
            path = base / normalize("NFC", unquote(parts.path))  # as names of archives are unpacked
        stays = path.resolve().is_relative_to(root.resolve())
        path.exists()
    except OSError as error:
        raise document.error(element, f"source '{source[:60]}...' cannot be a file ({error.strerror})") from None
    except ValueError:
        stays = False
    if not stays:
        raise document.error(element, f"source '{source}' leaves the package")
    return path, unquote(parts.fragment)


def nearest(source: str, folder: Path) -> str:
    """A hint which file of the folder may be meant by a source that is missing."""
    files = [p.relative_to(folder).as_posix() for p in sorted(folder.rglob("*")) if p.is_file()]
    for name in files:
        if (encoding := encoding_of(name, normalize("NFC", unquote(source)))) is not None:
            return f": the archive has that name in {encoding}; pack it anew with a tool that writes UTF-8"
    return did_you_mean(source.replace("\\", "/"), files)


def opened_at(document: Document, element: etree._Element, path: Path, shown: str) -> Document:
    """A file that an element asks for; one that is missing is told with the place that does."""
    if not path.is_file():
        hint = nearest(path.name, path.parent)
        raise document.error(element, f"'{element.get('source')}' is missing in the package{hint}")
    return Document(path, shown)


class Bindings:
    """Reads the bindings of elements of one system structure description."""

    def __init__(
        self, folder: Path, root: Path, remark: Remark, prefix: str = "", errors: list[str] | None = None,
        unused: Unused | None = None,
    ):  # fmt: skip
        self.folder, self.root, self.remark = folder, root, remark
        self.unused = Unused() if unused is None else unused
        self.errors = errors
        """Where this is a list, what is wrong with a binding goes there, and the others are read."""
        self.prefix = prefix
        """What names of files begin with in messages: the package that this one lies in."""

    def read(
        self, document: Document, owner: etree._Element, definitions: Definitions, source: Path | None = None
    ) -> tuple[Binding, ...]:
        """The bindings of an element; `source` is the component's own file."""
        section = document.child(owner, f"{SSD}ParameterBindings")
        if section is None:
            return ()
        bindings = []
        for element in document.children(section, (f"{SSD}ParameterBinding",)):
            try:
                bindings.append(self._binding(document, element, definitions, source))
            except PackageError as error:
                if self.errors is None:
                    raise
                self.errors.append(str(error))
        return tuple(bindings)

    def _binding(
        self, document: Document, element: etree._Element, definitions: Definitions, of: Path | None
    ) -> Binding:
        kind = element.get("type", SSV_TYPE)
        if kind != SSV_TYPE:
            raise document.error(element, f"parameter bindings of type '{kind}' are not supported; known: {SSV_TYPE}")
        values = document.child(element, f"{SSD}ParameterValues")
        mapping = document.child(element, f"{SSD}ParameterMapping")
        list(document.children(element, (f"{SSD}ParameterValues", f"{SSD}ParameterMapping")))
        if element.get("source"):  # an empty one is none
            if values is not None:
                raise document.error(element, "a parameter binding has either a source or ParameterValues, not both")
            where, root = self._open(document, element, of)
            parameters = self._set(where, root, None)
        else:
            inline = values.find(f"{SSV}ParameterSet") if values is not None else None
            if inline is None:
                raise document.error(element, "a parameter binding needs a source or ParameterValues")
            parameters = self._set(document, inline, definitions)
        entries = None
        if mapping is not None:
            kind = mapping.get("type", SSM_TYPE)
            if kind != SSM_TYPE:
                raise document.error(
                    mapping, f"parameter mappings of type '{kind}' are not supported; known: {SSM_TYPE}"
                )
            if mapping.get("source"):
                entries = self._mapping(*self._open(document, mapping, of))
            else:
                inline = mapping.find(f"{SSM}ParameterMapping")
                if inline is None:
                    raise document.error(mapping, "a parameter mapping needs a source or a ParameterMapping inside")
                entries = self._mapping(document, inline)
        prefix = element.get("prefix", "")
        _check_given_once(parameters, None if entries is None else {e.source.removeprefix(prefix) for e in entries})
        return Binding(parameters, prefix, entries, document.where(element))

    def _open(self, document: Document, element: etree._Element, of: Path | None) -> tuple[Document, etree._Element]:
        source, base = element.get("source", ""), element.get("sourceBase", "SSD")
        if base not in ("SSD", "component"):
            raise document.error(element, f"sourceBase '{base}' is not supported; known: SSD, component")
        if base == "SSD":
            path, _ = inside(document, element, source, self.folder, self.root)
            opened = opened_at(document, element, path, f"{self.prefix}{_shown(path, self.root)}")
        else:
            opened = self._of_component(document, element, source, of)
        self.unused.add(opened, opened.root)
        return opened, opened.root

    def _of_component(self, document: Document, element: etree._Element, source: str, of: Path | None) -> Document:
        """A file inside the component's own archive, or beside it."""
        if of is None:
            raise document.error(element, "sourceBase 'component' on a system, which has no source")
        is_archive = of.suffix.lower() != ".ssd"
        if is_archive and (document_inside := _in_archive(of, source)) is not None:
            return document_inside
        path, _ = inside(document, element, source, of.parent, self.root)
        if not path.is_file():
            where = f"neither in {of.name} nor beside it" if is_archive else f"not beside {of.name}"
            raise document.error(element, f"'{source}' is {where}")
        return Document(path, _shown(path, self.root))

    def _check(self, document: Document, root: etree._Element, tag: str) -> None:
        if root.tag != tag:
            raise document.error(
                root, f"<{etree.QName(root).localname}> is not a {tag.rpartition('}')[2]} of SSP 1.0 or 2.0"
            )
        for text in violations(document, root, version(document, root)):
            self.remark(text)

    def _set(self, document: Document, root: etree._Element, outer: Definitions | None) -> tuple[Parameter, ...]:
        self._check(document, root, f"{SSV}ParameterSet")
        definitions = Definitions(document, root, SSV, outer)
        sections = list(document.children(root, (f"{SSV}Parameters", f"{SSV}Units", f"{SSV}Enumerations")))
        parameters: dict[str, Parameter] = {}
        for section in sections:
            if section.tag != f"{SSV}Parameters":
                continue
            for element in document.children(section, (f"{SSV}Parameter",)):
                name = document.name(element)
                if name in parameters:
                    parameters[name] = replace(parameters[name], again=document.where(element))
                    continue
                tags = [f"{SSV}{kind}" for kind in TYPE_KINDS]
                typed = [e for e in document.children(element, (*tags, f"{SSC}Dimension")) if e.tag in tags]
                if not typed:
                    raise document.error(element, f"parameter '{name}' has no value")
                if len(typed) > 1:
                    raise document.error(typed[1], f"parameter '{name}' has more than one value")
                type = typed_as(document, element, typed[0], definitions)
                value = value_of(document, typed[0], type)
                if isinstance(value, tuple) and len(value) > 1 and not type.dimensions:
                    text = f"parameter '{name}' has {len(value)} values and no <ssc:Dimension>; taken for an array"
                    self.remark(f"{document.where(element)}: {text}")
                parameters[name] = Parameter(name, type, value, document.where(element))
        return tuple(parameters.values())

    def _mapping(self, document: Document, root: etree._Element) -> tuple[MappingEntry, ...]:
        self._check(document, root, f"{SSM}ParameterMapping")
        entries = []
        for element in document.children(root, (f"{SSM}MappingEntry",)):
            list(document.children(element, TRANSFORMATIONS))
            if element.get("source") == "":
                continue  # a template's line that nobody has filled in
            entries.append(
                MappingEntry(
                    document.name(element, "source"), document.name(element, "target"),
                    transformation_of(document, element), document.truth(element, "suppressUnitConversion"),
                    document.where(element),
                )
            )  # fmt: skip
        return tuple(entries)


def read_set(path: Path, remark: Remark) -> tuple[Parameter, ...]:
    """The parameters of an .ssv file that stands alone. Raises `PackageError` naming file and line."""
    if not path.is_file():
        raise PackageError(f"{path}: no such file")
    document = Document(path, path.name)
    parameters = Bindings(path.parent, path.parent, remark)._set(document, document.root, None)
    _check_given_once(parameters, None)
    return parameters


def _check_given_once(parameters: Iterable[Parameter], used: Collection[str] | None) -> None:
    """Raise `PackageError` where a parameter that is used, all where `used` is None, is given twice."""
    for p in parameters:
        if p.again and (used is None or p.name in used):
            raise PackageError(f"{p.again}: parameter '{p.name}' is given twice")


def _in_archive(path: Path, source: str) -> Document | None:
    """A file of an FMU's or a package's archive; None where it has none of that name."""
    try:
        name = unquote(urlsplit(source).path)
        with zipfile.ZipFile(path) as archive:
            entry = {normpath(name_in(e)): e for e in archive.infolist()}.get(normpath(normalize("NFC", name)))
            if entry is None:
                return None
            shown = f"{path.name}/{name_in(entry)}"
            if entry.file_size > MAX_XML:
                raise PackageError(f"{shown}: larger than {MAX_XML // 1024**2} MB; refused")
            return Document(BytesIO(archive.read(entry)), shown)
    except (OSError, zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, ValueError) as error:
        raise PackageError(f"{path.name}: not a zip archive or damaged ({error})") from None


def _shown(path: Path, root: Path) -> str:
    try:
        return path.resolve().relative_to(root.resolve()).as_posix()
    except ValueError:
        return path.name
