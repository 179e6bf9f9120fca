"""Third-party code that pages bring with them, so that they work without a network (core/vendor/README.md)."""

from __future__ import annotations

from importlib.resources import files

CHART_CODE, CHART_STYLE, CHART_LICENCE = "uPlot.iife.min.js", "uPlot.min.css", "uPlot.LICENSE.txt"
"""The library that draws time series in pages."""


def vendored(name: str) -> str:
    """A file of core/vendor."""
    return files(__package__).joinpath("vendor", name).read_text(encoding="utf-8")
