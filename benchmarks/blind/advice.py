"""Whether the advised next measurement tells more than a run at random: both are made and diagnosed.

    python -m benchmarks.blind.advice DIR --package build/deepsea_0km.ssp

Takes the diagnosed cases of DIR whose answer was not sure, adds to each the run or the channel that its diagnosis
advises, and to another copy a run in conditions drawn as those of any case, and diagnoses both from the beginning. What
counts is the probability of the true effects, up to their groups, before and after. Goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .case import Case
from .draw import draw, draw_conditions
from .generate import write
from .measure import BIAS_SHARE, KINDS, Channel
from .run import default_command, diagnose
from .scoring.names import in_group
from .scoring.true import Truth

CONDITIONS = {
    "depth": "depth", "arm.load_weight": "load_weight", "hydraulics.command.target": "target",
    "hydraulics.command.ramp_time": "ramp_time",
}  # fmt: skip
"""What a diagnosis may advise to change, and the plant's name of it."""

LONGEST = 24.0
"""Of a run [s]."""

WAYS = ("advised", "random")


def right_probability(answer: dict[str, Any], diagnosis: dict[str, Any]) -> float:
    """Probability of the hypotheses that say the effects to be found, up to their groups, and nothing else."""
    wanted = Truth.of(answer).wanted
    total = 0.0
    for h in diagnosis["evidence"]["hypotheses"]:
        said = [name.split(" [")[0] for name in h["label"].split(" + ")] if h["effects"] else []
        told = all(any(in_group(e.name, e.alike, s) for s in said) for e in wanted)
        needed = all(any(in_group(e.name, e.alike, s) for e in wanted) for s in said)
        total += h["probability"] * (told and needed)
    return total


def advised(case: Case, change: dict[str, Any], rng: np.random.Generator) -> Case:
    """The case with what the diagnosis advises: another channel in all runs, or its first run in other conditions."""
    if "channel" in change:
        kind = next(k for k in KINDS if k.connector == change["channel"])
        noise = float(np.exp(rng.uniform(np.log(kind.quiet), np.log(kind.loud))))
        bias = float(rng.normal(0.0, BIAS_SHARE * kind.span))
        return replace(case, channels=(*case.channels, Channel(kind, noise, bias)))
    run = replace(case.runs[0], **{CONDITIONS[name]: float(value) for name, value in change.items()})
    stop = min(LONGEST, max(run.stop, run.t_start + 2 * run.ramp_time + run.hold_time + 1.0))
    return replace(case, runs=(*case.runs, replace(run, stop=stop)))


def make(folder: Path, name: str, package: Path) -> None:
    """Write both campaigns of a case, where they are not there."""
    answer = json.loads((folder / "answers" / f"{name}.json").read_text("utf-8"))
    diagnosis = json.loads((folder / "diagnoses" / name / "diagnosis.json").read_text("utf-8"))
    case = draw(answer["seed"], answer["case"], "budget" in answer, answer.get("edition", 1))
    for way in WAYS:
        out = folder / "advice" / way
        if (out / name / "campaign.toml").exists():
            continue
        rng = np.random.default_rng([answer["seed"], answer["case"], 2])
        if way == "advised":
            more = advised(case, diagnosis["next_experiment"]["change"], rng)
        else:
            more = replace(case, runs=(*case.runs, draw_conditions(rng, case.runs[0].rate)))
        out.mkdir(parents=True, exist_ok=True)
        write(more, out, package, budget=False)


def unsure(folder: Path, least: float) -> list[str]:
    """Cases of the folder that have something to be found, or nothing wrong, and whose answer was less sure."""
    names = []
    for path in sorted((folder / "diagnoses").glob("case_*/diagnosis.json")):
        name = path.parent.name
        answer = json.loads((folder / "answers" / f"{name}.json").read_text("utf-8"))
        diagnosis = json.loads(path.read_text("utf-8"))
        truth = Truth.of(answer)
        known = (truth.known and truth.wanted) or answer["kind"] == "none"
        if known and diagnosis.get("next_experiment") and right_probability(answer, diagnosis) < least:
            names.append(name)
    return names


def table(folder: Path, names: list[str]) -> str:
    """The probability of the right answer before, with the advised measurement and with a run at random."""
    rows = []
    for name in names:
        answer = json.loads((folder / "answers" / f"{name}.json").read_text("utf-8"))
        places = [folder / "diagnoses" / name, *(folder / "advice" / way / "diagnoses" / name for way in WAYS)]
        if all((p / "diagnosis.json").exists() for p in places):
            told = [json.loads((p / "diagnosis.json").read_text("utf-8")) for p in places]
            change = json.dumps(told[0]["next_experiment"]["change"])
            rows.append((name, [right_probability(answer, d) for d in told], change))
    lines = [f"{'case':<12}{'before':>8}{'advised':>9}{'random':>8}  advice"]
    lines += [f"{name:<12}{p[0]:8.2f}{p[1]:9.2f}{p[2]:8.2f}  {change}" for name, p, change in rows]
    if rows:
        p = np.array([p for _, p, _ in rows])
        mean, better = p.mean(axis=0), np.mean(p[:, 1] > p[:, 2])
        lines.append(f"{'mean':<12}{mean[0]:8.2f}{mean[1]:9.2f}{mean[2]:8.2f}  advised better in {better:.0%}")
    return "\n".join(lines)


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.advice", description="Checks what diagnoses advise to measure.")
    p.add_argument("folder", type=Path, help="cases with their diagnoses")
    p.add_argument("--package", type=Path, required=True, help="the package that the diagnosis compares with")
    p.add_argument("--less-than", type=float, default=0.9, metavar="P", help="probability of the right answer")
    p.add_argument("--cases", type=int, default=30, help="at most so many")
    p.add_argument("--command", default=default_command(), help="the diagnosis (default: cosim-gap)")
    p.add_argument("--timeout", type=float, default=900.0, help="longest time for one case, s")
    p.add_argument("--processes", type=int, default=1, help="diagnoses at the same time")
    p.add_argument("--option", action="append", default=[], help="further option of the diagnosis, may be repeated")
    options = p.parse_args()
    names = unsure(options.folder, options.less_than)[: options.cases]
    for name in names:
        make(options.folder, name, options.package.resolve())
    command, jobs = [options.command, *options.option], []
    for name in names:
        for way in WAYS:
            place = options.folder / "advice" / way
            if not (place / "diagnoses" / name / "diagnosis.json").exists():
                jobs.append((command, place / name, place / "diagnoses" / name, options.timeout))
    print(f"{len(names)} cases whose answer was not sure, {len(jobs)} diagnoses to make", flush=True)
    with ThreadPoolExecutor(options.processes) as pool:
        for name, seconds, fault in pool.map(lambda job: diagnose(*job), jobs):
            print(f"{name}  {seconds:6.1f} s  {fault or 'done'}", flush=True)
    print(table(options.folder, names))


if __name__ == "__main__":
    main()
