"""cosim-master open: a run as a page in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.cli import OneLineParser, exit_code
from ...core.console import add_output, conclude

if TYPE_CHECKING:
    import argparse

    from .record import RunRecord

EXAMPLES = """examples:
  cosim-master open results/deepsea_11km
  cosim-master open runs/heavy --units bar,mm
  cosim-master open arm.parquet --no-browser

The page is results.html in the result folder (of a file on its own, x.csv.html beside x.csv). One that is older
than the results is made anew, and so it is with --units.

exit codes: 0 done, 1 the page could not be opened, 2 no result folder or file
"""


def parser() -> OneLineParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-master open", description="Show a run in the browser, as a page that needs no network.",
        epilog=EXAMPLES,
    )  # fmt: skip
    p.add_argument("run", metavar="DIR", type=Path, help="a result folder; or a result file: .csv, .parquet, .h5")
    p.add_argument("--no-browser", action="store_true", help="only make the page, and print its path")
    p.add_argument(
        "--units", metavar="LIST",
        help="what the page shows: metric, si, us, or units like mm,bar,L/min,deg (default: what your units.toml says, "
        "else metric)",
    )  # fmt: skip
    add_output(p, quiet=False)
    return p


def main(arguments: Sequence[str]) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    return exit_code("cosim-master open", lambda: _open(options), as_json=options.json)


def _open(options: argparse.Namespace) -> int:
    from ...core.display_units import display_units
    from .record import read_record
    from .write import write_page

    display = display_units(options.units)
    record = read_record(options.run)
    if options.units is not None or _is_old(record):
        write_page(record, display)
    conclude(options, lambda: {"page": record.page}, lambda: [str(record.page)])
    return 0 if options.no_browser else show(record.page)


def _is_old(record: RunRecord) -> bool:
    """Whether there is no page, or one of before the results."""
    from ...core.files import changed

    sources = [record.file, *([record.folder / "summary.json"] if record.folder is not None else [])]
    return not record.page.is_file() or changed(record.page) < max(map(changed, sources))


def show(page: Path) -> int:
    """Open a page in the browser; gives the exit code."""
    import os
    import sys
    import webbrowser

    if webbrowser.open(page.resolve().as_uri()):
        return 0
    displays = [os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")]
    no_display = sys.platform.startswith("linux") and not any(displays)
    why = "there is no display here" if no_display else "no browser was found"
    print(f"{page}: {why}; open the file in a browser", file=sys.stderr)
    return 1
