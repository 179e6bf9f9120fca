"""Writes docs/effects.md: every effect of the shipped machine with equation, parameters, forms, step and test.

    python docs/make_effects.py build/deepsea_3km.ssp

All comes from the package and from the FMUs' variable tables; and the step that each effect takes is
measured here, in some minutes.
"""

from __future__ import annotations

import sys
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.mechanics.variables import ARM

STEPS, EXACT = (4e-3, 2e-3, 1e-3, 0.5e-3), 0.25e-3
"""Communication steps that are tried, and that which they are held against [s]."""
HELD = 0.05e-3
"""Largest error of the displacement [m]."""
STOP = 22.0
SIGNAL = ("arm.x_h",)
PAGE = Path(__file__).with_name("effects.md")

HEAD = """# The effects

What a real machine may have and the plain one lacks: the candidates of `cosim-gap`, and parameters of the FMUs for
everybody else. Every one is exactly absent at its neutral value, bit for bit. `usual` is how far from neutral it is
usually found; bounds are those of a fit. Forms are tried where something is left. `step` is the longest of 4, 2, 1 and
0.5 ms, by the shipped package's method, that holds the displacement within 0.05 mm of a step of 0.25 ms over a stroke
at 3 km with the effect at its usual size; the last column names the test against a closed form or a limit.

This page is made by `python docs/make_effects.py build/deepsea_3km.ssp` from the catalogue in the package
([effects.toml](../ssp/scenarios/deepsea/effects.toml)) and from its FMUs.

| effect | equation | parameters: neutral; bounds; usual | forms | shares its group with | step | source | test |
|---|---|---|---|---|---|---|---|
"""


def usual(parameter: Mapping[str, Any]) -> float:
    """A value at which the effect is usually found."""
    value = parameter["neutral"] + parameter["prior"]
    return float(value if value <= parameter["bounds"][1] else parameter["neutral"] - parameter["prior"])


def step_of(session: Session, effect: Mapping[str, Any]) -> str:
    """The longest step [ms] that holds the displacement."""
    main = next(p for p in effect["parameter"] if not p.get("shape"))
    changes = dict.fromkeys((main["address"], *main.get("also", ())), usual(main))

    def displacement(step: float) -> np.ndarray:
        return np.array(session.run(SIGNAL, STOP, step, changes, {})[1])[:, 0]

    try:
        exact = displacement(EXACT)
        for step in STEPS:
            apart = displacement(step) - exact[:: round(step / EXACT)][: round(STOP / step) + 1]
            if np.abs(apart).max() <= HELD:
                return f"{1e3 * step:g} ms"
    except CosimError as error:
        raise SystemExit(f"{effect['id']}: {error}") from error
    return "shorter than 0.5 ms"


def parameters(entries: list[Mapping[str, Any]], units: Mapping[str, str | None]) -> str:
    """Parameters of an effect or a form with their numbers."""
    made = []
    for p in entries:
        unit, (low, high) = units.get(p["address"]) or "1", p["bounds"]
        own = "" if unit == "1" else f" {unit}"
        also = "".join(f", `{a}`" for a in p.get("also", ()))
        made.append(f"`{p['address']}`{also}: {p['neutral']:g}; {low:g} to {high:g}; {p['prior']:g}{own}")
    return "<br>".join(made)


def rows(package: Path) -> Iterator[str]:
    """The table's lines."""
    with zipfile.ZipFile(package) as archive:
        catalogue = tomllib.loads(archive.read("resources/effects.toml").decode())
    session = Session(package)
    tables = {"hydraulics": HYDRAULICS, "arm": ARM}
    units = {f"{component}.{v.name}": v.unit for component, table in tables.items() for v in table}
    groups: dict[str, list[str]] = {}
    for entry in (*catalogue["effect"], *catalogue["sensor"]):
        groups.setdefault(entry["group"], []).append(entry["id"])
    for effect in catalogue["effect"]:
        forms = "<br>".join(f"{f['text']}: {parameters(f['parameter'], units)}" for f in effect.get("form", ()))
        others = ", ".join(id for id in groups[effect["group"]] if id != effect["id"])
        step = step_of(session, effect)
        print(f"{effect['id']}: {step}", flush=True)
        yield line(effect, parameters(effect["parameter"], units), forms, others, step)
    for sensor in catalogue["sensor"]:
        low, high = sensor["bounds"]
        own = f"every channel's {sensor['quantity']}: {sensor['neutral']:g}; {low:g} to {high:g}; {sensor['prior']:g}"
        forms = "<br>".join(f["text"] for f in sensor.get("form", ()))
        yield line(sensor, own, forms, ", ".join(id for id in groups[sensor["group"]] if id != sensor["id"]), "")


def line(entry: Mapping[str, Any], own: str, forms: str, others: str, step: str) -> str:
    """One effect."""
    path, _, name = entry["test"].partition("::")
    equation = entry["equation"].replace("|", "\\|")
    test = f"[{name.replace('_', ' ')}](../{path})"
    first = f"**{entry['id']}**<br>{entry['text']}"
    return f"| {first} | {equation} | {own} | {forms} | {others} | {step} | {entry.get('source', '')} | {test} |\n"


def main() -> None:
    """Write the page."""
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    text = HEAD + "".join(rows(Path(sys.argv[1])))
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
