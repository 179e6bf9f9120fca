"""The command `cosim-gap diagnose`: progress while it works, then the budget of the gap."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from types import FrameType

from ..core import ending
from ..core.console import conclude


def diagnose_command(options: argparse.Namespace) -> int:
    """Run the diagnosis and print it; returns the exit code."""
    from .diagnosed import diagnose_into
    from .problem.stop import StopToken
    from .summary import lines

    show = _Progress(options.quiet)
    with _StopCondition(options.time_limit) as stop_condition:
        found = diagnose_into(
            options.campaign, options.out, processes=options.processes, dask=options.dask,
            resume=options.out if options.resume is True else options.resume, report=not options.no_report,
            stop=StopToken(stop_condition.ended), on_stage=show.stage, progress=show.run, on_finding=show.known,
            on_end=show.clear,
        )  # fmt: skip
    files = f"{found.folder}: {', '.join(found.files)}"
    conclude(
        options, lambda: {"folder": found.folder, "files": found.files, "diagnosis": found.summary},
        lambda: lines(found.summary, found.signals, sys.stdout.encoding, files),
    )  # fmt: skip
    return ending.code() if stop_condition.interrupted else 0


class _StopCondition:
    """How long to look for causes: until a time limit [s] or the first Ctrl-C; the second one ends everything."""

    def __init__(self, limit: float | None):
        self.until = float("inf") if limit is None else time.monotonic() + limit
        self.interrupted = self._is_told = False
        self._when = 0.0

    def ended(self) -> bool:
        """Whether what has been found is to be judged now; says so once, for a handler of signals must not print."""
        if self.interrupted and not self._is_told:
            self._is_told = True
            print("\ncosim-gap: judging what has been found (Ctrl-C again: end without a result)", file=sys.stderr)
        return self.interrupted or time.monotonic() > self.until

    def __enter__(self) -> _StopCondition:
        self._before = {kind: signal.signal(kind, self._first) for kind in ending.listened_to()}
        return self

    def __exit__(self, *_: object) -> None:
        for kind, handler in self._before.items():
            signal.signal(kind, handler)

    def _first(self, number: int, frame: FrameType | None) -> None:
        if self.interrupted:
            if time.monotonic() - self._when > ending.TWICE:  # else the same request, passed on
                handler = self._before[signal.Signals(number)]
                (handler if callable(handler) else signal.default_int_handler)(number, frame)
            return
        self.interrupted, self._when = True, time.monotonic()
        ending.note(number)


class _Progress:
    """One line on stderr with stage, runs and seconds, where that is a terminal."""

    def __init__(self, quiet: bool):
        self.on = not quiet and sys.stderr.isatty()
        self.plain = not quiet and not self.on
        self.text, self.runs = "", 0
        self.begin = self.last = time.monotonic()

    def stage(self, text: str) -> None:
        self.text = text
        if self.plain:
            print(f"[{time.monotonic() - self.begin:5.1f} s] {text}", file=sys.stderr)
        self._draw(True)

    def known(self, text: str) -> None:
        """What is known so far; it stays."""
        if self.plain:
            self.stage(text)
        elif self.on:
            self.clear()
            print(f"[{time.monotonic() - self.begin:5.1f} s] {text}", file=sys.stderr)

    def run(self, runs: int) -> None:
        self.runs = runs
        self._draw(False)

    def _draw(self, now: bool) -> None:
        if self.on and (now or time.monotonic() - self.last > 0.2):
            self.last = time.monotonic()
            line = f"[{self.last - self.begin:5.1f} s, {self.runs} runs] {self.text}"
            print(f"\r{line:<78}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        if self.on:
            print(f"\r{'':<78}\r", end="", file=sys.stderr, flush=True)
