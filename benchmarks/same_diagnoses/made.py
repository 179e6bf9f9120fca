"""What campaigns are made of."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from tests.gap import oscillator


@dataclass(frozen=True)
class Made:
    """A folder with the toy's FMU, and the deep-sea package."""

    toys: Path
    machine: Path


def build_toys(folder: Path) -> None:
    """The toy's FMU, made with plain pythonfmu."""
    script = Path(oscillator.__file__).parents[1] / "toys" / "toy_oscillator.py"
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)


def edit(path: Path, *changes: tuple[str, str]) -> None:
    """Replace texts in a file; ValueError where there is nothing to replace."""
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        if old not in text:
            raise ValueError(f"{path}: has no {old!r} to change")
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def catalogue_of(package: Path) -> str:
    """The text of a package's catalogue."""
    with zipfile.ZipFile(package) as archive:
        return archive.read("resources/effects.toml").decode("utf-8")


def cut(catalogue: str, effects: Collection[str], base: Collection[str]) -> str:
    """The text of a catalogue with these effects, sensors and base parameters, and the curves that stand for these
    effects only; the rest stays."""
    kept, keep = [], True
    for part in re.split(r"^(?=\[)", catalogue, flags=re.MULTILINE):
        head = part.partition("\n")[0]
        if head in ("[[effect]]", "[[sensor]]", "[[base]]"):
            name = re.search(r'^(?:id|parameter) = "(.*)"', part, re.MULTILINE)
            keep = name is not None and name[1] in (base if head == "[[base]]" else effects)
        elif head == "[[curve]]":
            keep = set(tomllib.loads(part)["curve"][0]["effects"]) <= set(effects)
        elif not head.lstrip("[").startswith(("effect.", "sensor.", "curve.")):
            keep = True
        if keep:
            kept.append(part)
    return "".join(kept)
