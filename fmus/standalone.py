"""The Python that an FMU carries with it (`cosim-fmus build --standalone`): library, modules and packages, trimmed.

The FMU then runs on a machine of the same kind (Linux, this processor family, a C library that is not older) without
Python. Its kernels are compiled when it is built (`ahead`), so numba stays behind.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from ..core.errors import PackageError
from ..core.scratch import scratch

HOME = "resources/python"
"""Where it lies in the FMU; Python's home."""

VERSION = f"python{sys.version_info.major}.{sys.version_info.minor}"

UNUSED = {
    "test", "tests", "idlelib", "tkinter", "turtledemo", "ensurepip", "lib2to3", "pydoc_data", "distutils", "venv",
    "site-packages", "__pycache__", "curses", "dbm", "sqlite3", "wsgiref", "xmlrpc", "turtle.py",
}  # fmt: skip
"""Parts of the standard library that no FMU needs."""

UNUSED_MODULES = ("_test", "_tkinter", "_curses", "_dbm", "_gdbm", "_sqlite3", "xx", "_ctypes_test", "nis",
                  "ossaudiodev", "_codecs_", "readline", "_ssl", "_hashlib")  # fmt: skip
"""Beginnings of the names of extension modules likewise."""

TRIM = {
    "numpy": ("tests", "f2py", "distutils", "typing", "testing/tests", "_pyinstaller", "include", "random/lib"),
    "mujoco": ("studio", "mjx", "plugin", "include", "usd", "doc", "sysid", "testdata", "rollout.py", "introspect",
               "_render_filament", "_simulate", "_rollout", "libmujoco_filament"),
}  # fmt: skip
"""Parts of packages that no FMU needs, by the beginning of their path."""

KEPT = (".py", ".so", ".json")

LICENCE = re.compile("licen[cs]e|copying|notice", re.IGNORECASE)
"""Names of files with licences."""


def files(packages: Sequence[str]) -> dict[str, bytes]:
    """The runtime with these packages, by path in the FMU."""
    from .build import interpreter

    _, library = interpreter().splitlines()
    lib = f"{HOME}/lib"
    made = {f"{lib}/{Path(library).name}": _stripped(Path(library))}
    stdlib = Path(sysconfig.get_path("stdlib"))
    for path in _below(stdlib):
        inside = path.relative_to(stdlib)
        if UNUSED.isdisjoint(inside.parts) and not inside.parts[0].startswith("config-"):
            if inside.parts[0] == "lib-dynload" and inside.name.startswith(UNUSED_MODULES):
                continue
            made[f"{lib}/{VERSION}/{inside.as_posix()}"] = _stripped(path)
    for package in packages:
        made |= {f"{lib}/{VERSION}/site-packages/{name}": content for name, content in _package(package).items()}
    foreign = _foreign_libraries(made, Path(library))
    for path in foreign:
        made[f"{lib}/preload/{path.name}"] = path.read_bytes()
    made |= _licences(packages, foreign)
    made["resources/python.txt"] = f"python/bin/python3\npython/lib/{Path(library).name}\n".encode()
    return made


def _below(folder: Path) -> Iterator[Path]:
    return (p for p in sorted(folder.rglob("*")) if p.is_file() and (p.suffix in KEPT or ".so." in p.name))


def _package(name: str) -> dict[str, bytes]:
    """The files of an installed package that are needed, with the libraries beside it, by path below site-packages."""
    spec = find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        raise PackageError(f"--standalone: the files of {name} are not found")
    folder = Path(next(iter(spec.submodule_search_locations)))
    made = {}
    for place in (folder, folder.with_name(f"{folder.name}.libs")):
        for path in _below(place) if place.is_dir() else ():
            inside = path.relative_to(place)
            if not UNUSED.isdisjoint(inside.parts) or inside.as_posix().startswith(TRIM.get(name, ())):
                continue
            made[path.relative_to(folder.parent).as_posix()] = _stripped(path)
    return made


def _licences(packages: Sequence[str], libraries: Sequence[Path]) -> dict[str, bytes]:
    """The licences of all that is carried, as far as this machine has their texts, by path in the FMU."""
    found = {"python": [Path(sysconfig.get_path("stdlib")) / "LICENSE.txt"]}
    for package in (*packages, "pythonfmu", "deepsea-cosim"):
        files = metadata.files(package) or []
        found[package] = [Path(str(f.locate())) for f in files if LICENCE.search(f.name)]
    for library in libraries:
        found[library.name] = [_copyright(library)]
    return {
        f"documentation/licenses/{name}/{place}{path.name}": path.read_bytes()
        for name, paths in found.items()
        for path in paths
        for place in [f"{path.parent.name}/" if len({p.name for p in paths}) < len(paths) else ""]
        if path.is_file()
    }


def _copyright(library: Path) -> Path:
    """Where Debian and its kin tell of a library's licence; a path that does not exist where they do not."""
    if not shutil.which("dpkg"):
        return Path("/nowhere")
    for path in (library, library.resolve()):
        told = subprocess.run(["dpkg", "-S", str(path)], capture_output=True, text=True).stdout
        if told:
            return Path("/usr/share/doc") / told.partition(":")[0] / "copyright"
    return Path("/nowhere")


def _stripped(path: Path) -> bytes:
    """A file; a library without its symbols for debugging, where there is `strip`."""
    if ".so" not in path.name or ".libs" in str(path) or not shutil.which("strip"):
        return path.read_bytes()  # what auditwheel has patched does not survive it
    with scratch("library") as place:
        copy = place / path.name
        shutil.copy(path, copy)
        subprocess.run(["strip", "--strip-unneeded", str(copy)], capture_output=True)
        return copy.read_bytes()


SYSTEM = ("libc.so", "libm.so", "libdl.so", "libpthread.so", "librt.so", "libutil.so", "ld-linux", "linux-vdso",
          "libgcc_s.so", "libstdc++.so")  # fmt: skip
"""What every Linux has."""


def _foreign_libraries(made: dict[str, bytes], library: Path) -> list[Path]:
    """Libraries of this system that Python's and the standard library's modules need and other systems may not have."""
    folder = Path(sysconfig.get_path("stdlib")) / "lib-dynload"
    users = [library, *(folder / Path(name).name for name in made if "/lib-dynload/" in name)]
    found: dict[str, Path] = {}
    for user in users:
        told = subprocess.run(["ldd", str(user)], capture_output=True, text=True).stdout
        for line in told.splitlines():
            name, arrow, place = line.partition("=>")
            path = Path(place.split("(")[0].strip()) if arrow else None
            if path is not None and path.is_file() and not name.strip().startswith((*SYSTEM, "libpython")):
                found[path.name] = path
    return [found[name] for name in sorted(found)]
