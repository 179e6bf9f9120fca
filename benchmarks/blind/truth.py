"""The true budget of a case: how much of what a refit of the base parameters leaves each of its effects accounts for.

    python -m benchmarks.blind.truth DIR [--processes 1] [--records FILE]

writes the budgets into the answers of a folder that lack them, and goes on where it was stopped. The plant is refitted,
within the tolerances, with each subset of the effects; an effect's share is its Shapley value of the mean square that
is left without noise, so that the shares add up to 1.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import combinations
from math import factorial, sqrt
from pathlib import Path
from typing import Any

from .case import Case, Conditions, Wrong
from .effect_forms import FORMS
from .effects import by_id
from .measure import KINDS, Channel
from .readings import Readings
from .records import load, merge

Subset = tuple[int, ...]
"""Places of effects in a case's list, ascending."""

ENOUGH = 0.1
"""RMS (in noise) below which a refit need not be better: 1 % of a noise's square."""

SCAN = 9
"""Values at which each base parameter is tried alone beside some of the effects; without any, as for sizes."""


def subsets(count: int) -> list[Subset]:
    """All subsets of so many effects but the whole, the smallest first."""
    return [s for k in range(count) for s in combinations(range(count), k)]


def shapley(left: Mapping[Subset, float], count: int) -> list[float]:
    """Share of each of `count` effects, from the RMS that is left with each subset; with all of them nothing is.

    Shares add up to 1. As in the budget of a diagnosis no subset counts as worse than none at all, nor as better than
    one that contains it: what one effect hides of another's work is nobody's share.
    """
    power = {tuple(range(count)): 0.0}
    for s in reversed(subsets(count)):
        above = [power[tuple(sorted((*s, i)))] for i in range(count) if i not in s]
        power[s] = max(min(left[s], left[()]) ** 2, *above)
    shares = []
    for i in range(count):
        total = 0.0
        for s in subsets(count):
            if i not in s:
                orders = factorial(len(s)) * factorial(count - len(s) - 1)
                total += orders * (power[s] - power[tuple(sorted((*s, i)))])
        shares.append(total / factorial(count) / power[()] if power[()] > 0.0 else 0.0)
    return shares


def left_by_subset(case: Case, known: Mapping[Subset, float] | None = None) -> dict[Subset, float]:
    """RMS (in noise) that the best refit leaves of a case's readings, with each subset of its effects in the plant.

    known: what has been found already.
    """
    left = dict(known or {})
    missing = [s for s in subsets(len(case.wrong)) if s not in left]
    if not missing:
        return left
    readings = Readings(case)
    target = readings.reading + readings.change(case.wrong)
    for s in missing:
        some = tuple(case.wrong[i] for i in s)
        left[s] = readings.left(target, some, ENOUGH, SCAN) if s else readings.left(target, (), ENOUGH)
    return left


def budget(left: Mapping[Subset, float], count: int) -> dict[str, Any]:
    """The budget as it stands in an answer: what calibration leaves with the noise, shares, RMS by subset."""
    rows = [{"effects": list(s), "left": left[s]} for s in subsets(count)]
    calibrated = sqrt(1.0 + left[()] ** 2) if count else 1.0
    return {"calibrated": calibrated, "shares": shapley(left, count), "subsets": rows}


def case_of(answer: Mapping[str, Any]) -> Case:
    """The case that an answer is of, as far as readings without noise need it."""
    kinds = {k.key: k for k in KINDS}
    channels = []
    for c in answer["channels"]:
        factor = kinds[c["column"]].factor
        channels.append(Channel(kinds[c["column"]], c["noise_std"] * factor, c["bias"] * factor))
    runs = tuple(_conditions(run) for run in answer["runs"])
    columns = {c["connector"]: c["column"] for c in answer["channels"]}
    wrong = tuple(_wrong(e, columns) for e in answer["effects"])
    return Case(
        answer["seed"], answer["case"], answer["kind"], runs, tuple(channels), answer["delay"], answer["tolerance"],
        answer["base"], answer["noise_stated"], wrong, answer["size_all"], answer.get("edition", 1),
    )  # fmt: skip


def _conditions(run: Mapping[str, Any]) -> Conditions:
    command = "hydraulics.command."
    return Conditions(
        run["depth"], run["arm.load_weight"], run["arm.current_speed"], run[command + "target"],
        run[command + "t_start"], run[command + "ramp_time"], run[command + "hold_time"], run["stop"], run["rate"],
    )  # fmt: skip


def _wrong(entry: Mapping[str, Any], columns: Mapping[str, str]) -> Wrong:
    effect, plant = by_id(entry["id"]), entry["plant"]
    change = plant[effect.knob] - effect.neutral
    shapes = {name: value for name, value in plant.items() if name != effect.knob}
    column = columns[entry["channel"]] if entry.get("channel") else None
    form = next((f for f in FORMS if f.effect == effect.id and f.id == entry.get("form")), None)
    return Wrong(effect, 1.0 if change >= 0.0 else -1.0, shapes, abs(change), column, entry["size"], form=form)


def told(answer: Mapping[str, Any]) -> dict[Subset, float]:
    """What an answer tells of its budget already: of one effect alone its size is what a refit leaves."""
    if len(answer["effects"]) == 1:
        return {(): float(answer["size"])}
    return {}


def complete(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The answer with its budget."""
    case = case_of(answer)
    return {**answer, "budget": budget(left_by_subset(case, told(answer)), len(case.wrong))}


def _update(file: Path) -> str:
    begin = time.perf_counter()
    answer = complete(json.loads(file.read_text("utf-8")))
    file.write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    pairs = zip(answer["effects"], answer["budget"]["shares"], strict=True)
    shares = ", ".join(f"{e['id']} {s:.0%}" for e, s in pairs) or "-"
    seconds = time.perf_counter() - begin
    return f"{file.stem}  {answer['budget']['calibrated']:6.2f} times the noise  {shares}  ({seconds:.0f} s)"


def update(files: Sequence[Path], processes: int) -> None:
    """Complete answer files, several at a time, and print a line for each."""
    if processes == 1:
        for file in files:
            print(_update(file), flush=True)
        return
    with ProcessPoolExecutor(processes) as pool:
        for future in as_completed([pool.submit(_update, file) for file in files]):
            print(future.result(), flush=True)


def into_records(files: Sequence[Path], records: Path) -> int:
    """Put the budgets of answer files into the cases of a file of records; returns how many it has of them."""
    known = {}
    for answer in (json.loads(file.read_text("utf-8")) for file in files):
        if "budget" in answer:
            known[answer["seed"], answer["case"]] = answer["budget"]
    made = []
    for record in load(records):
        found = known.get((record.answer["seed"], record.answer["case"]))
        if found is not None:
            made.append(record._replace(answer={**record.answer, "budget": found}))
    merge(records, made)
    return len(made)


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.truth", description="Adds the true budgets to the answers.")
    p.add_argument("folder", type=Path)
    p.add_argument("--processes", type=int, default=1, help="cases at the same time")
    p.add_argument("--records", type=Path, nargs="+", default=[], help="put the budgets into these records, too")
    options = p.parse_args()
    files = sorted((options.folder / "answers").glob("case_*.json"))
    if not files:
        p.error(f"{options.folder / 'answers'}: holds no answers")
    todo = [file for file in files if "budget" not in json.loads(file.read_text("utf-8"))]
    print(f"{len(files)} answers, {len(files) - len(todo)} with their budget", flush=True)
    update(todo, options.processes)
    for records in options.records:
        print(f"{records}: {into_records(files, records)} budgets", flush=True)


if __name__ == "__main__":
    main()
