"""Campaigns of the deep-sea machine; the blind benchmark's plant makes the measurements."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.case import BASE as BLIND_BASE
from benchmarks.blind.generate import write_case
from benchmarks.blind.machine import Machine
from benchmarks.blind.measure import KINDS, Channel, ideal, measured
from benchmarks.blind.plant import column, simulate

from .made import Made, catalogue_of, cut

Array = NDArray[np.float64]

QUICK = {"t_start": 0.2, "ramp_time": 1.0, "hold_time": 0.4, "target": 0.05}
"""Conditions of a run, under the plant's names: out and back in 2.6 s."""

STOP, RATE = 3.0, 50.0
"""End of a run [s] and its samples a second."""

ADDRESS = {
    "depth": "depth", "nu0": "hydraulics.oil.nu0", "target": "hydraulics.command.target",
    "t_start": "hydraulics.command.t_start", "ramp_time": "hydraulics.command.ramp_time",
    "hold_time": "hydraulics.command.hold_time",
}  # fmt: skip
"""The package's names of what is known of a run."""

BASE = ("hydraulics.oil.nu0", "hydraulics.valve.q_rated", "arm.load_weight")
"""Base parameters that are refitted: few, for each costs a simulation in every step of a fit."""


def _head(folder: Path, made: Made, effects: Collection[str]) -> str:
    """The first lines of a campaign; writes its catalogue."""
    (folder / "effects.toml").write_text(cut(catalogue_of(made.machine), effects, BASE), encoding="utf-8")
    return f'name = "{folder.name}"\nsystem = "{made.machine}"\neffects = "effects.toml"\n'


def _stated(known: Mapping[str, float]) -> str:
    return "parameters = { " + ", ".join(f'"{ADDRESS[name]}" = {value!r}' for name, value in known.items()) + " }\n"


def _run(known: Mapping[str, float], truth: Mapping[str, float]) -> tuple[Array, Array]:
    """Times [s] and the plant's signals."""
    grid = np.arange(round(STOP * 1000) + 1) / 1000
    return grid, simulate(replace(Machine(**known), **truth), grid)


def _measured(
    folder: Path, made: Made, truth: Mapping[str, float], columns: Collection[str], effects: Collection[str],
    noise: float = 1.0,
) -> None:  # fmt: skip
    """A run of the machine with `truth` in it; the noise is so many times that of the quietest sensors."""
    random = np.random.default_rng(1)
    channels = [Channel(kind, noise * kind.quiet, 0.0) for kind in KINDS if kind.key in columns]
    text = _head(folder, made, effects)
    for channel in channels:
        kind = channel.kind
        text += f'\n[[channel]]\ncolumn = "{kind.key}"\nconnector = "{kind.connector}"\nunit = "{kind.unit}"\n'
        text += f"noise_std = {channel.std / kind.factor:.4g}\n"
    at = np.arange(round(STOP * RATE) + 1) / RATE
    grid, signals = _run(QUICK, truth)
    readings = [measured(c, ideal(c, grid, signals, at), random) / c.kind.factor for c in channels]
    rows = [",".join(f"{v:.7g}" for v in row) for row in np.column_stack([at, *readings])]
    head = ",".join(["time", *(c.kind.key for c in channels)])
    (folder / "run.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    text += f'\n[[run]]\nfile = "run.csv"\n{_stated(QUICK)}'
    (folder / "campaign.toml").write_text(text, encoding="utf-8")


def single(folder: Path, made: Made) -> None:
    """A dead zone of the valve; both pressures and the force are measured, which have to agree."""
    effects = ("cylinder_coulomb_friction", "valve_dead_zone", "valve_flow_gain", "hose_compliance", "sensor_delay")
    _measured(folder, made, {"overlap": 0.06, "nu0": 22.5e-6}, ("x_h", "P1", "P2", "F_h"), effects)


def pair(folder: Path, made: Made) -> None:
    """A dead zone and a slow spool, with which the machine is near to swinging; speed is measured beside position."""
    effects = (
        "cylinder_coulomb_friction", "valve_dead_zone", "valve_dynamics", "command_delay", "valve_null_shift",
    )  # fmt: skip
    _measured(folder, made, {"overlap": 0.05, "spool_time": 0.025}, ("x_h", "v_h"), effects, 0.5)


def three(folder: Path, made: Made) -> None:
    """Three effects, where no pair is enough: a dead zone, Stribeck friction and a late command."""
    effects = (
        "cylinder_coulomb_friction", "cylinder_stribeck_friction", "valve_dead_zone", "valve_dynamics",
        "command_delay", "ambient_pressure_error",
    )  # fmt: skip
    truth = {"overlap": 0.08, "stribeck": 300.0, "delay": 0.02}
    _measured(folder, made, truth, ("x_h", "v_h", "P1"), effects)


def _first(t: Array, inside: NDArray[np.bool_], after: float) -> float:
    """Time [s] from `after` until something is the case."""
    return float(t[np.flatnonzero(inside & (t >= after))[0]] - after)


def moments(folder: Path, made: Made) -> None:
    """No channels: how long five runs with cold oil took out and back, or only that it was not longer."""
    effects = ("oil_temperature", "viscosity_law", "valve_flow_gain", "line_minor_losses", "cylinder_viscous_error")
    text = _head(folder, made, effects)
    changes = ({"depth": 4000.0}, {"depth": 6000.0}, {"depth": 7000.0}, {"nu0": 30e-6}, {"target": 0.08})
    for k, change in enumerate(changes):
        known: dict[str, float] = {"depth": 4000.0, "nu0": 22e-6, **QUICK, **change}
        t, signals = _run(known, {"temperature": 303.0})
        x, target = column(signals, "x_h"), known["target"]
        back = known["t_start"] + known["ramp_time"] + known["hold_time"]
        out = _first(t, np.abs(x - target) < 2e-3, known["t_start"])
        home = _first(t, np.abs(x) < 2e-3, back)
        text += f'\n[[run]]\nname = "run {k}"\nstop_time = {STOP}\n{_stated(known)}'
        limit = f"at_most = {home + 0.1:.3f}" if k == 3 else f"time = {home:.3f}"
        for place, after, said in ((target, known["t_start"], f"time = {out:.3f}"), (0.0, back, limit)):
            text += f'[[run.event]]\nconnector = "arm.x_h"\ntarget = {place}\nwithin = 0.002\nafter = {after:.2f}\n'
            text += f"first = true\n{said}\nstd = 0.005\n"
    (folder / "campaign.toml").write_text(text, encoding="utf-8")


def blind(index: int, stop: float, effects: Collection[str] | None = None) -> Callable[[Path, Made], None]:
    """What writes the first run of a blind case of seed 3 (edition 2) until `stop` [s]; its truth is drawn with it.

    All effects of the package are candidates, or those that are named.
    """

    def write(folder: Path, made: Made) -> None:
        name = f"case_{index:04d}"
        with TemporaryDirectory() as scratch:
            whole = Path(scratch)
            write_case(3, index, whole, made.machine.resolve(), refit=False, edition=2)
            text = (whole / name / "campaign.toml").read_text(encoding="utf-8")
            lines = (whole / name / "run01.csv").read_text(encoding="utf-8").splitlines()
        head, first, *_ = re.split(r"^(?=\[\[run\]\])", text, flags=re.MULTILINE)
        if effects is not None:
            few = cut(catalogue_of(made.machine), effects, BLIND_BASE)
            (folder / "effects.toml").write_text(few, encoding="utf-8")
            head = f'effects = "effects.toml"\n{head}'
        (folder / "campaign.toml").write_text(head + first, encoding="utf-8")
        rows = [row for row in lines[1:] if float(row.partition(",")[0]) <= stop]
        (folder / "run01.csv").write_text("\n".join([lines[0], *rows]) + "\n", encoding="utf-8")

    return write


def blind_pair(folder: Path, made: Made) -> None:
    """Case 11 with what is alike to its marine growth and its leakage, and little else: all effects take minutes."""
    effects = (
        "marine_growth", "current_error", "drag_coefficient", "valve_leakage", "piston_leakage", "command_delay",
        "valve_dynamics", "cylinder_stribeck_friction", "oil_temperature", "sensor_bias",
    )  # fmt: skip
    blind(11, 4.0, effects)(folder, made)
