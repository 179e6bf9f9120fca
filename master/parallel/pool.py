"""Many runs of a package in parallel processes, behind the interface of `concurrent.futures`.

Any executor of that kind serves: processes of this machine, or `client.get_executor()` of a Dask cluster whose workers
see the package under the same path.
"""

from __future__ import annotations

import atexit
import logging
import multiprocessing
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from math import isinf
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from types import TracebackType
from typing import Any

import numpy as np

from ...core.ending import ignore_interrupts, starting_processes
from ...core.errors import CosimError, SimulationError, UsageError, install
from ...core.files import changed
from ...core.scratch import make_scratch, remove_all, remove_scratch
from ...core.scripts import check_script, end_if_loaded_again, unguarded
from ..algorithms import DEFAULT
from ..simulation.session import Series, Session
from .last_words import last_words, leave_last_words
from .same_file import SameFile


@dataclass(frozen=True)
class Job:
    """One run: what to record, until when, at which distance [s], parameters and driven inputs."""

    record: tuple[str, ...]
    stop: float
    step: float
    changes: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Series] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    """Components to run alone; empty: the whole system."""
    method: str = DEFAULT
    """Coupling algorithm."""
    parts: int = 1
    """Macro steps between two recorded points."""


ALARM = getattr(signal, "SIGALRM", 14)
"""The signal that ends a process whose run takes too long."""

CONNECT_TIMEOUT = "10s"
"""How long a Dask scheduler may take to answer."""


@dataclass(frozen=True)
class Failure:
    """A run that had to stop, and why; `limit`: it took longer than that [s]."""

    reason: str
    limit: float | None = None


DIED = "the simulation's process died; an FMU may have crashed"


class WorkerDied(SimulationError):
    """A process that simulates ended unasked, or (`late`) was ended because a run took longer than it may."""

    late = False
    why = DIED
    """What is known of the cause."""


class Abandoned(Exception):
    """What runs was given up, for whoever asked for it has been asked to stop."""


GRACE = 1.5
"""Time that processes have to clean up once they are told to end [s]."""

UNDER_WAY = 4000
"""Tasks that are handed out at a time: a scheduler that is given a million at once is busy with them for minutes."""

STOP_POLL = 0.2
"""Time after which it is looked whether to stop [s]."""


_sessions: dict[tuple[str, tuple[str, ...]], tuple[Session, int]] = {}
"""What this worker process has loaded, and when its package was written [ns]."""


def session(package: str, only: tuple[str, ...] = ()) -> Session:
    """The session of a package in this process, loaded when it is asked for first, and anew where an FMU was lost in it
    or the package is another one now, for the workers of a cluster outlive who asks them."""
    key, current = (package, only), changed(Path(package))
    if key in _sessions:
        earlier, when = _sessions[key]
        if not earlier.is_lost and current in (when, 0):
            return earlier
        del _sessions[key]
        earlier.close()
    _sessions[key] = Session(Path(package), only=only), current
    return _sessions[key][0]


def simulate(package: str, job: Job) -> np.ndarray | Failure:
    """Runs the job in this process; the signals (n, len(record)) at start, start + step, ..."""
    try:
        opened, step = session(package, job.only), job.step / job.parts
        return opened.run(job.record, job.stop, step, job.changes, job.inputs, job.method)[1][:: job.parts]
    except CosimError as error:  # also of values that an FMU does not take
        return Failure(str(error))


def _within(limit: float | None, function: Callable[[str, Any], Any], package: str, task: Any) -> Any:
    """The function's result; a call longer than `limit` [s] ends the process, for an FMU cannot be stopped."""
    if limit is None or isinf(limit):
        return function(package, task)
    with suppress(CosimError):  # loading does not count
        session(package)
    signal.setitimer(signal.ITIMER_REAL, min(limit, 1e8))
    try:
        return function(package, task)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _end(process: multiprocessing.Process) -> int | None:
    """How a process has ended. The pool's own thread waits for it too, and one of two is told later."""
    by = monotonic() + 5.0
    process.join(5.0)
    while process.exitcode is None and monotonic() < by:
        sleep(0.01)
    return process.exitcode


def _end_now(processes: Sequence[multiprocessing.Process]) -> None:
    """End processes without waiting for what they simulate."""
    for process in processes:
        process.terminate()
    by = monotonic() + GRACE
    for process in processes:
        process.join(max(0.0, by - monotonic()))
        process.kill()
        process.join()


@atexit.register
def _free_sessions() -> None:
    """Terminate and free the FMUs of this process."""
    while _sessions:
        with suppress(Exception):
            _sessions.popitem()[1][0].close()


def _end_cleanly(*_: object) -> None:
    _free_sessions()
    remove_all()
    os._exit(143)


def _culprit(crash: str) -> str:
    return next(filter(None, (opened.culprit(crash) for opened, _ in _sessions.values())), "")


def _settle_in(scratch: str) -> None:
    """A folder of this process's own in the pool's, to work in and for what it unpacks; instances with its number in
    their names: FMUs write files where they are, and call them after themselves."""
    from ..slaves.library import mark_instances

    sys.path[:] = [os.path.abspath(place) for place in sys.path]
    folder = make_scratch("worker", Path(scratch))
    os.chdir(folder)
    tempfile.tempdir = os.environ["TMPDIR"] = str(folder)
    mark_instances(f"_{os.getpid()}")


def _quiet_worker(scratch: str) -> None:
    """A worker leaves Ctrl-C to the main process and ends with it, however that ends."""
    import threading

    _settle_in(scratch)
    leave_last_words(Path(scratch), _culprit)
    ignore_interrupts()
    signal.signal(signal.SIGTERM, _end_cleanly)
    parent = multiprocessing.parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            remove_all()
            os._exit(0)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def cluster(address: str | None) -> Iterator[Executor | None]:
    """The executor of the Dask cluster whose scheduler has that address; None without one."""
    if address is None:
        yield None
        return
    if not address.strip():
        raise UsageError("--dask: the address is empty; give one like tcp://scheduler:8786")
    try:
        from distributed import Client

        from .dask_executor import DaskExecutor
    except ImportError:
        raise UsageError(f"--dask needs the extra 'distributed': {install('distributed')}") from None
    connect: Any = Client
    try:
        client = connect(address, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError) as error:
        raise UsageError(f"--dask {address}: no scheduler answers there ({error})") from None
    for name in ("distributed", "distributed.client", "tornado", "asyncio"):  # a lost scheduler is told in a line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        if not client.scheduler_info()["workers"]:
            print(f"--dask {address}: there are no workers yet; this waits for them", file=sys.stderr)
        yield DaskExecutor(client)
    finally:
        _close(client)


def _close(client: Any) -> None:
    """Leave the cluster. Where its scheduler is gone the client may stumble as it closes (distributed 2026.8: over its
    own futures), and would try again for 20 s when it is freed."""
    try:
        client.close()
    except (RuntimeError, OSError):  # TimeoutError is one of the latter
        client.status = "closed"


class Pool:
    """Runs jobs of one package; a context manager. Counts the runs and tells `progress` of each."""

    def __init__(
        self,
        package: Path,
        executor: Executor | None = None,
        processes: int | None = None,
        progress: Callable[[int], None] = lambda runs: None,
        limit: float | None = None,
    ):
        """limit: wall time of a task [s], for processes of this machine."""
        self.package = package.resolve()
        self._same = SameFile(self.package)
        self.count = 0
        self.limit = limit
        self.progress = progress
        self._own, self._processes = executor is None, processes
        self._scratch = ""
        self._abandoned = False
        self._executor = executor or self._started()

    def _started(self) -> Executor:
        end_if_loaded_again()
        check_script()
        if not self._scratch:
            self._scratch = str(make_scratch("pool"))
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ.setdefault(name, "1")
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._processes or os.cpu_count() or 1, context, _quiet_worker, (self._scratch,))

    def __enter__(self) -> Pool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._own:
            return
        processes = list((getattr(self._executor, "_processes", None) or {}).values())
        stops = self._abandoned or (kind is not None and not issubclass(kind, Exception))
        # what is still to be done is dropped before its processes end: CPython 3.11 prints an error of each else
        self._executor.shutdown(wait=not stops, cancel_futures=True)
        if stops:
            _end_now(processes)
        remove_scratch(Path(self._scratch))

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool] | None = None) -> list[np.ndarray | Failure]:
        """The results in the order of the jobs; raises `Abandoned` as soon as `stop` is true.

        A process that dies is replaced; a run that takes its process with it every time is a `Failure`.
        """
        results: dict[int, np.ndarray | Failure] = dict(self.each_surviving(simulate, jobs, stop))
        return [results[k] for k in range(len(jobs))]

    def each_surviving(
        self, function: Callable[[str, Any], Any], tasks: Sequence[Any], stop: Callable[[], bool] | None = None
    ) -> Iterator[tuple[int, Any]]:
        """As `each`, with a `Failure` for a task that takes its process with it, or that the limit ends.

        Those that may have been at work when a process died are run again one by one, the others go on together. So are
        those that a cluster has given up: it blames all that its lost workers had been handed.
        """
        remaining = dict(enumerate(tasks))
        while remaining:
            keys, suspects = list(remaining), []
            try:
                for i, result in self.each(function, list(remaining.values()), stop):
                    if isinstance(result, Failure) and result.reason == DIED:
                        suspects.append(keys[i])
                        continue
                    del remaining[keys[i]]
                    yield keys[i], result
                for k in suspects:
                    self.count -= 1
                    yield k, next(self.each(function, [remaining.pop(k)], stop))[1]
            except WorkerDied:
                if not self._own:
                    raise
                self._executor.shutdown(wait=True, cancel_futures=True)
                self._executor = self._started()
                for k in list(remaining)[: 2 * (self._processes or os.cpu_count() or 1)]:
                    yield k, self._alone(function, remaining.pop(k), stop)

    def _alone(self, function: Callable[[str, Any], Any], task: Any, stop: Callable[[], bool] | None) -> Any:
        """function(package, task) in a process that may die of it."""
        try:
            with Pool(self.package, processes=1, limit=self.limit) as pool:
                result = next(pool.each(function, [task], stop))[1]
                self._same.check()
                return result
        except WorkerDied as error:
            return Failure(f"it takes longer than {self.limit:g} s", self.limit) if error.late else Failure(error.why)

    def _next(self, done: SimpleQueue[Future[Any]], stop: Callable[[], bool] | None) -> Future[Any]:
        """The next future that is done; raises `Abandoned` as soon as `stop` is true."""
        while True:
            if stop is not None and stop():
                self._abandoned = True
                raise Abandoned
            with suppress(Empty):
                return done.get(timeout=None if stop is None else STOP_POLL)

    def each(
        self, function: Callable[[str, Any], Any], tasks: Sequence[Any], stop: Callable[[], bool] | None = None
    ) -> Iterator[tuple[int, Any]]:
        """(index, function(package, task)) of every task, in the order in which they are done.

        A `Failure` instead where a Dask cluster gives a task up because its workers died of it; processes of this
        machine raise `WorkerDied`.
        """
        package, waiting = str(self.package), iter(enumerate(tasks))
        done, under_way, processes = SimpleQueue[Future[Any]](), dict[Future[Any], int](), list[Any]()

        def send() -> None:
            for k, task in islice(waiting, UNDER_WAY - len(under_way)):
                with starting_processes():  # the executor starts one when it is given work
                    future = self._executor.submit(_within, self.limit, function, package, task)
                under_way[future] = k
                future.add_done_callback(done.put)

        try:
            send()
            processes += (getattr(self._executor, "_processes", None) or {}).values()
            while under_way:
                future = self._next(done, stop)
                try:
                    result = future.result()
                except Exception as error:
                    kind = type(error).__name__  # of distributed, which need not be installed
                    if not self._own and kind in ("CancelledError", "FutureCancelledError", "CommClosedError"):
                        reason = "the cluster is gone; what was done is kept"
                        raise SimulationError(f"{self.package.name}: {reason}") from None
                    if kind != "KilledWorker":
                        raise
                    result = Failure(DIED)
                self._same.check()
                self.count += 1
                self.progress(self.count)
                yield under_way.pop(future), result
                send()
        except BrokenProcessPool:
            under_way.clear()  # the executor gives them up itself, and stumbles over one that is cancelled meanwhile
            codes = [_end(p) for p in processes]
            if lacking := unguarded(codes):
                raise UsageError(lacking) from None
            died = WorkerDied(f"{self.package.name}: a simulation process died; an FMU may have crashed")
            died.late = self.limit is not None and -ALARM in codes
            died.why = last_words(Path(self._scratch)) or DIED
            raise died from None
        finally:
            for future in list(under_way):
                future.cancel()
