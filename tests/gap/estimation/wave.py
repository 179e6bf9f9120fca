"""A wave of three parameters, and fits of it."""

from __future__ import annotations

import numpy as np
from deepsea_cosim.gap.estimation.fit import Fit
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.problem.parameters import EstimatedParameter

from benchmarks.blind.oracle.gauss_newton import fit, run_fit
from tests.gap.formula import FormulaProblem, at_any_step, measured

T = np.linspace(0.0, 10.0, 800)


def unknown(name, kind="effect", low=-10.0, high=10.0, sd=3.0):
    return EstimatedParameter(name, kind, 0.0, 1.0, low, high, sd)


X = (unknown("a"), unknown("b"), unknown("c"))


def wave(p):
    return (1.0 + p["a"]) * np.sin((1.0 + 0.1 * p["b"]) * T) + 0.2 * p["c"] * T


def problem(machine, truth, noise=0.01, seed=0, bias=0.0):
    """A machine measured at its truth, by a sensor with a bias."""
    biased = measured(lambda p: machine(p) + bias, truth, T, noise, seed)
    return FormulaProblem(at_any_step(machine), biased)


def solve(p, parameters, iterations=20, start=None) -> tuple[Fit, np.ndarray]:
    """The fit, and the nuisances' columns."""
    start = np.zeros(len(parameters)) if start is None else start
    nuisance_jacobian = nuisance_jacobian_at(p, p.evaluate([{x.name: 0.0 for x in parameters}])[0])
    return run_fit(p, fit(p, parameters, start, nuisance_jacobian, iterations)), nuisance_jacobian
