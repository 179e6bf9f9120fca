"""overview.png: what matters of a run, a panel per unit; for any system, because it goes by units and connections.

Run as a module it is a helper process: it loads matplotlib while the simulation runs, then waits for the name of a
request file on its standard input.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ...core.display_units import DisplayUnits
from ...core.ending import starting_processes
from ...core.errors import UsageError, did_you_mean
from ...core.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .result import Result

MAX_PANELS, MAX_LINES = 6, 8
"""Panels of an overview, and lines in a panel."""

MAX_PANELS_ASKED, MAX_LINES_ASKED = 12, 20
"""The same where the user has said what to show; there are 10 colours."""

LEGEND = 104
"""Letters in a row of a legend, with 6 for a line and the gap before it."""


@dataclass(frozen=True)
class Panel:
    """Signals of one unit that are drawn together, and how many more there are."""

    unit: str
    names: tuple[str, ...]
    more: int = 0

    @property
    def columns_of_legend(self) -> int:
        """Names side by side in the legend, as many as the panel is wide."""
        return max(1, min(4, LEGEND // (6 + max(map(len, self.names)))))

    @property
    def rows_of_legend(self) -> int:
        """Rows of the legend."""
        return -(-(len(self.names) + (self.more > 0)) // self.columns_of_legend)


def panels(
    names: Sequence[str], units: Mapping[str, str], connected: Sequence[str], rows: np.ndarray, asked: bool
) -> tuple[list[Panel], dict[str, int]]:
    """What to draw, and how many signals there are in other units.

    asked: the names are those that the user wants to see, all of them. Else units of connected outputs come first,
    what does not change is left out unless nothing does, and elements of arrays that drive nothing are only counted
    where a unit has others. Texts are no lines.
    """
    drives = set(connected)
    places = {name: i for i, name in enumerate(names)}
    numbers = [n for i, n in enumerate(names) if i and np.isfinite(rows[:, i]).any()]
    if not asked:
        numbers = [n for n in numbers if _changes(rows[:, places[n]])] or numbers
        numbers.sort(key=lambda n: (n not in drives, "[" in n))
    groups: dict[str, list[str]] = {}
    for name in numbers:
        groups.setdefault(units.get(name, "1"), []).append(name)
    lines, most = (MAX_LINES_ASKED, MAX_PANELS_ASKED) if asked else (MAX_LINES, MAX_PANELS)
    made = []
    for unit, group in list(groups.items())[:most]:
        wanted = [n for n in group if asked or n in drives or "[" not in n] or group
        made.append(Panel(unit, tuple(wanted[:lines]), len(group) - len(wanted[:lines])))
    return made, {unit: len(group) for unit, group in list(groups.items())[most:]}


def _changes(column: np.ndarray) -> bool:
    finite = column[np.isfinite(column)]
    return bool(np.ptp(finite) > 1e-12 * np.max(np.abs(finite)))


def signals_to_draw(result: Result, patterns: Sequence[str]) -> tuple[list[str], bool]:
    """The time and the names of the signals that a figure of a run is to show, and whether patterns asked for them.

    Without patterns that match all outputs. Raises `UsageError` for a pattern that matches nothing.
    """
    from ..system.addresses import matches

    names = result.names[1:]
    if not patterns and result.answers is not None and result.answers.signals:
        return ["time", *result.answers.signals], True
    for pattern in patterns:
        if not any(matches(name, pattern) for name in names):
            raise UsageError(f"no signal matches '{pattern}'{did_you_mean(pattern, names)}")
    shown = [n for n in names if any(matches(n, p) for p in patterns)]
    return ["time", *(shown or [n for n in result.outputs if n in names])], bool(shown)


def draw(target: Path | BinaryIO, *what: Any, **more: Any) -> None:
    """Write a `figure` into a file."""
    with replacing(target) if isinstance(target, Path) else nullcontext(target) as place:
        figure(*what, **more).savefig(place, format="png", pil_kwargs={"compress_level": 3})


def figure(
    title: str,
    names: Sequence[str],
    units: Mapping[str, str],
    connected: Sequence[str],
    rows: np.ndarray,
    asked: bool = False,
    display: DisplayUnits | None = None,
) -> Figure:
    """The figure; rows are (n, columns) with the time in the first; see `panels`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    display = display or DisplayUnits()
    chosen, others = panels(names, units, connected, rows, asked)
    count = max(len(chosen), 1)
    columns = 1 if count == 1 else 2
    lines = -(-count // columns)
    head = 0.14 * max((panel.rows_of_legend for panel in chosen), default=1)  # inches for the legend above each panel
    made = Figure(figsize=(6.4 * columns, (2.9 + head) * lines + 0.3), dpi=100)
    FigureCanvasAgg(made)
    width, height = made.get_size_inches()
    more = ", ".join(f"{n} in {unit}" for unit, n in others.items())
    note = f"\nnot drawn: {sum(others.values())} more signals ({more})" if others else ""
    top = (0.6 if note else 0.5) + head
    made.subplots_adjust(
        0.85 / width, 0.55 / height, 1.0 - 0.2 / width, 1.0 - top / height, 0.18, (0.55 + head) / 2.3
    )  # fmt: skip
    made.suptitle(_plain(title + note), fontsize=11 if note else 12, y=1.0 - 0.08 / height)
    axes = made.subplots(lines, columns, squeeze=False).ravel()
    for axis, panel in zip(axes, chosen, strict=False):
        _draw_panel(axis, panel, names, rows, display)
    if not chosen:
        axes[0].text(0.5, 0.5, "no numbers to draw", ha="center", transform=axes[0].transAxes)
    for axis in axes[count:]:
        axis.set_visible(False)
    for axis in axes[max(count - columns, 0) : count]:
        axis.set_xlabel("time [s]")
    return made


def _draw_panel(
    axis: Any, panel: Panel, names: Sequence[str], rows: np.ndarray, display: DisplayUnits
) -> None:
    table = rows[:, [names.index(name) for name in panel.names]]
    unit, factor, offset = display.of(panel.unit, float(np.nanmax(np.abs(table))))
    for k, name in enumerate(panel.names):
        style = "-" if k < 10 else "--"
        axis.plot(rows[:, 0], table[:, k] * factor + offset, style, label=_plain(name), linewidth=1.2)
    if panel.more:
        axis.plot([], [], " ", label=f"and {panel.more} more")
    axis.set_ylabel(_plain(f"[{unit}]"))
    axis.grid(alpha=0.3)
    axis.locator_params(nbins=6)
    axis.set_xlim(rows[0, 0], rows[-1, 0])
    # beside the power of ten that may stand above the axis
    place = (0.06, 0.98)
    axis.legend(fontsize=7, loc="lower left", bbox_to_anchor=place, ncols=panel.columns_of_legend, frameon=False)


def _plain(text: str) -> str:
    """A text in which matplotlib finds no formula and nothing to hide."""
    text = text.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


class Plotter:
    """A helper process that gets ready while the simulation runs; a context manager."""

    def __init__(self) -> None:
        with starting_processes():  # Ctrl-C is for who started it, and ends it
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )

    def __enter__(self) -> Plotter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()

    def draw(
        self, target: Path, title: str, result: Result, display: DisplayUnits, patterns: Sequence[str] = ()
    ) -> str | None:
        """Draw and wait; None when all went well, else the reason why not.

        patterns: what to show; without, the outputs that change, those that drive something first (see `panels`).
        """
        assert result.sample is not None
        data = target.with_suffix(".npy.tmp")
        chosen, asked = signals_to_draw(result, patterns)
        request = {
            "target": str(target), "title": title, "names": chosen, "units": result.units,
            "connected": result.connected, "rows": str(data), "asked": asked,
            "display": [display.chosen, display.usual],
        }  # fmt: skip
        try:
            with data.open("wb") as file:
                np.save(file, result.sample[:, [result.names.index(name) for name in chosen]])
            _, errors = self._process.communicate(json.dumps(request).encode())
        except OSError as error:
            return f"{data}: cannot be written ({error.strerror})"
        finally:
            data.unlink(missing_ok=True)
        if self._process.returncode:
            return errors.decode(errors="replace").strip().splitlines()[-1] if errors else "the plot failed"
        return None


def _serve() -> None:
    import io

    # the first figure of a process loads fonts and more: draw one while nobody waits
    draw(io.BytesIO(), "t", ["t", "x"], {}, [], np.arange(4.0).reshape(2, 2))
    text = sys.stdin.read()
    if not text:
        return
    request = json.loads(text)
    rows = np.load(request.pop("rows"))
    request["target"] = Path(request["target"])
    request["display"] = DisplayUnits(*map(tuple, request["display"]))
    draw(rows=rows, **request)


if __name__ == "__main__":
    _serve()
    os._exit(0)  # somebody waits for the end of this process, and there is nothing to clean up
