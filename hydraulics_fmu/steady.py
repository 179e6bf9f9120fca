"""The state at rest from which every run starts: nothing moves until the command or the load does."""

from __future__ import annotations

from math import nan

import numpy as np

from ..core.jit import kernel
from ..core.sea import ATMOSPHERE
from .bordered import flow_of
from .constants import by_name
from .cylinder import EYE_STIFFNESS, outward_leaks, piston_leak
from .line import LAGS, mean_viscosity
from .moving_supply import hose_loss, pressure_at_rest, spilled
from .oil import viscosity
from .ports import port_flows
from .states import border, border_length, chain_length, further, lag_length, typical_flow

SMALLEST_OPENING = 1e-6
BEYOND = 2e9
"""Pressure [Pa] at which the search for a state gives a line up: more than any machine holds."""

SUPPLY_PASSES = 4
"""Times that the pressure of a supply that moves is found anew from what the valve takes at it."""


@kernel
def line_nodes(P_start: float, q: float, sign: float, c: object, nodes: object) -> None:
    """Write the n + 1 node pressures of a line that passes q [m3/s], from the end P_start [Pa]; sign -1 follows q."""
    n, line, law = len(nodes) - 1, c.line, c.effect.viscosity_law.share
    nodes[0] = P_start
    for j in range(n):
        P = nodes[j]
        for _ in range(50):
            if c.line.variable_viscosity != 0.0:
                eta = mean_viscosity(nodes[j], P, line.eta0, line.alpha, law)
            else:  # Eq. 21: the lower of the two port pressures, with equal losses of all segments
                eta = viscosity(min(P_start, P_start + n * (P - nodes[j])), line.eta0, line.alpha, law)
            P_next = min(max(nodes[j] + sign * c.line.resistance * eta * q, 0.0), BEYOND)
            if P_next == P:
                break
            P = P_next
        nodes[j + 1] = P


@kernel
def rest_lines(y: object, q_1: float, nodes_a: object, q_2: float, nodes_b: object) -> None:
    """Write the lines' states at rest: what each passes [m3/s], and its node pressures from the chamber on."""
    n = len(nodes_a) - 1
    for j in range(n):
        y[2 * j] = q_1
        y[2 * n - 1 + 2 * j] = q_2
        if j > 0:
            y[2 * j - 1] = nodes_a[n - j]
            y[2 * n - 2 + 2 * j] = nodes_b[j]


@kernel
def opening_for(q: float, Pa: float, Pb: float, Pt: float, given: float, c: object) -> float:
    """Spool position at which the valve takes q [m3/s] in at port b; an end of the stroke when it cannot."""
    low, high = -1.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle in (low, high):  # two neighbours among the numbers: it would stay there
            break
        if port_flows(middle, Pa, Pb, Pt, given, c)[1] < q:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def steady_state(
    constants: np.ndarray, F_hold: float, P_s: float = 0.0, P_r: float = 0.0
) -> tuple[np.ndarray, bool]:
    """State (ny,) at rest in which the pressures hold the force F_hold [N], and whether the supply does.

    P_s, P_r: pressures [Pa] of a supply from outside.

    A force that the supply cannot hold against the leakage is held by oil behind the closed valve, with the unloaded
    chamber at tank pressure; then the machine sinks as fast as the piston leaks.
    """
    c = by_name(constants)
    y = np.zeros(chain_length(c) + border_length(c) + lag_length(c))
    held = bool(come_to_rest(constants, F_hold, P_s, P_r, y))
    return y, held


@kernel
def balance(
    F_hold: float, Pt: float, P_top: float, given: float, c: object, nodes_a: object, nodes_b: object
) -> tuple[float, float, float, float, float]:
    """Write both lines' node pressures with which the force is held, as `come_to_rest` says, under a supply of P_top
    [Pa]; given: that, where the valve's flow does not lower it, else NaN.

    Returns what both lines pass [m3/s], the spool's position, its flow at port b, and what is left of the balance.
    """
    n, p_am, A_1, A_2 = len(nodes_a) - 1, c.sea.p_am, c.cylinder.area_1, c.cylinder.area_2
    low, high = Pt, P_top
    q_1, q_2, x_v, Q_b, surplus = 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(100):
        P_2 = 0.5 * (low + high)
        P_1 = p_am + (F_hold + (P_2 - p_am) * A_2) / A_1
        leak = piston_leak(P_1, P_2, c)
        out_1, out_2 = outward_leaks(P_1, P_2, c)
        q_1, q_2 = leak + out_1, leak - out_2
        line_nodes(P_1, q_1, 1.0, c, nodes_a)  # from the chamber back to port a
        line_nodes(P_2, q_2, -1.0, c, nodes_b)
        Pa, Pb = nodes_a[n], nodes_b[n]
        x_v = opening_for(q_2, Pa, Pb, Pt, given, c)
        if abs(x_v) < SMALLEST_OPENING:  # the valve shut: decide by its first opening
            x_v = SMALLEST_OPENING if q_2 >= 0.0 else -SMALLEST_OPENING
        Q_a, Q_b, _, _ = port_flows(x_v, Pa, Pb, Pt, given, c)
        surplus = Q_a - Q_b - (q_1 - q_2)
        if P_2 in (low, high):  # two neighbours among the numbers
            break
        if surplus > 0.0:
            low = P_2
        else:
            high = P_2
    return q_1, q_2, x_v, Q_b, surplus


@kernel
def come_to_rest(constants: object, F_hold: float, P_s: float, P_r: float, y: object) -> bool:
    """Write the state at rest into y (ny,), see `steady_state`; arrays alone, so that it is compiled with an FMU.

    The spool stands where its flow replaces the piston's leakage q, and the integral part of the controller holds it
    there, of a valve without null shift: what else the integral part has then is `controller.integral_start`. Unknown
    is P2: the force gives P1, q follows, Eq. 22 gives both lines' losses, and both lands must pass q at one opening.
    The difference of the lands' flows falls with P2, so bisection closes it.
    """
    c = by_name(constants)
    n, cylinder, compensator, p_am = int(c.line.segments), c.cylinder, c.compensator, c.sea.p_am
    A_1, A_2 = cylinder.area_1, cylinder.area_2
    x_c = compressed(c)
    Pt = p_am + compensator.k_c * (compensator.precompression - x_c) / compensator.area
    nodes_a, nodes_b = np.empty(n + 1), np.empty(n + 1)
    P_top, given = Pt + c.relief.p_set, nan
    if c.supply.from_outside != 0.0:
        Pt, P_top, given = P_r, P_s, P_s
    q_1, q_2, x_v, Q_b, surplus = balance(F_hold, Pt, P_top, given, c, nodes_a, nodes_b)
    for _ in range(SUPPLY_PASSES if c.supply.moves != 0.0 else 0):
        taken = port_flows(x_v, nodes_a[n], nodes_b[n], Pt, P_top, c)[2]
        P_top = Pt + pressure_at_rest(taken, c) - hose_loss(taken, P_top, c)
        q_1, q_2, x_v, Q_b, surplus = balance(F_hold, Pt, P_top, P_top, c, nodes_a, nodes_b)
    small = 1e-6 * typical_flow(c)
    held = abs(surplus) <= small and abs(Q_b - q_2) <= small
    if not held:
        q_1, q_2, x_v = 0.0, 0.0, 0.0
        P_2 = Pt if F_hold > 0.0 else p_am + ((Pt - p_am) * A_1 - F_hold) / A_2
        nodes_a[:] = p_am + (F_hold + (P_2 - p_am) * A_2) / A_1
        nodes_b[:] = P_2
    rest_lines(y, q_1, nodes_a, q_2, nodes_b)
    if abs(x_v) <= SMALLEST_OPENING:
        x_v = 0.0
    s = border(y, c)
    s.p_a, s.p_1, s.p_2, s.p_b, s.p_t = nodes_a[n], nodes_a[0], nodes_b[0], nodes_b[n], Pt
    s.x_c, s.v_c, s.spool, s.spool_rate = x_c, 0.0, x_v, 0.0
    s.integral = x_v * c.valve.i_rated + c.controller.integral_start
    rest_further(y, F_hold, P_top, c)
    return held


@kernel
def compressed(c: object) -> float:
    """How far [m] the compensator's piston has followed the air that the sea has compressed, up to its stop."""
    compensator = c.compensator
    if compensator.gas == 0.0:
        return 0.0
    x_c = compensator.gas * (1.0 / ATMOSPHERE - 1.0 / c.sea.p_am) / compensator.area
    return min(x_c, compensator.travel) if compensator.travel > 0.0 else x_c


@kernel
def rest_further(y: object, F_hold: float, P_p: float, c: object) -> None:
    """Write the states behind the first ones of the border at rest.

    A loose rod lies against its eye, which is at 0, half its clearance ahead; the controller, which has come to rest
    too, asks for no more than without it.
    """
    b, n, s = chain_length(c), int(c.line.segments), border(y, c)
    if c.states.lags != 0.0:
        for k in range(2 * n):
            y[b + border_length(c) + LAGS * k : b + border_length(c) + LAGS * (k + 1)] = y[flow_of(k, b)]
    if c.states.further == 0.0:
        return
    z, taken = further(y, c), port_flows(s.spool, s.p_a, s.p_b, s.p_t, P_p, c)[2]
    z.p_p, z.p_pump, z.Q_hose, z.Q_pump = P_p, P_p + hose_loss(taken, P_p, c), taken, taken
    if c.supply.lag > 0.0:
        z.Q_pump += spilled(y, z.p_pump, s.p_t, c)
    push = F_hold / EYE_STIFFNESS
    half = 0.5 * c.effect.joint_clearance.gap
    z.x_r = push + half if F_hold > 0.0 else push - half
    if c.cylinder.loose != 0.0:
        s.integral += c.controller.kp * c.sensor.gain * z.x_r
