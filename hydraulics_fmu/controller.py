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


@kernel
def controller_output(error: float, error_rate: float, integral: float, held: float, c: object) -> float:
    """Controller output u [mA]: the PID's, or `held` when that is a number (delay and sampling, see `march`)."""
    if held == held:
        return held
    return pid_output(error, error_rate, integral, c.controller.kp, c.controller.kd, c.valve.i_rated)


@kernel
def command(t: float, t_0: float, x_ref: float, ref_rate: float, c: object) -> float:
    """Command in force [m]: the built-in ramp, or the input continued from time t_0 with its rate."""
    if c.command.use_input != 0.0:
        return x_ref + ref_rate * (t - t_0)
    return ramp_command(t, c.command.target, c.command.t_start, c.command.ramp_time, c.command.hold_time)


@kernel
def command_rate(t: float, ref_rate: float, c: object) -> float:
    """Rate [m/s] of the command in force just before time t [s]."""
    if c.command.use_input != 0.0:
        return ref_rate
    return ramp_rate(t, c.command.target, c.command.t_start, c.command.ramp_time, c.command.hold_time)
