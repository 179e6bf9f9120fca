"""The greedy search: fits of plausible effects, then of one more beside each of the best.

A later search replaces it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..estimation.cross_validation import held_out
from ..estimation.fit import FitTask
from ..estimation.gauss_newton import fit, with_wide_differences
from ..estimation.scheduler import run_fits
from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from .greedy_screening import MUCH, STARTS_KEPT, ResponseCurve, point_at
from .hypothesis import Hypothesis, best_of_each, is_adequate

KEPT, CLOSE = 3, 8.0
"""Of these, so many are fitted to the end, and as many again if their merit is not further from the best."""

HARDLY, AROUND, MORE = 0.1, 0.3, 4
"""Size, in usual ones, up to which an effect is hardly there; how far around, in u, the fit without it then starts too,
and how often."""

RIVAL, BEHIND = 1.3, 4.0
"""RMS of a fit from which, after a few iterations, another may still get where one has settled; and how many times the
best one's another may have to be carried on where nothing is settled."""

QUICK, TASTE, MOST = 3, 2, 8
"""Steps of a fit: of a first look, after which hopeless ones are left, and at most."""


def _first_look(problem: Problem, s: ResponseCurve, nuisance_jacobian: np.ndarray, iterations: int) -> FitTask:
    """A quick fit that starts from that of a response curve, with its candidate added."""
    at, new = s.at, s.candidate.parameters
    amount = s.amount if abs(s.amount) > 1e-3 else float(np.clip(0.1 * np.sign(s.size), new[0].low, new[0].high))
    at_start = point_at(s.candidate, amount, s.shape)
    u = np.concatenate([s.base if len(s.base) else at.normalised, [at_start[x.name] for x in new]])
    return fit(problem, (*at.parameters, *new), u, nuisance_jacobian, iterations, like=at)


def finish_fit(problem: Problem, h: Hypothesis, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The hypothesis fitted to the end, with the derivatives that judging rests on.

    Those for larger moves serve, unless the fit's own foretell better what is left out: where a machine sticks and
    slips, larger moves are another motion.
    """
    h = continue_fits(problem, [h], nuisance_jacobian, MOST)[0]
    if h.finished:
        return h
    found = run_fits(problem, [with_wide_differences(problem, h.fit, nuisance_jacobian)])[0]
    if found is None:
        return replace(h, finished=True)
    own = replace(found, jacobian=h.fit.jacobian)
    best = min(found, own, key=lambda f: held_out(problem, f, nuisance_jacobian).structured_energy)
    return replace(h, fit=best, finished=True)


def drop_effect(
    problem: Problem, h: Hypothesis, gone: EffectCandidate, nuisance_jacobian: np.ndarray, iterations: int
) -> Hypothesis | None:
    """The hypothesis without one of its effects, fitted from where it stands; None where the model does not run.

    Where the effect is hardly there, the fit also starts from points around: what so little does the base parameters
    may do as well, but a machine that drifts through its valve's closed centre shows the way to it from few points.
    """
    kept = np.array([x not in gone.parameters for x in h.fit.parameters])
    parameters = tuple(x for x, keep in zip(h.fit.parameters, kept, strict=True) if keep)
    starts = [h.fit.normalised[kept]]
    amounts = [
        u for x, u in zip(h.fit.parameters, h.fit.normalised, strict=True) if x in gone.parameters and not x.shape
    ]
    if all(abs(u) < HARDLY for u in amounts):
        moved = np.array([AROUND * (x.kind == "base") for x in parameters])
        low, high = np.array([x.low for x in parameters]), np.array([x.high for x in parameters])
        random = np.random.default_rng(0)
        starts += [np.clip(starts[0] + moved * random.normal(size=len(moved)), low, high) for _ in range(MORE)]
    ends = run_fits(problem, [fit(problem, parameters, u, nuisance_jacobian, iterations) for u in starts])
    left = tuple(c for c in h.candidates if c is not gone)
    found = [Hypothesis(left, end) for end in ends if end is not None]
    return min(found, key=lambda h: h.penalised_deviance, default=None)


def forward_step(
    problem: Problem, at: Hypothesis, found: Sequence[ResponseCurve], nuisance_jacobian: np.ndarray, most: int,
    kept: int, others: Sequence[ResponseCurve] = (),
) -> list[Hypothesis]:  # fmt: skip
    """Fits of a hypothesis with one candidate more: `most` are begun, about `kept` carried to the end. Best first.

    Near the data, what was found to promise most goes on in any case: a first look may stop on its way.
    """
    have = {c.label for c in at.candidates}
    chosen = [*[s for s in found if s.candidate.label not in have][:most], *others]
    begun = run_fits(problem, [_first_look(problem, s, nuisance_jacobian, QUICK) for s in chosen])
    made = [
        Hypothesis((*at.candidates, s.candidate), f, quick=True)
        for s, f in zip(chosen, begun, strict=True) if f is not None
    ]  # fmt: skip

    def cost(k: int) -> float:
        return made[k].penalised_deviance

    def go_on(which: Sequence[int], iterations: int) -> None:
        fitted = continue_fits(problem, [made[k] for k in which], nuisance_jacobian, iterations)
        for k, h in zip(which, fitted, strict=True):
            made[k] = h

    every = range(len(made))
    promised = list(every[: (kept + 1) // 2]) if at.fit.rms < MUCH else []
    elsewhere = sorted(every[len(chosen) - len(others) :] if others else [], key=cost)[:STARTS_KEPT]
    order = sorted(every, key=cost)
    going = order[:kept] + [k for k in order[kept : 2 * kept] if cost(k) < cost(order[0]) + CLOSE]
    for k in (*elsewhere, *promised):
        if k not in going:
            going.append(k)
    going = [k for k in going if made[k].fit.rms < BEHIND * max(made[order[0]].fit.rms, 1.0)]
    go_on(going, TASTE)
    best = min((made[k].fit.rms for k in going), default=0.0)
    far = RIVAL if any(is_adequate(problem, made[k].fit) for k in going) else BEHIND * best
    going = sorted((k for k in going if made[k].fit.rms < far), key=cost)
    go_on(going[:kept], MOST)
    return best_of_each([made[k] for k in order], lambda h: h.penalised_deviance)


def continue_fits(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray, iterations: int
) -> list[Hypothesis]:
    """The hypotheses, those that have not arrived fitted on where that does not make them worse."""
    made = list(hypotheses)
    going = [k for k, h in enumerate(made) if h.quick or not h.fit.converged]
    tasks = []
    for h in (made[k] for k in going):
        at = None if h.quick else h.fit
        tasks.append(fit(problem, h.fit.parameters, h.fit.normalised, nuisance_jacobian, iterations, at=at))
    for k, f in zip(going, run_fits(problem, tasks), strict=True):
        h = made[k]
        if f is not None and (h.quick or replace(h, fit=f).penalised_deviance < h.penalised_deviance + 1.0):
            made[k] = replace(h, fit=f, quick=False, finished=False)
    return made
