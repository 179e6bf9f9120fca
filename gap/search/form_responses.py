"""Effects in other forms than their plain one among a bank's responses.

Pressure that sinks slowly looks like nothing that a pressure lower from the start explains, and a dead zone of four
unequal lands like nothing that four equal ones do: the plain form would never come in for its other ones to be tried.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..problem.curves import CurveForm
from ..problem.parameters import EffectCandidate, EffectForm
from ..problem.problem import Problem
from .response_bank import Response, ResponseBank, Variant, add_responses, rms_left
from .sets import Projection
from .sizes import grid, resized, starts_of_shapes, usual_sizes, variants


def add_forms(problem: Problem, bank: ResponseBank, projection: Projection) -> ResponseBank:
    """The bank with effects in other forms: each parameter of a form where it is farthest from the plain one, and of
    forms with several the mixture of them that takes most of what is left."""
    bank = add_responses(problem, bank, _single_variants(problem, bank))
    return add_responses(problem, bank, _mixed_variants(problem, bank, projection))


def _in_plain_form(problem: Problem, bank: ResponseBank) -> list[EffectCandidate]:
    """The effects that the bank's point lacks and that may be in another form than they are tried in."""
    settings, labels = problem.settings.search, {c.label for c in bank.candidates}
    return [
        c for c in problem.candidates
        if c.label not in labels and c.form is None and len(starts_of_shapes(c)) <= settings.shapes
    ]  # fmt: skip


def _forms(c: EffectCandidate) -> list[EffectForm]:
    return [f for f in c.forms if not isinstance(f, CurveForm)]


def _single_variants(problem: Problem, bank: ResponseBank) -> list[Variant]:
    singles: list[Variant] = []
    for c in _in_plain_form(problem, bank):
        plain = [_sized(problem, bank, c, values) for values in _plain_variants(problem, c)] if _forms(c) else []
        for form in _forms(c):
            neutral = {x.name: 0.0 for x in form.parameters}
            farthest = [{**neutral, x.name: max(x.starts, key=abs)} for x in form.parameters if x.starts]
            singles += [(c.in_form(form), {**values, **at}) for values in plain for at in farthest]
        if any(len(f.parameters) > 1 for f in _forms(c)):  # mixtures of these need the plain form there
            singles += [(c, values) for values in plain if bank.response_to(c, values) is None]
    return singles


def _plain_variants(problem: Problem, c: EffectCandidate) -> list[dict[str, float]]:
    """The plain form to each side, with the first start of its shapes."""
    settings = problem.settings.search
    return variants(c, usual_sizes(c.main, settings), settings)[:: len(starts_of_shapes(c))]


def _sized(
    problem: Problem, bank: ResponseBank, c: EffectCandidate, values: Mapping[str, float]
) -> dict[str, float]:
    """The plain form at the size of the grid at which it would do as much as is left, the usual one where that is not
    known: what a form changes may be another thing at another size."""
    settings, usual = problem.settings.search, values[c.main.name]
    done = bank.rms_of(c, values)
    if done < settings.min_response_rms:
        return dict(values)
    wanted = usual * rms_left(problem, bank) / done
    if not wanted:
        return dict(values)
    same_side = [s for s in grid(c.main, settings) if s * usual > 0.0]
    return resized(c, values, min(same_side, key=lambda s: abs(math.log(s / wanted))))


def _mixed_variants(problem: Problem, bank: ResponseBank, projection: Projection) -> list[Variant]:
    mixed: list[Variant] = []
    for c in _in_plain_form(problem, bank):
        for form in (f for f in _forms(c) if len(f.parameters) > 1):
            names = {x.name for x in form.parameters}
            responses = [x for x in bank.responses if x.candidate == c.in_form(form)]
            for side in (1.0, -1.0):
                of_side = [x for x in responses if x.size * side > 0.0]
                values = {k: v for k, v in of_side[0].values.items() if k not in names} if of_side else {}
                if (plain := bank.response_to(c, values)) is not None:
                    mixture = _mixture(problem, projection, form, plain, of_side)
                    mixed.append((c.in_form(form), {**values, **mixture}))
    return mixed


def _mixture(
    problem: Problem, projection: Projection, form: EffectForm, plain: Response, responses: list[Response]
) -> dict[str, float]:
    """The form's parameters that take most of what is left, as far as what they change adds up."""
    beyond, values = problem.settings.search.form_beyond, {x.name: 0.0 for x in form.parameters}
    sizes = projection.best_sizes(np.stack([plain.change, *(x.change for x in responses)], axis=1))
    whole = float(sizes.sum())
    if abs(whole) < 1e-6 * float(np.abs(sizes).max()):
        return values
    for x, share in zip(responses, sizes[1:] / whole, strict=True):
        parameter = next(p for p in form.parameters if x.values[p.name] != 0.0)
        value = x.values[parameter.name] * float(np.clip(share, -beyond, beyond))
        values[parameter.name] = min(max(value, parameter.low), parameter.high)
    return values
