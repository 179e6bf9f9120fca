"""The table of a package's catalogue: what `cosim-gap effects` prints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .campaign.catalogue import Parameter
from .campaign.read_catalogue import load_from_package

HEAD = f"{'effect':<28}{'group':<18}{'parameter':<52}{'neutral':>9}{'bounds':>22}{'usual size':>12}  unit"
LEGEND = (
    "usual size: that of the parameter's deviation from neutral where a machine has the effect. Equation, source, step",
    "and test of each effect of the deep-sea machine: docs/effects.md; a catalogue of your own: docs/gap.md",
)


def table(package: Path) -> Iterator[str]:
    """The lines of the table. Raises `PackageError`."""
    catalogue, unit = load_from_package(package), _units(package)
    yield HEAD
    for effect in catalogue.effects:
        for i, p in enumerate(effect.parameters):
            yield _row(*((effect.id, effect.group) if i == 0 else ("", "")), p, unit)
        yield f"{'':<28}{effect.text}"
        for form in effect.forms:
            yield f"{'':<28}  or: {form.text}"
            for p in form.parameters:
                yield _row("", "", p, unit)
    for curve in catalogue.curves:
        yield f"{curve.id:<28}curve of {', '.join(curve.effects)}"
        yield f"{'':<28}{curve.text}"
    for sensor in catalogue.sensors:
        bounds = f"{sensor.low:g} .. {sensor.high:g}"
        address = f"each channel's {sensor.quantity}"
        yield f"{sensor.id:<28}{sensor.group:<18}{address:<52}{sensor.neutral:>9g}{bounds:>22}{sensor.prior:>12g}"
        yield f"{'':<28}{sensor.text}"
        for kind in sensor.forms:
            yield f"{'':<28}  or: {kind.text}"
    yield ""
    yield "refitted in every candidate: " + ", ".join(f"{b.parameter} +-{b.tolerance:.0%}" for b in catalogue.base)
    yield from LEGEND


def content(package: Path) -> dict[str, Any]:
    """The same for programs: what the catalogue has, by its own words, and the unit of each parameter."""
    catalogue, unit = load_from_package(package), _units(package)
    told = asdict(catalogue)
    for effect in told["effects"]:
        for p in (*effect["parameters"], *(p for form in effect["forms"] for p in form["parameters"])):
            p["unit"] = unit(p["address"])
    return {name: told[name] for name in ("effects", "curves", "sensors", "base")}


def _row(effect: str, group: str, p: Parameter, unit: Callable[[str], str]) -> str:
    bounds = f"{p.low:g} .. {p.high:g}"
    shown = f"{effect:<28}{group:<18}{p.address:<52}{p.neutral:>9g}{bounds:>22}{p.prior:>12g}  {unit(p.address)}"
    return shown.rstrip()


def _units(package: Path) -> Callable[[str], str]:
    """Unit of a parameter by its address, "" where there is none."""
    from ..master.options import Options
    from ..master.system.addresses import split
    from ..master.system.assemble import assemble
    from ..master.system.findings import Findings

    with ExitStack() as stack:
        system = assemble(package, Options(), stack, Findings())
        assert system is not None  # what is wrong with it has been raised
        instances = system.instances

    def unit(address: str) -> str:
        component, name = split(address, instances)
        is_known = component in instances and name in instances[component].variables
        return (instances[component].unit_name(name) or "") if is_known else ""

    return unit
