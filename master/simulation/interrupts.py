"""Ctrl-C and other requests to end, also where an FMU does not come back to let anybody hear of them; and FMUs that
end the process they are in."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import cache
from pathlib import Path
from time import monotonic
from typing import Any

from ...core import ending

HANG_TIMEOUT = 5.0
"""How long a call of an FMU may take once the run was asked to end [s]."""

EXITED = 250
"""What `ending.c` says of a process that ends by exit(); of one that crashes it says the signal's number."""

CRASHES = (signal.SIGSEGV, signal.SIGFPE, signal.SIGILL, signal.SIGABRT, getattr(signal, "SIGBUS", signal.SIGSEGV))

OnHang = Callable[[str], object]
"""Has to end the process. Is told what happened, "{} crashed (SIGSEGV) in {}" of who was in what; "" for an FMU that
does not come back."""


class Interrupts(list[int]):
    """The signals that asked the run to end.

    An exception instead would end up in an FMU that is written in Python.
    """

    def __init__(self) -> None:
        super().__init__()
        self._on_hang: OnHang | None = None
        self._lock = threading.Lock()

    @contextmanager
    def watching(self, on_hang: OnHang) -> Iterator[None]:
        """Where FMUs are called: if one does not come back or ends the process, another thread calls `on_hang`."""
        self.watch_until_end(on_hang)
        try:
            yield
        finally:
            with self._lock:  # for ever, once `on_hang` is called
                self._on_hang = None

    def watch_until_end(self, on_hang: OnHang) -> None:
        """As `watching`, to the end of the run."""
        self._on_hang = on_hang

    def watch(self, signals: socket.socket) -> None:
        """Wait for a signal, and then for `HANG_TIMEOUT` seconds, or until the other end is closed."""
        up = float("inf")
        while True:
            signals.settimeout(None if up == float("inf") else max(0.01, up - monotonic()))
            try:
                got = signals.recv(64)
            except TimeoutError:
                got = bytes(1)
            if not got:
                return
            asked = [number for number in got if number in ending.SIGNALS]
            if up == float("inf") and asked:
                ending.note(asked[0])  # the handler may never get to it
                up = monotonic() + HANG_TIMEOUT
            with self._lock:
                if self._on_hang is not None and (crash := crash_of(got)):
                    ending_library().heard()
                    self._on_hang(crash)
                if self._on_hang is not None and monotonic() >= up:
                    self._on_hang("")


def crash_of(got: bytes) -> str:
    """What an FMU did to the process, of the numbers that came, to be filled with who was in what; "" for nothing."""
    crashes = [signal.Signals(number).name for number in got if number in CRASHES]
    ours = {thread.native_id for thread in threading.enumerate()} | {os.getpid()}  # a fork leaves the first one's
    if crashes and ending_library().crashed_thread() not in ours:
        return f"a thread that an FMU has started crashed ({crashes[0]}), while {{}} was in {{}}"
    if crashes:
        return f"{{}} crashed ({crashes[0]}) in {{}}"
    return "{} ended the whole process in {}" if EXITED in got else ""


@cache
def ending_library() -> Any:
    """The library of `ending.c`; None where it was not compiled."""
    with suppress(OSError):
        return ctypes.CDLL(str(Path(__file__).with_name("_ending.abi3.so")))
    return None


@contextmanager
def interrupts(watched: bool = False) -> Iterator[Interrupts]:
    """What asks this run to end; `watched`: with a thread that looks whether it is heard.

    The handlers of signals run in Python's main thread only, which sits in the FMU.
    """
    asked = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return

    def heard(number: int, _frame: object) -> None:
        ending.note(number)
        asked.append(number)

    before = {kind: signal.signal(kind, heard) for kind in ending.listened_to()}
    try:
        with _watched(asked) if watched else nullcontext():
            yield asked
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)


@contextmanager
def _watched(asked: Interrupts) -> Iterator[None]:
    ours, pythons = socket.socketpair()
    pythons.setblocking(False)
    before = signal.set_wakeup_fd(pythons.fileno(), warn_on_full_buffer=False)
    if ending_library() is not None:
        ending_library().watch_for_the_end(pythons.fileno())
    thread = threading.Thread(target=asked.watch, args=(ours,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        if ending_library() is not None:
            ending_library().watch_no_longer()
        signal.set_wakeup_fd(before)
        pythons.close()
        thread.join()
        ours.close()
