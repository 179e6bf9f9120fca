"""A sweep on a Dask cluster that is not left in peace: are there as many results as cases, and each the right one?

    python -m benchmarks.dask_faults [--cases 10000] [--workers 2,4,8] [--faults none,worker,nanny,slow,scheduler]

The cluster is processes of this machine: a scheduler, and a nanny with a worker each. While `cosim-study sweep` runs,
every few seconds a worker is killed (its nanny starts another), or a nanny with its worker (another is started), or a
worker stands still for some seconds; or the scheduler is killed once and started again, whereupon the sweep ends with a
line and is called once more. Every case is a gain; its result is twice that.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from benchmarks import native

FAULTS = ("none", "worker", "nanny", "slow", "scheduler")
PERIOD = 4.0
"""Time between two faults [s]."""

PAUSE = 6.0
"""How long a slow worker stands still [s]."""


class Cluster:
    """A scheduler and workers, as processes; a context manager."""

    def __init__(self, workers: int, folder: Path):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self._folder = folder
        self.start_scheduler()
        self.nannies = [self._nanny() for _ in range(workers)]

    def start_scheduler(self) -> None:
        place = ("--host", "127.0.0.1", "--port", str(self.port))
        self.scheduler = self._start("dask_scheduler", *place, "--no-dashboard", "--dashboard-address", "127.0.0.1:0")

    def add(self) -> None:
        self.nannies.append(self._nanny())

    def renew(self) -> None:
        """Workers for those that have ended with their scheduler."""
        ended = [nanny for nanny in self.nannies if nanny.poll() is not None]
        for nanny in ended:
            self.nannies.remove(nanny)
            self.add()

    def workers(self) -> list[int]:
        """Processes that simulate: children of the nannies, but for what keeps count of their resources."""
        found = []
        for nanny in self.nannies:
            with suppress(OSError):
                children = Path(f"/proc/{nanny.pid}/task/{nanny.pid}/children").read_text().split()
                commands = {int(c): Path(f"/proc/{c}/cmdline").read_bytes() for c in children}
                found += [c for c, command in commands.items() if b"resource_tracker" not in command]
        return found

    def _nanny(self) -> subprocess.Popen[bytes]:
        return self._start("dask_worker", self.address, "--nthreads", "1", "--no-dashboard", "--death-timeout", "60")

    def _start(self, tool: str, *more: str) -> subprocess.Popen[bytes]:
        line = [sys.executable, "-m", f"distributed.cli.{tool}", *more]
        nothing = subprocess.DEVNULL
        return subprocess.Popen(line, cwd=self._folder, stdout=nothing, stderr=nothing, start_new_session=True)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.nannies, self.scheduler):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def disturb(fault: str, cluster: Cluster, chance: random.Random) -> None:
    """Do it once."""
    with suppress(ProcessLookupError, IndexError):
        if fault == "worker":
            os.kill(chance.choice(cluster.workers()), signal.SIGKILL)
        elif fault == "nanny":
            gone = cluster.nannies.pop(chance.randrange(len(cluster.nannies)))
            os.killpg(gone.pid, signal.SIGKILL)
            gone.wait()
            cluster.add()
        elif fault == "slow":
            slow = chance.choice(cluster.workers())
            os.kill(slow, signal.SIGSTOP)
            time.sleep(PAUSE)
            os.kill(slow, signal.SIGCONT)
        elif fault == "scheduler":
            cluster.scheduler.kill()
            cluster.scheduler.wait()
            time.sleep(1.0)
            cluster.start_scheduler()


def package(folder: Path) -> Path:
    """A gain, on a ramp that is 2 at the end."""
    from tests.master.parts import constant, gain
    from tests.packages import link, system
    from tests.packages import package as pack

    root = system("root", constant("a", 2.0), gain("b", 1.0), links=(link("a.y1", "b.u1"),))
    return pack(folder / "p.ssp", root, {"resources/L.fmu": native.linear(folder, 2)}, stop=1.0, step=0.01)


def swept(folder: Path, cases: int, workers: int, fault: str) -> str:
    """Run the sweep until it is done; what came of it, as a line."""
    out, said, calls, faults = folder / f"{fault}{workers}", list[str](), 0, 0
    line = [sys.executable, "-m", "deepsea_cosim.study.cli", "sweep", str(folder / "p.ssp"), "--out", str(out)]
    line += ["--quiet", "--vary", f"b.D[1,1]=1:{cases}:1", "--metric", "end=final(b.y1)"]
    chance, over = random.Random(f"{fault} {workers}"), threading.Event()
    begin = time.monotonic()
    with Cluster(workers, folder) as cluster:

        def disturbing() -> None:
            nonlocal faults
            while not over.wait(PERIOD):
                cluster.renew()
                enough = fault == "none" or (fault == "scheduler" and faults > 0)
                if not enough and (out / "cases.jsonl").exists():  # it is under way
                    disturb(fault, cluster, chance)
                    faults += 1

        thread = threading.Thread(target=disturbing)
        thread.start()
        while calls < 5:
            calls += 1
            done = subprocess.run([*line, "--dask", cluster.address], capture_output=True, text=True, check=False)
            if done.returncode == 0:
                break
            said.append(done.stderr.strip().splitlines()[-1][:120] if done.stderr.strip() else "nothing")
        over.set()
        thread.join()
    taken = time.monotonic() - begin
    return f"{faults:>4} faults {calls:>2} calls {taken:>7.0f} s  {judged(out, cases)}  {'; '.join(said)}"


def judged(out: Path, cases: int) -> str:
    """Cases in and out."""
    entries = [json.loads(text) for text in (out / "cases.jsonl").read_text().splitlines()]
    names = Counter(entry["case"] for entry in entries)
    import pandas as pd

    table = pd.read_parquet(out / "sweep.parquet")
    right = (abs(table["end"] - 2.0 * table["b.D[1,1]"]) < 1e-9).sum()
    twice = sum(count > 1 for count in names.values())
    return f"{cases} in, {len(names)} kept, {twice} twice, {len(table)} in the table, {right} right"


def main() -> None:
    p = argparse.ArgumentParser(prog="python -m benchmarks.dask_faults", description=__doc__,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("--cases", type=int, default=10_000)
    p.add_argument("--workers", default="2,4,8")
    p.add_argument("--faults", default=",".join(FAULTS))
    options = p.parse_args()
    with tempfile.TemporaryDirectory(prefix="dask_faults_") as name:
        folder = Path(name)
        package(folder)
        for fault in options.faults.split(","):
            for workers in map(int, options.workers.split(",")):
                print(f"{fault:<10}{workers} workers {swept(folder, options.cases, workers, fault)}", flush=True)


if __name__ == "__main__":
    main()
