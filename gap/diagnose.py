"""The whole diagnosis of a campaign, as a value."""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import suppress

from ..master.parallel.pool import Pool
from .campaign import read_catalogue as catalogues
from .campaign.campaign import Campaign
from .pipeline.diagnosis import Diagnosis
from .pipeline.pipeline import PIPELINE
from .pipeline.stage import run_pipeline
from .pipeline.state import initial_state
from .problem.stop import StopToken
from .search.earlier import EarlierDiagnosis
from .settings import DEFAULT, Settings

NEEDED_LATE = ("arch.bootstrap", "ruptures", "sklearn.ensemble", "threadpoolctl")
"""What judging and telling import: loaded while the first runs are simulated, for it takes as long as stopping may."""


def import_ahead(names: Sequence[str]) -> threading.Thread:
    """Import modules in the background; one that is not there is told by who needs it."""

    def work() -> None:
        for name in names:
            with suppress(ImportError):
                importlib.import_module(name)

    thread = threading.Thread(target=work, name="imports", daemon=True)
    thread.start()
    return thread


def diagnose(
    campaign: Campaign,
    executor: Executor | None = None,
    on_stage: Callable[[str], None] = lambda text: None,
    progress: Callable[[int], None] = lambda runs: None,
    processes: int | None = None,
    stop: StopToken | None = None,
    settings: Settings = DEFAULT,
    on_finding: Callable[[str], None] = lambda text: None,
    earlier: EarlierDiagnosis | None = None,
) -> Diagnosis:
    """The diagnosis of a campaign.

    on_stage: gets each stage's name; progress: the number of simulations so far; stop: as soon as it is requested, what
    has been found by then is judged; on_finding: gets what is known so far, in a sentence, as it grows; earlier: sets
    of effects of an earlier diagnosis, to go on from.
    """
    started = time.perf_counter()
    stop = stop or StopToken()
    catalogue = catalogues.load(campaign.effects) if campaign.effects else catalogues.load_from_package(campaign.system)
    with Pool(campaign.system, executor, processes, progress) as pool:
        on_stage("reading the model")
        initial = initial_state(campaign, catalogue, pool, stop, settings, earlier)
        import_ahead(NEEDED_LATE)
        state = run_pipeline(PIPELINE, initial, on_stage, on_finding)
        return Diagnosis(state, pool.count, time.perf_counter() - started)
