"""Saves the state of a run while it goes on, and has another run begin with one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from ...core.errors import UsageError
from ...core.versions import versions
from ..engine.program import Program
from ..engine.runner import last_step
from ..slaves.base import FmuInstance
from ..system.execution_order import component_order
from ..system.system import System
from .manifest import digest
from .plan import Plan
from .saved_state import SavedState, write_state


class StateSaver:
    """Writes the state of a run at its start and its end, every so often, and where it is asked to end.

    A state is one of a point that a longer run has, too: where the last step is cut short to end at the stop time, the
    last state is that before it.
    """

    def __init__(
        self, path: Path, plan: Plan, program: Program, identity: Mapping[str, Any],
        guarded: Callable[[], AbstractContextManager[None]],
    ):  # fmt: skip
        """identity: see there; guarded: around what calls the FMUs."""
        self.path, self._system, self._program, self._identity = path, plan.system, program, identity
        self._guarded, self._versions = guarded, versions()
        stimuli, every = plan.options.stimuli, plan.options.save_state_every
        self._stimuli = digest(stimuli) if stimuli is not None else None
        self._start, stop, self._step, n = plan.times
        self._whole = n
        whole = last_step(self._start, self._step, n, stop) == self._step and self._start + n * self._step <= stop
        self._last = n if whole else n - 1
        self._every = max(1, round(every / self._step)) if every is not None else self._last + 1
        self.saved: SavedState | None = None
        """The last one."""

    def until(self, done: int) -> int:
        """Steps to the next state that has to be saved, from the step after `done`."""
        ahead = self._every - done % self._every
        return ahead if done >= self._last else min(ahead, self._last - done)

    def is_due(self, done: int) -> bool:
        """Whether the state after so many steps is to be saved."""
        return done == self._last or (done < self._last and done % self._every == 0)

    def save(self, done: int) -> None:
        """Save the state after so many steps, if a longer run has it and it is not there already.

        Raises `SimulationError` where an FMU does not give its state, `OutputError` where the file cannot be written.
        """
        if done > self._last or (self.saved is not None and self.saved.done == done):
            return
        system, time = self._system, self._start + done * self._step
        answers = {name: dict(instance.detected_feedthrough) for name, instance in system.instances.items()}
        memories = {m.name: {key: array.copy() for key, array in m.read().items()} for m in self._program.memories}
        with self._guarded():
            fmus = {name: _serialised(instance) for name, instance in system.instances.items()}
        values = system.buffer.integers[: system.layout.signal_slots].copy()
        made = SavedState(
            time, done, self._step, self._identity, self._stimuli, self._versions, answers, values,
            list(system.buffer.texts), memories, fmus,
        )  # fmt: skip
        write_state(self.path, made)
        self.saved = made

    def remarks(self) -> list[str]:
        """What to say of a run that has come to its end, where the last state is not that of the end."""
        saved = self.saved
        if saved is None or saved.done >= self._whole:
            return []
        why = "the last step is shorter than the others"
        if saved.done < self._last:
            why = "an FMU has ended the run, which is not gone on with"
        return [f"the saved state is that of t = {saved.time:g} s: {why}"]


def _serialised(instance: FmuInstance) -> bytes:
    state = instance.save()
    with instance.dropping(state):
        return instance.serialise(state)


def recall_feedthrough(state: SavedState, system: System) -> None:
    """What was found out of outputs holds on, wherever the FMUs are now: the coupling is that of the run before."""
    for name, instance in system.instances.items():
        instance.detected_feedthrough = {output: list(inputs) for output, inputs in state.answers.get(name, {}).items()}
    system.order = component_order(system.instances, system.links)


def restore(state: SavedState, path: Path, system: System, program: Program) -> None:
    """Bring an initialised system to a state; `path` is for messages.

    Raises `UsageError` for a state that does not fit, `SimulationError` where an FMU does not take its own.
    """
    memories = {m.name: m for m in program.memories}
    if other := sorted(set(memories) ^ set(state.memories)):
        told = f"the coupling's internal state differs ({other[0]}): connect and drive the same inputs"
        raise UsageError(f"--resume {path}: {told}")
    if set(state.fmus) != set(system.instances) or len(state.texts) != len(system.buffer.texts):
        raise UsageError(f"--resume {path}: it is damaged")
    for name, instance in system.instances.items():
        own = instance.deserialise(state.fmus[name])
        with instance.dropping(own):
            instance.restore(own)
    try:
        system.buffer.integers[: system.layout.signal_slots] = state.values
        system.buffer.texts[:] = state.texts
        for name, memory in memories.items():
            memory.restore(state.memories[name])
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise UsageError(f"--resume {path}: it is damaged ({error})") from None
