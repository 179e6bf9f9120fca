"""Tries mutants in a process of their own and counts what became of them."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

PATIENCE = 60.0
"""Time that a mutant has [s]; much, for the machine may be busy."""


@dataclass
class Tally:
    """How many were tried, refused in one line, run rightly; and what failed, by number of the mutant."""

    tried: int = 0
    refused: int = 0
    ran: int = 0
    failed: dict[str, str] = field(default_factory=dict)

    def __add__(self, other: Tally) -> Tally:
        counts = self.tried + other.tried, self.refused + other.refused, self.ran + other.ran
        return Tally(*counts, {**self.failed, **other.failed})

    def __str__(self) -> str:
        return f"{self.tried} tried, {self.refused} refused in a line, {self.ran} run, {len(self.failed)} failed"


def table(found: Mapping[str, Tally]) -> str:
    """For people."""
    lines = ["| what is changed | tried | refused in one line | run rightly | failed |"]
    lines.append("| --- | --- | --- | --- | --- |")
    total = Tally()
    for name, t in found.items():
        lines.append(f"| {name} | {t.tried} | {t.refused} | {t.ran} | {len(t.failed)} |")
        total += t
    lines.append(f"| all | {total.tried} | {total.refused} | {total.ran} | {len(total.failed)} |")
    return "\n".join(lines)


def run(target: str, seed: int, count: int, out: Path) -> Tally:
    """Try so many mutants; those that fail are kept in a folder, with what was said."""
    tally, first = Tally(), 0
    while first < count:
        first = _watched(target, seed, first, count, tally, out)
    return tally


def _watched(target: str, seed: int, first: int, count: int, tally: Tally, out: Path) -> int:
    """Try mutants from the first on until a process ends; returns the next."""
    out.mkdir(parents=True, exist_ok=True)
    what = target, str(seed), str(first), str(count), str(out / target)
    command = [sys.executable, "-m", "benchmarks.fuzz.worker", *what]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)
    assert process.stdout is not None
    k = first
    try:
        for line in _lines(process):
            told = json.loads(line)
            tally.tried += 1
            if told["outcome"] == "failed":
                _keep(target, seed, k, told["said"], tally, out)
            else:
                setattr(tally, told["outcome"], getattr(tally, told["outcome"]) + 1)
            k += 1
    except TimeoutError:
        tally.tried += 1
        _keep(target, seed, k, f"not done after {PATIENCE:g} s", tally, out)
        return k + 1
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if k < count:
        tally.tried += 1
        _keep(target, seed, k, f"the process ended with {process.returncode}", tally, out)
        return k + 1
    return k


def _lines(process: subprocess.Popen[bytes]) -> Iterator[bytes]:
    assert process.stdout is not None
    waiting = b""
    while True:
        if not select.select([process.stdout], [], [], PATIENCE)[0]:
            raise TimeoutError
        got = os.read(process.stdout.fileno(), 1 << 16)
        if not got:
            return
        *whole, waiting = (waiting + got).split(b"\n")
        yield from whole


def _keep(target: str, seed: int, k: int, said: str, tally: Tally, out: Path) -> None:
    name = f"{target}_{seed}_{k}"
    tally.failed[name] = said
    with suppress(FileNotFoundError):
        (out / f"{target}.{k}").replace(out / name)
    (out / f"{name}.txt").write_text(said, encoding="utf-8", errors="replace")
