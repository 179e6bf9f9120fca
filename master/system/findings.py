"""What there is to say of a package: the first error ends a run, a check keeps them all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ParamSpec, TypeVar

from ...core.errors import CosimError, PackageError

P = ParamSpec("P")
T = TypeVar("T")


@dataclass
class Findings:
    """What was found: errors keep a package from running, warnings do not, notes are worth knowing."""

    keeps: bool = False
    """Whether errors are kept; else they are raised."""
    errors: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def kept(self) -> list[str] | None:
        """Where to put errors; None: raise them."""
        return self.errors if self.keeps else None

    def refuse(self, told: str) -> None:
        """Something is wrong with the package."""
        if not self.keeps:
            raise PackageError(told)
        self.errors.append(told)

    def attempt(self, make: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T | None:
        """What `make` gives for these arguments; None where it raises a `CosimError` that is kept."""
        try:
            return make(*arguments, **named)
        except CosimError as error:
            if not self.keeps:
                raise
            self.errors.append(str(error))
            return None

    def unless(self, errors: bool) -> Findings:
        """These findings, or where there are errors from which others may follow, some that nobody reads."""
        return Findings(keeps=True) if errors else self

    def lines(self) -> list[str]:
        """All of it, a finding a line, the errors first."""
        made = []
        for kind, texts in (("error", self.errors), ("warning", self.warnings), ("note", self.notes)):
            made += [f"{kind}: {text}" for text in dict.fromkeys(texts)]
        return made
