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
    better: str
    text: str
    sure: bool = True
    """No machine differs from its model by so much; else it is only remarked on."""


def check_units(problem: Problem, nominal: np.ndarray) -> list[str]:
    """Raise `CampaignError` for what is likelier in another unit; returns warnings of what may be.

    nominal: the long vector (n,) of the model as delivered.
    """
    settings = problem.settings.sanity
    suspects = [x for k in range(len(problem.campaign.outputs)) if (x := _suspect(problem, k, nominal)) is not None]
    suspect = next((x for x in suspects if x.sure), None)
    warnings = [f"{x.text}; is it in {x.better}? {_remedy([''])}" for x in suspects if not x.sure]
    models = {b.place.start: nominal[b.place] for b in problem.observations.series}
    straight = _missed(problem, models)
    if suspect is None and max(straight, default=0.0) <= settings.movement_lost:
        return warnings
    stories = [(_sum(shares), text, shares) for shares, text in _stories(problem)]
    if suspect is None:
        left, text, shares = min(stories, default=(np.inf, "", []))
        found = any(
            before > settings.movement_lost and after < settings.movement_found
            for before, after in zip(straight, shares, strict=False)
        )
        if found and left < _sum(straight) - settings.as_good:
            raise CampaignError(
                f"{problem.campaign.file}: the model misses the channels' movement; {text}? {_remedy([text])}"
            )
        return warnings
    own = _missed(problem, models, suspect)
    stories = [(_sum(own), f"is it in {suspect.better}", own), *sorted(stories)]
    least = min(stories)[0]
    told = [text for left, text, _ in stories if left <= least + settings.as_good][:3]
    raise CampaignError(f"{problem.campaign.file}: {suspect.text}; {', or '.join(told)}? {_remedy(told)}")


def _remedy(told: list[str]) -> str:
    keys = {"'time_unit'" if text.startswith("is time") else "the channel's 'unit'" for text in told}
    return f"Then {' or '.join(sorted(keys, reverse=True))} has to say so"


def _sum(shares: list[float]) -> float:
    return float(np.log(shares).sum())


def _suspect(problem: Problem, k: int, nominal: np.ndarray) -> _Suspect | None:
    """The channel, where the readings move or stand unlike the model as those of another unit would."""
    parts = [b for b in problem.observations.series if b.channel == k]
    if not parts:
        return None
    channel = problem.campaign.outputs[k]
    return _of_another_size(problem, channel, parts, nominal) or _of_another_zero(problem, channel, parts, nominal)


def _of_another_size(problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray) -> _Suspect | None:
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
    ratio, own = measured / modelled, problem.units[c.connector]
    size, better = abs(float(np.log(ratio))), None
    doubtful = size > np.log(settings.doubtful_ratio)
    if size > np.log(settings.wrong_ratio):
        better = _likelier(c.unit, ratio, 2.0 * settings.better_share)
        if better and _left(parts, nominal, own, c.unit, better) > _left(parts, nominal, own):
            better = None  # it moves where the model rests, as far from its level in any unit
    elif size > np.log(settings.possible_ratio):
        better = _likelier(c.unit, ratio, settings.ratio_fits)
        share = settings.better_share if doubtful else settings.much_better_share
        if better and not _explains(problem, c, parts, nominal, better, share, word == "moves by"):
            better = None
    if better is None:
        return None
    shown = [f"{convert(float(x), own, c.unit):.4g} {c.unit}" for x in (measured, modelled)]
    text = f"channel '{c.column}': it {word} {shown[0]} where the model {word} {shown[1]}"
    return _Suspect(c, better, text, doubtful)


def _explains(
    problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray, better: str, share: float, moves: bool
) -> bool:
    """Whether the model misses far less of the readings in the better unit, and little of them themselves.

    Large readings that have nothing of the model become smaller in a larger unit, too.
    """
    own = problem.units[c.connector]
    after = _left(parts, nominal, own, c.unit, better)
    if after > share * _left(parts, nominal, own):
        return False
    read = [_meant(b.y, own, c.unit, better) for b in parts]
    whole = rms(np.concatenate([y - y.mean() if moves else y for y in read]))
    return after <= problem.settings.sanity.shape_missed * whole


def _of_another_zero(problem: Problem, c: Channel, parts: list[Block], nominal: np.ndarray) -> _Suspect | None:
    """Where the readings stand off the model by what is between the zeros of two units, as of K and degC."""
    settings, own = problem.settings.sanity, problem.units[c.connector]
    given = _left(parts, nominal, own)
    others = [u for u in _others(c.unit) if u.offset != unit(c.unit).offset]
    if not others or given <= settings.quiet * max(b.noise_std for b in parts):
        return None
    readings = np.concatenate([b.y for b in parts])
    model = np.concatenate([nominal[b.place] for b in parts])
    moves = max(float(np.ptp(readings)), float(np.ptp(model)))
    left = {u.name: _left(parts, nominal, own, c.unit, u.name) for u in others}
    better = min(left, key=left.__getitem__)
    shift = float(np.median(np.abs(_meant(readings, own, c.unit, better) - readings)))
    share = settings.better_share if shift > settings.zero_beyond * moves else settings.much_better_share
    if left[better] > share * given:
        return None
    shown = [f"{convert(float(np.median(x)), own, c.unit):.4g} {c.unit}" for x in (readings, model)]
    absolute = (unit(c.unit).offset == 0.0) != (unit(better).offset == 0.0)  # 255 K apart, degC and degF about 40
    return _Suspect(c, better, f"channel '{c.column}': it is at {shown[0]} where the model is at {shown[1]}", absolute)


def _left(parts: list[Block], nominal: np.ndarray, own: str, given: str = "", better: str = "") -> float:
    """RMS of the readings less the model, in the connector's unit; of readings in another unit than the given one."""
    read = [_meant(b.y, own, given, better) if better else b.y for b in parts]
    return rms(np.concatenate([y - nominal[b.place] for y, b in zip(read, parts, strict=True)]))


def _meant(values: np.ndarray, own: str, given: str, better: str) -> np.ndarray:
    """Values in their own unit, had they been in a better one than the given."""
    return convert(convert(values, own, given), better, own)


def _others(given: str) -> Iterator[Unit]:
    """The other units of the same quantity, one of each size; those that are angles too, of an angle, come first."""
    here = unit(given)
    seen = {(here.factor, here.offset)}
    for u in sorted(UNITS.values(), key=lambda u: u.exponents != here.exponents):
        if u.same_dimension(here) and (u.factor, u.offset) not in seen:
            seen.add((u.factor, u.offset))
            yield u


def _likelier(given: str, ratio: float, within: float) -> str | None:
    """The unit of the same quantity whose readings, taken for the given one, would differ by the ratio."""
    fitting = [(abs(np.log(ratio * u.factor / unit(given).factor)), u.name) for u in _others(given)]
    best = min(fitting, default=(9.0, ""))
    return best[1] if best[0] < within else None


def _missed(problem: Problem, models: Mapping[int, np.ndarray], suspect: _Suspect | None = None) -> list[float]:
    """Share of each channel's movement that the models (by the start of a block's place) miss, whatever the bias."""
    settings = problem.settings.sanity
    shares = []
    for k, c in enumerate(problem.campaign.outputs):
        parts = [b for b in problem.observations.series if b.channel == k]
        if not parts:
            continue
        read, model = [b.y for b in parts], [models[b.place.start] for b in parts]
        if suspect is not None and suspect.channel == c:
            read = [_meant(y, problem.units[c.connector], c.unit, suspect.better) for y in read]
        shares.append(missed_share(read, model, max(b.noise_std for b in parts), settings))
    return shares


def missed_share(read: list[np.ndarray], model: list[np.ndarray], noise: float, settings: SanitySettings) -> float:
    """Share of the movement of a channel's readings, block by block, that a model misses, whatever the bias."""
    moved = rms(np.concatenate([y - y.mean() for y in read]))
    left = rms(np.concatenate([y - x - (y - x).mean() for y, x in zip(read, model, strict=True)]))
    return float(np.clip(left / max(moved, noise), settings.least_movement, settings.most_movement))


def _stories(problem: Problem) -> Iterator[tuple[list[float], str]]:
    """What the models miss with each input in each other unit, and with the time of driven runs in another one."""
    for c in problem.campaign.inputs:
        own = problem.units[c.connector]
        for other in _others(c.unit):
            inputs = []
            for info in problem.runs:
                mine = dict(info.inputs)
                if c.connector in mine:
                    t, x = mine[c.connector]
                    mine[c.connector] = t, _meant(x, own, c.unit, other.name)
                inputs.append(mine)
            if (models := _models(problem, inputs)) is not None:
                yield _missed(problem, models), f"is the input '{c.column}' in {other.name}"
    if problem.scenario_stop is None:
        return
    for name, f in TIME_UNITS.items():
        if all(info.inputs and 0.5 < info.stop / (f * problem.scenario_stop) < 1.5 for info in problem.runs):
            inputs = [{c: (t / f, x) for c, (t, x) in info.inputs.items()} for info in problem.runs]
            if (models := _models(problem, inputs, f)) is not None:
                yield _missed(problem, models), f"is time in {name}"


def _models(
    problem: Problem, inputs: list[dict[str, tuple[np.ndarray, np.ndarray]]], f: float = 1.0
) -> dict[int, np.ndarray] | None:
    """What the model as delivered says of each block with these inputs, for readings of 1/f s; None where it stops."""
    step = problem.fit_step
    stops = [float(np.ceil(info.stop / f / step) * step) for info in problem.runs]
    jobs = [
        Job(tuple(problem.connectors), stop, step, problem.changes(r, {}), given, method=problem.discretisation.method)
        for r, (stop, given) in enumerate(zip(stops, inputs, strict=True))
    ]
    rows = problem.simulator.simulate(jobs)
    if any(isinstance(x, Failure) for x in rows):
        return None
    made = {}
    for b in problem.observations.series:
        run = rows[b.run]
        assert not isinstance(run, Failure)  # or this would have returned above
        signal = run[:, problem.connectors.index(b.connector)]
        made[b.place.start] = np.interp(b.t / f, np.arange(len(signal)) * step, signal)
    return made
