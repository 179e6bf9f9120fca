"""The whole diagnosis: which effect, where, how far, and what to do next."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Executor

from ..core.errors import SimulationError
from ..master.pool import Pool
from .analysis.component_replay import replays
from .analysis.experiment_design import Next, ranked
from .analysis.localisation import places, regions
from .campaign import catalogue as catalogues
from .campaign.read import Campaign
from .checks.sensor_consistency import check
from .estimation.gauss_newton import bias, clock
from .estimation.uncertainty import reduction_interval
from .problem.noise import rms
from .problem.problem import Problem
from .result.diagnosis import Diagnosis
from .selection.calibration import Calibration
from .selection.pipeline import Study, study
from .selection.posterior import NONE, UNKNOWN, Cause, causes, features

MOST_TOLD = 12
"""Causes of which parameters and gaps are told; all others have their probability alone."""


def diagnose(
    campaign: Campaign,
    executor: Executor | None = None,
    say: Callable[[str], None] = lambda text: None,
    progress: Callable[[int], None] = lambda runs: None,
    processes: int | None = None,
    hurry: Callable[[], bool] = lambda: False,
) -> Diagnosis:
    """The diagnosis of a campaign. `say` gets each stage's name, `progress` the number of simulations so far; as soon
    as `hurry` is true, what has been found by then is judged."""
    begin = time.perf_counter()
    catalogue = (
        catalogues.load(campaign.effects) if campaign.effects else catalogues.load_from_package(campaign.system)
    )
    with Pool(campaign.system, executor, processes, progress) as pool:
        s = study(campaign, catalogue, pool, say, hurry)
        calibration = Calibration.load()
        x = features(calibration, s.null_judged.shared, s.judged[0].shared, len(s.problem.obs))
        found = causes(s.judged, calibration, x)
        for place, cause in enumerate(found):
            cause.told = place < MOST_TOLD or cause.effects in (NONE, UNKNOWN)
        d = Diagnosis(s, found, [], [], None, warnings=list(s.problem.warnings), features=[float(v) for v in x])
        say("where the gap lies")
        d.masks = _masks(s.scoring, s)
        for cause in found:
            if cause.judged is not None and cause.told and cause.judged is not d.chosen:
                try:
                    s.gap(cause.judged)  # simulates the held-out runs
                except SimulationError as error:
                    cause.told = False
                    d.warnings.append(f"{' + '.join(cause.effects)}: {error}")
        d.places = places(s.scoring, s.after(s.null_judged), d.masks)
        d.replays = replays(s.problem, s.null.fit.point)
        d.warnings += check(s.problem, s.delivered)
        d.warnings += _remarks(d)
        d.reduction_ci = reduction_interval(s.scoring, s.before, s.after(d.chosen))
        say("what to measure next")
        options = _next(s, found)
        d.next = options[0] if options else None
        d.channel = next((n for n in options if "channel" in n.change), None)
    d.seconds = time.perf_counter() - begin
    return d


def _masks(problem: Problem, s: Study):
    wanted = s.problem.catalogue.regions
    record = tuple(dict.fromkeys(r.signal for r in wanted if r.signal in problem.signals))
    if not record:
        return regions(problem, (), (), [], problem.coarse)
    rows = problem.rows([s.null.fit.point], s.problem.coarse, record, keep=False)[0]
    if rows is None:
        return {}
    return regions(problem, wanted, record, rows, s.problem.coarse)


def _next(s: Study, found: list[Cause]) -> list[Next]:
    known = [c for c in found if c.judged is not None]
    if len(known) < 2:
        return []
    first = known[0]
    second = next((c for c in known[1:] if not set(first.effects) & set(c.effects)), known[1])
    assert first.judged is not None
    assert second.judged is not None
    return ranked(
        s.problem, first.judged.hypothesis, second.judged.hypothesis, s.problem.catalogue.experiments,
        s.problem.catalogue.measurables,
    )  # fmt: skip


def _remarks(d: Diagnosis) -> list[str]:
    told = []
    fit = d.chosen.hypothesis.fit
    for x, u in zip(fit.unknowns, fit.u, strict=True):
        if x.kind == "base" and abs(u) > 0.999:
            told.append(f"{x.name} is at the end of its tolerance of {x.scale:.0%}; it may lie beyond")
    problem = d.study.problem
    for k, (label, q) in enumerate(zip(problem.labels, fit.q[: fit.channels], strict=False)):
        if abs(q) > 3.0:
            value = f"{q * bias(problem, k):.2g} {problem.units.get(label, '1')}"
            told.append(f"{label}: its sensor seems to read {value} too much, more than sensors usually do")
    for r, (info, q) in enumerate(zip(problem.runs, fit.q[fit.channels :], strict=True)):
        if abs(q) > 5.0:
            told.append(f"{info.name}: its clock seems to be off by {1e3 * q * clock(problem, r):.2g} ms")
    for name, values in problem.varied(fit.point).items():
        share = values[0] / problem.runs[0].values[name] - 1.0
        told.append(f"{name} is {share:+.2%} off what each run states; calibrated.ssv, which is for all, leaves it out")
    step = rms(d.study.numerical / problem.obs.floor)
    if step >= 0.5:
        told.append(f"halving the model's step moves it by {step:.2f} noise floors: take a shorter step")
    top = d.causes[0]
    if top.effects not in (NONE, UNKNOWN) and top.ambiguous_with:
        names = ", ".join(" + ".join(e) for e in top.ambiguous_with)
        told.append(f"this campaign can hardly tell {' + '.join(top.effects)} from {names}")
    return told
