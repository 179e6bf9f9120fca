"""The set of calibrations as a table, a file for a program, and what of the paper's claims depends on the choice."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path

from ...core.files import write_together
from .buildable import as_values
from .search import Calibration

ERRORS = ("out, variable", "in, variable", "out, constant", "in, constant")
"""The four times in the order of the errors."""


@dataclass(frozen=True)
class Row:
    """A calibration with whether each claim of the paper holds with it, by place and text; None: it cannot be run."""

    name: str
    calibration: Calibration
    claims: Mapping[str, bool] | None

    @property
    def held(self) -> str:
        """How many claims hold."""
        return "-" if self.claims is None else f"{sum(self.claims.values())} of {len(self.claims)}"


HEAD = ("", "lam_crit", "beam_length [m]", "rod_eye_radius [m]", "theta0 [deg]", "base_x [m]", "base_y [m]",
        "cylinder [m]", "dead centre [m]", *(f"{e} [%]" for e in ERRORS), "claims")  # fmt: skip


def cells(row: Row) -> list[str]:
    """A row of the table, under `HEAD`."""
    of, c = row.calibration.linkage, row.calibration
    numbers = (of.beam_length, of.rod_eye_radius, degrees(of.theta0), of.base_x, of.base_y, of.length, of.reach)
    places = (3, 4, 2, 4, 4, 3, 3)
    own = [f"{v:.{k}f}" for v, k in zip(numbers, places, strict=True)]
    return [row.name, f"{of.lam_crit:.0f}", *own, *(f"{e:+.2f}" for e in c.errors), row.held]


def markdown(rows: Sequence[Row]) -> str:
    """The table for a page of text; it is short enough for a terminal, too."""
    lines = [HEAD, ["---"] * len(HEAD), *(cells(r) for r in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def depending(rows: Sequence[Row]) -> dict[str, list[str]]:
    """For each claim that holds with some calibrations and not with others: the names of those with which it holds."""
    judged = [(r.name, r.claims) for r in rows if r.claims is not None]
    names = judged[0][1] if judged else {}
    found = {claim: [name for name, claims in judged if claims[claim]] for claim in names}
    return {claim: held for claim, held in found.items() if 0 < len(held) < len(judged)}


def write(folder: Path, rows: Sequence[Row], settings: Mapping[str, object]) -> None:
    """calibrations.csv and calibrations.json in the folder."""
    content = {
        **settings,
        "calibrations": [
            {"name": r.name, **as_values(r.calibration.linkage),
             "errors": dict(zip(ERRORS, r.calibration.errors.tolist(), strict=True)), "claims": r.claims}
            for r in rows
        ],
        "depending": depending(rows),
    }  # fmt: skip
    table = io.StringIO()
    csv.writer(table).writerows([HEAD, *(cells(r) for r in rows)])
    together = {"calibrations.csv": table.getvalue(), "calibrations.json": json.dumps(content, indent=1) + "\n"}
    write_together(folder, together)
