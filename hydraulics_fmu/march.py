"""One communication step with a controller whose output is delayed or sampled: slices with a known output.

Without these effects it is one call of `integrator.advance`. With them the step is cut at the controller's sampling
times and, with a delay, into slices of at most `SLICE` that are no longer than the delay; at the start of a slice the
controller's output is computed and remembered, and within it the output in force is known: what was remembered the
delay ago, joined by straight lines. A spool that is held back is followed in such slices, too.
What is remembered (`memory`) is part of the state.

No slice is shorter than `SHORTEST`, so that a run's cost stays bounded: for a shorter delay the last straight line goes
on, and sampling in a shorter period is, in the constants already, the delay of half a period that it amounts to.
"""

from __future__ import annotations

from math import floor

from ..core.jit import kernel
from .circuit import outputs_at, rod_at
from .constants import SHORTEST
from .controller import command, command_rate, controller_output, pid_output
from .friction import rub
from .integrator import OK, advance
from .memory import LENGTH
from .states import border
from .valve import let_go, sticks

SLICE = 8e-3
"""Longest slice with a delay or with a spool that is held back [s]: the rod moves straight on within a communication
step, so that shorter slices of steps up to this one change less than the step itself does (docs/accuracy.md)."""

PARTS = 220
"""Parts of a delay in each of which a history of short steps has an entry: with the ticks of a controller that samples
as well they are fewer than it holds, and steps of 1 ms are not short for any delay."""


@kernel
def remembered(t: float, m: object, limit: float) -> float:
    """Controller output [mA] at time t [s] from the history, held before it and continued after it up to +-limit."""
    count = int(m.count)
    oldest = max(0, count - LENGTH)
    k = count - 1
    while k > oldest and m.times[k % LENGTH] > t:
        k -= 1
    u = m.outputs[k % LENGTH]
    if m.times[k % LENGTH] > t or count == 1:
        return u
    a, b = (k, k + 1) if k < count - 1 else (k - 1, k)
    t_a, t_b = m.times[a % LENGTH], m.times[b % LENGTH]
    if t_b <= t_a:
        return u
    u_a, u_b = m.outputs[a % LENGTH], m.outputs[b % LENGTH]
    return min(max(u + (u_b - u_a) * (t - m.times[k % LENGTH]) / (t_b - t_a), -limit), limit)


@kernel
def latest_tick(t: float, s: float, t_0: float, period: float, tiny: float) -> float:
    """Time [s] of the last tick of the controller's clock up to t = t_0 + s [s], or of one that follows within `tiny`.

    Ticks are counted, so that one is always the same number; late in a run a period is less than what t resolves of it,
    and t falls short of a tick that s has reached.
    """
    n = floor(t / period + 1e-9)
    if n * period + period - t_0 <= s + tiny:
        n += 1
    return n * period


@kernel
def march(
    y: object, w: object, m: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float,
) -> int:  # fmt: skip
    """Advance y over the step as `advance` does, with delay and sampling of the controller where switched on."""
    delay, period, gain = c.controller.delay, c.controller.period, c.sensor.gain
    plain, stuck = delay == 0.0 and period == 0.0, sticks(c)
    tiny = 1e-9 * max(h, 1e-6)
    s = 0.0  # time since t_0, as in `advance`
    status = OK
    while s < h and status == OK:
        t = t_0 + s
        stop = min(h, s + SLICE) if stuck else h
        m.u, m.u_rate = float("nan"), 0.0
        if not plain:
            if delay > 0.0:
                stop = min(stop, s + min(max(delay, SHORTEST), SLICE))
            sample = True
            if period > 0.0:
                tick = latest_tick(t, s, t_0, period, tiny)
                sample = m.count == 0.0 or tick > m.sampled_at + tiny
                stop = min(stop, tick + period - t_0)
                if sample:
                    m.sampled_at = tick
            if h - stop < tiny:
                stop = h
            if sample:
                x, v = rod_at(y, x_0 + v_h * s, v_h, c)
                r = command(t, t_0, x_ref, ref_rate, c)
                r_rate = command_rate(t_0 + 0.5 * (s + stop), ref_rate, c)
                m.held = pid_output(
                    gain * (r - x), gain * (r_rate - v), border(y, c).integral, c.controller.kp, c.controller.kd,
                    c.valve.i_rated,
                )  # fmt: skip
            told(t_0, s, stop, h, m, c)
        status = advance(y, w, c, scale, t, stop - s, x_0 + v_h * s, v_h, x_ref + ref_rate * s, ref_rate, m)
        if stuck and status == OK:
            t = t_0 + stop
            x, v = rod_at(y, x_0 + v_h * stop, v_h, c)
            error, error_rate = command(t, t_0, x_ref, ref_rate, c) - x, command_rate(t, ref_rate, c) - v
            u = controller_output(gain * error, gain * error_rate, border(y, c).integral, output_in_force(t, m, c), c)
            let_go(u, stop - s, c, m)
        s = stop
    return status


@kernel
def told(t_0: float, s: float, stop: float, h: float, m: object, c: object) -> None:
    """Remember the controller's output, and say which is in force between t_0 + s and t_0 + stop [s]; h: the step [s].

    In short steps the newest entry is written over until a `PARTS` of the delay has passed since the one before it, for
    the history would not reach back over the delay otherwise.
    """
    delay = c.controller.delay
    m.u = m.held
    if delay > 0.0:
        if not crowded(h, delay, m):
            m.count += 1.0
        k = (int(m.count) - 1) % LENGTH
        m.times[k] = t_0 + s
        m.outputs[k] = m.held
        m.u = remembered(t_0 + s - delay, m, c.valve.i_rated)
        m.u_rate = (remembered(t_0 + stop - delay, m, c.valve.i_rated) - m.u) / (stop - s)
    else:
        m.count += 1.0


@kernel
def crowded(h: float, delay: float, m: object) -> bool:
    """Whether the newest entry of the history comes too soon after the one before it, in steps of h [s]."""
    last = int(m.count) - 1
    if last < 1 or h >= delay / PARTS:
        return False
    return m.times[last % LENGTH] - m.times[(last - 1) % LENGTH] < delay / PARTS


@kernel
def output_in_force(t: float, m: object, c: object) -> float:
    """Controller output [mA] that acts on the valve at time t [s], or NaN when it is continuous."""
    if c.controller.delay > 0.0:
        return remembered(t - c.controller.delay, m, c.valve.i_rated) if m.count > 0.0 else float("nan")
    if c.controller.period > 0.0:
        return m.held if m.count > 0.0 else float("nan")
    return float("nan")


@kernel
def step(
    y: object, w: object, m: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float, out: object,
) -> int:  # fmt: skip
    """`march`, and the outputs at its end; with h = 0 those of the present state. One call from Python."""
    status = march(y, w, m, c, scale, t_0, h, x_0, v_h, x_ref, ref_rate)
    if status == OK:
        if h > 0.0:
            rub(rod_at(y, x_0, v_h, c)[1], h, c, m)
        outputs_at(y, c, t_0, h, x_0, v_h, x_ref, ref_rate, output_in_force(t_0 + h, m, c), m, out)
    return status
