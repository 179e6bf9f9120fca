"""What it saves that the arm switches MuJoCo's timers off: the same runs with and without, in turns, in one process.

    python benchmarks/mujoco_timers.py build/deepsea_0km.ssp [ROUNDS]

Prints wall times of a 20 s run at 1 ms, their ratio, and whether the results are the same bit for bit.
"""

from __future__ import annotations

import ctypes
import statistics
import sys
from pathlib import Path
from time import perf_counter

import mujoco
import numpy as np
from deepsea_cosim.master.simulation.session import Session

RECORD = ("arm.x_h", "hydraulics.P1", "hydraulics.P2")


def timed(session: Session) -> tuple[float, np.ndarray]:
    """Seconds of a run, and its signals."""
    begin = perf_counter()
    signals = session.run(RECORD, 20.0, 1e-3)[1]
    return perf_counter() - begin, signals


def main() -> None:
    """Print the comparison."""
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 15
    file = next(p for p in Path(mujoco.__file__).parent.iterdir() if p.name.startswith(("libmujoco.", "mujoco.dll")))
    clock = ctypes.c_void_p.in_dll(ctypes.CDLL(str(file)), "mjcb_time")
    asked = clock.value  # as MuJoCo's Python package has set it
    with Session(Path(sys.argv[1])) as session:
        timed(session)
        off, on = [], []
        for _ in range(rounds):
            clock.value = None
            seconds, a = timed(session)
            off.append(seconds)
            clock.value = asked
            seconds, b = timed(session)
            on.append(seconds)
    ratio = statistics.median(y / x for x, y in zip(off, on, strict=True))
    same = "the same bit for bit" if a.tobytes() == b.tobytes() else "NOT the same"
    one, other = (1e3 * statistics.median(x) for x in (off, on))
    print(f"{one:.1f} ms, with timers {other:.1f} ms, {ratio:.3f} times; {same}")


if __name__ == "__main__":
    main()
