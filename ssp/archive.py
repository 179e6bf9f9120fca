"""Zip archives from strangers: extracted only into the folder given, with bounded size."""

from __future__ import annotations

import lzma
import zipfile
import zlib
from pathlib import Path

from ..core.errors import OutputError, PackageError

MAX_SIZE = 4 * 1024**3
"""Most bytes that an archive may hold unpacked."""


def extract(archive: Path, folder: Path) -> Path:
    """Extract a zip archive into `folder` and return it.

    Raises `PackageError` when the file is missing, is not a zip, is damaged, holds a path that leaves the folder, or
    would unpack to more than `MAX_SIZE`.
    """
    if not archive.exists():
        raise PackageError(f"{archive}: no such file")
    if archive.is_dir():
        raise PackageError(f"{archive}: is a folder, not a package")
    if not archive.is_file():
        raise PackageError(f"{archive}: is not a regular file")
    try:
        with zipfile.ZipFile(archive) as package:
            entries = package.infolist()
            size = sum(entry.file_size for entry in entries)
            if size > MAX_SIZE:
                raise PackageError(f"{archive}: would unpack to {size / 1e9:.1f} GB, more than {MAX_SIZE / 1e9:.1f} GB")
            root = folder.resolve()
            for entry in entries:
                target = (root / entry.filename).resolve()
                if not target.is_relative_to(root) or "\\" in entry.filename:
                    raise PackageError(f"{archive}: entry '{entry.filename}' would leave the package; refused")
            package.extractall(folder)
    except zipfile.BadZipFile as error:
        raise PackageError(f"{archive}: not a zip archive or damaged ({error})") from None
    except (RuntimeError, NotImplementedError, EOFError, ValueError, zlib.error, lzma.LZMAError) as error:
        raise PackageError(f"{archive}: cannot be unpacked ({error})") from None
    except PermissionError as error:
        raise OutputError(f"{error.filename}: {error.strerror}") from None
    except OSError as error:
        raise PackageError(f"{archive}: cannot be unpacked ({error})") from None
    return folder
