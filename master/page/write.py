"""The page as one file of HTML: its content as JSON in it, and the scripts that draw it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from ...core.console import plain
from ...core.display_units import DisplayUnits
from ...core.files import replacing
from ...core.vendored import CHART_CODE, CHART_LICENCE, CHART_STYLE, vendored
from .content import page_content
from .record import RunRecord, read_record
from .series import read_series

SCRIPTS = (
    "numbers.js", "series.js", "state.js", "panel.js", "legend.js", "pointer.js", "choice.js", "diagram.js",
    "tables.js", "main.js",
)  # fmt: skip
"""In the order in which they stand in the page; each adds to one object, `page`."""


def write_page(record: RunRecord | Path, display: DisplayUnits | None = None, target: Path | None = None) -> Path:
    """Write the page of a run beside its result file, or to `target`; gives its path.

    record: also the result folder or file. Raises `UsageError` where it is none, `OutputError` where the page cannot be
    written.
    """
    record = read_record(record) if isinstance(record, Path) else record
    content = page_content(record, read_series(record), display or DisplayUnits())
    return save(content, target or record.page)


def save(content: Mapping[str, Any], target: Path) -> Path:
    """Write a page, all or nothing."""
    with replacing(target) as part:
        part.write_text(render(content), encoding="utf-8", errors="replace")
    return target


def render(content: Mapping[str, Any]) -> str:
    """The page as HTML."""
    return Template(_part("page.html")).substitute(
        title=escape(str(content["title"])),
        style=vendored(CHART_STYLE) + _part("page.css"),
        licence=vendored(CHART_LICENCE).replace("*/", ""),
        library=vendored(CHART_CODE),
        script="\n".join(_part(name) for name in SCRIPTS),
        content=_in_script(content),
    )


def _in_script(content: Mapping[str, Any]) -> str:
    """JSON that no text in it can end: neither the script, nor by a comment of HTML."""
    text = json.dumps(plain(content), allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _part(name: str) -> str:
    return files(__package__).joinpath("templates", name).read_text(encoding="utf-8")
