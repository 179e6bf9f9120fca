"""The JSON schema of machine.toml, for editors."""

from __future__ import annotations

from ..core.json_schema import TEXT, Key, Keys, Schema, file_schema, table
from ..hydraulics_fmu.variables import HYDRAULICS
from ..mechanics.variables import ARM
from .data_sheet import KEYS, NEEDED

NAME = "machine.schema.json"

NUMBER_OR_TEXT: Schema = {"type": ["number", "string"]}


def machine_schema() -> Schema:
    """A number is in SI units, a text has its unit: "63 mm"."""
    entries: dict[str, Key] = {
        "name": Key(TEXT, "what the packages are called; the file's name if it is not stated"),
        "depth": Key({"anyOf": [NUMBER_OR_TEXT, {"type": "array", "items": NUMBER_OR_TEXT, "minItems": 1}]},
                     'depth, or depths: a package each, such as ["0 m", "3000 m"]'),
    }  # fmt: skip
    for name, keys in KEYS.items():
        entries[name] = Key(table(_keys(name)), f"{name}; a number is in SI units, a text has its unit",
                            name in NEEDED and bool(keys))  # fmt: skip
    return file_schema("machine.toml of deepsea-cosim", entries)


def _keys(name: str) -> Keys:
    made: dict[str, Key] = {}
    variables = ARM if name == "arm" else HYDRAULICS
    for key, (unit, parameter) in KEYS[name].items():
        said = variables[parameter].description if parameter else key.replace("_", " ")
        shown = f" [{unit}]" if unit not in ("", "1") else ""
        made[key] = Key(NUMBER_OR_TEXT if unit else TEXT, f"{said}{shown}", key in NEEDED.get(name, ()))
    return made
