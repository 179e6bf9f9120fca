"""Measured moments ("the stroke took 7.6 s") out of the tables of a campaign."""

from __future__ import annotations

from math import inf
from typing import Any

from ..settings import FILE_LIMITS
from .campaign import CampaignError, Event
from .tables import reject_unknown_keys, take


def read_event(table: dict[str, Any], where: str) -> Event:
    reject_unknown_keys(table, "event", where)
    values: dict[str, float] = {key: take.number(table, where, key) for key in ("target", "within", "after", "std")}
    readings = ("time", "at_most", "at_least")
    times: dict[str, float] = {key: take.number(table, where, key) for key in readings if key in table}
    if "until" in table:
        values["until"] = take.number(table, where, "until")
        if not values["until"] > values["after"]:
            raise CampaignError(f"{where}: 'until' has to be later than 'after'")
        for key in ("time", "at_least"):
            if times.get(key, 0.0) + values["after"] > values["until"]:
                raise CampaignError(f"{where}: '{key}' = {times[key]:g} s, counted from 'after', is later than 'until'")
    for key, value in {**times, "after": values["after"]}.items():
        if value < 0.0:
            raise CampaignError(f"{where}: '{key}' = {value:g} s is negative")
    if len(times) != 1:
        raise CampaignError(f"{where}: needs one of 'time', 'at_most' and 'at_least'")
    if not (values["std"] > 0.0 and values["within"] > 0.0):
        raise CampaignError(f"{where}: 'std' and 'within' have to be positive")
    for key in ("target", "within"):
        if abs(values[key]) > FILE_LIMITS.largest_quantity:
            raise CampaignError(f"{where}: '{key}' = {values[key]:g} is no quantity of a machine")
    first = take.get(table, where, "first", bool, False)
    return Event(take.get(table, where, "connector", str), **values, first=first, **times)


def check_events(where: str, events: tuple[Event, ...], stop: float) -> None:
    """No moment lies far beyond the end of its run: it would be in another unit."""
    for i, e in enumerate(events, 1):
        reading = next(v for v in (e.time, e.at_most, e.at_least) if v is not None)
        if e.after + reading > FILE_LIMITS.latest_event * stop:
            overrun = f"{e.after + reading:g} s is long after the run's end at {stop:g} s"
            raise CampaignError(f"{where}, event {i}: {overrun}: is it in seconds?")
        if e.std > stop or stop < e.until < inf:
            key, value = ("std", e.std) if e.std > stop else ("until", e.until)
            raise CampaignError(f"{where}, event {i}: '{key}' = {value:g} s, but the run ends at {stop:g} s")
        if e.after >= stop:
            raise CampaignError(f"{where}, event {i}: 'after' = {e.after:g} s, but the run ends at {stop:g} s")
    same: dict[tuple[Any, ...], list[Event]] = {}
    for e in events:
        same.setdefault((e.connector, e.target, e.within, e.after, e.until, e.first), []).append(e)
    for alike in same.values():
        soonest = max((v for e in alike for v in (e.time, e.at_least) if v is not None), default=-inf)
        latest = min((v for e in alike for v in (e.time, e.at_most) if v is not None), default=inf)
        slack = 6.0 * max(e.std for e in alike)
        if soonest > latest + slack:
            detail = f"'{alike[0].connector}' cannot be there after {soonest:g} s at least and {latest:g} s at most"
            raise CampaignError(f"{where}: two events contradict each other: {detail}")
