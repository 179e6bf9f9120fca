"""The scenes of the shipped models, which a replay draws: the files in `replay/<model>`."""

from __future__ import annotations

import re
from pathlib import Path

SHIPPED = Path(__file__).parent / "replay"
NAME = re.compile(r"\b[A-Za-z_]\w*(?:\.\w+)*\b(?!\()")
"""A variable in a formula; what is followed by a bracket is a function."""

Files = tuple[tuple[str, bytes], ...]


def shipped_scene(model: str) -> Files:
    """Names in resources/replay of the model's FMU, and contents; none where nothing is drawn of it."""
    return tuple((path.name, path.read_bytes()) for path in sorted((SHIPPED / model).glob("*")))


def scene_within(part: str, model: str) -> Files:
    """The scene of a model that is a part of an FMU, in which the variables are called <part>.<name>."""
    files = {name: content.decode() for name, content in shipped_scene(model)}
    scene = re.sub(r"\{[^{}]*\}", lambda place: _within(part, place[0]), files["scene.xml"])
    rules, joints, rest = files["replay.toml"].partition("[joints]\n")
    own, gap, others = rest.partition("\n\n")
    own = re.sub(r'(?<== ").*(?="$)', lambda formula: _within(part, formula[0]), own, flags=re.MULTILINE)
    return ("replay.toml", (rules + joints + own + gap + others).encode()), ("scene.xml", scene.encode())


def _within(part: str, formula: str) -> str:
    return NAME.sub(lambda name: f"{part}.{name[0]}", formula)
