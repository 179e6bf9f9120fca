"""What a section of the report is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..settings import ReportSettings
from .parts import Data
from .signals import Signals

Context = dict[str, Any]

SHOWN = ReportSettings()


@dataclass(frozen=True)
class Section:
    """A part of the page: `templates/<id>.html.j2` sets what `context` gives; None: there is nothing to show."""

    id: str
    title: str
    context: Callable[[Data, Signals], Context | None]
