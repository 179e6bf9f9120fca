"""The headline: what the gap is made of, in one or two sentences with units."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.verdict import EXPLAINED, NO_GAP, UNEXPLAINED
from ..pipeline.probabilities import at_bound
from ..pipeline.remarks import base_at_tolerance
from ..pipeline.state import State
from ..problem.noise import rms
from .channels import leading_channel
from .naming import part_name, plain, shown_factor
from .numbers import NBSP, listed, multiple, percent, percents, quantity


def headline(state: State, budget: dict[str, Any], events: list[dict[str, Any]], after: np.ndarray) -> str:
    """For people, with plain spaces, so that it can be searched; budget, events: as in diagnosis.json; after:
    normalised residual of the chosen set (n,) on the scoring data."""
    sentences = [_to_settle(state), _physical(state, budget, events, after), _divided(state, budget), *cautions(state)]
    return " ".join(s for s in sentences if s).replace(NBSP, " ")


def _physical(state: State, budget: dict[str, Any], events: list[dict[str, Any]], after: np.ndarray) -> str:
    """What the gap means: seconds of a moment, or the physical RMS of the channel in which effects explain most; where
    none do, of the one that is off most."""
    timed = [e for e in events if not e["limit"] and abs(e["measured"] - e["delivered"]) > 2.0 * e["std"]]
    if timed:
        e = max(timed, key=lambda e: abs(e["measured"] - e["delivered"]) / e["std"])
        difference, word = e["measured"] - e["delivered"], "longer" if e["measured"] > e["delivered"] else "shorter"
        by_effects = (e["explained"] - e["calibrated"]) * (1.0 if difference > 0 else -1.0)
        calibration = (e["calibrated"] - e["delivered"]) * (1.0 if difference > 0 else -1.0)
        moment = f"In {e['run']}, '{e['event']}' takes {quantity(abs(difference), 's')} {word} than the model says"
        parts = f"calibration within the tolerances makes {quantity(calibration, 's')} of that"
        if state.reported.hypothesis.candidates:
            parts += f", {listed([plain(id) for id in state.reported.hypothesis.ids])} {quantity(by_effects, 's')}"
        return f"{moment}; {parts}."
    label = leading_channel(budget)
    c = budget["per_channel"][label]
    factor, unit = shown_factor(state, label)
    delivered, calibrated = (quantity(c[key] * factor, unit) for key in ("delivered", "calibrated"))
    deviation = f"{label} misses the measurement by {delivered} (rms) as delivered, by {calibrated} once calibrated"
    if state.reported.hypothesis.candidates:
        effects = listed([plain(id) for id in state.reported.hypothesis.ids])
        remaining = quantity(_rms_left_in(state, label, after) * factor, unit)
        return f"{deviation} and by {remaining} with {effects} in the model."
    return f"{deviation}; its noise is {quantity(c['noise'] * factor, unit)}."


def _rms_left_in(state: State, label: str, after: np.ndarray) -> float:
    """RMS of what the chosen set leaves of a channel, in the unit of its FMU: the budget's own is an average over all
    plausible sets, with effects in some that are not sure enough to be named."""
    scoring = state.scoring.observations
    in_channel = (scoring.channel == state.scoring.labels.index(label)) & scoring.takes_bias
    return rms((after * scoring.noise_std)[in_channel])


def _divided(state: State, budget: dict[str, Any]) -> str:
    before, after = multiple(budget["delivered"]), multiple(budget["calibrated"])
    accepted = list(dict.fromkeys(plain(c.id) for c in state.problem.accepted))
    accepted_text = f", with {listed(accepted)} taken as known," if accepted else ""
    calibration = (
        f"Calibration within the tolerances{accepted_text} brings the gap from {before} to {after} times the noise"
    )
    if state.verdict == NO_GAP:
        return f"No effect is missing: {calibration[0].lower()}{calibration[1:]}."
    rest = next(p for p in budget["parts"] if p["kind"] == "unexplained")
    unexplained = f"{percent(rest['share'])} is in no effect of the catalogue"
    if state.verdict == UNEXPLAINED:
        nearest = f" (nearest: {listed([plain(e) for e in rest['nearest']], word='or')})" if rest["nearest"] else ""
        return f"{calibration}; what is left is in no effect of the catalogue{nearest}: {rest['character']}."
    effects = [p for p in budget["parts"] if p["kind"] == "effect" and not p["minor"]]
    texts = [_part(state, p) for p in effects if _is_sure_enough(state, p)]
    if not texts:
        return f"{calibration}."
    texts += [_unsure_part(state, p) for p in effects if not _is_sure_enough(state, p)]
    ending = "" if state.verdict == EXPLAINED else f", {unexplained}: {rest['character']}"
    return f"{calibration}; of what is left then, {', '.join(texts)}{ending}."


def _is_sure_enough(state: State, part: dict[str, Any]) -> bool:
    return bool(part["inclusion_probability"] >= state.problem.settings.posterior.named)


def _unsure_part(state: State, part: dict[str, Any]) -> str:
    name = part_name(state, part["group"], part["effects"])
    return f"{percent(part['share'])} goes with {name}, which is unsure ({percent(part['inclusion_probability'])})"


def _part(state: State, part: dict[str, Any]) -> str:
    name = part_name(state, part["group"], part["effects"])
    sure = part["inclusion_probability"] >= state.problem.settings.posterior.sure
    doubt = "" if sure else f"; probably: {percent(part['inclusion_probability'])}"
    return f"{name} makes {percent(part['share'])} ({percents(part['ci95'])}{doubt})"


def _to_settle(state: State) -> str:
    """What has to be settled before anything else is believed."""
    if not state.run_mistakes:
        return ""
    first, more = state.run_mistakes[0], len(state.run_mistakes) - 1
    others = f" And {more} more like that, which cosim-gap check tells." if more else ""
    return f"To be settled first: {first}{others}"


def cautions(state: State) -> list[str]:
    """What contradicts the rest and has to be known with it, a sentence each: they end the headline."""
    sentences = []
    if state.unfinished:
        stopped = f"stopped before everything was tried, while {state.unfinished}"
        sentences.append(f"Not finished: {stopped}; the probabilities allow for that.")
    ends = at_bound(state.reported, frozenset(state.reported.hypothesis.ids))
    if ends:
        hint = "the effect may be another one, or larger than allowed"
        sentences.append(f"{listed(ends)} {_stand(ends)} at the end of the allowed range: {hint}.")
    base = base_at_tolerance(state)
    if base:
        hint = "something that is not calibrated may hide there"
        sentences.append(f"{listed(base, 2)} {_stand(base)} at the end of the tolerance: {hint}.")
    if state.noise_widened:
        sentences.append(state.noise_widened)
    return [text.replace(NBSP, " ") for text in sentences]


def _stand(names: list[str]) -> str:
    return "stands" if len(names) == 1 else "stand"
