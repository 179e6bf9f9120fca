"""What the command prints: progress, and at the end what the run answers, how far to trust it, and a table."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from math import isnan
from pathlib import Path
from shutil import disk_usage
from time import perf_counter
from typing import Any

from ..core.console import in_line
from ..core.display_units import DisplayUnits
from .accuracy.step_error import worst
from .simulation.result import Result
from .simulation.trust import trust

SHOWN, FILLED = 30, 12
"""Most signals in the table: those that are connected, and what the system gives; and lines up to which it is filled
with outputs that nobody reads."""

LOOK_AFTER, LONG, LARGE = 3.0, 60.0, 1e9
"""Time after which a run's length is estimated [s]; time left [s] and size of its record [bytes] that are told."""

BONDS = 3
"""Most power bonds that are listed, the worst first."""


class Progress:
    """A progress bar that appears once a run takes longer than a second, on a terminal only."""

    def __init__(self, quiet: bool, unit: str = "step"):
        self._unit = unit
        self._quiet = quiet or not sys.stderr.isatty()
        self._begin = perf_counter()
        self._bar: Any = None

    def __call__(self, done: int, total: int) -> None:
        if self._quiet or (self._bar is None and (perf_counter() - self._begin < 1.0 or done == total)):
            return
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(total=total, unit=self._unit, unit_scale=True, leave=False)
        self._bar.update(done - self._bar.n)
        if done == total:
            self._bar.close()


class Estimate:
    """Says once, as soon as that is known, how long something will take, such as the steps of a run, and how large its
    record becomes, where it is more than a minute or a gigabyte."""

    def __init__(
        self, say: Callable[[str], object], file: Path | None = None, text: str = "{} steps will take about {} more"
    ):
        self._say, self._file, self._text = say, file, text
        self._begin, self._is_told = perf_counter(), False

    def __call__(self, done: int, total: int) -> None:
        if done == 0:
            self._begin = perf_counter()
        elapsed = perf_counter() - self._begin
        if self._is_told or done == 0 or elapsed < LOOK_AFTER:
            return
        self._is_told, say = True, self._say
        left, size = elapsed * (total - done) / done, self._size() * total / done
        if left > LONG or size > LARGE:
            told = f", its record about {size / 1e9:.2g} GB" if size > LARGE else ""
            say(f"{self._text.format(total, _duration(left))}{told}")
            if self._file is not None and size > (free := disk_usage(self._file.parent).free):
                say(f"{self._file.parent}: only {free / 1e9:.2g} GB are free; --record and --record-every keep less")

    def _size(self) -> float:
        """Bytes that have been written."""
        if self._file is None:
            return 0.0
        files = self._file.rglob("*") if self._file.is_dir() else [self._file]
        return float(sum(path.stat().st_size for path in files if path.is_file()))


def _duration(seconds: float) -> str:
    for unit, length in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds > 2.0 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{seconds:.0f} s"


def report(result: Result, display: DisplayUnits) -> str:
    """The text at the end of a run."""
    summary = result.summary
    told = result.answers.texts(display) if result.answers is not None else []
    fmus = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in summary["fmu_time_s"].items())
    simulated = summary["stop_time_s"] - summary["start_time_s"]
    lines = [
        *told, trust(summary, bool(result.connected)), "",
        f"{Path(summary['package']).stem}: {simulated:g} s in {summary['steps']} steps of {summary['step_s']:g} s, "
        f"{summary['method']}",
        f"  wall time {summary['wall_time_s']:.2f} s ({summary['real_time_factor']:.1f} x real time) after "
        f"{summary['setup_time_s']:.2f} s of set-up; {fmus}",
        *_bonds(summary["coupling"]), *_step_check(result, display), "", *_table(result, display),
    ]  # fmt: skip
    return "\n".join(lines)


def _bonds(coupling: list[dict[str, Any]]) -> Iterator[str]:
    ranked = sorted(coupling, key=lambda bond: -(bond["relative"] or 0.0))
    for bond in ranked[:BONDS]:
        swing = f", omega h {bond['omega_h']:.2g}" if bond["omega_h"] is not None else ""
        if bond["numerical_damping"] is not None:
            swing += f", numerical damping {bond['numerical_damping']:+.1e}"
        yield (
            f"  residual {bond['residual_energy_J']:.3g} J of {bond['exchanged_energy_J']:.4g} J exchanged "
            f"({100 * bond['relative']:.2g} %){swing}  {bond['bond']}"
        )
    if len(ranked) > BONDS:
        yield f"  and {len(ranked) - BONDS} more power bonds with less"


def _step_check(result: Result, display: DisplayUnits) -> Iterator[str]:
    """What half the step has told."""
    found = result.summary.get("step_check", {})
    if found and (top := worst(found["errors"])) is not None:
        unit, factor, _ = display.of(result.units.get(top[0], ""), top[1]["error"])
        yield (
            f"  half the step: greatest estimated error {top[1]['relative']:.1e} of its range, {top[0]} "
            f"({factor * top[1]['error']:.2g} {unit})"
        ).rstrip()
    if (hint := found.get("advice")) is not None:
        yield (
            f"  largest coupling error: input {hint['input']}, off from {hint['source']} by up to "
            f"{hint['off']:.1e} of its range; --method {hint['method']} --step {hint['step']:.3g} would halve it, "
            f"in {hint['cost']:.2g} x the steps"
        )


def _table(result: Result, display: DisplayUnits) -> Iterator[str]:
    """Start, least, greatest and end of what is connected, of what the system gives, and of some other outputs."""
    assert result.extremes is not None
    yield f"  {'signal':<28}{'unit':>7}{'start':>13}{'least':>13}{'greatest':>13}{'end':>13}"
    places = {name: i for i, name in enumerate(result.names)}
    shown = dict.fromkeys((*result.connected, *result.system_outputs))
    other_outputs = [name for name in result.outputs if name not in shown and "[" not in name]
    numbers = [name for name in (*shown, *other_outputs) if not isnan(result.extremes[0][places[name]])]
    count = min(SHOWN, max(FILLED, len(shown)))
    for name in numbers[:count]:
        values = [float(row[places[name]]) for row in result.extremes]
        unit, factor, offset = display.of(result.units.get(name, ""), max(map(abs, values)))
        cells = "".join(f"{factor * value + offset:>13.6g}" for value in values)
        yield f"  {in_line(name):<28}{unit:>7}{cells}"
    if len(numbers) > count:
        yield f"  and {len(numbers) - count} more signals"
