"""What calibration's biases take over of a sensor's bias where a set of effects lacks it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..estimation.nuisances import usual_bias
from ..problem.observations import Observations
from ..problem.parameters import EffectCandidate, sensor_quantity
from ..problem.problem import Problem
from ..selection.evidence import RankedHypothesis


def absorbed_bias(
    problem: Problem, observations: Observations, whole: RankedHypothesis, subset: RankedHypothesis
) -> np.ndarray:
    """What calibration's biases take over in a subset from a sensor's bias that the whole has as an effect: it is the
    effect's work, for usual biases do not reach that far. Normalised, of these observations (n,)."""
    taken_over = np.zeros(len(observations))
    for c in whole.hypothesis.candidates:
        connector = _biased_channel(c)
        if connector is None or c.label in subset.hypothesis.labels:
            continue
        k = problem.labels.index(connector)
        difference = subset.hypothesis.fit.nuisances[k] - whole.hypothesis.fit.nuisances[k]
        in_channel = (observations.channel == k) & observations.takes_bias
        taken_over[in_channel] += difference * usual_bias(problem, k) / observations.noise_std[in_channel]
    return taken_over


def energies_without_bias(
    problem: Problem, whole: RankedHypothesis, others: Sequence[RankedHypothesis]
) -> dict[tuple[str, ...], float]:
    """Structured energies of the sets without a sensor's bias that a hypothesis has, with what calibration's biases
    take over given back; the least of each set, by its effects. None for a hypothesis that has no such bias."""
    biases = {c.label for c in whole.hypothesis.candidates if _biased_channel(c)}
    energies: dict[tuple[str, ...], float] = {}
    for r in others if biases else ():
        if set(r.hypothesis.ids) <= set(whole.hypothesis.ids) and biases - set(r.hypothesis.labels):
            given_back = r.cv_residual + absorbed_bias(problem, problem.observations, whole, r)
            energy = max(r.structured_energy, problem.observations.structured_energy(given_back))
            energies[r.hypothesis.ids] = min(energies.get(r.hypothesis.ids, np.inf), energy)
    return energies


def _biased_channel(c: EffectCandidate) -> str | None:
    """The channel whose sensor's bias an effect is."""
    for x in c.parameters:
        connector, quantity = sensor_quantity(x.name) if x.kind == "sensor" else ("", "")
        if quantity == "bias":
            return connector
    return None
