"""Runs of a package for one problem: side by side in the pool, the latest kept so that none is run twice in a row."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Mapping, Sequence

import numpy as np

from ...master.parallel.pool import Abandoned, Failure, Job, Pool
from .stop import StopRequested, StopToken

Rows = np.ndarray | Failure


def _bytes(result: Rows) -> int:
    return 0 if isinstance(result, Failure) else result.nbytes


class Simulator:
    """Simulates jobs and remembers them; also what was seen of the simulations' smoothness, and the last failure."""

    def __init__(self, pool: Pool, stop: StopToken | None = None, capacity: float = 1e8):
        """capacity: memory for runs [bytes]."""
        self.pool = pool
        self.stop = stop or StopToken()
        self.smooth: dict[str, bool] = {}
        """Whether runs are smooth in an effect's parameter at the differences' step, as far as that has been seen."""
        self.failure = ""
        """The last run that could not be simulated, and why."""
        self._cache: OrderedDict[Hashable, Rows] = OrderedDict()
        self._capacity = capacity
        self._size = 0

    def run(
        self, jobs: Mapping[Hashable, Job], names: Mapping[Hashable, str], keep: bool = True
    ) -> dict[Hashable, Rows]:
        """Signals (n, len(record)) or the failure of every job; names: of their runs, for messages."""
        cached = {key: self._cache[key] for key in jobs if key in self._cache}
        fresh_keys = [key for key in jobs if key not in cached]
        fresh = dict(zip(fresh_keys, self.simulate([jobs[key] for key in fresh_keys]), strict=True))
        for key, result in fresh.items():
            if isinstance(result, Failure):
                self.failure = f"run '{names[key]}': {result.reason}"
        if keep:
            self._cache.update(fresh)
            self._size += sum(_bytes(result) for result in fresh.values())
            while self._size > self._capacity:
                self._size -= _bytes(self._cache.popitem(last=False)[1])
        return {**cached, **fresh}

    def simulate(self, jobs: Sequence[Job]) -> list[Rows]:
        """The results in the order of the jobs; raises `StopRequested` once the diagnosis is asked to stop."""
        if jobs and self.stop.requested:
            raise StopRequested
        try:
            return self.pool.run(jobs, lambda: self.stop.requested)
        except Abandoned:
            raise StopRequested from None
