"""Whether small errors of the coupling have grown into large ones, as one run shows it.

Two measurements of the run are multiplied: how far the inputs of a component were off in a step (`held`), as a share
of their range, and by how much differences grow where it leaves a rest by itself (`departure`). The product is about
the share of its range by which a signal is off there: docs/accuracy.md has it beside true errors. Neither alone says
anything: all couplings are off a little, and machines may leave a rest as often as they like where nothing was off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .departure import departures
from .held_inputs import HeldInputs

IN_DOUBT = 0.1
"""Share of its range that a signal has to be off to be told."""


def doubt(
    columns: Mapping[str, Sequence[tuple[int, str]]], sample: np.ndarray, held: HeldInputs
) -> dict[str, Any] | None:
    """What is most in doubt of a run, or None where no signal leaves a rest.

    columns: index and name of the real outputs, by component; sample: (n, columns) with the time in the first. Told are
    the signal, from when to when it leaves [s], the factor by which differences grow, the input that was furthest off
    and by which share of its range, and the share of its range by which the signal may be off.
    """
    most_doubtful: dict[str, Any] | None = None
    for component, outputs in columns.items():
        worst = held.worst(component)
        if worst is None:
            continue
        for departure in departures(sample[:, 0], sample[:, [j for j, _ in outputs]]):
            off = departure.change * min(1.0, worst[1] * departure.factor)
            if most_doubtful is None or off > most_doubtful["signal_off"]:
                most_doubtful = {
                    "signal": outputs[departure.column][1], "from_s": departure.begin, "to_s": departure.end,
                    "growth": departure.factor, "input": worst[0], "input_off": worst[1], "signal_off": off,
                }  # fmt: skip
    return most_doubtful


def warning(most: dict[str, Any] | None, order: int, step: float) -> list[str]:
    """The line that a run ends with, if there is reason for one; order: of the method; step in s."""
    if most is None or most["signal_off"] <= IN_DOUBT:
        return []
    other = "--method nepce or " if order == 1 else ""
    return [
        f"{most['signal']} may be off by {most['signal_off']:.0%} of its range: from t = {most['from_s']:.4g} s on it "
        f"leaves a rest by itself, differences grow {most['growth']:.2g}-fold by {most['to_s']:.4g} s, and "
        f"the input {most['input']} was off by up to {most['input_off']:.2g} of its range; take {other}--step "
        f"{step / 2:g}, and --check-step to see what that changes"
    ]
