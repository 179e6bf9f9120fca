"""The README of each FMU: a hand-written text with the equations, and the variables from the table."""

from __future__ import annotations

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


def readme(model: str) -> str:
    """The full text for a model."""
    return (HERE / f"{model}.md").read_text() + "\n" + variable_tables(table_of(model))
