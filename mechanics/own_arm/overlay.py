"""A table that makes cylinders of another's model: which of its tendons are some, or between which bodies they are;
what is left out of the model, and which joints stay as they are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from ...core.errors import PackageError, did_you_mean
from ...core.toml_tables import Tables

ENDS = ("base", "eye")
KEYS = ("name", *(f"{end}{what}" for end in ENDS for what in ("", "_at")))
"""What a `[[cylinder]]` may say."""


@dataclass(frozen=True)
class Cylinder:
    """A cylinder by the name of its tendon; ends: two bodies, each with a place in its frame [m]. Without them the
    model has that tendon."""

    name: str
    ends: tuple[tuple[str, tuple[float, ...]], ...]


@dataclass(frozen=True)
class Overlay:
    """What the table says; names that are left out or held may have * in them. where: the file."""

    where: str = ""
    without: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()


def read_overlay(path: Path) -> Overlay:
    """The table in a TOML file. Raises `PackageError`."""
    tables = Tables(PackageError)
    data, where = tables.load(path), str(path)
    tables.reject_unknown_keys(data, ("without", "held", "cylinder"), where)
    entries = tables.tables(data, where, "cylinder")
    made = tuple(_cylinder(tables, entry, f"{path}: cylinder {entry.get('name', k)}")
                 for k, entry in enumerate(entries, 1))  # fmt: skip
    names = [c.name for c in made]
    for name in names:
        if names.count(name) > 1:
            raise PackageError(f"{path}: cylinder {name}: stands there {names.count(name)} times")
    return Overlay(where, tables.strings(data, where, "without"), tables.strings(data, where, "held"), made)


def _cylinder(tables: Tables, entry: dict[str, Any], where: str) -> Cylinder:
    tables.reject_unknown_keys(entry, KEYS, where)
    name = tables.get(entry, where, "name", str)
    if not set(entry) & set(KEYS[1:]):
        return Cylinder(name, ())
    ends = []
    for end in ENDS:
        place = tables.numbers(entry, where, f"{end}_at")
        if len(place) != 3:
            raise PackageError(f"{where}: '{end}_at' has to be three numbers, a place in the frame of the body [m]")
        ends.append((tables.get(entry, where, end, str), tuple(place)))
    return Cylinder(name, tuple(ends))


def leave_out(spec: Any, overlay: Overlay) -> None:
    """Delete the bodies, tendons and equality constraints that the table names, with what refers to them."""
    for pattern in overlay.without:
        known = [e.name for kind in _kinds(spec) for e in kind]
        if not matching(pattern, known):
            told = did_you_mean(pattern, known)
            raise PackageError(f"{overlay.where}: without '{pattern}': no body, tendon or equality is called so{told}")
        while found := [e for kind in _kinds(spec) for e in kind if fnmatchcase(e.name, pattern)]:
            spec.delete(found[0])  # one at a time: others may have gone with it


def _kinds(spec: Any) -> Sequence[Iterable[Any]]:
    return [b for b in spec.bodies if b.name != "world"], list(spec.tendons), list(spec.equalities)


def add_cylinders(spec: Any, overlay: Overlay) -> tuple[str, ...]:
    """Put the cylinders into the model that it has not; names of all the cylinders' tendons, without a table all of
    the model's."""
    has = [t.name for t in spec.tendons]
    for cylinder in overlay.cylinders:
        where = f"{overlay.where}: cylinder {cylinder.name}"
        if not cylinder.ends and cylinder.name not in has:
            told = did_you_mean(cylinder.name, has) or "; one that it has not needs base, base_at, eye and eye_at"
            raise PackageError(f"{where}: the model has no tendon of that name{told}")
        if cylinder.ends and cylinder.name in has:
            raise PackageError(f"{where}: the model has a tendon of that name; take another name")
        if not cylinder.ends:
            continue
        tendon = spec.add_tendon(name=cylinder.name)
        for end, (body, place) in zip(ENDS, cylinder.ends, strict=True):
            bodies = {b.name: b for b in spec.bodies if b.name}
            if body not in bodies:
                raise PackageError(f"{where}: {end}: the model has no body '{body}'{did_you_mean(body, list(bodies))}")
            name = f"{cylinder.name}_{end}_of_cylinder"
            bodies[body].add_site(name=name, pos=place)
            tendon.wrap_site(name)
    return tuple(c.name for c in overlay.cylinders) or tuple(has)


def held_joints(overlay: Overlay, names: Sequence[str]) -> tuple[str, ...]:
    """Those of the joints' names that the table holds."""
    for pattern in overlay.held:
        if not matching(pattern, names):
            told = did_you_mean(pattern, names)
            raise PackageError(f"{overlay.where}: held '{pattern}': no joint is called so{told}")
    return tuple(name for name in names if any(fnmatchcase(name, pattern) for pattern in overlay.held))


def matching(pattern: str, names: Iterable[str]) -> list[str]:
    """Those of the names that are like the pattern."""
    return [name for name in names if fnmatchcase(name, pattern)]
