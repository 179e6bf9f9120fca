"""How long a run with each effect of a package's catalogue takes, beside one without any.

    python -m benchmarks.effect_cost build/deepsea_0km.ssp [--step 0.008]

A diagnosis simulates every effect, so that one that takes ten times as long as the others is felt in each. Sizes are
the catalogue's usual ones; CPU time of this process, the least of five runs of 22 s at 5.7 km; the slowest first.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from pathlib import Path

from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.catalogue import Effect
from deepsea_cosim.gap.campaign.read_catalogue import load_from_package
from deepsea_cosim.master.simulation.session import Session

CONDITIONS = {"depth": 5700.0}
STOP, RUNS = 22.0, 5


def usual(effect: Effect) -> dict[str, float]:
    """The parameters of the machine that an effect of its usual size has; none of a sensor's."""
    return {
        p.address: p.starts[0] if p.starts else p.neutral + p.prior
        for p in effect.parameters
        if not p.address.startswith("sensor.")
    }


def seconds(session: Session, changes: Mapping[str, float], step: float) -> float:
    """CPU time of a run [s], the least of some."""
    taken = []
    for _ in range(RUNS):
        begin = time.process_time()
        session.run((), STOP, step, {**CONDITIONS, **changes})
        taken.append(time.process_time() - begin)
    return min(taken)


def main() -> int:
    p = argparse.ArgumentParser(prog="benchmarks.effect_cost", description="What a run with each effect costs.")
    p.add_argument("package", type=Path)
    p.add_argument("--step", type=float, default=8e-3, help="macro step in seconds")
    options = p.parse_args()
    catalogue, made = load_from_package(options.package), []
    with Session(options.package) as session:
        plain = seconds(session, catalogue.estimation, options.step)
        for effect in catalogue.effects:
            if not (changes := usual(effect)):
                continue
            try:
                taken = seconds(session, {**catalogue.estimation, **changes}, options.step)
            except CosimError as error:
                print(f"{effect.id}: {error}")
                continue
            made.append((taken / plain, effect.id))
    print(f"plain: {1e3 * plain:.1f} ms")
    for ratio, name in sorted(made, reverse=True):
        print(f"{ratio:6.2f}  {name}")
    print(f"all {len(made)}: {sum(ratio for ratio, _ in made) / len(made):.2f} on average")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
