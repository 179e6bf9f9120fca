"""Limits on what is read from strangers: each is stated where it is met, and raised by an environment variable."""

from __future__ import annotations

import os
from math import isfinite

from .errors import UsageError
from .plain_numbers import plain_number

GIGABYTES, ENTRIES, COMPONENTS, SETTINGS = (
    f"DEEPSEA_COSIM_MAX_{what}" for what in ("GB", "ENTRIES", "COMPONENTS", "TOML_MB")
)

USUAL = {GIGABYTES: 4.0, ENTRIES: 1e5, COMPONENTS: 1e5, SETTINGS: 20.0}
"""Gigabytes that a package may hold unpacked, with the archives inside it; entries, likewise; its components and
systems; megabytes of a campaign.toml, a catalogue or a machine.toml."""


def limit(name: str) -> float:
    """The limit in force; raises `UsageError` where the environment gives what is no limit."""
    text = os.environ.get(name)
    if text is None:
        return USUAL[name]
    try:
        value = plain_number(text)
    except ValueError as error:
        raise UsageError(f"{name}: {error}") from None
    if not isfinite(value) or value <= 0.0:
        raise UsageError(f"{name}={text} has to be a positive number")
    return value


def remedy(name: str, needed: float | None = None) -> str:
    """How to take something that needs so much; None: how much is not known."""
    value = "" if needed is None else f"={needed:.6g}"
    return f"{name}{value} in the environment allows more"
