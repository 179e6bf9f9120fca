"""What is asked of the simulations: unknowns, runs, observations of a campaign, and the model's answer to a point.

A point gives each unknown in its own scale u; u = 0 is the model as delivered. The runs of an estimation take long
macro steps; a fit corrects them where it stands with the model's own answer, in which the macro step's error is
extrapolated away (Richardson 1911): what is numerical must not be taken up by parameters.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...core.errors import CosimError, ParameterError, UnknownNameError, UsageError, did_you_mean
from ...core.repeated import repeated
from ...core.units import unit
from ...master.algorithms import NAMES
from ...master.pool import Failure, Job, Pool
from ...master.session import Session
from ...master.setup import split
from ..campaign.catalogue import Catalogue, Effect
from ..campaign.catalogue import Sensor as SensorEffect
from ..campaign.read import Campaign, CampaignError, Event, Run, own_unit
from .noise import quantum, spread
from .observations import Moment, Observations, gather, thin
from .sensors import Sensor

DIFFERENCES = (1e-4, 1e-3, 1e-2, 5e-2)
"""Steps of a finite difference, in u: the smallest at which the simulations are smooth is taken."""

BIAS, BIAS_OF_LEVEL = 1.5e-3, 5e-4
"""Usual bias of a sensor as a share of its span, and of its largest reading: a nuisance in every fit."""

CLOCK = 0.1
"""Usual misalignment of a run's clock in sample intervals, at most 1 ms: a nuisance in every fit."""

LONGEST = 5e6
"""Steps that a run may have: more than a day of most machines."""

TIMES = {"ms": 1e3, "us": 1e6, "ns": 1e9, "minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0}
"""Units that times are found in, as multiples that a number of them is of one in seconds."""

REACH = 1.0
"""How far a base parameter may go, in its tolerances."""

Point = Mapping[str, float]
"""Unknowns by name, in their scale u; those left out are 0."""


@dataclass(frozen=True)
class Unknown:
    """A quantity to be estimated: value = start + scale * u, low <= u <= high; u has the prior N(0, sd)."""

    name: str
    kind: str
    """base (a factor), effect (a parameter's value) or sensor (sensor.<connector>.<quantity>)."""
    start: float
    scale: float
    low: float
    high: float
    sd: float
    addresses: tuple[str, ...] = ()
    shape: bool = False
    starts: tuple[float, ...] = ()
    """Of a shape: values of u to try first."""

    def value(self, u: float) -> float:
        """The value of the quantity, without the last digits: what is a range's end but for rounding is that end."""
        value = float(f"{self.start + self.scale * u:.14g}")
        return 0.0 if abs(value) < 1e-12 * abs(self.scale) else value


@dataclass(frozen=True)
class Candidate:
    """A possible cause: an effect of the machine, or one of a sensor."""

    id: str
    text: str
    group: str
    unknowns: tuple[Unknown, ...]
    weight: float = 1.0
    """Share of its id's prior probability: an effect of any of n channels is n candidates."""

    @property
    def label(self) -> str:
        """The id, with the channel of a sensor's effect."""
        name = self.unknowns[0].name
        if not name.startswith("sensor."):
            return self.id
        return f"{self.id}({name.removeprefix('sensor.').rpartition('.')[0]})"


@dataclass
class _RunInfo:
    name: str
    stop: float
    changes: dict[str, Any]
    inputs: dict[str, tuple[np.ndarray, np.ndarray]]
    values: dict[str, Any]
    """Every parameter in force, by address."""


@dataclass
class Problem:
    """Made by `pose`; answers `evaluate`."""

    campaign: Campaign
    catalogue: Catalogue
    pool: Pool
    runs: list[_RunInfo]
    obs: Observations
    connectors: list[str]
    units: dict[str, str]
    base: tuple[Unknown, ...]
    candidates: tuple[Candidate, ...]
    fine: float
    labels: list[str]
    """Name of each channel: its connector, or the event."""
    factor: int = 1
    warnings: list[str] = field(default_factory=list)
    parameter_units: dict[str, str] = field(default_factory=dict)
    signals: frozenset[str] = frozenset()
    """All connectors of the package."""
    ends: float | None = None
    """Stop time of the package's scenario [s]."""
    order: int = 0
    """Order of the error of the package's macro step; 0 where that is too small to matter."""
    method: str = NAMES[0]
    """Coupling algorithm of the runs."""
    difference: float = DIFFERENCES[0]
    """Step of a finite difference, in u."""
    smooth: dict[str, bool] = field(default_factory=dict)
    """Whether the runs are smooth in an effect's unknown at that step, as far as that has been seen."""
    failure: str = ""
    """The last run that could not be simulated, and why."""
    hurry: Callable[[], bool] = lambda: False
    """Whether nothing more is to be begun: a fit then ends after the iteration that it is in."""
    _kept: OrderedDict[tuple[Any, ...], np.ndarray | Failure] = field(default_factory=OrderedDict)

    @property
    def coarse(self) -> float:
        """Macro step of an estimation [s]."""
        return self.fine * self.factor

    @cached_property
    def unknowns(self) -> dict[str, Unknown]:
        """All unknowns by name."""
        return {u.name: u for u in (*self.base, *(u for c in self.candidates for u in c.unknowns))}

    def changes(self, run: int, point: Point) -> dict[str, Any]:
        """Parameters to set for the run at that point: its conditions, and what the point says of the model."""
        return {**self.runs[run].changes, **self.found(run, point)}

    def found(self, run: int, point: Point) -> dict[str, Any]:
        """What the point says of the model's parameters; a base parameter is a share of what the run states of it."""
        info = self.runs[run]
        made: dict[str, Any] = {}
        known = self.unknowns
        for name, u in point.items():
            unknown = known[name]
            if unknown.kind == "base" and u != 0.0:
                for address in unknown.addresses:
                    made[address] = info.values[address] * unknown.value(u)
            elif unknown.kind == "effect" and u != 0.0:
                for address in unknown.addresses:
                    made[address] = unknown.value(u)
        return made

    def varied(self, point: Point) -> dict[str, list[Any]]:
        """Parameters that the point puts at different values from run to run, for the runs state different ones."""
        values = [self.found(r, point) for r in range(len(self.runs))]
        each = {a: [v[a] for v in values] for a in values[0]}
        return {a: v for a, v in each.items() if any(other != v[0] for other in v)}

    def sensors(self, point: Point) -> dict[str, Sensor]:
        """The sensors at that point, by connector."""
        known = self.unknowns
        found: dict[str, dict[str, float]] = {}
        for name, u in point.items():
            if known[name].kind == "sensor" and u != 0.0:
                connector, _, quantity = name.removeprefix("sensor.").rpartition(".")
                found.setdefault(connector, {})[quantity] = known[name].value(u)
        return {connector: Sensor(**quantities) for connector, quantities in found.items()}

    def grid(self, run: int, step: float) -> np.ndarray:
        """Times of a run's rows [s]."""
        return np.arange(self._steps(run, step) + 1) * step

    def _steps(self, run: int, step: float) -> int:
        return int(np.ceil(self.runs[run].stop / step - 1e-6))

    def rows(
        self, points: Sequence[Point], step: float | Sequence[float], record: Sequence[str] = (), keep: bool = True,
        tight: bool | Sequence[bool] = False,
    ) -> list[list[np.ndarray] | None]:  # fmt: skip
        """Signals of every run at every point, or None where a run had to stop.

        step, tight: one for all or one for each; runs that are not tight and have a longer step than the package's use
        the catalogue's parameters for estimations.
        """
        record = tuple(record) or tuple(self.connectors)
        steps = [step] * len(points) if isinstance(step, (int, float)) else step
        tights = [tight] * len(points) if isinstance(tight, bool) else tight
        keys, jobs = [], OrderedDict()
        for point, step, tight in zip(points, steps, tights, strict=True):
            mine = []
            for r, info in enumerate(self.runs):
                changes = self.changes(r, point)
                if step > self.fine and not tight:
                    changes = {**self.catalogue.estimation, **changes}
                key = (r, step, self.method, record, tuple(sorted((k, repr(v)) for k, v in changes.items())))
                mine.append(key)
                if key not in self._kept and key not in jobs:
                    jobs[key] = Job(
                        record, self._steps(r, step) * step, step, changes, info.inputs, method=self.method
                    )
            keys.append(mine)
        fresh = dict(zip(jobs, self.pool.run(list(jobs.values())), strict=True))
        for key, result in fresh.items():
            if isinstance(result, Failure):
                self.failure = f"run '{self.runs[key[0]].name}': {result.reason}"
        if keep:
            self._kept.update(fresh)
        known = {**self._kept, **fresh}
        made: list[list[np.ndarray] | None] = []
        for mine in keys:
            results = [known[key] for key in mine]
            made.append(None if any(isinstance(x, Failure) for x in results) else results)
        while len(self._kept) > 150:
            self._kept.popitem(last=False)
        return made

    def read(self, point: Point, rows: list[np.ndarray], step: float) -> np.ndarray:
        """What the channels read, from the rows of a point."""
        grids = [self.grid(r, step) for r in range(len(self.runs))]
        columns = {name: i for i, name in enumerate(self.connectors)}
        return self.obs.read(grids, rows, columns, self.sensors(point))

    def evaluate(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """The model's long vectors at the points from runs at long steps; None where a run failed."""
        return self.answer(points, [])[0]

    def answer(
        self, coarse: Sequence[Point], exact: Sequence[Point]
    ) -> tuple[list[np.ndarray | None], list[np.ndarray | None]]:
        """The long vectors of some points at long steps, and of others as `exact` gives them, run side by side."""
        k, n = len(coarse), len(exact)
        double = n if self.order else 0
        points = [*coarse, *exact, *exact[:double]]
        steps = [self.coarse] * k + [self.fine] * n + [2.0 * self.fine] * double
        found = self.rows(points, steps, tight=[False] * k + [True] * (n + double))
        made = [None if r is None else self.read(p, r, h) for p, r, h in zip(points, found, steps, strict=True)]
        one, two = made[k : k + n], made[k + n :]
        if self.order:
            one = [None if y is None or z is None else self.limit(z, y) for y, z in zip(one, two, strict=True)]
        return made[:k], one

    def limit(self, double: np.ndarray, single: np.ndarray) -> np.ndarray:
        """What runs tend to as the macro step goes to 0, from those at some step and at twice that."""
        return single + (single - double) / (2.0**self.order - 1.0)

    def exact(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """The long vectors with the macro step's error extrapolated away, from runs at the package's step and at twice
        that; None where a run failed."""
        return self.answer([], points)[1]

    def at_step(self, point: Point, step: float) -> np.ndarray | None:
        """The long vector of a run at a macro step [s], as it is."""
        rows = self.rows([point], step, tight=True)[0]
        return None if rows is None else self.read(point, rows, step)


def pose(campaign: Campaign, catalogue: Catalogue, pool: Pool) -> Problem:
    """The problem of a campaign; raises one-line errors for what does not fit the package."""
    with Session(campaign.system) as session:
        units = session.system.units()
        connected = {link.end for link in session.system.links}
        for run in campaign.runs:
            for e in run.events:
                _of_entry(f"{campaign.file}: run '{run.name}', event", session, e.connector)
        for c in campaign.channels:
            where = f"{campaign.file}: channel '{c.column}'"
            is_output, _ = _of_entry(where, session, c.connector)
            given = is_output or split(c.connector, session.system.slaves) in connected
            if c.role == "input" and given:
                why = "an output of the model" if is_output else "connected to another component"
                raise CampaignError(f"{where}: '{c.connector}' cannot be an input: it is {why}")
            if c.role == "output" and not given and c.connector not in session.system.own_outputs:
                remedy = 'what was measured of it drives the model with role = "input"'
                raise CampaignError(f"{where}: '{c.connector}' is an input that nothing in the model drives; {remedy}")
            units |= own_unit(c, units, where)
        parameter_units = {
            f"{name}.{v}": own
            for name, slave in session.system.slaves.items()
            for v in slave.variables
            if (own := slave.unit_name(v)) is not None
        }
        signals = frozenset(f"{c}.{n}" for c, n in (*session.system.outputs, *session.system.inputs))
        start = session.structure.start_time
        fine = session.structure.step_size
        runs = []
        for run in campaign.runs:
            try:
                values = session.values(run.parameters)
            except CosimError as error:
                raise CampaignError(f"{campaign.file}: run '{run.name}': {error}") from None
            meant = [a for name in run.parameters for a in matching(name, values)]
            if (twice := repeated(meant)) is not None:
                raise CampaignError(f"{campaign.file}: run '{run.name}': two parameters mean '{twice}'")
            inputs = {}
            for c in campaign.inputs:
                if c.connector in run.series:
                    t, x = run.series[c.connector]
                    inputs[c.connector] = (t, _own(units[c.connector], x))
            runs.append(_RunInfo(run.name, run.stop, dict(run.parameters), inputs, values))
        check_catalogue(catalogue, session)
        try:
            session.values(catalogue.estimation)
        except ParameterError as error:
            raise CampaignError(f"estimation: {error}") from None
        except UnknownNameError:
            pass  # told below
        ends = session.structure.stop_time
    if start != 0.0:
        raise UsageError(f"{campaign.system.name}: starts at {start:g} s; a diagnosis needs a start at 0 s")
    warnings = list(campaign.warnings)
    blocks, floors = [], {}
    for k, c in enumerate(campaign.outputs):
        for run in campaign.runs:
            if c.connector in run.series:
                floors.setdefault(k, []).append(spread(_own(units[c.connector], run.series[c.connector][1])))
    for r, run in enumerate(campaign.runs):
        for k, c in enumerate(campaign.outputs):
            if c.connector not in run.series:
                continue
            t, y = run.series[c.connector]
            y = _own(units[c.connector], y)
            floor = float(np.median(floors[k]))
            if c.noise_std is not None:
                floor = float(np.hypot(c.noise_std / unit(units[c.connector]).factor, quantum(y) / np.sqrt(12.0)))
            t, y, m = thin(t, y)
            blocks.append((r, k, c.connector, t, y, floor / np.sqrt(m), None, c.noise_std is not None))
    fine = fine or min([float(np.median(np.diff(b[3]))) for b in blocks] or [1e-2]) / 10.0
    for run in campaign.runs:
        _check_length(f"{campaign.file}: run '{run.name}'", run, ends, fine, bool(campaign.inputs))
    labels = [c.connector for c in campaign.outputs]
    for r, run in enumerate(campaign.runs):
        for e in run.events:
            if e.label not in labels:
                labels.append(e.label)
            blocks.append((r, labels.index(e.label), e.connector, *_moment(e), True))
    for r, info in enumerate(runs):
        info.stop = max(b[3][-1] for b in blocks if b[0] == r)
        if campaign.runs[r].events:
            info.stop = max(info.stop, campaign.runs[r].stop)
    obs = gather(blocks)
    for info in runs:
        info.stop = float(np.ceil(info.stop / fine - 1e-9) * fine)
    connectors = list(dict.fromkeys(b[2] for b in blocks))
    base = _base(campaign, catalogue, runs, warnings)
    candidates = _candidates(campaign, catalogue, runs, obs, warnings)
    for name in catalogue.estimation:
        _addresses(name, runs[0].values, "estimation")
    return Problem(
        campaign, catalogue, pool, runs, obs, connectors, units, base, candidates, fine, labels, 1, warnings,
        parameter_units, signals, ends,
    )  # fmt: skip


def _moment(e: Event) -> tuple[np.ndarray, np.ndarray, float, Moment]:
    """Time, reading, floor and moment of an event; a limit is a reading that the model is clipped to."""
    if e.time is not None:
        reading, low, high = e.time, -np.inf, np.inf
    elif e.at_most is not None:
        reading, low, high = e.at_most, e.at_most, np.inf
    else:
        assert e.at_least is not None
        reading, low, high = e.at_least, -np.inf, e.at_least
    moment = Moment(e.target, e.within, e.after, low, high, e.until, e.first)
    return np.array([e.after + reading]), np.array([reading]), e.std, moment


def _own(own: str, values: np.ndarray) -> np.ndarray:
    """SI values in the FMU's own unit."""
    u = unit(own)
    return (values - u.offset) / u.factor


def matching(name: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    """The addresses that a name means: itself, or without a component that parameter wherever it exists."""
    return (name,) if name in values else tuple(a for a in values if a.partition(".")[2] == name)


def _addresses(name: str, values: Mapping[str, Any], where: str) -> tuple[str, ...]:
    found = matching(name, values)
    if not found:
        raise UnknownNameError(f"{where}: no component has a parameter '{name}'{did_you_mean(name, list(values))}")
    return found


def _base(
    campaign: Campaign, catalogue: Catalogue, runs: list[_RunInfo], warnings: list[str]
) -> tuple[Unknown, ...]:
    tolerances = {}
    values = runs[0].values
    for b in catalogue.base:
        tolerances[_addresses(b.parameter, values, f"base {b.parameter}")] = b.tolerance
    for name, tolerance in campaign.base.items():
        tolerances[_addresses(name, values, f"{campaign.file}: base {name}")] = tolerance
    made = []
    changed = {a: e.id for e in catalogue.effects for p in e.parameters for a in (p.address, *p.also)}
    told = [a for addresses in tolerances for a in addresses]
    if (twice := repeated(told)) is not None:
        raise CampaignError(f"{campaign.file}: base: two entries mean '{twice}'; name it in full in one of them only")
    for addresses, tolerance in tolerances.items():
        if tolerance == 0.0:
            continue
        for a in addresses:
            if a in changed:
                raise CampaignError(f"base {a}: that is what effect {changed[a]} changes; leave it out of the base")
            if isinstance(values[a], (bool, str)) or not isinstance(values[a], (int, float)):
                raise CampaignError(f"base {a}: {values[a]!r} is no number that could be refitted")
        if all(info.values[a] == 0.0 for info in runs for a in addresses):
            warnings.append(f"base parameter '{addresses[0]}' is 0 and has no relative tolerance; it is held")
            continue
        made.append(Unknown(addresses[0], "base", 1.0, tolerance, -REACH, REACH, 0.6, addresses))
    return tuple(made)


def _candidates(
    campaign: Campaign, catalogue: Catalogue, runs: list[_RunInfo], obs: Observations, warnings: list[str]
) -> tuple[Candidate, ...]:
    made = [_effect(e, runs, warnings) for e in catalogue.effects]
    channels = [c for k, c in enumerate(campaign.outputs) if any(b.channel == k for b in obs.blocks)]
    for s in catalogue.sensors:
        for k, c in enumerate(campaign.outputs):
            if c in channels:
                made.append(_sensor(s, c.connector, float(obs.span[k]), len(channels)))
    return tuple(made)


def check_catalogue(catalogue: Catalogue, session: Session) -> None:
    """Every entry has to be of the package, and its values such that the FMUs take them; nothing is found out later."""
    known = session.values()

    def trying(entry: str, address: str, values: Iterable[float]) -> None:
        if any(isinstance(known[a], (bool, str)) for a in _addresses(address, known, entry)):
            raise CampaignError(f"{entry}: '{address}' is no real number")
        for value in values:
            try:
                session.values({address: value})
            except CosimError as error:
                raise CampaignError(f"{entry}: {error}") from None

    for effect in catalogue.effects:
        for p in effect.parameters:
            for address in (p.address, *p.also):
                trying(f"effect {effect.id}", address, (p.low, p.high))
    for e in catalogue.experiments:
        trying(f"experiment {e.parameter}", e.parameter, e.values)
    for m in catalogue.measurables:
        _of_entry(f"measurable {m.connector}", session, m.connector)
    for region in catalogue.regions:
        _of_entry(f"region '{region.text}'", session, region.signal)


def _of_entry(entry: str, session: Session, connector: str) -> tuple[bool, int]:
    """Whether the connector of an entry is an output, and its slot."""
    try:
        return session.place(connector)
    except UnknownNameError as error:
        raise UnknownNameError(f"{entry}: {error}") from None


def _check_length(where: str, run: Run, ends: float | None, fine: float, driven: bool) -> None:
    """A run's length betrays a wrong unit of its time."""
    if run.stop / fine > LONGEST:
        raise CampaignError(f"{where} lasts {run.stop:g} s, {run.stop / fine:.1e} steps: is time in seconds?")
    if ends is None or driven:
        return
    unit_ = next((u for u, f in TIMES.items() if 0.5 < run.stop / (f * ends) < 1.5), None)
    if unit_ is not None:
        raise CampaignError(
            f"{where} lasts {run.stop:g} s, the scenario {ends:g} s: is time in {unit_}? It has to be in "
            "seconds"
        )


def _effect(effect: Effect, runs: list[_RunInfo], warnings: list[str]) -> Candidate:
    unknowns = []
    for p in effect.parameters:
        for address in (p.address, *p.also):
            if address not in runs[0].values:
                hint = did_you_mean(address, list(runs[0].values))
                raise UnknownNameError(f"effect {effect.id}: the package has no parameter '{address}'{hint}")
        start = float(runs[0].values[p.address])
        if any(info.values[p.address] != start for info in runs):
            warnings.append(f"effect {effect.id}: '{p.address}' differs between the runs; the first run's counts")
        low, high = (p.low - start) / p.prior, (p.high - start) / p.prior
        unknowns.append(
            Unknown(
                p.address, "effect", start, p.prior, min(low, 0.0), max(high, 0.0), 3.0, (p.address, *p.also), p.shape,
                tuple((v - start) / p.prior for v in p.starts),
            )
        )  # fmt: skip
    return Candidate(effect.id, effect.text, effect.group, tuple(sorted(unknowns, key=lambda u: u.shape)))


def _sensor(effect: SensorEffect, connector: str, span: float, channels: int) -> Candidate:
    scale = effect.prior * (span if effect.quantity == "bias" else 1.0)
    name = f"sensor.{connector}.{effect.quantity}"
    low, high = (effect.low - effect.neutral) / effect.prior, (effect.high - effect.neutral) / effect.prior
    unknown = Unknown(name, "sensor", effect.neutral, scale, low, high, 3.0)
    return Candidate(effect.id, effect.text, effect.group, (unknown,), 1.0 / channels)
