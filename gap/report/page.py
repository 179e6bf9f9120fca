"""The page: all sections in their order, in one file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from ...core.vendored import vendored
from ..result.numbers import cleaned
from . import (
    budget,
    calibration,
    charts,
    curves,
    effects,
    headline,
    localisation,
    method,
    next_step,
    runs,
    swings,
    unexplained,
)
from .glossary import GLOSSARY
from .signals import Signals, without_signals

SECTIONS = (
    headline.SECTION,
    budget.SECTION,
    localisation.SECTION,
    charts.SECTION,
    swings.SECTION,
    runs.EVENTS,
    unexplained.SECTION,
    curves.SECTION,
    next_step.SECTION,
    effects.EFFECTS,
    effects.HYPOTHESES,
    calibration.SECTION,
    runs.RUNS,
    method.METHOD,
    method.NOTES,
)
"""In the order of the page."""


def render(data: Mapping[str, Any], signals: Signals | None = None) -> str:
    """The page as HTML.

    data: the contents of diagnosis.json, schema 2; signals: the time series, without which the page has no charts.
    """
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup, escape

    data = cleaned(dict(data))
    signals = signals or without_signals(data)

    def term(word: str, shown: str = "") -> Markup:
        inside = f'<abbr tabindex="0" title="{escape(GLOSSARY[word])}">{escape(shown or word)}</abbr>'
        return Markup(inside)  # noqa: S704  escaped above

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, loader=FunctionLoader(_read)
    )
    environment.globals.update(
        term=term, asset=lambda name: Markup(_text(name)),  # noqa: S704  files of ours
        vendored=lambda name: Markup(vendored(name)),  # noqa: S704
    )
    contexts = [(s, s.context(data, signals)) for s in SECTIONS]
    parts = [(s, environment.get_template(s.id).render(c)) for s, c in contexts if c is not None]
    shown = [{"id": s.id, "title": s.title, "html": Markup(html)} for s, html in parts]  # noqa: S704  rendered with autoescape
    page = {"campaign": data["campaign"], "verdict": data["verdict"], "sections": shown}
    page |= {"charts": any(s.id == charts.SECTION.id for s, _ in parts)}
    return environment.get_template("page").render(page)


def _read(name: str) -> str:
    return _text(f"templates/{name}.html.j2")


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
