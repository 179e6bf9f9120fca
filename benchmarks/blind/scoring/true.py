"""What is true of a case: its effects with their shares of the gap."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

LEAST_SHARE = 0.10
"""True share from which an effect is to be found; below, it counts neither as missed nor as false."""

LEAST_GAP = 1.1
"""Times the noise that an effect's part of the gap has to be to count, noise included."""

UNKNOWN = "unknown"
"""Kind of the cases whose effect the catalogue does not have."""


@dataclass(frozen=True)
class TrueEffect:
    """An effect at work: name with its channel, ids that are alike, share of what a refit leaves (None: not known), its
    size alone in noise, another form than the plain one, and the library's parameters that mean exactly the same."""

    name: str
    alike: frozenset[str]
    share: float | None
    size: float
    form: str
    library: dict[str, float]


@dataclass(frozen=True)
class Truth:
    """What an answer says; `left` is the RMS, in noise, that a refit of the base parameters leaves without noise."""

    kind: str
    effects: tuple[TrueEffect, ...]
    size: float
    left: float | None
    swinging: bool = False
    """Whether the machine swings by itself, where `benchmarks.blind.swinging` has looked."""

    @classmethod
    def of(cls, answer: dict[str, Any]) -> Truth:
        """From the contents of an answer file, with its budget where it has one, else as far as sizes tell it."""
        entries = answer["effects"]
        shares, left = _budget(answer)
        effects = tuple(_effect(e, s, answer) for e, s in zip(entries, shares, strict=True))
        return cls(answer["kind"], effects, float(answer["size"]), left, bool(answer.get("swinging")))

    @property
    def known(self) -> bool:
        """Whether its effects are of the catalogue."""
        return self.kind not in ("none", UNKNOWN)

    @property
    def visible(self) -> bool:
        """Whether there is a gap beyond a refit."""
        left = self.size if self.left is None else self.left
        return bool(self.effects) and sqrt(1.0 + left**2) >= LEAST_GAP

    def counts(self, effect: TrueEffect) -> bool:
        """Whether an effect is to be found: its share and what it leaves are large enough."""
        if effect.share is None or self.left is None:
            return sqrt(1.0 + effect.size**2) >= LEAST_GAP
        part = max(effect.share, 0.0) * self.left**2
        return effect.share >= LEAST_SHARE and sqrt(1.0 + part) >= LEAST_GAP

    @property
    def wanted(self) -> tuple[TrueEffect, ...]:
        """Effects of the catalogue that are to be found."""
        return tuple(e for e in self.effects if self.known and self.counts(e))


def _budget(answer: dict[str, Any]) -> tuple[list[float | None], float | None]:
    """Each effect's share, and what a refit leaves without noise; None where it is not known.

    Without a true budget the sizes beyond base parameters and sensors' own biases stand for it, as if no effect had to
    do with another: in a case made with `--linear`.
    """
    entries, budget = answer["effects"], answer.get("budget")
    if budget:
        shares = [min(max(s, 0.0), 1.0) for s in budget["shares"]]  # of old records: `truth.shapley` keeps to that
        return shares, sqrt(max(budget["calibrated"] ** 2 - 1.0, 0.0))
    if len(entries) < 2:
        return [1.0] * len(entries), float(answer["size"])
    if all("size_net" in e for e in entries):
        squares = [float(e["size_net"]) ** 2 for e in entries]
        return [s / max(sum(squares), 1e-300) for s in squares], sqrt(sum(squares))
    return [None] * len(entries), None


def _effect(entry: dict[str, Any], share: float | None, answer: dict[str, Any]) -> TrueEffect:
    channel = entry.get("channel")
    library = {a: float(v) for a, v in entry.get("library", {}).items() if v is not None}
    return TrueEffect(
        f"{entry['id']}({channel})" if channel else entry["id"], frozenset(entry["alike"]), share,
        float(entry.get("size", answer["size"])), entry.get("form", ""), library,
    )  # fmt: skip
