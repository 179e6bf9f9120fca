"""cosim-master compare: runs laid over each other."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.cli import OneLineParser, decimal, exit_code
from ...core.console import add_output, conclude
from ...core.errors import UsageError

if TYPE_CHECKING:
    from ..page.record import RunRecord
    from .compare import Comparison

TOLERANCE = 1e-6
"""Share of a signal's range: far above what rounding makes of a run, far below what its step or solver is good to."""

EXAMPLES = """examples:
  cosim-master compare results/deepsea_11km runs/heavy
  cosim-master compare before.csv after.csv --tolerance 1e-3 --no-html
  cosim-master compare runs/a runs/b runs/c --units bar,mm --out abc.html

The first run is compared with each of the others. A signal's range is its greatest less its least value of both runs
(at least a millionth of its size); texts have to be equal. What only one of the runs has, signals or time, is told and
does not count.

exit codes: 0 the same within the tolerance, 1 different, 2 bad input
"""


def _tolerance(text: str) -> float:
    value = decimal(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text}: it has to be 0 or more, a share of a signal's range")
    return value


def parser() -> OneLineParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-master compare",
        description="Tell where and by how much runs differ, and lay them over each other.",
        epilog=EXAMPLES,
    )
    p.add_argument(
        "runs", metavar="RUN", nargs="+", type=Path, help="two or more result folders, or files: .csv, .parquet, .h5"
    )
    p.add_argument(
        "--tolerance", metavar="SHARE", type=_tolerance, default=TOLERANCE,
        help="of a signal's range, up to which values are the same (default: %(default)g)",
    )  # fmt: skip
    p.add_argument(
        "--out", metavar="FILE", type=Path, default=Path("compare.html"), help="the page (default: %(default)s)"
    )
    p.add_argument("--no-html", action="store_true", help="write no page")
    p.add_argument(
        "--units", metavar="LIST",
        help="what is shown: metric, si, us, or units like mm,bar,L/min,deg (default: what your units.toml says, else "
        "metric)",
    )  # fmt: skip
    add_output(p, quiet=False)
    return p


def main(arguments: Sequence[str]) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    return exit_code("cosim-master compare", lambda: _compare(options), as_json=options.json)


def _compare(options: argparse.Namespace) -> int:
    from ...core.display_units import display_units
    from ..page.record import read_record
    from .compare import compare, in_units_of, read_runs
    from .report import report

    if len(options.runs) < 2:
        raise UsageError("give two runs or more")
    if options.out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out {options.out}: a page is a file.html")
    display = display_units(options.units)
    runs = read_runs(labelled([read_record(path) for path in options.runs]))
    for run in runs[1:]:
        in_units_of(runs[0], run)
    comparisons = [compare(runs[0], run, options.tolerance) for run in runs[1:]]
    page = None
    if not options.no_html:
        from ..page.write import save
        from .page import comparison_content

        page = save(comparison_content(comparisons, display), options.out)

    def lines() -> Iterator[str]:
        for k, comparison in enumerate(comparisons):
            yield from ([""] if k else [])
            yield from report(comparison, options.tolerance, display)
        if page is not None:
            yield f"\n{page}"

    conclude(options, lambda: _content(comparisons, options.tolerance, page), lines)
    return int(any(comparison.differs for comparison in comparisons))


def _content(comparisons: Sequence[Comparison], tolerance: float, page: Path | None) -> dict[str, Any]:
    """For programs: how each run differs from the first one, values in the units of that."""
    from .report import remarks

    pairs = []
    for c in comparisons:
        signals = [{**asdict(d), "differs": d.differs} for d in c.differences]
        pairs.append({
            "a": c.a.label, "b": c.b.label, "differs": c.differs, "remarks": list(remarks(c)), "only_a": c.only_a,
            "only_b": c.only_b, "signals": signals,
        })  # fmt: skip
    return {"differs": any(c.differs for c in comparisons), "tolerance": tolerance, "pairs": pairs, "page": page}


def labelled(records: Sequence[RunRecord]) -> Mapping[str, RunRecord]:
    """The runs by what they are called beside each other: as little of their paths as tells them apart."""
    parts = [Path(record.name).absolute().parts for record in records]
    for count in range(1, max(map(len, parts)) + 1):
        labels = ["/".join(part[-count:]) for part in parts]
        if len(set(labels)) == len(labels):
            return dict(zip(labels, records, strict=True))
    return {f"{k + 1}. {record.name}": record for k, record in enumerate(records)}
