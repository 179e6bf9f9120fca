"""Direct feedthrough: how outputs answer at once to inputs, measured by perturbations before the first step."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from typing import Any

import numpy as np

from ...core.errors import CosimError, Interrupted, SimulationError
from ..engine.runner import Runner
from ..engine.values import REAL, TEXT, Signal
from ..slaves.base import FmuInstance
from ..slaves.variables import ALWAYS
from ..system.connections import SignalConnection
from ..system.execution_order import component_order
from ..system.strongly_connected import strongly_connected_components
from ..system.system import System
from .algebraic_loops import Node, graph, loops
from .loop_solver import drives_itself, input_output_runners
from .perturbation import perturbed
from .power_bonds import Bond, singles

PERTURBATION = 1e-6
"""Change of an input, relative to 1 + its size."""


def detect_feedthrough(system: System, loops_only: bool) -> list[str]:
    """Find direct feedthrough where an FMU does not say (`FmuInstance.detected_feedthrough`).

    By FMI such an output may depend on every input, which would make loops of all that are connected both ways; so each
    connected number is perturbed, and what does not follow, where the FMU is now, counts as not dependent. Only FMUs
    that can be put back to the state before are asked. What is found counts for the order of the components, too.

    loops_only: only those are asked that may close a loop. A remark is returned where what drives others, or the
    component itself, may depend on more than was found.
    """
    for instance in system.instances.values():
        instance.detected_feedthrough = {}
    suspects = set(system.instances)
    if loops_only:
        suspects = {
            component
            for members in strongly_connected_components(graph(system, doubtful=True))
            for component, _ in members
        }
    driving: dict[str, set[str]] = {name: set() for name in ("", *system.instances)}
    for link in system.links:
        if link.source.component != link.target.component:
            driving[link.source.component].add(link.source.name)
    unsure = []
    for name, instance in system.instances.items():
        if _may_feed_through(system, name, driving[name]):
            unsure.append(name)
        silent = [s for s in instance.outputs if s.family != TEXT and instance.direct_feedthrough(s.name) is None]
        inputs = dict.fromkeys(link.target for link in system.writer.links_to(name) if link.target.family != TEXT)
        if not silent or not inputs or name not in suspects or not instance.can_restore:
            continue
        try:
            state = instance.save()
        except SimulationError:
            continue
        give, take = input_output_runners(system, name)
        with instance.dropping(state):
            give.once()
            take.once()
            instance.detected_feedthrough = _measure_feedthrough(
                system, instance, state, silent, list(inputs), (give, take)
            )
    system.order = component_order(system.instances, system.links)
    silent_components = [name for name in unsure if not any(system.instances[name].detected_feedthrough.values())]
    if loops_only:  # what others give is there in time
        silent_components = [name for name in silent_components if drives_itself(system, name)]
    if not silent_components:
        return []
    names = f"component{'s' if len(silent_components) > 1 else ''} {', '.join(map(repr, silent_components))}"
    return [
        f"{names}: no output dependencies are declared in the model description, and perturbing the inputs showed no "
        "direct feedthrough; where there is some, those outputs are a step late"
    ]


def loops_that_came_up(system: System) -> list[str]:
    """What to say of algebraic loops that nothing told of at the start: at the end of a run, when FMUs may be asked in
    any way, those whose outputs have come to follow inputs at once.

    FMUs that cannot be put back to a state before, and those that deny that an output follows, have not been asked at
    all until then. No step may follow.
    """
    edges: dict[str, set[str]] = {name: set() for name in ("", *system.instances)}
    for link in system.links:
        edges[link.source.component].add(link.target.component)
    measured: dict[Node, set[Node]] = {}
    for component in sorted(name for members in strongly_connected_components(edges) for name in members):
        instance = system.instances[component]
        outputs = [s for s in instance.outputs if s.family != TEXT]
        inputs = dict.fromkeys(link.target for link in system.writer.links_to(component) if link.target.family != TEXT)
        if instance.readable != ALWAYS or not outputs or not inputs:
            continue
        with suppress(SimulationError):
            way = input_output_runners(system, component)
            for step in way:
                step.once()
            for output, names in _measure_feedthrough(system, instance, None, outputs, list(inputs), way).items():
                measured[component, output] = {(component, name) for name in names}
    known_loops = {frozenset(members) for members in loops(system)}
    return [
        f"{' -> '.join(members)}: an algebraic loop that the FMUs do not declare and that was not detected at the "
        "start: its values are a step late and may be wrong or oscillate; have the FMUs declare what their outputs "
        "depend on, so that it is solved"
        for members in loops(system, more=measured) if frozenset(members) not in known_loops
    ]  # fmt: skip


def _may_feed_through(system: System, name: str, sources: Collection[str]) -> bool:
    """Whether an output may follow, unsaid, an input that is driven: one of those that drive others, or any of a
    component that drives itself and says of none."""
    instance = system.instances[name]
    if not system.writer.links_to(name):
        return False
    reals = [s.name for s in instance.outputs if s.family == REAL]
    if drives_itself(system, name) and all(instance.direct_feedthrough(output) is None for output in reals):
        return True
    return any(instance.direct_feedthrough(output) is None for output in sources)


def _measure_feedthrough(
    system: System, instance: FmuInstance, state: Any, outputs: list[Signal], inputs: list[Signal],
    way: tuple[Runner, Runner],
) -> dict[str, list[str]]:  # fmt: skip
    """Inputs that each output follows at once; the buffer is left as it was, and the instance where it has a state
    to be put back to."""
    reals, bits, texts = system.buffer.reals, system.buffer.integers, system.buffer.texts
    owners: dict[int, list[str]] = {}  # several where an output has aliases
    for s in outputs:
        for place in range(s.place, s.place + s.size):
            owners.setdefault(place, []).append(s.name)
    signals = [*instance.inputs, *instance.outputs]
    slots = np.array([s.place + k for s in signals if s.family != TEXT for k in range(s.size)], np.int64)
    before = bits[slots]
    spoken = {s.place + k: texts[s.place + k] for s in signals if s.family == TEXT for k in range(s.size)}
    measured: dict[str, dict[str, None]] = {s.name: {} for s in outputs}
    for target in inputs:
        for place in range(target.place, target.place + target.size):
            if target.family == REAL and not np.isfinite(reals[place]):
                continue
            for size in (PERTURBATION, -PERTURBATION):
                with perturbed(system, target, place, size):
                    try:
                        for step in way:
                            step.once()
                        for changed in slots[bits[slots] != before].tolist():
                            for owner in owners.get(changed, ()):
                                measured[owner][target.name] = None
                    except Interrupted:
                        raise
                    except SimulationError:
                        pass
                if instance.is_lost:
                    raise SimulationError(
                        f"component '{instance.name}' does not declare what its outputs depend on, and a change of "
                        f"'{target.name}' by {PERTURBATION:g} to find out is fatal to it; --method gauss-seidel does "
                        "not ask"
                    )
                if state is None:
                    way[0].once()
                else:
                    instance.restore(state)
                bits[slots] = before
                for place, text in spoken.items():
                    texts[place] = text
    return {output: list(names) for output, names in measured.items()}


def feedthrough_slopes(system: System, bond: Bond) -> tuple[float, float]:
    """|dy/dx| of both sides' outputs of a bond, in SI units; x is what the side gets besides its rate: a position
    besides its speed.

    0 where the FMU declares no such dependence. What is perturbed is put back.
    """
    slopes_of_sides = []
    for gives, takes, si in ((bond.forth, bond.back, bond.forth_si), (bond.back, bond.forth, bond.back_si)):
        beside = singles(system.connections.into(takes.target.component))
        inputs = [link for link in beside if _integral(system, link, takes)]
        declared = system.instances[gives.source.component].direct_feedthrough(gives.source.name) or []
        slopes = [_slope(system, gives, link) * si[0] for link in inputs if link.target.name in declared]
        slopes_of_sides.append(sum(map(abs, slopes)))
    return slopes_of_sides[0], slopes_of_sides[1]


def _integral(system: System, link: SignalConnection, flow: SignalConnection) -> bool:
    """Whether a link carries what another one between the same components carries the rate of."""
    if (link.source.component, link.target.component) != (flow.source.component, flow.target.component):
        return False
    if link.target.element not in (None, flow.target.element):
        return False
    units = [system.instances[one.target.component].unit(one.target.name) for one in (link, flow)]
    of_units = [u.exponents for u in units if u is not None and u.exponents is not None]
    if len(of_units) < len(units):
        return False
    level, rate = ({k: p for k, p in exponents.items() if k != "rad"} for exponents in of_units)
    return {**level, "s": level.get("s", 0) - 1} == {"s": 0, **rate}


def _slope(system: System, output: SignalConnection, link: SignalConnection) -> float:
    """dy/du of one output of the component that a link ends at, u in SI units; NaN if that cannot be had."""
    unit = system.instances[link.target.component].unit(link.target.name)
    reals, y = system.buffer.reals, output.source.place
    way = input_output_runners(system, link.target.component)
    try:
        with perturbed(system, link.target, link.target.place, PERTURBATION) as perturbation:
            for step in way:
                step.once()
            changed = float(reals[y])
        for step in way:
            step.once()
    except CosimError:
        if system.instances[link.target.component].is_lost:
            raise
        return float("nan")
    if not perturbation:
        return float("nan")
    return (changed - float(reals[y])) / (perturbation * (unit.factor if unit else 1.0))
