"""Futures of a cluster that is made up: whatever becomes of a task, its future ends."""

from __future__ import annotations

import asyncio
from concurrent.futures import as_completed

import pytest

pytest.importorskip("distributed")

from deepsea_cosim.master.parallel.dask_executor import DaskExecutor


class Sent:
    def __init__(self, what):
        self.what, self.taken_back = what, False

    async def _result(self):
        if isinstance(self.what, BaseException):
            raise self.what
        return self.what

    def cancel(self):
        self.taken_back = True


class Cluster:
    """Gives what it is sent; what is to be followed waits until `go`."""

    def __init__(self):
        self.sent, self.waiting = [], []
        self.loop = self

    def submit(self, fn, *args, pure):
        self.sent.append(Sent(fn(*args)))
        return self.sent[-1]

    def add_callback(self, follow):
        self.waiting.append(follow)

    def go(self):
        for follow in self.waiting:
            asyncio.run(follow())


def test_every_future_ends_also_where_gathering_raises():
    cluster = Cluster()
    executor = DaskExecutor(cluster)
    gone = RuntimeError("four workers died of it")
    futures = [executor.submit(lambda x: x, what) for what in (7, gone, asyncio.CancelledError())]
    dropped = executor.submit(lambda x: x, 1)
    dropped.cancel()
    cluster.go()
    assert len(list(as_completed(futures, timeout=5.0))) == 3
    assert futures[0].result() == 7
    assert futures[1].exception() is gone
    assert isinstance(futures[2].exception(), asyncio.CancelledError)
    assert cluster.sent[3].taken_back
    assert not cluster.sent[0].taken_back


def failing_at_first(marked):
    if not marked.exists():
        marked.touch()
        raise RuntimeError("at first")
    return 5


def test_a_task_sent_again_is_run_again_while_its_first_future_is_kept(tmp_path):
    from distributed import Client

    with Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        executor = DaskExecutor(client)
        first = executor.submit(failing_at_first, tmp_path / "marked")
        assert isinstance(first.exception(timeout=20.0), RuntimeError)
        assert executor.submit(failing_at_first, tmp_path / "marked").result(timeout=20.0) == 5
