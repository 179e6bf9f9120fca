"""A small process that waits for a command, and says what became of it where nobody inside could: an FMU called
_exit(), the system killed the process, memory ran out.

The command runs in a fork that is made before anything heavy is imported. What it does is told in a page of memory that
both see: a call of an FMU by its name, steps by the report that the compiled loop writes in any case, so that they cost
nothing. Where there is no fork (Windows), or with DEEPSEA_COSIM_GUARDIAN=0, the command runs as it is.
"""

from __future__ import annotations

import json
import mmap
import os
import signal
import struct
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NoReturn

from . import ending

SIZE, TEXTS, LABELS = 1 << 17, 1024, 8192
FINISHED, STEPPING = 0, 1
"""Bytes that say so."""
REPORT, TIMES = 64, 128
"""Places of the loop's report (six int64) and of start, step [s] and steps before (three doubles)."""
WATCHED = {*ending.SIGNALS, *([signal.SIGCHLD] if hasattr(signal, "SIGCHLD") else [])}
FROM_TERMINAL = 0x80
"""si_code of a signal that the kernel sends, to all processes of a terminal at once."""

_page: mmap.mmap | None = None


class Told:
    """What a command's process tells its guardian; nothing where there is none."""

    def call(self, component: str, doing: str) -> None:
        """A call of an FMU begins; "": it has ended."""
        self._text({"component": component, "doing": doing})

    def results(self, folder: str, file: str) -> None:
        """Where the results are written; file: of the record, "" for none."""
        self._put(LABELS // 2, json.dumps([folder, file]).encode(), LABELS // 2)

    def steps(self, start: float, step: float, labels: Sequence[tuple[str, str]]) -> Any:
        """Steps begin: operation k of the loop is of labels[k], a component and what it does. Returns memory for the
        loop's report, None where there is no guardian."""
        if _page is None:
            return None
        content = json.dumps(labels).encode()
        self._put(LABELS, content if len(content) < SIZE - LABELS - 8 else b"[]", SIZE - LABELS)
        struct.pack_into("ddd", _page, TIMES, start, step, 0.0)
        _page[STEPPING] = 1
        return memoryview(_page)[REPORT : REPORT + 48]

    def steps_before(self, count: int) -> None:
        """So many steps had been taken when the loop began to count."""
        if _page is not None:
            struct.pack_into("d", _page, TIMES + 16, float(count))

    def no_steps(self) -> None:
        """Steps have ended."""
        if _page is not None:
            _page[STEPPING] = 0

    def finished(self) -> None:
        """What there is to say has been said."""
        if _page is not None:
            _page[FINISHED] = 1

    def _text(self, value: dict[str, str]) -> None:
        if _page is not None:
            self._put(TEXTS, json.dumps(value).encode()[: LABELS // 2 - TEXTS - 8], LABELS // 2 - TEXTS)

    def _put(self, place: int, content: bytes, room: int) -> None:
        if _page is not None and len(content) + 4 <= room:
            struct.pack_into("I", _page, place, len(content))
            _page[place + 4 : place + 4 + len(content)] = content


tell = Told()


def guarded(command: str, main: Callable[[], int], explain: Callable[[str, list[str], float | None], str]) -> int:
    """The exit code of a command's main function, which runs in another process.

    explain(what happened, [folder, file] of the results, time reached [s]): the line that is printed where it ended
    without a word.
    """
    global _page
    if not hasattr(os, "fork") or os.environ.get("DEEPSEA_COSIM_GUARDIAN") == "0":
        return main()
    try:
        page = mmap.mmap(-1, SIZE)
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, WATCHED)
        child = os.fork()
    except OSError:
        return main()
    if child == 0:
        _page = page
        ending.die_with_parent()
        _run(command, main, before)
    status, asked = _wait(child)
    if page[FINISHED] and os.WIFEXITED(status):
        return os.WEXITSTATUS(status)
    if os.WIFSIGNALED(status) and (number := os.WTERMSIG(status)) in asked:  # before it could listen
        ending.note(number)
        return ending.tell(command)
    text = explain(*_what_happened(page, status))
    print(f"{command}: {text}", file=sys.stderr)
    return 1


def _run(command: str, main: Callable[[], int], mask: set[Any]) -> NoReturn:
    """mask: signals that are to be held back from now on; until it listened, more were."""
    try:
        with ending.terminable(signal.SIGINT):
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            code = main()
            sys.stdout.flush()
    except SystemExit as stop:
        code = ending.code_of(stop)
    except KeyboardInterrupt:  # before or after what the command itself takes care of
        ending.take_no_more()
        code = ending.tell(command)
    except BaseException:
        traceback.print_exc()
        code = 1
    ending.put_away()
    tell.finished()
    os._exit(code)


def _wait(child: int) -> tuple[int, set[int]]:
    """The child's wait status, and the signals that asked to end; those sent to this process alone are passed on."""
    asked = set[int]()
    while True:
        got, status = os.waitpid(child, os.WNOHANG)
        if got:
            return status, asked
        if hasattr(signal, "sigwaitinfo"):
            told = signal.sigwaitinfo(WATCHED)
            asked.add(told.si_signo)
            by_terminal = told.si_signo == signal.SIGINT and told.si_code == FROM_TERMINAL
            if told.si_signo in ending.SIGNALS and not by_terminal:
                with suppress(ProcessLookupError):
                    os.kill(child, told.si_signo)
        else:  # macOS
            number = signal.sigwait(WATCHED)
            asked.add(number)
            if number in ending.SIGNALS and number != signal.SIGINT:
                os.kill(child, number)


def _read(page: mmap.mmap, place: int) -> Any:
    (size,) = struct.unpack_from("I", page, place)
    try:
        return json.loads(page[place + 4 : place + 4 + size]) if size else None
    except ValueError:
        return None


def _what_happened(page: mmap.mmap, status: int) -> tuple[str, list[str], float | None]:
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        how = f"crashed ({signal.Signals(number).name})"
        if number == signal.SIGKILL:
            how = "was killed (SIGKILL), by somebody or for lack of memory"
    else:
        how = f"ended the whole process (exit code {os.WEXITSTATUS(status)})"
    results = _read(page, LABELS // 2) or ["", ""]
    if page[STEPPING]:
        report = struct.unpack_from("6q", page, REPORT)
        start, step, before = struct.unpack_from("ddd", page, TIMES)
        labels = _read(page, LABELS) or []
        component, doing = labels[report[2]] if 0 <= report[2] < len(labels) else ("", "")
        time = start + (before + report[1]) * step
        who = f"component '{component}'" if component and "killed" not in how else "the run"
        return f"{who} {how}{f' in {doing}' if component else ''} at t = {time:g} s", results, time
    called = _read(page, TEXTS) or {}
    if called.get("component"):
        return f"component '{called['component']}' {how} in {called['doing']}", results, None
    return f"{'the run' if 'killed' in how else 'an FMU'} {how}", results, None
