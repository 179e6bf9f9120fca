"""Zip archives whatever the clock says: they know no time before 1980 nor after 2107."""

from __future__ import annotations

import zipfile
from pathlib import Path


def new_archive(file: Path) -> zipfile.ZipFile:
    """An archive to be written; files of other times than it knows are dated to the nearest that it does."""
    return zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False)


def add(archive: zipfile.ZipFile, name: str, content: str | bytes) -> None:
    """Write content into an archive as a file of that name, dated to 1980."""
    entry = zipfile.ZipInfo(name)
    entry.compress_type, entry.external_attr = archive.compression, 0o600 << 16
    archive.writestr(entry, content, compresslevel=archive.compresslevel)
