"""Writing where the user said, and when a file was written."""

from __future__ import annotations

import ctypes
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from .errors import OutputError
from .regular import require_regular


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Around what writes to the path: raises `OutputError` in one line when the disk or the rights do not allow it."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A place beside a file to write its successor to, which takes the file's place at once when it is complete; what
    was there stays if that fails. Raises `OutputError`, as `writing` does, and for what is no file."""
    if path.exists() and not path.is_file():
        require_regular(path, OutputError)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        with writing(path):
            if part.is_symlink() or (part.exists() and not part.is_file()):  # a pipe would wait for who reads it
                part.unlink()
            yield part
            part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def write_together(folder: Path, texts: Mapping[str, str]) -> None:
    """Write texts into files of a folder, by name: none takes its place before all are complete. Raises
    `OutputError`."""
    with ExitStack() as stack:
        for name, text in texts.items():
            stack.enter_context(replacing(folder / name)).write_text(text, encoding="utf-8")


def name_of_results(package: Path) -> str:
    """What a folder for the results of a package is called: its name, which may be nothing but dots."""
    return package.stem.strip(". ") or "run"


def is_same_file(one: Path | None, other: Path) -> bool:
    """Whether two paths are one file that is there."""
    try:
        return one is not None and one.samefile(other)
    except OSError:
        return False


def changed(path: Path) -> int:
    """When a file was written last [ns]; 0 where that is not known."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def working_folder() -> Path:
    """The folder that this process works in; raises `OutputError` where that has been removed."""
    try:
        return Path.cwd()
    except OSError:
        raise OutputError("the folder this runs in does not exist any more: change to another") from None


@contextmanager
def returning() -> Iterator[Path]:
    """Come back to the folder that this process works in, for strangers' code may change it; gives that folder."""
    here = working_folder()
    try:
        yield here
    finally:
        with suppress(OSError):
            os.chdir(here)


def exchange(one: Path, other: Path) -> None:
    """Swap two files or folders at once: nobody, however it ends, sees one of them missing.

    Where the system cannot (Linux alone can), one is away for a moment, as `.<name>.away...` beside it.
    """
    with suppress(OSError, AttributeError):
        here, swap = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
        if ctypes.CDLL(None).renameat2(here, os.fsencode(one), here, os.fsencode(other), swap) == 0:
            return
    away = other.with_name(f".{other.name}.away{os.getpid()}")
    other.rename(away)
    one.rename(other)
    away.rename(one)


@contextmanager
def held(folder: Path, by: str) -> Iterator[None]:
    """Hold a folder; raises `OutputError` where another process or thread does, `by` says what that is.

    The lock goes with its holder, however that ends. Where folders cannot be locked (Windows, some file servers)
    everybody holds them.
    """
    try:
        import fcntl

        file = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(f"{folder}: {by} is writing there") from None
        except OSError:
            pass
        yield
    finally:
        os.close(file)


def make_folder(path: Path) -> None:
    """Make the folder and those above it; raises `OutputError` where that, or a file in it, is not possible."""
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
