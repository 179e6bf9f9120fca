"""What it saves that the FMUs step without Python: the same runs with and without it, in turns, in one process.

    python benchmarks/native_step.py build/deepsea_0km.ssp [ROUNDS]

Prints wall times of a 20 s run for macro steps of 1 to 8 ms, their ratio, and whether the results are the same bit for
bit.
"""

from __future__ import annotations

import statistics
import sys
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

import numpy as np
from deepsea_cosim.master.simulation.session import Session

RECORD = ("arm.x_h", "hydraulics.P1", "hydraulics.P2")


@contextmanager
def steps_by_python():
    """The FMUs' Python code keeps from the front library where the compiled step is."""
    bases = [m.Instance for n, m in sys.modules.items() if n.startswith("deepsea_cosim_") and n.endswith(".instance")]
    before = [base._tell_step for base in bases]
    for base in bases:
        base._tell_step = lambda self: None
    yield
    for base, own in zip(bases, before, strict=True):
        base._tell_step = own


def timed(session: Session, step: float) -> tuple[float, np.ndarray]:
    """Seconds of a run, and its signals."""
    begin = perf_counter()
    signals = session.run(RECORD, 20.0, step)[1]
    return perf_counter() - begin, signals


def main() -> None:
    """Print the table."""
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 9
    with Session(Path(sys.argv[1])) as session:
        for step in (8e-3, 4e-3, 1e-3):
            native, python = [], []
            for _ in range(rounds):
                seconds, a = timed(session, step)
                native.append(seconds)
                with steps_by_python():
                    seconds, b = timed(session, step)
                python.append(seconds)
            ratio = statistics.median(p / n for p, n in zip(python, native, strict=True))
            same = "the same bit for bit" if a.tobytes() == b.tobytes() else "NOT the same"
            one, other = (1e3 * statistics.median(x) for x in (native, python))
            print(f"{1e3 * step:3.0f} ms: {one:6.1f} ms, by Python {other:6.1f} ms, {ratio:.2f} times; {same}")


if __name__ == "__main__":
    main()
