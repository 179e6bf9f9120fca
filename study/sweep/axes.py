"""What a sweep varies: `NAME=1,2,3`, `NAME=start:stop:step`, or `NAME=low:high` for a sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import floor, isfinite
from typing import Any

from ...core.errors import UsageError
from ...core.plain_numbers import plain_number, plain_whole
from ...core.repeated import repeated
from ...master.system.number_with_unit import NUMBER_AND_UNIT

MOST = 100_000
"""Cases that a sweep has at most."""


@dataclass(frozen=True)
class Axis:
    """A parameter and its values; or, for a sample, its range."""

    name: str
    values: tuple[Any, ...] = ()
    low: float = 0.0
    high: float = 0.0
    texts: tuple[str, ...] = ()
    """The values as they were written, where they are a list: `settled` takes them for what the parameter is."""
    ends: tuple[str, ...] = ()
    """Low and high as they were written, where they have a unit; `settled` takes them for what the parameter is."""

    @property
    def is_range(self) -> bool:
        """Whether values are to be drawn from low to high."""
        return not self.values


def parse_axis(text: str) -> Axis:
    """The axis of `--vary text`; raises `UsageError`."""
    name, equals, what = (part.strip() for part in text.partition("="))
    if not equals or not name or not what:
        raise UsageError(f"--vary {text}: expected NAME=1,2,3 or NAME=start:stop:step or, with --sample, NAME=low:high")
    if _is_range(what):
        return _written_range(text, name, [part.strip() for part in what.split(":")])
    texts = tuple(v.strip() for v in what.split(","))
    if "" in texts:
        raise UsageError(f"--vary {text}: an empty value between commas")
    values = tuple(_value(v) for v in texts)
    if len({(isinstance(v, bool), v) for v in values}) < len(values):  # 1 and 1.0 are the same, true is not
        raise UsageError(f"--vary {text}: a value is there twice")
    return Axis(name, values, texts=texts)


def settled(axis: Axis, value_of: Callable[[str, str], Any]) -> Axis:
    """The axis with the values of its list as what the parameter is; value_of(name, text) says that, and raises."""
    if axis.ends:
        low, high = (value_of(axis.name, end) for end in axis.ends)
        return _range(f"{axis.name}={':'.join(axis.ends)}", axis.name, [low, high])
    if not axis.texts:
        return axis
    values = tuple(value_of(axis.name, text) for text in axis.texts)
    if len(set(values)) < len(values):
        raise UsageError(f"--vary {axis.name}={','.join(axis.texts)}: a value is there twice")
    return replace(axis, values=tuple(map(_shown, axis.texts, values)))


def _shown(text: str, value: Any) -> Any:
    """The value as the table has it: an item of an enumeration, which is a whole number, by its name."""
    named = isinstance(value, int) and not isinstance(value, bool) and isinstance(_value(text), str)
    return text if named else value


def _is_range(what: str) -> bool:
    """Whether it is start:stop:step or low:high, and not a text with a colon in it."""
    if ":" not in what:
        return False
    first = what.partition(":")[0].strip()
    return first == "" or _is_number(first) or NUMBER_AND_UNIT.fullmatch(first) is not None


def _is_number(text: str) -> bool:
    try:
        plain_number(text)
    except ValueError:
        return False
    return True


def _written_range(text: str, name: str, parts: list[str]) -> Axis:
    """A range whose parts may have a unit: the one behind the last is that of all."""
    last = NUMBER_AND_UNIT.fullmatch(parts[-1])
    unit = last[2] if last is not None else ""
    numbers = [part.removesuffix(unit) for part in parts]
    if not all(map(_is_number, numbers)):
        raise UsageError(f"--vary {text}: '{':'.join(parts)}' has to be made of numbers, in one unit or in none")
    found = _range(text, name, [plain_number(n) for n in numbers])
    if not unit:
        return found
    if found.is_range:
        return replace(found, ends=(f"{found.low!r}{unit}", f"{found.high!r}{unit}"))
    return replace(found, texts=tuple(f"{value:.12g}{unit}" for value in found.values))


def _range(text: str, name: str, numbers: Sequence[float]) -> Axis:
    if len(numbers) not in (2, 3) or not all(map(isfinite, numbers)):
        raise UsageError(f"--vary {text}: expected start:stop:step or low:high")
    low, high = numbers[:2]
    if high <= low:
        raise UsageError(f"--vary {text}: {high:g} is not above {low:g}")
    if len(numbers) == 2:
        return Axis(name, (), low, high)
    step = numbers[2]
    if step <= 0.0 or (high - low) / step > MOST:
        raise UsageError(f"--vary {text}: a step of {step:g} makes no sense here")
    count = floor((high - low) / step + 1e-9) + 1
    return Axis(name, tuple(_plain(low + k * step) for k in range(count)))


def _plain(value: float) -> float:
    """The value without the last digits of a sum."""
    return float(f"{value:.12g}")


def _value(text: str) -> Any:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (plain_whole, plain_number):
        try:
            value = kind(text)
        except ValueError:
            continue
        if not isfinite(value):
            return text
        return value
    return text


def check_names(axes: Sequence[Axis]) -> None:
    """Raise `UsageError` when a name is there twice, or there is none."""
    if not axes:
        raise UsageError("nothing to vary: give --vary NAME=...")
    names = [a.name for a in axes]
    twice = repeated(names)
    if twice:
        raise UsageError(f"--vary {twice}: it is there twice")
