"""Pictures of the arm by MuJoCo: Figure 10, and an animation of the run at 11 km. Works without a display."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...master.replay.film import Eye, Film
from ...master.replay.offscreen import pictures
from ...mechanics.linkage import linkage
from ...mechanics.mjcf import mjcf
from ...mechanics.variables import ARM

FRAMES, SHOWN = 110, 200
"""Frames of the animation, and the time of one [ms]: the run as fast as it was."""


def shots(parameters: Mapping[str, float], angles: Sequence[float], width: int, height: int) -> np.ndarray:
    """Pictures (n, height, width, 3) of the arm at the beam's angles [rad]."""
    import mujoco

    p = ARM.parameters(parameters)
    states = []
    for theta in angles:
        length, _, _, phi, *_ = linkage.py_func(theta, p["rod_eye_radius"], p["base_x"], p["base_y"])
        states.append((theta, phi, length))
    size = p["beam_length"]
    eye = Eye((0.45 * size, 0.0, 0.42 * size), 1.9 * size, 90.0, -4.0)
    film = Film(mujoco.MjModel.from_xml_string(mjcf(p)), np.array(states))
    return np.array(list(pictures(film, eye, width, height)))


def angle(parameters: Mapping[str, float], x_h: float) -> float:
    """The beam's angle [rad] at a displacement x_h [m], by bisection from theta0 upwards."""
    p = ARM.parameters(parameters)

    def reach(theta: float) -> float:
        return linkage.py_func(theta, p["rod_eye_radius"], p["base_x"], p["base_y"])[0]

    low, high, goal = p["theta0"], p["theta0"] + 2.0, reach(p["theta0"]) + x_h
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reach(middle) < goal and reach(middle) >= reach(low) else (low, middle)
    return low


def states(parameters: Mapping[str, float], path: Path) -> None:
    """Figure 10: the arm at 0, 100 and 200 mm beside each other."""
    from PIL import Image, ImageDraw

    width = 640
    angles = [angle(parameters, x) for x in (0.0, 0.1, 0.2)]
    image = Image.fromarray(np.concatenate(shots(parameters, angles, width, 480), axis=1))
    draw = ImageDraw.Draw(image)
    for k, label in enumerate(("(a) x_h = 0 mm", "(b) x_h = 100 mm", "(c) x_h = 200 mm")):
        draw.text((k * width + 12, 10), label, fill="white", font_size=22)
    image.save(path)


def animation(parameters: Mapping[str, float], run: Any, path: Path) -> None:
    """The run as a GIF: the arm, and beside it displacement, force and pressures up to that moment."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    figure = Figure(figsize=(4.2, 3.6), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    panels = (
        ("mm", ((1e3, "x_h", "$x_h$", "#0072b2"), (1e3, "x_cmd", "command", "#999999"))),
        ("kN", ((1e-3, "F_h", "$F_h$", "#d55e00"),)),
        ("MPa", ((1e-6, "P1", "$P_1$", "#009e73"), (1e-6, "P2", "$P_2$", "#cc79a7"), (1e-6, "Pa", "$P_a$", "#56b4e9"))),
    )
    marks = []
    for k, (unit, curves) in enumerate(panels):
        ax = figure.add_subplot(3, 1, k + 1)
        for factor, name, label, colour in curves:
            ax.plot(run.t[::20], factor * run[name][::20], color=colour, lw=1.0, label=label)
        ax.set_ylabel(unit, fontsize=8)
        ax.tick_params(labelsize=7)
        ax.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, handlelength=1.0)
        ax.grid(alpha=0.3)
        marks.append(ax.axvline(0.0, color="black", lw=0.8))
    ax.set_xlabel("time [s]", fontsize=8)
    frames = []
    times = np.linspace(run.t[0], run.t[-1], FRAMES)
    for t, shot in zip(times, shots(parameters, [run.at("theta", float(t)) for t in times], 480, 360), strict=True):
        for mark in marks:
            mark.set_xdata([t, t])
        canvas.draw()
        plot = np.asarray(canvas.buffer_rgba())[:, :, :3]
        whole = Image.fromarray(np.concatenate([shot, plot[: shot.shape[0]]], axis=1))
        frames.append(whole.quantize(255, dither=Image.Dither.NONE))
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=SHOWN, loop=0, optimize=True)
