"""What becomes of a run when an FMU misbehaves, in every call of the interface, with and without isolation.

    python -m benchmarks.rogue [--how segfault,exit] [--where fmi2DoStep] [--ways plain,isolate,sandbox]

A well-behaved FMU is connected to one that does something wrong (`fmus/rogue.c`). A run of the command is judged by
what it leaves: it has to end by itself, with exit code 0 and a summary, or with a line that names the component; never
with a signal, a traceback, an empty result and exit code 0, or not at all.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks import native

HOW = (
    "segfault", "abort", "fpe", "exit", "_exit", "hang", "error", "fatal", "status", "nan", "percent", "storm",
    "thread", "signals", "descriptors", "output", "folder", "write", "network", "parent",
)  # fmt: skip
WHERE = (
    "fmi2Instantiate", "fmi2SetupExperiment", "fmi2EnterInitializationMode", "fmi2ExitInitializationMode",
    "fmi2GetReal", "fmi2SetReal", "fmi2DoStep", "fmi2Terminate", "fmi2FreeInstance",
)  # fmt: skip
WAYS = {"plain": (), "isolate": ("--isolate", "--step-timeout", "5"), "sandbox": ("--sandbox", "--step-timeout", "5")}
PATIENCE = 200.0
"""Longest time of a run [s]: an isolated FMU has two minutes to be loaded and initialised."""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Rogue" guid="rogue">
<CoSimulation modelIdentifier="Rogue" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
"""


def fmu(folder: Path, how: str, where: str) -> Path:
    """The FMU that misbehaves so, in that call."""
    library = folder / "Rogue.so"
    if not library.exists():
        native.compiled(native.HERE / "fmus" / "rogue.c", 2, library, "-lpthread")
    path = folder / f"{how}_{where}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(library, "binaries/linux64/Rogue.so")
        archive.writestr("resources/rogue.txt", f"{how} {where}")
    return path


def package(folder: Path, how: str, where: str) -> Path:
    """A ramp that drives the FMU, and a gain that it drives."""
    from tests.master.parts import constant, gain
    from tests.packages import component, connector, link, system
    from tests.packages import package as pack

    rogue = component("rogue", "resources/R.fmu", connector("u", "input"), connector("y", "output"))
    root = system("root", constant("good", 1.0), rogue, gain("after", 2.0),
                  links=(link("good.y1", "rogue.u"), link("rogue.y", "after.u1")))  # fmt: skip
    files = {"resources/L.fmu": native.linear(folder, 2), "resources/R.fmu": fmu(folder, how, where)}
    return pack(folder / f"{how}_{where}.ssp", root, files, stop=1.0, step=0.1)


@dataclass(frozen=True)
class Outcome:
    """What a run left."""

    verdict: str
    """`runs`, `told` (a line that names the component), or what is wrong."""
    said: str
    wrote: bool
    """Whether the FMU could write outside of its folders."""


def attempt(folder: Path, how: str, where: str, way: str) -> Outcome:
    """Run the command."""
    out, home = folder / f"{how}_{where}_{way}", folder / f"home_{how}_{where}_{way}"
    home.mkdir()
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package(folder, how, where)), "--out", str(out)]
    environment = {**os.environ, "HOME": str(home)}
    try:
        done = subprocess.run([*command, "--no-plot", "--quiet", *WAYS[way]], capture_output=True, text=True,
                              timeout=PATIENCE, env=environment, check=False, errors="replace")  # fmt: skip
    except subprocess.TimeoutExpired:
        return Outcome("not done in time", "", False)
    wrote, said = (home / "rogue_was_here").exists(), done.stderr.strip()
    last = said.splitlines()[-1] if said else ""
    summary = out / "summary.json"
    status = json.loads(summary.read_text())["status"] if summary.exists() else None
    if "Traceback" in said:
        return Outcome("traceback", said[-400:], wrote)
    if done.returncode < 0:
        return Outcome(f"signal {-done.returncode}", last, wrote)
    if done.returncode == 0:
        return Outcome("runs" if status in ("ok", "ended") else "nothing, and exit code 0", last, wrote)
    if done.returncode == 143 and how == "parent":
        return Outcome("told", last, wrote)
    is_named = "rogue" in last or "--isolate says" in last
    return Outcome("told" if is_named and last.startswith("cosim-master: ") else "not named", last, wrote)


def main(arguments: Sequence[str] | None = None) -> int:
    p = argparse.ArgumentParser(prog="python -m benchmarks.rogue", description=__doc__,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("--how", default=",".join(HOW))
    p.add_argument("--where", default=",".join(WHERE))
    p.add_argument("--ways", default=",".join(WAYS))
    options = p.parse_args(arguments)
    counts: dict[str, Counter[str]] = {way: Counter() for way in options.ways.split(",")}
    wrong, written = [], Counter[str]()
    with tempfile.TemporaryDirectory(prefix="rogue_") as name:
        for how in options.how.split(","):
            for where in options.where.split(","):
                for way in counts:
                    if how in ("hang", "parent") and way == "plain":
                        continue  # waits for Ctrl-C; ends who has started it
                    found = attempt(Path(name), how, where, way)
                    counts[way][found.verdict] += 1
                    written[way] += found.wrote
                    line = f"{how:<12}{where:<30}{way:<9}{found.verdict:<12}{found.said[:150]}"
                    print(line, flush=True)
                    if found.verdict not in ("runs", "told"):
                        wrong.append(line)
    print()
    for way, counter in counts.items():
        told = ", ".join(f"{n} {verdict}" for verdict, n in counter.most_common())
        print(f"{way}: {told}; {written[way]} wrote outside of their folders")
    print("\n".join(["", "wrong:", *wrong]) if wrong else "\nnothing wrong")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
