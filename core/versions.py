"""Versions of what a result depends on."""

from __future__ import annotations

import platform
from importlib import metadata


def versions() -> dict[str, str]:
    """Version by package name, Python's first; of those that are installed."""
    found = {"python": platform.python_version()}
    for package in ("deepsea-cosim", "fmpy", "numpy", "numba", "mujoco", "pythonfmu"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def line() -> str:
    """All of them, for people."""
    return "  ".join(f"{name} {version}" for name, version in versions().items())
