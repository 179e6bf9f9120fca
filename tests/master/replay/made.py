"""Runs of scenes, made for tests without an FMU."""

from __future__ import annotations

import numpy as np
from deepsea_cosim.master.replay.film import Film
from deepsea_cosim.master.replay.motion import Motion, names
from deepsea_cosim.master.replay.recorded import RecordedRun
from deepsea_cosim.master.replay.scene import Scene, parsed
from deepsea_cosim.master.replay.stage import build

RAM = """<mujoco><worldbody>
  <site name="foot" pos="{foot} 0 0"/>
  <body name="arm"><joint name="q" axis="0 -1 0"/>
    <geom name="beam" type="capsule" fromto="0 0 0 {long} 0 0" size="0.05"/><site name="eye" pos="{long} 0 0"/></body>
  <body name="rod" mocap="true"><geom type="cylinder" size="0.02" fromto="0 0 0 0.1 0 0"/>
    <site name="end" pos="0.1 0 0"/></body>
  <geom name="oil" type="cylinder" size="0.03" fromto="0 0 0 0 0 1"/>
</worldbody></mujoco>"""
RULES = """view = [90, 0]
[joints]
q = "angle + lead"
[[aim]]
body = "rod"
at = "eye"
towards = "foot"
[[stretch]]
geom = "oil"
from = "foot"
to = "end"
"""
"""A beam that turns, a rod that hangs at its end and points at the foot, and oil from the foot to that rod's end."""


def ram(component: str = "arm", xml: str = RAM, rules: str = RULES) -> Scene:
    return parsed(component, "Ram.fmu: resources/replay/", xml, rules, {})


def made_run(signals=None, parameters=None, tmp="run", seconds: float = 2.0) -> RecordedRun:
    """A run whose signals are given at even distances."""
    signals = signals or {"arm.angle": [0.0, 0.5, 1.0], "arm.p": [0.0, 5.0, 10.0]}
    count = len(next(iter(signals.values())))
    made = {name: np.asarray(x, dtype=float) for name, x in signals.items()}
    parameters = parameters or {"arm.long": 1.0, "arm.foot": 0.4, "arm.lead": 0.0}
    return RecordedRun(tmp, "p.ssp", None, np.linspace(0.0, seconds, count), made, parameters)


def filmed(scene: Scene, run: RecordedRun, times) -> Film:
    """The frames of a scene of a run on a stage."""
    stage = build([scene], run)
    [part] = stage.parts
    return Motion(stage.model, part.scene, run, part.prefix).film(np.asarray(times, dtype=float))


def site_distance(film: Film, one: str, other: str) -> np.ndarray:
    """Distance of two sites in each frame [m]."""
    from deepsea_cosim.master.replay.motion import places

    known = names(film.model, "site")
    at = places(film, [("site", known[one]), ("site", known[other])])
    return np.linalg.norm(at[:, 0] - at[:, 1], axis=1)
