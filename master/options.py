"""What a run may be told, from Python or the command line: one place for types and names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..core.errors import UsageError, did_you_mean
from ..core.plain_numbers import plain_number, plain_whole


@dataclass(frozen=True)
class Options:
    """Options of a run. `changes` are (address, value) pairs, address = component.parameter or parameter."""

    step: float | None = None
    stop_time: float | None = None
    method: str | None = None
    """The coupling; None: what the package suggests, else the first of all."""
    changes: tuple[tuple[str, str], ...] = ()
    parameters: tuple[Path, ...] = ()
    """Parameter sets (.ssv) on top of the package's; `changes` win over them."""
    variant: str | None = None
    stimuli: Path | None = None
    record: tuple[str, ...] = ()
    """Patterns of columns to keep; all if there is none."""
    plot: tuple[str, ...] = ()
    """Patterns of columns that will be drawn, looked at before the run."""
    record_every: int = 1
    results: str = "results.csv"
    """Name of the result file; its suffix says the format. Empty: no file."""
    log: str = ""
    """Name of a file for all that FMUs say, in the result folder. Empty: no file."""
    log_level: str | None = None
    """What is written there: error, warning, info, debug; None: info."""
    log_categories: tuple[str, ...] = ()
    """Categories of FMUs whose notes are written; all if there is none."""
    substeps: tuple[tuple[str, int], ...] = ()
    """(component, steps of its own in a macro step)."""
    realtime: bool = False
    isolate: bool = False
    """Each FMU in a process of its own."""
    sandbox: bool = False
    """So, and an FMU may write into its own folders only, and use no network."""
    parallel: bool = False
    """FMUs that do not depend on each other within a step take it side by side, in threads, and those that run in
    Python in processes."""
    step_timeout: float | None = None
    """Longest time that an isolated FMU may take for a step [s]."""
    check_step: bool = False
    """Run again with half the step and estimate the error of every signal."""
    save_state: bool = False
    """Leave the state at the end, or where the run was asked to end, in the result folder: a run may go on from it."""
    save_state_every: float | None = None
    """Save it also whenever so much time has been simulated [s]."""
    resume: Path | None = None
    """A saved state, or the result folder that holds one, to go on from."""
    record_parameters: tuple[str, ...] = ()
    """Patterns of parameters that become columns of the results."""

    @property
    def saves(self) -> bool:
        """Whether the run may be gone on with."""
        return self.save_state or self.save_state_every is not None

    def __post_init__(self) -> None:
        """Every option in its type, or a `UsageError` that names it."""
        convert: dict[str, Callable[[str, Any], Any]] = {
            "step": as_time, "stop_time": as_time, "step_timeout": _timeout, "method": as_text, "changes": _changes,
            "save_state": _switch, "save_state_every": _timeout, "resume": as_path, "record_parameters": as_texts,
            "parameters": _paths, "variant": as_text, "stimuli": as_path, "record": as_texts, "plot": as_texts,
            "record_every": _count, "results": _file_name, "log": _file_name, "log_level": as_text,
            "log_categories": as_texts, "substeps": _substeps, "realtime": _switch,
            "isolate": _switch, "sandbox": _switch, "parallel": _switch, "check_step": _switch,
        }  # fmt: skip
        for f in fields(self):
            value = getattr(self, f.name)
            if value is not None or f.default is not None:
                object.__setattr__(self, f.name, convert[f.name](f.name, value))
        if self.sandbox:
            object.__setattr__(self, "isolate", True)


def options_of(values: Mapping[str, Any]) -> Options:
    """Options by their names."""
    names = [f.name for f in fields(Options)]
    for name in values:
        if name not in names:
            raise UsageError(f"there is no option '{name}'{did_you_mean(name, names)}")
    return Options(**values)


def parse_change(text: str) -> tuple[str, str]:
    """'component.parameter=value' as (address, value)."""
    address, equals, value = text.partition("=")
    if not equals or not address.strip() or not value.strip():
        raise UsageError(f"--set {text}: expected component.parameter=value, e.g. --set arm.load_weight=1000")
    return address.strip(), value.strip()


def _wrong(name: str, value: object, expected: str) -> NoReturn:
    raise UsageError(f"{name}: {value!r} is no {expected}") from None


def as_time(name: str, value: Any) -> float:
    """A time, or a `UsageError` that names what it is for."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        return plain_number(value) if isinstance(value, str) else float(value)
    except (TypeError, ValueError, OverflowError):
        _wrong(name, value, "number")


def _timeout(name: str, value: Any) -> float:
    time = as_time(name, value)
    return time if time > 0.0 else _wrong(name, value, "time above 0")


def _count(name: str, value: Any) -> int:
    try:
        number = plain_whole(value) if isinstance(value, str) else int(value)
        if isinstance(value, (bool, np.bool_)) or (not isinstance(value, str) and number != value):
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        _wrong(name, value, "whole number")
    return number


def _switch(name: str, value: Any) -> bool:
    if isinstance(value, (bool, np.bool_)) or (isinstance(value, (int, np.integer)) and value in (0, 1)):
        return bool(value)
    _wrong(name, value, "boolean")


def as_text(name: str, value: Any) -> str:
    """A text, or a `UsageError` that names what it is for."""
    return value if isinstance(value, str) else _wrong(name, value, "text")


def as_texts(name: str, value: Any) -> tuple[str, ...]:
    """Texts, or a `UsageError` that names what they are for."""
    return tuple(as_text(name, item) for item in _items(name, value))


def _items(name: str, value: Any) -> list[Any]:
    """One thing stands for a list of one."""
    if isinstance(value, (str, Path)):
        return [value]
    try:
        return list(value.items() if isinstance(value, Mapping) else value)
    except TypeError:
        _wrong(name, value, "list")


def as_path(name: str, value: Any) -> Path:
    """A path, or a `UsageError` that names what it is for."""
    if not isinstance(value, (str, Path)) or "\0" in str(value):
        _wrong(name, value, "path")
    return Path(value)


def _paths(name: str, value: Any) -> tuple[Path, ...]:
    return tuple(as_path(name, item) for item in _items(name, value))


def _file_name(name: str, value: Any) -> str:
    return str(as_path(name, value)) if value else ""


def _pair(name: str, item: Any, example: str) -> tuple[str, Any]:
    """A pair of a name and what it stands for; 'name=value' is one too."""
    pair = item.rpartition("=")[::2] if isinstance(item, str) else item
    if not isinstance(pair, (tuple, list)) or len(pair) != 2 or not isinstance(pair[0], str) or not pair[0]:
        _wrong(name, item, f"pair, e.g. {example}")
    return pair[0], pair[1]


def _substeps(name: str, value: Any) -> tuple[tuple[str, int], ...]:
    pairs = (_pair(name, item, "{'arm': 4}") for item in _items(name, value))
    return tuple((component, _count(f"{name} of {component}", n)) for component, n in pairs)


def _changes(name: str, value: Any) -> tuple[tuple[str, str], ...]:
    changes = []
    for item in _items(name, value):
        if isinstance(item, str):
            changes.append(parse_change(item))
            continue
        address, content = _pair(name, item, "{'arm.load_weight': 1000}")
        many = isinstance(content, (list, tuple, np.ndarray))
        changes.append((address, " ".join(map(str, np.ravel(content).tolist() if many else [content]))))
    return tuple(changes)
