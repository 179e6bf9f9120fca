"""Displacement sensor, PID with saturation and anti-windup, and the built-in command."""

from __future__ import annotations

from ..core.jit import kernel


@kernel
def ramp_command(t: float, target: float, t_start: float, ramp_time: float, hold_time: float) -> float:
    """Built-in command [m] at time t [s]: 0, linear rise to target, hold, linear fall to 0."""
    s = t - t_start
    if s <= 0.0:
        return 0.0
    if s < ramp_time:
        return target * s / ramp_time
    s -= ramp_time + hold_time
    if s <= 0.0:
        return target
    if s < ramp_time:
        return target * (1.0 - s / ramp_time)
    return 0.0


@kernel
def ramp_rate(t: float, target: float, t_start: float, ramp_time: float, hold_time: float) -> float:
    """Rate [m/s] of the built-in command just before time t [s]."""
    s = t - t_start
    if 0.0 < s <= ramp_time:
        return target / ramp_time
    if 0.0 < s - ramp_time - hold_time <= ramp_time:
        return -target / ramp_time
    return 0.0


@kernel
def pid_output(error: float, error_rate: float, integral: float, kp: float, kd: float, limit: float) -> float:
    """Controller output u [mA], saturated at +-limit. `integral` [mA] is the integral part as it stands."""
    return min(max(kp * error + integral + kd * error_rate, -limit), limit)


@kernel
def integral_rate(error: float, u: float, ki: float, limit: float) -> float:
    """Rate of the integral part [mA/s]; it stands still while the output is saturated and would go further."""
    if (u >= limit and error > 0.0) or (u <= -limit and error < 0.0):
        return 0.0
    return ki * error
