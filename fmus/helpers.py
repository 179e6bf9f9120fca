"""Processes that help to build FMUs, side by side; they end with the build, however that ends."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from ..core import ending
from ..core.errors import Interrupted, PackageError
from ..core.scratch import scratch

T, R = TypeVar("T"), TypeVar("R")

_lock = threading.Lock()
_running: set[subprocess.Popen[str]] = set()
_given_up = threading.Event()


def run_python(arguments: Sequence[str], environment: Mapping[str, str], failure: str) -> None:
    """Run this Python in a process of its own; if it fails, `PackageError` with that text and its last line.

    What it puts into temporary folders goes with one of this process, for both may be killed.
    """
    if arguments[0] == "-c":
        arguments = ["-c", f"from {ending.__name__} import die_with_parent; die_with_parent(); {arguments[1]}"]
    with scratch("helper") as place:
        _run(arguments, {**environment, **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(place))}, failure)


def _run(arguments: Sequence[str], environment: Mapping[str, str], failure: str) -> None:
    pipe = subprocess.PIPE
    with _lock:
        if _given_up.is_set():
            raise Interrupted("the build was given up")
        process = subprocess.Popen([sys.executable, *arguments], env=environment, stdout=pipe, stderr=pipe, text=True)
        _running.add(process)
    try:
        _, said = process.communicate()
    finally:
        process.kill()
        with _lock:
            _running.discard(process)
    if process.returncode:
        lines = said.strip().splitlines() or [f"the process ended with code {process.returncode}"]
        raise PackageError(f"{failure}: {lines[-1]}")


def side_by_side(function: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
    """function(item) of each, in threads, in the order of the items; when one fails or this is interrupted, the others'
    processes are ended, for they may take a minute."""
    pool = ThreadPoolExecutor(max(1, min(len(items), os.cpu_count() or 1)))
    try:
        yield from pool.map(function, items)
    except BaseException:
        with _lock:
            _given_up.set()
            for process in _running:
                process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        _given_up.clear()
