"""Finds out which format a file of measurements has, and reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...core.regular import require_regular
from . import delimited_text, matlab, mdf, parquet, tdms
from .table import MeasurementError, MeasurementTable, TextFormat


@dataclass(frozen=True)
class BinaryFormat:
    """A format that is known by how its files begin, or by their suffix."""

    name: str
    begins: tuple[bytes, ...]
    suffixes: tuple[str, ...]
    read: Callable[[Path], MeasurementTable]


FORMATS = (
    BinaryFormat("MATLAB", (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"), (".mat",), matlab.read),
    BinaryFormat("HDF5", (b"\x89HDF\r\n\x1a\n",), (), matlab.read_hdf5),
    BinaryFormat("Parquet", (b"PAR1",), (), parquet.read),
    BinaryFormat("TDMS", (b"TDSm",), (), tdms.read),
    BinaryFormat("MDF", (b"MDF     ", b"UnFinMF "), (), mdf.read),
)

REMEDIES = {
    b"PK\x03\x04": "is a spreadsheet or an archive; save its table as CSV",
    b"\xd0\xcf\x11\xe0": "is a spreadsheet of the old kind; save its table as CSV",
    b"\x1f\x8b": "is compressed; unpack it",
    b"\xff\xfe": "is a text file in UTF-16; save it in UTF-8",
    b"\xfe\xff": "is a text file in UTF-16; save it in UTF-8",
}
"""What other files begin with, and what to do with them."""


def read_table(path: Path, form: TextFormat = TextFormat()) -> MeasurementTable:
    """The table in a file of any known format; text where it begins like none of them.

    Raises `MeasurementError` for a file that is not a regular one (a device or a pipe may never end), that cannot be
    read, or whose library is not installed.
    """
    require_regular(path, MeasurementError)
    try:
        with path.open("rb") as file:
            start = file.read(64)
    except OSError as error:
        raise MeasurementError(f"{path}: cannot be read ({error.strerror})") from None
    for file_format in FORMATS:
        if start.startswith(file_format.begins) or path.suffix.lower() in file_format.suffixes:
            return file_format.read(path)
    for begin, remedy in REMEDIES.items():
        if start.startswith(begin):
            raise MeasurementError(f"{path}: {remedy}")
    return delimited_text.read(path, form)
