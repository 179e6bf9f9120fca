"""report.html: a diagnosis for a person, in one file that needs nothing else.

Reads the contents of diagnosis.json and `signals.Signals`, nothing else of the diagnosis; `collect` makes the latter of
the pipeline's state. Every section of the page is a module (what is shown) and a template (how).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.files import make_folder, write_together
from .page import render
from .signals import Signals

NAME = "report.html"

__all__ = ["NAME", "render", "write_report"]


def write_report(data: Mapping[str, Any], signals: Signals | None, folder: Path) -> Path:
    """Write the report of a diagnosis into `folder`.

    data: the contents of diagnosis.json; signals: its time series, None where they are not at hand. Raises
    `OutputError`.
    """
    text = render(data, signals)
    make_folder(folder)
    write_together(folder, {NAME: text})
    return folder / NAME
