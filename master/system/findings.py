"""What there is to say of a package: the first error ends a run, a check collects them all."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ParamSpec, TypeVar

from ...core.errors import CosimError, PackageError, first_few

P = ParamSpec("P")
T = TypeVar("T")

PLACE = re.compile(r"(.*?, line \d+): (.*)", re.DOTALL)
WHOSE = re.compile(r"^(component '[^']*'|'[^']*' -> '[^']*')")
"""What a text begins with where it says of whom it is; what one file lacks, all components of that file do."""

MAX_PLACES = 5
"""Places that are named of one error."""


@dataclass
class Findings:
    """Errors, warnings and notes on a package; errors keep it from running, warnings do not."""

    collects: bool = False
    """Whether errors are collected; else they are raised."""
    errors: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def collected(self) -> list[str] | None:
        """Where to put errors; None: raise them."""
        return self.errors if self.collects else None

    def refuse(self, text: str) -> None:
        """Something is wrong with the package."""
        if not self.collects:
            raise PackageError(text)
        self.errors.append(text)

    def attempt(self, make: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T | None:
        """What `make` gives for these arguments; None where it raises a `CosimError` that is collected."""
        try:
            return make(*arguments, **named)
        except CosimError as error:
            if not self.collects:
                raise
            self.errors.append(str(error))
            return None

    def muted_if(self, condition: bool) -> Findings:
        """These findings; or, where `condition` holds, findings that are thrown away, for they would only follow from
        errors already told."""
        return Findings(collects=True) if condition else self

    def tell_once(self) -> None:
        """Errors that say the same of several places become one, with the other places behind it."""
        places: dict[str, dict[str, None]] = {}
        first: dict[str, str] = {}
        for error in self.errors:
            place, text = _parted(error)
            cause = WHOSE.sub("", text)
            first.setdefault(cause, error)
            places.setdefault(cause, {})[place] = None
        self.errors[:] = [first[cause] + _also(list(others)) for cause, others in places.items()]

    def lines(self) -> list[str]:
        """All of it, a finding a line, the errors first."""
        lines = []
        for kind, texts in (("error", self.errors), ("warning", self.warnings), ("note", self.notes)):
            lines += [f"{kind}: {text}" for text in dict.fromkeys(texts)]
        return lines


def _parted(error: str) -> tuple[str, str]:
    """(place, text) of an error; no place where it begins with none."""
    match = PLACE.fullmatch(error)
    return (match[1], match[2]) if match else ("", error)


def _also(places: list[str]) -> str:
    """The places after the first, those of its file by their lines alone."""
    if len(places) < 2:
        return ""
    file = places[0].rpartition(", ")[0]
    shown = [p.removeprefix(f"{file}, ") for p in places[1:]]
    return f" (also {first_few(shown, MAX_PLACES)})"
