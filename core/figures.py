"""Figures that are shown where they are returned, and where matplotlib keeps what it needs."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from .scratch import make_scratch


def settle_matplotlib() -> None:
    """Where the user's folders cannot be written to, matplotlib leaves a temporary one for every process: give those of
    this command one that goes with it."""
    own = [("XDG_CONFIG_HOME", ".config"), ("XDG_CACHE_HOME", ".cache")]
    if "MPLCONFIGDIR" not in os.environ and os.name == "posix":
        places = [Path(os.environ.get(name) or Path("~", usual).expanduser(), "matplotlib") for name, usual in own]
        if not all(map(_can_be_written, places)):
            os.environ["MPLCONFIGDIR"] = str(make_scratch("matplotlib"))


def _can_be_written(folder: Path) -> bool:
    there = next((p for p in (folder, *folder.parents) if p.exists()), folder)
    try:
        with TemporaryFile(dir=there):
            return True
    except OSError:
        return False


def in_notebooks(figure: Any) -> Any:
    """The matplotlib figure, made to show itself in a notebook, which it does else only once pyplot is imported."""

    def image() -> bytes:
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()

    figure._repr_png_ = image
    return figure
