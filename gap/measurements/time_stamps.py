"""Time stamps: dates with times as ISO 8601 writes them, day.month.year with a time, and clock times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from itertools import pairwise

import numpy as np

from .table import FloatArray, TimeStamp

DAY = timedelta(days=1)

_CLOCK = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d)(?:[.,](\d{1,9}))?", re.ASCII)
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d{1,9})?)?(Z|[+-]\d\d:?\d\d)?", re.ASCII)
_DOTTED = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[T ]+(.+)", re.ASCII)


def parse_time_stamp(text: str) -> TimeStamp | None:
    """The moment that a text names, or None where it is no time stamp."""
    text = text.strip()
    if (clock := _clock(text)) is not None:
        return clock
    try:
        if _ISO.fullmatch(text):
            return datetime.fromisoformat(text.replace(",", "."))
        if match := _DOTTED.fullmatch(text):
            of_day = _clock(match[4].strip())
            day = datetime(int(match[3]), int(match[2]), int(match[1]))
            return None if of_day is None else day + of_day
    except ValueError:  # a thirteenth month
        return None
    return None


def _clock(text: str) -> timedelta | None:
    match = _CLOCK.fullmatch(text)
    if match is None or int(match[1]) > 23:
        return None
    hours, minutes, seconds = (int(match[i]) for i in (1, 2, 3))
    microseconds = float(f"0.{match[4]}") * 1e6 if match[4] else 0.0
    return timedelta(hours=hours, minutes=minutes, seconds=seconds, microseconds=microseconds)


def from_toml(value: object) -> TimeStamp | None:
    """The moment of a TOML value: a date-time, a time, or a text of them; None for anything else."""
    if isinstance(value, datetime):
        return value
    if isinstance(value, time):
        return datetime.combine(date.min, value) - datetime.min
    return parse_time_stamp(value) if isinstance(value, str) else None


def comparable(a: TimeStamp, b: TimeStamp) -> bool:
    """Whether the time between two stamps is known: both with a date, and both or none with a time zone."""
    if isinstance(a, datetime) and isinstance(b, datetime):
        return (a.utcoffset() is None) == (b.utcoffset() is None)
    return isinstance(a, timedelta) and isinstance(b, timedelta)


def seconds_between(first: TimeStamp, second: TimeStamp) -> float:
    """Time from the first to the second stamp [s], which have to be `comparable`.

    A clock time that is more than half a day earlier is of the next day.
    """
    if isinstance(first, datetime) and isinstance(second, datetime):
        return (second - first).total_seconds()
    assert isinstance(first, timedelta)
    assert isinstance(second, timedelta)
    elapsed = second - first
    return (elapsed + DAY if elapsed < -DAY / 2 else elapsed).total_seconds()


def seconds_since_first(stamps: Sequence[TimeStamp]) -> FloatArray:
    """Times [s] of stamps (n,) since the first of them; a clock that steps back by half a day has passed midnight."""
    if isinstance(stamps[0], datetime):
        return np.array([seconds_between(stamps[0], stamp) for stamp in stamps])
    steps = [seconds_between(a, b) for a, b in pairwise(stamps)]
    return np.concatenate([[0.0], np.cumsum(np.round(np.array(steps) * 1e6))]) / 1e6
