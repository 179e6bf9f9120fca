"""Puts effect_forms.py beside an FMU script."""

from __future__ import annotations

from pathlib import Path

from ..core.errors import OutputError
from ..core.files import make_folder, replacing, writing

NAME = "effect_forms.py"


def write(folder: Path) -> Path:
    """Write it into a folder; raises `OutputError` where another file of that name is there."""
    text, target = Path(__file__).with_name(NAME).read_text(encoding="utf-8"), folder / NAME
    make_folder(folder)
    with writing(target):
        if target.exists() and target.read_text(encoding="utf-8", errors="replace") != text:
            raise OutputError(f"{target}: is there already and is another one; move it away, or choose another --out")
        with replacing(target) as part:
            part.write_text(text, encoding="utf-8")
    return target
