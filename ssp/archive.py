"""Zip archives from strangers: extracted only into the folder given, with bounded size and number of entries."""

from __future__ import annotations

import lzma
import shutil
import stat
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import OutputError, PackageError
from ..core.limits import COMPONENTS, ENTRIES, GIGABYTES, limit, remedy
from .encoding import name_in

GIGA = 1e9
"""Bytes of a gigabyte."""

MAX_RATIO, LARGE = 1000.0, 64 * 1024**2
"""Most that a large entry (bytes) may grow when it is unpacked; deflate itself ends at about 1030."""


@dataclass
class UnpackLimits:
    """Bytes and entries that may still be unpacked, components and systems that may still be there."""

    size: float = field(default_factory=lambda: GIGA * limit(GIGABYTES))
    entries: float = field(default_factory=lambda: limit(ENTRIES))
    elements: float = field(default_factory=lambda: limit(COMPONENTS))
    known: set[Path] = field(default_factory=set)

    def element(self, where: str) -> None:
        """Count an element of a system: a small package can refer to its own parts over and over."""
        self.elements -= 1
        if self.elements < 0:
            most = f"{limit(COMPONENTS):.0f} components and systems"
            raise PackageError(f"{where}: more than {most}; {remedy(COMPONENTS)}")

    def look_into(self, archive: Path) -> None:
        """Count an archive that is unpacked later, once."""
        if archive not in self.known:
            self.known.add(archive)
            try:
                with zipfile.ZipFile(archive) as opened:
                    self.take(archive, opened.infolist())
            except (zipfile.BadZipFile, OSError, ValueError, RuntimeError, NotImplementedError, EOFError):
                return  # told when it is unpacked

    def take(self, archive: Path, entries: list[zipfile.ZipInfo]) -> None:
        """Count an archive, or refuse it."""
        size = sum(entry.file_size for entry in entries)
        if size > self.size:
            more = f"would unpack to {size / GIGA:.3g} GB, more than {self.size / GIGA:.3g} GB"
            needed = limit(GIGABYTES) + (size - self.size) / GIGA
            raise PackageError(f"{archive}: {more}; {remedy(GIGABYTES, needed + 0.1)}")
        if len(entries) > self.entries:
            more = f"holds {len(entries)} entries, more than {self.entries:.0f}"
            needed = limit(ENTRIES) + len(entries) - self.entries
            raise PackageError(f"{archive}: {more}; {remedy(ENTRIES, needed)}")
        for entry in entries:
            growth = entry.file_size / max(1, entry.compress_size)
            if entry.file_size > LARGE and growth > MAX_RATIO:
                raise PackageError(f"{archive}: entry '{entry.filename}' would grow {growth:.0f} times; refused")
        self.size, self.entries = self.size - size, self.entries - len(entries)


def extract(archive: Path, folder: Path, limits: UnpackLimits | None = None) -> Path:
    """Extract a zip archive into `folder` and return it.

    Raises `PackageError` when the file is missing, is not a zip, is damaged, holds a path that leaves the folder or a
    link, or would unpack to more than what the limits leave. What was unpacked until then stays in the folder.
    """
    if not archive.exists():
        raise PackageError(f"{archive}: no such file")
    if archive.is_dir():
        raise PackageError(f"{archive}: is a folder, no zip archive")
    if not archive.is_file():
        raise PackageError(f"{archive}: is not a regular file")
    try:
        with zipfile.ZipFile(archive) as package:
            entries = package.infolist()
            (limits or UnpackLimits()).take(archive, entries)
            root = folder.resolve()
            for entry in entries:
                entry.filename = name_in(entry)
                target = (root / entry.filename).resolve()
                if "\\" in entry.filename:
                    raise PackageError(
                        f"{archive}: entry '{entry.filename}' has a backslash where archives have '/'; "
                        "pack it anew with another tool"
                    )
                if not target.is_relative_to(root):
                    raise PackageError(f"{archive}: entry '{entry.filename}' would leave the package; refused")
                if stat.S_ISLNK(entry.external_attr >> 16):
                    raise PackageError(f"{archive}: entry '{entry.filename}' is a link; refused")
            folder.mkdir(parents=True, exist_ok=True)
            if shutil.disk_usage(folder).free < sum(entry.file_size for entry in entries):
                raise OutputError(f"{folder}: not enough space to unpack {archive}")
            for entry in entries:
                package.extract(entry, folder)
    except zipfile.BadZipFile as error:
        raise PackageError(f"{archive}: not a zip archive or damaged ({error})") from None
    except (RuntimeError, NotImplementedError, EOFError, ValueError, zlib.error, lzma.LZMAError) as error:
        raise PackageError(f"{archive}: cannot be unpacked ({error})") from None
    except PermissionError as error:
        raise OutputError(f"{error.filename}: {error.strerror}") from None
    except OSError as error:
        raise PackageError(f"{archive}: cannot be unpacked ({error})") from None
    return folder
