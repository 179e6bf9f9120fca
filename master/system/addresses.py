"""What an address such as component.parameter, or a pattern of such, means."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from typing import Any

from ..slaves.base import FmuInstance
from .system import System


def split(address: str, instances: Mapping[str, Any]) -> tuple[str, str]:
    """(component, name) of an address; component names may hold dots, so the longest counts. ('', address) if none."""
    return max(splits(address, instances), key=lambda ends: len(ends[0]), default=("", address))


def splits(address: str, instances: Iterable[str]) -> list[tuple[str, str]]:
    """Every (component, name) that an address may mean."""
    begins = [c for c in instances if address.startswith(f"{c}.") and len(address) > len(c) + 1]
    return [(c, address[len(c) + 1 :]) for c in begins]


def targets(address: str, instances: Mapping[str, FmuInstance], system: System | None = None) -> list[tuple[str, str]]:
    """(component, variable) of all that an address means: a bare name, every component's that has it to be set.

    A name that nothing has may be the end of one: 'target' is command.target where no other name ends so. With
    `system`, the name of one of its own inputs means that input, of component ''.
    """
    if system is not None and address in system.system_inputs:
        return [("", address)]
    if system is not None and address in system.network.connectors:
        return [(component, name) for component, name, _ in system.network.connectors[address]]
    component, name = split(address, instances)
    if component:
        return [(component, name)]
    if exact := [(c, address) for c, instance in instances.items() if instance.settable(address)]:
        return exact
    ending = ending_in(address, instances)
    return ending if len({name for _, name in ending}) == 1 else []


def ending_in(end: str, instances: Mapping[str, FmuInstance]) -> list[tuple[str, str]]:
    """(component, variable) of what can be set and has a name that ends in a dot and this."""
    return [
        (c, name) for c, instance in instances.items() for name in instance.variables
        if name.endswith(f".{end}") and instance.settable(name)
    ]  # fmt: skip


def matches(name: str, pattern: str) -> bool:
    """Whether a pattern of the user's means a column; the name of an array means all its elements.

    Brackets are those of names: they are no sets of letters.
    """
    array = name.rpartition("[")[0] or name
    plain = pattern.replace("[", "[[]")
    return name == pattern or array == pattern or fnmatchcase(name, plain) or fnmatchcase(array, plain)
