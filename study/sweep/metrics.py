"""What is measured of a run: `label=function(connector, numbers)`, one number each.

The functions, with x the signal, times in s from the start of the run's clock:

    initial(x)  final(x)  min(x)  max(x)  mean(x)  rms(x)  range(x)  integral(x)
    at(x, t)                          value at t
    reaches(x, target, within, after) time from `after` (0) until x is within `within` of `target` for the first time
    settles(x, target, within, after, until)
                                      the same until it has come to stay there, until `until` (the end)
    above(x, level)                   time spent above the level

`mean`, `rms` and `integral` are over time, by the trapezoidal rule. A number that does not exist (x never arrives) is
empty in the table.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ...core.errors import UsageError, did_you_mean
from ...core.plain_numbers import plain_number
from ...master.results.measures import FUNCTIONS


@dataclass(frozen=True)
class Metric:
    """A number of a run."""

    label: str
    function: str
    connector: str
    numbers: tuple[float, ...] = ()

    def __str__(self) -> str:
        inside = ", ".join([self.connector, *(f"{n:.12g}" for n in self.numbers)])
        return f"{self.function}({inside})"

    def unit(self, of_signal: str | None) -> str | None:
        """Unit of the number, from that of the signal; None where that is not known."""
        if self.function in ("reaches", "settles", "above"):
            return "s"
        if self.function == "integral" and of_signal is not None:
            return "s" if of_signal == "1" else f"{of_signal}.s"
        return of_signal

    def check(self, start: float, stop: float) -> None:
        """Raise `UsageError` for numbers that no run from `start` to `stop` [s] can have anything to do with."""
        first = {"at": 0, "reaches": 2, "settles": 2}.get(self.function, len(self.numbers))
        for when in self.numbers[first : first + 1]:
            if when > stop or (self.function == "at" and when < start):
                raise UsageError(f"--metric {self}: {when:g} s is not in the run, from {start:g} to {stop:g} s")
        if self.function in ("reaches", "settles") and self.numbers[1] < 0.0:
            raise UsageError(f"--metric {self}: within = {self.numbers[1]:g} is negative")

    def of(self, t: np.ndarray, x: np.ndarray) -> float | None:
        """The number for the signal x (n,) at the times t (n,)."""
        return FUNCTIONS[self.function][0](t, x, *self.numbers)


def _arguments(text: str) -> tuple[str, list[str]]:
    """The connector, in whose brackets there may be commas, and what comes after it."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    connector, *rest = (part.strip() for part in parts)
    return connector, rest


def parse_metric(text: str) -> Metric:
    """The metric of `--metric text`; raises `UsageError`."""
    found = re.fullmatch(r"\s*(?:([^=()]+?)\s*=\s*)?(\w+)\s*\((.*)\)\s*", text)
    if not found:
        raise UsageError(f"--metric {text}: expected function(connector, numbers), e.g. final(arm.x_h)")
    label, function, inside = found.groups()
    if function not in FUNCTIONS:
        names = list(FUNCTIONS)
        raise UsageError(f"--metric {text}: no function '{function}'{did_you_mean(function, names)}; "
                         f"known: {', '.join(names)}")  # fmt: skip
    connector, rest = _arguments(inside)
    _, least, most = FUNCTIONS[function]
    try:
        numbers = tuple(plain_number(part) for part in rest)
    except ValueError:
        raise UsageError(f"--metric {text}: after the connector come numbers") from None
    if not connector or not least <= len(numbers) <= most or not np.isfinite(numbers).all():
        wanted = f"{least}" if least == most else f"{least} to {most}"
        raise UsageError(f"--metric {text}: {function} takes a connector and {wanted} numbers")
    metric = Metric("", function, connector, numbers)
    return Metric(label or str(metric), function, connector, numbers)
