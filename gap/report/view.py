"""What the page shows, put into words and numbers: the context of the template."""

from __future__ import annotations

import html
import re
from typing import Any

import numpy as np

from ..analysis.localisation import excess_energy
from ..pipeline.diagnosis import Diagnosis
from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter
from ..problem.problem import Problem, matching
from ..selection.posterior import NONE, UNKNOWN, Cause
from . import location, series
from .numbers import change, duration, floors, given, percent, pretty, short, with_interval

PICTURES = 40
"""Most pictures of channels in a page; the runs with the largest gaps come first."""

CHANNELS = 12
"""Most channels of a run that are drawn, those with the largest gaps."""

MUCH = 3.0
"""Gap, in floors, that a cause should not leave."""

ROWS = 8
"""Most causes in the ranking, besides "none" and "unknown"."""

SCREENED = 14
"""Most bars of the screening."""

KINDS = {
    "explained": ("Explained by the catalogue", "explained"),
    "no_significant_gap": ("No effect is missing", "none"),
    "unknown_effect": ("Not in the catalogue", "unknown"),
}

ORDER = {
    "explained": ("pictures", "where", "which", "base", "left", "next", "method"),
    "no_significant_gap": ("pictures", "base", "where", "which", "left", "next", "method"),
    "unknown_effect": ("left", "pictures", "where", "which", "base", "next", "method"),
}


def view(d: Diagnosis, data: dict[str, Any]) -> dict[str, Any]:
    """Everything the template asks for."""
    s = d.state
    problem = s.problem
    badge, kind = KINDS[d.state.verdict]
    best_name = None
    if d.state.chosen.hypothesis.candidates:
        best_name = "with the cause" if d.state.verdict == "explained" else "best attempt"
    context = {
        "title": f"Gap diagnosis: {problem.campaign.name}",
        "campaign": problem.campaign.name,
        "system": problem.campaign.system.name,
        "kind": kind,
        "badge": badge,
        "sentence": _with_code(data["sentence"], d),
        "order": ORDER[d.state.verdict],
        "caution": _caution(d, data),
        "best_name": best_name,
        "best_label": d.state.chosen.hypothesis.label,
        "held_out": data["gap"]["held_out"],
        "held_runs": _few([info.name for info in s.holdout.problem.runs]) if s.holdout else "",
        "effects_tried": len({c.id for c in problem.candidates}),
        "base_count": len(problem.base),
        "run_count": len(problem.runs) + (len(s.holdout.problem.runs) if s.holdout else 0),
        "stages": _stages(data["gap"], best_name),
        "reduction": _reduction(data["gap"]),
        "channels": _channels(d),
        **_pictures(d, best_name),
        "contrasts": [
            {k: short(v) if isinstance(v, float) else v for k, v in c.items()} for c in data.get("contrasts", [])
        ],
        "where": location.where(d),
        "regions": location.regions(d, best_name),
        "bands": location.bands(d),
        "replays": location.replays(d),
        **_causes(d, data),
        "screened": _screened(d),
        "forest": _forest(d, data),
        "left": _left(d),
        "next": _next(d),
        "warnings": list(dict.fromkeys(data["warnings"])),
        "numerical": {**data["numerical_gap"], "text": floors(data["numerical_gap"]["step_halving_rms"])},
        "timing": _timing(data["timing"]),
    }
    context["facts"] = _facts(d, context)
    return context


def _caution(d: Diagnosis, data: dict[str, Any]) -> str:
    """What a reader has to know before trusting the verdict; empty when it is clear."""
    first, second = d.state.causes[0], d.state.causes[1] if len(d.state.causes) > 1 else None
    said = []
    if first.probability < 0.7 and second is not None:
        said.append(f"The verdict is not certain: its probability is {percent(first.probability)}, {_named(second)} "
                    f"has {percent(second.probability)}.")  # fmt: skip
    if d.state.verdict == "explained" and data["gap"]["after_calibration"] < 1.1 * data["gap"]["after"]:
        said.append("The refit alone brings the gap almost as far.")
    if d.state.verdict == "explained" and data["gap"]["after"] > MUCH:
        said.append(f"{floors(data['gap']['after'])} noise floors are left, so there is more to it.")
    if not data["numerical_gap"]["ok"]:
        said.append("The simulation's own step error is not small against the noise.")
    return " ".join(said)


def _named(c: Cause) -> str:
    return {NONE: "no effect at all", UNKNOWN: "something unknown"}.get(c.effects, " + ".join(c.effects))


def _with_code(text: str, d: Diagnosis) -> str:
    """The sentence as HTML, with the ids of effects and connectors set apart."""
    names = {e for c in d.state.causes for e in c.effects if c.ranked is not None}
    names |= {p.channel for p in d.state.places}
    made = html.escape(text)
    for name in sorted(names, key=len, reverse=True):
        made = re.sub(rf"(?<![\w.>]){re.escape(html.escape(name))}(?![\w<])", f"<code>{html.escape(name)}</code>", made)
    return made


def _stages(gap: dict[str, Any], best_name: str | None) -> dict[str, Any]:
    rows = [("as delivered", gap["before"], "delivered")]
    rows.append(("refitted", gap["after_calibration"], "refitted" if best_name else "best"))
    if best_name:
        rows.append((best_name, gap["after"], "best"))
    most = max(1.15, *(g for _, g, _ in rows)) * 1.02
    return {
        "rows": [{"label": n, "text": floors(g), "width": 100.0 * g / most, "colour": c} for n, g, c in rows],
        "floor": 100.0 / most,
    }


def _reduction(gap: dict[str, Any]) -> dict[str, Any]:
    low, high = gap["reduction_ci95"]
    smaller = gap["reduction"] >= 0.0
    return {
        "text": f"{abs(gap['reduction']):.0%}",
        "word": "smaller" if smaller else "larger",
        "interval": f"{low:.0%} to {high:.0%}".replace("-", "−"),
        "explainable": f"{gap['explainable_reduction']:.0%}",
        "above": gap["before"] > 1.0,
    }


def _channels(d: Diagnosis) -> list[dict[str, Any]]:
    s = d.state
    problem, observations = s.scoring, s.scoring.observations
    residuals = {"delivered": s.before, "refitted": s.after(s.ranked_baseline), "best": s.after(d.state.chosen)}
    made = []
    for k, c in enumerate(series.quantities(problem).values()):
        mine = observations.channel == k
        if not mine.any():
            continue
        shown = c.shown
        row: dict[str, Any] = {
            "column": c.name, "connector": c.connector, "unit": shown.unit or "–",
            "floor": short(shown.difference(rms(observations.noise_std[mine]))),
        }  # fmt: skip
        for name, e in residuals.items():
            row[name] = short(shown.difference(rms(e[mine] * observations.noise_std[mine])))
            row[f"{name}_floors"] = floors(rms(e[mine]))
        made.append(row)
    return made


def _pictures(d: Diagnosis, best_name: str | None) -> dict[str, Any]:
    from .plots import Sheet, far_apart

    runs = series.runs(d)
    order = sorted(range(len(runs)), key=lambda i: -runs[i].before)
    units = d.state.problem.parameter_units
    made, drawn = {}, 0
    sheets: dict[bool, Sheet] = {}
    for place, i in enumerate(order):
        run = runs[i]
        chosen = sorted(run.traces, key=lambda t: -t.before)[:CHANNELS]
        chosen = [t for t in run.traces if any(t is c for c in chosen)]
        chosen = chosen[: max(0, PICTURES - drawn)]
        drawn += len(chosen)
        closer = bool(chosen) and far_apart(chosen)
        if chosen and closer not in sheets:
            sheets[closer] = Sheet(best_name, closer)
        figures = [
            {
                "column": t.column, "connector": t.connector, "src": sheets[closer].draw(t), "before": floors(t.before),
                "after": floors(t.after), "changes": ", ".join(f"{x:.1f}" for x in t.changes),
                "alt": f"{t.column} ({t.connector}) in {run.name}: measured and simulated over time, and residuals; "
                f"gap {floors(t.before)} noise floors as delivered, {floors(t.after)} {best_name or 'refitted'}",
            }
            for t in chosen
        ]  # fmt: skip
        made[i] = {
            "name": run.name, "held": run.holdout, "figures": figures, "missing": len(run.traces) - len(figures),
            "first": place == 0, "seconds": short(run.seconds), "before": floors(run.before),
            "refitted": floors(run.refitted), "after": floors(run.after),
            "conditions": [_condition(k, v, units) for k, v in run.conditions.items()],
        }  # fmt: skip
        made[i]["events"] = [
            {
                "name": e.name, "measured": f"{e.limit}{short(e.measured)}", "delivered": short(e.nominal),
                "refitted": short(e.refitted), "best": short(e.best), "floor": short(e.floor, 2),
                "floors": [floors(abs(e.measured - x) / e.floor) for x in (e.nominal, e.refitted, e.best)],
            }
            for e in run.events
        ]  # fmt: skip
    names = list(dict.fromkeys(name for run in runs for name in run.conditions))
    for i, run in enumerate(runs):
        made[i]["cells"] = [given(run.conditions[n]) if n in run.conditions else "–" for n in names]
    return {
        "runs": [made[i] for i in range(len(runs))], "shown_runs": [made[i] for i in order],
        "has_events": any(run.events for run in runs),
        "not_drawn": sum(1 for m in made.values() if not m["figures"] and not m["events"]),
        "condition_names": [{"parts": n.split("."), "unit": pretty(_unit(n, units))} for n in names],
    }  # fmt: skip


def _condition(name: str, value: object, units: dict[str, str]) -> str:
    return "\u00a0".join(x for x in (name, given(value), pretty(_unit(name, units))) if x)


def _unit(name: str, units: dict[str, str]) -> str:
    return next((u for a, u in units.items() if a == name or a.split(".", 1)[1] == name), "1")


def _causes(d: Diagnosis, data: dict[str, Any]) -> dict[str, Any]:
    """The ranking: known causes, "none" and "unknown", and what the rest adds up to."""
    parameters = d.state.problem.parameters
    rows, rest, known = [], [], 0
    for place, (c, entry) in enumerate(zip(d.state.causes, data["causes"], strict=True)):
        plain = c.effects in (NONE, UNKNOWN)
        if not plain:
            if known >= ROWS or (known >= 4 and c.probability < 0.002):
                rest.append(c.probability)
                continue
            known += 1
        row: dict[str, Any] = {
            "first": place == 0, "probability": percent(c.probability), "width": 100.0 * c.probability,
            "parts": [], "said": "", "parameters": [], "ambiguous": "", "gap": "–", "reduction": "–",
        }  # fmt: skip
        if c.effects == NONE:
            row["said"] = "No effect: the refitted base parameters are enough"
        elif c.effects == UNKNOWN:
            row["said"] = "Something that the catalogue does not have"
        if c.ranked is not None:
            row["gap"], row["reduction"] = floors(entry["gap_after"]), percent(entry["reduction"])
            row["parts"] = [{"label": x.label, "text": x.text} for x in c.ranked.hypothesis.candidates]
            row["parameters"] = [_parameter(n, p, parameters[n]) for n, p in entry["parameters"].items()]
        if c.ambiguous_with and (place == 0 or c.probability > 0.05):
            row["ambiguous"] = _listed([" + ".join(e) for e in c.ambiguous_with])
        rows.append(row)
    return {"causes": rows, "rest": {"count": len(rest), "probability": percent(float(sum(rest)))}}


def _parameter(name: str, p: dict[str, Any], x: EstimatedParameter) -> dict[str, Any]:
    value, ends, factor = with_interval(p["value"], p["ci95"])
    limits = sorted((x.value(x.low), x.value(x.high)))
    at = ""
    if p["at_bound"]:
        nearest = min(limits, key=lambda v: abs(v - p["value"]))
        at = f"at the end of its range ({given(nearest)})"
    label = name.rsplit(".", 2)
    return {
        "name": name, "label": ".".join(label[1:]) if name.startswith("sensor.") else label[-1], "value": value,
        "ends": ends, "factor": factor, "unit": pretty(p["unit"]), "neutral": given(x.start), "at_bound": at,
    }  # fmt: skip


def _few(names: list[str], most: int = 4) -> str:
    return ", ".join(names) if len(names) <= most else f"{len(names)} runs"


def _listed(names: list[str], most: int = 4) -> str:
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _screened(d: Diagnosis) -> list[dict[str, Any]]:
    chosen = {c.label for c in d.state.chosen.hypothesis.candidates}
    found = sorted((s for s in d.state.screened if s.gain > 0.005), key=lambda s: -s.gain)[:SCREENED]
    return [
        {
            "label": s.candidate.label, "text": s.candidate.text, "chosen": s.candidate.label in chosen,
            "share": percent(max(0.0, s.gain)), "width": 100.0 * float(np.clip(s.gain, 0.0, 1.0)),
        }
        for s in found
    ]  # fmt: skip


def _forest(d: Diagnosis, data: dict[str, Any]) -> dict[str, Any] | None:
    """Base parameters as deviations from what was delivered, with the tolerance of each."""
    problem = d.state.problem
    base = {x.name: x for x in problem.base}
    rows = []
    for name, p in data["base_parameters"].items():
        x = base[name]
        values = [info.values[name] for info in problem.runs]
        one = p["unit"] != "of the stated value"
        unit = float(values[0]) if one else 1.0
        ends = sorted(v / unit - 1.0 for v in p["ci95"])
        value, interval, factor = with_interval(p["value"], p["ci95"])
        interval = f"({interval}){factor}" if factor else interval
        stated = given(values[0]) if one else _span(values)
        own = pretty(problem.parameter_units.get(name, "1"))
        rows.append(
            {
                "name": name, "stated": f"{stated} {own}".strip(), "value": f"{value}{factor}" if one else f"× {value}",
                "interval": interval, "at": p["value"] / unit - 1.0,
                "low": ends[0], "high": ends[1], "tolerance": x.scale, "at_bound": p["at_bound"],
                "beyond": abs(p["value"] / unit - 1.0) > 1.15 * x.scale,
                "loose": ends[1] - ends[0] > 0.8 * 2.0 * 1.96 * x.sd * x.scale,
            }
        )  # fmt: skip
    if not rows:
        return None
    reach = 1.05 * max(max(abs(r["low"]), abs(r["high"]), 1.3 * r["tolerance"]) for r in rows)

    def place(v: float) -> float:
        return float(np.clip(50.0 + 50.0 * v / reach, 0.0, 100.0))

    step = next(s for s in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0) if reach / s < 3.2 or s == 1.0)
    ticks = [k * step for k in range(-3, 4) if abs(k * step) < 0.97 * reach]
    for r in rows:
        r["change"] = change(r["at"])
        for key, v in (("x", r["at"]), ("x0", r["low"]), ("x1", r["high"])):
            r[key] = place(v)
        r["t0"], r["t1"] = place(-r["tolerance"]), place(r["tolerance"])
        r["tolerance_text"] = f"±{100 * r['tolerance']:.3g}%"
    return {
        "rows": rows,
        "ticks": [{"x": place(t), "text": f"{100 * t:+.3g}%".replace("-", "−") if t else "0"} for t in ticks],
        "loose": any(r["loose"] for r in rows),
    }  # fmt: skip


def _span(values: list[Any]) -> str:
    return f"{given(min(values))} to {given(max(values))}"


def _left(d: Diagnosis) -> dict[str, Any]:
    """What the best hypothesis leaves, by channel, and a picture of the largest part."""
    s = d.state
    problem, observations = s.problem, s.problem.observations
    best = s.ranked[0]
    regions = {p.channel: p for p in d.state.places}
    rows = []
    known = series.quantities(problem)
    for k, (label, c) in enumerate(known.items()):
        mine = observations.channel == k
        if not mine.any():
            continue
        p = regions.get(label)
        share = s.structure.channels.get(label, 0.0)
        gap = rms(best.held_out[mine])
        bands = max(p.bands.items(), key=lambda x: x[1]) if p is not None and sum(p.bands.values()) > 0.5 else None
        rows.append(
            {
                "column": c.name, "connector": c.connector, "gap": gap, "gap_text": floors(gap),
                "share": percent(share), "predictable": share,
                "varies": _varies(known, s.structure.varies_with.get(label, "")) if share > 0.1 else "–",
                "region": p.region if p is not None and gap > 1.1 else "–",
                "band": bands[0].replace("-", "–").replace("> ", "above ") if bands and gap > 1.1 else "–",
                "energy": max(0.0, float(excess_energy(best.held_out[mine]).sum())),
            }
        )  # fmt: skip
    rows.sort(key=lambda r: -r["energy"])
    top = rows[0]
    figures, stands_out = [], False
    if top["gap"] > 1.3 and (top["predictable"] > 0.1 or d.state.verdict == "unknown_effect"):
        from .plots import against

        found = series.dependences(d, top["connector"])
        figures = [
            {
                "src": against(x), "column": x.column, "x": x.x_name, "share": percent(x.share), "odd": x.odd,
                "clear": x.share > 0.05, "kind": "measured" if x.given else "simulated",
                "alt": f"Residual of {x.column} against {x.x_name}: readings and their mean",
            }
            for x in found
        ]  # fmt: skip
        stands_out = bool(found) and found[0].share > 0.3
        if stands_out:
            top["varies"] = found[0].x_name
    return {
        "rows": rows, "share": percent(s.structure.share), "figures": figures, "label": best.hypothesis.label,
        "stands_out": stands_out,
        "gap": floors(best.gap), "little": best.gap < 1.1 or s.structure.share < 0.1, "small": best.gap < 1.1,
        "refit_only": not best.hypothesis.candidates,
    }  # fmt: skip


def _varies(known: dict[str, series.Quantity], name: str) -> str:
    source = name.removeprefix("rate of ")
    shown = known[source].name if source in known else source
    return f"rate of {shown}" if name.startswith("rate of ") else shown


def _next(d: Diagnosis) -> dict[str, Any] | None:
    if not d.state.next_measurements:
        return None
    n = d.state.next_measurements[0]
    problem = d.state.problem
    a, b = (" + ".join(e) or "no effect" for e in n.separates)
    size = n.separation
    how = "clearly apart" if size > 3.0 else "apart" if size > 1.0 else "only a little apart"
    if "channel" in n.change:
        connector = n.change["channel"]
        noise = next((m.noise_std for m in problem.catalogue.measurables if m.connector == connector), None)
        own = problem.units.get(connector, "1")
        brief = f"measure {connector} as well"
        said = f"Measure {connector} as well"
        said += f", with a sensor whose noise is about {short(noise)} {pretty(own)}".rstrip() if noise else ""
    else:
        changes = [_change(problem, k, v) for k, v in n.change.items()]
        brief = "one more run with " + " and ".join(c[0] for c in changes)
        said = f"Repeat {problem.runs[0].name} with " + " and ".join(f"{new}{old}" for new, old in changes)
    return {
        "said": f"{said}.", "brief": brief, "a": a, "b": b, "size": floors(size), "how": how,
    }  # fmt: skip


def _change(problem: Problem, name: str, value: Any) -> tuple[str, str]:
    info = problem.runs[0]
    addresses = matching(name, info.values)
    unit = pretty(next((problem.parameter_units[a] for a in addresses if a in problem.parameter_units), "1"))
    old = info.changes.get(name, info.values.get(addresses[0]) if addresses else None)
    new = f"{name} = {given(value)} {unit}".strip()
    return new, f" (instead of {given(old)} {unit})".replace(" )", ")") if old is not None else ""


def _timing(timing: dict[str, Any]) -> dict[str, Any]:
    return {
        "simulations": timing["simulations"], "wall": duration(timing["wall_s"]),
        "stages": [{"name": n, "text": duration(s)} for n, s in timing["stages"].items()],
    }  # fmt: skip


def _facts(d: Diagnosis, context: dict[str, Any]) -> list[dict[str, str]]:
    """Three things to know, beside the verdict."""
    made = []
    top = context["where"]["rows"][0]
    of = "the gap as delivered" if context["where"]["of"] == "delivered" else "what the refit leaves"
    region = "" if top["region"] in ("everywhere", "nowhere") else f", densest in: {top['region']}"
    made.append({"title": "Where", "text": f"{top['column']} has {top['share']} of {of}{region}"})
    first = d.state.causes[0]
    sure = f"{percent(first.probability)} for this verdict"
    if first.ambiguous_with and d.state.verdict == "explained":
        sure += f"; hard to tell from {_listed([' + '.join(e) for e in first.ambiguous_with], 2)}"
    elif len(d.state.causes) > 1:
        sure += f"; next best: {_named(d.state.causes[1])}, {percent(d.state.causes[1].probability)}"
    made.append({"title": "How sure", "text": sure})
    if d.state.verdict == "unknown_effect" and context["left"]["figures"]:
        f = context["left"]["figures"][0]
        made.append({"title": "Look at", "text": f"what is left of {f['column']}, against {f['x']}"})
    elif context["next"] is not None and d.state.verdict != "no_significant_gap":
        made.append({"title": "Measure next", "text": context["next"]["brief"]})
    elif d.state.verdict == "no_significant_gap":
        made.append({"title": "Use", "text": "the refitted parameters in calibrated.ssv"})
    return made
