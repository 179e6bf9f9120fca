"""The pages of the study, each one file that contains its pictures."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

from ...core.files import write_together
from ...core.versions import versions
from ..table1 import Result
from .claims import Claim

CAPTIONS = {
    "8": "loss of one line with variable (full) and constant (dashed) viscosity at five depths; the paper's steady "
    "values at 11 km are marked.",
    "9": "displacement at five depths and with constant viscosity; the paper's four published times are marked "
    "(triangles), as are those of the base case in Figures 13 to 21; a square is where the command ends, with which "
    "the paper says that a curve arrives.",
    "10": "the arm at 0, 100 and 200 mm, drawn by MuJoCo.",
    "11": "losses of both lines three seconds after the start of the extension.",
    "12": "pressure difference over the supplied land, spool and speed at the same time: the spool comes to its end.",
    "13": "pressure-viscosity index of the oil.",
    "14": "kinematic viscosity at ambient pressure.",
    "15": "length of the lines.",
    "16": "inner diameter of the lines.",
    "17": "rated flow of the servo valve.",
    "18": "cracking pressure of the relief valve.",
    "19": "command; dotted what is commanded.",
    "20": "weight of the load.",
    "21": "current; positive pushes towards retraction.",
    "run": "the run at 11 km as it goes: arm, displacement, force, pressures.",
}  # fmt: skip


def page(
    path: Path, title: str, lead: str, notes: Sequence[str], claims: Sequence[Claim], pictures: Mapping[str, Path],
    table: Sequence[Result],
) -> None:  # fmt: skip
    """Write a page; pictures: files by the figure's number."""
    from jinja2 import Environment

    template = files(__package__).joinpath("page.html.j2").read_text(encoding="utf-8")
    figures = [
        {"number": n, "source": _inside(p), "caption": CAPTIONS[n],
         "name": "The run" if n == "run" else f"Figure {n} of the paper"}
        for n, p in pictures.items()
    ]  # fmt: skip
    told = ", ".join(f"{name} {version}" for name, version in versions().items())
    context: dict[str, Any] = {
        "title": title, "lead": lead, "notes": notes, "claims": claims, "figures": figures, "table": table,
        "made": f"cosim-study paper, {datetime.now():%Y-%m-%d %H:%M}, {told}",
    }  # fmt: skip
    text = Environment(autoescape=True).from_string(template).render(context)
    write_together(path.parent, {path.name: text})


def _inside(path: Path) -> str:
    kind = path.suffix.removeprefix(".")
    return f"data:image/{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
