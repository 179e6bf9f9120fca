"""Three simple ways to name effects, for comparison, from what a diagnosis has computed anyway.

    python -m benchmarks.blind.baselines DIR|RECORDS [--diagnoses FOLDER] [--markdown FILE]

* refit: base parameters are to blame for everything; no effect is ever named.
* probable: the effect with the greatest inclusion probability, alone, if calibration leaves more than 1.1 noises.
* least left: the single effect whose hypothesis leaves least, or none if that gains less than 10 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from .records import Record, load
from .scoring.names import Names
from .scoring.outcome import Outcome, outcomes
from .scoring.said import Said
from .scoring.table import score

ABOVE = 1.1
"""RMS that calibration leaves, in noise, from which something is named."""

GAIN = 0.9
"""Share of what calibration leaves that the least may be to be named."""


def refit(o: Outcome) -> Names:
    """Never an effect."""
    return ()


def probable(o: Outcome) -> Names:
    """The most probable effect."""
    if not o.said.probabilities or not o.said.calibrated > ABOVE:
        return ()
    return (max(o.said.probabilities, key=lambda name: o.said.probabilities[name]),)


def least_left(o: Outcome) -> Names:
    """The single effect that leaves least."""
    singles = [h for h in o.said.hypotheses if len(h.effects) == 1 and h.left == h.left]
    best = min(singles, key=lambda h: h.left, default=None)
    return best.effects if best and best.left < GAIN * o.said.calibrated else ()


BASELINES: dict[str, Callable[[Outcome], Names]] = {
    "refit of base parameters": refit,
    "most probable effect": probable,
    "least left, single effects": least_left,
}


def stated(cases: Sequence[Record], name: str) -> list[Outcome]:
    """What a baseline says of every diagnosed case; its probability is 1."""
    made = []
    for o in outcomes([case for case in cases if case.diagnosis is not None]):
        said = Said("baseline", dict.fromkeys(BASELINES[name](o), 1.0))
        made.append(Outcome(o.case, o.true, said, {}))
    return made


KEYS = ("false_alarms", "recall", "precision", "exact_single", "exact_several")


def table(cases: Sequence[Record]) -> list[list[str]]:
    """Head and a row per baseline."""
    rows = [["baseline", "false alarms", "recall", "precision", "exact, one", "exact, several"]]
    for name in BASELINES:
        result = score(stated(cases, name))
        shares = [result[key]["share"] for key in KEYS]
        rows.append([name, *("-" if s is None else f"{s:.0%}" for s in shares)])
    return rows


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.baselines", description="Scores three simple baselines.")
    p.add_argument("place", type=Path, help="folder of the cases, or a file of records")
    p.add_argument("--diagnoses", type=Path)
    p.add_argument("--markdown", type=Path)
    options = p.parse_args()
    rows = table(load(options.place, options.diagnoses))
    for row in rows:
        print(f"{row[0]:<28}" + "".join(f"{cell:>18}" for cell in row[1:]))
    if options.markdown:
        lines = [" | ".join(row) for row in rows]
        lines.insert(1, " | ".join(["---"] * len(rows[0])))
        options.markdown.write_text("\n".join(f"| {line} |" for line in lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
