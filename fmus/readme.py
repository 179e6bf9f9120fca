"""The README of each FMU: a hand-written text with the equations, and the variables from the table."""

from __future__ import annotations

import html
from pathlib import Path

from ..core.variables import VariableTable
from .description import variable_tables

HERE = Path(__file__).parent


def table_of(model: str) -> VariableTable:
    """The variable table of a model."""
    if model == "DeepseaHydraulics":
        from ..hydraulics_fmu.variables import HYDRAULICS as table
    elif model == "DeepseaSupply":
        from ..hydraulics_fmu.supply_unit.variables import SUPPLY as table
    elif model == "DeepseaMachine":
        from .machine import DeepseaMachine

        table = DeepseaMachine.table
    else:
        from ..mechanics.variables import ARM as table
    return table


STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "table{border-collapse:collapse;font-size:.85rem}td,th{border:1px solid #ccc;padding:.2rem .5rem;text-align:left}"
    "pre,code{background:#f4f4f4;font-size:.9rem}pre{padding:.6rem;overflow:auto}"
)


def page(model: str, text: str) -> str:
    """An FMU's README as the page that importers show (FMI: documentation/index.html)."""
    import markdown

    body = markdown.markdown(text, extensions=["tables", "fenced_code", "sane_lists"])
    title = f"<title>{html.escape(model)}</title>"
    return f'<!doctype html>\n<html lang="en"><meta charset="utf-8">{title}<style>{STYLE}</style>\n{body}\n</html>\n'


def readme(model: str) -> str:
    """The full text for a model."""
    return (HERE / f"{model}.md").read_text() + "\n" + variable_tables(table_of(model))
