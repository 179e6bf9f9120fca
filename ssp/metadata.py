"""What a package holds beside what is simulated: files of SSP Traceability, meta data, dictionaries nothing names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lxml import etree

from ..core.errors import PackageError
from .document import SSC, Document, local
from .model import Metadata

TRACEABILITY = {".stmd": "simulation task", ".srmd": "simulation resource"}
"""Simulation Task Meta-Data and Simulation Resource Meta-Data, by suffix."""


def read_metadata(folder: Path, named: Collection[Path], document: Document) -> tuple[Metadata, ...]:
    """Those of an unpacked package; `named` are the signal dictionaries in use, `document` describes the system.

    A file that cannot be read is one of them, with the reason: nothing that is simulated depends on it.
    """
    found = list(_meta_data(document, folder))
    for path in sorted(p for p in folder.rglob("*") if p.suffix.lower() in (*TRACEABILITY, ".ssb") and p.is_file()):
        if path.resolve() in named:
            continue
        shown = path.relative_to(folder).as_posix()
        kind = TRACEABILITY.get(path.suffix.lower(), "signal dictionary that nothing names")
        try:
            content = Document(path, shown)
        except PackageError as error:
            found.append(Metadata(shown, kind, "", (str(error).removeprefix(f"{shown}: "),)))
            continue
        traced = path.suffix.lower() in TRACEABILITY
        lines = [*_phases(content, folder), *_classified(content.root)] if traced else _entries(content)
        found.append(Metadata(shown, kind, content.root.get("name", ""), tuple(lines)))
    return tuple(found)


def _meta_data(document: Document, folder: Path) -> Iterator[Metadata]:
    """Meta data that elements of the system's description refer to, or have inside."""
    for element in document.root.iter(f"{SSC}MetaData"):
        owner = element.getparent()
        source = element.get("source")
        of = f"of {local(owner)}" + (f" '{owner.get('name')}'" if owner.get("name") else "")
        title = f"meta data ({element.get('kind', 'general')}) {of}"
        shown = "inside" if source is None else _shown(source, Path(str(document.path)).parent, folder)
        yield Metadata(document.where(element), title, "", (f"{element.get('type', '')} {shown}".strip(),))


def _phases(document: Document, folder: Path) -> Iterator[str]:
    """A line for each phase of a simulation task: its steps, and the resources that they name."""
    base = Path(str(document.path)).parent
    for phase in document.root:
        if not local(phase).endswith("Phase"):
            continue
        steps = []
        for step in phase:
            named = [r.get("source") for r in step.iter() if local(r) == "Resource" and r.get("source")]
            resources = f" ({', '.join(_shown(source, base, folder) for source in named)})" if named else ""
            steps.append(local(step) + resources)
        yield f"{local(phase)}: {', '.join(steps)}" if steps else local(phase)


def _classified(root: etree._Element) -> Iterator[str]:
    """keyword: text, for the entries of classifications, in which resources are described."""
    for entry in root.iter():
        if local(entry) == "ClassificationEntry":
            yield f"{entry.get('keyword', '')}: {' '.join(''.join(entry.itertext()).split())}"


def _entries(document: Document) -> list[str]:
    names = [e.get("name", "") for e in document.root if local(e) == "DictionaryEntry"]
    twice = [name for name, count in Counter(names).items() if count > 1]
    return [f"entries: {', '.join(names)}" + (f"; twice: {', '.join(twice)}" if twice else "")]


def _shown(source: str, base: Path, folder: Path) -> str:
    """A source as it stands there, and whether it is a file of the package that is missing."""
    try:
        parts = urlsplit(source)
        if parts.scheme or parts.netloc or not parts.path:
            return source
        path = base / unquote(parts.path)
        exists = path.resolve().is_relative_to(folder.resolve()) and path.exists()
    except (OSError, ValueError):
        exists = False
    return source if exists else f"{source}, which is missing"
