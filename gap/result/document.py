"""The contents of diagnosis.json, schema 2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..analysis.budget import Alternative, split
from ..analysis.character import nearest_effects
from ..analysis.experiment_design import NextMeasurement
from ..analysis.verdict import NO_GAP
from ..estimation.cross_validation import predict_each_run
from ..pipeline.diagnosis import Diagnosis
from ..pipeline.state import State
from ..problem.noise import rms
from .curves import curves
from .events import contrasts, events, has_events
from .forms import form
from .headline import cautions, headline
from .naming import members
from .observations import observations
from .parameters import moved_base, parameters

SCHEMA = 2

METRIC = (
    "share of what a refit within the tolerances leaves: squared normalised residual above the noise, held-out data"
)


def document(d: Diagnosis) -> dict[str, Any]:
    """All that was found, as JSON values."""
    s = d.state
    event_list = events(s) if has_events(s) else []
    divided = budget(s)
    chosen, after = s.reported.hypothesis.fit, s.residual_of(s.reported)
    data: dict[str, Any] = {
        "schema": SCHEMA, "campaign": s.problem.campaign.name, "verdict": s.verdict,
        "headline": headline(s, divided, event_list, after), "cautions": cautions(s),
        "finished": not s.unfinished, "unfinished_stage": s.unfinished,
        "budget": divided,
        "calibration": {"moved": moved_base(s.problem, chosen, s.nuisance_jacobian), "accepted": accepted(s)},
        "effects": effects(s),
        "hypotheses": hypotheses(s),
        "reduction": reduction(s, after),
        "observations": observations(s),
        "where": where(s),
        "replay": replay(s),
        "curves": curves(s),
        "next_experiment": None, "next_channel": None,
        "numerics": numerics(s),
        "warnings": list(dict.fromkeys(s.warnings)),
        "timing": {"wall_s": d.seconds, "first_budget_s": s.first_answer or d.seconds, "simulations": d.simulations,
                   "stages": dict(s.seconds)},
        "settings": s.problem.settings.as_dict(),
        "evidence": evidence(s),
        "search": search(s),
        **s.sections,
    }  # fmt: skip
    if event_list:
        data |= {"events": event_list, "contrasts": contrasts(s.problem, event_list)}
    if s.next_measurements:
        data["next_experiment"] = _measurement(s.next_measurements[0])
        channel = next((n for n in s.next_measurements if "channel" in n.change), None)
        data["next_channel"] = None if channel is None else _measurement(channel)
    return data


def budget(s: State) -> dict[str, Any]:
    """What calibration, each effect and nothing account for: in all, by channel, run and region."""
    gap_budget, scoring = s.required_budget, s.scoring
    data: dict[str, Any] = {
        "metric": METRIC, "held_out": s.held_out_how, "noise": 1.0, "delivered": rms(s.nominal_residual),
        "calibrated": gap_budget.calibrated, "explained": gap_budget.explained, "parts": parts(s),
    }  # fmt: skip
    data["per_channel"] = {
        label: _channel(s, k, label) for k, label in enumerate(scoring.labels)
        if (scoring.observations.channel == k).any()
    }  # fmt: skip
    data["per_run"] = _runs(s)
    data["per_region"] = {name: _steps(s, mask) for name, mask in s.masks.items()}
    return data


def parts(s: State) -> list[dict[str, Any]]:
    """The shares; they add up to 1."""
    gap_budget, minor = s.required_budget, s.problem.settings.budget.minor
    texts = {c.id: c.text for c in s.problem.candidates}
    entries = []
    for group, part in sorted(gap_budget.groups.items(), key=lambda item: -item[1].share):
        ids = members(s, group)
        entries.append(
            {"kind": "effect", "group": group, "effects": ids, "text": {e: texts[e] for e in ids},
             "share": part.share, "ci95": list(part.ci95), "inclusion_probability": s.inclusion.groups[group],
             "minor": part.share < minor, "within_group": _within(s, group), "form": form(s, ids),
             "parameters": _part_parameters(s, ids)}
        )  # fmt: skip
    rest = gap_budget.unexplained
    named = [id for id in s.inclusion.effects if s.is_named(id)]
    gains = _gains(s)
    character = s.character.text if s.character is not None and s.verdict != NO_GAP else "within the noise"
    something = s.character is not None and bool(s.character.channel)
    count = s.problem.settings.analysis.nearest if something else 0
    entries.append(
        {"kind": "unexplained", "share": rest.share, "ci95": list(rest.ci95), "rms": gap_budget.explained,
         "character": character, "nearest": list(nearest_effects(gains, named, count))}
    )  # fmt: skip
    return entries


def _gains(s: State) -> dict[str, float]:
    """Share that each effect alone could explain, of any of its channels."""
    gains: dict[str, float] = {}
    for c in s.problem.candidates:
        gains[c.id] = max(gains.get(c.id, 0.0), s.shares_alone.get(c.label, 0.0))
    return {id: gain for id, gain in sorted(gains.items(), key=lambda item: -item[1]) if gain > 0.0}


def _within(s: State, group: str) -> dict[str, float]:
    """How the probability of a group is divided among its effects; adds up to 1."""
    raw: dict[str, float] = {}
    for r, p in zip(s.ranked, s.probabilities, strict=True):
        for id in r.hypothesis.ids:
            if s.inclusion.group_of[id] == group:
                raw[id] = raw.get(id, 0.0) + p
    least = 1e-3 * sum(raw.values())
    raw = {id: p for id, p in sorted(raw.items(), key=lambda item: -item[1]) if p >= least}
    total = sum(raw.values()) or 1.0
    return {id: p / total for id, p in raw.items()}


def _part_parameters(s: State, ids: Sequence[str]) -> dict[str, Any]:
    """Parameters of some effects in the most probable hypothesis that has one of them."""
    best = next((r for r in s.ranked if set(ids) & set(r.hypothesis.ids)), None)
    if best is None:
        return {}
    fit = best.hypothesis.fit
    names = {x.name for c in best.hypothesis.candidates if c.id in ids for x in c.parameters}
    values = parameters(s.problem, fit, s.nuisance_jacobian, ("effect", "sensor"))
    return {name: value for name, value in values.items() if name in names}


def _steps(s: State, mask: np.ndarray) -> dict[str, float]:
    """Normalised RMS of the readings of a mask (n,), as delivered, calibrated and explained."""
    calibrated = s.alternatives[0].residuals[frozenset()]
    return {
        "noise": 1.0, "delivered": rms(s.nominal_residual[mask]), "calibrated": rms(calibrated[mask]),
        "explained": _rms_left(s.alternatives, mask),
    }  # fmt: skip


def _rms_left(alternatives: Sequence[Alternative], mask: np.ndarray, scale: np.ndarray | float = 1.0) -> float:
    """RMS of what the alternatives leave of the readings of a mask (n,), averaged with their probabilities."""
    squares = [a.probability * rms((a.residuals[a.labels] * scale)[mask]) ** 2 for a in alternatives]
    return float(np.sqrt(sum(squares)))


def _masked_parts(s: State, mask: np.ndarray) -> list[dict[str, Any]]:
    divided = split(s.alternatives, mask)
    groups: dict[str, float] = {}
    group_of = {c.label: c.group for c in s.problem.candidates}
    for label, share in divided.effects.items():
        groups[group_of[label]] = groups.get(group_of[label], 0.0) + share
    entries = [{"kind": "effect", "group": g, "share": x} for g, x in sorted(groups.items(), key=lambda i: -i[1])]
    return [*entries, {"kind": "unexplained", "share": divided.unexplained}]


def _channel(s: State, k: int, label: str) -> dict[str, Any]:
    """RMS of a channel in the unit of its FMU, and its parts."""
    compared, noise = s.scoring.observations, s.scoring.observations.noise_std
    in_channel = compared.channel == k
    mask = in_channel & compared.takes_bias
    calibrated = s.alternatives[0].residuals[frozenset()]
    series = k < len(s.problem.campaign.outputs)
    return {
        "unit": s.problem.units.get(label, "1") if series else "s", "noise": rms(noise[mask]),
        "delivered": rms((s.nominal_residual * noise)[mask]), "calibrated": rms((calibrated * noise)[mask]),
        "explained": _rms_left(s.alternatives, mask, noise), "parts": _masked_parts(s, in_channel),
    }  # fmt: skip


def _runs(s: State) -> dict[str, Any]:
    """Normalised RMS of each run and its parts; of several runs of which none is held out, also as the others alone
    foretell it."""
    predicted: list[float] = []
    if s.holdout is None and len(s.problem.runs) > 1:
        predicted = predict_each_run(s.problem, s.reported.hypothesis.fit, s.nuisance_jacobian)
    entries = {}
    for r, conditions in enumerate(s.scoring.runs):
        mask = s.scoring.observations.run == r
        entries[conditions.name] = {**_steps(s, mask), "parts": _masked_parts(s, mask)}
        if predicted:
            entries[conditions.name]["foretold_by_others"] = predicted[r]
    return entries


def accepted(s: State) -> dict[str, Any]:
    """The effects that are known to be there, with their parameters in the most probable hypothesis."""
    values = parameters(s.problem, s.reported.hypothesis.fit, s.nuisance_jacobian, ("effect", "sensor"))
    entries: dict[str, Any] = {}
    for c in s.problem.accepted:
        entry = entries.setdefault(c.id, {"text": c.text, "parameters": {}})
        entry["parameters"] |= {x.name: values[x.name] for x in c.parameters}
    return entries


def effects(s: State) -> dict[str, Any]:
    """Every effect of the catalogue that is not taken as known."""
    shares: dict[str, float] = {}
    ids = {c.label: c.id for c in s.problem.candidates}
    for label, share in s.required_budget.effects.items():
        shares[ids[label]] = shares.get(ids[label], 0.0) + share
    return {
        id: {"inclusion_probability": p, "share": shares.get(id, 0.0), "group": s.inclusion.group_of[id]}
        for id, p in sorted(s.inclusion.effects.items(), key=lambda item: -item[1])
    }


def hypotheses(s: State) -> list[dict[str, Any]]:
    """The most probable ones; of the first their parameters, too."""
    settings = s.problem.settings.analysis
    entries = []
    for k, (r, p) in enumerate(zip(s.ranked, s.probabilities, strict=True)):
        if k == settings.max_listed_hypotheses:
            break
        fit = r.hypothesis.fit
        values: dict[str, Any] = {}
        if k < settings.max_with_parameters:
            values = parameters(s.problem, fit, s.nuisance_jacobian, ("effect", "sensor"))
        entries.append(
            {"effects": list(r.hypothesis.ids), "label": r.hypothesis.label, "probability": p, "left": r.gap,
             "status": fit.status, "forms": {c.id: c.form.id for c in r.hypothesis.candidates if c.form is not None},
             "parameters": values}
        )  # fmt: skip
    return entries


def reduction(s: State, after: np.ndarray) -> dict[str, Any]:
    """How far the gap as delivered shrinks on held-out data; after: what the chosen set leaves of it (n,)."""
    before = rms(s.nominal_residual)
    value = 1.0 - rms(after) / before if before > 0.0 else 0.0
    low, high = s.reduction_ci
    return {"value": value, "ci95": [min(low, value), max(high, value)], "how": s.held_out_how}


def where(s: State) -> list[dict[str, Any]]:
    """Channels by their share in what calibration leaves."""
    return [
        {"subsystem": p.subsystem, "channel": p.channel, "share": p.share, "region": p.region, "bands": p.bands,
         "change_points": [{"run": r, "time": t} for r, t in p.change_points]}
        for p in s.places
    ]  # fmt: skip


def replay(s: State) -> list[dict[str, Any]]:
    """Components alone, driven with what was measured."""
    return [
        {"component": r.component, "driven_by": list(r.driven_by), "assumed": list(r.assumed), "rms": r.rms,
         "noise_amplification": r.amplification}
        for r in s.replays
    ]  # fmt: skip


def numerics(s: State) -> dict[str, Any]:
    """Method and macro steps [s]; step_error: normalised RMS change under halving of the package's step."""
    d = s.problem.discretisation
    is_known = len(s.step_change) > 0
    error = rms(s.step_change / s.problem.observations.noise_std) if is_known else None
    return {"method": d.method, "step": d.macro_step, "fit_step": d.fit_step, "step_error": error,
            "package_step": s.package_step, "richardson_order": d.richardson_order}  # fmt: skip


def search(s: State) -> dict[str, Any]:
    """Where the search stood: the best sets of effects with their forms and normalised parameters, to go on from."""
    count = s.problem.settings.search.saved_sets
    return {
        "finished": not s.unfinished,
        "sets": [
            {"effects": {c.label: c.form and c.form.id for c in r.hypothesis.candidates},
             "point": {name: u for name, u in r.hypothesis.fit.point.items() if u != 0.0}}
            for r in [*s.ranked[:count], s.ranked_baseline]
        ],
    }  # fmt: skip


def evidence(s: State) -> dict[str, Any]:
    """What the probabilities rest on: every hypothesis that was fitted, and what screening said of each effect."""
    ids = {c.label: c.id for c in s.problem.candidates}
    return {
        "readings": len(s.problem.observations),
        "hypotheses": [
            {"effects": list(r.hypothesis.ids), "label": r.hypothesis.label, "probability": p,
             "parameters": len(r.hypothesis.fit.normalised), "fit_rms": r.hypothesis.fit.rms, "held_out_rms": r.gap,
             "structured_energy": r.structured_energy, "dispersion": r.hypothesis.fit.dispersion,
             "status": r.hypothesis.fit.status, "neg2_log_posterior": r.neg2_log_posterior, "terms": r.terms,
             "curvature": {key: list(values) for key, values in r.curvature._asdict().items()},
             "without_bias": [{"effects": list(ids), "energy": e} for ids, e in r.without_bias.items()]}
            for r, p in zip(s.ranked, s.probabilities, strict=True)
        ],
        "structure": _structure(s),
        "screening": [
            {"effect": ids[label], "label": label, "explains": gain}
            for label, gain in sorted(s.shares_alone.items(), key=lambda item: -item[1])
        ],
    }  # fmt: skip


def _structure(s: State) -> Mapping[str, Any] | None:
    if s.structure is None:
        return None
    x = s.structure
    return {"predictable_share": x.share, "per_channel": x.channels, "varies_with": x.varies_with}


def _measurement(n: NextMeasurement) -> dict[str, Any]:
    return {
        "change": n.change, "separates": [list(e) for e in n.separates], "expected_separation": n.separation,
        "expected_probability": {"now": n.expected[0], "then": n.expected[1]},
    }  # fmt: skip
