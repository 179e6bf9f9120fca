"""The command `cosim-gap pack`: a campaign with package, catalogue and runs in one file."""

from __future__ import annotations

import argparse
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.console import conclude
from ...core.errors import OutputError
from ...core.files import is_same_file, make_folder, replacing
from ...core.zips import add, new_archive
from ..campaign.campaign import CampaignError
from ..campaign.packed import CAMPAIGN, opened
from ..campaign.read import read
from ..campaign.tables import take
from .toml_text import quoted, value

PACKABLE = (".ssp", ".fmu")


def pack_command(options: argparse.Namespace) -> int:
    """Write the archive; returns the exit code."""
    size = pack(options.campaign, options.out, options.force)
    told = f"  {options.out}: {size / 1e6:.3g} MB; cosim-gap check, diagnose read it as it is"
    conclude(options, lambda: {"file": options.out, "bytes": size}, lambda: [told])
    return 0


def pack(path: Path, target: Path, force: bool = False) -> int:
    """Write a campaign and all that it names into a zip archive, whose size [bytes] is returned.

    Raises `CampaignError` for a campaign that cannot be read, `OutputError` for a file that is there.
    """
    if target.exists() and not force:
        raise OutputError(f"{target}: is there already; --force replaces it")
    with opened(path) as file:
        campaign = read(file)
        if campaign.system.suffix.lower() not in PACKABLE:
            raise CampaignError(f"{file}: system = '{campaign.system.name}': only an .ssp or .fmu can be packed")
        files: dict[str, Path] = {}
        data = take.load(file)
        renamed: dict[str, Any] = {**data, "system": _placed(campaign.system, "", files)}
        if campaign.effects is not None:
            renamed["effects"] = _placed(campaign.effects, "", files)
        renamed["run"] = [
            {**run, "file": _placed(file.parent / run["file"], "runs/", files)} if "file" in run else run
            for run in data.get("run", [])
        ]
        text = _renamed_text(file.read_text(encoding="utf-8-sig"), renamed)
        inputs = (path, campaign.system, campaign.effects, *(run.file for run in campaign.runs))
        if (used := next((p for p in inputs if is_same_file(p, target)), None)) is not None:
            raise OutputError(f"{target}: is {used.name}, which is packed; --out names another file")
        make_folder(target.parent)
        with replacing(target) as part, new_archive(part) as archive:
            add(archive, CAMPAIGN, text)
            for name, source in files.items():
                archive.write(source, name)
    return target.stat().st_size


def _placed(source: Path, folder: str, files: dict[str, Path]) -> str:
    """The name of a file in the archive, its own where no other has that."""
    source = source.resolve()
    name, k = f"{folder}{source.name}", 1
    while name in (CAMPAIGN, *files) and files.get(name) != source:
        k += 1
        name = f"{folder}{source.stem}_{k}{source.suffix}"
    files[name] = source
    return name


def _renamed_text(text: str, data: Mapping[str, Any]) -> str:
    """The text of a campaign with other names of files, its comments kept where that can be done line by line."""
    names = {"system": iter([data["system"]]), "effects": iter([data["effects"]] if "effects" in data else []),
             "file": iter([run["file"] for run in data["run"] if "file" in run])}  # fmt: skip
    lines = []
    for line in text.splitlines():
        match = re.match(r"""(\s*(system|effects|file)\s*=\s*)("(?:[^"\\]|\\.)*"|'[^']*')(.*)$""", line)
        name = next(names[match[2]], None) if match else None
        lines.append(f"{match[1]}{quoted(name)}{match[4]}" if match and name is not None else line)
    made = "\n".join(lines) + "\n"
    try:
        if tomllib.loads(made) == data:
            return made
    except ValueError:
        pass
    return _plain(data)


def _plain(data: Mapping[str, Any]) -> str:
    """A campaign as TOML, without comments."""
    lines = [f"{quoted(k)} = {value(x)}" for k, x in data.items() if not _is_tables(x)]
    for key, tables in ((k, x) for k, x in data.items() if _is_tables(x)):
        for table in tables:
            lines += ["", f"[[{key}]]", *(f"{quoted(k)} = {value(x)}" for k, x in table.items())]
    return "\n".join(lines) + "\n"


def _is_tables(x: Any) -> bool:
    return isinstance(x, list) and bool(x) and all(isinstance(t, dict) for t in x)
