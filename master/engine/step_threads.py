"""Threads beside the compiled loop, which take steps that do not depend on each other (`loop.FORK`)."""

from __future__ import annotations

import ctypes
import os
import sys
import weakref
from functools import cache
from threading import Thread

import numpy as np

from . import loop


@cache
def _semaphores() -> tuple[int, ...] | None:
    """Addresses of sem_init, sem_post, sem_wait and sem_trywait; None where there are no semaphores without a name."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    try:
        functions = [getattr(library, f"sem_{name}") for name in ("init", "post", "wait", "trywait")]
    except AttributeError:
        return None
    return tuple(int(ctypes.cast(function, ctypes.c_void_p).value or 0) for function in functions)


def supported() -> bool:
    """Whether there can be threads here that are woken for every step."""
    return _semaphores() is not None


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class StepThreads:
    """The threads of one program; they end with it."""

    def __init__(self, operations: np.ndarray, instances: int):
        """operations: the program (operations, OPERANDS); instances: how many it has to do with."""
        self.control = np.zeros(loop.STATUS + len(operations), np.int64)
        self.spans = np.zeros((3, max(2, instances)))
        counts = operations[operations[:, 0] == loop.FORK, 1]
        self._threads = min(cores(), int(counts.max(initial=0))) - 1 if supported() else 0
        self._begun = False

    def begin(self, operations: np.ndarray, u8: np.ndarray, seconds: np.ndarray, clock: int) -> None:
        """Start the threads, if there are any and they do not run already; `clock`: address of clock_gettime or 0."""
        semaphores = _semaphores()
        if self._begun or self._threads < 1 or semaphores is None:
            return
        self._begun = True
        init, *calls = semaphores
        room = np.zeros((2, 32), np.uint8)  # of sem_t, which has up to 32 bytes
        work, done = (int(row.ctypes.data) for row in room)
        make = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_uint)(init)
        for place in (work, done):
            make(place, 0, 0)
        self.control[[loop.POST, loop.WAIT, loop.TRY, loop.WORK, loop.WORKED]] = *calls, work, done
        arguments = operations, u8, seconds, self.control, self.spans, clock
        threads = [Thread(target=_help, args=(room, *arguments), daemon=True) for _ in range(self._threads)]
        for thread in threads:
            thread.start()
        self.control[loop.THREADS] = self._threads
        weakref.finalize(self, _end, self.control, threads)


NO_THREADS = StepThreads(np.zeros((0, loop.OPERANDS), np.int64), 0)
"""Of programs that have nothing to share."""


def _help(_room: np.ndarray, *arguments: object) -> None:
    """A thread; it keeps the semaphores' room."""
    loop.worker_thread(*arguments)


def _end(control: np.ndarray, threads: list[Thread]) -> None:
    control[loop.STOP], count = 1, int(control[loop.THREADS])
    control[loop.THREADS] = 0
    post = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(int(control[loop.POST]))
    for _ in range(count):
        post(int(control[loop.WORK]))
    for thread in threads:
        thread.join(1.0)
