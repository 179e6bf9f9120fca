"""Which single further run, or channel, would tell the two leading hypotheses apart best.

Two fitted hypotheses a and b foretell other readings m_a and m_b, in units of the noise, of which their parameters, the
new run's clock and a new sensor's bias could still take up something. With their derivatives J and covariances C as the
data so far leave them, and columns N of those nuisances, one standard deviation each, the readings differ by

    D^2 = (m_a - m_b)^T (1 + J_a C_a J_a^T + J_b C_b J_b^T + N N^T)^-1 (m_a - m_b)

and the separation is D / sqrt(readings): the distance in times the noise that no refit closes (the discrimination
criterion of Box and Hill, Technometrics 9, 1967, for models whose parameters are not known exactly). The base
parameters' derivatives, which differ little, are those of the first hypothesis for both. D is never more than the plain
distance |m_a - m_b|, so derivatives are taken under the changes with the greatest of these alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...master.parallel.pool import Failure, Job
from ..estimation.nuisances import usual_clock_error
from ..estimation.uncertainty import data_covariance
from ..problem.parameters import Point
from ..problem.problem import Problem, RunConditions, matching
from ..search.response_bank import wide_step
from ..selection.evidence import RankedHypothesis
from ..selection.probability_calibration import ProbabilityCalibration, chance

_Pair = tuple[RankedHypothesis, RankedHypothesis]


@dataclass(frozen=True)
class NextMeasurement:
    """A change of conditions or a channel to add, what it separates, by how much (normalised RMS that no refit closes),
    and the probability that the right one of the two is expected to have beside the other, now and then."""

    change: dict[str, Any]
    separates: tuple[tuple[str, ...], tuple[str, ...]]
    separation: float
    expected: tuple[float, float] = (0.5, 0.5)


class _Signals(NamedTuple):
    """What is read under a change, every `interval` [s]: rows (n, channels) of both hypotheses, and how these change
    with each normalised parameter."""

    both: tuple[np.ndarray, np.ndarray]
    slopes: dict[tuple[int, str], np.ndarray]
    """By hypothesis and parameter; of base parameters the first one's alone."""
    interval: float


def rival(ranked: Sequence[RankedHypothesis], probabilities: Sequence[float], problem: Problem) -> int | None:
    """The place of the hypothesis that the first one has to be told from: the most probable that is about something
    else, if that is a question, else that has other effects."""
    groups = {c.id: c.group for c in problem.candidates}
    kinds = [frozenset(groups.get(id, id) for id in r.hypothesis.ids) for r in ranked]
    least = problem.settings.analysis.question * probabilities[0]
    rivals = [k for k, p in enumerate(probabilities) if kinds[k] != kinds[0] and p >= least]
    rivals += [k for k, r in enumerate(ranked) if r.hypothesis.ids != ranked[0].hypothesis.ids]
    return next(iter(rivals), None)


def rank_measurements(
    problem: Problem, pair: _Pair, odds: float, baseline: float, nuisance_jacobian: np.ndarray
) -> list[NextMeasurement]:
    """Changes of conditions and further channels, those under which the two differ most first.

    odds: of the first against the second, as the data so far leave them; baseline: energy that calibration leaves.
    """
    usual_noise = {m.connector: m.noise_std for m in problem.catalogue.measurables}
    noise_std = problem.samples.noise_std
    channel_noise = {b.connector: float(np.median(noise_std[b.place])) for b in problem.samples.series}
    channel_noise.update({c: usual_noise[c] for c in problem.connectors if c not in channel_noise and c in usual_noise})
    extra = {c: noise for c, noise in usual_noise.items() if c not in problem.connectors}
    noise = {**{c: channel_noise[c] for c in problem.connectors if c in channel_noise}, **extra}
    if not noise:
        return []
    changes = _promising(problem, _changes(problem), pair, channel_noise)
    read = _simulated(problem, changes, pair, tuple(noise))
    separates = (pair[0].hypothesis.ids, pair[1].hypothesis.ids)
    spread = [_spread(problem, r, nuisance_jacobian) for r in pair]
    measurements: list[NextMeasurement] = []
    for change, signals in zip(changes, read, strict=True):
        if signals is None:
            continue
        for channels in [channel_noise] if change else [{c: n} for c, n in extra.items()]:
            if not channels:
                continue
            squared, count = _separation(problem, pair, signals, spread, tuple(noise), channels, not change)
            design = change or {"channel": next(iter(channels))}
            share = 1.0 if change else 1.0 / (len(channel_noise) + 1)  # beside the channels that are there
            separation = float(np.sqrt(share * squared / count))
            expected = _expected_probabilities(problem, pair, odds, baseline, separation)
            measurements.append(NextMeasurement(design, separates, separation, expected))
    return sorted(measurements, key=lambda n: -n.separation)


def _spread(problem: Problem, ranked: RankedHypothesis, nuisance_jacobian: np.ndarray) -> np.ndarray:
    """Moves (k, k) of a fit's parameters, one standard deviation each, that do not depend on each other."""
    energy = problem.settings.uncertainty.form_energy
    values, directions = np.linalg.eigh(data_covariance(problem, ranked.hypothesis.fit, nuisance_jacobian, energy))
    return np.asarray(directions * np.sqrt(np.maximum(values, 0.0)))


def _separation(
    problem: Problem, pair: _Pair, signals: _Signals, spread: Sequence[np.ndarray], record: tuple[str, ...],
    channels: Mapping[str, float], added: bool,
) -> tuple[float, int]:  # fmt: skip
    """The square of what the readings of some channels differ by that nothing takes up, and how many they are."""
    chosen, noise = [record.index(c) for c in channels], np.array(list(channels.values()))

    def column(rows: np.ndarray) -> np.ndarray:
        return np.asarray((rows[:, chosen] / noise).ravel())

    first = signals.both[0]
    if added:  # to a run that was measured: the clock is known as well as it is, the new sensor's bias is not
        nuisance = problem.settings.noise.bias_of_span * np.ptp(first, axis=0) * np.ones_like(first)
    else:
        nuisance = usual_clock_error(problem, 0) * np.gradient(first, signals.interval, axis=0)
    nuisance_jacobian_at = [column(nuisance)[:, None]]
    for k, ranked in enumerate(pair):
        names = [x.name for x in ranked.hypothesis.fit.parameters]
        slopes = [column(signals.slopes[(k, name) if (k, name) in signals.slopes else (0, name)]) for name in names]
        if slopes:
            nuisance_jacobian_at.append(np.stack(slopes, axis=1) @ spread[k])
    columns, difference = np.concatenate(nuisance_jacobian_at, axis=1), column(first - signals.both[1])
    moment = columns.T @ difference
    inner = np.linalg.solve(np.eye(len(moment)) + columns.T @ columns, moment)
    return max(0.0, float(difference @ difference - moment @ inner)), len(difference)


def _expected_probabilities(
    problem: Problem, pair: _Pair, odds: float, baseline: float, separation: float
) -> tuple[float, float]:
    """The expected probability of the right one of the two, now and with one more run of that separation."""
    calibration, readings = ProbabilityCalibration.load().of_gap(baseline), len(problem.observations)
    share = 1.0 / (1.0 + len(problem.runs))
    energy = np.array([r.structured_energy for r in pair])
    floor = calibration.form_scatter(float(energy.min()), readings) + calibration.discrepancy + chance(readings)
    log_odds = np.log(odds) - 0.5 * calibration.independent * float(np.log((energy[1] + floor) / (energy[0] + floor)))
    p_right = []
    for right in (0, 1):
        missed = np.where(np.arange(2) == right, 0.0, separation**2)
        # of another run each leaves what it leaves so far, and the wrong one misses it
        energies = energy + share * missed
        gain = 0.5 * calibration.independent * float(np.log((energies[1] + floor) / (energies[0] + floor)))
        p_right.append(
            1.0 / (1.0 + np.exp(-(log_odds + gain) * (1.0 if right == 0 else -1.0) / calibration.temperature))
        )
    p = odds / (1.0 + odds)
    return p**2 + (1.0 - p) ** 2, float(p * p_right[0] + (1.0 - p) * p_right[1])


def _changes(problem: Problem) -> list[dict[str, Any]]:
    """No change, and every condition that the catalogue lists and no run has had."""
    values = problem.runs[0].values
    changes: list[dict[str, Any]] = [{}]
    for e in problem.catalogue.experiments:
        addresses = matching(e.parameter, values)
        if not addresses:
            continue
        used = {r.values[addresses[0]] for r in problem.runs}
        changes += [{e.parameter: v} for v in e.values if not any(_is_same_value(v, u) for u in used)]
    return changes


def _promising(
    problem: Problem, changes: Sequence[dict[str, Any]], pair: _Pair, channels: Mapping[str, float]
) -> list[dict[str, Any]]:
    """No change, and those under which the fits as they stand differ most in the channels that are there."""
    unchanged, changed = [c for c in changes if not c], [c for c in changes if c]
    if not channels:
        return unchanged
    record, noise = tuple(channels), np.array(list(channels.values()))
    points = [r.hypothesis.fit.point for r in pair]
    by_distance = []
    for change, (a, b) in zip(changed, _runs(problem, changed, points, record), strict=True):
        if a is not None and b is not None:
            by_distance.append((float(np.mean(((a - b) / noise) ** 2)), change))
    ordered = [change for _, change in sorted(by_distance, key=lambda x: -x[0])]
    return [*unchanged, *ordered[: problem.settings.analysis.designs]]


def _runs(
    problem: Problem, changes: Sequence[dict[str, Any]], points: Sequence[Point], record: tuple[str, ...]
) -> list[list[np.ndarray | None]]:
    """What is read (n, channels) in the first run under each change at every point; None where the model fails."""
    step, method, inputs = problem.fit_step, problem.discretisation.method, problem.runs[0].inputs
    grid = problem.grid(0, step)
    jobs = []
    for change in changes:
        trial = replace(problem, runs=(_changed(problem, change),))
        values = [trial.overrides(0, p) for p in points]
        jobs += [Job(record, grid[-1], step, v, inputs, method=method, parts=problem.substeps(v, step)) for v in values]
    outcomes = problem.simulator.simulate(jobs)
    read = [None if isinstance(x, Failure) else _read(problem, grid, x, record, p, _row_stride(problem, grid))
            for x, p in zip(outcomes, [*points] * len(changes), strict=True)]  # fmt: skip
    return [read[k * len(points) : (k + 1) * len(points)] for k in range(len(changes))]


def _row_stride(problem: Problem, grid: np.ndarray) -> int:
    return -(-len(grid) // problem.settings.analysis.design_rows)


def _simulated(
    problem: Problem, changes: Sequence[dict[str, Any]], pair: _Pair, record: tuple[str, ...]
) -> list[_Signals | None]:
    """The first run under each change with both hypotheses and their derivatives; None where one of them fails."""
    moves = _moves(problem, pair)
    points = [*(r.hypothesis.fit.point for r in pair), *(m.point for m in moves)]
    interval = _row_stride(problem, problem.grid(0, problem.fit_step)) * problem.fit_step
    signals: list[_Signals | None] = []
    for a, b, *moved in _runs(problem, changes, points, record):
        if a is None or b is None:
            signals.append(None)
            continue
        slopes = {
            (m.of, m.name): np.zeros_like(a) if x is None else (x - (a, b)[m.of]) / m.by
            for m, x in zip(moves, moved, strict=True)
        }
        signals.append(_Signals((a, b), slopes, interval))
    return signals


class _Move(NamedTuple):
    """A parameter of a hypothesis, how far it is moved, and the point there."""

    of: int
    name: str
    by: float
    point: Point


def _moves(problem: Problem, pair: _Pair) -> list[_Move]:
    settings, moves = problem.settings.search, dict[tuple[int, str], _Move]()
    for k, ranked in enumerate(pair):
        point = ranked.hypothesis.fit.point
        for x in ranked.hypothesis.fit.parameters:
            if x.in_every_set and (0, x.name) in moves:
                continue
            by = wide_step(x, point[x.name], settings)
            moves[k, x.name] = _Move(k, x.name, by, {**point, x.name: point[x.name] + by})
    return list(moves.values())


def _read(
    problem: Problem, grid: np.ndarray, rows: np.ndarray, record: tuple[str, ...], point: Point, stride: int
) -> np.ndarray:
    """What the channels read every so many rows, with the point's errors of their sensors."""
    readings = rows[::stride].copy()
    for connector, sensor in problem.sensors(point).items():
        if connector in record:
            k = record.index(connector)
            readings[:, k] = sensor.observe(grid, rows[:, k], grid[::stride])
    return readings


def _is_same_value(a: Any, b: Any) -> bool:
    return isinstance(a, (int, float)) and isinstance(b, (int, float)) and abs(a - b) <= 1e-6 * max(abs(a), abs(b), 1.0)


def _changed(problem: Problem, change: dict[str, Any]) -> RunConditions:
    """The first run under other conditions."""
    conditions = problem.runs[0]
    values = dict(conditions.values)
    for name, value in change.items():
        values.update(dict.fromkeys(matching(name, values), value))
    return replace(conditions, stated={**conditions.stated, **change}, values=values)
