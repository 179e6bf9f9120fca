"""The run in MuJoCo's own viewer, in real time."""

from __future__ import annotations

import os
import sys
import threading
from time import perf_counter, sleep
from typing import Any

import mujoco
import numpy as np

from ...core.display_units import DisplayUnits
from ...core.errors import UsageError
from .film import Film
from .lettering import ends
from .replay import Replay

RATE = 60.0
"""Pictures a second."""

CLOSING = 5.0
"""Longest time [s] that the window gets to close."""

FILES = "give --video out.mp4 or --gif out.gif, which need no display"


def check_display() -> None:
    """Raise `UsageError` where a window cannot be opened."""
    linux = sys.platform.startswith("linux")
    if linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise UsageError(f"there is no display here (DISPLAY is not set): {FILES}")


def show(
    replay: Replay, times: np.ndarray, display: DisplayUnits, speed: float, view: tuple[float, float] | None
) -> None:  # fmt: skip
    """Show the frames at these times [s] over and over until the window is closed; `speed` is how many seconds of the
    run pass in one."""
    from mujoco import viewer

    film, eye = replay.film(times), replay.eye(16 / 9, view)
    data = mujoco.MjData(film.model)
    film.pose(data, 0)
    threads = set(threading.enumerate())
    try:
        window = viewer.launch_passive(film.model, data, show_left_ui=False, show_right_ui=False)
    except RuntimeError as error:  # macOS wants its own Python for windows
        raise UsageError(f"MuJoCo's viewer does not open ({' '.join(str(error).split())}): {FILES}") from None
    with window:
        window.cam.lookat[:] = eye.lookat
        window.cam.distance, window.cam.azimuth, window.cam.elevation = eye.distance, eye.azimuth, eye.elevation
        _play(window, replay, _legend(replay, display), film, data, times, speed)
    for thread in set(threading.enumerate()) - threads:  # the window's: a process that ends under it crashes
        thread.join(CLOSING)


def _legend(replay: Replay, display: DisplayUnits) -> list[str]:
    """What colours and ghosts mean, in lines."""
    told = [(scale.text or scale.name, *ends(scale, display)) for scale in replay.scales]
    return [*(f"{text}: blue {least}, red {most} {unit}" for text, unit, least, most in told), *replay.legend]


def _play(
    window: Any, replay: Replay, legend: list[str], film: Film, data: mujoco.MjData, times: np.ndarray, speed: float
) -> None:
    begun = perf_counter()
    while window.is_running():
        passed = (perf_counter() - begun) * speed
        length = float(times[-1] - times[0])
        if passed > length + speed:  # a second at the end, then from the beginning
            begun, passed = perf_counter(), 0.0
        k = int(np.searchsorted(times, times[0] + min(passed, length) + 1e-9, side="right")) - 1
        with window.lock():
            film.pose(data, k)
        lines = [f"t = {times[k]:.2f} s", *(label.at(float(times[k])) for label in replay.labels), *legend]
        window.set_texts((mujoco.mjtFontScale.mjFONTSCALE_150, mujoco.mjtGridPos.mjGRID_TOPLEFT, "\n".join(lines), ""))
        window.sync()
        sleep(1.0 / RATE)
