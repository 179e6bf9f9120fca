"""Compares diagnoses with the sealed answers.

    python -m benchmarks.blind.score DIR|RECORDS [--json FILE] [--markdown FILE] [--records FILE]

A diagnosis says one thing: "none" or "unknown" by its verdict, else the effects of its first cause. Probabilities are
those of the causes, among them ("none",) and ("unknown",), or those two from a table `probabilities`.
"""

from __future__ import annotations

import argparse
import json
import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from .records import NONE, UNKNOWN, Record, load, merge
from .report import as_markdown, as_text

Names = tuple[str, ...]
FAILED = ("failed",)
VERDICTS = {"no_significant_gap": NONE, "unknown_effect": UNKNOWN}
BINS = ((0.0, 1.0, "0.3-1"), (1.0, 2.0, "1-2"), (2.0, 5.0, "2-5"), (5.0, 10.0, "5-10"), (10.0, float("inf"), ">10"))
CLEAR = 2.0
"""Size from which an effect has to be found, in noise floors."""


def plain(name: str) -> tuple[str, str]:
    """Id and channel of an effect: "sensor_bias(arm.x_h)", "sensor_bias:arm.x_h", "sensor_bias" and the like."""
    match = re.match(r"\s*([A-Za-z_]\w*)\s*(?:[(:@\[ ]\s*([\w.\[\]]+?)\s*[)\]]?\s*)?$", name)
    return (match[1], match[2] or "") if match else (name, "")


def same_effect(true: str, said: str) -> bool:
    """Whether both name the same effect; a channel counts when both name one."""
    (a, channel_a), (b, channel_b) = plain(true), plain(said)
    return a == b and (not channel_a or not channel_b or channel_a == channel_b)


def same(true: Names, said: Names) -> bool:
    """Whether both sets hold the same effects."""
    if len(true) != len(said):
        return False
    return any(all(same_effect(a, b) for a, b in zip(true, order, strict=True)) for order in permutations(said))


@dataclass(frozen=True)
class Truth:
    """What the answer says."""

    kind: str
    names: Names
    alike: tuple[frozenset[str], ...]
    size: float
    library: dict[str, float]

    @classmethod
    def of(cls, answer: dict[str, Any]) -> Truth:
        """From the contents of an answer file."""
        kind = answer["kind"]
        effects = answer["effects"]
        if kind in ("none", "unknown"):
            return cls(kind, (kind,), (), float(answer["size"]), {})
        names = tuple(f"{e['id']}({e['channel']})" if e.get("channel") else e["id"] for e in effects)
        library = {a: v for e in effects for a, v in e["library"].items() if v is not None}
        return cls(kind, names, tuple(frozenset(e["alike"]) for e in effects), float(answer["size"]), library)

    def in_group(self, said: Names) -> bool:
        """Whether each effect that was said is in the ambiguity group of a true one, one to one."""
        if not self.alike or len(said) != len(self.alike):
            return same(self.names, said)
        orders = permutations(plain(s)[0] for s in said)
        return any(all(s in group for s, group in zip(order, self.alike, strict=True)) for order in orders)


def _names(entry: Any) -> Names:
    return (entry,) if isinstance(entry, str) else tuple(entry)


@dataclass(frozen=True)
class Said:
    """What a diagnosis says."""

    names: Names
    others: tuple[Names, ...]
    """Sets of effects that it could not tell apart from these."""
    probabilities: tuple[tuple[Names, float], ...]
    parameters: dict[str, dict[str, Any]]
    reduction: float
    explainable: float
    seconds: float

    @classmethod
    def of(cls, diagnosis: dict[str, Any] | None) -> Said:
        """From the contents of diagnosis.json; None: there is none."""
        if diagnosis is None:
            return cls(FAILED, (), (), {}, float("nan"), float("nan"), float("nan"))
        causes = diagnosis.get("causes", [])
        listed = [(tuple(c["effects"]), float(c["probability"])) for c in causes]
        there = {names for names, _ in listed}
        listed += [((k,), float(p)) for k, p in diagnosis.get("probabilities", {}).items() if (k,) not in there]
        real = [c for c in causes if tuple(c["effects"]) not in (NONE, UNKNOWN)]
        names = VERDICTS.get(diagnosis["verdict"])
        others: tuple[Names, ...] = ()
        parameters: dict[str, dict[str, Any]] = {}
        if names is None:
            names = tuple(real[0]["effects"]) if real else UNKNOWN
            if real:
                others = tuple(_names(entry) for entry in real[0].get("ambiguous_with", []))
                parameters = real[0].get("parameters", {})
        gap = diagnosis.get("gap", {})
        return cls(
            names, others, tuple(listed), parameters,
            float(gap.get("reduction", float("nan"))), float(gap.get("explainable_reduction", float("nan"))),
            float(diagnosis.get("timing", {}).get("wall_s", float("nan"))),
        )  # fmt: skip

    @property
    def top(self) -> tuple[Names, float]:
        """The most probable answer."""
        return max(self.probabilities, key=lambda entry: entry[1], default=(self.names, 0.0))


@dataclass(frozen=True)
class Outcome:
    """One case: truth, statement, and whether it hits."""

    case: str
    true: Truth
    said: Said

    @property
    def exact(self) -> bool:
        """The statement is the truth."""
        return same(self.true.names, self.said.names)

    @property
    def grouped(self) -> bool:
        """The statement is the truth up to the ambiguity group, or to what the diagnosis itself calls ambiguous."""
        called_alike = any(same(self.true.names, other) for other in self.said.others)
        return self.exact or called_alike or self.true.in_group(self.said.names)

    @property
    def partial(self) -> bool:
        """At least one true effect is among those of the statement."""
        return any(same_effect(a, b) for a in self.true.names for b in self.said.names)

    def brier(self) -> float:
        """Sum of squared differences between the probabilities and the truth."""
        p_true = sum(p for names, p in self.said.probabilities if same(self.true.names, names))
        rest = sum(p * p for names, p in self.said.probabilities if not same(self.true.names, names))
        return (1.0 - p_true) ** 2 + rest

    def covered(self) -> list[bool]:
        """For every true parameter value that has an interval: whether it lies within."""
        found = []
        for address, value in self.true.library.items():
            interval = self.said.parameters.get(address, {}).get("ci95")
            if interval:
                slack = 1e-9 * abs(value)
                found.append(interval[0] - slack <= value <= interval[1] + slack)
        return found


def share(values: list[bool]) -> dict[str, Any]:
    """Number of hits, of cases, and their ratio."""
    return {"hits": sum(values), "of": len(values), "share": sum(values) / len(values) if values else None}


def mean(values: list[float]) -> float | None:
    """Mean of those that are numbers."""
    there = [v for v in values if v == v]
    return sum(there) / len(there) if there else None


def calibration_error(pairs: list[tuple[float, bool]], bins: int = 10) -> float | None:
    """Expected calibration error of (probability, hit): mean gap between both, weighted by the bin's number."""
    if not pairs:
        return None
    by_bin: dict[int, list[tuple[float, bool]]] = defaultdict(list)
    for p, hit in pairs:
        by_bin[min(int(p * bins), bins - 1)].append((p, hit))
    total = 0.0
    for members in by_bin.values():
        total += abs(sum(p for p, _ in members) - sum(hit for _, hit in members))
    return total / len(pairs)


def sure_error(probabilities: list[float], draws: int = 2000) -> float | None:
    """Mean calibration error of a tool whose probabilities are right: what so few cases scatter."""
    if not probabilities:
        return None
    lots = np.random.default_rng(0).random((draws, len(probabilities)))
    hits = lots < np.array(probabilities)
    return mean([calibration_error(list(zip(probabilities, row, strict=True))) or 0.0 for row in hits.tolist()])


@dataclass
class Tally:
    """Hits of a group of cases."""

    exact: list[bool] = field(default_factory=list)
    grouped: list[bool] = field(default_factory=list)
    silent: list[bool] = field(default_factory=list)

    def add(self, o: Outcome) -> None:
        """Count a case."""
        self.exact.append(o.exact)
        self.grouped.append(o.grouped)
        self.silent.append(o.said.names == NONE)

    def row(self, head: str) -> dict[str, Any]:
        """Number and shares."""
        n = len(self.exact)
        return {
            "what": head, "cases": n, "exact": sum(self.exact) / n if n else None,
            "group": sum(self.grouped) / n if n else None, "said none": sum(self.silent) / n if n else None,
        }  # fmt: skip


def score(outcomes: list[Outcome], ids: dict[str, Names] | None = None) -> dict[str, Any]:
    """All scores. `ids`: names of the effects by case, for the table by effect of cases outside the catalogue."""
    ids = ids or {}
    known = [o for o in outcomes if o.true.kind in ("single", "pair")]
    clear = [o for o in known if o.true.size >= CLEAR]
    pairs = [o for o in known if o.true.kind == "pair"]
    none = [o for o in outcomes if o.true.kind == "none"]
    unknown = [o for o in outcomes if o.true.kind == "unknown"]
    answered = [o for o in outcomes if o.said.names != FAILED]
    covered = [hit for o in known if o.exact for hit in o.covered()]
    bins, effects = {name: Tally() for _, _, name in BINS}, defaultdict(Tally)
    for o in outcomes:
        if o.true.kind != "none":
            bins[next(name for low, high, name in BINS if low <= o.true.size < high)].add(o)
        for name in ids.get(o.case, o.true.names):
            effects[plain(name)[0]].add(o)
    confusions = Counter(
        (" + ".join(ids.get(o.case, o.true.names)), " + ".join(o.said.names)) for o in outcomes if not o.exact
    )
    seconds = sorted(o.said.seconds for o in answered if o.said.seconds == o.said.seconds)
    return {
        "cases": len(outcomes),
        "failed": len(outcomes) - len(answered),
        "all_exact": share([o.exact for o in outcomes]),
        "exact_top1": share([o.exact for o in known]),
        "group_top1": share([o.grouped for o in known]),
        "exact_top1_clear": share([o.exact for o in clear]),
        "group_top1_clear": share([o.grouped for o in clear]),
        "single_exact": share([o.exact for o in known if o.true.kind == "single"]),
        "pair_exact": share([o.exact for o in pairs]),
        "pair_partial": share([o.partial for o in pairs]),
        "false_alarms": share([o.said.names not in (NONE, FAILED) for o in none]),
        "unknown_recall": share([o.said.names == UNKNOWN for o in unknown]),
        "unknown_recall_clear": share([o.said.names == UNKNOWN for o in unknown if o.true.size >= CLEAR]),
        "unknown_false": share([o.said.names == UNKNOWN for o in outcomes if o.true.kind != "unknown"]),
        "brier": mean([o.brier() for o in answered]),
        "calibration_error": calibration_error([(o.said.top[1], same(o.true.names, o.said.top[0])) for o in answered]),
        "calibration_error_sure": sure_error([o.said.top[1] for o in answered]),
        "said_top": mean([o.said.top[1] for o in answered]),
        "right_top": mean([float(same(o.true.names, o.said.top[0])) for o in answered]),
        "calibration_error_group": calibration_error(
            [(o.said.top[1], same(o.true.names, o.said.top[0]) or o.true.in_group(o.said.top[0])) for o in answered]
        ),
        "coverage": share(covered),
        "reduction": mean([o.said.reduction for o in known]),
        "explainable_reduction": mean([o.said.explainable for o in known]),
        "wall_s": {"mean": mean(seconds), "median": seconds[len(seconds) // 2] if seconds else None,
                   "most": seconds[-1] if seconds else None},
        "by_size": [bins[name].row(name) for _, _, name in BINS],
        "by_effect": [effects[name].row(name) for name in sorted(effects)],
        "confusions": [{"true": a, "said": b, "cases": n} for (a, b), n in confusions.most_common()],
    }  # fmt: skip


def outcomes_of(cases: Sequence[Record]) -> tuple[list[Outcome], dict[str, Names]]:
    """Outcomes of cases, and the true names of the effects by case where the catalogue does not have them."""
    outcomes = [Outcome(case.name, Truth.of(case.answer), Said.of(case.diagnosis)) for case in cases]
    strange = (case for case in cases if case.answer["kind"] == "unknown")
    return outcomes, {case.name: tuple(f"[{e['id']}]" for e in case.answer["effects"]) for case in strange}


def as_csv(outcomes: list[Outcome], ids: dict[str, Names]) -> str:
    """Truth and statement of every case."""
    lines = ["case,kind,true,size,said,probability,p_true,right,group,reduction,wall_s"]
    for o in outcomes:
        p_true = sum(p for names, p in o.said.probabilities if same(o.true.names, names))
        true, said = " + ".join(ids.get(o.case, o.true.names)), " + ".join(o.said.names)
        lines.append(
            f"{o.case},{o.true.kind},{true},{o.true.size:.2f},{said},{o.said.top[1]:.3f},{p_true:.3f},"
            f"{int(o.exact)},{int(o.grouped)},{o.said.reduction:.3f},{o.said.seconds:.0f}"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.score", description="Scores diagnoses against the answers.")
    p.add_argument("place", type=Path, help="folder of the cases, or a file of records")
    p.add_argument("--diagnoses", type=Path, help="folder of the diagnoses (default: FOLDER/diagnoses)")
    p.add_argument("--json", type=Path, help="write the scores there")
    p.add_argument("--markdown", type=Path, help="write them as Markdown")
    p.add_argument("--csv", type=Path, help="write a row per case there")
    p.add_argument("--records", type=Path, help="put the cases into this file of records, which may exist")
    p.add_argument("--recalibrated", action="store_true", help="with the probabilities of today's calibration")
    p.add_argument("--without", metavar="CASE", nargs="+", default=[], help="leave these cases out")
    p.add_argument("--since", metavar="CASE", default="", help="only this case and those after it")
    p.add_argument("--count-missing", action="store_true", help="a case not yet diagnosed counts as failed")
    options = p.parse_args()
    cases = load(options.place, options.diagnoses, options.count_missing)
    if not cases:
        p.error(f"{options.diagnoses or options.place}: holds no diagnoses")
    if options.records:
        merge(options.records, cases)
    cases = [case for case in cases if case.name >= options.since and case.name not in options.without]
    if options.recalibrated:
        from .calibrate import recalibrated

        cases = [recalibrated(case) for case in cases]
    outcomes, ids = outcomes_of(cases)
    result = score(outcomes, ids)
    print(as_text(result))
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if options.markdown:
        options.markdown.write_text(as_markdown(result), encoding="utf-8")
    if options.csv:
        options.csv.write_text(as_csv(outcomes, ids), encoding="utf-8")


if __name__ == "__main__":
    main()
