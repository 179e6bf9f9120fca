"""The paper's figures 8, 9 and 11 to 21 as pictures, with the published numbers marked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .cases import CONSTANT, DEEPEST, DEPTHS, FIGURES, PROMPT, RAMP, T_DOWN, T_START, TARGET, TIMES, VISCOSITY, WITHIN
from .lines import STEADY, Lines
from .runs import Run, Runs

COLOURS = ("#0072b2", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#56b4e9", "#111111")
"""Okabe and Ito's, which the colour-blind tell apart."""

PUBLISHED = "#111111"
STYLE = {"font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False}
DISPLACEMENT = "displacement $x_h$ [mm]"
EVERY = 20
"""Samples between the drawn ones: 20 ms."""


def all_figures(lines: Lines, runs: Runs) -> dict[str, Figure]:
    """Every figure by its number."""
    with rc_context(STYLE):
        made = {"8": _line_losses(lines), "9": _depths(runs), "11": _losses(runs), "12": _cause(runs)}
        for number in range(13, 22):
            made[str(number)] = _displacements(number, runs.of(FIGURES[number][1]), FIGURES[number][0])
    return made


def save(figure: Figure, path: Path) -> None:
    """Write the picture."""
    if not isinstance(figure.canvas, FigureCanvasAgg):
        FigureCanvasAgg(figure)
    with rc_context(STYLE):
        figure.savefig(path, dpi=120)


def _new(columns: int = 1) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(7.2 if columns == 1 else 9.0, 4.0), layout="constrained")
    return figure, [figure.add_subplot(1, columns, k + 1) for k in range(columns)]


def _line_losses(lines: Lines) -> Figure:
    figure, (ax,) = _new()
    for km, colour in zip(lines.depths, COLOURS, strict=False):
        for variable, style in ((True, "-"), (False, "--")):
            t, loss = lines.made[km, variable]
            ax.plot(1e3 * t, loss / 1e6, style, color=colour, label=f"{km:g} km" if variable else None)
    end = 1e3 * lines.made[lines.depths[0], True][0][-1]
    for variable, value in STEADY.items():
        ax.plot(end, value, "<", color=PUBLISHED, ms=6)
        place, up = (-8, 6 if variable else -11), "offset points"
        told = f"{value} MPa, {VISCOSITY[variable]} (paper)"
        ax.annotate(told, (end, value), place, textcoords=up, ha="right", fontsize=8)
    ax.plot([], [], "k--", label="constant viscosity")
    ax.set(xlabel="time [ms]", ylabel="loss of one line [MPa]", title="3 L/min switched on at the inlet")
    ax.legend(ncols=2)
    return figure


def _draw(ax: Axes, run: Run, **style: object) -> None:
    ax.plot(run.t[::EVERY], 1e3 * run["x_h"][::EVERY], **style)  # type: ignore[arg-type]


def _command(ax: Axes, run: Run, label: str | None = "command") -> None:
    ax.plot(run.t[::EVERY], 1e3 * run["x_cmd"][::EVERY], ":", color="#777777", lw=1.2, label=label)


def _published(ax: Axes, variable: bool, shape: str, label: str) -> None:
    """The paper's times at 11 km, at which the cylinder comes within 1 mm of its ends."""
    out, back = TIMES[variable]
    done = 1e3 * (TARGET - WITHIN), 1e3 * WITHIN
    ax.plot([T_START + out, T_DOWN + back], done, shape, color=PUBLISHED, ms=6, label=label)


def _prompt(ax: Axes, number: int) -> None:
    """What the paper says comes with its command: where that ends."""
    if number in PROMPT:
        what, target = PROMPT[number]
        at = [T_START + RAMP, T_DOWN + RAMP], [1e3 * (target - WITHIN), 1e3 * WITHIN]
        ax.plot(*at, "s", color=PUBLISHED, mfc="none", ms=7, mew=1.3, label=f"paper, no delay:\n{what}", zorder=3)


def _labels(ax: Axes, title: str) -> None:
    ax.set(xlabel="time [s]", ylabel=DISPLACEMENT, title=title)
    ax.legend(fontsize=8)


def _depths(runs: Runs) -> Figure:
    figure, (ax,) = _new()
    _command(ax, runs[DEEPEST])
    for run, colour in zip(runs.of(FIGURES[9][1]), COLOURS, strict=False):
        constant = run.case is CONSTANT
        _draw(ax, run, color=COLOURS[4] if constant else colour, ls="--" if constant else "-", label=run.case.label)
    for variable, shape in ((True, "v"), (False, "^")):
        _published(ax, variable, shape, f"paper, 11 km,\n{VISCOSITY[variable]} viscosity")
    _prompt(ax, 9)
    ax.set(xlabel="time [s]", ylabel=DISPLACEMENT, title=FIGURES[9][0])
    figure.legend(fontsize=8, loc="outside right upper")
    return figure


def _displacements(number: int, runs: Sequence[Run], title: str) -> Figure:
    figure, (ax,) = _new()
    commands = {run.target for run in runs}
    for run, colour in zip(runs, COLOURS, strict=False):
        _draw(ax, run, color=colour, label=run.case.label)
        if len(commands) > 1:
            _command(ax, run, None)
        if run.case.key == DEEPEST.key:
            _published(ax, True, "v", f"paper, {run.case.label}")
    if len(commands) == 1:
        _command(ax, runs[0])
    _prompt(ax, number)
    _labels(ax, f"{title}, 11 km")
    return figure


def _losses(runs: Runs) -> Figure:
    figure, (ax,) = _new()
    km = np.arange(len(DEPTHS))
    for k, (line, colour) in enumerate((("a-1 (supply side)", COLOURS[0]), ("2-b (return side)", COLOURS[3]))):
        ax.plot(km, [r.losses[k] / 1e6 for r in runs.of(DEPTHS)], "o-", color=colour, label=f"line {line}")
    ax.set(xlabel="depth [km]", ylabel="loss in mid-extension [MPa]", title=FIGURES[11][0])
    ax.axvspan(9.5, 11.3, color="#eeeeee", zorder=0)
    ax.annotate("delayed:\nless flow", (10.4, 0.06), xycoords=("data", "axes fraction"), ha="center", fontsize=8)
    ax.set_ylim(bottom=0)
    ax.legend()
    return figure


def _cause(runs: Runs) -> Figure:
    figure, axes = _new(3)
    km = np.arange(len(DEPTHS))
    found = runs.of(DEPTHS)
    for ax, values, label, colour in (
        (axes[0], [(r.at("Pp") - r.at("Pa")) / 1e6 for r in found], "$P_p - P_a$ [MPa]", COLOURS[6]),
        (axes[1], [100 * r.at("x_v") for r in found], "spool position [%]", COLOURS[3]),
        (axes[2], [1e3 * r.at("v_h") for r in found], "speed [mm/s]", COLOURS[0]),
    ):
        ax.plot(km, values, "o-", color=colour)
        ax.set(xlabel="depth [km]", ylabel=label, xticks=km)
        ax.set_ylim(bottom=0)
    for ax, where, value, label in (
        (axes[1], km[10:], 100, "paper: full open\nfrom 10 km on"),
        (axes[2], km[:10], 40, "paper: as commanded,\n40 mm/s, to 9 km"),
    ):
        ax.plot(where, [value] * len(where), "s", color=PUBLISHED, mfc="none", ms=9, mew=1.3, label=label)
        ax.legend(fontsize=8, loc="lower left")
    figure.suptitle(FIGURES[12][0])
    return figure
