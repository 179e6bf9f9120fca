"""Makes the problem of a campaign; everything that does not fit the package is told here, in one line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import CosimError, ParameterError, UnknownNameError, UsageError, did_you_mean
from ...core.repeated import repeated
from ...core.units import unit
from ...master.parallel.pool import Pool
from ...master.simulation.session import Session
from ...master.system.addresses import split
from ..campaign.campaign import Campaign, CampaignError, Event, Run, unit_in_fmu
from ..campaign.catalogue import Catalogue
from ..settings import DEFAULT, Settings
from .candidates import addresses_of, base_parameters, check_catalogue, connector_of, effect_candidates
from .discretisation import Discretisation
from .noise import estimate_channel_noise, quantisation_step
from .observations import EventObservation, RawBlock, average_neighbours, gather
from .problem import Problem, RunConditions, matching
from .simulator import Simulator
from .stop import StopToken

TIME_UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9, "minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0}
"""Units that times are found in, as multiples that a number of them is of one in seconds."""

TIME_UNIT_KEYS = {"minutes": "min", "hours": "h"}
"""What `time_unit` calls them, where that is another name."""


@dataclass(frozen=True)
class _Package:
    """What the campaign's package says of itself."""

    units: dict[str, str]
    parameter_units: dict[str, str]
    signals: frozenset[str]
    step: float | None
    stop: float | None
    runs: tuple[RunConditions, ...]


def build_problem(
    campaign: Campaign, catalogue: Catalogue, pool: Pool, stop: StopToken | None = None, settings: Settings = DEFAULT
) -> Problem:
    """The problem of a campaign; raises one-line errors for what does not fit the package."""
    with Session(campaign.system) as session:
        package = _read_package(campaign, catalogue, session)
    warnings = list(campaign.warnings)
    blocks = _series(campaign, package.units, settings)
    macro_step = package.step or _usual_step(campaign, blocks)
    for run in campaign.runs:
        _check_length(
            f"{campaign.file}: run '{run.name}'", run, package.stop, macro_step, bool(campaign.inputs), settings
        )
    labels = [c.connector for c in campaign.outputs]
    blocks += _events(campaign, labels)
    runs = tuple(
        _until_last_reading(r, conditions, campaign, blocks, macro_step) for r, conditions in enumerate(package.runs)
    )
    observations = gather(blocks, settings.noise)
    base = base_parameters(campaign, catalogue, runs, warnings, settings.parameters)
    possible = effect_candidates(campaign, catalogue, runs, observations, warnings, settings)
    accepted = tuple(c.as_accepted() for c in possible if c.id in campaign.accept)
    candidates = tuple(c for c in possible if c.id not in campaign.accept)
    base = (*base, *(x for c in accepted for x in c.parameters))
    with catalogue.named_in_errors():
        for name in catalogue.estimation:
            addresses_of(name, runs[0].values, "estimation")
    discretisation = Discretisation(macro_step, difference_step=settings.numerics.difference_steps[0])
    return Problem(
        campaign, catalogue, Simulator(pool, stop, settings.numerics.kept), discretisation, runs, observations,
        tuple(dict.fromkeys(b.connector for b in blocks)), package.units, base, candidates, tuple(labels),
        accepted, tuple(warnings), package.parameter_units, package.signals, package.stop, settings,
    )  # fmt: skip


def _usual_step(campaign: Campaign, blocks: Sequence[RawBlock]) -> float:
    """Macro step of a package that says none [s]: a tenth of the readings' interval, and no longer than that of what
    drives the model, before readings are averaged."""
    compared = [float(np.median(np.diff(b.t))) / 10.0 for b in blocks]
    driving = [
        float(np.median(np.diff(run.series[c.connector][0])))
        for run in campaign.runs for c in campaign.inputs if c.connector in run.series
    ]  # fmt: skip
    return min([*compared, *driving] or [1e-3])


def _read_package(campaign: Campaign, catalogue: Catalogue, session: Session) -> _Package:
    units = _units(campaign, session)
    parameter_units = {
        f"{name}.{v}": unit_name
        for name, instance in session.system.instances.items()
        for v in instance.variables
        if (unit_name := instance.unit_name(v)) is not None
    }
    signals = frozenset(f"{c}.{n}" for c, n in (*session.system.outputs, *session.system.inputs))
    start, step = session.structure.start_time, session.structure.step_size
    runs = tuple(_conditions(campaign, run, session, units) for run in campaign.runs)
    with catalogue.named_in_errors():
        check_catalogue(catalogue, session)
    _check_accepted(campaign, catalogue)
    with catalogue.named_in_errors():
        try:
            session.values(catalogue.estimation)
        except ParameterError as error:
            raise CampaignError(f"estimation: {error}") from None
        except UnknownNameError:
            pass  # told when its addresses are looked for
    if start != 0.0:
        raise UsageError(f"{campaign.system.name}: starts at {start:g} s; a diagnosis needs a start at 0 s")
    return _Package(units, parameter_units, signals, step, session.structure.stop_time, runs)


def _check_accepted(campaign: Campaign, catalogue: Catalogue) -> None:
    ids = [*(e.id for e in catalogue.effects), *(s.id for s in catalogue.sensors)]
    for id in campaign.accept:
        if id not in ids:
            raise CampaignError(f"{campaign.file}: accept: no effect '{id}' in the catalogue{did_you_mean(id, ids)}")


def _units(campaign: Campaign, session: Session) -> dict[str, str]:
    """Unit of each connector in its FMU; every channel and event has to have a connector of its role."""
    units = session.system.units()
    connected = {link.end for link in session.system.links}
    for run in campaign.runs:
        for e in run.events:
            connector_of(f"{campaign.file}: run '{run.name}', event", session, e.connector)
    for c in campaign.channels:
        where = f"{campaign.file}: channel '{c.column}'"
        is_output, _ = connector_of(where, session, c.connector)
        driven = is_output or split(c.connector, session.system.instances) in connected
        if c.role == "input" and driven:
            reason = "an output of the model" if is_output else "connected to another component"
            raise CampaignError(f"{where}: '{c.connector}' cannot be an input: it is {reason}")
        if c.role == "output" and not driven and c.connector not in session.system.system_outputs:
            remedy = 'what was measured of it drives the model with role = "input"'
            raise CampaignError(f"{where}: '{c.connector}' is an input that nothing in the model drives; {remedy}")
        units |= unit_in_fmu(c, units, where)
    return units


def _conditions(campaign: Campaign, run: Run, session: Session, units: dict[str, str]) -> RunConditions:
    try:
        values = session.values(run.parameters)
    except CosimError as error:
        raise CampaignError(f"{campaign.file}: run '{run.name}': {error}") from None
    addresses = [a for name in run.parameters for a in matching(name, values)]
    if (duplicate := repeated(addresses)) is not None:
        raise CampaignError(f"{campaign.file}: run '{run.name}': two parameters mean '{duplicate}'")
    inputs = {}
    for c in campaign.inputs:
        if c.connector in run.series:
            t, x = run.series[c.connector]
            inputs[c.connector] = (t, _to_fmu_unit(units[c.connector], x))
    return RunConditions(run.name, run.stop, dict(run.parameters), inputs, values)


def _series(campaign: Campaign, units: dict[str, str], settings: Settings) -> list[RawBlock]:
    """The time series of all runs, averaged where they are faster than needed, with their noise."""
    estimated: dict[int, list[float]] = {}
    for k, c in enumerate(campaign.outputs):
        for run in campaign.runs:
            if c.connector in run.series:
                t, readings = run.series[c.connector]
                readings = _to_fmu_unit(units[c.connector], readings)
                estimated.setdefault(k, []).append(estimate_channel_noise(readings, settings.noise, t))
    blocks = []
    for r, run in enumerate(campaign.runs):
        for k, c in enumerate(campaign.outputs):
            if c.connector not in run.series:
                continue
            t, y = run.series[c.connector]
            y = _to_fmu_unit(units[c.connector], y)
            noise = float(np.median(estimated[k]))
            if c.noise_std is not None:
                stated_std = c.noise_std / unit(units[c.connector]).factor
                noise = float(np.hypot(stated_std, quantisation_step(y, settings.noise) / np.sqrt(12.0)))
            times, y = average_neighbours(t, y, settings.noise.max_samples)
            averaging = np.sqrt(times.shape[1])
            jitter = None if c.clock_jitter is None else c.clock_jitter / averaging
            stated = c.noise_std is not None
            blocks.append(
                RawBlock(r, k, c.connector, times.mean(1), y, noise / averaging, None, stated, jitter, times)
            )
    return blocks


def _events(campaign: Campaign, labels: list[str]) -> list[RawBlock]:
    """The measured moments of all runs; their channels' names are added to the labels."""
    blocks = []
    for r, run in enumerate(campaign.runs):
        for e in run.events:
            if e.label not in labels:
                labels.append(e.label)
            blocks.append(_event(r, labels.index(e.label), e))
    return blocks


def _event(run: int, channel: int, e: Event) -> RawBlock:
    """An event as a block; a limit is a reading that the model is clipped to."""
    if e.time is not None:
        reading, low, high = e.time, -np.inf, np.inf
    elif e.at_most is not None:
        reading, low, high = e.at_most, e.at_most, np.inf
    else:
        assert e.at_least is not None
        reading, low, high = e.at_least, -np.inf, e.at_least
    event = EventObservation(e.target, e.within, e.after, low, high, e.until, e.first)
    return RawBlock(run, channel, e.connector, np.array([e.after + reading]), np.array([reading]), e.std, event, True)


def _until_last_reading(
    r: int, conditions: RunConditions, campaign: Campaign, blocks: Sequence[RawBlock], step: float
) -> RunConditions:
    """The run, as far as it was measured, in whole steps."""
    stop = max(float((b.t if b.members is None else b.members).max()) for b in blocks if b.run == r)
    if campaign.runs[r].events:
        stop = max(stop, campaign.runs[r].stop)
    return replace(conditions, stop=float(np.ceil(stop / step - 1e-9) * step))


def _to_fmu_unit(name: str, values: np.ndarray) -> np.ndarray:
    """SI values in the FMU's own unit."""
    u = unit(name)
    converted: np.ndarray = (values - u.offset) / u.factor
    return converted


def _check_length(where: str, run: Run, scenario: float | None, step: float, driven: bool, settings: Settings) -> None:
    """A run's length betrays a wrong unit of its time."""
    fitting = [u for u, f in TIME_UNITS.items() if scenario is not None and 0.5 < run.stop / (f * scenario) < 1.5]
    keys = [f'time_unit = "{TIME_UNIT_KEYS.get(u, u)}"' for u in fitting]
    unknown = "in which unit is its time? 'time_unit' says so"
    if run.stop < step:
        raise CampaignError(f"{where} lasts {run.stop:.3g} s, less than a step of the model ({step:g} s): {unknown}")
    if run.stop / step > settings.numerics.max_steps:
        remedy = f"{keys[0]} makes it as long as the scenario" if keys else "'time_unit' says another unit"
        raise CampaignError(
            f"{where} lasts {run.stop:g} s, {run.stop / step:.1e} steps: is time in seconds? {remedy}, 'start' where "
            "in the file the model starts"
        )
    if fitting and not driven:
        raise CampaignError(
            f"{where} lasts {run.stop:g} s, the scenario {scenario:g} s: is time in {fitting[0]}? Then it needs "
            f"{keys[0]}"
        )
    finer = settings.sanity.finer_units
    if scenario is not None and not driven and any(0.5 < run.stop * f / scenario < 1.5 for f in finer):
        raise CampaignError(f"{where} lasts {run.stop:g} s, the scenario {scenario:g} s: {unknown}")
