"""The command `cosim-gap check`: a campaign beside the model as delivered, drawn, and what looks wrong in a table."""

from __future__ import annotations

import argparse
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from ...core.console import conclude
from ...core.errors import PackageError, SimulationError
from ...core.files import make_folder
from ...core.units import unit
from ...master.parallel.pool import Pool
from ..campaign import read_catalogue as catalogues
from ..campaign.campaign import NOTHING_TO_FIT, Campaign, CampaignError
from ..campaign.catalogue import Catalogue
from ..campaign.packed import campaign_at
from ..checks.campaign_sanity import CHECKS as SANITY_CHECKS
from ..checks.catalogue_values import check_catalogue_values
from ..checks.readings import check_readings, gaps
from ..checks.run_mistakes import check_runs
from ..checks.sensor_consistency import check_sensors
from ..checks.shape_mistakes import Finding, check_shapes
from ..checks.time_unit import check_time
from ..problem.build import build_problem
from ..problem.problem import Problem
from ..settings import CHECKS
from .drawing import draw
from .guess import spread

PICTURE = "check.png"


class _Here(Executor):
    """Runs tasks in this process: for a few runs, starting others takes longer."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@dataclass(frozen=True, eq=False)
class Checked:
    """What was found: the problem of the runs that were simulated, the model as delivered (n,), and how many runs."""

    problem: Problem
    nominal: np.ndarray
    findings: tuple[Finding, ...]
    runs: int
    notes: tuple[Finding, ...] = ()
    """What a campaign may well have."""


NOTES = (
    "was not measured in this run", "its clock jitters by", "is taken as 0 s of the model",
    "changes nothing in the model as delivered",
)  # fmt: skip
"""In what readers and checks tell: what a sound campaign may have, too."""


TIME = "time_unit"
"""The key that is named where time is in another unit."""


def check_command(options: argparse.Namespace) -> int:
    """Check and draw; returns 1 where something looks wrong, else 0."""
    folder = options.out or options.campaign.parent
    with campaign_at(options.campaign) as campaign:
        try:
            checked = check(campaign)
        except CampaignError as error:
            if TIME not in str(error):
                raise
            finding = _split(str(error).removeprefix(f"{campaign.file}: "), campaign)
            conclude(options, lambda: {"findings": [asdict(finding)]}, lambda: _table((finding,)))
            return 1
        make_folder(folder)
        name = PICTURE if not zipfile.is_zipfile(options.campaign) else f"{options.campaign.stem}_{PICTURE}"
        drawn = draw(checked.problem, checked.nominal, folder / name)
    picture = folder / name if drawn else None
    conclude(
        options, lambda: _content(checked, picture),
        lambda: [*_lines(checked), f"drawn in {picture}" if picture else "no channels to draw"],
    )  # fmt: skip
    return 1 if checked.findings else 0


def check(campaign: Campaign) -> Checked:
    """All checks of a campaign. Raises `CosimError` for what cannot be simulated, also where time is in another unit:
    such a run would take a thousand times too long."""
    chosen = spread(len(campaign.runs), CHECKS.simulated_runs)
    some = replace(campaign, runs=tuple(campaign.runs[r] for r in chosen))
    catalogue, findings = _catalogue(campaign)
    with Pool(campaign.system, _Here()) as pool:
        problem = build_problem(some, catalogue, pool)
        findings += [_split(text, campaign) for text in problem.warnings]
        findings += [_split(text, campaign) for text in check_time(problem)]
        nominal = problem.at_step({}, problem.macro_step)
        if nominal is None:
            raise SimulationError(f"{campaign.system.name}: the model as delivered does not run the campaign: "
                                  f"{problem.simulator.failure}")  # fmt: skip
        for sanity in SANITY_CHECKS:
            findings += _told(problem, partial(sanity, problem, nominal))
        findings += _told(problem, lambda: check_sensors(problem, nominal))
        findings += check_runs(problem, nominal)
        findings += check_shapes(problem, nominal, {f.channel for f in findings})
        findings += [*check_readings(problem, nominal), *check_catalogue_values(problem)]
    findings += [Finding("", "", NOTHING_TO_FIT)] if campaign.lacks_training else []
    notes = [f for f in findings if any(part in f.text for part in NOTES)]
    wrong = [f for f in findings if f not in notes]
    return Checked(problem, nominal, tuple(_merged(wrong)), len(campaign.runs), tuple(_merged(notes)))


def _catalogue(campaign: Campaign) -> tuple[Catalogue, list[Finding]]:
    """The campaign's catalogue; where there is none, an empty one, and that it is missing."""
    if campaign.effects:
        return catalogues.load(campaign.effects), []
    try:
        return catalogues.load_from_package(campaign.system), []
    except PackageError as error:
        return Catalogue(()), [Finding("", "", f"no catalogue of effects: {error}")]


def _told(problem: Problem, check: Callable[[], list[str]]) -> list[Finding]:
    """What a check warns of or refuses."""
    try:
        return [_split(text, problem.campaign) for text in check()]
    except CampaignError as error:
        return [_split(str(error).removeprefix(f"{problem.campaign.file}: "), problem.campaign)]


def _split(text: str, campaign: Campaign) -> Finding:
    """A sentence of another check, with the run and the channel that it begins with in their places."""
    run = channel = ""
    for r in campaign.runs:
        for begin in (f"run '{r.name}'", f"{r.file.name}" if r.file else "\0", r.name):
            if not run and text.startswith((f"{begin}: ", f"{begin}, ")):
                run, text = r.name, text[len(begin) + 2 :]
    for c in campaign.channels:
        for begin in (f"channel '{c.column}'", f"'{c.column}'"):
            if not channel and text.startswith((f"{begin}: ", f"{begin} is ", f"{begin} was ")):
                channel, text = c.column, text[len(begin) :].removeprefix(":").strip()
    return Finding(run, channel, text)


def _merged(findings: list[Finding]) -> Iterator[Finding]:
    """Each finding once; what is said alike of several runs in one line."""
    runs: dict[tuple[str, str], list[str]] = {}
    for f in findings:
        runs.setdefault((f.channel, f.text), []).append(f.run)
    for (channel, text), names in runs.items():
        known = list(dict.fromkeys(n for n in names if n))
        more = f" and {len(known) - 1} more" if len(known) > 1 else ""
        yield Finding(known[0] + more if known else "", channel, text)


@dataclass(frozen=True)
class _Row:
    """A channel: least and greatest value measured and modelled, noise (all in its unit), and gap over noise."""

    channel: str
    unit: str
    measured: tuple[float, float]
    modelled: tuple[float, float]
    noise: float
    gap_over_noise: float


def _rows(checked: Checked) -> Iterator[_Row]:
    problem, gap = checked.problem, gaps(checked.problem, checked.nominal)
    for k, c in enumerate(problem.campaign.outputs):
        parts = [b for b in problem.observations.series if b.channel == k]
        if not parts:
            continue
        of_fmu, own = unit(problem.units[c.connector]), unit(c.unit)
        y, model = np.concatenate([b.y for b in parts]), np.concatenate([checked.nominal[b.place] for b in parts])
        measured, modelled = ((of_fmu.factor * x + of_fmu.offset - own.offset) / own.factor for x in (y, model))
        noise = max(b.noise_std for b in parts) * of_fmu.factor / own.factor
        yield _Row(c.column, c.unit, _ends(measured), _ends(modelled), noise, gap.get(k, 0.0))


def _ends(x: np.ndarray) -> tuple[float, float]:
    return float(x.min()), float(x.max())


def _content(checked: Checked, picture: Path | None) -> dict[str, Any]:
    """For programs: channels with their gaps, what looks wrong, and what is noted."""
    return {
        "channels": [asdict(row) for row in _rows(checked)],
        "runs": checked.runs, "simulated_runs": len(checked.problem.runs),
        "findings": [asdict(f) for f in checked.findings], "notes": [asdict(f) for f in checked.notes],
        "picture": picture,
    }  # fmt: skip


def _lines(checked: Checked) -> list[str]:
    """What is printed: channels with their gaps, then what looks wrong."""
    rows = list(_rows(checked))
    wide = max([len(row.channel) for row in rows] + [7])
    lines = [f"{'channel':<{wide}}  {'unit':<7}{'measured':>22}{'modelled':>22}{'noise':>11}{'gap/noise':>11}"]
    for row in rows:
        measured, modelled = (f"{low:.4g} .. {high:.4g}" for low, high in (row.measured, row.modelled))
        lines.append(
            f"{row.channel:<{wide}}  {row.unit:<7}{measured:>22}{modelled:>22}{row.noise:>11.3g}"
            f"{row.gap_over_noise:>11.3g}"
        )
    some = len(checked.problem.runs)
    if some < checked.runs:
        lines.append(f"{some} of {checked.runs} runs were simulated")
    lines += ["", *(_table(checked.findings) or _nothing_wrong(checked, rows)), ""]
    lines += [f"noted: {f.in_one_line.partition(';')[0]}" for f in checked.notes[: CHECKS.longest_notes]]
    if len(checked.notes) > CHECKS.longest_notes:
        lines.append(f"noted: and {len(checked.notes) - CHECKS.longest_notes} more like these")
    return lines


def _nothing_wrong(checked: Checked, rows: list[_Row]) -> list[str]:
    """That nothing looks wrong, and where the model as delivered misses the measurement most."""
    worst = max(rows, key=lambda row: row.gap_over_noise, default=None)
    if worst is None or worst.gap_over_noise <= CHECKS.below_noise:
        return ["Nothing looks wrong."]
    problem = checked.problem
    series = [b for b in problem.observations.series if problem.campaign.outputs[b.channel].column == worst.channel]
    missed = {id(b): ((b.y - checked.nominal[b.place]) / b.noise_std) ** 2 for b in series}
    b = max(series, key=lambda b: float(missed[id(b)].sum()))
    grown = np.cumsum(missed[id(b)])
    begin = float(b.t[int(np.searchsorted(grown, CHECKS.gap_begins * grown[-1]))])
    return wrap(
        f"Nothing looks wrong. The model as delivered misses {worst.channel} most, by {worst.gap_over_noise:.3g} "
        f"noises, and of the runs most in {problem.runs[b.run].name}, from {begin:.3g} s on.", 100,
    )  # fmt: skip


def _table(findings: tuple[Finding, ...]) -> list[str]:
    if not findings:
        return []
    shown = findings[: CHECKS.longest_texts]
    run = max([len(f.run) for f in shown] + [3])
    channel = max([len(f.channel) for f in shown] + [7])
    lines = [f"{'run':<{run}}  {'channel':<{channel}}  what looks wrong"]
    for f in shown:
        first, *more = wrap(f.text, 100) or [""]
        lines.append(f"{f.run:<{run}}  {f.channel:<{channel}}  {first}")
        lines += [f"{'':<{run}}  {'':<{channel}}  {text}" for text in more]
    if len(findings) > len(shown):
        lines.append(f"and {len(findings) - len(shown)} more")
    return lines
