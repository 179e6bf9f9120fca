"""Coupling algorithms, one a file. An algorithm is a function that takes a system over one macro step."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from ...core.errors import UsageError, did_you_mean

NAMES = ("gauss-seidel", "jacobi")
"""The first is the default."""


def algorithm(name: str) -> Callable[..., None]:
    """The step function of the algorithm called `name`."""
    if name not in NAMES:
        raise UsageError(f"unknown method '{name}'; known: {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    return import_module(f".{name.replace('-', '_')}", __package__).step
