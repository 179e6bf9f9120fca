"""Keys of a TOML file's tables, described once: readers take their names, editors the JSON schema made of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .files import make_folder, replacing

Schema = dict[str, Any]

DIALECT = "http://json-schema.org/draft-07/schema#"
"""What editors of TOML understand."""

TEXT: Schema = {"type": "string"}
NUMBER: Schema = {"type": "number"}
ABOVE_ZERO: Schema = {"type": "number", "exclusiveMinimum": 0}
NOT_NEGATIVE: Schema = {"type": "number", "minimum": 0}
SWITCH: Schema = {"type": "boolean"}
NUMBERS: Schema = {"type": "array", "items": NUMBER}
TWO_NUMBERS: Schema = {**NUMBERS, "minItems": 2, "maxItems": 2}
TEXTS: Schema = {"type": "array", "items": TEXT}
SCALARS: Schema = {"type": "object", "additionalProperties": {"type": ["number", "boolean", "string"]}}
"""Numbers, switches and texts by any name."""


@dataclass(frozen=True)
class Key:
    """A key of a table: what its value may be, and a sentence for people."""

    schema: Schema
    text: str
    needed: bool = False


Keys = Mapping[str, Key]


def one_of(*texts: str) -> Schema:
    """One of these texts."""
    return {"enum": list(texts)}


def table(keys: Keys) -> Schema:
    """A table of these keys and no others."""
    return {
        "type": "object", "additionalProperties": False,
        "properties": {name: {**key.schema, "description": key.text} for name, key in keys.items()},
        "required": [name for name, key in keys.items() if key.needed],
    }  # fmt: skip


def tables(keys: Keys) -> Schema:
    """Tables `[[name]]` of these keys."""
    return {"type": "array", "items": table(keys)}


def file_schema(title: str, keys: Keys) -> Schema:
    """The schema of a whole file."""
    return {"$schema": DIALECT, "title": title, **table(keys)}


def write_schema(folder: Path, name: str, schema: Schema) -> Path:
    """Write a schema into a folder, whatever is there by that name."""
    make_folder(folder)
    target = folder / name
    with replacing(target) as part:
        part.write_text(json.dumps(schema, indent=1) + "\n", encoding="utf-8")
    return target


def reference(name: str) -> str:
    """The first line of a TOML file by which editors find a schema beside it."""
    return f"#:schema ./{name}"
