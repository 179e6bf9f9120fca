"""Many runs of a package: in processes, on a Dask cluster, and when one fails."""

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Lock
from time import perf_counter, sleep

import numpy as np
import pytest
from deepsea_cosim.master.parallel import pool as pool_module
from deepsea_cosim.master.parallel.pool import Failure, Job, Pool, session
from deepsea_cosim.master.simulation.session import Session

from tests.toys import package


@pytest.fixture(scope="module")
def spring(toys, tmp_path_factory):
    return package(tmp_path_factory.mktemp("pool") / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=1.0)


def jobs():
    push = (np.array([0.0, 1.0]), np.array([1.0, 1.0]))
    return [Job(("o.x",), 1.0, 0.01, {"o.k": k}, {"o.u": push}) for k in (40.0, 80.0, 160.0)]


def alone(spring):
    with Session(spring) as session:
        return [session.run(j.record, j.stop, j.step, j.changes, j.inputs)[1] for j in jobs()]


def test_processes_give_what_one_session_gives(spring):
    told = []
    with Pool(spring, processes=2, progress=told.append) as pool:
        found = pool.run(jobs())
    for a, b in zip(found, alone(spring), strict=True):
        assert np.array_equal(a, b)
    assert told == [1, 2, 3]
    assert pool.count == 3


def test_runs_go_on_when_one_of_their_processes_is_killed(spring):
    killed = []

    def kill_one(_):
        if not killed:
            killed.append(next(iter(pool._executor._processes)))
            os.kill(killed[0], signal.SIGKILL)

    many = 4 * jobs()
    with Pool(spring, processes=2, progress=kill_one) as pool:
        found = pool.run(many)
    assert killed
    for a, b in zip(found, 4 * alone(spring), strict=True):
        assert np.array_equal(a, b)


def test_a_run_that_takes_its_process_with_it_is_a_failure_and_the_others_are_not(toys, tmp_path):
    bomb = package(tmp_path / "bomb.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    good, deadly = (Job(("b.x",), 1.0, 0.1, {"b.t_bomb": 0.5, "b.how": how}) for how in (5, 6))
    with Pool(bomb, processes=2) as pool:
        found = pool.run([good, deadly, good, good])
        again = pool.run([good])
    assert isinstance(found[1], Failure)
    assert all(isinstance(r, np.ndarray) for r in (*found[:1], *found[2:], *again))


class Counting(ThreadPoolExecutor):
    """Counts the tasks that are handed out and not done."""

    under_way = most = 0
    lock = Lock()

    def submit(self, *task):
        self.add(1)
        future = super().submit(*task)
        future.add_done_callback(lambda _: self.add(-1))
        return future

    def add(self, change):
        with self.lock:
            self.under_way += change
            self.most = max(self.most, self.under_way)


def test_so_many_tasks_are_under_way_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr(pool_module, "UNDER_WAY", 3)
    with Counting(2) as executor, Pool(tmp_path / "none.ssp", executor) as pool:
        found = dict(pool.each(lambda _, task: task * task, range(40)))
    assert found == {k: k * k for k in range(40)}
    assert executor.most <= 3
    assert pool.count == 40


def test_macro_steps_between_recorded_points(spring):
    with Pool(spring, processes=1) as pool:
        found = pool.run([replace(job, parts=4) for job in jobs()])
    with Session(spring) as opened:
        finer = [opened.run(j.record, j.stop, j.step / 4, j.changes, j.inputs)[1] for j in jobs()]
    for a, b in zip(found, finer, strict=True):
        assert np.array_equal(a, b[::4])


def test_a_package_that_is_made_anew_is_loaded_anew(toys, tmp_path):
    """A worker of a cluster lives on; and what only vanished goes on with what is loaded."""
    path = package(tmp_path / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=1.0)
    first = session(str(path))
    assert session(str(path)) is first
    os.utime(path, ns=(1, 1))
    second = session(str(path))
    assert second is not first
    path.unlink()
    assert session(str(path)) is second


def test_a_dask_cluster_gives_the_same(spring):
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster) as client, Pool(spring, client.get_executor()) as pool:
        found = pool.run(jobs())
    for a, b in zip(found, alone(spring), strict=True):
        assert np.array_equal(a, b)


def test_a_run_that_fails_is_reported_and_the_others_are_kept(toys, tmp_path):
    bomb = package(tmp_path / "bomb.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    with Pool(bomb, processes=1) as pool:
        found = pool.run([Job(("b.x",), 1.0, 0.1, {"b.t_bomb": 0.5}), Job(("b.x",), 1.0, 0.1)])
    assert isinstance(found[0], Failure)
    assert "not finite" in found[0].reason
    assert isinstance(found[1], np.ndarray)


def test_an_fmu_that_is_lost_is_loaded_anew_for_the_next_run(toys, tmp_path):
    bomb = package(tmp_path / "bomb.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    with Pool(bomb, processes=1) as pool:
        bad = Job(("b.x",), 1.0, 0.1, {"b.t_bomb": 0.5, "b.how": 3})
        found = pool.run([bad, Job(("b.x",), 1.0, 0.1), bad, bad, Job(("b.x",), 1.0, 0.1)])
    assert ["lost" in r.reason for r in found if isinstance(r, Failure)] == [False, False, False]
    assert [r[-1, 0] for r in found if isinstance(r, np.ndarray)] == pytest.approx([1.0, 1.0])


def test_an_interrupt_does_not_wait_for_what_is_being_simulated(toys, tmp_path):
    path = package(tmp_path / "p.ssp", {"mass": toys / "Mass.fmu"})
    begin = perf_counter()

    def interrupted():
        with Pool(path, processes=1) as pool:
            pool._executor.submit(sleep, 120.0)
            sleep(1.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert perf_counter() - begin < 60.0
