"""The command `cosim-gap new`: a campaign from a package and run files."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...core.console import conclude
from ...core.errors import CosimError, OutputError, UsageError
from ...core.files import is_same_file, make_folder, replacing, write_together
from ...core.json_schema import write_schema
from ...master.simulation.session import Session
from ..campaign.keys import SCHEMAS
from ..campaign.read import read
from .ask import ask_all
from .draft import Draft, RunDraft
from .guess import guess
from .model import Model
from .sources import complete, write_copy
from .write import campaign_text

CAMPAIGN, EFFECTS, RUNS = "campaign.toml", "effects.toml", "runs"


def new_command(options: argparse.Namespace) -> int:
    """Write the campaign and print what was guessed; returns the exit code."""
    files, folder = _files(options.data), options.out
    if not options.package.exists():
        raise UsageError(f"{options.package}: no such file")
    if not options.force:
        _refuse(folder, [CAMPAIGN])
    with Session(options.package) as session:
        model = Model(session, options.package)
        draft = guess(model, files, options.package.stem, options.rate)
        if options.tolerance:
            draft = replace(draft, base_said={p.address: options.tolerance for p in draft.base})
        if options.tolerance and not draft.base:
            remark = "--tolerance is not used: the catalogue of the package says how well its parameters are known"
            draft = replace(draft, remarks=(remark, *draft.remarks))
        if options.ask and not options.json and sys.stdin is not None and sys.stdin.isatty():
            draft = ask_all(draft, model, input)
    target, faults = write(draft, options.package, folder, options.force)
    conclude(options, lambda: _content(draft, target, faults), lambda: _told(draft, target, faults))
    return 0


def _files(named: Sequence[Path]) -> list[Path]:
    """The run files, each once; patterns that the shell has not opened are."""
    found: list[Path] = []
    for path in named:
        matches = sorted(Path(path.anchor or ".").glob(str(path.relative_to(path.anchor)))) if _is_pattern(path) else []
        found += matches or [path]
    for path in found:
        if path.is_dir():
            raise UsageError(f"{path}: is a folder; name the files in it, as {path}/*.csv")
        if not path.exists():
            raise UsageError(f"{path}: no such file")
    return list(dict.fromkeys(found))


def _is_pattern(path: Path) -> bool:
    return not path.exists() and any(mark in str(path) for mark in "*?")


def _refuse(folder: Path, names: Sequence[str]) -> None:
    for name in names:
        if (folder / name).exists():
            raise OutputError(f"{folder / name}: is there already; --force replaces it, --out names another folder")


def write(draft: Draft, package: Path, folder: Path, force: bool) -> tuple[Path, str]:
    """Write the campaign and what it needs into a folder; returns campaign.toml, and what reading it says or "".

    What is there is replaced with `force` only, and each file only once its new contents are complete. Raises
    `OutputError`.
    """
    names = _copies(draft)
    if not force:
        _refuse(folder, [CAMPAIGN, *([EFFECTS] if draft.catalogue else []), *filter(None, names)])
    for copy in filter(None, names):
        if any(is_same_file(r.source.file, folder / copy) for r in draft.runs):
            raise OutputError(f"{folder / copy}: is one of the files that are read; --out names another folder")
    make_folder(folder)
    sources = complete([r.source for r in draft.runs], draft.used)
    files = []
    for source, name in zip(sources, names, strict=True):
        if name is not None:
            make_folder((folder / name).parent)
            with replacing(folder / name) as part:
                write_copy(source, draft.used, part)
        files.append(name or _relative(source.file, folder))
    for name, schema in SCHEMAS.items():
        if draft.catalogue or name.startswith(Path(CAMPAIGN).stem):
            write_schema(folder, name, schema)
    if draft.catalogue:
        write_together(folder, {EFFECTS: draft.catalogue})
    text = campaign_text(draft, _relative(package, folder), EFFECTS if draft.catalogue else None, files)
    with replacing(folder / CAMPAIGN) as part:
        part.write_text(text, encoding="utf-8")
        faults = _faults(part) if draft.matches else ""
    return folder / CAMPAIGN, faults


def _copies(draft: Draft) -> list[str | None]:
    """Names of the copies of runs that need one, in the campaign's folder; None for the others."""
    sources = complete([r.source for r in draft.runs], draft.used)
    names: list[str | None] = []
    for s in sources:
        stem = re.sub(r"[^\w.=+-]+", "_", s.name)
        name = f"{RUNS}/{stem}.csv"
        while name in names:
            name = f"{RUNS}/{(stem := stem + '_')}.csv"
        names.append(name if s.copy else None)
    return names


def _relative(path: Path, folder: Path) -> str:
    """A path as the campaign in a folder names it: relative where both are on one drive."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_posix()


def _faults(path: Path) -> str:
    """What reading the campaign says, in a line; "" where it can be read."""
    try:
        read(path)
    except CosimError as error:
        return str(error).replace(str(path), CAMPAIGN)
    return ""


def _content(draft: Draft, target: Path, faults: str) -> dict[str, Any]:
    """For programs: what was guessed, and what could not be."""
    channels = [
        {"column": m.column, "connector": m.connector.address, "unit": m.unit, "drives": m.connector.is_input,
         "why": m.why}
        for m in draft.matches
    ]  # fmt: skip
    return {
        "campaign": target, "channels": channels, "runs": [_run_line(r) for r in draft.runs],
        "remarks": list(draft.remarks), "questions": [*filter(None, [faults]), *draft.questions()],
    }  # fmt: skip


def _told(draft: Draft, target: Path, faults: str) -> list[str]:
    """What is printed: channels, runs, remarks, questions."""
    lines = [f"{target}: {len(draft.matches)} channels, {len(draft.runs)} runs"]
    wide = max((len(m.column) for m in draft.matches), default=0)
    for m in draft.matches:
        arrow = "drives" if m.connector.is_input else "is"
        lines.append(f"  {m.column:<{wide}}  {arrow:<6} {m.connector.address} in {m.unit}, {m.why}")
    lines += [f"  {_run_line(r)}" for r in draft.runs[:6]]
    if len(draft.runs) > 6:
        lines.append(f"  and {len(draft.runs) - 6} more runs")
    lines += [f"  {remark}" for remark in draft.remarks[:6]]
    questions = draft.questions()
    if not draft.matches:
        questions.insert(0, "no column was recognised: give the channels by hand")
    if faults:
        questions.insert(0, faults)
    if questions:
        lines += ["", f"Not guessed ({len(questions)}; each is a '# ?' in the file):"]
        lines += [f"  ? {q}" for q in questions]
    return [*lines, "", f"Next: cosim-gap check {target}"]


def _run_line(run: RunDraft) -> str:
    t = run.clock.times(run.source)
    conditions = "".join(f", {c.parameter} = {c.value:g}" for c in run.conditions)
    rate = (len(t) - 1) / float(t[-1] - t[0])
    start = f", from {run.clock.start:g} s of the file on" if run.clock.start is not None else ""
    use = ", held out" if run.use else ""
    return f"{run.source.name}: {float(t[-1]):.4g} s at {rate:.4g} readings a second{start}{conditions}{use}"
