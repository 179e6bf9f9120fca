"""The units in which a person reads numbers: in tables, plots and pages. Files keep the units of the FMUs."""

from __future__ import annotations

import os
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from .errors import UsageError, did_you_mean
from .unit_names import named
from .units import UNITS, Unit, conversion

METRIC = ("mm", "mm/s", "MPa", "L/min", "L", "kN", "deg", "deg/s")
US = ("in", "in/s", "psi", "gpm", "gal", "lbf", "deg", "deg/s")
USUAL = 0.1, 1e5
"""Least and greatest size of numbers for which another unit is taken: a depth of 11 km is not told in mm."""


@dataclass(frozen=True)
class DisplayUnits:
    """Units that are shown instead of others of their dimension.

    chosen: instead of any; usual: instead of those of SI only, for a unit that an FMU has chosen stays.
    """

    chosen: tuple[str, ...] = ()
    usual: tuple[str, ...] = METRIC

    def of(self, unit: str, largest: float) -> tuple[str, float, float]:
        """(name, factor, offset) of what is shown for a signal in `unit` whose greatest absolute value is `largest`:
        shown = factor * value + offset."""
        own = named(unit)
        if own is None or not own.exponents:
            return unit, 1.0, 0.0
        is_si = (own.factor, own.offset) == (1.0, 0.0)
        for name in (*self.chosen, *(self.usual if is_si else ())):
            other = named(name)
            if other is not None and other.same_dimension(own) and _is_angle(other) == _is_angle(own):
                factor, offset = conversion(own, other)
                if not largest or USUAL[0] <= abs(factor * largest + offset) * (1.0 + 1e-9) <= USUAL[1]:
                    return name, factor, offset
        return unit, 1.0, 0.0


def _is_angle(unit: Unit) -> bool:
    """Whether radians are in it: an angle a second is no number of turns, though both are 1/s."""
    return bool((unit.exponents or {}).get("rad"))


PRESETS = {"metric": DisplayUnits(), "si": DisplayUnits((), ()), "us": DisplayUnits(US, ())}


def display_units(text: str | None, where: str = "--units") -> DisplayUnits:
    """What `--units` asks for: a preset or names of units; None: what the user's file says, else metric."""
    if text is None:
        return _of_user()
    return PRESETS.get(text.strip()) or _chosen([part.strip() for part in text.split(",")], where)


def _chosen(names: list[str], where: str) -> DisplayUnits:
    for name in names:
        if not name or named(name) is None:
            known = [*PRESETS, *UNITS]
            raise UsageError(
                f"{where}: unknown unit '{name}'{did_you_mean(name, known)}; "
                f"give {', '.join(PRESETS)}, or units like mm,bar,L/min,deg"
            )
    return DisplayUnits(tuple(names))


def user_file() -> Path:
    """Where a user says once which units are shown: units = ["mm", "bar", "L/min", "deg"]."""
    if sys.platform == "win32":
        base = Path(os.environ.get("APPDATA") or Path.home() / "AppData" / "Roaming")
    else:
        base = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return base / "deepsea-cosim" / "units.toml"


def _of_user() -> DisplayUnits:
    path = user_file()
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return DisplayUnits()
    except (OSError, ValueError) as error:
        raise UsageError(f"{path}: {error}") from None
    units = content.get("units")
    if isinstance(units, str):
        return display_units(units, str(path))
    if not isinstance(units, list) or not all(isinstance(name, str) for name in units) or len(content) != 1:
        raise UsageError(f'{path}: expected units = ["mm", "bar", "L/min", "deg"]')
    return _chosen(units, str(path))
