"""All that FMUs say, in a file: a line a message, with time, component, status and category."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")
ERROR, FATAL = 3, 4

LEVELS = {"error": (3, 4), "warning": (1, 2, 3, 4), "info": tuple(range(6)), "debug": tuple(range(6))}
"""Statuses that are written; `debug` has FMUs say more, too: debug logging is switched on, with all categories."""

HEAD = "time\tcomponent\tstatus\tcategory\tmessage\n"


class MessageLog:
    """The file of a run. Each line is written at once and at the end, so that FMUs in other processes share it, and
    what an FMU said before it crashed is there.

    It travels to another process as its name and what is wanted; the file has to exist by then (`begin`).
    """

    def __init__(self, path: Path, level: str, categories: Sequence[str] = ()):
        self.path, self.level, self.categories = path, level, tuple(categories)
        self.clock: Callable[[], float | None] = lambda: None
        """Tells the start of the step that is under way [s]."""
        self.fault: str | None = None
        """Why a line could not be written."""
        self._file: int | None = None

    def __reduce__(self) -> tuple[type[MessageLog], tuple[Path, str, tuple[str, ...]]]:
        return MessageLog, (self.path, self.level, self.categories)

    def begin(self) -> None:
        """Make the file anew; raises `OSError`."""
        self.path.write_text(HEAD, encoding="utf-8")
        self.open()

    def open(self) -> int:
        """The file's descriptor; raises `OSError`."""
        if self._file is None:
            self._file = os.open(self.path, os.O_WRONLY | os.O_APPEND)
        return self._file

    def wants(self, status: int, category: str) -> bool:
        """Whether a message is written: by its status, and where categories are given, by these unless it is more than
        a note."""
        if status not in LEVELS[self.level]:
            return status >= len(STATUS)
        return status in LEVELS["warning"] or not self.categories or category in self.categories

    def write(self, component: str, status: int, category: str, message: str) -> None:
        """Append a message, if it is wanted; never raises, for FMUs call this."""
        if self.fault is not None or not self.wants(status, category):
            return
        time = self.clock()
        shown = STATUS[status] if 0 <= status < len(STATUS) else str(status)
        cells = "" if time is None else f"{time:.12g}", component, shown, category, message
        line = "\t".join(cell.replace("\t", " ").replace("\r", "").replace("\n", "\\n") for cell in cells)
        try:
            os.write(self.open(), f"{line}\n".encode("utf-8", "replace"))
        except OSError as error:
            self.fault = f"{self.path}: a message could not be written ({error.strerror}); those after it are missing"

    def switched_on(self, declared: Sequence[str]) -> list[str] | None:
        """The categories that an FMU is to be told, of those it declares; [] are all, None: it need not be told.

        What it says of its statuses stays on, or its warnings would be lost.
        """
        if self.categories:
            named = [c for c in declared if c in self.categories]
            return [*named, *(c for c in declared if c.startswith("logStatus") and c not in named)] if named else None
        return list(declared) if self.level == "debug" else None

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
