"""Makes the cases: campaign.toml and run files for the diagnosis, and sealed answers apart from them.

    python -m benchmarks.blind.generate --seed 1 --cases 40 --out DIR --package build/deepsea_0km.ssp

Run from the root of the repository. Cases that exist are left alone.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from . import truth
from .case import BASE, GRID, Array, Case, Conditions, Wrong, erring, machine_of, span_of
from .draw import KINDS_OF_CASE, LATEST, draw, plan
from .effects import alike
from .machine import Machine
from .measure import ideal, measured
from .plant import simulate


def _toml(value: Any) -> str:
    return json.dumps(value) if isinstance(value, str) else repr(value)


def campaign_text(case: Case, package: str) -> str:
    """campaign.toml of a case."""
    lines = [f'name = "case {case.index}"', f"system = {_toml(package)}"]
    for channel in case.channels:
        kind = channel.kind
        lines += ["", "[[channel]]", f'column = "{kind.key}"', f'connector = "{kind.connector}"']
        lines.append(f'unit = "{kind.unit}"')
        if case.noise_stated:
            lines.append(f"noise_std = {float(f'{channel.std / kind.factor:.3g}')!r}")
    for i, run in enumerate(case.runs, 1):
        known = ", ".join(f'"{k}" = {v!r}' for k, v in run.parameters().items())
        lines += ["", "[[run]]", f'file = "run{i:02d}.csv"', f"parameters = {{ {known} }}"]
    if case.tolerance != 0.05:
        for address in BASE:
            lines += ["", "[[base]]", f'parameter = "{address}"', f"tolerance = {case.tolerance!r}"]
    return "\n".join(lines) + "\n"


def _effect_answer(w: Wrong, case: Case, spans: dict[str, float]) -> dict[str, Any]:
    entry: dict[str, Any] = {"id": w.effect.id, "group": w.effect.group, "alike": alike(w.effect.id, case.edition)}
    entry |= {"size": w.size, "size_linear": w.size_linear, "size_net": w.size_net, "size_wanted": w.wanted}
    entry["plant"] = w.plant
    if w.form is not None:
        entry["form"] = w.form.id
    if w.column is None:  # in another form the library's parameter does not mean the same
        entry["library"] = w.effect.library(w.plant) if w.form is None else {}
        return entry
    kind = next(c.kind for c in case.channels if c.kind.key == w.column)
    entry["channel"] = kind.connector
    entry["library"] = {}
    if w.effect.knob not in ("wave", "drift", "bow") and w.form is None:
        value = w.plant[w.effect.knob]
        address = f"sensor.{kind.connector}.{w.effect.knob}"
        entry["library"] = {address: value * spans[w.column] if w.effect.knob == "bias" else value}
        if w.effect.knob == "bias":
            entry["share_of_span"] = value
    return entry


def answer(case: Case, spans: dict[str, float], before: float) -> dict[str, Any]:
    """The sealed answer of a case."""
    sizes = [w.size for w in case.wrong]
    edition = {"edition": case.edition} if case.edition > 1 else {}
    return {
        "case": case.index,
        "seed": case.seed,
        **edition,
        "kind": case.kind,
        "effects": [_effect_answer(w, case, spans) for w in case.wrong],
        "size": min(sizes, default=0.0),
        "size_all": case.size_all,
        "gap_before": before,
        "base": case.factors,
        "tolerance": case.tolerance,
        "noise_stated": case.noise_stated,
        "delay": case.delay,
        "runs": [{**run.parameters(), "stop": run.stop, "rate": run.rate} for run in case.runs],
        "channels": [
            {
                "column": c.kind.key, "connector": c.kind.connector, "unit": c.kind.unit,
                "noise_std": c.noise / c.kind.factor, "noise_std_all": c.std / c.kind.factor,
                "quantum": c.step / c.kind.factor, "bias": c.bias / c.kind.factor,
            }
            for c in case.channels
        ],
        "notes": case.notes,
    }  # fmt: skip


def _run(run: Conditions, machine: Machine) -> Array:
    return simulate(machine, np.arange(round(run.stop / GRID) + 1) * GRID)


def write_case(
    seed: int, index: int, out: Path, package: Path, refit: bool = True, edition: int = LATEST
) -> dict[str, Any]:
    """Draw, simulate and write one case; returns its answer, since edition 2 with its budget if sizes are refitted."""
    return write(draw(seed, index, refit, edition), out, package, refit and edition > 1)


def write_again(answer: Mapping[str, Any], out: Path, package: Path) -> dict[str, Any]:
    """Write a case anew whose sealed answer is there: a second, not the minutes that sizes and budget take."""
    case, _ = plan(answer["seed"], answer["case"], answer.get("edition", 1))
    told = truth.case_of(answer)
    write(replace(case, wrong=told.wrong, size_all=told.size_all), out, package, budget=False)
    (out / "answers" / f"case_{case.index:04d}.json").write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    return dict(answer)


def write(case: Case, out: Path, package: Path, budget: bool) -> dict[str, Any]:
    """Simulate and write a case; returns its answer, with its true budget if that is wanted."""
    seed, index = case.seed, case.index
    signals = [_run(run, machine_of(run, case.factors, case.wrong)) for run in case.runs]
    delivered = [_run(run, run.machine()) for run in case.runs]
    # the bias is a share of the channel's span in the machine without the effect
    healthy = [_run(run, machine_of(run, case.factors)) for run in case.runs] if case.wrong else signals
    spans = {c.kind.key: span_of(healthy, c) for c in case.channels}
    channels = erring(case.channels, case.wrong, spans)
    rng = np.random.default_rng([seed, index, 1])
    name = f"case_{index:04d}"
    folder, answers = out / name, out / "answers"
    folder.mkdir(parents=True, exist_ok=True)
    answers.mkdir(exist_ok=True)
    gap = []
    for i, run in enumerate(case.runs):
        grid = np.arange(signals[i].shape[0]) * GRID
        columns = []
        for channel, true in zip(channels, case.channels, strict=True):
            reading = ideal(channel, grid, signals[i], run.at, case.delay)
            gap.append((reading - ideal(true, grid, delivered[i], run.at)) / channel.std)
            columns.append(measured(channel, reading, rng) / channel.kind.factor)
        with (folder / f"run{i + 1:02d}.csv").open("w", encoding="utf-8") as file:
            file.write(",".join(["time", *(c.kind.key for c in channels)]) + "\n")
            for t, row in zip(run.at, np.column_stack(columns), strict=True):
                file.write(f"{t:.6g}," + ",".join("" if np.isnan(v) else f"{v:.7g}" for v in row) + "\n")
    before = float(np.sqrt(np.mean(np.concatenate(gap) ** 2)))
    result = answer(case, spans, before)
    if budget:
        result = truth.complete(result)
    (answers / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    system = package if package.is_absolute() else Path(os.path.relpath(package, folder))
    (folder / "campaign.toml").write_text(campaign_text(case, str(system)), encoding="utf-8")
    return result


def _form(entry: dict[str, Any]) -> str:
    return f", {entry['form']}" if "form" in entry else ""


def _line(result: dict[str, Any]) -> str:
    effects = " + ".join(f"{e['id']}{_form(e)} ({e['size']:.2g})" for e in result["effects"]) or "-"
    return (
        f"case_{result['case']:04d}  {result['kind']:<8} {len(result['runs'])} runs {len(result['channels'])} channels"
        f"  gap {result['gap_before']:6.1f}  {effects}"
    )


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.generate", description="Makes blind cases.")
    p.add_argument("--seed", type=int)
    p.add_argument("--cases", type=int, help="number of cases")
    p.add_argument("--answers", type=Path, help="in place of both: the cases of sealed answers (JSON lines) again")
    p.add_argument("--start", type=int, default=0, help="index of the first case")
    p.add_argument("--out", type=Path, required=True)
    p.add_argument("--package", type=Path, required=True, help="package that the diagnosis is to use")
    p.add_argument("--processes", type=int, default=1)
    p.add_argument("--edition", type=int, default=LATEST, choices=list(KINDS_OF_CASE),
                   help="of the benchmark; 1 reproduces the seeds up to 20261126, 2 those up to 20261202")
    p.add_argument("--linear", action="store_true",
                   help="sizes after a linear refit and no true budgets, in a second a case: to develop on")
    options = p.parse_args()
    if not options.package.is_file():
        p.error(f"--package {options.package}: no such file")
    if options.answers is not None:
        for line in options.answers.read_text("utf-8").splitlines():
            print(_line(write_again(json.loads(line), options.out, options.package)), flush=True)
        return
    if options.seed is None or options.cases is None:
        p.error("--seed and --cases, or --answers, are needed")
    wanted = range(options.start, options.start + options.cases)
    todo = [k for k in wanted if not (options.out / f"case_{k:04d}" / "campaign.toml").exists()]
    print(f"{len(wanted) - len(todo)} cases are there already, {len(todo)} to make", flush=True)
    begin = time.perf_counter()
    make = partial(
        write_case, options.seed, out=options.out, package=options.package, edition=options.edition,
        refit=not options.linear,
    )
    if options.processes == 1:
        for k in todo:
            print(_line(make(k)), flush=True)
    else:
        with ProcessPoolExecutor(options.processes) as pool:
            futures = [pool.submit(make, k) for k in todo]
            for future in as_completed(futures):
                print(_line(future.result()), flush=True)
    print(f"{time.perf_counter() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
