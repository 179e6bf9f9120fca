"""Whether the parameters of the package and the runs are where the catalogue expects them."""

from __future__ import annotations

from ..problem.problem import Problem
from .shape_mistakes import Finding


def check_catalogue_values(problem: Problem) -> list[Finding]:
    """Parameters of effects outside the range of a fit, and a catalogue without effects."""
    found: dict[str, Finding] = {}
    for conditions in problem.runs:
        for effect in problem.catalogue.effects:
            for p in effect.all_parameters:
                value = conditions.values.get(p.address)
                if not isinstance(value, (int, float)) or isinstance(value, bool) or p.low <= value <= p.high:
                    continue
                run = conditions.name if p.address in conditions.stated else ""
                bounds = f"the catalogue's bounds, {p.low:g} to {p.high:g} ({effect.id})"
                text = f"{p.address} = {value:g} is outside {bounds}"
                found.setdefault(f"{run} {p.address}", Finding(run, "", text))
    if not problem.catalogue.effects:
        found[""] = Finding("", "", "the catalogue has no effects of the model: nothing but sensors could be accused")
    return list(found.values())
