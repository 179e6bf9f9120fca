"""A stage of a diagnosis, and how a list of them is run."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..problem.stop import StopRequested
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
    """Also when the diagnosis has been asked to stop: it judges what is there, without a simulation."""


def run_pipeline(
    stages: Sequence[Stage], state: State, on_stage: Callable[[str], None] = lambda text: None,
    on_finding: Callable[[str], None] = lambda text: None,
) -> State:  # fmt: skip
    """The state after all stages; `on_stage` gets the name of each that is run, `on_finding` what is known so far when
    that has changed.

    Once it is asked to stop no simulation is begun: what a stage then lacks is left out, and the state is marked as
    unfinished with the stage that was cut off.
    """
    stop = state.problem.simulator.stop
    for stage in stages:
        if (stop.requested and not stage.always) or not stage.when(state):
            continue
        begin, last_progress = time.perf_counter(), state.progress
        on_stage(stage.name)
        try:
            state = stage.run(state)
        except StopRequested:
            state = replace(state, unfinished=state.unfinished or stage.name)
        if stop.requested:
            state = replace(state, unfinished=state.unfinished or stage.name)
        state = replace(state, seconds={**state.seconds, stage.name: time.perf_counter() - begin})
        if state.progress != last_progress:
            on_finding(state.progress)
            if not state.first_answer and (state.fitted_sets or state.first_look):
                state = replace(state, first_answer=sum(state.seconds.values()))
    return state
