"""The sea that both FMUs are in."""

from __future__ import annotations

GRAVITY = 9.81
"""Standard gravity used throughout [m/s2]."""

ATMOSPHERE = 0.1013e6
"""Pressure at the surface [Pa absolute]; the least ambient pressure."""

PRESSURE_GRADIENT = 1.0e4
"""Growth of the ambient pressure with depth [Pa/m]: 10 MPa per km (paper, section 3)."""


def ambient_pressure(depth: float) -> float:
    """Ambient pressure P_am [Pa absolute] at `depth` [m] below the surface: 10 MPa/km, at least one atmosphere."""
    return max(PRESSURE_GRADIENT * depth, ATMOSPHERE)
