"""A case: what is true against what is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..records import Record
from .names import in_group, same_effect
from .said import SURE, Part, Said, said
from .true import UNKNOWN, TrueEffect, Truth

LARGE = 0.10
"""Share, true or said, from which its error counts."""


class Share(NamedTuple):
    """A share of the gap as it is and as it is said."""

    true: float
    said: float


@dataclass(frozen=True)
class Outcome:
    """One case: truth, statement, and what the oracle found (empty: not asked)."""

    case: str
    true: Truth
    said: Said
    oracle: dict[str, Any]

    def meets(self, effect: TrueEffect, names: Sequence[str]) -> bool:
        """Whether one of the names is in the group of a true effect; what the catalogue lacks has no group in it."""
        return self.true.known and any(in_group(effect.name, effect.alike, name) for name in names)

    @property
    def hits(self) -> list[tuple[TrueEffect, bool]]:
        """Effects that are to be found, and whether they are said, up to the group."""
        return [(e, any(self.meets(e, s) for s in self.said.statements)) for e in self.true.wanted]

    @property
    def rights(self) -> list[bool]:
        """Of each statement whether it is right, up to the group; none of what is there but too small to count."""
        made = []
        for statement in self.said.statements:
            met = [e for e in self.true.effects if self.meets(e, statement)]
            if not met or any(self.true.counts(e) for e in met):
                made.append(bool(met))
        return made

    @property
    def exact(self) -> bool:
        """Whether all effects are said and no other is; those too small to count may be said or not."""
        if self.said.failed:
            return False
        if self.true.kind == UNKNOWN:
            return not self.said.statements
        named = self.said.named
        missed = any(not any(same_effect(e.name, n) for n in named) for e in self.true.wanted)
        groups = [s for s in self.said.statements if len(s) > 1]
        false = any(not any(same_effect(e.name, n) for e in self.true.effects) for n in named)
        return not missed and not false and not groups

    @property
    def false_alarm(self) -> bool:
        """Whether an effect is said."""
        return bool(self.said.statements)

    @property
    def unexplained_largest(self) -> bool:
        """Whether what is in no effect is the largest part."""
        others = [p.share for p in self.said.parts if p.effects]
        return self.said.unexplained > max(others, default=0.0)

    @property
    def probabilities(self) -> list[tuple[float, bool]]:
        """Inclusion probability of every effect and whether it is there; effects too small to count are left out."""
        known = self.true.effects if self.true.known else ()
        made = []
        for name, p in self.said.probabilities.items():
            there = [e for e in known if same_effect(e.name, name)]
            if not there or any(self.true.counts(e) for e in there):
                made.append((p, bool(there)))
        unheard = (e for e in self.true.wanted if not any(same_effect(e.name, n) for n in self.said.probabilities))
        return made + [(0.0, True) for _ in unheard] if not self.said.failed else []

    def _clusters(self) -> list[tuple[list[TrueEffect], list[Part]]]:
        """True effects and parts of the budget that cannot be told apart, up to the group, together."""
        made: list[tuple[list[TrueEffect], list[Part]]] = [([e], []) for e in self.true.effects if self.true.known]
        for part in (p for p in self.said.parts if p.effects):
            met = [c for c in made if any(self.meets(e, part.effects) for e in c[0])]
            made = [c for c in made if c not in met]
            made.append(([e for c in met for e in c[0]], [q for c in met for q in c[1]] + [part]))
        return made

    @property
    def shares(self) -> list[Share]:
        """True and said shares of 10 % and more; none without a budget, or where there is no gap."""
        if not self._budgets:
            return []
        made = [Share(sum(e.share or 0.0 for e in es), sum(p.share for p in ps)) for es, ps in self._clusters()]
        made.append(Share(0.0 if self.true.known else 1.0, self.said.unexplained))
        return [s for s in made if max(abs(s.true), abs(s.said)) >= LARGE]

    @property
    def _budgets(self) -> bool:
        known = all(e.share is not None for e in self.true.effects)
        return self.true.visible and known and self.said.unexplained == self.said.unexplained

    @property
    def share_covered(self) -> list[bool]:
        """For every part with an interval that is of one true effect or of several: whether it holds the true share."""
        if not self._budgets:
            return []
        made = []
        for effects, parts in self._clusters():
            if len(parts) == 1 and (span := parts[0].interval):
                true = sum(e.share or 0.0 for e in effects)
                made.append(span[0] - 1e-9 <= true <= span[1] + 1e-9)
        return made

    @property
    def covered(self) -> list[bool]:
        """For every parameter of an effect that is said and there: whether its interval holds the true value."""
        made = []
        for part in (p for p in self.said.parts if p.probability >= SURE):
            for effect in self.true.effects:
                if any(same_effect(effect.name, name) for name in part.effects):
                    spans = ((part.parameters.get(a), v) for a, v in effect.library.items())
                    made += [s[0] - 1e-9 * abs(v) <= v <= s[1] + 1e-9 * abs(v) for s, v in spans if s]
        return made

    @property
    def search_gap(self) -> float | None:
        """What the best hypothesis leaves over what the true one does, both fitted alike by the oracle."""
        if self.oracle.get("true", {}).get("left") and self.oracle.get("said"):
            return float(self.oracle["said"]["left"]) / float(self.oracle["true"]["left"])
        return None


def outcomes(cases: Sequence[Record]) -> list[Outcome]:
    """Outcomes of cases."""
    return [Outcome(case.name, Truth.of(case.answer), said(case.diagnosis), case.oracle or {}) for case in cases]
