"""All singles, pairs and the promising triples of a bank's responses, each with the size that serves best.

The model is taken as linear in base parameters, nuisances and, between the grid's sizes, in the effects. What base
parameters and nuisances can take up is projected out once; then every set costs a few multiplications of the Gram
matrix of the responses. Sizes stay near those that were run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.linear import profile_nuisances
from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..settings import SCORING, SearchSettings
from .response_bank import Response, ResponseBank, Variant, add_responses, families
from .sizes import grid, resized

ScoredSet = tuple[float, tuple[int, ...], np.ndarray]
"""Cost, responses by their place in the bank, and how much each is scaled (s,)."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """A set of effects, where it is expected to fit best, and its expected cost there."""

    candidates: tuple[EffectCandidate, ...]
    point: Point
    cost: float
    left: float = 0.0
    """Normalised RMS that it is expected to leave there."""
    as_run: Point = field(default_factory=dict)
    """The bank's point with the effects at the sizes that were run."""

    @property
    def labels(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset(c.label for c in self.candidates)


class Projection:
    """What is left of the data, and what responses change, after base parameters, the bank's own effects and nuisances
    have taken what they can of it, at the cost of their priors. All is divided by the root of the dispersion."""

    def __init__(self, problem: Problem, bank: ResponseBank, nuisance_jacobian: np.ndarray, dispersion: float):
        noise, rows, n = problem.observations.noise_std, bank.rows, len(problem.observations)
        self.row_count = len(range(n)[rows])
        self.scale = np.sqrt(n / self.row_count / dispersion)
        columns = np.concatenate([bank.jacobian, nuisance_jacobian], axis=1) / noise[:, None]
        A = self.scale * columns[rows]
        r = self.scale * ((problem.observations.y - bank.model) / noise)[rows]
        sd = np.array([*(x.sd for x in bank.parameters), *[1.0] * nuisance_jacobian.shape[1]])
        u = np.array([*(bank.point.get(x.name, 0.0) for x in bank.parameters), *[0.0] * nuisance_jacobian.shape[1]])
        self.r = np.concatenate([r, -u / sd])
        self.Q, self.R = np.linalg.qr(np.concatenate([A, np.diag(1.0 / sd)]))
        self.residual = self.without(self.r)

    @classmethod
    def of_all(cls, problem: Problem, bank: ResponseBank, nuisance_jacobian: np.ndarray) -> Self:
        """With the dispersion of all that is left at the bank's point."""
        residual = profile_nuisances(problem, bank.model, nuisance_jacobian, 1.0).residual
        return cls(problem, bank, nuisance_jacobian, estimate_dispersion(problem, residual))

    def scaled(self, changes: np.ndarray) -> np.ndarray:
        """Changes (rows, k) of the model, and none of the priors."""
        return np.concatenate([self.scale * changes, np.zeros((len(self.r) - len(changes), changes.shape[1]))])

    def without(self, v: np.ndarray) -> np.ndarray:
        """Columns after the bank's parameters and nuisances have taken what they can of them."""
        rest: np.ndarray = v - self.Q @ (self.Q.T @ v)
        return rest

    def best_sizes(self, changes: np.ndarray) -> np.ndarray:
        """How much of each of some changes (rows, k) of the model takes most of what is left (k,), without bounds."""
        return self._taking(changes)[0]

    def taken_by(self, changes: np.ndarray) -> float:
        """Squares of what is left that some changes (rows, k) of the model, in any sizes, take."""
        return self._taking(changes)[1]

    def _taking(self, changes: np.ndarray) -> tuple[np.ndarray, float]:
        D = self.without(self.scaled(changes))
        sizes = np.linalg.lstsq(D, self.residual, rcond=1e-6)[0]
        return sizes, float(sizes @ (D.T @ self.residual))


class ProjectedBank(Projection):
    """The same for all sets of a bank's responses.

    Costs are squares of the residual over the dispersion, priors, and a price for every effect.
    """

    def __init__(self, problem: Problem, bank: ResponseBank, nuisance_jacobian: np.ndarray, dispersion: float):
        super().__init__(problem, bank, nuisance_jacobian, dispersion)
        self.problem, self.bank, self.settings = problem, bank, problem.settings.search
        # a response a row, so that it stands together in memory
        self.D = np.zeros((len(bank.responses), len(self.r)))
        for row, x in zip(self.D, bank.responses, strict=True):
            np.multiply(self.scale, x.change, out=row[: self.row_count])
        rest = self.without(self.D.T)
        self.gram, self.rhs = rest.T @ rest, rest.T @ self.residual
        self.energy = float(self.residual @ self.residual)
        is_removal = np.array([x.is_removal for x in bank.responses], dtype=bool)
        self.low, self.high = _reach(bank.responses, self.settings)
        self.price = np.where(is_removal, -1.0, 1.0) * [
            SCORING.price + SCORING.form_price * (x.candidate.form is not None) for x in bank.responses
        ]

    def solve(self, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sizes (S, s) that cost least, as multiples of those that were run, and costs (S,), of sets (S, s) of
        responses; within bounds."""
        G = self.gram[sets[:, :, None], sets[:, None, :]]
        t, fitted = bounded_minimum(G, self.rhs[sets], self.low[sets], self.high[sets])
        return t, self.energy + fitted + self.price[sets].sum(axis=1)

    def proposal(self, chosen: Sequence[int], t: np.ndarray, cost: float) -> Proposal:
        """A set of responses at sizes t (s,) with the base parameters that go with it."""
        bank = self.bank
        change = sum((x * self.D[i] for i, x in zip(chosen, t, strict=True)), np.zeros(len(self.r)))
        shifts = np.linalg.solve(self.R, self.Q.T @ (self.r - change))
        own_reach = self.settings.own_radius
        point, as_run = dict(bank.point), dict(bank.point)
        for x, d in zip(bank.parameters, shifts, strict=False):
            u = point.get(x.name, 0.0)
            reach = np.inf if x.kind == "base" else own_reach * max(abs(u), 0.3)
            point[x.name] = float(np.clip(u + np.clip(d, -reach, reach), x.low, x.high))
        removed: set[str] = set()
        added: list[EffectCandidate] = []
        for i, x in zip(chosen, t, strict=True):
            response = bank.responses[i]
            if response.is_removal:
                removed.add(response.candidate.label)
                for p in response.candidate.parameters:
                    point.pop(p.name, None)
                    as_run.pop(p.name, None)
            else:
                added.append(response.candidate)
                point.update(_scaled(response, float(x)))
                as_run.update(response.values)
        remaining = [c for c in bank.candidates if c.label not in removed]
        squares = max(cost - float(self.price[list(chosen)].sum()), 0.0)
        left = float(np.sqrt(squares / self.row_count)) / self.scale
        return Proposal((*remaining, *added), point, cost, left, as_run)


def bounded_minimum(
    G: np.ndarray, g: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The t (S, s) within bounds that makes t G t - 2 g t least, for G (S, s, s) and g (S, s), and how much that is.

    It is exact, for effects that act alike make a long narrow valley: where the free solution lies outside, one of the
    sizes is at one of its bounds.
    """
    if g.shape[1] == 1:
        t = np.clip(g / np.maximum(G[:, :, 0], 1e-12), low, high)
        return t, (t * (G[:, :, 0] * t - 2.0 * g))[:, 0]
    t = _free_minimum(G, g)
    value = np.einsum("ki,ki->k", t, np.einsum("kij,kj->ki", G, t) - 2.0 * g)
    outside = np.flatnonzero(np.any((t < low) | (t > high), axis=1))
    if len(outside):
        t[outside], value[outside] = _on_bounds(G[outside], g[outside], low[outside], high[outside])
    return t, value


def _free_minimum(G: np.ndarray, g: np.ndarray) -> np.ndarray:
    """The same without bounds: t (S, s)."""
    size = g.shape[1]
    G = G + 1e-10 * np.maximum(np.einsum("kii->ki", G), 1e-12)[:, :, None] * np.eye(size)
    if size == 2:  # most are pairs, for which this takes a third of the time
        (a, b), c = G[:, 0].T, G[:, 1, 1]
        adjugate = np.stack([c * g[:, 0] - b * g[:, 1], a * g[:, 1] - b * g[:, 0]], axis=1)
        return np.asarray(adjugate / (a * c - b * b)[:, None])
    return np.asarray(np.linalg.solve(G, g[:, :, None])[:, :, 0])


def _on_bounds(
    G: np.ndarray, g: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The same with at least one of the sizes at one of its bounds."""
    t, value = np.empty_like(g), np.full(len(g), np.inf)
    for i in range(g.shape[1]):
        rest = np.delete(np.arange(g.shape[1]), i)
        inner, cross = G[:, rest][:, :, rest], G[:, rest, i]
        for bound in (low[:, i], high[:, i]):
            others, reduced = bounded_minimum(inner, g[:, rest] - cross * bound[:, None], low[:, rest], high[:, rest])
            reduced = reduced + bound * (G[:, i, i] * bound - 2.0 * g[:, i])
            better = np.flatnonzero(reduced < value)
            value[better], t[better, i] = reduced[better], bound[better]
            t[better[:, None], rest] = others[better]
    return t, value


def _reach(responses: Sequence[Response], settings: SearchSettings) -> tuple[np.ndarray, np.ndarray]:
    """How far each response may be scaled: half way to the next size that was run, else to the end of its range."""
    low, high = np.ones(len(responses)), np.ones(len(responses))
    for members in families(responses):
        sizes = [abs(responses[k].size) for k in members]
        main = responses[members[0]].candidate.main
        reach = main.high if responses[members[0]].size > 0.0 else -main.low
        for i, k in enumerate(members):
            below = np.sqrt(sizes[i - 1] / sizes[i]) if i else 1.0 / settings.extrapolation
            above = np.sqrt(sizes[i + 1] / sizes[i]) if i + 1 < len(members) else settings.extrapolation
            low[k], high[k] = below, max(1.0, min(above, reach / sizes[i]))
    return low, high


def _scaled(response: Response, t: float) -> Mapping[str, float]:
    values = {}
    for x in response.candidate.parameters:
        v = response.values[x.name]
        values[x.name] = v if x.shape else float(np.clip(t * v, x.low, x.high))
    return values


def propose_sets(
    problem: Problem, bank: ResponseBank, nuisance_jacobian: np.ndarray, rounds: int | None = None
) -> tuple[ResponseBank, list[Proposal]]:
    """The best sets of effects, each once, the cheapest first, and the bank with the sizes that they asked for in so
    many rounds, of which the last asks for none.

    The dispersion is that of what the best set is expected to leave, as far as the first look goes.
    """
    settings = problem.settings.search
    rounds = rounds or settings.size_rounds
    residual = profile_nuisances(problem, bank.model, nuisance_jacobian, 1.0).residual
    first = estimate_dispersion(problem, residual)
    whole, dispersion = float(residual @ residual), first
    proposals: list[Proposal] = []
    for look in range(rounds):
        projected = ProjectedBank(problem, bank, nuisance_jacobian, dispersion)
        best_sets = _best_sets(projected, settings)
        rest = min(cost for cost, _, _ in best_sets.values()) * dispersion / max(whole, 1e-300)
        dispersion = max(1.0, first * float(np.clip(rest, settings.least_left, 1.0)))
        missing = _missing_variants(bank, list(best_sets.values())[: settings.sets_asking], settings)
        if look + 1 == rounds or (look and not missing):
            proposals = [projected.proposal(chosen, t, cost) for cost, chosen, t in best_sets.values()]
            break
        bank = add_responses(problem, bank, missing)
    return bank, proposals


def shares_alone(problem: Problem, bank: ResponseBank, nuisance_jacobian: np.ndarray) -> dict[str, float]:
    """Share of the residual's squares at the bank's point that each effect alone could explain, by its label."""
    projected = ProjectedBank.of_all(problem, bank, nuisance_jacobian)
    by_label: dict[str, float] = {}
    if not bank.responses:
        return by_label
    cost = projected.solve(np.arange(len(bank.responses))[:, None])[1] - projected.price
    for response, remaining in zip(bank.responses, cost, strict=True):
        gain = 1.0 - float(remaining) / max(projected.energy, 1e-300)
        if not response.is_removal:
            by_label[response.candidate.label] = max(gain, by_label.get(response.candidate.label, 0.0))
    return by_label


def _missing_variants(bank: ResponseBank, sets: Sequence[ScoredSet], settings: SearchSettings) -> list[Variant]:
    """Sizes of the grid, not yet run, that are nearest to what the sets want."""
    run_variants = {(x.candidate.name, x.shape, x.size) for x in bank.responses}
    variants: dict[tuple[object, ...], Variant] = {}
    for _, chosen, t in sets:
        for i, x in zip(chosen, t, strict=True):
            response = bank.responses[i]
            if response.is_removal:
                continue
            size = response.size * float(x)
            same_sign = [s for s in grid(response.candidate.main, settings) if s * size > 0.0]
            nearest = min(same_sign, key=lambda s: abs(np.log(s / size)))
            key = (response.candidate.name, response.shape, nearest)
            if key not in run_variants:
                variants[key] = (response.candidate, resized(response.candidate, response.values, nearest))
    return list(variants.values())


def _best_sets(projected: ProjectedBank, settings: SearchSettings) -> dict[frozenset[str], ScoredSet]:
    """The cheapest way to have each set of effects, by its labels, the cheapest first."""
    labels = np.array([x.candidate.label for x in projected.bank.responses])
    count = len(labels)
    codes = np.unique(labels, return_inverse=True)[1]
    bank_labels = frozenset(c.label for c in projected.bank.candidates)
    most = settings.most_effects
    candidates: list[ScoredSet] = [(projected.energy, (), np.zeros(0))]
    t, cost = projected.solve(np.arange(count)[:, None])
    candidates += [(float(cost[i]), (i,), t[i]) for i in range(count)]
    first, second = np.triu_indices(count, 1)
    apart = codes[first] != codes[second]
    pairs = np.stack([first[apart], second[apart]], axis=1)
    t, cost = projected.solve(pairs)
    order = np.argsort(cost)
    candidates += [(float(cost[k]), tuple(pairs[k].tolist()), t[k]) for k in order[: settings.pairs]]
    leading = pairs[order[: settings.leading_pairs]]
    triples = np.concatenate([np.repeat(leading, count, axis=0), np.tile(np.arange(count), len(leading))[:, None]], 1)
    triples = np.unique(np.sort(triples, axis=1), axis=0)
    c = codes[triples]
    triples = triples[(c[:, 0] != c[:, 1]) & (c[:, 1] != c[:, 2]) & (c[:, 0] != c[:, 2])]
    if len(triples):
        t, cost = projected.solve(triples)
        order = np.argsort(cost)[: settings.pairs]
        candidates += [(float(cost[k]), tuple(triples[k].tolist()), t[k]) for k in order]
    best: dict[frozenset[str], ScoredSet] = {}
    for entry in sorted(candidates, key=lambda e: e[0]):
        responses = [projected.bank.responses[i] for i in entry[1]]
        key = (bank_labels - {x.candidate.label for x in responses if x.is_removal}) | {
            x.candidate.label for x in responses if not x.is_removal
        }
        if len(key) <= most:
            best.setdefault(key, entry)
    return best
