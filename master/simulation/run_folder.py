"""Around a run: the result folder and summary.json."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ...core.console import strict_json
from ...core.errors import OutputError, UsageError
from ...core.files import held, make_folder, replacing, writing
from ...core.owned import read_object, refuse_others
from ..results import by_suffix
from .saved_state import STATE_FILE

PAGE = "results.html"
FILES = ("results.csv", "summary.json", "manifest.json", "overview.png", PAGE, STATE_FILE)
LOG_SUFFIXES = (".log", ".txt", ".tsv")
"""Of names of message logs."""

STAGE, SWITCH = ".new", "switch.json"
"""Where a run's files are until there is something to show, and in it, what is to be done as they take their place."""

FAILED = "failed_start"
"""What is known of a run that failed before it had anything to show, in a folder where an earlier one had."""

LONGEST_NAME = 200
"""Bytes of the name of a record or log; files beside it have longer ones."""

TAIL = 1 << 16
"""Bytes at the end of a CSV file in which its last whole row is looked for."""


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json, all or nothing; numbers that are none become null."""
    with replacing(folder / "summary.json") as part:
        part.write_bytes(strict_json(summary))


class RunFolder:
    """The folder of a run. Where an earlier run has left something, the files stand apart, in `place`, until there is
    something to show: what was there is whole until then, and gone afterwards."""

    def __init__(self, folder: Path, results: str, log: str):
        self.folder = folder
        self._own = tuple(filter(None, (results, log)))
        left = earlier(folder, "results", tuple(by_suffix())), earlier(folder, "log", LOG_SUFFIXES)
        self._left = tuple(dict.fromkeys(filter(None, (*FILES, *left, *self._own))))
        if not is_of_a_run(folder):
            refuse_others(folder, self._left, "a run")
        for name in self._left:
            _check_replaceable(folder / name)
        self.place = folder / STAGE if self.has_earlier else folder
        """Where its files are now."""
        with writing(self.place):
            _clear_stage(folder)
            for name in self._own:
                (self.place / name).parent.mkdir(parents=True, exist_ok=True)
            self.place.mkdir(exist_ok=True)

    @property
    def is_shown(self) -> bool:
        """Whether its files are where they are looked for."""
        return self.place == self.folder

    @property
    def has_earlier(self) -> bool:
        """Whether an earlier run has left something in the folder."""
        return any((self.folder / name).exists() for name in self._left)

    def show(self) -> None:
        """Put the files in their place, and remove what an earlier run left; raises `OutputError`."""
        if self.is_shown:
            return
        order = {"move": [n for n in (*FILES, *self._own) if (self.place / n).exists()], "remove": list(self._left)}
        with writing(self.place), replacing(self.place / SWITCH) as part:
            part.write_text(json.dumps(order))
        _switch(self.folder, order["move"], order["remove"])
        self.place = self.folder

    def fail(self, summary: Mapping[str, Any]) -> str:
        """The run has ended without anything to show: keep its summary, and an earlier run's result.

        Returns what is to be said of that, "" where there was none. Raises `OutputError`.
        """
        write_summary(self.place, summary)
        if self.is_shown or not self.has_earlier:
            self.show()
            return ""
        target = self.folder / FAILED
        _remove_failed(self.folder)
        with writing(target):
            self.place.rename(target)
        return f"; the earlier result in {self.folder} is kept, what is known of this run is in {target.name} there"


@contextmanager
def result_folder(
    folder: Path, results: str = "", log: str = "", say: Callable[[str], object] = lambda text: None
) -> Iterator[RunFolder]:
    """Make the result folder and those of the result file and message log in it and hold it, or say why that is not
    possible. say: is told what became of an earlier run there that was killed.
    """
    make_folder(folder)
    with held(folder, "another run"):
        for remark in found(folder):
            say(remark)
        for name in filter(None, (results, log)):
            make_folder((folder / name).parent)
        made = RunFolder(folder, results, log)
        if os.name == "nt":  # files that are open cannot be moved there
            made.show()
        try:
            yield made
        finally:
            shutil.rmtree(folder / STAGE, ignore_errors=True)


@contextmanager
def held_again(folder: Path, summary: Mapping[str, Any]) -> Iterator[None]:
    """Hold the folder of a run that has ended, to write something beside its files.

    Raises `OutputError` where another run writes there, or has written there since.
    """
    with held(folder, "another run"):
        with writing(folder):
            is_same = (folder / "summary.json").read_bytes() == strict_json(summary)
        if not is_same:
            raise OutputError(f"{folder}: another run has written there meanwhile")
        yield


def is_of_a_run(folder: Path) -> bool:
    """Whether a run has made the folder, by its manifest."""
    return isinstance(read_object(folder / "manifest.json").get("options"), dict)


def _clear_stage(folder: Path) -> None:
    """Remove what a run left that was killed in its set-up; raises `OutputError` for what is not of a run."""
    stage = folder / STAGE
    if stage.is_symlink() or (stage.exists() and not stage.is_dir()):
        raise OutputError(f"{stage}: is a link or a file; a run has its files there before it shows them: remove it")
    whole = [p for p in stage.rglob("*") if p.is_file() and ".part" not in p.name]  # a run's manifest is its first
    if whole and not (is_of_a_run(stage) or (stage / SWITCH).is_file()):
        raise OutputError(f"{stage}: holds files of somebody else; a run has its own there: move them away")
    shutil.rmtree(stage, ignore_errors=True)


def found(folder: Path) -> Iterator[str]:
    """What an earlier run left that did not come to its end; one that was killed while its files took their place is
    helped to it."""
    stage = folder / STAGE
    if finish(folder):
        pass
    elif stage.is_dir():
        yield f"{folder}: a run was killed before it had anything to show; what was there before is kept"
    manifest = folder / "manifest.json"
    if manifest.is_file() and not (folder / "summary.json").exists():
        name = earlier(folder, "results", tuple(by_suffix())) or ""
        time = last_time(folder / name) if name.endswith(".csv") else None
        until = f", recorded up to t = {time:g} s," if time is not None else ""
        yield f"{folder}: the run before was killed; its record{until} stays until this one has something to show"


def finish(folder: Path) -> bool:
    """Whether a run's files were taking their place when it was killed; they have done so now."""
    try:
        if (folder / STAGE).is_symlink():
            return False
        order = read_object(folder / STAGE / SWITCH)
        names = [*order["move"], *order["remove"]]
        inside = all(name in FILES or _can_be_of_a_run(folder, name, (*by_suffix(), *LOG_SUFFIXES)) for name in names)
    except (OSError, ValueError, TypeError, KeyError):
        return False
    if inside:
        with suppress(OutputError):
            _switch(folder, order["move"], order["remove"])
    return inside


def _switch(folder: Path, move: Sequence[str], remove: Sequence[str]) -> None:
    """May be done again where it was not done to its end."""
    for name in remove:
        if name not in move:
            _forget(folder / name)
    for name in move:
        new, target = folder / STAGE / name, folder / name
        if not new.exists():
            continue  # it is in its place already
        if new.is_dir() or target.is_dir():
            _forget(target)
        with writing(target):
            new.replace(target)
    _remove_failed(folder)
    shutil.rmtree(folder / STAGE, ignore_errors=True)


def _remove_failed(folder: Path) -> None:
    if (folder / FAILED / "summary.json").is_file():  # else it is not ours
        shutil.rmtree(folder / FAILED, ignore_errors=True)


def settle(folder: Path) -> None:
    """Help the files of a run that was killed as they took their place, unless another run is under way there."""
    if (folder / STAGE).is_dir():
        with suppress(OutputError), held(folder, "another run"):
            finish(folder)


def last_time(file: Path) -> float | None:
    """The time in the last whole row of a CSV file [s]; None where there is none."""
    try:
        with file.open("rb") as stream:
            stream.seek(max(0, file.stat().st_size - TAIL))
            rows = stream.read().split(b"\n")[:-1]
        return float(rows[-1].split(b",")[0])
    except (OSError, ValueError, IndexError):
        return None


def earlier(folder: Path, option: str, suffixes: Sequence[str]) -> str | None:
    """Name of a file of the run before in the folder, by its manifest; None for what cannot be one."""
    try:
        name = read_object(folder / "manifest.json")["options"][option]
        return name if _can_be_of_a_run(folder, name, suffixes) else None
    except Exception:  # whatever stands there
        return None


def check_name(option: str, name: str) -> None:
    """Raise `UsageError` for the name of a record or log that a run folder cannot have."""
    if (first := Path(name).parts[0]) in (STAGE, FAILED):
        raise UsageError(f"{option} {name}: '{first}' is a folder of the master's own; take another name")
    if not _is_plain(name):
        raise UsageError(f"{option} {name}: has to be one line of at most {LONGEST_NAME} bytes")


def _is_plain(name: str) -> bool:
    return len(os.fsencode(name)) <= LONGEST_NAME and name.isprintable()


def _can_be_of_a_run(folder: Path, name: str, suffixes: Sequence[str]) -> bool:
    """Whether a file of that name can be a run's record or log."""
    fits = _is_plain(name) and Path(name).suffix.lower() in suffixes
    return fits and (folder / name).resolve().is_relative_to(folder.resolve())


def _check_replaceable(file: Path) -> None:
    """Raise `OutputError` for a folder where a result file is to stand, unless it is one of Parquet's parts."""
    try:
        is_folder = file.is_dir() and not file.is_symlink()
        if is_folder and any(not p.name.startswith((".part-", "part-")) for p in file.iterdir()):
            raise OutputError(f"{file}: cannot be replaced (a folder that holds other things than results)")
    except OSError as error:
        raise OutputError(f"{file}: cannot be replaced ({error.strerror})") from None


def _forget(file: Path) -> None:
    """Remove a result file of an earlier run; a folder of Parquet's parts is one too."""
    _check_replaceable(file)
    try:
        if file.is_dir() and not file.is_symlink():
            shutil.rmtree(file)
        file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be replaced ({error.strerror})") from None
