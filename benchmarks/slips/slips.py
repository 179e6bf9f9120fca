"""Slips in the run files of the pool test: what spoils a file, and the words that have to be said of it.

A file is a table (n, 5): time [s], x_h [mm], P1, P2 [bar], spool [%], at 100 readings a second.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.float64]
Change = Callable[[Table], Table]

HEAD = "time,x_h,P1,P2,spool"
T, X, P1, P2, SPOOL = range(5)
RUNS = ("run01", "run02", "run03")
DEPTHS = {"run01": 0.0, "run02": 6000.0, "run03": 9000.0}
AMBIENT = 1025.0 * 9.81 / 1e5
"""Pressure of the sea by its depth [bar/m]."""


@dataclass(frozen=True)
class Slip:
    """A change of the files of some runs, by name; `told`: words of which one has to be said, () where nothing may be
    asked, for it is read as it was meant."""

    name: str
    changes: dict[str, Change]
    told: tuple[str, ...]
    text: Callable[[str], str] = str
    """Of the written file."""
    keys: tuple[str, str] = ("", "")
    """What is replaced in campaign.toml, and by what."""


def same(table: Table) -> Table:
    """As it was measured."""
    return table


def column(j: int, function: Callable[[Table], Table], table: Table) -> Table:
    """A table of which one column is changed."""
    made = table.copy()
    made[:, j] = function(made[:, j])
    return made


def of(change: Change, runs: Collection[str] = RUNS) -> dict[str, Change]:
    """That change in the files of these runs."""
    return {run: change if run in runs else same for run in RUNS}


def times(j: int, factor: float) -> Change:
    """A column times a factor."""
    return partial(column, j, lambda y: factor * y)


def late(columns: Collection[int], seconds: float, table: Table) -> Table:
    """Columns of another logger, whose clock is off."""
    made = table.copy()
    for j in columns:
        made[:, j] = np.interp(table[:, T] - seconds, table[:, T], table[:, j])
    return made


def lost(table: Table) -> Table:
    """Three seconds without a row, and times counted on."""
    made = np.delete(table, slice(400, 700), 0)
    made[:, T] = table[: len(made), T]
    return made


def stuck(j: int, begin: int, end: int, noise: float, table: Table) -> Table:
    """A sensor that stands still."""
    made = table.copy()
    made[begin:end, j] = made[begin, j] + noise * np.random.default_rng(1).normal(size=len(made[begin:end]))
    return made


def marked(mark: float, table: Table) -> Table:
    """A mark in the place of a twentieth of the readings."""
    made = table.copy()
    where = np.random.default_rng(2).random(made[:, 1:].shape) < 0.05
    made[:, 1:][where] = mark
    return made


def over_ambient(depth: float, table: Table) -> Table:
    """Pressures that are told over that of the sea."""
    made = table.copy()
    made[:, [P1, P2]] -= AMBIENT * depth
    return made


def held(rows: int, table: Table) -> Table:
    """A sensor that is read more often than it measures."""
    return column(P1, lambda y: y[np.arange(len(y)) // rows * rows], table)


def swapped(table: Table) -> Table:
    """Two columns in each other's place."""
    return table[:, [T, X, P2, P1, SPOOL]]


def comma(text: str) -> str:
    """As a German spreadsheet writes it."""
    return text.replace(",", ";").replace(".", ",")


UNITS = [
    Slip("P1 in kPa", of(times(P1, 100.0)), ("kPa",)), Slip("P1 in MPa", of(times(P1, 0.1)), ("MPa",)),
    Slip("P1 in psi", of(times(P1, 14.5038)), ("psi",)), Slip("x_h in m", of(times(X, 1e-3)), ("in m?", "in m ")),
    Slip("spool as a share", of(times(SPOOL, 0.01)), ("in 1?", "share", "in 1 ")),
    Slip("P1 in kPa in a run", of(times(P1, 100.0), ["run02"]), ("kPa", "times as much")),
    Slip("x_h turned", of(times(X, -1.0)), ("scale = -1",)),
    Slip("spool turned in a run", of(times(SPOOL, -1.0), ["run02"]), ("scale = -1",)),
    Slip("P1 and P2 exchanged", of(swapped), ("swapped",)),
    Slip("pressures over ambient", {r: partial(over_ambient, d) for r, d in DEPTHS.items()}, ("over ambient",)),
]  # fmt: skip

CLOCKS = [
    Slip("time in ms", of(times(T, 1e3)), ("time_unit", "ms")), Slip("time in minutes", of(times(T, 1 / 60)), ("min",)),
    Slip("twice too slow", of(times(T, 2.0)), ("times its time",)),
    Slip("a tenth too slow", of(times(T, 1.1)), ("times its time",)),
    Slip("a hundredth too slow", of(times(T, 1.01)), ("times its time",)),
    Slip("another logger half a second late", of(partial(late, (P1, P2), 0.5)), ("late",)),
    Slip("rows lost, times counted on", of(lost, ["run02"]), ("jumps",)),
    Slip("rows lost", of(lambda t: np.delete(t, slice(400, 700), 0), ["run02"]), ("nothing was measured",)),
    Slip("rows out of order", of(lambda t: np.r_[t[:300], t[301:302], t[300:301], t[302:]]), ("does not increase",)),
    Slip("a row twice", of(lambda t: np.insert(t, 300, t[300], 0)), ("does not increase",)),
    Slip("jitter in ms", of(same), ("it is in seconds",), keys=("unit = \"mm\"", "unit = \"mm\"\nclock_jitter = 5")),
]  # fmt: skip

SENSORS = [
    Slip("x_h stuck in motion", of(partial(stuck, X, 300, 900, 0.0)), ("stuck",)),
    Slip("x_h stuck, with noise", of(partial(stuck, X, 300, 700, 0.05)), ("stuck",)),
    Slip("P1 dead from 8 s on", of(partial(stuck, P1, 800, 2201, 0.0)), ("stuck",)),
    Slip("P1 constant in a run", of(partial(column, P1, lambda y: 0.0 * y + 123.4), ["run02"]), ("constant",)),
    Slip("P1 clipped", of(partial(column, P1, lambda y: np.minimum(y, np.quantile(y, 0.7)))), ("clipped",)),
    Slip("P1 measured every 0.2 s and held", of(partial(held, 20)), ("20th row",)),
    Slip("-9999 for what is missing", of(partial(marked, -9999.0)), ("-9999",)),
    Slip("999 for what is missing", of(partial(marked, 999.0)), ("999",)),
    Slip("nothing for what is missing", of(partial(marked, np.nan)), ()),
    Slip("noise of 100 mm", of(partial(column, X, lambda y: y + 100.0 * np.sin(1e6 * y))), ("scatter",)),
    Slip(
        "one reading a million times too large", of(lambda t: np.r_[t[:300], t[300:301] * [1, 1e6, 1, 1, 1], t[301:]]),
        ("impossible", "left out"),
    ),
    Slip("one reading a second", of(lambda t: t[::100]), ("too slow",)),
]  # fmt: skip

FILES = [
    Slip("decimal commas", of(same), (), comma), Slip("semicolons", of(same), (), lambda text: text.replace(",", ";")),
    Slip("lines of Windows", of(same), (), lambda text: text.replace("\n", "\r\n")),
    Slip(
        "units in the head", of(same), (),
        lambda text: text.replace(HEAD, "time [s],x_h [mm],P1 [bar],P2 [bar],spool [%]"),
    ),
    Slip("another unit in the head", of(same), ("bar",), lambda text: text.replace(HEAD, "time,x_h,P1 [psi],P2,spool")),
    Slip("text below", of(same), ("line",), lambda text: f"{text}END OF TEST\n"),
    Slip("NUL characters", of(same), ("NUL",), lambda text: text.replace("\n9,", "\n9,\0\0", 1)),
    Slip("ERR for what is missing", of(same), ("leave empty",), lambda text: re.sub("\n9,[^,]*", "\n9,ERR", text)),
]  # fmt: skip

CONDITIONS = [
    Slip("nothing spoilt", of(same), ()),
    Slip("a depth of 600 m for 6000 m", of(same), ("condition",), keys=('"depth" = 6000.0', '"depth" = 600.0')),
    Slip("files exchanged", of(same), ("exchanged",), keys=("run02.csv", "run03.csv")),
]  # fmt: skip

SLIPS = [*CONDITIONS, *UNITS, *CLOCKS, *SENSORS, *FILES]
