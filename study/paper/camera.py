"""Draws the arm with MuJoCo: a process that is asked by `arm_pictures`, because drivers are chosen once a process.

    python -m deepsea_cosim.study.paper.camera ORDER.json SHOTS.npy
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

from ...mechanics.linkage import linkage
from ...mechanics.mjcf import mjcf
from ...mechanics.variables import ARM


def main(order: Path, answer: Path) -> None:
    """Draw what the order says: parameters, angles [rad] and size."""
    wanted = json.loads(order.read_text())
    p, (width, height) = ARM.parameters(wanted["parameters"]), wanted["size"]
    model = mujoco.MjModel.from_xml_string(mjcf(p))
    data, eye = mujoco.MjData(model), mujoco.MjvCamera()
    eye.lookat[:] = 0.45 * p["beam_length"], 0.0, 0.42 * p["beam_length"]
    eye.distance, eye.azimuth, eye.elevation = 1.9 * p["beam_length"], 90.0, -4.0
    shots = []
    with mujoco.Renderer(model, height, width) as renderer:
        for theta in wanted["angles"]:
            length, _, _, phi, *_ = linkage.py_func(theta, p["rod_eye_radius"], p["base_x"], p["base_y"])
            data.qpos[:] = theta, phi, length
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera=eye)
            shots.append(renderer.render().copy())
    np.save(answer, np.array(shots))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
