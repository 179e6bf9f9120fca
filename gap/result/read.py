"""Reads a diagnosis.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...core.errors import CosimError
from ..search.earlier import EarlierDiagnosis, EarlierSet
from .document import SCHEMA


class DiagnosisError(CosimError):
    """A file that is no diagnosis of the schema that is read."""


def load(path: Path) -> dict[str, Any]:
    """The contents of a diagnosis.json, or of the one in a folder; raises `DiagnosisError`."""
    file = path / "diagnosis.json" if path.is_dir() else path
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DiagnosisError(f"{file}: cannot be read ({error.strerror or error})") from None
    except ValueError as error:
        raise DiagnosisError(f"{file}: is no JSON ({error}); give the diagnosis.json of a diagnosis") from None
    schema = data.get("schema") if isinstance(data, dict) else None
    if schema is None:
        raise DiagnosisError(f"{file}: has no 'schema'; give the diagnosis.json of a diagnosis")
    if schema == SCHEMA:
        return dict(data)
    if isinstance(schema, int) and schema < SCHEMA:
        raise DiagnosisError(f"{file}: schema {schema} is no longer read; diagnose again")
    raise DiagnosisError(
        f"{file}: schema {schema} is not known here (this version reads {SCHEMA}); update deepsea-cosim"
    )


def load_earlier(path: Path) -> EarlierDiagnosis:
    """The sets that the diagnosis in a folder had fitted; raises `DiagnosisError` where it does not tell them."""
    search = load(path).get("search")
    if not search:
        file = path / "diagnosis.json" if path.is_dir() else path
        raise DiagnosisError(f"{file}: tells no sets to go on from; diagnose without --resume once")
    return EarlierDiagnosis(tuple(EarlierSet(s["effects"], s["point"]) for s in search["sets"]), search["finished"])
