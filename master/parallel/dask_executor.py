"""A Dask cluster behind the interface of `concurrent.futures`; imported only where one is asked for."""

from __future__ import annotations

import hashlib
import socket
from asyncio import CancelledError
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import cache
from pathlib import Path
from typing import Any

from distributed import Client

from ...core.errors import UsageError

PARTS = ("core", "ssp", "master")
"""Packages on whose code the result of a simulation hangs."""


@cache
def code_digest() -> str:
    """What the code that simulates here is."""
    home, found = Path(__file__).parents[2], hashlib.sha256()
    for part in PARTS:
        for path in sorted((home / part).rglob("*.py")):
            found.update(path.relative_to(home).as_posix().encode() + path.read_bytes())
    return found.hexdigest()


def on_the_same_code(asked: str, fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """fn(*args), on a worker with the code of the one who asks."""
    if asked != code_digest():
        raise UsageError(f"--dask: the worker on {socket.gethostname()} has another version of deepsea-cosim than this "
                         "machine; install the same on both (what was done is kept)")  # fmt: skip
    return fn(*args, **kwargs)


class DaskExecutor(Executor):
    """As `client.get_executor()`, whose futures never end where a result is lost and its task then kills workers.

    (distributed 2026.8: `_cascade_future` takes it that gathering does not raise; it does when the scheduler gives a
    task up that had been done before.)
    """

    def __init__(self, client: Client):
        self._client = client

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The future of fn(*args) on the cluster; cancelling it takes the task back.

        Nothing is taken from an earlier call with the same arguments: a task that was blamed for the end of a worker
        is sent again to be tried alone.
        """
        sent: Any = self._client.submit(on_the_same_code, code_digest(), fn, *args, pure=False, **kwargs)
        future: Future[Any] = Future()

        async def follow() -> None:
            try:
                result = await sent._result()
            except (CancelledError, Exception) as error:
                if not future.done():
                    future.set_exception(error)
            else:
                if not future.done():
                    future.set_result(result)

        def taken_back(done: Future[Any]) -> None:
            if done.cancelled():
                sent.cancel()

        future.add_done_callback(taken_back)
        loop: Any = self._client.loop
        loop.add_callback(follow)
        return future
