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
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

if TYPE_CHECKING:
    from .run import Result

MAX_PANELS = 6
MAX_LINES = 8

SHOWN = {
    "Pa": ("MPa", 1e-6), "m3/s": ("L/min", 6e4), "m3": ("L", 1e3), "m": ("mm", 1e3), "m/s": ("mm/s", 1e3),
    "N": ("kN", 1e-3),
}  # fmt: skip
"""Units that are shown in another one."""


def panels(
    names: Sequence[str], units: Mapping[str, str], connected: Sequence[str], rows: np.ndarray
) -> dict[str, list[str]]:
    """Unit -> signals to show: units of connected outputs first; no arrays, no constants."""
    drives = set(connected)
    chosen: dict[str, list[str]] = {}
    for name in sorted(names[1:], key=lambda n: n not in drives):
        column = rows[:, names.index(name)]
        spread = np.ptp(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0
        if "[" in name or spread <= 1e-12 * np.max(np.abs(column), initial=1e-300):
            continue
        others = chosen.setdefault(units.get(name, "1"), [])
        if len(others) < MAX_LINES:
            others.append(name)
    return dict([item for item in chosen.items() if item[1]][:MAX_PANELS])


def draw(
    target: Path | BinaryIO,
    title: str,
    names: Sequence[str],
    units: Mapping[str, str],
    connected: Sequence[str],
    rows: np.ndarray,
) -> None:
    """Write the figure; rows are (n, columns) with the time in the first."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    chosen = panels(names, units, connected, rows)
    count = max(len(chosen), 1)
    columns = 1 if count == 1 else 2
    lines = -(-count // columns)
    figure = Figure(figsize=(6.4 * columns, 3.2 * lines + 0.3), dpi=100)
    FigureCanvasAgg(figure)
    height = figure.get_figheight()
    figure.subplots_adjust(0.07, 0.55 / height, 0.985, 1.0 - 0.8 / height, 0.16, 0.32)
    figure.suptitle(title, fontsize=12, y=1.0 - 0.12 / height)
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for axis, (unit, group) in zip(axes, chosen.items(), strict=False):
        shown, factor = SHOWN.get(unit, (unit, 1.0))
        for name in group:
            axis.plot(rows[:, 0], rows[:, names.index(name)] * factor, label=name, linewidth=1.2)
        axis.set_ylabel(f"[{shown}]")
        axis.grid(alpha=0.3)
        axis.locator_params(nbins=6)
        axis.set_xlim(rows[0, 0], rows[-1, 0])
        axis.legend(fontsize=7, loc="lower left", bbox_to_anchor=(-0.02, 0.98), ncols=4, frameon=False)
    for axis in axes[count:]:
        axis.set_visible(False)
    for axis in axes[max(count - columns, 0) : count]:
        axis.set_xlabel("time [s]")
    figure.savefig(target, pil_kwargs={"compress_level": 3})


class Plotter:
    """A helper process that gets ready while the simulation runs; a context manager."""

    def __init__(self) -> None:
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

    def draw(self, target: Path, title: str, result: Result, patterns: Sequence[str] = ()) -> str | None:
        """Draw and wait; None when all went well, else the reason why not.

        patterns: what to show; without, the outputs that change, those that drive something first.
        """
        from ..system.addresses import matches

        assert result.sample is not None
        data = target.with_suffix(".npy.tmp")
        names = result.names[1:]
        shown = [n for n in names if any(matches(n, p) for p in patterns)]
        chosen = ["time", *(shown or [n for n in result.outputs if n in names])]
        request = {
            "target": str(target), "title": title, "names": chosen, "units": result.units,
            "connected": result.connected, "rows": str(data),
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
    draw(rows=rows, **request)


if __name__ == "__main__":
    _serve()
    os._exit(0)  # somebody waits for the end of this process, and there is nothing to clean up
