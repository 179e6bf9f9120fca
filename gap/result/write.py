"""Writes diagnosis.json and calibrated.ssv."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...core.files import make_folder, writing
from ..pipeline.diagnosis import Diagnosis
from .document import document
from .parameter_set import parameter_set


def write(d: Diagnosis, folder: Path) -> dict[str, Any]:
    """Write the files of a diagnosis; returns the contents of diagnosis.json."""
    data = document(d)
    make_folder(folder)
    with writing(folder):
        (folder / "diagnosis.json").write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (folder / "calibrated.ssv").write_text(parameter_set(d), encoding="utf-8")
    return data
