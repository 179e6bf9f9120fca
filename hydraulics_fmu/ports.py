"""Flows through the four ports of the servo valve, whose supply the pump limits."""

from __future__ import annotations

from ..core.jit import kernel
from .oil import gap_flow
from .supply import demanded, limited_by_pump, port_pressure, relief_pressure, return_pressure
from .valve import land, land_of, metered, supplied_opening


@kernel
def port_flows(
    x_v: float, Pa: float, Pb: float, Pt: float, P_given: float, c: object
) -> tuple[float, float, float, float]:
    """Flows Q_a, Q_b of the valve's ports (Eqs. 8, 9), Q_p taken from the supply and Q_t given to the tank [m3/s].

    What the supplied land and the leakage take is limited by the pump, unless a pressure at port p is given (`P_given`
    not NaN). Leakage past the lands flows from p to both ports and from both ports to t.
    """
    s, overlap, leak = supplied_opening(x_v, c), c.valve.overlap, c.valve.leak
    a_t, b_t = c.valve.retraction * land_of(-x_v, overlap.at, c), land_of(x_v, overlap.bt, c)
    if x_v >= 0.0:
        b_t = metered(b_t, x_v, c)
    else:
        a_t = metered(a_t, x_v, c)
    P_t = return_pressure(a_t, b_t, Pa, Pb, Pt, c)
    Q_at = land(a_t, Pa, P_t, c) if a_t > 0.0 else 0.0
    Q_bt = land(b_t, Pb, P_t, c) if b_t > 0.0 else 0.0
    P_p, port = P_given, Pa if s >= 0.0 else Pb
    if P_given == P_given:
        Q_p = land(abs(s), P_p, port, c)
    else:
        P_p = relief_pressure(s, Pa, Pb, Pt, c)
        if leak.pa + leak.pb > 0.0 and demanded(P_p, s, Pa, Pb, c) > c.pump.flow:
            P_p = port_pressure(x_v, Pa, Pb, Pt, c)
            Q_p = land(abs(s), P_p, port, c)
        else:
            Q_p = limited_by_pump(land(abs(s), P_p, port, c), c.pump.flow)
    Q_t = Q_at + Q_bt
    Q_a, Q_b = (Q_p - Q_at, Q_bt) if s >= 0.0 else (-Q_at, Q_bt - Q_p)
    if leak.pa + leak.at + leak.pb + leak.bt > 0.0:
        bent, thinner = c.effect.valve_leakage.turbulent, c.oil.thinner
        pa, at = gap_flow(P_p - Pa, leak.pa, bent, thinner), gap_flow(Pa - Pt, leak.at, bent, thinner)
        pb, bt = gap_flow(P_p - Pb, leak.pb, bent, thinner), gap_flow(Pb - Pt, leak.bt, bent, thinner)
        Q_a += pa - at
        Q_b -= pb - bt
        Q_p += pa + pb
        Q_t += at + bt
    return Q_a, Q_b, Q_p, Q_t
