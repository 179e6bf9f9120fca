"""Whether a channel, an input or the time of a campaign is in another unit than it says.

The model as delivered tells. A factor of ten in a measured input moves every channel, so whatever looks wrong is tried
on the inputs and the time, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...core.units import UNITS, Unit, convert, unit
from ...master.parallel.pool import Failure, Job
from ..campaign.campaign import CampaignError, Channel
from ..problem.build import TIME_UNITS
from ..problem.noise import rms
from ..problem.observations import Block
from ..problem.problem import Problem
from ..settings import SanitySettings


@dataclass(frozen=True)
class _Suspect:
    """A channel that another unit would bring nearer, and how it moves."""

    channel: Channel
    better_unit: str
    text: str
    sure: bool = True
    """No machine differs from its model by so much; else it is only remarked on."""


def check_units(problem: Problem, nominal: np.ndarray) -> list[str]:
    """Raise `CampaignError` for what is likelier in another unit; returns warnings of what may be.

    nominal: the prediction (n,) of the model as delivered.
    """
    settings = problem.settings.sanity
    suspects = [x for k in range(len(problem.campaign.outputs)) if (x := _suspect(problem, k, nominal)) is not None]
    suspect = next((x for x in suspects if x.sure), None)
    warnings = [f"{x.text}; is it in {x.better_unit}? {_remedy([''])}" for x in suspects if not x.sure]
    models = {b.place.start: nominal[b.place] for b in problem.observations.series}
    stated_shares = _missed_shares(problem, models)
    if suspect is None and max(stated_shares, default=0.0) <= settings.movement_lost:
        return warnings
    explanations = [(_log_sum(shares), text, shares) for shares, text in _explanations(problem)]
    if suspect is None:
        loss, text, shares = min(explanations, default=(np.inf, "", []))
        recovered = any(
            before > settings.movement_lost and after < settings.movement_found
            for before, after in zip(stated_shares, shares, strict=False)
        )
        if recovered and loss < _log_sum(stated_shares) - settings.as_good:
            raise CampaignError(
                f"{problem.campaign.file}: the model misses the channels' movement; {text}? {_remedy([text])}"
            )
        return warnings
    suspect_shares = _missed_shares(problem, models, suspect)
    explanations = [
        (_log_sum(suspect_shares), f"is it in {suspect.better_unit}", suspect_shares), *sorted(explanations)
    ]  # fmt: skip
    least = min(explanations)[0]
    texts = [text for loss, text, _ in explanations if loss <= least + settings.as_good][:3]
    raise CampaignError(f"{problem.campaign.file}: {suspect.text}; {', or '.join(texts)}? {_remedy(texts)}")


def _remedy(texts: list[str]) -> str:
    keys = {"'time_unit'" if text.startswith("is time") else "the channel's 'unit'" for text in texts}
    return f"Then {' or '.join(sorted(keys, reverse=True))} has to say so"


def _log_sum(shares: list[float]) -> float:
    return float(np.log(shares).sum())


def _suspect(problem: Problem, k: int, nominal: np.ndarray) -> _Suspect | None:
    """The channel, where the readings move or stand unlike the model as those of another unit would."""
    parts = [b for b in problem.observations.series if b.channel == k]
    if not parts:
        return None
    channel = problem.campaign.outputs[k]
    return _scale_mismatch(problem, channel, parts, nominal) or _offset_mismatch(problem, channel, parts, nominal)


def _scale_mismatch(problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray) -> _Suspect | None:
    """Where the readings are larger or smaller than the model's by what is between two units."""
    settings = problem.settings.sanity
    measured = max(np.ptp(b.y) for b in parts)
    noise = max(b.noise_std for b in parts)
    modelled = max(np.ptp(nominal[b.place]) for b in parts)
    word = "moves by"
    rests = modelled <= settings.rest * max(np.abs(nominal[b.place]).max() for b in parts)
    if rests or max(modelled, measured) <= settings.quiet * noise:
        word = "is at"
        measured = max(np.abs(np.median(b.y)) for b in parts)
        modelled = max(np.abs(np.median(nominal[b.place])) for b in parts)
    if max(modelled, measured) <= settings.quiet * noise or min(modelled, measured) <= 0.0:
        return None
    ratio, fmu_unit = measured / modelled, problem.units[c.connector]
    size, better_unit = abs(float(np.log(ratio))), None
    doubtful = size > np.log(settings.doubtful_ratio)
    if size > np.log(settings.wrong_ratio):
        better_unit = likelier_unit(c.unit, ratio, 2.0 * settings.better_share)
        if better_unit and _misfit(parts, nominal, fmu_unit, c.unit, better_unit) > _misfit(parts, nominal, fmu_unit):
            better_unit = None  # it moves where the model rests, as far from its level in any unit
    elif size > np.log(settings.possible_ratio):
        better_unit = likelier_unit(c.unit, ratio, settings.ratio_fits)
        share = settings.better_share if doubtful else settings.much_better_share
        if better_unit and not _explains(problem, c, parts, nominal, better_unit, share, word == "moves by"):
            better_unit = None
    if better_unit is None:
        return None
    shown = [f"{convert(float(x), fmu_unit, c.unit):.4g} {c.unit}" for x in (measured, modelled)]
    text = f"channel '{c.column}': it {word} {shown[0]} where the model {word} {shown[1]}"
    return _Suspect(c, better_unit, text, doubtful)


def _explains(
    problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray, better_unit: str, share: float, moves: bool
) -> bool:
    """Whether the model misses far less of the readings in the better unit, and little of them themselves.

    Large readings that have nothing of the model become smaller in a larger unit, too.
    """
    fmu_unit = problem.units[c.connector]
    after = _misfit(parts, nominal, fmu_unit, c.unit, better_unit)
    if after > share * _misfit(parts, nominal, fmu_unit):
        return False
    read = [_reinterpret(b.y, fmu_unit, c.unit, better_unit) for b in parts]
    whole = rms(np.concatenate([y - y.mean() if moves else y for y in read]))
    return after <= problem.settings.sanity.shape_missed * whole


def _offset_mismatch(problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray) -> _Suspect | None:
    """Where the readings stand off the model by what is between the zeros of two units, as of K and degC."""
    settings, fmu_unit = problem.settings.sanity, problem.units[c.connector]
    stated_misfit = _misfit(parts, nominal, fmu_unit)
    candidates = [u for u in _other_units(c.unit) if u.offset != unit(c.unit).offset]
    if not candidates or stated_misfit <= settings.quiet * max(b.noise_std for b in parts):
        return None
    readings = np.concatenate([b.y for b in parts])
    model = np.concatenate([nominal[b.place] for b in parts])
    moves = max(float(np.ptp(readings)), float(np.ptp(model)))
    misfits = {u.name: _misfit(parts, nominal, fmu_unit, c.unit, u.name) for u in candidates}
    better_unit = min(misfits, key=misfits.__getitem__)
    shift = float(np.median(np.abs(_reinterpret(readings, fmu_unit, c.unit, better_unit) - readings)))
    share = settings.better_share if shift > settings.zero_beyond * moves else settings.much_better_share
    if misfits[better_unit] > share * stated_misfit:
        return None
    shown = [f"{convert(float(np.median(x)), fmu_unit, c.unit):.4g} {c.unit}" for x in (readings, model)]
    absolute = (unit(c.unit).offset == 0.0) != (unit(better_unit).offset == 0.0)  # 255 K apart, degC and degF about 40
    return _Suspect(
        c, better_unit, f"channel '{c.column}': it is at {shown[0]} where the model is at {shown[1]}", absolute
    )  # fmt: skip


def _misfit(parts: list[Block], nominal: np.ndarray, fmu_unit: str, stated: str = "", better_unit: str = "") -> float:
    """RMS of the readings less the model, in the connector's unit; of readings in another unit than the stated one."""
    read = [_reinterpret(b.y, fmu_unit, stated, better_unit) if better_unit else b.y for b in parts]
    return rms(np.concatenate([y - nominal[b.place] for y, b in zip(read, parts, strict=True)]))


def _reinterpret(values: np.ndarray, fmu_unit: str, stated: str, better_unit: str) -> np.ndarray:
    """Values in the FMU's unit, had they been read in a better one than the stated."""
    return convert(convert(values, fmu_unit, stated), better_unit, fmu_unit)


def _other_units(stated: str) -> Iterator[Unit]:
    """The other units of the same quantity, one of each size; those that are angles too, of an angle, come first."""
    same = unit(stated)
    sizes = {(same.factor, same.offset)}
    for u in sorted(UNITS.values(), key=lambda u: u.exponents != same.exponents):
        if u.same_dimension(same) and (u.factor, u.offset) not in sizes:
            sizes.add((u.factor, u.offset))
            yield u


def likelier_unit(stated: str, ratio: float, within: float) -> str | None:
    """The unit of the same quantity whose readings, taken for the stated one, would differ by the ratio."""
    fitting = [(abs(np.log(ratio * u.factor / unit(stated).factor)), u.name) for u in _other_units(stated)]
    best = min(fitting, default=(9.0, ""))
    return best[1] if best[0] < within else None


def _missed_shares(problem: Problem, models: Mapping[int, np.ndarray], suspect: _Suspect | None = None) -> list[float]:
    """Share of each channel's movement that the models (by the start of a block's place) miss, whatever the bias."""
    settings = problem.settings.sanity
    shares = []
    for k, c in enumerate(problem.campaign.outputs):
        parts = [b for b in problem.observations.series if b.channel == k]
        if not parts:
            continue
        read, model = [b.y for b in parts], [models[b.place.start] for b in parts]
        if suspect is not None and suspect.channel == c:
            read = [_reinterpret(y, problem.units[c.connector], c.unit, suspect.better_unit) for y in read]
        shares.append(missed_share(read, model, max(b.noise_std for b in parts), settings))
    return shares


def missed_share(readings: list[np.ndarray], model: list[np.ndarray], noise: float, settings: SanitySettings) -> float:
    """Share of the movement of a channel's readings, block by block, that a model misses, whatever the bias."""
    movement = rms(np.concatenate([y - y.mean() for y in readings]))
    missed = rms(np.concatenate([y - x - (y - x).mean() for y, x in zip(readings, model, strict=True)]))
    return float(np.clip(missed / max(movement, noise), settings.least_movement, settings.most_movement))


def _explanations(problem: Problem) -> Iterator[tuple[list[float], str]]:
    """What the models miss with each input in each other unit, and with the time of driven runs in another one."""
    for c in problem.campaign.inputs:
        fmu_unit = problem.units[c.connector]
        for other_unit in _other_units(c.unit):
            inputs = []
            for conditions in problem.runs:
                run_inputs = dict(conditions.inputs)
                if c.connector in run_inputs:
                    t, x = run_inputs[c.connector]
                    run_inputs[c.connector] = t, _reinterpret(x, fmu_unit, c.unit, other_unit.name)
                inputs.append(run_inputs)
            if (models := _models(problem, inputs)) is not None:
                yield _missed_shares(problem, models), f"is the input '{c.column}' in {other_unit.name}"
    if problem.scenario_stop is None:
        return
    for name, f in TIME_UNITS.items():
        stated_stop = f * problem.scenario_stop
        if all(conditions.inputs and 0.5 < conditions.stop / stated_stop < 1.5 for conditions in problem.runs):
            inputs = [{c: (t / f, x) for c, (t, x) in conditions.inputs.items()} for conditions in problem.runs]
            if (models := _models(problem, inputs, f)) is not None:
                yield _missed_shares(problem, models), f"is time in {name}"


def _models(
    problem: Problem, inputs: list[dict[str, tuple[np.ndarray, np.ndarray]]], f: float = 1.0
) -> dict[int, np.ndarray] | None:
    """What the model as delivered says of each block with these inputs, for readings of 1/f s; None where it stops."""
    step = problem.fit_step
    stops = [float(np.ceil(conditions.stop / f / step) * step) for conditions in problem.runs]
    jobs = [
        Job(
            tuple(problem.connectors), stop, step, problem.overrides(r, {}), run_inputs,
            method=problem.discretisation.method,
        )
        for r, (stop, run_inputs) in enumerate(zip(stops, inputs, strict=True))
    ]
    rows = problem.simulator.simulate(jobs)
    if any(isinstance(x, Failure) for x in rows):
        return None
    models = {}
    for b in problem.observations.series:
        run = rows[b.run]
        assert not isinstance(run, Failure)  # or this would have returned above
        signal = run[:, problem.connectors.index(b.connector)]
        models[b.place.start] = np.interp(b.t / f, np.arange(len(signal)) * step, signal)
    return models
