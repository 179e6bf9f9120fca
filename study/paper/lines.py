"""Figure 8: the loss of one line from rest to a steady flow of 3 L/min, with variable and constant viscosity.

The flow is switched on at once, so a front runs to and fro in the line until friction has taken it. By characteristics
it stays a front; the FMU's segments, which are made for the flows that a valve makes, would ring.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...core.sea import ambient_pressure
from ..characteristics import line_transient
from ..table1 import BASE, P_VAPOUR, ROWS

DEPTHS = (0.0, 3.0, 6.0, 9.0, 11.0)
"""Depths of the figure [km]."""

RESPONSE = 0.1
"""How long the dynamic response is looked at: at 3 km and more it is over then [s]."""

STEADY: Mapping[bool, float] = {
    True: next(row.simulated for row in ROWS if row.case["depth"] == 1e3 * DEPTHS[-1]), False: 6.6593,
}  # fmt: skip
"""Published steady losses at 11 km [MPa], by whether the viscosity is variable: Table 1 and the text beside it."""


@dataclass(frozen=True)
class Lines:
    """Times [s] and losses [Pa] by depth [km] and whether the viscosity is variable."""

    made: Mapping[tuple[float, bool], tuple[np.ndarray, np.ndarray]]

    @property
    def depths(self) -> tuple[float, ...]:
        """The depths [km]."""
        return tuple(dict.fromkeys(km for km, _ in self.made))

    def steady(self, km: float, variable: bool) -> float:
        """Loss [Pa] in the end."""
        return float(self.made[float(km), variable][1][-1])

    def apart(self, km: float, until: float = RESPONSE) -> float:
        """RMS distance of the responses with variable and constant viscosity, of that with constant one's RMS.

        Up to `until` [s], or to where the oil in the line first comes near its vapour's pressure.
        """
        (t, variable), (_, constant) = (self.made[float(km), v] for v in (True, False))
        tears = constant < 2 * P_VAPOUR - ambient_pressure(1e3 * km)
        end = min(int(np.searchsorted(t, until, "right")), int(tears.argmax()) if tears.any() else len(t))
        return float(np.sqrt(np.mean((variable - constant)[:end] ** 2) / np.mean(constant[:end] ** 2)))


def responses(stop: float = 0.5) -> Lines:
    """All responses of the figure."""
    made = {}
    for km in DEPTHS:
        case = {**BASE, "depth": 1e3 * km}
        for variable in (True, False):
            made[km, variable] = line_transient(**case, variable=variable, stop=stop)
    return Lines(made)
