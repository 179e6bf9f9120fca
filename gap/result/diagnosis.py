"""diagnosis.json and calibrated.ssv: a study in the formats that others read."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import make_folder, writing
from ..analysis.component_replay import Replay
from ..analysis.experiment_design import Next
from ..analysis.localisation import Place
from ..estimation.cross_validation import by_run
from ..estimation.uncertainty import WIDTH, parameter_std
from ..problem.noise import rms
from ..problem.problem import Problem, Unknown, matching
from ..selection.evidence import Judged
from ..selection.pipeline import Study
from ..selection.posterior import NONE, UNKNOWN, Cause

SCHEMA = 1


@dataclass
class Diagnosis:
    """A study with its verdict, places, and what to do next."""

    study: Study
    causes: list[Cause]
    places: list[Place]
    replays: list[Replay]
    next: Next | None
    channel: Next | None = None
    """Of the channels that could be added, the one that tells most."""
    reduction_ci: tuple[float, float] = (0.0, 0.0)
    warnings: list[str] = field(default_factory=list)
    masks: dict[str, np.ndarray] = field(default_factory=dict)
    """Regions of the scoring data, by name."""
    seconds: float = 0.0
    features: list[float] = field(default_factory=list)
    """What the probability of "unknown" was found from."""

    @property
    def verdict(self) -> str:
        """The most probable: explained, no_significant_gap or unknown_effect."""
        top = self.causes[0].effects
        return "no_significant_gap" if top == NONE else "unknown_effect" if top == UNKNOWN else "explained"

    @property
    def chosen(self) -> Judged:
        """The hypothesis whose figures are reported: the best cause's, or what comes nearest where none is."""
        if self.verdict == "no_significant_gap":
            return self.study.null_judged
        if self.verdict == "unknown_effect":  # nearest in what it leaves, however unlikely its effects are
            return min(self.study.judged, key=lambda j: j.terms["fit"] + j.terms["penalty"])
        known = [c.judged for c in self.causes if c.judged is not None and c.effects != NONE]
        return known[0] if known else self.study.null_judged


def parameters(problem: Problem, judged: Judged, N: np.ndarray, kinds: tuple[str, ...]) -> dict[str, Any]:
    """Value, 95 % interval, unit and whether it is at a bound, of a hypothesis' unknowns of these kinds."""
    fit = judged.hypothesis.fit
    std = parameter_std(problem, fit, N)
    made = {}
    for x, u, s in zip(fit.unknowns, fit.u, std, strict=True):
        if x.kind not in kinds:
            continue
        low, high = max(x.low, u - WIDTH * s), min(x.high, u + WIDTH * s)
        factor, unit = _scale(problem, x)
        ends = sorted((x.value(low) * factor, x.value(high) * factor))
        at_bound = bool(u - x.low < 1e-6 * (x.high - x.low) or x.high - u < 1e-6 * (x.high - x.low))
        made[x.name] = {"value": x.value(u) * factor, "ci95": ends, "unit": unit, "at_bound": at_bound}
    return made


def _scale(problem: Problem, x: Unknown) -> tuple[float, str]:
    """(factor from the unknown's value to the shown one, unit): base parameters are factors of the delivered value."""
    if x.kind == "base":
        values = [info.values[x.name] for info in problem.runs]
        if not any(values):  # shared by several components, of which this one has none
            return 1.0, "of the stated value"
        if all(v == values[0] for v in values):
            return float(values[0]), problem.parameter_units.get(x.name, "1")
        return 1.0, "of the stated value"
    if x.kind == "sensor":
        connector, _, quantity = x.name.removeprefix("sensor.").rpartition(".")
        return 1.0, {"bias": problem.units.get(connector, "1"), "scale": "1"}.get(quantity, "s")
    return 1.0, problem.parameter_units.get(x.name, "1")


def per_channel(problem: Problem, before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Physical RMS of whitened residuals per channel."""
    made = {}
    obs = problem.obs
    for k, label in enumerate(problem.labels):
        mine = obs.channel == k
        if mine.any():
            made[label] = {
                "unit": problem.units.get(label, "1") if k < len(problem.campaign.outputs) else "s",
                "rms_before": rms(before[mine] * obs.floor[mine]),
                "rms_after": rms(after[mine] * obs.floor[mine]),
                "noise_floor": rms(obs.floor[mine]),
            }
    return made


def per_run(d: Diagnosis, before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Whitened RMS per run; of several runs of which none is held out, also as the others alone foretell each."""
    s, made = d.study, {}
    others: list[float] = []
    if s.held is None and len(s.problem.runs) > 1:
        others = by_run(s.problem, d.chosen.hypothesis.fit, s.nuisance)
    for r, info in enumerate(s.scoring.runs):
        mine = s.scoring.obs.run == r
        made[info.name] = {"before": rms(before[mine]), "after": rms(after[mine])}
        if others:
            made[info.name]["after_from_other_runs"] = others[r]
    return made


def per_region(masks: dict[str, np.ndarray], before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Whitened RMS per region."""
    return {name: {"before": rms(before[m]), "after": rms(after[m])} for name, m in masks.items()}


def make(d: Diagnosis) -> dict[str, Any]:
    """The contents of diagnosis.json."""
    s = d.study
    problem = s.problem
    scoring, before, after = s.scoring, s.before, s.after(d.chosen)
    g0, g1, g2 = rms(before), s.gap(s.null_judged), s.gap(d.chosen)
    step = rms(s.numerical / problem.obs.floor)
    listed = []
    for c in d.causes:
        entry: dict[str, Any] = {
            "effects": list(c.effects), "probability": c.probability,
            "ambiguous_with": [e[0] if len(e) == 1 else list(e) for e in c.ambiguous_with],
        }  # fmt: skip
        if c.judged is not None and c.told:
            gap = s.gap(c.judged)
            entry["parameters"] = parameters(problem, c.judged, s.nuisance, ("effect", "sensor"))
            entry["gap_after"] = gap
            entry["reduction"] = 1.0 - gap / g0 if g0 > 0 else 0.0
            entry["delta_bic"] = c.judged.score - s.null_judged.score
        listed.append(entry)
    made: dict[str, Any] = {
        "schema": SCHEMA,
        "campaign": problem.campaign.name,
        "verdict": d.verdict,
        "sentence": sentence(d),
        "gap": {
            "metric": "whitened RMS over output channels on held-out data",
            "held_out": s.held_out_how,
            "noise_floor": 1.0,
            "before": g0,
            "after_calibration": g1,
            "after": g2,
            "reduction": 1.0 - g2 / g0 if g0 > 0 else 0.0,
            "reduction_ci95": list(d.reduction_ci),
            "explainable_reduction": float(np.clip((g0 - g2) / (g0 - 1.0), 0.0, 1.0)) if g0 > 1.0 else 0.0,
            "per_channel": per_channel(scoring, before, after),
            "per_run": per_run(d, before, after),
            "per_region": per_region(d.masks, before, after),
        },
        "where": [
            {"subsystem": p.subsystem, "channel": p.channel, "share": p.share, "region": p.region, "bands": p.bands,
             "change_points": [{"run": r, "time": t} for r, t in p.changes]}
            for p in d.places
        ],
        "replay": [
            {"component": r.component, "driven_by": list(r.driven_by), "assumed": list(r.assumed), "rms": r.rms,
             "noise_amplification": r.amplification}
            for r in d.replays
        ],
        "numerical_gap": {"step_halving_rms": step, "ok": bool(step < 0.5)},
        "causes": listed,
        "base_parameters": parameters(problem, d.chosen, s.nuisance, ("base",)),
        "unexplained": {
            "predictable_share": s.structure.share,
            "per_channel": s.structure.channels,
            "varies_with": s.structure.varies_with,
        },
        "next_experiment": None,
        "warnings": d.warnings,
        "timing": {"wall_s": d.seconds, "simulations": s.problem.pool.count, "stages": s.stages},
    }  # fmt: skip
    made["evidence"] = evidence(d)
    if any(b.moment is not None for b in problem.obs.blocks):
        made["events"] = events(d)
        made["contrasts"] = contrasts(problem, made["events"])
    if d.next is not None:
        made["next_experiment"] = _step(d.next)
    if d.channel is not None:
        made["next_channel"] = _step(d.channel)
    return made


def _step(n: Next) -> dict[str, Any]:
    return {
        "change": n.change,
        "separates": [list(e) for e in n.separates],
        "expected_separation": n.separation,
    }


def events(d: Diagnosis) -> list[dict[str, Any]]:
    """Measured moments beside those of the model as delivered, refitted, and with the cause [s]."""
    s = d.study
    fits = {"refitted": s.null_judged.hypothesis.fit, "with_cause": d.chosen.hypothesis.fit}
    made = []
    for b in s.problem.obs.blocks:
        if b.moment is None:
            continue
        limit = "at most" if np.isfinite(b.moment.low) else "at least" if np.isfinite(b.moment.high) else ""
        made.append(
            {"run": s.problem.runs[b.run].name, "event": s.problem.labels[b.channel], "limit": limit,
             "measured": float(b.y[0]), "std": b.floor, "delivered": float(s.delivered[b.place][0]),
             **{name: float(fit.model[b.place][0]) for name, fit in fits.items()}}
        )  # fmt: skip
    return made


def contrasts(problem: Problem, found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """How much longer an event took in one run than in another that differs in one stated condition only [s].

    What such runs share, errors of the base parameters above all, cancels in the difference.
    """
    stated = {run.name: run.parameters for run in problem.campaign.runs}
    keys = ("measured", "delivered", "refitted", "with_cause")
    made = []
    for i, a in enumerate(found):
        for b in found[i + 1 :]:
            ours, theirs = stated[a["run"]], stated[b["run"]]
            changed = [k for k in {**ours, **theirs} if ours.get(k) != theirs.get(k)]
            if a["event"] == b["event"] and len(changed) == 1 and not (a["limit"] or b["limit"]):
                apart = {k: a[k] - b[k] for k in keys}
                std = float(np.hypot(a["std"], b["std"]))
                made.append(
                    {"runs": [a["run"], b["run"]], "event": a["event"], "changed": changed[0], **apart, "std": std}
                )
    return made


def evidence(d: Diagnosis) -> dict[str, Any]:
    """What the probabilities rest on: every hypothesis that was fitted, and what screening said of each effect."""
    s = d.study
    return {
        "readings": len(s.problem.obs),
        "unknown_features": d.features,
        "hypotheses": [
            {"effects": list(j.hypothesis.ids), "label": j.hypothesis.label, "unknowns": len(j.hypothesis.fit.u),
             "fit_rms": j.hypothesis.fit.rms, "held_out_rms": j.gap, "held_out_shared": j.shared,
             "dispersion": j.hypothesis.fit.phi,
             "score": j.score, "terms": j.terms}
            for j in s.judged
        ],
        "screening": [{"effect": q.candidate.id, "label": q.candidate.label, "explains": q.gain} for q in s.screened],
    }  # fmt: skip


def sentence(d: Diagnosis) -> str:
    """The verdict for a person, in one sentence."""
    s = d.study
    g0, g2 = rms(s.before), s.gap(d.chosen)
    top = d.causes[0]
    if d.verdict == "no_significant_gap":
        return (
            f"No effect is missing: refitting the base parameters within their tolerance brings the gap from "
            f"{g0:.1f} to {s.gap(s.null_judged):.1f} times the noise floor."
        )
    if d.verdict == "unknown_effect":
        nearest = " + ".join(d.chosen.hypothesis.ids) or "the refit of the base parameters"
        return (
            f"Something that the catalogue does not have: what comes nearest, {nearest}, still leaves {g2:.1f} times "
            f"the noise floor (from {g0:.1f}), most of it in {d.places[0].channel} ({d.places[0].region})."
        )
    texts = {c.id: c.text for c in s.problem.candidates}
    what = "; and ".join(f"{e} ({texts[e]})" for e in top.effects)
    return (
        f"The gap comes from {what}: with it the gap falls from {g0:.1f} to {g2:.1f} times the noise floor "
        f"(probability {top.probability:.0%})."
    )


def write(d: Diagnosis, folder: Path) -> dict[str, Any]:
    """Write diagnosis.json and calibrated.ssv; returns the contents of the former."""
    data = make(d)
    make_folder(folder)
    with writing(folder):
        (folder / "diagnosis.json").write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (folder / "calibrated.ssv").write_text(parameter_set(d), encoding="utf-8")
    return data


def parameter_set(d: Diagnosis) -> str:
    """The parameters of the chosen hypothesis as an SSV file; conditions that the runs state are not in it."""
    from xml.sax.saxutils import quoteattr

    problem = d.study.problem
    point = d.chosen.hypothesis.fit.point
    found, varied = problem.found(0, point), problem.varied(point)
    values = problem.runs[0].values
    lines = []
    wanted = {t: value for name, value in found.items() if name not in varied for t in matching(name, values)}
    for target, value in sorted(wanted.items()):
        if isinstance(value, bool) or isinstance(values[target], bool):
            body = f"<ssv:Boolean value={quoteattr(str(bool(value)).lower())}/>"
        elif isinstance(values[target], int):
            body = f"<ssv:Integer value={quoteattr(str(int(value)))}/>"
        elif isinstance(value, str):
            body = f"<ssv:String value={quoteattr(value)}/>"
        else:
            body = f"<ssv:Real value={quoteattr(repr(float(value)))}/>"
        lines.append(f"    <ssv:Parameter name={quoteattr(target)}>{body}</ssv:Parameter>")
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
        'name="calibrated">\n  <ssv:Parameters>\n' + "\n".join(lines) + "\n  </ssv:Parameters>\n</ssv:ParameterSet>\n"
    )
