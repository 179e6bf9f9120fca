"""Compares diagnoses with the sealed answers, and prints the table of what a diagnosis has to reach.

    python -m benchmarks.blind.score DIR|RECORDS... [--json FILE] [--markdown FILE] [--records FILE]

What is true of a case, what is said, and how both are compared is in `scoring`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from .records import load_all, merge
from .scoring.drawers import drawer
from .scoring.outcome import Outcome, outcomes
from .scoring.report import as_markdown, as_text
from .scoring.table import score


def as_csv(found: Sequence[Outcome]) -> str:
    """A row per case: truth with its shares, statement, and whether it is right."""
    lines = ["case,kind,true,shares,size,left,said,exact,missed,false,search_gap,drawer,wall_s"]
    for o in found:
        shares = " + ".join("" if e.share is None else f"{e.share:.3f}" for e in o.true.effects)
        left = "" if o.true.left is None else f"{o.true.left:.2f}"
        said = " + ".join("|".join(s) for s in o.said.statements)
        gap = "" if o.search_gap is None else f"{o.search_gap:.3f}"
        lines.append(
            f"{o.case},{o.true.kind},{' + '.join(e.name for e in o.true.effects)},{shares},{o.true.size:.2f},{left},"
            f"{said},{int(o.exact)},{sum(not hit for _, hit in o.hits)},{o.rights.count(False)},{gap},{drawer(o)},"
            f"{o.said.finished:.0f}"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.score", description="Scores diagnoses against the answers.")
    p.add_argument(
        "places", type=Path, nargs="+",
        help="folders of cases, or files of records; of a case that is in several, the first counts",
    )  # fmt: skip
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
    cases = load_all(options.places, options.diagnoses, options.count_missing)
    if not cases:
        p.error(f"{options.diagnoses or options.places[0]}: holds no diagnoses")
    if options.records:
        merge(options.records, cases)
    cases = [case for case in cases if case.name >= options.since and case.name not in options.without]
    if options.recalibrated:
        from .calibrate import recalibrated

        cases = [recalibrated(case) for case in cases]
    found = outcomes(cases)
    result = score(found)
    print(as_text(result), end="")
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if options.markdown:
        options.markdown.write_text(as_markdown(result), encoding="utf-8")
    if options.csv:
        options.csv.write_text(as_csv(found), encoding="utf-8")


if __name__ == "__main__":
    main()
