"""What is struck: commands, what they write, and what of that is sound."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks import native

OLD, NEW, PART = "old", "new", "part"
"""What is there: the earlier result whole, the new one whole, the new one up to a time."""

TIMES = re.compile(rb'"(setup_time_s|wall_time_s|real_time_factor|created|machine|total_s|seconds)": ?[^,}\n]*')
"""What two runs of a command do not have in common."""


@dataclass(frozen=True)
class Command:
    """A command of the tool that writes into `out`, a folder or a file in the folder of a trial."""

    name: str
    module: str
    before: tuple[str, ...]
    """Arguments of the earlier run; empty where the same command makes both."""
    arguments: tuple[str, ...]
    out: str
    is_complete: Callable[[Path], bool]
    """Whether what is there is a whole result."""
    tells_part: Callable[[Path], bool] = lambda _: False
    """Whether what is there is a part of a result, and says so."""
    exit_codes: tuple[int, ...] = (0,)
    environment: tuple[tuple[str, str], ...] = ()
    """Variables and their values, besides those that there are."""

    def line(self, earlier: bool = False) -> list[str]:
        """The command line."""
        return [sys.executable, "-m", f"deepsea_cosim.{self.module}", *(self.before if earlier else self.arguments)]


APART = (".new", "failed_start")
"""Where a run keeps what is not to be shown yet, and what is known of one that has nothing to show."""


def fingerprint(place: Path) -> dict[str, str]:
    """A digest of every file that is a part of the result, but for times that no two runs have in common."""
    inside = (p for p in sorted(place.rglob("*")) if p.is_file() and p.name[0] != "." and p.parent.name not in APART)
    files = [place] if place.is_file() else inside
    return {str(p.relative_to(place)): hashlib.sha256(TIMES.sub(b"", p.read_bytes())).hexdigest() for p in files}


def _run_is_complete(folder: Path) -> bool:
    return _status(folder) == "ok" and _rows(folder / "results.csv") == 20_001


def _run_tells(folder: Path) -> bool:
    """A run that was asked to end says so in its summary; one that was killed has none, and whole rows."""
    return _status(folder) in ("interrupted", "failed", None) and (folder / "results.csv").exists()


def _status(folder: Path) -> str | None:
    try:
        return str(json.loads((folder / "summary.json").read_text())["status"])
    except FileNotFoundError:
        return None


def _rows(file: Path) -> int:
    return file.read_bytes().count(b"\n") - 1 if file.exists() else -1


def _sweep_is_complete(folder: Path) -> bool:
    import pandas as pd

    return len(pd.read_parquet(folder / "sweep.parquet")) == 6


def _sweep_tells(folder: Path) -> bool:
    """Every case that is kept is a whole line, but for the last."""
    lines = (folder / "cases.jsonl").read_bytes().split(b"\n")[:-1]
    return all("case" in json.loads(line) for line in lines)


def _page_is_complete(file: Path) -> bool:
    return file.read_bytes().rstrip().endswith(b"</html>")


def _zip_is_sound(file: Path) -> bool:
    with zipfile.ZipFile(file) as archive:
        return archive.testzip() is None


def _folder_of_zips(folder: Path) -> bool:
    fmus = list(folder.glob("*.fmu"))
    return bool(fmus) and all(map(_zip_is_sound, fmus))


def _diagnosis_is_complete(folder: Path) -> bool:
    json.loads((folder / "diagnosis.json").read_text())
    return _page_is_complete(folder / "report.html") and (folder / "calibrated.ssv").exists()


def _campaign_is_complete(file: Path) -> bool:
    return "[[run]]" in file.read_text()


def commands(folder: Path) -> dict[str, Command]:
    """The commands, and in the folder what they read: two linear machines, and a toy with measurements."""
    package, campaign = _machine(folder), _campaign(folder)
    results, other = folder / "results", folder / "other"
    run = ("--no-plot", "--quiet")
    for place, stop in ((results, "20"), (other, "10")):
        line = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package), *run]
        subprocess.run([*line, "--out", str(place), "--stop", stop], check=True)
    sweep = ("sweep", str(package), "--vary", "a.D[1,1]=1:6:1", "--metric", "max(a.y1)", "--quiet", "--processes", "2")
    found = (
        Command("run", "master.cli", (str(package), *run, "--out", "out", "--stop", "3"),
                (str(package), *run, "--out", "out", "--html"), "out", _run_is_complete, _run_tells),
        Command("isolated", "master.cli", (str(package), *run, "--out", "out", "--stop", "3"),
                (str(package), *run, "--out", "out", "--isolate", "--step", "0.01"), "out",
                lambda p: _status(p) == "ok" and _rows(p / "results.csv") == 2001, _run_tells),
        Command("sweep", "study.cli", (*sweep, "--stop-time", "2", "--out", "out"), (*sweep, "--out", "out"), "out",
                _sweep_is_complete, _sweep_tells),
        Command("compare", "master.cli", (), ("compare", str(results), str(other), "--out", "c.html"), "c.html",
                _page_is_complete, exit_codes=(0, 1)),
        Command("new", "gap.cli", (), ("new", str(folder / "toy.ssp"), str(folder / "run0.csv"), "--out", "made",
                "--force"), "made/campaign.toml", _campaign_is_complete),
        Command("pack", "gap.cli", (), ("pack", str(campaign), "--out", "p.zip", "--force"), "p.zip", _zip_is_sound),
        Command("diagnose", "gap.cli", (), ("diagnose", str(campaign), "--out", "out", "--quiet"), "out",
                _diagnosis_is_complete),
        # not compiled: a strike is at files, and compiling takes a minute each time
        Command("build", "fmus.cli", ("build", "--out", "out"), ("build", "--out", "out", "--fmi", "3"), "out",
                _folder_of_zips, environment=(("NUMBA_DISABLE_JIT", "1"),)),
    )  # fmt: skip
    return {c.name: c for c in found}


def _machine(folder: Path) -> Path:
    from tests.master.parts import constant, gain
    from tests.packages import link, package, system

    root = system("root", constant("a", 1.0), gain("b", 2.0), links=(link("a.y1", "b.u1"),))
    return package(folder / "machine.ssp", root, {"resources/L.fmu": native.linear(folder, 2)}, stop=20.0, step=0.001)


def _campaign(folder: Path) -> Path:
    import numpy as np

    from tests.gap.oscillator import campaign, measure
    from tests.toys import build

    toys = folder / "toys"
    toys.mkdir()
    build(toys)
    return campaign(folder, toys, [measure(s, lambda _, __, v: -0.4 * np.tanh(v / 0.01)) for s in (1, 2)])
