"""report.html: a diagnosis for a person, in one file that needs nothing else.

`view` puts into words and numbers what is shown, `plots` draws the series, `report.html.j2` sets the page.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

from ...core.files import make_folder, writing
from ..pipeline.diagnosis import Diagnosis

NAME = "report.html"


def write_report(d: Diagnosis, data: dict[str, Any], folder: Path) -> Path:
    """Write the report of a diagnosis into `folder`; `data` are the contents of diagnosis.json."""
    text = render(d, data)
    target = folder / NAME
    make_folder(folder)
    with writing(target):
        target.write_text(text, encoding="utf-8")
    return target


def render(d: Diagnosis, data: dict[str, Any]) -> str:
    """The page."""
    from jinja2 import Environment, StrictUndefined

    from .view import view

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = files(__package__).joinpath("report.html.j2").read_text(encoding="utf-8")
    return environment.from_string(template).render(view(d, data))
