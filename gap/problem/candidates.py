"""The catalogue's entries as parameters to be estimated; what does not fit the package is told here."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import log
from typing import Any

from ...core.errors import CosimError, UnknownNameError, did_you_mean
from ...core.repeated import repeated
from ...master.simulation.session import Session
from ..campaign.campaign import BaseTolerance, Campaign, CampaignError, FactorTolerance
from ..campaign.catalogue import Catalogue, Curve, Effect, Parameter, SensorEffect, SensorFormParameter
from ..settings import ParameterSettings, Settings
from .curves import CurveForm, curve_form, formula_over, knots_of
from .observations import Observations
from .parameters import EffectCandidate, EffectForm, EstimatedParameter
from .problem import RunConditions, matching


def addresses_of(name: str, values: Mapping[str, Any], where: str) -> tuple[str, ...]:
    """The addresses that a name means; raises `UnknownNameError`."""
    addresses = matching(name, values)
    if not addresses:
        raise UnknownNameError(f"{where}: no component has a parameter '{name}'{did_you_mean(name, list(values))}")
    return addresses


def connector_of(entry: str, session: Session, connector: str) -> tuple[bool, int]:
    """Whether the connector of an entry is an output, and its slot."""
    try:
        return session.place(connector)
    except UnknownNameError as error:
        raise UnknownNameError(f"{entry}: {error}") from None


def base_parameters(
    campaign: Campaign, catalogue: Catalogue, runs: Sequence[RunConditions], warnings: list[str],
    settings: ParameterSettings,
) -> tuple[EstimatedParameter, ...]:  # fmt: skip
    """The base parameters of catalogue and campaign; what is held instead is added to the warnings."""
    values = runs[0].values
    tolerances = _tolerances(campaign, catalogue, values)
    changed = {a: f"effect {e.id}" for e in catalogue.effects for p in e.all_parameters for a in (p.address, *p.also)}
    changed |= {a: f"curve {c.id}" for c in catalogue.curves for a in c.parameters}
    parameters = []
    for addresses, tolerance in tolerances.items():
        if tolerance == 0.0:
            continue
        if isinstance(tolerance, FactorTolerance):
            factor, scale = tolerance.factor, log(tolerance.factor)
        else:
            factor, scale = None, tolerance
        for a in addresses:
            if a in changed:
                raise CampaignError(f"base {a}: that is what {changed[a]} changes; leave it out of the base")
            if isinstance(values[a], (bool, str)) or not isinstance(values[a], (int, float)):
                raise CampaignError(f"base {a}: {values[a]!r} is no number that could be refitted")
        if all(conditions.values[a] == 0.0 for conditions in runs for a in addresses):
            warnings.append(f"base parameter '{addresses[0]}' is 0 and has no relative tolerance; it is held")
            continue
        reach, std = settings.base_reach, settings.base_std
        parameters.append(
            EstimatedParameter(addresses[0], "base", 1.0, scale, -reach, reach, std, addresses, factor=factor)
        )
    return tuple(parameters)


def _tolerances(
    campaign: Campaign, catalogue: Catalogue, values: Mapping[str, Any]
) -> dict[tuple[str, ...], BaseTolerance]:
    """Tolerance by addresses; those of the campaign count."""
    tolerances: dict[tuple[str, ...], BaseTolerance] = {}
    with catalogue.named_in_errors():
        for b in catalogue.base:
            tolerances[addresses_of(b.parameter, values, f"base {b.parameter}")] = b.tolerance
    for name, tolerance in campaign.base.items():
        tolerances[addresses_of(name, values, f"{campaign.file}: base {name}")] = tolerance
    listed = [a for addresses in tolerances for a in addresses]
    if (duplicate := repeated(listed)) is not None:
        raise CampaignError(
            f"{campaign.file}: base: two entries mean '{duplicate}'; name it in full in one of them only"
        )
    return tolerances


def effect_candidates(
    campaign: Campaign, catalogue: Catalogue, runs: Sequence[RunConditions], observations: Observations,
    warnings: list[str], settings: Settings,
) -> tuple[EffectCandidate, ...]:  # fmt: skip
    """The effects of the machine, and those of every channel's sensor, unless it reads the same all the time."""
    curves = [curve_form(c, settings.curves) for c in catalogue.curves]
    candidates = [_effect_candidate(e, curves, runs, warnings, settings.parameters) for e in catalogue.effects]
    channels = [c for k, c in enumerate(campaign.outputs) if any(b.channel == k for b in observations.blocks)]
    for s in catalogue.sensors:
        for k, c in enumerate(campaign.outputs):
            if c in channels and not observations.is_constant(k, settings.parameters.least_span):
                candidates.append(
                    _sensor_candidate(s, c.connector, float(observations.span[k]), len(channels), settings.parameters)
                )
    return tuple(candidates)


def _effect_candidate(
    effect: Effect, curves: Sequence[CurveForm], runs: Sequence[RunConditions], warnings: list[str],
    settings: ParameterSettings,
) -> EffectCandidate:  # fmt: skip
    def estimated(entries: Sequence[Parameter]) -> tuple[EstimatedParameter, ...]:
        return tuple(_effect_parameter(effect.id, p, runs, warnings, settings) for p in entries)

    parameters = sorted(estimated(effect.parameters), key=lambda u: u.shape)
    forms = [EffectForm(f.id, f.text, estimated(f.parameters)) for f in effect.forms]
    forms += [c for c in curves if effect.id in c.curve.effects]
    return EffectCandidate(effect.id, effect.text, effect.group, tuple(parameters), forms=tuple(forms))


def _effect_parameter(
    effect: str, p: Parameter, runs: Sequence[RunConditions], warnings: list[str], settings: ParameterSettings
) -> EstimatedParameter:
    for address in (p.address, *p.also):
        if address not in runs[0].values:
            hint = did_you_mean(address, list(runs[0].values))
            raise UnknownNameError(f"effect {effect}: the package has no parameter '{address}'{hint}")
    start = float(runs[0].values[p.address])
    if any(conditions.values[p.address] != start for conditions in runs):
        warnings.append(f"effect {effect}: '{p.address}' differs between the runs; the first run's counts")
    low, high = min((p.low - start) / p.prior, 0.0), max((p.high - start) / p.prior, 0.0)
    std = max(settings.effect_std, max(high, -low) / settings.effect_range)
    return EstimatedParameter(
        p.address, "effect", start, p.prior, low, high, std,
        (p.address, *p.also), p.shape, tuple((v - start) / p.prior for v in p.starts),
        longest_run=max(conditions.stop for conditions in runs) if p.period else 0.0, frequency=p.frequency,
    )  # fmt: skip


def _sensor_candidate(
    effect: SensorEffect, connector: str, span: float, channels: int, settings: ParameterSettings
) -> EffectCandidate:
    unit = {"bias": span, "drift": span / settings.drift_time, "curvature": 4.0 / span}.get(effect.quantity, 1.0)
    forms = tuple(
        EffectForm(f.id, f.text, (_sensor_parameter(f.parameter, connector, 1.0, settings, True),))
        for f in effect.forms
    )
    main = _sensor_parameter(effect, connector, unit, settings)
    return EffectCandidate(effect.id, effect.text, effect.group, (main,), 1.0 / channels, forms)


def _sensor_parameter(
    x: SensorEffect | SensorFormParameter, connector: str, unit: float, settings: ParameterSettings, shape: bool = False
) -> EstimatedParameter:
    low, high = (x.low - x.neutral) / x.prior, (x.high - x.neutral) / x.prior
    starts = tuple((v - x.neutral) / x.prior for v in x.starts)
    return EstimatedParameter(
        f"sensor.{connector}.{x.quantity}", "sensor", x.neutral, x.prior * unit, low, high, settings.effect_std,
        shape=shape, starts=starts,
    )  # fmt: skip


def check_catalogue(catalogue: Catalogue, session: Session) -> None:
    """Every entry has to be of the package, and its values such that the FMUs take them; nothing is found out later."""
    parameters = session.values()

    def check_values(entry: str, address: str, values: Iterable[float]) -> None:
        if any(isinstance(parameters[a], (bool, str)) for a in addresses_of(address, parameters, entry)):
            raise CampaignError(f"{entry}: '{address}' is no real number")
        for value in values:
            try:
                session.values({address: value})
            except CosimError as error:
                raise CampaignError(f"{entry}: {error}") from None

    for effect in catalogue.effects:
        for p in effect.all_parameters:
            for address in (p.address, *p.also):
                check_values(f"effect {effect.id}", address, (p.low, p.high))
            for address in p.also:
                if parameters[address] != parameters[p.address]:
                    raise CampaignError(
                        f"effect {effect.id}: 'also' is for what takes the same value, and '{p.address}' "
                        f"stands at {parameters[p.address]} in the package, '{address}' at {parameters[address]}"
                    )
    for c in catalogue.curves:
        _check_curve(c, session, check_values)
    for e in catalogue.experiments:
        check_values(f"experiment {e.parameter}", e.parameter, e.values)
    for m in catalogue.measurables:
        connector_of(f"measurable {m.connector}", session, m.connector)
    for region in catalogue.regions:
        connector_of(f"region '{region.text}'", session, region.signal)


def _check_curve(curve: Curve, session: Session, check_values: Callable[[str, str, Iterable[float]], None]) -> None:
    entry, parameters = f"curve {curve.id}", session.values()
    for address in (*curve.parameters, *filter(None, [curve.knots_of]), *curve.names.values()):
        if address not in parameters:
            hint = did_you_mean(address, list(parameters))
            raise UnknownNameError(f"{entry}: the package has no parameter '{address}'{hint}")
        check_values(entry, address, (-curve.prior, curve.prior) if address in curve.parameters else ())
    try:
        formula_over(curve, parameters, knots_of(curve, parameters))
    except ValueError as error:
        raise CampaignError(f"{entry}: formula {error}") from None
