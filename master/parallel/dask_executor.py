"""A Dask cluster behind the interface of `concurrent.futures`; imported only where one is asked for."""

from __future__ import annotations

from asyncio import CancelledError
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from distributed import Client


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
        sent: Any = self._client.submit(fn, *args, pure=False, **kwargs)
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
