"""Requests to end a command: Ctrl-C (SIGINT, exit code 130) and SIGTERM (143)."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

_asked: list[int] = []
"""The signals that asked this process to end."""


def code_of(stop: SystemExit) -> int:
    """The exit code that a `SystemExit` asks for."""
    return stop.code if isinstance(stop.code, int) else int(stop.code is not None)


def put_away() -> None:
    """Remove this process's temporary folders, for it ends without Python's shutdown."""
    if scratch := sys.modules.get(f"{__package__}.scratch"):
        scratch.remove_all()


def die_with_parent() -> None:
    """End this process with the one that started it, however that ends; on Linux only."""
    if sys.platform.startswith("linux"):
        import ctypes

        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL, 0, 0, 0)  # PR_SET_PDEATHSIG


class Terminated(KeyboardInterrupt):
    """SIGTERM, where nothing else listens to it."""


def note(number: int) -> None:
    """A signal has asked this process to end."""
    _asked.append(number)


def told() -> str:
    """What to say of that."""
    number = _asked[-1] if _asked else signal.SIGINT
    return "interrupted" if number == signal.SIGINT else f"asked to end ({signal.Signals(number).name})"


def code() -> int:
    """The exit code of a command that was asked to end."""
    return 128 + (_asked[-1] if _asked else signal.SIGINT)


@contextmanager
def starting_processes() -> Iterator[None]:
    """Around the start of processes: they inherit that Ctrl-C is held back from them, and decide what it does once
    they are ready; one that comes meanwhile reaches this process afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


@contextmanager
def terminable() -> Iterator[None]:
    """Around a command: SIGTERM ends it as Ctrl-C does, so that what it holds is put away."""
    _asked.clear()
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        yield
        return

    def ended(number: int, _frame: FrameType | None) -> NoReturn:
        note(number)
        raise Terminated

    signal.signal(signal.SIGTERM, ended)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
