"""What decides how a run goes on from a saved state, so that it has to be the same in the run that resumes."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from ...core.errors import UsageError
from ...core.versions import versions
from .manifest import digest
from .plan import Plan
from .saved_state import state_file

SHOWN = 60
"""Letters of a value in a message."""


def identity(plan: Plan) -> dict[str, Any]:
    """Everything by what to call it, as JSON gives it back."""
    entries = dict([*_machine(plan), *_components(plan), *_values(plan), *_system(plan)])
    plain: dict[str, Any] = json.loads(json.dumps(entries, default=_plain))
    return plain


def check_resumed(plan: Plan, now: Mapping[str, Any], folder: Path) -> list[str]:
    """Raise `UsageError` where the state of a plan does not fit it, or would be lost with what is in the result folder.

    now: the plan's own identity. What may differ is told.
    """
    state, given = plan.resumed, plan.options.resume
    if state is None or given is None:
        return []
    if (mismatch := difference(state.identity, now)) is not None:
        raise UsageError(f"--resume {given}: {mismatch}")
    stop, n = plan.times.stop, plan.times.steps
    if n <= state.done:
        raise UsageError(f"--resume {given}: it is at t = {state.time:g} s; the stop time, {stop:g} s, is not later")
    if state_file(given).resolve().parent == folder.resolve():
        raise UsageError(f"--resume {given}: the results there would be lost; give another folder with --out")
    stimuli, remarks = plan.options.stimuli, []
    if (digest(stimuli) if stimuli is not None else None) != state.stimuli:
        remarks.append(f"--resume {given}: from t = {state.time:g} s on the stimuli are others")
    if dict(state.versions) != versions():
        other = difference(state.versions, versions())
        remarks.append(f"--resume {given}: results may differ in their last digits from those of one run; {other}")
    return remarks


def difference(then: Mapping[str, Any], now: Mapping[str, Any]) -> str | None:
    """The first thing that differs, for a message; None where nothing does."""
    for what in dict.fromkeys((*then, *now)):
        if then.get(what) != now.get(what):
            return f"{what}: {_shown(then.get(what))} when the state was saved, {_shown(now.get(what))} here"
    return None


def _machine(plan: Plan) -> Iterator[tuple[str, Any]]:
    yield "platform", f"{platform.system()} {platform.machine()}"
    yield "--method", plan.options.method
    yield "step [s]", plan.times.step
    yield "start time [s]", plan.times.start


def _components(plan: Plan) -> Iterator[tuple[str, Any]]:
    content = cache(digest)  # an FMU may be that of many components
    interpolating = plan.method.interpolating(plan.instances.values())
    for name, instance in plan.instances.items():
        component = plan.network.components[name].component
        if component.function is not None:
            yield f"function of component '{name}'", repr(component.function)
        else:
            yield f"FMU of component '{name}', SHA-256", content(component.source)
        yield f"--substeps of component '{name}'", instance.substeps
        if name in interpolating:
            yield f"slopes of inputs are given to component '{name}' (--isolate)", True


def _values(plan: Plan) -> Iterator[tuple[str, Any]]:
    for v in (*plan.structural_values, *plan.values):  # the last one counts
        yield f"value of '{f'{v.component}.' if v.component else ''}{v.variable}'", v.value


def _system(plan: Plan) -> Iterator[tuple[str, Any]]:
    """Connections, and all variables that are exchanged."""
    connections = plan.system.connections
    for link in (*connections.links, *connections.shown):
        c = link.conversion
        yield (
            f"connection {link.source.label} -> {link.target.label}",
            [c.factor, c.offset, c.from_integer, repr(c.whole)],
        )
    for flat_connection in connections.parameter_connections:
        yield f"connection {'.'.join(flat_connection.start)} -> {'.'.join(flat_connection.end)}", "of a parameter"
    for s in plan.system.signals:
        yield f"variable '{s.address}' that is set or read (--record)", [s.type, s.size]


def _plain(value: Any) -> Any:
    """For JSON: what it does not know."""
    if isinstance(value, bytes):
        return {"hex": value.hex()}
    if isinstance(value, Path):
        return str(value)
    return value.item()


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
