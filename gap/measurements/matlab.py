"""MATLAB's .mat files, to version 7.2 (scipy) and 7.3 (h5py), and plain HDF5: named vectors and structs of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..settings import FILE_LIMITS
from .binary import library, table_of_arrays, translate_errors
from .table import MeasurementError, MeasurementTable

OPAQUE = "holds a table, timetable, timeseries or other object, which only MATLAB can read"
REMEDY = "save vectors or a struct of them, or use writetable"


def read(path: Path) -> MeasurementTable:
    """The vectors of a .mat file; members of a struct are called `struct.member`, columns of a matrix `name(:,k)`."""
    with path.open("rb") as file:
        start = file.read(1024)
    if start.startswith(b"MATLAB 7.3") or start.startswith(b"\x89HDF") or start[512:516] == b"\x89HDF":
        return read_hdf5(path)
    loader = library(path, "scipy.io", "scipy")
    with translate_errors(path, "a MATLAB file"):
        content = loader.loadmat(path, squeeze_me=False, struct_as_record=True)
    arrays: dict[str, Any] = {}
    objects = False
    for name, value in content.items():
        objects = objects or type(value).__name__ == "MatlabOpaque" or name == "None"
        if not name.startswith("__"):
            _add(arrays, name, value, 0)
    return _table(path, arrays, objects)


def read_hdf5(path: Path) -> MeasurementTable:
    """The vectors of an HDF5 file, MATLAB's 7.3 among them."""
    h5py = library(path, "h5py", "h5py")
    arrays: dict[str, Any] = {}
    with translate_errors(path, "HDF5"), h5py.File(path, "r") as file:
        objects = "#subsystem#" in file
        _add_group(h5py, arrays, "", file, 0)
    return _table(path, arrays, objects)


def _add_group(h5py: Any, arrays: dict[str, Any], prefix: str, group: Any, depth: int) -> None:
    matlab = ("MATLAB_class" in value.attrs for value in group.values())
    transpose = any(matlab)
    for name, value in group.items():
        if name.startswith("#"):
            continue
        if isinstance(value, h5py.Group):
            if depth < FILE_LIMITS.deepest_struct:
                _add_group(h5py, arrays, f"{prefix}{name}.", value, depth + 1)
        elif value.dtype.kind in "biuf" and "MATLAB_empty" not in value.attrs and _is_numeric(value):
            array = value[()]
            _add(arrays, f"{prefix}{name}", array.T if transpose else array, depth)


def _is_numeric(dataset: Any) -> bool:
    kind = dataset.attrs.get("MATLAB_class", b"double")
    return kind not in (b"char", b"cell", b"function_handle")


def _add(arrays: dict[str, Any], name: str, value: Any, depth: int) -> None:
    """Put a variable's vectors among the arrays."""
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names is not None:
        if value.size == 1 and depth < FILE_LIMITS.deepest_struct:
            for member in value.dtype.names:
                _add(arrays, f"{name}.{member}", value.reshape(-1)[0][member], depth + 1)
    elif value.dtype.kind in "biuf" and value.size > 1:
        if value.ndim <= 1 or max(value.shape) == value.size:
            arrays[name] = value.reshape(-1)
        elif value.ndim == 2:
            arrays |= {f"{name}(:,{k})": value[:, k - 1] for k in range(1, value.shape[1] + 1)}


def _table(path: Path, arrays: dict[str, Any], objects: bool) -> MeasurementTable:
    """Times may be a member of the only struct there is: its members are then called by their own names."""
    structs = {name.rpartition(".")[0] for name in arrays}
    if len(structs) == 1 and "" not in structs:
        arrays = {name.rpartition(".")[2]: value for name, value in arrays.items()}
    try:
        return table_of_arrays(path, arrays, {})
    except MeasurementError as error:
        if objects:
            raise MeasurementError(f"{path}: {OPAQUE}; {REMEDY}") from None
        raise error
