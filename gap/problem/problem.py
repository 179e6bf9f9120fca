"""What is asked of the simulations: parameters, runs, observations of a campaign, and the model's answer to a point.

A point gives each parameter on its own scale; 0 is the model as delivered. The runs of an estimation take long macro
steps; a fit corrects them where it stands with the model's own answer, in which the macro step's error is extrapolated
away: what is numerical must not be taken up by parameters.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, inf
from typing import Any

import numpy as np

from ...core.units import unit
from ...master.parallel.pool import Failure, Job
from ..campaign.campaign import Campaign
from ..campaign.catalogue import Catalogue
from ..settings import DEFAULT, Settings
from .discretisation import Discretisation
from .observations import Observations
from .parameters import EffectCandidate, EstimatedParameter, Point, sensor_quantity
from .sensors import Sensor
from .simulator import Simulator


@dataclass(frozen=True, eq=False)
class RunConditions:
    """A run as the simulator needs it."""

    name: str
    stop: float
    """End of the run [s]."""
    stated: dict[str, Any]
    """Parameters that the campaign states, by address."""
    inputs: dict[str, tuple[np.ndarray, np.ndarray]]
    """Measured inputs: times [s] and values in the FMU's unit, by connector."""
    values: dict[str, Any]
    """Every parameter in force, by address."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Made by `build_problem`; answers `evaluate`. Nothing of it is ever rewritten: see `with_discretisation`."""

    campaign: Campaign
    catalogue: Catalogue
    simulator: Simulator
    discretisation: Discretisation
    runs: tuple[RunConditions, ...]
    observations: Observations
    connectors: tuple[str, ...]
    """What is recorded of a run."""
    units: dict[str, str]
    """Unit of each connector in its FMU."""
    base: tuple[EstimatedParameter, ...]
    """What every hypothesis has: the base parameters, and those of accepted effects."""
    candidates: tuple[EffectCandidate, ...]
    labels: tuple[str, ...]
    """Name of each channel: its connector, or the event."""
    accepted: tuple[EffectCandidate, ...] = ()
    """Effects that are known to be there; they are none of the candidates."""
    warnings: tuple[str, ...] = ()
    """What was found odd while the problem was built."""
    parameter_units: Mapping[str, str] = field(default_factory=dict)
    signals: frozenset[str] = frozenset()
    """All connectors of the package."""
    scenario_stop: float | None = None
    """Stop time of the package's scenario [s]."""
    settings: Settings = DEFAULT
    recorded: Observations | None = None
    """All samples as they were measured, where `observations` compare some of them otherwise; else None."""

    @property
    def samples(self) -> Observations:
        """The observations with all samples as they were measured."""
        return self.recorded or self.observations

    def with_discretisation(self, **changes: Any) -> Problem:
        """The same problem simulated with other steps or another method."""
        return replace(self, discretisation=replace(self.discretisation, **changes))

    @property
    def macro_step(self) -> float:
        """Macro step of exact runs [s]."""
        return self.discretisation.macro_step

    @property
    def fit_step(self) -> float:
        """Macro step of a fit's runs [s]."""
        return self.discretisation.fit_step

    @property
    def stated_scatter(self) -> float:
        """Mean square of the scatter of the model's form that the campaign states, in noise; 0 where it states none."""
        stated = np.zeros(len(self.observations))
        for k, c in enumerate(self.campaign.outputs):
            if c.model_form_scatter is not None:
                scatter = c.model_form_scatter / unit(self.units[c.connector]).factor
                stated[(self.observations.channel == k) & self.observations.takes_bias] = scatter
        return float(np.mean((stated / self.observations.noise_std) ** 2))

    @property
    def stop_requested(self) -> bool:
        """Whether nothing more is to be begun."""
        return self.simulator.stop.requested

    @cached_property
    def parameters(self) -> dict[str, EstimatedParameter]:
        """All parameters by name."""
        effects = [x for c in self.candidates for x in (*(y for f in c.forms for y in f.parameters), *c.parameters)]
        return {x.name: x for x in (*self.base, *effects)}

    def of_runs(self, runs: Sequence[int]) -> Problem:
        """The same problem of some of its runs, in that order."""
        campaign = replace(self.campaign, runs=tuple(self.campaign.runs[r] for r in runs))
        recorded = None if self.recorded is None else self.recorded.of_runs(runs)
        return replace(
            self, campaign=campaign, runs=tuple(self.runs[r] for r in runs), recorded=recorded,
            observations=self.observations.of_runs(runs),
        )  # fmt: skip

    def until(self, end: float) -> Problem:
        """The same problem of the samples until then [s], its runs as short as that."""
        return replace(
            self, runs=tuple(replace(r, stop=min(r.stop, end)) for r in self.runs), recorded=None,
            observations=self.samples.until(end),
        )  # fmt: skip

    def overrides(self, run: int, point: Point) -> dict[str, Any]:
        """Parameters to set for the run at that point: its conditions, and what the point says of the model."""
        return {**self.runs[run].stated, **self.model_values(run, point)}

    def model_values(self, run: int, point: Point) -> dict[str, Any]:
        """What the point says of the model's parameters; a base parameter is a share of what the run states of it."""
        conditions = self.runs[run]
        values: dict[str, Any] = {}
        parameters = self.parameters
        for name, u in point.items():
            parameter = parameters[name]
            if parameter.kind == "base" and u != 0.0:
                for address in parameter.addresses:
                    values[address] = conditions.values[address] * parameter.value(u)
            elif parameter.weights and u != 0.0:
                for address, weight in zip(parameter.addresses, parameter.weights, strict=True):
                    values[address] = values.get(address, conditions.values[address]) + weight * parameter.value(u)
            elif parameter.kind == "effect" and u != 0.0:
                for address in parameter.addresses:
                    values[address] = parameter.value(u)
        return values

    def differing_values(self, point: Point) -> dict[str, list[Any]]:
        """Parameters that the point puts at different values from run to run, for the runs state different ones."""
        values = [self.model_values(r, point) for r in range(len(self.runs))]
        by_address = {a: [v[a] for v in values] for a in values[0]}
        return {a: v for a, v in by_address.items() if any(x != v[0] for x in v)}

    def sensors(self, point: Point) -> dict[str, Sensor]:
        """The sensors at that point, by connector."""
        parameters = self.parameters
        errors: dict[str, dict[str, float]] = {}
        for name, u in point.items():
            if parameters[name].kind == "sensor" and u != 0.0:
                connector, quantity = sensor_quantity(name)
                errors.setdefault(connector, {})[quantity] = parameters[name].value(u)
        for connector, quantities in errors.items():
            if "curvature" in quantities:
                quantities["middle"] = self.observations.middle_of(connector)
        return {connector: Sensor(**quantities) for connector, quantities in errors.items()}

    def grid(self, run: int, step: float) -> np.ndarray:
        """Times of a run's rows [s]."""
        return np.arange(self._steps(run, step) + 1) * step

    def _steps(self, run: int, step: float) -> int:
        return int(np.ceil(self.runs[run].stop / step - 1e-6))

    def rows(
        self, points: Sequence[Point], step: float | Sequence[float], record: Sequence[str] = (), keep: bool = True,
        package_tolerances: bool | Sequence[bool] = False,
    ) -> list[list[np.ndarray] | None]:  # fmt: skip
        """Signals of every run at every point, or None where a run had to stop.

        step, package_tolerances: one for all or one for each. With package_tolerances a run has the package's solver
        settings; without, where its step is longer than the exact ones', those of the catalogue for estimations.
        """
        record = tuple(record) or self.connectors
        steps = [step] * len(points) if isinstance(step, (int, float)) else step
        tights = [package_tolerances] * len(points) if isinstance(package_tolerances, bool) else package_tolerances
        jobs: dict[Hashable, Job] = {}
        keys: list[list[Hashable]] = []
        for point, h, exact in zip(points, steps, tights, strict=True):
            point_jobs = [self._job(r, point, h, record, exact) for r in range(len(self.runs))]
            jobs.update(point_jobs)
            keys.append([key for key, _ in point_jobs])
        names = {key: key[0].name for key in jobs}  # type: ignore[index]
        outcomes = self.simulator.run(jobs, names, keep)
        signals: list[list[np.ndarray] | None] = []
        for point_keys in keys:
            results = [outcomes[key] for key in point_keys]
            arrays = [x for x in results if not isinstance(x, Failure)]
            signals.append(arrays if len(arrays) == len(results) else None)
        return signals

    def _job(
        self, run: int, point: Point, step: float, record: tuple[str, ...], package_tolerances: bool
    ) -> tuple[tuple[Any, ...], Job]:
        """A simulation, and the key by which it is known."""
        changes, method = self.overrides(run, point), self.discretisation.method
        if step > self.macro_step and not package_tolerances:
            changes = {**self.catalogue.estimation, **changes}
        key = (self.runs[run], step, method, record, tuple(sorted((k, repr(v)) for k, v in changes.items())))
        stop = self._steps(run, step) * step
        inputs, parts = self.runs[run].inputs, self.substeps(changes, step)
        return key, Job(record, stop, step, changes, inputs, method=method, parts=parts)

    def substeps(self, changes: Mapping[str, Any], step: float) -> int:
        """Into how many macro steps a step [s] has to be cut so that no effect among the changes makes the coupling
        unstable."""
        longest = min((h for a, h in self._longest_steps.items() if a in changes), default=inf)
        return max(1, ceil(step / longest - 1e-9))

    @cached_property
    def _longest_steps(self) -> dict[str, float]:
        """Of the effects that have one, by address."""
        return {
            a: e.longest_step
            for e in self.catalogue.effects if e.longest_step < inf
            for p in e.all_parameters for a in (p.address, *p.also)
        }  # fmt: skip

    def observe(self, point: Point, rows: Sequence[np.ndarray], step: float) -> np.ndarray:
        """What the channels read (n,), from the rows of a point."""
        grids = [self.grid(r, step) for r in range(len(self.runs))]
        columns = {name: i for i, name in enumerate(self.connectors)}
        return self.observations.observe(grids, rows, columns, self.sensors(point))

    def evaluate(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """The model's predictions at the points from runs at the fit's step; None where a run failed."""
        return self.evaluate_both(points, [])[0]

    def evaluate_both(
        self, coarse: Sequence[Point], exact: Sequence[Point]
    ) -> tuple[list[np.ndarray | None], list[np.ndarray | None]]:
        """The predictions of some points at the fit's step, and of others as `exact` gives them, run side by side."""
        k, n, d = len(coarse), len(exact), self.discretisation
        double = n if d.richardson_order else 0
        points = [*coarse, *exact, *exact[:double]]
        steps = [d.fit_step] * k + [d.macro_step] * n + [2.0 * d.macro_step] * double
        rows = self.rows(points, steps, package_tolerances=[False] * k + [True] * (n + double))
        vectors = [None if r is None else self.observe(p, r, h) for p, r, h in zip(points, rows, steps, strict=True)]
        exact_vectors, at_double = vectors[k : k + n], vectors[k + n :]
        if d.richardson_order:
            exact_vectors = [
                None if y is None or z is None else d.richardson(z, y)
                for y, z in zip(exact_vectors, at_double, strict=True)
            ]
        return vectors[:k], exact_vectors

    def exact(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """The predictions with the macro step's error extrapolated away, from runs at the macro step and at twice
        that; None where a run failed."""
        return self.evaluate_both([], points)[1]

    def at_step(self, point: Point, step: float) -> np.ndarray | None:
        """The prediction of a run at a macro step [s], as it is."""
        rows = self.rows([point], step, package_tolerances=True)[0]
        return None if rows is None else self.observe(point, rows, step)


def matching(name: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    """The addresses that a name means: itself, or without a component that parameter wherever it exists."""
    return (name,) if name in values else tuple(a for a in values if a.partition(".")[2] == name)
