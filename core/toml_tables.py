"""Takes values out of the tables of a TOML file, with faults that name the place in one line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from .errors import CosimError, did_you_mean
from .limits import SETTINGS, limit, remedy
from .plain_numbers import shown_value
from .regular import require_regular

CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Characters that end a line or steer a terminal."""


class Tables:
    """What is wrong in a file's tables is raised as `error`, its text beginning with `where`."""

    def __init__(self, error: type[CosimError]):
        self.error = error

    def load(self, path: Path) -> dict[str, Any]:
        """The data of a TOML file."""
        require_regular(path, self.error)
        self.check_size(path.stat().st_size, str(path))
        try:
            return self.parse(path.read_text(encoding="utf-8-sig"), str(path))
        except OSError as error:
            raise self.error(f"{path}: cannot be read ({error.strerror})") from None
        except UnicodeDecodeError:
            raise self.error(f"{path}: is not a text file in UTF-8; save it as that") from None

    def check_size(self, size: float, where: str) -> None:
        """Raises for more bytes than a file of settings is taken with: it would be read for minutes."""
        megabytes, most = size / 1e6, limit(SETTINGS)
        if megabytes > most:
            raise self.error(f"{where}: has {megabytes:.0f} MB, more than {most:g}; {remedy(SETTINGS, megabytes + 1)}")

    def parse(self, text: str, where: str) -> dict[str, Any]:
        """The data of a TOML text."""
        try:
            return tomllib.loads(text)
        except (ValueError, RecursionError) as error:  # of numbers that are too long, too
            raise self.error(f"{where}: not valid TOML ({error})") from None

    def label(self, table: dict[str, Any], where: str, key: str, default: str | None = None) -> str:
        """A name that stands in lines, pictures and tables: neither empty nor with control characters."""
        value: str = self.get(table, where, key, str, default)
        if not value.strip() or CONTROL.search(value):
            raise self.error(f"{where}: '{key}' = {shown_value(value)} has to be a name in one line")
        return value

    def get(self, table: dict[str, Any], where: str, key: str, kind: type, default: Any = None) -> Any:
        """A value of that type; one that is missing is `default`, or a fault when that is None."""
        if key not in table and default is not None:
            return default
        if key not in table:
            raise self.error(f"{where}: '{key}' is missing")
        if not isinstance(table[key], kind):
            raise self.error(f"{where}: '{key}' = {shown_value(table[key])} has the wrong type")
        return table[key]

    def number(self, table: dict[str, Any], where: str, key: str, default: float | None = None) -> float:
        """A finite number."""
        value = table.get(key, default)
        if value is None:
            raise self.error(f"{where}: '{key}' is missing")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(f"{where}: '{key}' = {shown_value(value)} has the wrong type; it has to be a number")
        try:
            number = float(value)
        except OverflowError:  # an integer of hundreds of digits
            raise self.error(f"{where}: '{key}' is not finite") from None
        if not isfinite(number):
            raise self.error(f"{where}: '{key}' = {shown_value(value)} is not finite")
        return number

    def numbers(
        self, table: dict[str, Any], where: str, key: str, default: Sequence[float] | None = None
    ) -> list[float]:
        """A list of finite numbers."""
        values = self.get(table, where, key, list, None if default is None else list(default))
        return [self.number({key: v}, where, key) for v in values]

    def file(self, table: dict[str, Any], where: str, key: str, folder: Path) -> Path:
        """A path, relative to a folder."""
        name: str = self.get(table, where, key, str)
        if "\0" in name or not name.strip():
            raise self.error(f"{where}: '{key}' = {name!r} is not the name of a file")
        try:
            (folder / name).is_file()
        except OSError as fault:
            raise self.error(f"{where}: '{key}' = {shown_value(name)}: {fault.strerror}") from None
        return folder / name

    def strings(self, table: dict[str, Any], where: str, key: str) -> tuple[str, ...]:
        """A list of strings; empty when it is missing."""
        values = self.get(table, where, key, list, [])
        if not all(isinstance(v, str) for v in values):
            raise self.error(f"{where}: '{key}' = {shown_value(values)} has to be a list of strings")
        return tuple(values)

    def tables(self, table: dict[str, Any], where: str, key: str) -> list[dict[str, Any]]:
        """The tables `[[key]]`; empty when there are none."""
        made = table.get(key, [])
        if not isinstance(made, list) or not all(isinstance(t, dict) for t in made):
            raise self.error(f"{where}: '{key}' has to be tables [[{key}]]")
        return made

    def reject_unknown_keys(self, table: dict[str, Any], known: Collection[str], where: str) -> None:
        """Raises for a key that is not known."""
        for key in table:
            if key not in known:
                raise self.error(f"{where}: unknown key '{key}'{did_you_mean(key, list(known))}")
