"""Which cases swing by themselves: the machine of the campaign, and not in step with the model as delivered.

    python -m benchmarks.blind.swinging RECORDS.jsonl --package build/deepsea_0km.ssp [--processes 2]

Puts `swinging` into the answers of a file of records, by which `score` counts such cases as a stratum of their own. The
campaigns are drawn again, in some seconds a case or some minutes, and compared with the model as the diagnosis does it
(`gap/problem/find_swings.py`); what is wrong with them is not shown.
"""

from __future__ import annotations

import argparse
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from .draw import draw
from .generate import write
from .records import load, merge


def swinging(answer: dict[str, Any], package: Path) -> bool:
    """Whether something swings in the case of an answer.

    Raises `ValueError` where a case that is drawn again has other effects than the answer.
    """
    from deepsea_cosim.gap.campaign.read import read
    from deepsea_cosim.gap.campaign.read_catalogue import load_from_package
    from deepsea_cosim.gap.problem.build import build_problem
    from deepsea_cosim.gap.problem.find_swings import compare_swings
    from deepsea_cosim.master.parallel.pool import Pool

    with tempfile.TemporaryDirectory() as place:
        out, index = Path(place), answer["case"]
        wanted = [e["id"] for e in answer["effects"]]
        for refit in (False, True):  # what a linear refit shows is nearly always what a whole one does, in a second
            case = draw(answer["seed"], index, refit, answer.get("edition", 1))
            if [w.effect.id for w in case.wrong] == wanted:
                break
        else:
            raise ValueError("drawn again it has other effects")
        write(case, out, package.resolve(), budget=False)
        campaign = read(out / f"case_{index:04d}" / "campaign.toml")
        with Pool(campaign.system, processes=1) as pool:
            problem = build_problem(campaign, load_from_package(campaign.system), pool)
            nominal = problem.at_step({}, problem.macro_step)
    if nominal is None:
        raise ValueError("the model as delivered does not run")
    return compare_swings(problem, nominal) is not problem


def told(answer: dict[str, Any], package: Path) -> bool | str:
    """The same, or why that is not known."""
    try:
        return swinging(answer, package)
    except ValueError as error:
        return str(error)


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.swinging", description="Marks the cases that swing.")
    p.add_argument("records", type=Path, help="file of records")
    p.add_argument("--package", type=Path, required=True)
    p.add_argument("--processes", type=int, default=1)
    options = p.parse_args()
    todo = [r for r in load(options.records) if "swinging" not in r.answer]
    with ProcessPoolExecutor(options.processes) as pool:
        found = pool.map(partial(told, package=options.package), [r.answer for r in todo])
        for k, (record, said) in enumerate(zip(todo, found, strict=True), 1):
            if isinstance(said, bool):
                merge(options.records, [record._replace(answer={**record.answer, "swinging": said})])
            print(f"{record.name} {'done' if isinstance(said, bool) else said}   [{k}/{len(todo)}]", flush=True)


if __name__ == "__main__":
    main()
