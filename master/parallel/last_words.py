"""What a process that simulates leaves behind when an FMU ends it: who did what, in a file."""

from __future__ import annotations

import atexit
import os
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ..simulation.interrupts import crash_of, ending_library

FILE = "last_words.txt"


def leave_last_words(folder: Path, told: Callable[[str], str]) -> None:
    """From now on: told("{} crashed (SIGSEGV) in {}") into a file of the folder, where an FMU crashes or calls exit().

    Where the library that hears of it was not compiled nothing is left.
    """
    library = ending_library()
    if library is None:
        return
    ours, theirs = socket.socketpair()
    library.watch_for_the_end(theirs.fileno())
    atexit.register(library.watch_no_longer)  # an end that Python knows of is none of an FMU's

    def wait() -> None:
        got = ours.recv(64)
        if crash := crash_of(got):
            library.heard()
            with suppress(Exception):
                (folder / FILE).write_text(told(crash), encoding="utf-8")
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
    _kept.append(theirs)


_kept: list[socket.socket] = []
"""What the library writes to, for as long as the process lives."""


def last_words(folder: Path) -> str:
    """What a process has left in the folder, "" where there is nothing; it is taken out."""
    file = folder / FILE
    try:
        text = file.read_text(encoding="utf-8")
        file.unlink()
    except OSError:
        return ""
    return text
