"""The small campaigns, made anew from a few lines.

Measurements of the toy are made by scipy, those of the deep-sea machine by the blind benchmark's plant: none of the
code that is compared has a part in them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.machine import Machine
from benchmarks.blind.measure import KINDS, Channel, ideal, measured
from benchmarks.blind.plant import simulate
from tests.gap import oscillator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Made:
    """What campaigns are made of: a folder with the toy's FMU, and the deep-sea package."""

    toys: Path
    machine: Path


@dataclass(frozen=True)
class Small:
    """A campaign: what it is, and what writes it into a folder with a campaign.toml."""

    name: str
    text: str
    write: Callable[[Path, Made], object]


def build_toys(folder: Path) -> None:
    """The toy's FMU, made with plain pythonfmu."""
    script = Path(oscillator.__file__).parents[1] / "toys" / "toy_oscillator.py"
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)


# the toy


def rubs(t: float, x: float, v: float) -> float:
    """Friction [N]."""
    return float(-0.4 * np.tanh(v / 0.01))


def nothing(t: float, x: float, v: float) -> float:
    """No force beyond the model's."""
    return 0.0


def knocks(t: float, x: float, v: float) -> float:
    """A force [N] at one place, which the catalogue does not know."""
    return -2.0 if 0.01 < x < 0.02 else 0.0


def stiffens(t: float, x: float, v: float) -> float:
    """A cubic spring [N]."""
    return -300.0 * x**3


def _edit(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        if old not in text:
            raise ValueError(f"{path}: has no {old!r} to change")
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def _toy_friction(folder: Path, made: Made) -> None:
    oscillator.campaign(folder, made.toys, [oscillator.measure(seed, rubs) for seed in (1, 2)])


def _toy_nothing(folder: Path, made: Made) -> None:
    oscillator.campaign(folder, made.toys, [oscillator.measure(seed, nothing) for seed in (3, 4)])


def _toy_unknown(folder: Path, made: Made) -> None:
    oscillator.campaign(folder, made.toys, [oscillator.measure(seed, knocks) for seed in (5, 6)])


def _toy_holdout(folder: Path, made: Made) -> None:
    path = oscillator.campaign(folder, made.toys, [oscillator.measure(seed, stiffens) for seed in (7, 8)])
    _edit(path, ('file = "run1.csv"', 'file = "run1.csv"\nuse = "holdout"'))


def _toy_late_sensor(folder: Path, made: Made) -> None:
    run = oscillator.measure(9, nothing)
    run[:, 2] = np.interp(run[:, 0] - 0.02, run[:, 0], run[:, 2])
    path = oscillator.campaign(folder, made.toys, [run])
    _edit(path, ("noise_std = 0.2\n", ""))


def _toy_moments(folder: Path, made: Made) -> None:
    path = oscillator.campaign(folder, made.toys, [])
    text = path.read_text(encoding="utf-8").split("[[channel]]")[0]
    for d, time in ((2.0, 3.3), (3.0, 2.4), (4.0, 1.6)):
        text += f'[[run]]\nname = "d {d}"\nstop_time = 8\nparameters = {{ "o.d" = {d}, "o.u" = 2.0 }}\n'
        text += '[[run.event]]\nconnector = "o.x"\ntarget = 0.025\nwithin = 0.001\nafter = 0\nstd = 0.01\n'
        text += f"time = {time}\n"
    path.write_text(text, encoding="utf-8")


# the deep-sea machine

QUICK = {"t_start": 0.3, "ramp_time": 1.5, "hold_time": 0.6, "target": 0.1}
STOP, RATE = 4.5, 50.0


def cut(catalogue: str, effects: Collection[str], base: Collection[str]) -> str:
    """The text of a catalogue with these effects, sensors and base parameters only; the rest stays."""
    kept, keep = [], True
    for part in re.split(r"^(?=\[)", catalogue, flags=re.MULTILINE):
        head = part.partition("\n")[0]
        if head in ("[[effect]]", "[[sensor]]"):
            keep = re.search(r'^id = "(.*)"', part, re.MULTILINE)[1] in effects  # type: ignore[index]
        elif head == "[[base]]":
            keep = re.search(r'^parameter = "(.*)"', part, re.MULTILINE)[1] in base  # type: ignore[index]
        elif head != "[[effect.parameter]]":
            keep = True
        if keep:
            kept.append(part)
    return "".join(kept)


def catalogue_of(package: Path) -> str:
    """The text of a package's catalogue."""
    with zipfile.ZipFile(package) as archive:
        return archive.read("resources/effects.toml").decode("utf-8")


CONDITIONS = {
    "depth": "depth", "load_weight": "arm.load_weight", "target": "hydraulics.command.target",
    "t_start": "hydraulics.command.t_start", "ramp_time": "hydraulics.command.ramp_time",
    "hold_time": "hydraulics.command.hold_time",
}  # fmt: skip
"""The plant's and the package's names of what is known of a run."""

BASE = ("hydraulics.oil.nu0", "hydraulics.valve.q_rated", "arm.load_weight")


def machine(
    folder: Path, made: Made, truth: Mapping[str, float], columns: Collection[str], effects: Collection[str],
    runs: Collection[Mapping[str, float]] = ({},), noise: float = 1.0, stop: float = STOP,
) -> Path:  # fmt: skip
    """A campaign of the machine with `truth` in it (the plant's parameters); returns its campaign.toml."""
    random = np.random.default_rng(1)
    channels = [Channel(kind, noise * kind.quiet, 0.0) for kind in KINDS if kind.key in columns]
    text = f'name = "{folder.name}"\nsystem = "{made.machine}"\neffects = "effects.toml"\n'
    for channel in channels:
        kind = channel.kind
        text += f'\n[[channel]]\ncolumn = "{kind.key}"\nconnector = "{kind.connector}"\nunit = "{kind.unit}"\n'
        text += f"noise_std = {channel.std / kind.factor:.4g}\n"
    for k, changes in enumerate(runs):
        known = {**QUICK, **changes}
        grid = np.arange(round(stop * 1000) + 1) / 1000
        at = np.arange(round(stop * RATE) + 1) / RATE
        signals = simulate(replace(Machine(**known), **truth), grid)
        readings = [measured(c, ideal(c, grid, signals, at), random) / c.kind.factor for c in channels]
        head = ",".join(["time", *(c.kind.key for c in channels)])
        rows = [",".join(f"{v:.7g}" for v in row) for row in np.column_stack([at, *readings])]
        (folder / f"run{k}.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
        stated = ", ".join(f'"{CONDITIONS[name]}" = {value!r}' for name, value in known.items())
        text += f'\n[[run]]\nfile = "run{k}.csv"\nparameters = {{ {stated} }}\n'
    (folder / "effects.toml").write_text(cut(catalogue_of(made.machine), effects, BASE), encoding="utf-8")
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path


FEW = ("cylinder_coulomb_friction", "valve_dead_zone", "valve_flow_gain", "hose_compliance", "sensor_delay")


def _machine_single(folder: Path, made: Made) -> None:
    machine(folder, made, {"overlap": 0.06, "nu0": 22.5e-6}, ("x_h", "P1", "P2"), FEW)


def _machine_pair(folder: Path, made: Made) -> None:
    machine(folder, made, {"overlap": 0.05, "coulomb": 500.0}, ("x_h", "P1", "P2"), FEW)


CAMPAIGNS = (
    Small("toy_friction", "two runs of an oscillator that rubs", _toy_friction),
    Small("toy_nothing", "two runs of an oscillator without an effect", _toy_nothing),
    Small("toy_unknown", "an effect that the catalogue does not know", _toy_unknown),
    Small("toy_holdout", "a cubic spring; one of two runs is held out", _toy_holdout),
    Small("toy_late_sensor", "a sensor that is late; its noise is estimated", _toy_late_sensor),
    Small("toy_moments", "no channels, but measured moments of three runs", _toy_moments),
    Small("machine_single", "the deep-sea machine with a dead zone of its valve", _machine_single),
    Small("machine_pair", "the deep-sea machine with a dead zone and friction", _machine_pair),
)
