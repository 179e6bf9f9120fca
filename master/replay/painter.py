"""Draws a film with MuJoCo: a process that `offscreen` starts, because drivers are chosen once a process.

python -m deepsea_cosim.master.replay.painter FOLDER
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from .film import Eye, Film, load
from .offscreen import PICTURE, READY, SAME

LESS = 0.1
"""Share of a pixel by which nothing that is seen has to have moved for a picture to be the one before."""


def main(folder: Path) -> None:
    """Draw what the folder's order says onto the standard output."""
    order = json.loads((folder / "order.json").read_text())
    film, eye, (width, height) = load(folder), Eye(**order["eye"]), order["size"]
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a driver prints is no picture
    camera = mujoco.MjvCamera()
    camera.lookat[:] = eye.lookat
    camera.distance, camera.azimuth, camera.elevation = eye.distance, eye.azimuth, eye.elevation
    film.model.vis.global_.offwidth, film.model.vis.global_.offheight = width, height
    data = mujoco.MjData(film.model)
    pixel = 2.0 * eye.distance * np.tan(0.5 * np.radians(film.model.vis.global_.fovy)) / height
    with mujoco.Renderer(film.model, height, width) as renderer:
        out.write(READY)
        before: Any = None
        for k in range(len(film)):
            film.pose(data, k)
            now = _seen(film, data, eye.distance, LESS * pixel)
            if before is not None and np.abs(now - before).max(initial=0.0) < LESS * pixel:
                out.write(SAME)
                continue
            before = now
            renderer.update_scene(data, camera=camera)
            out.write(PICTURE)
            out.write(renderer.render().tobytes())
    out.close()


def _seen(film: Film, data: mujoco.MjData, distance: float, least: float) -> np.ndarray:
    """Numbers [m] that differ by as much as what is seen does, a shade of 256 counts as `least`."""
    m, shades = film.model, 256.0 * film.model.geom_rgba[film.coloured]
    turns = 0.5 * distance * data.geom_xmat
    return np.concatenate([x.ravel() for x in (data.geom_xpos, turns, m.geom_size, least * shades)])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
