"""diagnosis.json and calibrated.ssv: a study in the formats that others read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import make_folder, writing
from ..analysis.experiment_design import NextMeasurement
from ..estimation.cross_validation import predict_each_run
from ..estimation.uncertainty import parameter_std
from ..pipeline.diagnosis import Diagnosis
from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter
from ..problem.problem import Problem, matching
from ..selection.evidence import RankedHypothesis

SCHEMA = 1


def parameters(
    problem: Problem, ranked: RankedHypothesis, nuisance_jacobian: np.ndarray, kinds: tuple[str, ...]
) -> dict[str, Any]:
    """Value, 95 % interval, unit and whether it is at a bound, of a hypothesis' unknowns of these kinds."""
    fit = ranked.hypothesis.fit
    std = parameter_std(problem, fit, nuisance_jacobian)
    made = {}
    for x, u, s in zip(fit.parameters, fit.normalised, std, strict=True):
        if x.kind not in kinds:
            continue
        low, high = (
            max(x.low, u - problem.settings.uncertainty.width * s),
            min(x.high, u + problem.settings.uncertainty.width * s),
        )
        factor, unit = _scale(problem, x)
        ends = sorted((x.value(low) * factor, x.value(high) * factor))
        at_bound = bool(u - x.low < 1e-6 * (x.high - x.low) or x.high - u < 1e-6 * (x.high - x.low))
        made[x.name] = {"value": x.value(u) * factor, "ci95": ends, "unit": unit, "at_bound": at_bound}
    return made


def _scale(problem: Problem, x: EstimatedParameter) -> tuple[float, str]:
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
    observations = problem.observations
    for k, label in enumerate(problem.labels):
        mine = observations.channel == k
        if mine.any():
            made[label] = {
                "unit": problem.units.get(label, "1") if k < len(problem.campaign.outputs) else "s",
                "rms_before": rms(before[mine] * observations.noise_std[mine]),
                "rms_after": rms(after[mine] * observations.noise_std[mine]),
                "noise_floor": rms(observations.noise_std[mine]),
            }
    return made


def per_run(d: Diagnosis, before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Whitened RMS per run; of several runs of which none is held out, also as the others alone foretell each."""
    s, made = d.state, {}
    others: list[float] = []
    if s.holdout is None and len(s.problem.runs) > 1:
        others = predict_each_run(s.problem, d.state.chosen.hypothesis.fit, s.nuisance_jacobian)
    for r, info in enumerate(s.scoring.runs):
        mine = s.scoring.observations.run == r
        made[info.name] = {"before": rms(before[mine]), "after": rms(after[mine])}
        if others:
            made[info.name]["after_from_other_runs"] = others[r]
    return made


def per_region(masks: dict[str, np.ndarray], before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Whitened RMS per region."""
    return {name: {"before": rms(before[m]), "after": rms(after[m])} for name, m in masks.items()}


def make(d: Diagnosis) -> dict[str, Any]:
    """The contents of diagnosis.json."""
    s = d.state
    problem = s.problem
    scoring, before, after = s.scoring, s.before, s.after(d.state.chosen)
    g0, g1, g2 = rms(before), s.gap(s.ranked_baseline), s.gap(d.state.chosen)
    step = rms(s.step_change / problem.observations.noise_std)
    listed = []
    for c in d.state.causes:
        entry: dict[str, Any] = {
            "effects": list(c.effects), "probability": c.probability,
            "ambiguous_with": [e[0] if len(e) == 1 else list(e) for e in c.ambiguous_with],
        }  # fmt: skip
        if c.ranked is not None and c.told:
            gap = s.gap(c.ranked)
            entry["parameters"] = parameters(problem, c.ranked, s.nuisance_jacobian, ("effect", "sensor"))
            entry["gap_after"] = gap
            entry["reduction"] = 1.0 - gap / g0 if g0 > 0 else 0.0
            entry["delta_bic"] = c.ranked.neg2_log_posterior - s.ranked_baseline.neg2_log_posterior
        listed.append(entry)
    made: dict[str, Any] = {
        "schema": SCHEMA,
        "campaign": problem.campaign.name,
        "verdict": d.state.verdict,
        "sentence": sentence(d),
        "gap": {
            "metric": "whitened RMS over output channels on held-out data",
            "held_out": s.held_out_how,
            "noise_floor": 1.0,
            "before": g0,
            "after_calibration": g1,
            "after": g2,
            "reduction": 1.0 - g2 / g0 if g0 > 0 else 0.0,
            "reduction_ci95": list(d.state.reduction_ci),
            "explainable_reduction": float(np.clip((g0 - g2) / (g0 - 1.0), 0.0, 1.0)) if g0 > 1.0 else 0.0,
            "per_channel": per_channel(scoring, before, after),
            "per_run": per_run(d, before, after),
            "per_region": per_region(d.state.masks, before, after),
        },
        "where": [
            {"subsystem": p.subsystem, "channel": p.channel, "share": p.share, "region": p.region, "bands": p.bands,
             "change_points": [{"run": r, "time": t} for r, t in p.changes]}
            for p in d.state.places
        ],
        "replay": [
            {"component": r.component, "driven_by": list(r.driven_by), "assumed": list(r.assumed), "rms": r.rms,
             "noise_amplification": r.amplification}
            for r in d.state.replays
        ],
        "numerical_gap": {"step_halving_rms": step, "ok": bool(step < 0.5)},
        "causes": listed,
        "base_parameters": parameters(problem, d.state.chosen, s.nuisance_jacobian, ("base",)),
        "unexplained": {
            "predictable_share": s.structure.share,
            "per_channel": s.structure.channels,
            "varies_with": s.structure.varies_with,
        },
        "next_experiment": None,
        "warnings": list(d.state.warnings),
        "timing": {"wall_s": d.seconds, "simulations": d.simulations, "stages": dict(s.seconds)},
    }  # fmt: skip
    made["evidence"] = evidence(d)
    if any(b.event is not None for b in problem.observations.blocks):
        made["events"] = events(d)
        made["contrasts"] = contrasts(problem, made["events"])
    options = d.state.next_measurements
    if options:
        made["next_experiment"] = _step(options[0])
    channel = next((n for n in options if "channel" in n.change), None)
    if channel is not None:
        made["next_channel"] = _step(channel)
    return made


def _step(n: NextMeasurement) -> dict[str, Any]:
    return {
        "change": n.change,
        "separates": [list(e) for e in n.separates],
        "expected_separation": n.separation,
    }


def events(d: Diagnosis) -> list[dict[str, Any]]:
    """Measured moments beside those of the model as delivered, refitted, and with the cause [s]."""
    s = d.state
    fits = {"refitted": s.ranked_baseline.hypothesis.fit, "with_cause": d.state.chosen.hypothesis.fit}
    made = []
    for b in s.problem.observations.blocks:
        if b.event is None:
            continue
        limit = "at most" if np.isfinite(b.event.low) else "at least" if np.isfinite(b.event.high) else ""
        made.append(
            {"run": s.problem.runs[b.run].name, "event": s.problem.labels[b.channel], "limit": limit,
             "measured": float(b.y[0]), "std": b.noise_std, "delivered": float(s.nominal[b.place][0]),
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
    s = d.state
    return {
        "readings": len(s.problem.observations),
        "unknown_features": list(d.state.features),
        "hypotheses": [
            {"effects": list(j.hypothesis.ids), "label": j.hypothesis.label, "unknowns": len(j.hypothesis.fit.normalised),
             "fit_rms": j.hypothesis.fit.rms, "held_out_rms": j.gap, "held_out_shared": j.structured_energy,
             "dispersion": j.hypothesis.fit.dispersion,
             "score": j.neg2_log_posterior, "terms": j.terms}
            for j in s.ranked
        ],
        "screening": [{"effect": q.candidate.id, "label": q.candidate.label, "explains": q.gain} for q in s.curves],
    }  # fmt: skip


def sentence(d: Diagnosis) -> str:
    """The verdict for a person, in one sentence."""
    s = d.state
    g0, g2 = rms(s.before), s.gap(d.state.chosen)
    top = d.state.causes[0]
    if d.state.verdict == "no_significant_gap":
        return (
            f"No effect is missing: refitting the base parameters within their tolerance brings the gap from "
            f"{g0:.1f} to {s.gap(s.ranked_baseline):.1f} times the noise floor."
        )
    if d.state.verdict == "unknown_effect":
        nearest = " + ".join(d.state.chosen.hypothesis.ids) or "the refit of the base parameters"
        return (
            f"Something that the catalogue does not have: what comes nearest, {nearest}, still leaves {g2:.1f} times "
            f"the noise floor (from {g0:.1f}), most of it in {d.state.places[0].channel} ({d.state.places[0].region})."
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

    problem = d.state.problem
    point = d.state.chosen.hypothesis.fit.point
    found, varied = problem.model_values(0, point), problem.differing_values(point)
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
