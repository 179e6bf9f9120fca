"""One trial: a command is started beside an earlier result, struck, judged, and run once more."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from .commands import NEW, OLD, PART, Command, fingerprint

FAULTS = ("kill", "term", "interrupt", "full", "clock")
PATIENCE = 120.0
"""Longest time of a command that was struck, and of what it leaves running [s]."""

ASKED = {"term": 128 + signal.SIGTERM, "interrupt": 128 + signal.SIGINT}
LARGEST = 400_000
"""Bytes of a file, below which it may grow no further where the disk is "full"."""


@dataclass(frozen=True)
class Usual:
    """What a command does when nothing happens."""

    time: float
    old: dict[str, str]
    new: dict[str, str]


class Trial:
    """The folder of a trial, and what is done in it."""

    def __init__(self, command: Command, place: Path, clock: Path):
        self.command, self.place, self._clock = command, place, clock
        self._work, self._temp = place / "work", place / "temp"

    @property
    def out(self) -> Path:
        return self._work / self.command.out

    def usual(self) -> Usual:
        """Make the earlier result, keep it, and do without a fault what is to be struck."""
        shutil.rmtree(self.place, ignore_errors=True)
        self._work.mkdir(parents=True)
        self._temp.mkdir()
        self._go(self.command.line(earlier=bool(self.command.before))).communicate()
        shutil.copytree(self._work, self.place / "kept")
        old = fingerprint(self.out)
        begin = time.monotonic()
        self._go(self.command.line()).communicate()
        taken = time.monotonic() - begin
        assert self.command.is_complete(self.out), f"{self.command.name} is not complete when nothing happens"
        return Usual(taken, old, fingerprint(self.out))

    def struck(self, fault: str, usual: Usual, chance: random.Random) -> tuple[str, str]:
        """(what was there afterwards, what is wrong with it: "" for nothing)"""
        shutil.rmtree(self._work)
        shutil.copytree(self.place / "kept", self._work)
        after = chance.uniform(0.0, usual.time)
        process = self._start(fault, after, chance)
        if fault in ("kill", *ASKED):
            with suppress(subprocess.TimeoutExpired):
                process.wait(after)
            self._strike(process, fault, chance)
        try:
            _, error = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            _end_group(process.pid)
            return "", "does not end"
        if wrong := self._wrong_end(fault, process.returncode, error):
            return "", wrong
        if not _gone(process.pid):
            _end_group(process.pid)
            return "", "a process is still there"
        state = self._state(usual)
        return state, "" if state in (OLD, NEW, PART) and not (wrong := self._again(usual)) else wrong or state

    def _start(self, fault: str, after: float, chance: random.Random) -> subprocess.Popen[str]:
        largest = round(LARGEST ** chance.random())

        def limited() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY))

        if fault == "clock":
            more = {"LD_PRELOAD": str(self._clock), "CLOCK_AFTER": str(after),
                    "CLOCK_JUMP": str(chance.choice((-86400, -60, 60, 86400, 10**8)))}  # fmt: skip
            return self._go(self.command.line(), more)
        return self._go(self.command.line(), limit=limited if fault == "full" else None)

    def _go(self, line: list[str], more: dict[str, str] | None = None, limit: Callable[[], None] | None = None
            ) -> subprocess.Popen[str]:  # fmt: skip
        own = {"TMPDIR": str(self._temp), "OMP_NUM_THREADS": "1", **dict(self.command.environment)}
        environment = {**os.environ, **own, **(more or {})}
        return subprocess.Popen(line, cwd=self._work, env=environment, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True,
                                preexec_fn=limit)  # fmt: skip

    def _strike(self, process: subprocess.Popen[str], fault: str, chance: random.Random) -> None:
        with suppress(ProcessLookupError):
            if fault == "kill":
                whom = chance.choice([process.pid, *filter(_is_ours, _session(process.pid))])
                os.kill(whom, signal.SIGKILL)
            elif fault == "term":
                os.kill(process.pid, signal.SIGTERM)
            else:
                os.killpg(process.pid, signal.SIGINT)

    def _wrong_end(self, fault: str, code: int, error: str) -> str:
        fine = self.command.exit_codes
        if "Traceback" in error:
            return f"a traceback: {error.strip().splitlines()[-1][:200]}"
        before_python = ASKED.get(fault, 128) - 128  # the signal's own end: the interpreter was not there yet
        if fault in ASKED and code not in (*fine, ASKED[fault]) and (code != -before_python or error.strip()):
            return f"exit code {code} where it was asked to end: {error.strip()[-200:]}"
        if fault == "clock" and code not in fine:
            return f"exit code {code}: {error.strip()[-200:]}"
        if fault == "full" and (code < 0 or (code not in fine and not error.strip())):
            return f"exit code {code} and no word"
        return ""

    def _state(self, usual: Usual) -> str:
        try:
            found = fingerprint(self.out)
            if found == usual.old:
                return OLD
            if self.command.is_complete(self.out):
                return NEW
            if self.command.tells_part(self.out):
                return PART
            return f"neither the old result nor the new one: {', '.join(found)}"
        except (OSError, ValueError, KeyError) as error:
            return f"what is there cannot be read: {error!r}"

    def _again(self, usual: Usual) -> str:
        """What is wrong with the same command, run once more; the temporary files are old by then."""
        for path in self._temp.iterdir():
            os.utime(path, (0.0, 0.0))
        process = self._go(self.command.line())
        _, error = process.communicate(timeout=PATIENCE)
        if process.returncode not in self.command.exit_codes:
            return f"the next one ends with {process.returncode}: {error.strip()[-200:]}"
        if not self.command.is_complete(self.out):
            return "the next one is not complete"
        left = [path.name for path in self._temp.iterdir()]
        for path in self._temp.iterdir():
            shutil.rmtree(path, ignore_errors=True)
        return f"left behind: {', '.join(left[:3])}" if left else ""


def _session(leader: int) -> list[int]:
    """Processes of the session that the leader has begun."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != leader:
            with suppress(OSError, ValueError, IndexError):
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
                if int(fields[3]) == leader and fields[0] != "Z":
                    found.append(int(entry.name))
    return found


def _is_ours(process: int) -> bool:
    """Not Python's own bookkeeper of shared memory, whose successor prints an error of what it never heard of."""
    with suppress(OSError):
        return b"resource_tracker" not in Path(f"/proc/{process}/cmdline").read_bytes()
    return False


def _gone(leader: int) -> bool:
    until = time.monotonic() + 20.0
    while _session(leader):
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def _end_group(leader: int) -> None:
    for process in [leader, *_session(leader)]:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
