"""Requests to end a command: Ctrl-C (SIGINT, exit code 130), SIGTERM (143), a terminal that is closed (SIGHUP, 129)."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import inf
from time import monotonic
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))
"""Those that ask to end."""

_asked: list[int] = []
"""The signals that asked this process to end."""

TWICE = 0.2
"""Time within which a second signal tells of the same request [s]."""


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


def note(number: int) -> None:
    """A signal has asked this process to end."""
    _asked.append(number)


def asked() -> bool:
    """Whether this command has been asked to end."""
    return bool(_asked)


def told() -> str:
    """What to say of that."""
    number = _asked[-1] if _asked else signal.SIGINT
    return "interrupted" if number == signal.SIGINT else f"asked to end ({signal.Signals(number).name})"


def code() -> int:
    """The exit code of a command that was asked to end."""
    return 128 + (_asked[-1] if _asked else signal.SIGINT)


def tell(command: str) -> int:
    """Say in a line that a command was asked to end; its exit code."""
    print(f"{command}: {told()}", file=sys.stderr)
    return code()


@contextmanager
def starting_processes() -> Iterator[None]:
    """Around the start of processes: they inherit that Ctrl-C is held back from the thread that starts them, and decide
    what it does once they are ready."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def listened_to() -> tuple[signal.Signals, ...]:
    """Those that a command heeds: all but the end of its terminal where it was started by nohup."""
    asks = (signal.SIGINT, signal.SIGTERM)
    return tuple(kind for kind in SIGNALS if kind in asks or signal.getsignal(kind) != signal.SIG_IGN)


def ignore_interrupts() -> None:
    """Leave what a terminal sends to all its processes, Ctrl-C and its end, to the process that started this one."""
    for kind in SIGNALS:
        if kind != signal.SIGTERM:
            signal.signal(kind, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def take_no_more() -> None:
    """From now on nothing asks this process to end, for it does."""
    for kind in SIGNALS:
        signal.signal(kind, signal.SIG_IGN)


def _say_nothing(_error: object) -> None:
    """In the place of Python's report of an error that nobody can handle."""


def _raising() -> Callable[[int, FrameType | None], None]:
    """A handler that notes a signal and raises `KeyboardInterrupt`, once for what comes twice at a time: a terminal and
    who passes a signal on may both send it.

    What a library was making at that moment stays half made, and may stumble as it is put away: of that nothing is
    said.
    """
    last = -inf

    def ended(number: int, _frame: FrameType | None) -> None:
        nonlocal last
        if monotonic() - last < TWICE:
            return
        last = monotonic()
        note(number)
        sys.unraisablehook = _say_nothing
        raise KeyboardInterrupt

    return ended


@contextmanager
def terminable(*kinds: signal.Signals) -> Iterator[None]:
    """Around a command: SIGTERM and SIGHUP end it as Ctrl-C does, so that what it holds is put away; or only `kinds`.

    They are noted, for a library that is being loaded makes another error of the exception.
    """
    _asked.clear()
    handler, taken = _raising(), list[int]()
    if threading.current_thread() is threading.main_thread():
        usual_handlers = dict.fromkeys(SIGNALS, signal.SIG_DFL) | {signal.SIGINT: signal.default_int_handler}
        taken = [kind for kind in kinds or usual_handlers if signal.getsignal(kind) == usual_handlers[kind]]
    before, report = [signal.signal(kind, handler) for kind in taken], sys.unraisablehook
    try:
        yield
    finally:
        sys.unraisablehook = report
        for kind, usual in zip(taken, before, strict=True):
            signal.signal(kind, usual)
