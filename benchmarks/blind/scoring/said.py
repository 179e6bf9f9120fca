"""What a diagnosis says: `diagnosis.json` of schema 2. What earlier ones said is in `history`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .names import Names, plain

NAN = float("nan")

SURE = 0.5
"""Inclusion probability from which an effect is said."""


@dataclass(frozen=True)
class Part:
    """A part of the budget: of effects that are told together, or what is in no effect (`effects` is empty)."""

    effects: Names
    share: float
    interval: tuple[float, float] | None
    probability: float
    parameters: dict[str, tuple[float, float]] = field(default_factory=dict)
    """95 % intervals by address."""


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, its probability, the RMS that it leaves in noise, and its parameters' values where told."""

    effects: Names
    probability: float
    left: float
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Said:
    """A diagnosis; `failed`: there is none."""

    verdict: str
    probabilities: dict[str, float] = field(default_factory=dict)
    """Inclusion probability of every effect."""
    parts: tuple[Part, ...] = ()
    hypotheses: tuple[Hypothesis, ...] = ()
    calibrated: float = NAN
    """RMS in noise that calibration leaves, and the explanation."""
    left: float = NAN
    reduction: float = NAN
    first_budget: float = NAN
    """Wall time until the first budget (s)."""
    finished: float = NAN
    """Wall time (s)."""
    failed: bool = False

    @property
    def named(self) -> Names:
        """Effects that are said to be in."""
        return tuple(name for name, p in self.probabilities.items() if p >= SURE)

    @property
    def statements(self) -> tuple[Names, ...]:
        """Each effect that is said to be in, and each group that is without any member being so."""
        named = self.named
        groups = (p.effects for p in self.parts if p.effects and p.probability >= SURE)
        return (*((name,) for name in named), *(g for g in groups if not set(g) & set(named)))

    @property
    def unexplained(self) -> float:
        """Share that is in no effect; not a number where there is no budget."""
        if not self.parts or any(p.share != p.share for p in self.parts):
            return NAN
        return sum(p.share for p in self.parts if not p.effects)


FAILED = Said("failed", failed=True)


def said(diagnosis: dict[str, Any] | None) -> Said:
    """From the contents of diagnosis.json, of this schema or an earlier one; None: there is none."""
    if diagnosis is None:
        return FAILED
    if "causes" in diagnosis:
        from .history import said_of_causes

        return said_of_causes(diagnosis)
    budget, timing = diagnosis.get("budget", {}), diagnosis.get("timing", {})
    return Said(
        diagnosis["verdict"],
        {name: float(e["inclusion_probability"]) for name, e in diagnosis.get("effects", {}).items()},
        tuple(_part(p) for p in budget.get("parts", [])),
        tuple(
            Hypothesis(_effects(h), float(h["probability"]), float(h["left"]), values(h))
            for h in diagnosis.get("hypotheses", [])
        ),
        float(budget.get("calibrated", NAN)),
        float(budget.get("explained", NAN)),
        float(diagnosis.get("reduction", {}).get("value", NAN)),
        float(timing.get("first_budget_s", NAN)),
        float(timing.get("wall_s", NAN)),
    )


def _effects(hypothesis: dict[str, Any]) -> Names:
    """The effects of a hypothesis with their channels, which stand in its label alone."""
    ids = tuple(hypothesis["effects"])
    labels = tuple(hypothesis.get("label", "").split(" + "))
    return labels if ids and sorted(plain(label)[0] for label in labels) == sorted(ids) else ids


def values(entry: dict[str, Any]) -> dict[str, float]:
    """Values of an entry's parameters, which are numbers or tables with a value."""
    told = entry.get("parameters", {})
    return {a: float(p["value"] if isinstance(p, dict) else p) for a, p in told.items()}


def _part(entry: dict[str, Any]) -> Part:
    intervals = {}
    for address, p in entry.get("parameters", {}).items():
        if p.get("ci95"):
            intervals[address] = (float(p["ci95"][0]), float(p["ci95"][1]))
    span = entry.get("ci95")
    return Part(
        tuple(entry.get("effects", ())) if entry["kind"] == "effect" else (),
        float(entry["share"]),
        (float(span[0]), float(span[1])) if span else None,
        float(entry.get("inclusion_probability", NAN)),
        intervals,
    )
