"""Reads an SSP package into the records of `model`. What is not supported is refused by name, never skipped."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from hashlib import blake2b
from itertools import islice
from pathlib import Path

from lxml import etree

from ..core.errors import PackageError, UsageError, did_you_mean
from ..core.units import conversion
from .annotations import (
    ANSWERS_ANNOTATION,
    REPLAY_ANNOTATION,
    STEP_ANNOTATION,
    Unused,
    answers_asked,
    replay_asked,
    step_hint,
    step_of_others,
)
from .archive import UnpackLimits, extract
from .document import SSB, SSC, SSD, Document, local, version, violations
from .metadata import read_metadata
from .model import (
    AnswersAsked,
    Component,
    Connection,
    Connector,
    ReplayAsked,
    SignalDictionaryReference,
    System,
    SystemStructure,
    Type,
)
from .parameters import Bindings, inside, nearest, opened_at
from .values import TRANSFORMATIONS, TYPES, Definitions, transformation_of, type_of

FMU = "application/x-fmu-sharedlibrary"
DEFINITION = "application/x-ssp-definition"
PACKAGE = "application/x-ssp-package"
DICTIONARY = "application/x-ssp-signal-dictionary"
USUAL = {".ssp": PACKAGE, ".ssd": DEFINITION}
"""What a component is by its file that nothing says to be another; else an FMU."""

CONNECTOR_KINDS = (
    "input", "output", "parameter", "calculatedParameter", "structuralParameter", "constant", "local", "inout",
    "unspecified",
)  # fmt: skip

DEFAULT = "SystemStructure.ssd"
NEAR = 1000
"""Entries of a folder, and of those in it, that are looked at for a package."""

MAX_LEVELS = 32
"""Deepest nesting of packages in packages."""


def read(
    package: Path, folder: Path, variant: str | None = None, errors: list[str] | None = None
) -> SystemStructure:  # fmt: skip
    """Extract the SSP file `package` into `folder` and read one of its system structure descriptions.

    Raises `PackageError` naming file, line and remedy when the package is damaged or uses what is not supported; with a
    list `errors`, what is wrong with an element or a connection goes there, and the others are read.
    """
    limits = UnpackLimits()
    extract(package, folder, limits)
    return _Reader(folder, limits, errors=errors).read(variant, f"{package}: ")


def read_folder(
    folder: Path, scratch: Path, variant: str | None = None, errors: list[str] | None = None
) -> SystemStructure:  # fmt: skip
    """Read a system structure description of a folder that is no archive; see `read`.

    scratch: where packages that lie in it are unpacked, for nothing is written into the folder itself.
    """
    return _Reader(folder, UnpackLimits(), errors=errors, scratch=scratch).read(variant, f"{folder}: ")


def no_package(files: Collection[str]) -> str:
    """What to say of files of which none is `SystemStructure.ssd`."""
    variants = sorted(name for name in files if name.endswith(".ssd") and "/" not in name)
    more = f"; it has {', '.join(variants)}: choose with --variant" if variants else ""
    deeper = [name for name in files if name.endswith(f"/{DEFAULT}")]
    if deeper and not variants:
        inside = deeper[0].removesuffix(DEFAULT)
        more = f", but one is in '{inside}'; pack what is inside that folder, not the folder itself"
        return f"{DEFAULT} is missing at the top of the package{more}"
    if "modelDescription.xml" in files:
        more = " but an FMU; a package with a SystemStructure.ssd has to say how it is run"
    return f"{DEFAULT} is missing: this is not an SSP package{more}"


class _Reader:
    """A folder of an extracted package; other folders, and packages inside it, get readers of their own."""

    def __init__(
        self, folder: Path, limits: UnpackLimits, depth: int = 0, remarks: list[str] | None = None,
        outer: _Reader | None = None, prefix: str = "", errors: list[str] | None = None, scratch: Path | None = None,
        unused: Unused | None = None,
    ):  # fmt: skip
        self.folder, self.limits, self.depth = folder, limits, depth
        self.errors = errors
        self.scratch: Path | None = outer.scratch if outer is not None else scratch
        """Where packages inside are unpacked; None: beside themselves."""
        self.remarks: list[str] = [] if remarks is None else remarks
        self.unused = Unused() if unused is None else unused
        self.root: Path = outer.root if outer is not None else folder
        """The package's folder."""
        self.prefix: str = outer.prefix if outer is not None else prefix
        """What names of files begin with in messages: the package that this one lies in."""
        self.documents: dict[str, Document] = {}
        """Descriptions that have been read."""
        self.dictionaries_read: set[Path] = outer.dictionaries_read if outer is not None else set()
        """Files of signal dictionaries that the descriptions name."""
        self.bindings = Bindings(folder, self.root, self.remarks.append, self.prefix, errors, self.unused)
        self.open: list[str] = outer.open if outer is not None else []
        """Descriptions and referenced systems that are being read, to notice one that contains itself."""

    @contextmanager
    def _opened(self, key: str) -> Iterator[None]:
        """While a description or a referenced system is read."""
        self.open.append(key)
        try:
            yield
        finally:
            self.open.pop()

    def _refuse(self, error: PackageError) -> None:
        """Collect what is wrong with a part, or raise it."""
        if self.errors is None:
            raise error
        self.errors.append(str(error))

    def variants(self) -> list[str]:
        """File names of the package's descriptions, the default first."""
        names = sorted(p.name for p in self.folder.glob("*.ssd") if p.is_file())
        return sorted(names, key=lambda name: name != DEFAULT)

    def read(self, variant: str | None = None, shown: str = "") -> SystemStructure:
        names = self.variants()
        if variant is None:
            if DEFAULT not in names:
                near = [p for pattern in ("*", "*/*") for p in islice(self.folder.glob(pattern), NEAR)]
                files = [p.relative_to(self.folder).as_posix() for p in near if p.is_file()]
                raise PackageError(shown + no_package(files))
            return self._whole(DEFAULT, names)
        if variant not in names and f"{variant}.ssd" in names:
            variant = f"{variant}.ssd"
        if variant not in names:
            titled = [n for n in names if self._title(n) == variant]
            if len(titled) != 1:
                hint = did_you_mean(variant, names)
                available = ", ".join(names) or "none"
                if titled:
                    raise PackageError(f"{shown}{', '.join(titled)} are all named '{variant}': give the file's name")
                raise PackageError(f"{shown}the package has no variant '{variant}'; it has {available}{hint}")
            variant = titled[0]
        return self._whole(variant, names)

    def _whole(self, name: str, variants: list[str]) -> SystemStructure:
        """The description with what belongs to the package as a whole."""
        structure = self.description(name)
        metadata = () if self.depth else read_metadata(self.folder, self.dictionaries_read, self.documents[name])
        return replace(structure, variants=tuple(variants), metadata=metadata)

    def _title(self, name: str) -> str | None:
        with suppress(PackageError):  # one that is damaged has none; it need not be the one that is meant
            title: str | None = Document(self.folder / name, name).root.get("name")
            return title
        return None

    def description(self, name: str) -> SystemStructure:
        """The description in a file of the folder."""
        shown = self.prefix + (self.folder / name).resolve().relative_to(self.root.resolve()).as_posix()
        if shown in self.open:
            raise PackageError(f"{shown}: the system contains itself ({' -> '.join([*self.open, shown])})")
        if len(self.open) + self.depth > MAX_LEVELS:
            raise PackageError(f"{shown}: nested more than {MAX_LEVELS} levels deep; refused")
        self.documents[name] = document = Document(self.folder / name, shown)
        root = document.root
        if root.tag != f"{SSD}SystemStructureDescription":
            raise document.error(root, f"root element {root.tag} is not that of SSP 1.0 or 2.0")
        of = version(document, root)
        self.remarks += violations(document, root, of)
        self.unused.add(document, root)
        sections = [f"{SSD}{s}" for s in ("System", "Enumerations", "Units", "DefaultExperiment")]
        list(document.children(root, sections))
        definitions = Definitions(document, root, SSD)
        element = document.child(root, f"{SSD}System")
        if element is None:
            raise document.error(root, "no <System>")
        with self._opened(shown):
            system = self.system(document, element, definitions)
        experiment = document.child(root, f"{SSD}DefaultExperiment")
        start = stop = step = method = None
        bonds: list[tuple[str, str]] = []
        answers, replay = AnswersAsked(), ReplayAsked()
        if experiment is not None:
            start, stop = document.number(experiment, "startTime"), document.number(experiment, "stopTime")
            for annotation in experiment.iterfind(f"{SSD}Annotations/{SSC}Annotation"):
                if annotation.get("type") == STEP_ANNOTATION and len(annotation):
                    step, method = document.number(annotation[0], "stepSize"), annotation[0].get("method")
                    for bond in annotation[0]:
                        bonds.append((document.name(bond, "a"), document.name(bond, "b")))
                elif annotation.get("type") == ANSWERS_ANNOTATION:
                    answers = answers_asked(document, annotation)
                elif annotation.get("type") == REPLAY_ANNOTATION:
                    replay = replay_asked(document, annotation)
        if step is None and experiment is not None:  # the schema has none there, but some tools do
            step = document.number(experiment, "stepSize")
        if step is None:
            step = step_of_others(document, [e for e in (experiment, element) if e is not None])
        title = system.name or root.get("name") or "system"
        return SystemStructure(
            title, of, self.folder / name, system, start or 0.0, stop, step, (name,), tuple(bonds), tuple(self.remarks),
            method, self.unused.lines(), answers=answers, replay=replay,
        )

    def system(self, document: Document, element: etree._Element, definitions: Definitions, level: int = 0) -> System:
        if level > MAX_LEVELS:
            raise document.error(element, f"systems are nested more than {MAX_LEVELS} levels deep; refused")
        name = element.get("name", "") if level == 0 else document.name(element)
        sections = ("Connectors", "ParameterBindings", "Elements", "Connections", "SignalDictionaries")
        list(document.children(element, [f"{SSD}{s}" for s in sections]))
        elements: list[Component | System | SignalDictionaryReference] = []
        broken: set[str] = set()
        section = document.child(element, f"{SSD}Elements")
        if section is not None:
            tags = [f"{SSD}{t}" for t in ("Component", "System", "SignalDictionaryReference")]
            for child in document.children(section, tags):
                self.limits.element(document.where(child))
                try:
                    if child.tag == f"{SSD}System":
                        elements.append(self.system(document, child, definitions, level + 1))
                    elif child.tag == f"{SSD}Component":
                        elements.append(self.component(document, child, definitions))
                    else:
                        elements.append(self.reference(document, child, definitions))
                except PackageError as error:
                    self._refuse(error)
                    broken.add(child.get("name", ""))
        places: dict[str, str] = {}
        for e in list(elements):
            if e.name in places:
                text = f"two components are called '{e.name}', the other one in {places[e.name]}"
                self._refuse(PackageError(f"{e.where}: {text}"))
                elements.remove(e)
            places.setdefault(e.name, e.where)
        return System(
            name,
            self.connectors(document, element, definitions),
            tuple(elements),
            self.connections(document, element),
            self.bindings.read(document, element, definitions),
            self.dictionaries(document, element, definitions),
            document.where(element),
            broken=frozenset(broken),
        )

    def connectors(self, document: Document, owner: etree._Element, definitions: Definitions) -> tuple[Connector, ...]:
        section = document.child(owner, f"{SSD}Connectors")
        if section is None:
            return ()
        connectors: dict[str, Connector] = {}
        for element in document.children(section, (f"{SSD}Connector",)):
            name, kind = document.name(element), document.attribute(element, "kind")
            if kind not in CONNECTOR_KINDS:
                raise document.error(
                    element, f"connector '{name}': kind '{kind}' is not supported{did_you_mean(kind, CONNECTOR_KINDS)}"
                )
            if name in connectors:
                raise document.error(element, f"two connectors are called '{name}'")
            list(document.children(element, (*TYPES, f"{SSC}Dimension", f"{SSD}Clock")))
            type = None if _of_modelica(element) else type_of(document, element, definitions, clocks=True)
            clocked = element.find(f"{SSD}Clock") is not None or (type is not None and type.kind == "Clock")
            connectors[name] = Connector(name, kind, type, document.where(element), clocked)
        for connector in connectors.values():
            for size in connector.type.dimensions if connector.type is not None else ():
                if isinstance(size, str) and size not in connectors:
                    hint = did_you_mean(size, list(connectors))
                    raise PackageError(f"{connector.where}: sizeConnector '{size}' is not a connector{hint}")
        return tuple(connectors.values())

    def component(self, document: Document, element: etree._Element, definitions: Definitions) -> Component | System:
        name, kind = document.name(element), element.get("type", FMU)
        list(document.children(element, (f"{SSD}Connectors", f"{SSD}ParameterBindings")))
        if kind not in (FMU, DEFINITION, PACKAGE):
            raise document.error(
                element,
                f"component '{name}' has type '{kind}', which is not supported; known: {FMU}, {PACKAGE}, {DEFINITION}",
            )
        implementation = element.get("implementation") or "any"
        if implementation not in ("any", "CoSimulation"):
            raise document.error(
                element, f"component '{name}' asks for {implementation}; only CoSimulation is supported"
            )
        if not element.get("source"):
            raise document.error(element, f"component '{name}' has no source: nothing to simulate")
        source = element.get("source", "")
        if source.startswith("#"):
            return self._embedded(document, element, definitions, name, source[1:])
        path, fragment = inside(document, element, source, self.folder, self.root)
        if path.is_dir():
            raise document.error(element, f"component '{name}': '{source}' is a folder; an FMU is a zip archive")
        if not path.is_file():
            missing = f"'{source}', which is missing in the package{nearest(source, self.folder)}"
            raise document.error(element, f"component '{name}' needs {missing}")
        if kind == FMU:
            kind = USUAL.get(path.suffix.lower(), FMU)
        if kind == DEFINITION and path.suffix.lower() in (".fmu", ".ssp"):
            raise document.error(element, f"component '{name}': '{source}' is no .ssd, as its type '{DEFINITION}' says")
        connectors = self.connectors(document, element, definitions)
        if fragment and kind != PACKAGE:
            raise document.error(element, f"component '{name}': '#{fragment}' of another file is not supported")
        if kind == FMU:
            self.limits.look_into(path)
            bindings = self.bindings.read(document, element, definitions, path)
            return Component(
                name, path, implementation, connectors, bindings, document.where(element),
                step_hint=step_hint(document, element),
            )  # fmt: skip
        if kind == DEFINITION:
            inner = self._beside(path.resolve())
        else:
            inner = self._package(document, element, name, path, fragment)
        return self._as_element(document, element, definitions, name, inner, path)

    def _beside(self, path: Path) -> System:
        """A description in this or another folder of the package."""
        reader = self if path.parent == self.folder.resolve() else _Reader(
            path.parent, self.limits, self.depth, self.remarks, self, errors=self.errors, unused=self.unused
        )  # fmt: skip
        return reader.description(path.name).system

    def _package(self, document: Document, element: etree._Element, name: str, path: Path, fragment: str) -> System:
        if self.depth + 1 > MAX_LEVELS:
            raise document.error(element, f"packages are nested more than {MAX_LEVELS} levels deep; refused")
        folder = path.with_name(f"{path.name}.unpacked")
        if self.scratch is not None:
            folder = self.scratch / f"{blake2b(bytes(path.resolve()), digest_size=8).hexdigest()}.unpacked"
        if not folder.is_dir():
            try:
                extract(path, folder, self.limits)
            except PackageError as error:
                raise document.error(
                    element, f"component '{name}': {str(error).replace(f'{path.parent}/', '')}"
                ) from None
        try:
            prefix = f"{self.prefix}{path.name}/"
            inner = _Reader(
                folder, self.limits, self.depth + 1, self.remarks, prefix=prefix, errors=self.errors, unused=self.unused
            )
            return inner.read(fragment or None).system
        except PackageError as error:
            message = str(error)
            if message.startswith(inner.prefix):
                raise
            raise document.error(element, f"{path.name}: {message}") from None

    def _embedded(
        self, document: Document, element: etree._Element, definitions: Definitions, name: str, id: str
    ) -> System:
        """A system of the same file, used once more."""
        systems = [e for e in document.root.iter(f"{SSD}System") if e.get("id") == id]
        if len(systems) != 1:
            raise document.error(element, f"component '{name}': there is no <System> with the id '{id}'")
        key = f"{document.shown}#{id}"
        if key in self.open:
            raise document.error(element, f"component '{name}': the system '{id}' contains itself")
        if len(self.open) + self.depth > MAX_LEVELS:
            raise document.error(element, f"nested more than {MAX_LEVELS} levels deep; refused")
        with self._opened(key):
            inner = self.system(document, systems[0], definitions)
        return self._as_element(document, element, definitions, name, inner, None)

    def _as_element(
        self,
        document: Document,
        element: etree._Element,
        definitions: Definitions,
        name: str,
        inner: System,
        path: Path | None,
    ) -> System:
        """A system in place of the component that refers to it; the component's bindings come after its own."""
        bindings = self.bindings.read(document, element, definitions, path)
        connectors = {c.name: c for c in inner.connectors}
        outer = dict(inner.outer)
        for connector in self.connectors(document, element, definitions):
            if connector.name not in connectors:
                hint = did_you_mean(connector.name, sorted(connectors))
                raise PackageError(
                    f"{connector.where}: component '{name}' has a connector '{connector.name}' that its system does "
                    f"not have{hint}"
                )
            connectors[connector.name] = _joined(connector, connectors[connector.name], name)
            if connector.type is not None and connector.type.unit is not None:
                outer[connector.name] = connector.type
        return replace(
            inner, name=name, connectors=tuple(connectors.values()), bindings=(*inner.bindings, *bindings), outer=outer,
            where=document.where(element),
        )  # fmt: skip

    def reference(
        self, document: Document, element: etree._Element, definitions: Definitions
    ) -> SignalDictionaryReference:
        list(document.children(element, (f"{SSD}Connectors", f"{SSD}ParameterBindings")))
        if element.find(f"{SSD}ParameterBindings") is not None:
            raise document.error(element, "parameter bindings of a signal dictionary reference are not supported")
        return SignalDictionaryReference(
            document.name(element), document.name(element, "dictionary"),
            self.connectors(document, element, definitions), document.where(element),
        )  # fmt: skip

    def dictionaries(
        self, document: Document, owner: etree._Element, definitions: Definitions
    ) -> dict[str, dict[str, Type]]:
        section = document.child(owner, f"{SSD}SignalDictionaries")
        dictionaries: dict[str, dict[str, Type]] = {}
        if section is None:
            return dictionaries
        for element in document.children(section, (f"{SSD}SignalDictionary",)):
            name, kind = document.name(element), element.get("type", DICTIONARY)
            if name in dictionaries:
                raise document.error(element, f"two signal dictionaries are called '{name}'")
            if kind != DICTIONARY:
                raise document.error(
                    element, f"signal dictionaries of type '{kind}' are not supported; known: {DICTIONARY}"
                )
            if element.get("source"):
                path, _ = inside(document, element, element.get("source"), self.folder, self.root)
                file = opened_at(document, element, path, f"{self.prefix}{path.name}")
                self.dictionaries_read.add(path.resolve())
                root, outer = file.root, None
            else:
                inline = element.find(f"{SSB}SignalDictionary")
                if inline is None:
                    raise document.error(
                        element, f"signal dictionary '{name}' needs a source or a SignalDictionary inside"
                    )
                file, root, outer = document, inline, definitions
            dictionaries[name] = self._dictionary(file, root, outer)
        return dictionaries

    def _dictionary(self, document: Document, root: etree._Element, outer: Definitions | None) -> dict[str, Type]:
        if root.tag != f"{SSB}SignalDictionary":
            raise document.error(root, f"<{local(root)}> is not a SignalDictionary of SSP 1.0 or 2.0")
        self.remarks += violations(document, root, version(document, root))
        self.unused.add(document, root)
        definitions = Definitions(document, root, SSB, outer)
        entries: dict[str, Type] = {}
        for element in document.children(root, [f"{SSB}{s}" for s in ("DictionaryEntry", "Units", "Enumerations")]):
            if element.tag != f"{SSB}DictionaryEntry":
                continue
            name = document.name(element)
            if name in entries:
                raise document.error(element, f"the dictionary has two entries '{name}'")
            type = type_of(document, element, definitions, required=True)
            assert type is not None
            entries[name] = type
        return entries

    def connections(self, document: Document, owner: etree._Element) -> tuple[Connection, ...]:
        section = document.child(owner, f"{SSD}Connections")
        if section is None:
            return ()
        connections = []
        for element in document.children(section, (f"{SSD}Connection",)):
            try:
                connections.append(self._connection(document, element))
            except PackageError as error:
                self._refuse(error)
        return tuple(connections)

    @staticmethod
    def _connection(document: Document, element: etree._Element) -> Connection:
        list(document.children(element, TRANSFORMATIONS))
        return Connection(
            # an empty name is what some tools write for the system itself
            (element.get("startElement") or None, document.name(element, "startConnector")),
            (element.get("endElement") or None, document.name(element, "endConnector")),
            _indices(document, element, "startIndices"),
            _indices(document, element, "endIndices"),
            transformation_of(document, element),
            document.truth(element, "suppressUnitConversion"),
            document.where(element),
        )


def _joined(outer: Connector, inner: Connector, component: str) -> Connector:
    """A connector of a component that is a system: what its system says, and what only the component says."""

    def refuse(what: str, value: object, in_system: object) -> PackageError:
        return PackageError(
            f"{outer.where}: connector '{outer.name}' of component '{component}' is {what} {value}, that of its system "
            f"is {in_system} ({inner.where})"
        )

    if outer.kind != inner.kind and "unspecified" not in (outer.kind, inner.kind):
        raise refuse("of kind", outer.kind, inner.kind)
    if outer.type is None or inner.type is None:
        return replace(inner, type=inner.type or outer.type)
    same = {"Real": "Float64", "Float32": "Float64", "Integer": "Int32"}
    if same.get(outer.type.kind, outer.type.kind) != same.get(inner.type.kind, inner.type.kind):
        raise refuse("a", outer.type.kind, inner.type.kind)
    unit = inner.type.unit or outer.type.unit
    if unit is not None and outer.type.unit is not None and unit.name != outer.type.unit.name:
        try:
            conversion(outer.type.unit, unit)
        except UsageError:
            raise refuse("in", outer.type.unit.name, unit.name) from None
    items = inner.type.enumeration or outer.type.enumeration
    return replace(inner, type=replace(inner.type, unit=unit, enumeration=items))


def _of_modelica(connector: etree._Element) -> bool:
    """Whether a connector is of a Modelica type, which SSP writes as a Binary: the FMUs know what that is."""
    binary = connector.find(f"{SSC}Binary")
    return binary is not None and binary.get("mime-type", "").partition(";")[0].strip() == "text/x-modelica"


def _indices(document: Document, element: etree._Element, name: str) -> tuple[int, ...]:
    text = element.get(name)
    if text is None:
        return ()
    try:
        return tuple(int(part) for part in text.split())
    except ValueError:
        raise document.error(element, f'{name}="{text}" is not a list of integers') from None
