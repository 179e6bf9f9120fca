"""All singles, pairs and the promising triples of a bank's responses, each with the size that serves best.

The model is taken as linear in base parameters, nuisances and, between the grid's sizes, in the effects. What base
parameters and nuisances can take up is projected out once; then every set costs a few multiplications of the Gram
matrix of the responses. Sizes stay near those that were run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.linear import profile_nuisances
from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..settings import SearchSettings
from .bank import Bank, Response, Variant, extend, families
from .sizes import grid

Set = tuple[float, tuple[int, ...], np.ndarray]
"""Cost, responses by their place in the bank, and how much each is scaled (s,)."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """A set of effects, where it is expected to fit best, and its expected cost there."""

    candidates: tuple[EffectCandidate, ...]
    point: Point
    cost: float

    @property
    def labels(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset(c.label for c in self.candidates)


class Projected:
    """A bank whose base parameters, own effects and nuisances are projected out, with their priors.

    Costs are squares of the residual over the dispersion, priors, and a price for every effect.
    """

    def __init__(self, problem: Problem, bank: Bank, nuisance_jacobian: np.ndarray, dispersion: float):
        self.problem, self.bank, self.settings = problem, bank, problem.settings.search
        noise, rows, n = problem.observations.noise_std, bank.rows, len(problem.observations)
        kept = len(range(n)[rows])
        scale = np.sqrt(n / kept / dispersion)
        columns = np.concatenate([bank.jacobian, nuisance_jacobian], axis=1) / noise[:, None]
        A = scale * columns[rows]
        r = scale * ((problem.observations.y - bank.model) / noise)[rows]
        D = scale * np.array([x.change for x in bank.responses]).reshape(-1, kept).T
        sd = np.array([*(x.sd for x in bank.parameters), *[1.0] * nuisance_jacobian.shape[1]])
        u = np.array([*(bank.point.get(x.name, 0.0) for x in bank.parameters), *[0.0] * nuisance_jacobian.shape[1]])
        A = np.concatenate([A, np.diag(1.0 / sd)])
        r = np.concatenate([r, -u / sd])
        D = np.concatenate([D, np.zeros((len(sd), D.shape[1]))])
        self.Q, self.R = np.linalg.qr(A)
        self.r, self.D = r, D
        left, columns = r - self.Q @ (self.Q.T @ r), D - self.Q @ (self.Q.T @ D)
        self.gram, self.moment, self.energy = columns.T @ columns, columns.T @ left, float(left @ left)
        removes = np.array([x.removes for x in bank.responses], dtype=bool)
        self.low, self.high = _reach(bank.responses, self.settings)
        self.price = np.where(removes, -1.0, 1.0) * self.settings.price

    def solve(self, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sizes (S, s) that cost least, as multiples of those that were run, and costs (S,), of sets (S, s) of
        responses; within bounds."""
        G = self.gram[sets[:, :, None], sets[:, None, :]]
        t, fitted = bounded_least(G, self.moment[sets], self.low[sets], self.high[sets])
        return t, self.energy + fitted + self.price[sets].sum(axis=1)

    def proposal(self, chosen: Sequence[int], t: np.ndarray, cost: float) -> Proposal:
        """A set of responses at sizes t (s,) with the base parameters that go with it."""
        bank = self.bank
        change = sum((x * self.D[:, i] for i, x in zip(chosen, t, strict=True)), np.zeros(len(self.r)))
        moved = np.linalg.solve(self.R, self.Q.T @ (self.r - change))
        own = self.settings.own_radius
        point = dict(bank.point)
        for x, d in zip(bank.parameters, moved, strict=False):
            u = point.get(x.name, 0.0)
            reach = np.inf if x.kind == "base" else own * max(abs(u), 0.3)
            point[x.name] = float(np.clip(u + np.clip(d, -reach, reach), x.low, x.high))
        gone: set[str] = set()
        added: list[EffectCandidate] = []
        for i, x in zip(chosen, t, strict=True):
            response = bank.responses[i]
            if response.removes:
                gone.add(response.candidate.label)
                for p in response.candidate.parameters:
                    point.pop(p.name, None)
            else:
                added.append(response.candidate)
                point.update(_scaled(response, float(x)))
        kept = [c for c in bank.candidates if c.label not in gone]
        return Proposal((*kept, *added), point, cost)


def bounded_least(
    G: np.ndarray, g: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The t (S, s) within bounds that makes t G t - 2 g t least, for G (S, s, s) and g (S, s), and how much that is.

    It is exact, for effects that act alike make a long narrow valley: where the free solution lies outside, one of the
    sizes is at one of its bounds.
    """
    size = g.shape[1]
    diagonal = np.maximum(np.einsum("kii->ki", G), 1e-12)
    if size == 1:
        t = np.clip(g / diagonal, low, high)
    else:
        t = np.linalg.solve(G + 1e-10 * diagonal[:, :, None] * np.eye(size), g[:, :, None])[:, :, 0]
    value = np.einsum("ki,kij,kj->k", t, G, t) - 2.0 * np.einsum("ki,ki->k", g, t)
    outside = np.flatnonzero(np.any((t < low) | (t > high), axis=1))
    if not len(outside):
        return t, value
    value[outside] = np.inf
    for i in range(size):
        rest = np.delete(np.arange(size), i)
        for bound in (low, high):
            b = bound[outside, i]
            inner, cross = G[outside][:, rest][:, :, rest], G[outside][:, rest, i]
            others, left = bounded_least(
                inner, g[outside][:, rest] - cross * b[:, None], low[outside][:, rest], high[outside][:, rest]
            )
            left = left + G[outside, i, i] * b**2 - 2.0 * g[outside, i] * b
            better = left < value[outside]
            chosen = outside[better]
            value[chosen] = left[better]
            t[chosen, i] = b[better]
            t[chosen[:, None], rest] = others[better]
    return t, value


def _reach(responses: Sequence[Response], settings: SearchSettings) -> tuple[np.ndarray, np.ndarray]:
    """How far each response may be scaled: half way to the next size that was run, else to the end of its range."""
    low, high = np.ones(len(responses)), np.ones(len(responses))
    for members in families(responses):
        sizes = [abs(responses[k].size) for k in members]
        main = responses[members[0]].candidate.main
        reach = main.high if responses[members[0]].size > 0.0 else -main.low
        for i, k in enumerate(members):
            below = np.sqrt(sizes[i - 1] / sizes[i]) if i else 1.0 / settings.beyond
            above = np.sqrt(sizes[i + 1] / sizes[i]) if i + 1 < len(members) else settings.beyond
            low[k], high[k] = below, max(1.0, min(above, reach / sizes[i]))
    return low, high


def _scaled(response: Response, t: float) -> Mapping[str, float]:
    made = {}
    for x in response.candidate.parameters:
        v = response.values[x.name]
        made[x.name] = v if x.shape else float(np.clip(t * v, x.low, x.high))
    return made


def propose(problem: Problem, bank: Bank, nuisance_jacobian: np.ndarray) -> tuple[Bank, list[Proposal]]:
    """The best sets of effects, each once, the cheapest first, and the bank with the sizes that they asked for.

    The dispersion is that of what the best set is expected to leave, as far as the first look goes.
    """
    settings = problem.settings.search
    residual = profile_nuisances(problem, bank.model, nuisance_jacobian, 1.0).residual
    first = estimate_dispersion(problem, residual)
    whole, dispersion = float(residual @ residual), first
    made: list[Proposal] = []
    for look in range(settings.looks):
        projected = Projected(problem, bank, nuisance_jacobian, dispersion)
        found = _best_sets(projected, settings)
        rest = min(cost for cost, _, _ in found.values()) * dispersion / max(whole, 1e-300)
        dispersion = max(1.0, first * float(np.clip(rest, settings.least_left, 1.0)))
        wanted = _unrun(bank, list(found.values())[: settings.asking], settings)
        if look + 1 == settings.looks or (look and not wanted):
            made = [projected.proposal(chosen, t, cost) for cost, chosen, t in found.values()]
            break
        bank = extend(problem, bank, wanted)
    return bank, made


def gains(problem: Problem, bank: Bank, nuisance_jacobian: np.ndarray) -> dict[str, float]:
    """Share of the residual's squares at the bank's point that each effect alone could explain, by its label."""
    residual = profile_nuisances(problem, bank.model, nuisance_jacobian, 1.0).residual
    projected = Projected(problem, bank, nuisance_jacobian, estimate_dispersion(problem, residual))
    made: dict[str, float] = {}
    if not bank.responses:
        return made
    cost = projected.solve(np.arange(len(bank.responses))[:, None])[1] - projected.price
    for response, left in zip(bank.responses, cost, strict=True):
        gain = 1.0 - float(left) / max(projected.energy, 1e-300)
        if not response.removes:
            made[response.candidate.label] = max(gain, made.get(response.candidate.label, 0.0))
    return made


def _unrun(bank: Bank, sets: Sequence[Set], settings: SearchSettings) -> list[Variant]:
    """Sizes of the grid, not yet run, that are nearest to what the sets want."""
    have = {(x.candidate.label, x.shape, x.size) for x in bank.responses}
    wanted: dict[tuple[object, ...], Variant] = {}
    for _, chosen, t in sets:
        for i, x in zip(chosen, t, strict=True):
            response = bank.responses[i]
            if response.removes:
                continue
            size = response.size * float(x)
            own = [s for s in grid(response.candidate.main, settings) if s * size > 0.0]
            near = min(own, key=lambda s: abs(np.log(s / size)))
            key = (response.candidate.label, response.shape, near)
            if key not in have:
                values = {
                    x.name: response.values[x.name] if x.shape else min(max(near, x.low), x.high)
                    for x in response.candidate.parameters
                }
                wanted[key] = (response.candidate, values)
    return list(wanted.values())


def _best_sets(projected: Projected, settings: SearchSettings) -> dict[frozenset[str], Set]:
    """The cheapest way to have each set of effects, by its labels, the cheapest first."""
    labels = np.array([x.candidate.label for x in projected.bank.responses])
    count = len(labels)
    codes = np.unique(labels, return_inverse=True)[1]
    own = frozenset(c.label for c in projected.bank.candidates)
    most = settings.most_effects
    found: list[Set] = [(projected.energy, (), np.zeros(0))]
    t, cost = projected.solve(np.arange(count)[:, None])
    found += [(float(cost[i]), (i,), t[i]) for i in range(count)]
    first, second = np.triu_indices(count, 1)
    apart = codes[first] != codes[second]
    pairs = np.stack([first[apart], second[apart]], axis=1)
    t, cost = projected.solve(pairs)
    order = np.argsort(cost)
    found += [(float(cost[k]), tuple(pairs[k].tolist()), t[k]) for k in order[: settings.pairs]]
    leading = pairs[order[: settings.leading_pairs]]
    triples = np.concatenate([np.repeat(leading, count, axis=0), np.tile(np.arange(count), len(leading))[:, None]], 1)
    triples = np.unique(np.sort(triples, axis=1), axis=0)
    c = codes[triples]
    triples = triples[(c[:, 0] != c[:, 1]) & (c[:, 1] != c[:, 2]) & (c[:, 0] != c[:, 2])]
    if len(triples):
        t, cost = projected.solve(triples)
        order = np.argsort(cost)[: settings.pairs]
        found += [(float(cost[k]), tuple(triples[k].tolist()), t[k]) for k in order]
    best: dict[frozenset[str], Set] = {}
    for entry in sorted(found, key=lambda e: e[0]):
        responses = [projected.bank.responses[i] for i in entry[1]]
        key = (own - {x.candidate.label for x in responses if x.removes}) | {
            x.candidate.label for x in responses if not x.removes
        }
        if len(key) <= most:
            best.setdefault(key, entry)
    return best
