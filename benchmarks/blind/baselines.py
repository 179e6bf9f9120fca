"""Three simple ways to name a cause, for comparison, from what a diagnosis has computed anyway.

    python -m benchmarks.blind.baselines DIR|RECORDS [--diagnoses FOLDER] [--markdown FILE]

* refit: base parameters are to blame for everything; no effect is ever named.
* residual: whichever effect explains most of the refitted model's residual in the linear screening, if that residual is
  above 1.1 floors.
* BIC: the single effect, or none, with the least n ln(mean square) + k ln n of the fit, all readings independent.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from math import log
from pathlib import Path
from typing import Any

from .records import Record, load
from .score import NONE, Names, Outcome, Said, Truth, score

ABOVE = 1.1


def refit(diagnosis: dict[str, Any]) -> Names:
    """Never an effect."""
    return NONE


def residual(diagnosis: dict[str, Any]) -> Names:
    """The effect that screening likes best."""
    screening = diagnosis["evidence"]["screening"]
    if diagnosis["gap"]["after_calibration"] < ABOVE or not screening:
        return NONE
    return (screening[0]["effect"],)


def bic(diagnosis: dict[str, Any]) -> Names:
    """The single effect with the least BIC."""
    evidence = diagnosis["evidence"]
    n = evidence["readings"]
    simple = [h for h in evidence["hypotheses"] if len(h["effects"]) <= 1]
    best = min(simple, key=lambda h: n * log(h["fit_rms"] ** 2) + h["unknowns"] * log(n))
    return tuple(best["effects"]) or NONE


BASELINES = {"refit of base parameters": refit, "largest residual": residual, "BIC, single effects": bic}


def outcomes(cases: Sequence[Record], name: str) -> list[Outcome]:
    """What a baseline says of every diagnosed case; its probability is 1."""
    made, nan = [], float("nan")
    for case in cases:
        if case.diagnosis is not None:
            said = BASELINES[name](case.diagnosis)
            statement = Said(said, (), ((said, 1.0),), {}, nan, nan, nan)
            made.append(Outcome(case.name, Truth.of(case.answer), statement))
    return made


KEYS = ("all_exact", "exact_top1_clear", "group_top1_clear", "false_alarms", "unknown_recall")


def table(cases: Sequence[Record]) -> list[list[str]]:
    """Head and a row per baseline."""
    rows = [["baseline", "right, all cases", "exact, clear", "group, clear", "false alarms", "unknown found", "Brier"]]
    for name in BASELINES:
        result = score(outcomes(cases, name))
        shares = [result[key]["share"] for key in KEYS]
        rows.append([name, *("-" if s is None else f"{s:.0%}" for s in shares), f"{result['brier']:.2f}"])
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
        print(f"{row[0]:<26}" + "".join(f"{cell:>18}" for cell in row[1:]))
    if options.markdown:
        lines = [" | ".join(row) for row in rows]
        lines.insert(1, " | ".join(["---"] * len(rows[0])))
        options.markdown.write_text("\n".join(f"| {line} |" for line in lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
