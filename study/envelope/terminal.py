"""The command `cosim-study envelope`."""

from __future__ import annotations

import argparse
import csv
import io
import sys
from collections.abc import Iterator
from dataclasses import asdict
from math import floor, log10
from pathlib import Path
from typing import Any

from ...core.console import conclude, json_text, plain
from ...core.errors import Interrupted, UnknownNameError, UsageError
from ...core.files import make_folder, name_of_results, replacing, write_together

SHOWN = 6
"""Cheapest designs that are listed."""


def envelope_command(options: argparse.Namespace) -> int:
    """Find the envelope and the cheapest change, write and print them; returns the exit code."""
    from ...master.parallel.pool import Pool, cluster
    from .options import designs, read
    from .search import cheapest, reaches

    wanted = read(options.options)
    mapped = [g for g in wanted.groups if g.mapped]
    fixed, method = _checked(options, wanted, mapped)
    over, every = designs(mapped), designs(wanted.groups)
    rest = designs([g for g in wanted.groups if not g.mapped])[0].parameters
    at = wanted.high if options.at is None else options.at
    if not wanted.low <= at <= wanted.high:
        raise UsageError(f"--at {at:g}: it has to be between {wanted.low:g} and {wanted.high:g} {wanted.unit}")
    folder: Path = options.out or Path("results") / f"envelope_{name_of_results(options.package)}"
    make_folder(folder)

    from tqdm import tqdm

    found: dict[tuple[str, ...], Any] = {}
    best, failed = None, 0
    try:
        with (
            cluster(options.dask) as executor,
            Pool(options.package, executor, options.processes) as pool,
            tqdm(total=len(over), unit="design", disable=options.quiet or options.json, file=sys.stderr) as bar,
        ):
            for design, answer in reaches(pool, wanted, over, {**fixed, **rest}, method):
                found[tuple(c.name for c in design.choices)] = answer
                bar.update()
            bar.set_description("the cheapest change")
            best, failed = cheapest(pool, wanted, every, at, fixed, method)
    except KeyboardInterrupt:
        if not found:
            raise
        _write(folder, options, wanted, mapped, found, best, at, method)
        raise Interrupted(f"interrupted; {len(found)} of {len(over)} designs are in {folder}") from None
    names = [tuple(c.name for c in d.choices) for d in over]
    reach = {name: found[name] for name in names}
    content = _write(folder, options, wanted, mapped, reach, best, at, method)
    if not options.no_plots:
        from .plots import picture

        with replacing(folder / "envelope.png") as part:
            picture(part, wanted, mapped, reach)
    files = ["envelope.csv", "envelope.json", *([] if options.no_plots else ["envelope.png"])]

    def lines() -> Iterator[str]:
        yield from _lines(wanted, mapped, reach, best, at)
        if failed:
            yield f"{failed} of the combinations that were tried cannot be run there; they count as not holding"
        yield f"\n{folder}: {', '.join(files)}"

    conclude(
        options, lambda: {"folder": folder, "files": files, "combinations_that_failed": failed, "envelope": content},
        lines,
    )  # fmt: skip
    return 0


def _checked(options: argparse.Namespace, wanted: Any, mapped: Any) -> tuple[dict[str, Any], str]:
    """Values of --set by address, and the coupling method that the package states, or the usual one. All that is asked
    is checked against the package."""
    from ...master.algorithms import choose_method
    from ...master.simulation.session import Session
    from ..sweep.request import fixed_values
    from ..sweep.run import check, check_distinct, value_of
    from .options import designs
    from .search import settings

    texts = fixed_values(options.set, ())
    if not 1 <= len(mapped) <= 3:
        raise UsageError(f"{options.options or 'options.toml'}: one to three groups need map = true")
    with Session(options.package) as session:
        fixed = {name: value_of(session, name, text) for name, text in texts.items()}
        used = [name for g in wanted.groups for name in {n: None for c in g.choices for n in c.parameters}]
        check_distinct(session, [*fixed, *used, wanted.parameter])
        first = {**fixed, **designs(wanted.groups)[0].parameters, wanted.parameter: wanted.low}
        others = [c.parameters for g in wanted.groups for c in g.choices]
        between = wanted.low + 0.382 * (wanted.high - wanted.low)  # bisection takes values that are not whole
        try:
            check(session, first, settings(wanted), [*others, *({wanted.parameter: x} for x in (between, wanted.high))])
        except UnknownNameError as error:
            remedy = "" if options.options else "; these are the deep-sea machine's options, give yours with --options"
            raise UnknownNameError(f"{options.options or 'options.toml'}: {error}{remedy}") from None
        return fixed, choose_method(None, session.structure.method)


def _told(r: Any, wanted: Any) -> str:
    if r.why:
        return f"cannot be run at {wanted.low:g}: {r.why}"
    if r.value is None:
        return f"not even {wanted.low:g}" + (f" ({', '.join(r.absent)}: never)" if r.absent else "")
    places = max(0, -floor(log10(wanted.within)))
    told = f"{wanted.high:g} and more" if r.whole else f"{r.value:.{places}f}"
    told += f", but not at {r.hole:.{places}f}" if r.hole is not None else ""
    return told + (f"; beyond, runs fail: {r.beyond}" if r.beyond else "")


def _write(
    folder: Path, options: argparse.Namespace, wanted: Any, mapped: Any, reach: Any, best: Any, at: float,
    method: str,
) -> dict[str, Any]:  # fmt: skip
    """Write the files; gives the contents of envelope.json."""
    from ...core.versions import versions
    from ...master.simulation.manifest import digest

    rows = [[*names, r.value, r.whole, r.hole, r.why or r.beyond] for names, r in reach.items()]
    content = {
        "package": str(options.package), "sha256": digest(options.package), "set": options.set,
        "method": method,
        "options": plain(asdict(wanted)), "versions": versions(),
        "axis": wanted.parameter, "unit": wanted.unit,
        "reach": [{**dict(zip((g.name for g in mapped), names, strict=True)), "value": r.value, "whole": r.whole,
                   "hole": r.hole, "why": r.why, "beyond": r.beyond}
                  for names, r in reach.items()],
        "at": at,
        "cheapest": None if best is None else [{"cost": d.cost, "changes": list(d.changes)} for d in best],
    }  # fmt: skip
    table = io.StringIO()
    writer = csv.writer(table)
    heads = f"{wanted.parameter} [{wanted.unit}]", "up to the high end", "not at", "runs fail"
    writer.writerow([*(g.name for g in mapped), *heads])
    writer.writerows(rows)
    write_together(folder, {"envelope.csv": table.getvalue(), "envelope.json": json_text(content) + "\n"})
    return content


def _lines(wanted: Any, mapped: Any, reach: Any, best: Any, at: float) -> Iterator[str]:
    widths = [max(len(g.name), *(len(c.name) for c in g.choices)) + 2 for g in mapped]
    head = "".join(f"{g.name:<{w}}" for g, w in zip(mapped, widths, strict=True))
    yield f"{head}{wanted.parameter} up to which all holds [{wanted.unit}], within {wanted.within:g}"
    for names, r in reach.items():
        line = "".join(f"{n:<{w}}" for n, w in zip(names, widths, strict=True))
        yield f"{line}{_told(r, wanted)}"
    yield ""
    if not best:
        yield f"no combination of the changes makes it hold at {wanted.parameter} = {at:g} {wanted.unit}"
    elif not best[0].changes:
        yield f"at {wanted.parameter} = {at:g} {wanted.unit} all holds without a change"
    else:
        yield f"cheapest at {wanted.parameter} = {at:g} {wanted.unit}, cost {best[0].cost:g}:"
        for d in best[:SHOWN]:
            yield f"  {'; '.join(d.changes)}"
        if len(best) > SHOWN:
            yield f"  and {len(best) - SHOWN} more of the same cost, see envelope.json"
