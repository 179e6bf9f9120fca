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
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...core.errors import UsageError, did_you_mean


def _integral(t: np.ndarray, x: np.ndarray) -> float:
    return float(np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(t)))


def _mean(t: np.ndarray, x: np.ndarray) -> float:
    return _integral(t, x) / float(t[-1] - t[0])


def _at(t: np.ndarray, x: np.ndarray, when: float) -> float | None:
    return float(np.interp(when, t, x)) if t[0] <= when <= t[-1] else None


def reaches(t: np.ndarray, x: np.ndarray, target: float, within: float, after: float = 0.0) -> float | None:
    """Time [s] from `after` until x (n,) at t (n,) is within `within` of `target` for the first time; None if never."""
    after = max(after, float(t[0]))
    t, x = _from(t, x, after)
    far = x - target
    passed = np.append(False, far[1:] * far[:-1] < 0.0)  # between two points, if not at one
    arrived = np.flatnonzero((np.abs(far) <= within) | passed)
    if not len(arrived):
        return None
    k = int(arrived[0])
    return 0.0 if k == 0 else _enters(t, far, within, k - 1) - after


def _settles(
    t: np.ndarray, x: np.ndarray, target: float, within: float, after: float = 0.0, until: float = np.inf
) -> float | None:
    after = max(after, float(t[0]))
    if until < after:
        return None
    if until < t[-1]:  # which need not be a sample's time either
        t, x = np.append(t[t < until], until), np.append(x[t < until], np.interp(until, t, x))
    t, x = _from(t, x, after)
    if not len(t):
        return None
    far = x - target
    outside = np.flatnonzero(np.abs(far) > within)
    if not len(outside):
        return 0.0
    k = int(outside[-1])
    return None if k == len(t) - 1 else _enters(t, far, within, k) - after


def _from(t: np.ndarray, x: np.ndarray, after: float) -> tuple[np.ndarray, np.ndarray]:
    """The signal from a time on, which need not be that of a sample."""
    if not len(t) or after <= t[0]:
        return t, x
    start = int(np.searchsorted(t, after))
    if start == len(t) or t[start] == after:
        return t[start:], x[start:]
    return np.append(after, t[start:]), np.append(np.interp(after, t, x), x[start:])


def _enters(t: np.ndarray, far: np.ndarray, within: float, k: int) -> float:
    """When the straight line from sample k, which is more than `within` from 0, to the next one has come that near."""
    edge = np.copysign(within, far[k])
    return float(t[k] + (t[k + 1] - t[k]) * (far[k] - edge) / (far[k] - far[k + 1]))


def _above(t: np.ndarray, x: np.ndarray, level: float) -> float:
    """Straight lines between samples."""
    a, b = x[:-1] - level, x[1:] - level
    share = np.where((a > 0) & (b > 0), 1.0, 0.0)
    crossing = (a > 0) != (b > 0)
    share[crossing] = np.maximum(a, b)[crossing] / np.abs(b - a)[crossing]
    return float(np.sum(share * np.diff(t)))


FUNCTIONS: Mapping[str, tuple[Callable[..., float | None], int, int]] = {
    "initial": (lambda t, x: float(x[0]), 0, 0),
    "final": (lambda t, x: float(x[-1]), 0, 0),
    "min": (lambda t, x: float(x.min()), 0, 0),
    "max": (lambda t, x: float(x.max()), 0, 0),
    "mean": (_mean, 0, 0),
    "rms": (lambda t, x: _mean(t, x * x) ** 0.5, 0, 0),
    "range": (lambda t, x: float(np.ptp(x)), 0, 0),
    "integral": (_integral, 0, 0),
    "at": (_at, 1, 1),
    "reaches": (reaches, 2, 3),
    "settles": (_settles, 2, 4),
    "above": (_above, 1, 1),
}
"""Function, least and most numbers after the connector."""


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
        numbers = tuple(float(part) for part in rest)
    except ValueError:
        raise UsageError(f"--metric {text}: after the connector come numbers") from None
    if not connector or not least <= len(numbers) <= most or not np.isfinite(numbers).all():
        wanted = f"{least}" if least == most else f"{least} to {most}"
        raise UsageError(f"--metric {text}: {function} takes a connector and {wanted} numbers")
    metric = Metric("", function, connector, numbers)
    return Metric(label or str(metric), function, connector, numbers)
