"""One communication step with a controller whose output is delayed or sampled: slices with a known output.

Without these effects it is one call of `integrator.advance`. With them the step is cut at the controller's sampling
times and, with a delay, into slices of at most 1 ms that are no longer than the delay; at the start of a slice the
controller's output is computed and remembered, and within it the output in force is known: what was remembered the
delay ago, joined by straight lines.
`memory` holds this history; it is part of the state.

No slice is shorter than `SHORTEST`, so that a run's cost stays bounded: for a shorter delay the last straight line goes
on, and sampling in a shorter period is, in the constants already, the delay of half a period that it amounts to.
"""

from __future__ import annotations

from math import floor

from ..core.jit import kernel
from .circuit import border, outputs_at
from .constants import SHORTEST
from .controller import command, command_rate, pid_output
from .integrator import OK, advance

LENGTH = 1024
COUNT, HELD, SAMPLED_AT = 0, 1, 2
FIRST = 3
MEMORY = FIRST + 2 * LENGTH
"""Size of the memory: number of entries made, output in force [mA], time of the last sample [s], times, outputs."""
SLICE = 1e-3
"""Longest slice with a delay [s]."""


@kernel
def remembered(t: float, memory: object, limit: float) -> float:
    """Controller output [mA] at time t [s] from the history, held before it and continued after it up to +-limit."""
    count = int(memory[COUNT])
    oldest = max(0, count - LENGTH)
    k = count - 1
    while k > oldest and memory[FIRST + k % LENGTH] > t:
        k -= 1
    u = memory[FIRST + LENGTH + k % LENGTH]
    if memory[FIRST + k % LENGTH] > t or count == 1:
        return u
    a, b = (k, k + 1) if k < count - 1 else (k - 1, k)
    t_a, t_b = memory[FIRST + a % LENGTH], memory[FIRST + b % LENGTH]
    if t_b <= t_a:
        return u
    u_a, u_b = memory[FIRST + LENGTH + a % LENGTH], memory[FIRST + LENGTH + b % LENGTH]
    return min(max(u + (u_b - u_a) * (t - memory[FIRST + k % LENGTH]) / (t_b - t_a), -limit), limit)


@kernel
def march(
    y: object, w: object, memory: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float,
) -> int:  # fmt: skip
    """Advance y over the step as `advance` does, with delay and sampling of the controller where switched on."""
    delay, period, gain = c.controller.delay, c.controller.period, c.sensor.gain
    plain = delay == 0.0 and period == 0.0
    limit = c.valve.i_rated
    tiny = 1e-9 * max(h, 1e-6)
    s = 0.0  # time since t_0, as in `advance`
    status = OK
    while s < h and status == OK:
        t = t_0 + s
        stop = h
        u, u_rate = float("nan"), 0.0
        x = x_0 + v_h * s
        if not plain:
            if delay > 0.0:
                stop = min(stop, s + min(max(delay, SHORTEST), SLICE))
            sample = True
            if period > 0.0:
                tick = floor(t / period + 1e-9) * period
                sample = memory[COUNT] == 0.0 or tick > memory[SAMPLED_AT] + tiny
                stop = min(stop, tick + period - t_0)
                if sample:
                    memory[SAMPLED_AT] = tick
            if h - stop < tiny:
                stop = h
            if sample:
                r = command(t, t_0, x_ref, ref_rate, c)
                r_rate = command_rate(t_0 + 0.5 * (s + stop), ref_rate, c)
                memory[HELD] = pid_output(
                    gain * (r - x), gain * (r_rate - v_h), border(y).integral, c.controller.kp, c.controller.kd, limit
                )
            u = memory[HELD]
            if delay > 0.0:
                k = int(memory[COUNT]) % LENGTH
                memory[FIRST + k] = t
                memory[FIRST + LENGTH + k] = u
                memory[COUNT] += 1.0
                u = remembered(t - delay, memory, limit)
                u_rate = (remembered(t_0 + stop - delay, memory, limit) - u) / (stop - s)
            else:
                memory[COUNT] += 1.0
        status = advance(y, w, c, scale, t, stop - s, x, v_h, x_ref + ref_rate * s, ref_rate, u, u_rate)
        s = stop
    return status


@kernel
def output_in_force(t: float, memory: object, c: object) -> float:
    """Controller output [mA] that acts on the valve at time t [s], or NaN when it is continuous."""
    if c.controller.delay > 0.0:
        return remembered(t - c.controller.delay, memory, c.valve.i_rated) if memory[COUNT] > 0.0 else float("nan")
    if c.controller.period > 0.0:
        return memory[HELD] if memory[COUNT] > 0.0 else float("nan")
    return float("nan")


@kernel
def step(
    y: object, w: object, memory: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float, out: object,
) -> int:  # fmt: skip
    """`march`, and the outputs at its end; with h = 0 those of the present state. One call from Python."""
    status = march(y, w, memory, c, scale, t_0, h, x_0, v_h, x_ref, ref_rate)
    if status == OK:
        outputs_at(y, c, t_0, h, x_0, v_h, x_ref, ref_rate, output_in_force(t_0 + h, memory, c), out)
    return status
