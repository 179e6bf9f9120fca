"""Files that are right, and what reads them."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks import native
from benchmarks.fuzz import mutants
from benchmarks.fuzz.mutants import Mutator

REPOSITORY = Path(__file__).parents[2]
STOP = 0.05


@dataclass(frozen=True)
class Target:
    """content: what is changed; act: does with a mutant what a command would, in a folder of its own, and raises
    `CosimError` where it refuses."""

    content: bytes
    mutate: Mutator
    act: Callable[[Path, bytes], None]


@cache
def parts() -> dict[str, bytes]:
    """The files of a package that has a bit of everything, by name."""
    from tempfile import TemporaryDirectory

    from tests.master.parts import constant, gain
    from tests.packages import (
        SPACES,
        binding,
        bindings,
        connector,
        description,
        entry,
        link,
        mapping_file,
        parameter,
        parameter_set,
        system,
        unit,
    )

    with TemporaryDirectory() as folder:
        fmu = native.linear(Path(folder), 2).read_bytes()
    bus = '<ssb:DictionaryEntry name="s"><ssc:Real unit="m"/></ssb:DictionaryEntry>'
    bus += f'<ssb:Units>{unit("m", m=1)}</ssb:Units>'
    dictionaries = '<ssd:SignalDictionary name="bus" source="resources/bus.ssb"/>'
    dictionaries = f"<ssd:SignalDictionaries>{dictionaries}</ssd:SignalDictionaries>"
    reference = (
        '<ssd:SignalDictionaryReference name="R" dictionary="bus"><ssd:Connectors>'
        f'{connector("s", "inout", "Real", "m")}</ssd:Connectors></ssd:SignalDictionaryReference>'
    )
    outside = bindings(binding(
        source="resources/values.ssv",
        mapping='<ssd:ParameterMapping source="resources/map.ssm"/>',
    ))  # fmt: skip
    inner = system("inner", gain("a", 2.0), made=(connector("u", "input"), connector("y", "output")),
                   links=(link("u", "a.u1"), link("a.y1", "y")))  # fmt: skip
    answers = '<Value name="top" unit="m" is="max(c.y1)"/><Say if="top &gt; 0">up to {top}</Say><Show>c.y1</Show>'
    root = system(
        "root", constant("c", 1.5), inner, gain("b", 0.5, unit_in="mm"), reference,
        made=(connector("out", "output", "Real", "m"),),
        links=(
            link("c.y1", "inner.u"), link("inner.y", "b.u1", '<ssc:LinearTransformation factor="2" offset="1"/>'),
            link("b.y1", "out"), link("c.y1", "R.s"),
        ),
        bindings=outside, dictionaries=dictionaries,
    )  # fmt: skip
    units = f"<ssd:Units>{unit('m', m=1)}{unit('mm', m=1, factor=1e-3)}</ssd:Units>"
    structure = description(root, after=units, stop=STOP, step=0.01, answers=answers)
    parameters = parameter_set(parameter("gain", "Real", 3.0), parameter("b.x0[1]", "Real", 0.0))
    return {
        "SystemStructure.ssd": structure.encode(), "resources/values.ssv": parameters.encode(),
        "resources/map.ssm": mapping_file(entry("gain", "inner.a.D[1,1]", '<ssc:LinearTransformation factor="2"/>'),
                                          entry("b.x0[1]", "b.x0[1]")).encode(),
        "resources/bus.ssb": f'<ssb:SignalDictionary {SPACES} version="1.0">{bus}</ssb:SignalDictionary>'.encode(),
        "resources/L.fmu": fmu,
    }  # fmt: skip


def package(folder: Path, changed: dict[str, bytes]) -> Path:
    """The package with other contents of some of its files."""
    path = folder / "p.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in {**parts(), **changed}.items():
            archive.writestr(name, content)
    return path


def simulated(folder: Path, path: Path, **options: object) -> None:
    """Run a package, a little, and look at what it left."""
    from deepsea_cosim import simulate
    from deepsea_cosim.master.page.write import write_page

    result = simulate(path, folder / "out", step=0.01, **options)  # type: ignore[arg-type]
    if result.summary["steps"] > 20_000:
        return
    write_page(folder / "out")


def of_package(name: str, mutate: Mutator) -> Target:
    return Target(parts()[name], mutate, lambda folder, mutant: simulated(folder, package(folder, {name: mutant})))


def ssd() -> Target:
    return of_package("SystemStructure.ssd", mutants.xml)


def ssv() -> Target:
    return of_package("resources/values.ssv", mutants.xml)


def ssm() -> Target:
    return of_package("resources/map.ssm", mutants.xml)


def ssb() -> Target:
    return of_package("resources/bus.ssb", mutants.xml)


def description() -> Target:
    """modelDescription.xml inside the FMU."""
    with zipfile.ZipFile(io.BytesIO(parts()["resources/L.fmu"])) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}

    def act(folder: Path, mutant: bytes) -> None:
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w") as archive:
            for name, content in {**inside, "modelDescription.xml": mutant}.items():
                archive.writestr(name, content)
        simulated(folder, package(folder, {"resources/L.fmu": made.getvalue()}))

    return Target(inside["modelDescription.xml"], mutants.xml, act)


def zipped() -> Target:
    """The archive itself."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, content in parts().items():
            archive.writestr(name, content)

    def act(folder: Path, mutant: bytes) -> None:
        path = folder / "p.ssp"
        path.write_bytes(mutant)
        simulated(folder, path)

    return Target(made.getvalue(), mutants.archive, act)


def stimuli() -> Target:
    """A table that drives an input."""
    def act(folder: Path, mutant: bytes) -> None:
        path = folder / "table.csv"
        path.write_bytes(mutant)
        simulated(folder, package(folder, {}), stimuli=path)

    rows = "\n".join(f"{0.01 * k:g},{0.1 * k:g},{k}" for k in range(8))
    return Target(f"time,b.u2,c.u1\n{rows}\n".encode(), mutants.csv, act)


CAMPAIGN = """
name = "pool"
system = "s.ssp"
accept = ["friction"]
[[channel]]
column = "x"
connector = "o.x"
unit = "mm"
noise_std = 0.1
[[channel]]
column = "u"
connector = "o.u"
unit = "N"
role = "input"
[[run]]
file = "run1.csv"
parameters = { "o.m" = 2.5 }
use = "fit"
[[run]]
name = "moments"
stop_time = 2
[[run.event]]
connector = "o.x"
target = 0.1
within = 0.01
after = 0
std = 0.1
time = 1
[[base]]
parameter = "o.k"
tolerance = 0.05
[[base]]
parameter = "o.d"
tolerance = { factor = 3 }
"""


def run_table() -> bytes:
    t = np.arange(200) * 0.01
    rows = (f"{a:.4g},{b:.5g},{c:.5g}" for a, b, c in zip(t, 50 * np.sin(3 * t), np.cos(3 * t), strict=True))
    return ("time,x,u\n" + "\n".join(rows) + "\n").encode()


def campaign_read(folder: Path, text: bytes, table: bytes) -> None:
    from deepsea_cosim.gap.campaign.read import read

    (folder / "s.ssp").write_bytes(b"x")
    (folder / "run1.csv").write_bytes(table)
    (folder / "campaign.toml").write_bytes(text)
    read(folder / "campaign.toml")


def campaign() -> Target:
    return Target(CAMPAIGN.encode(), mutants.toml, lambda folder, mutant: campaign_read(folder, mutant, run_table()))


def run_file() -> Target:
    """The readings of a run."""
    text = CAMPAIGN.encode()
    return Target(run_table(), mutants.csv, lambda folder, mutant: campaign_read(folder, text, mutant))


def catalogue() -> Target:
    """effects.toml of the deep-sea machine."""
    def act(folder: Path, mutant: bytes) -> None:
        from deepsea_cosim.gap.campaign.read_catalogue import load

        (folder / "effects.toml").write_bytes(mutant)
        load(folder / "effects.toml")

    return Target((REPOSITORY / "ssp/scenarios/deepsea/effects.toml").read_bytes(), mutants.toml, act)


def machine() -> Target:
    """A data sheet."""
    def act(folder: Path, mutant: bytes) -> None:
        from deepsea_cosim.fmus.data_sheet import read

        (folder / "machine.toml").write_bytes(mutant)
        read(folder / "machine.toml")

    return Target((REPOSITORY / "examples/machine.toml").read_bytes(), mutants.toml, act)


def mjcf() -> Target:
    """An arm as an MJCF model."""
    def act(folder: Path, mutant: bytes) -> None:
        from deepsea_cosim.mechanics.own_arm.reading import read

        (folder / "arm.xml").write_bytes(mutant)
        read(folder / "arm.xml")

    return Target((REPOSITORY / "examples/boom_and_stick/arm.xml").read_bytes(), mutants.xml, act)


TARGETS: dict[str, Callable[[], Target]] = {
    "ssd": ssd, "ssv": ssv, "ssm": ssm, "ssb": ssb, "description": description, "zip": zipped, "stimuli": stimuli,
    "campaign": campaign, "run": run_file, "catalogue": catalogue, "machine": machine, "mjcf": mjcf,
}  # fmt: skip
