"""The small campaigns. None of the code that is compared has a part in their measurements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import machine, toy
from .made import Made


@dataclass(frozen=True)
class Small:
    """A campaign: what it is, and what writes it into a folder with a campaign.toml."""

    name: str
    text: str
    write: Callable[[Path, Made], object]


CAMPAIGNS = (
    Small("blind_pair", "marine growth and leakage, all effects: case 11", machine.blind(11, 4.0)),
    Small("blind_single", "a stronger current, all effects: case 20", machine.blind(20, 4.0)),
    Small("machine_three", "three effects, where no pair is enough", machine.three),
    Small("machine_pair", "a dead zone and a slow spool, near to swinging", machine.pair),
    Small("machine_moments", "measured moments of five runs, no channels", machine.moments),
    Small("machine_single", "a dead zone", machine.single),
    Small("toy_unknown", "two runs with what the catalogue does not know", toy.unknown),
    Small("toy_friction", "two runs with little friction and base parameters far off", toy.friction),
    Small("toy_large", "a large effect beside an unknown one; one of two runs is held out", toy.large),
    Small("toy_holdout", "a machine that swings; one of two runs is held out", toy.holdout),
    Small("toy_nothing", "two runs that a refit explains", toy.no_effect),
    Small("toy_late_sensor", "a sensor that is late; its noise is estimated", toy.late_sensor),
)
"""Those that take longest first, so that two at a time end together."""
