"""The files of a diagnosis beside its report: diagnosis.json and calibrated.ssv."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...core.files import make_folder, write_together
from ..pipeline.diagnosis import Diagnosis
from .document import document
from .parameter_set import parameter_set

JSON, CALIBRATED = "diagnosis.json", "calibrated.ssv"


def texts(d: Diagnosis) -> tuple[dict[str, Any], dict[str, str]]:
    """The contents of diagnosis.json, and the texts of the files by name."""
    data = document(d)
    return data, {JSON: json.dumps(data, indent=1, allow_nan=False) + "\n", CALIBRATED: parameter_set(d)}


def write(d: Diagnosis, folder: Path) -> dict[str, Any]:
    """Write them; returns the contents of diagnosis.json."""
    data, made = texts(d)
    make_folder(folder)
    write_together(folder, made)
    return data
