"""A stage of a diagnosis, and how a list of them is run."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from .state import State


@dataclass(frozen=True)
class Stage:
    """One step of the diagnosis: a function from state to state."""

    name: str
    """For progress and timing."""
    run: Callable[[State], State]
    when: Callable[[State], bool] = lambda state: True
    """Whether it has anything to do."""
    always: bool = False
    """Also when the diagnosis has been asked to stop: it judges what is there."""


def run_pipeline(stages: Sequence[Stage], state: State, say: Callable[[str], None] = lambda text: None) -> State:
    """The state after all stages; `say` is told the name of each that is run.

    A stage that is asked to stop returns what it has; later ones that only search are left out.
    """
    last = ""
    for stage in stages:
        if not stage.always and state.problem.stop_requested:
            state = replace(state, unfinished=state.unfinished or last or stage.name)
            continue
        if not stage.when(state):
            continue
        begin, last = time.perf_counter(), stage.name
        say(stage.name)
        state = stage.run(state)
        state = replace(state, seconds={**state.seconds, stage.name: time.perf_counter() - begin})
    return state
