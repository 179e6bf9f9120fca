"""What the paper claims, and whether it holds here: numbers within a stated tolerance, statements as inequalities.

A claim that does not hold has to be explained; so has one that holds only because something was fitted to it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..table1 import Result
from .cases import CONSTANT, DEEPEST, DEPTHS, FIGURES, RAMP, SLOWER, T_DOWN, T_START, TIMES, VISCOSITY
from .choices import NAMES, OURS, Choices, number, others
from .lines import STEADY, Lines
from .runs import Run, Runs

NUMBER, LOSS, DIFFERENCE, PRINTED = 0.01, 0.05, 0.15, 2e-4
"""Relative tolerances where the paper gives a number: of a time, of a line's loss (the paper's own), of a small
difference of two times, and of a formula's printed value. What else a verdict needs stands in `choices`."""

RELIEF = 20.0
"""Pressure of the relief valve [MPa]."""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper with what it is here.

    chosen: the names of the thresholds and instants in `choices` that the verdict needs and the paper does not give.
    `claims` tells what they are in `assumed`, empty where the paper gives all, and in `otherwise` with which other
    values of them the verdict would be another one.
    """

    where: str
    text: str
    published: str
    ours: str
    holds: bool
    remark: str = ""
    chosen: tuple[str, ...] = ()
    assumed: str = ""
    otherwise: str = ""


FITTED = (
    "the linkage, which the paper does not give, was fitted to the four times (docs/calibration.md), with the valve's "
    "laminar transition"
)


def claims(table: Sequence[Result], lines: Lines, runs: Runs) -> list[Claim]:
    """Every claim of the paper's sections 4 and 5, with what is assumed; see `Claim`."""
    with_ours = judged(table, lines, runs, OURS)
    told: list[list[str]] = [[] for _ in with_ours]
    for name, value, choices in others(NAMES):
        for claim, other, words in zip(with_ours, judged(table, lines, runs, choices), told, strict=True):
            if other.holds != claim.holds:
                words.append(f"{'fails' if claim.holds else 'holds'} with {number(name, value)} instead of "
                             f"{number(name, getattr(OURS, name))}")  # fmt: skip
    return [
        replace(claim, assumed=OURS.words(claim.chosen), otherwise="; ".join(words))
        for claim, words in zip(with_ours, told, strict=True)
    ]


def judged(table: Sequence[Result], lines: Lines, runs: Runs, choices: Choices) -> list[Claim]:
    """Every claim as it is with these choices."""
    parts = (_depths, _cause, _parameters, _inputs, _loads)
    seen = runs.chosen(choices)
    return [*_table(table), *_lines(lines, choices), *(claim for part in parts for claim in part(seen))]


def summary(found: Sequence[Claim]) -> str:
    """How many hold and how many of these rest on a choice of ours, one sentence each."""
    held = [c for c in found if c.holds]
    resting, turned = [c for c in held if c.assumed], [c for c in held if c.otherwise]
    gained = [c for c in found if c.otherwise and not c.holds]
    more = f", and {len(gained)} more would hold" if gained else ""
    return (
        f"{len(held)} of {len(found)} claims hold. {len(resting)} of the {len(held)} rest on a threshold or an instant "
        f"that the paper does not give and we assumed (marked *); with about half or double of one of these, or an "
        f"instant 0.5 s off, {len(turned)} of them would fail{more}."
    )


def _number(
    where: str, text: str, published: float, ours: float, unit: str, within: float, remark: str = "",
    chosen: tuple[str, ...] = (),
) -> Claim:  # fmt: skip
    off = ours / published - 1.0
    here = f"{ours:.5g} {unit} ({100 * off:+.2f} %)"
    return Claim(where, text, f"{published:g} {unit}", here, abs(off) <= within, remark, chosen)


def _table(table: Sequence[Result]) -> Iterator[Claim]:
    where = "Table 1"
    right = [r for r in table if abs(r.row.eq22 / 1e6 / r.row.theoretical - 1.0) <= PRINTED]
    yield Claim(where, "the theoretical losses are those of Eq. 22", f"{len(table)} rows", f"{len(right)} rows",
                all(r in right or r.row.misprint for r in table), "the others are misprints, see below")  # fmt: skip
    for r in table:
        if r.row.misprint:
            remark = "a misprint: no value of the formula, see docs/errata.md"
            yield _number(f"{where}, {r.row.label}", "theoretical loss", r.row.theoretical, r.row.eq22 / 1e6, "MPa",
                          PRINTED, remark)  # fmt: skip
            told = "a misprint, too: the paper's own formula is as far away" if r.row.simulated_misprint else ""
            yield _number(f"{where}, {r.row.label}", "simulated loss", r.row.simulated, r.dynamic / 1e6, "MPa",
                          LOSS, told)  # fmt: skip
    worst = max(abs(r.dynamic / r.row.eq22 - 1.0) for r in table)
    beyond = [r.row for r in table if abs(r.row.simulated / r.row.theoretical - 1.0) > LOSS]
    own = ", ".join(f"{r.label} {100 * (r.simulated / r.theoretical - 1.0):+.1f} %" for r in beyond)
    yield Claim(where, "the dynamic line ends within 5 % of the theoretical loss", "5 %",
                f"{100 * worst:.3f} % at most", worst <= LOSS,
                f"the paper's own numbers, as printed, are further apart in {own}" if own else "")  # fmt: skip
    right = [r for r in table if not r.row.misprint]
    off = max(right, key=lambda r: abs(r.dynamic / 1e6 / r.row.simulated - 1.0), default=None)
    if off is not None:
        far = off.dynamic / 1e6 / off.row.simulated - 1.0
        yield Claim(where, "the simulated losses, in the rows without a misprint", f"{len(right)} values",
                    f"all within {100 * abs(far):.1f} % ({off.row.label})", abs(far) <= LOSS)  # fmt: skip


def _lines(lines: Lines, choices: Choices = OURS) -> Iterator[Claim]:
    where = "Figure 8"
    apart = {km: lines.steady(km, True) / lines.steady(km, False) - 1.0 for km in lines.depths}
    shallow, deep = [km for km in apart if km <= 3], [km for km in apart if km >= 6]
    told = ", ".join(f"{100 * apart[km]:.1f} % at {km:g} km" for km in apart)
    yield Claim(where, "variable and constant viscosity lose about the same at 3 km and less", "coincide", told,
                all(abs(apart[km]) <= choices.visible for km in shallow), chosen=("visible",))  # fmt: skip
    yield Claim(where, "they differ from 6 km on, the more the deeper", "differ", told,
                all(apart[km] > choices.visible for km in deep) and _rising([apart[km] for km in deep]),
                chosen=("visible",))  # fmt: skip
    distance = {km: lines.apart(km, choices.window) for km in lines.depths}
    told = ", ".join(f"{100 * distance[km]:.1f} % at {km:g} km" for km in distance)
    yield Claim(where, "so do the dynamic responses: alike at 3 km and less, from 6 km on the less the deeper",
                "differ", f"{told} (RMS of the first {1e3 * choices.window:g} ms)",
                all(distance[km] <= choices.responds for km in shallow)
                and all(distance[km] > choices.responds for km in deep) and _rising([distance[km] for km in deep]),
                "at 0 km up to where the oil in the line tears; what follows is shifted by milliseconds",
                ("responds", "window"))  # fmt: skip
    yield _number(where, "variable viscosity loses more at 11 km by", 8.22, 100 * apart[11], "%", DIFFERENCE)
    for variable, loss in STEADY.items():
        ours = lines.steady(11, variable) / 1e6
        yield _number(where, f"steady loss at 11 km, {VISCOSITY[variable]} viscosity", loss, ours, "MPa", LOSS)


def _depths(runs: Runs) -> Iterator[Claim]:
    where = "Figure 9"
    by_km = runs.of(DEPTHS)
    shallow, deep = by_km[:10], by_km[10:]
    worst = max(shallow, key=lambda r: r.extension)
    yield Claim(where, "no delay at 9 km and less", "5 s", f"at most {worst.extension:.2f} s out, "
                f"{max(r.retraction for r in shallow):.2f} s in", all(r.on_time for r in shallow),
                chosen=("late", "done"))  # fmt: skip
    lag = [r.lag / r.target for r in shallow]
    full = shallow[9].full(runs.choices.full)
    follows = max(lag) <= runs.choices.follows
    yield Claim(where, "the displacement is consistent with the command at 9 km and less", "consistent",
                ", ".join(f"{1e3 * r.lag:.1f} mm off at {k} km" for k, r in enumerate(shallow) if k in (3, 6, 8, 9)),
                follows, "" if follows else f"at 9 km the valve is full open for {100 * full:.0f} % of the ramp: "
                "the lands' laminar transition takes flow that the printed equations leave; it lags on the way and "
                "arrives in time", ("follows",))  # fmt: skip
    yield Claim(where, "delay from 10 km on, the deeper the more", "delayed", _times(deep),
                all(not r.on_time for r in deep) and _rising([r.extension for r in deep])
                and _rising([r.retraction for r in deep]), chosen=("late", "done"))  # fmt: skip
    eleven, constant = runs[DEEPEST], runs[CONSTANT]
    done = ("done",)
    out, back = TIMES[True]
    yield _number(where, "extension at 11 km", out, eleven.extension, "s", NUMBER, FITTED, done)
    yield _number(where, "retraction at 11 km", back, eleven.retraction, "s", NUMBER, FITTED, done)
    for text, published, time in (("extension", 52.50, eleven.extension), ("retraction", 43.12, eleven.retraction)):
        yield _number(where, f"{text} is delayed by", published, 100 * (time / RAMP - 1), "%", 3 * NUMBER, FITTED, done)
    out, back = TIMES[False]
    yield _number(where, "extension at 11 km, constant viscosity", out, constant.extension, "s", NUMBER, FITTED, done)
    yield _number(where, "retraction at 11 km, constant viscosity", back, constant.retraction, "s", NUMBER, FITTED,
                  done)  # fmt: skip
    gained = eleven.extension - constant.extension, eleven.retraction - constant.retraction
    yield _number(where, "constant viscosity extends faster by", 0.447, gained[0], "s", DIFFERENCE, chosen=done)
    yield _number(where, "constant viscosity retracts faster by", 0.377, gained[1], "s", DIFFERENCE, chosen=done)


def _cause(runs: Runs) -> Iterator[Claim]:
    by_km = runs.of(DEPTHS)
    for k, line in enumerate(("a-1", "2-b")):
        loss = [r.losses[k] / 1e6 for r in by_km]
        rise = [b - a for a, b in pairwise(loss)]
        yield Claim("Figure 11", f"loss of line {line} in mid-extension rises with depth", "rises",
                    f"{loss[0]:.2f} to {loss[-1]:.2f} MPa", _rising(loss), chosen=("mid",))  # fmt: skip
        yield Claim("Figure 11", f"loss of line {line} rises more slowly beyond 9 km", "slows down",
                    f"{rise[8]:.2f} MPa from 8 to 9 km, {rise[9]:.2f} and {rise[10]:.2f} MPa beyond",
                    max(rise[9], rise[10]) < rise[8], chosen=("mid",))  # fmt: skip
    supply = [(r.at("Pp") - r.at("Pt")) / 1e6 for r in by_km]
    yield _number("Section 4.2", "the pump's pressure is that of the relief valve, above the tank's",
                  20.0, max(supply, key=lambda p: abs(p - 20.0)), "MPa", NUMBER, chosen=("mid",))  # fmt: skip
    gap = [(r.at("Pp") - r.at("Pa")) / 1e6 for r in by_km]
    spool = [r.at("x_v") for r in by_km]
    full = runs.choices.full
    yield Claim("Figure 12", "pressure difference from p to a falls with depth", "falls",
                f"{gap[0]:.2f} to {gap[-1]:.2f} MPa", _rising([-g for g in gap]), chosen=("mid",))  # fmt: skip
    yield Claim("Figure 12", "the spool opens more the deeper, to 100 % at 10 km and beyond", "100 % from 10 km",
                ", ".join(f"{100 * s:.1f} % at {k} km" for k, s in enumerate(spool) if k >= 6),
                _rising(spool[:10]) and min(spool[10:]) > full and spool[9] <= full,
                "" if spool[9] <= full else "full at 9 km already, with the lands' laminar transition; the page of the "
                "equations as printed has it below", ("full", "mid"))  # fmt: skip
    speed = [1e3 * r.at("v_h") for r in by_km]
    steady = runs.choices.steady
    way = 1e3 * by_km[9]["v_h"][(by_km[9].t > T_START + 1.0) & (by_km[9].t < T_START + RAMP - 0.2)]
    yield Claim("Figure 12", "40 mm/s down to 9 km, less at 10 km and beyond", "40 mm/s",
                ", ".join(f"{v:.1f} mm/s at {k} km" for k, v in enumerate(speed) if k >= 8),
                all(abs(v / 40.0 - 1.0) < steady for v in speed[:10]) and 40.0 * (1.0 - steady) > speed[10] > speed[11],
                "" if np.ptp(way) < 2.0 else f"at 9 km in passing: {way.min():.0f} to {way.max():.0f} mm/s on the "
                "way", ("steady", "mid"))  # fmt: skip
    back = T_DOWN + runs.choices.mid
    over = [(r.at("Pp", back) - r.at("Pb", back)) / 1e6 for r in by_km]
    spool = [-r.at("x_v", back) for r in by_km]
    yield Claim("Section 4.2", "the delay of the retraction has the same cause", "similar",
                f"p to b {over[0]:.2f} to {over[-1]:.2f} MPa; spool "
                + ", ".join(f"{100 * s:.1f} % at {k} km" for k, s in enumerate(spool) if k >= 8),
                _rising([-x for x in over]) and min(spool[10:]) > runs.choices.full,
                chosen=("full", "mid"))  # fmt: skip


def _parameters(runs: Runs) -> Iterator[Claim]:
    yield from _monotonic(runs, 13, "the greater alpha, the longer the delay", 1.0)
    yield from _none(runs, 13, "no delay for alpha up to 1.8e-8 1/Pa", lambda v: v < 1.81e-8, "hydraulics.oil.alpha")
    yield from _monotonic(runs, 14, "the greater nu0, the longer the delay", 1.0)
    yield from _none(runs, 14, "no delay at 10 cSt", lambda v: v < 10.1e-6, "hydraulics.oil.nu0")
    yield from _monotonic(runs, 15, "the longer the lines, the longer the delay", 1.0)
    yield from _none(runs, 15, "no delay with 2 m", lambda v: v <= 2.0, "hydraulics.line.length")
    yield from _monotonic(runs, 16, "the wider the lines, the shorter the delay", -1.0)
    wide = runs.of(FIGURES[16][1])
    steps = [a.behind - b.behind for a, b in pairwise(wide)]
    yield Claim("Figure 16", "as little as 0.5 mm of diameter matters greatly", "greatly",
                "; ".join(f"{a.case.label} to {b.case.label}: {_gain(a, b)}" for a, b in pairwise(wide)),
                all(gain > runs.choices.greatly * RAMP for gain in steps[:-1]),
                chosen=("greatly", "done", "curves"))  # fmt: skip
    yield from _none(runs, 16, "no delay with 5 mm", lambda v: v >= 5e-3, "hydraulics.line.diameter")
    yield from _monotonic(runs, 17, "the smaller the valve, the longer the delay", -1.0)
    _, five, ten, *more = runs.of(FIGURES[17][1])
    gained = five.extension - ten.extension
    yield Claim("Figure 17", "little gain beyond 10 L/min", "no longer obvious",
                f"{gained:.2f} s from 5 to 10 L/min, {ten.extension - more[-1].extension:.2f} s from 10 to 40 L/min",
                ten.extension - more[-1].extension < runs.choices.little * gained,
                chosen=("little", "done", "curves"))  # fmt: skip
    larger = (five, ten, *more)
    lost = [sum(r.losses) / 1e6 for r in larger]
    left = [(r.at("Pp") - r.at("Pa")) / 1e6 for r in larger]
    yield Claim("Figure 17", "for the lines' loss is not less, and the valve's pressure difference still very small",
                "not less; very small",
                "; ".join(f"{r.case.label}: lines {a:.1f} MPa, p to a {b:.2f} MPa"
                          for r, a, b in zip(larger, lost, left, strict=True)),
                all(a >= lost[0] for a in lost) and all(b <= runs.choices.small * RELIEF for b in left)
                and _rising([-b for b in left]), chosen=("small", "mid", "curves"))  # fmt: skip
    yield from _monotonic(runs, 18, "the higher the relief pressure, the shorter the delay", -1.0)
    relief = runs.of(FIGURES[18][1])
    wasted = [r.overflow / 1e3 for r in relief]
    yield Claim("Figure 18", "the higher it is, the more energy is lost by the overflow", "more",
                "; ".join(f"{r.case.label}: {e:.1f} kJ" for r, e in zip(relief, wasted, strict=True)),
                _rising(wasted), chosen=("curves",))  # fmt: skip


def _inputs(runs: Runs) -> Iterator[Claim]:
    hundred, *late = runs.of(FIGURES[19][1])
    yield Claim("Figure 19", "no delay for 100 mm, delay for 150, 200 and 220 mm", "delay",
                _times([hundred, *late]), hundred.on_time and not any(r.on_time for r in late),
                chosen=("late", "done"))  # fmt: skip
    spool = [r.at("x_v") for r in (hundred, *late)]
    yield Claim("Figure 19", "the valve is full open where it is late, and not for 100 mm", "full open",
                ", ".join(f"{100 * s:.0f} %" for s in spool), spool[0] < runs.choices.full < min(spool[1:]),
                chosen=("full", "mid"))  # fmt: skip
    together = _apart_out(late)
    yield Claim("Figure 19", "150, 200 and 220 mm coincide while extending", "coincide",
                f"within {1e3 * together:.2f} mm until the first arrives", together < runs.choices.coincide,
                chosen=("coincide",))  # fmt: skip
    slopes = {x: [_slope_in(r, 1e-3 * x) for r in late] for x in (130, 120, 110)}
    parallel = max((max(s) - min(s)) / max(s) for s in slopes.values()) < runs.choices.parallel
    yield Claim("Figure 19", "they run parallel while retracting", "parallel",
                "; ".join(f"{', '.join(f'{1e3 * v:.1f}' for v in s)} mm/s at {x} mm" for x, s in slopes.items()),
                parallel, "on the way that all three make; 150 mm catch up below 100 mm" if parallel else "",
                ("parallel",))  # fmt: skip
    slower = runs[SLOWER]
    yield Claim("Section 4.3.2", "a command that changes more slowly removes the delay", "removes",
                f"{slower.case.label}: {slower.extension:.2f} s", slower.extension <= 2 * RAMP + runs.choices.late,
                chosen=("late", "done", "slower"))  # fmt: skip
    for k, text, more in ((20, "a heavier load", "heavier"), (21, "a more positive current", "more positive")):
        found = runs.of(FIGURES[k][1])
        ordered = _rising([r.extension for r in found]) and _rising([-r.retraction for r in found])
        yield Claim(f"Figure {k}", f"{text} delays the extension more, the retraction less", f"the {more}, the more",
                    _times(found), ordered, chosen=("done", "curves"))  # fmt: skip


def _loads(runs: Runs) -> Iterator[Claim]:
    rest = [[1e-6 * (r.at(p, T_START) - r.at("Pt", T_START)) for p in ("P1", "P2")] for r in runs.of(DEPTHS)]
    ambient = 1e-6 * (runs[DEEPEST].at("Pt", T_START) - runs.of(DEPTHS)[0].at("Pt", T_START))
    spread = max(np.ptp(chamber) for chamber in np.transpose(rest))
    yield Claim("Section 4.3.2", "the ambient pressure's load is balanced and needs no attention", "balanced",
                f"at rest P1 and P2 are {rest[0][0]:.2f} and {rest[0][1]:.2f} MPa above the tank at 0 km, "
                f"{rest[-1][0]:.2f} and {rest[-1][1]:.2f} MPa at 11 km, where that is {ambient:.0f} MPa deeper",
                bool(spread < runs.choices.balanced * ambient), chosen=("balanced",))  # fmt: skip
    by_speed = {float(r.case.parameters["arm.current_speed"]): r for r in runs.of(FIGURES[21][1])}
    steady = {u: abs(by_speed[u].at("M_hd")) for u in (0.0, 0.5)}
    mean = {u: float(np.sqrt((by_speed[u]["M_hd"] ** 2).mean())) for u in (0.0, 0.5)}
    much = runs.choices.much
    yield Claim("Section 4.3.2", "the arm's own motion loads it much less than the current does", "much smaller",
                f"moving steadily {steady[0.0]:.1f} Nm without a current, {steady[0.5]:.0f} Nm with 0.5 m/s; "
                f"{mean[0.0]:.1f} and {mean[0.5]:.0f} Nm RMS over the run",
                max(steady[0.0] / steady[0.5], mean[0.0] / mean[0.5]) < much,
                "" if mean[0.0] < much * mean[0.5] else "while the arm starts and stops the water's inertia "
                "loads it as much as the current does; moving steadily the claim holds", ("much", "mid"))  # fmt: skip


def _gain(slow: Run, fast: Run) -> str:
    return f"{slow.extension - fast.extension:.2f} s" if slow.arrives else "arrives at all"


def _monotonic(runs: Runs, figure: int, text: str, sign: float) -> Iterator[Claim]:
    found = runs.of(FIGURES[figure][1])
    late = [r for r in found if not r.on_time]
    fast = [r for r in found if r.on_time]
    ordered = len(late) > 1 and _rising([sign * r.behind for r in late])
    ordered = ordered and _rising([sign * r.retraction for r in late if r.arrives])
    apart = all(f.behind < slow.behind for f in fast for slow in late)
    remark = "" if all(r.arrives for r in late) else "where it never arrives it goes back from less far"
    yield Claim(f"Figure {figure}", text, "monotonic", _times(found), ordered and apart, remark,
                ("late", "done", "curves"))  # fmt: skip


def _none(runs: Runs, figure: int, text: str, chosen: Callable[[float], bool], name: str) -> Iterator[Claim]:
    found = [r for r in runs.of(FIGURES[figure][1]) if chosen(float(r.case.parameters[name]))]
    yield Claim(f"Figure {figure}", text, "5 s", _times(found), all(r.on_time for r in found),
                chosen=("late", "done"))  # fmt: skip


def _times(runs: Sequence[Run]) -> str:
    return "; ".join(f"{r.case.label}: {_time(r)} / {r.retraction:.2f} s" for r in runs)


def _time(run: Run) -> str:
    if run.arrives:
        return f"{run.extension:.2f}"
    return f"never, up to {1e3 * float(run['x_h'].max()):.0f} mm"


def _rising(values: Sequence[float]) -> bool:
    return all(a < b for a, b in pairwise(values))


def _apart_out(runs: Sequence[Run]) -> float:
    """Greatest distance [m] of the displacements while all extend, until the shortest is near its target."""
    shortest = min(runs, key=lambda r: r.target)
    near = shortest["x_h"] >= 0.97 * shortest.target
    until = int(near.argmax()) if near.any() else int(shortest.t.searchsorted(T_DOWN))
    rows = [r["x_h"][:until] for r in runs]
    return float(max(abs(a - b).max() for a, b in pairwise(rows)))


def _slope_in(run: Run, x: float) -> float:
    """Speed [m/s] of the retraction when it passes x [m]."""
    begin = int(run.t.searchsorted(T_DOWN))
    k = begin + int((run["x_h"][begin:] < x).argmax())
    return float(-run["v_h"][k])
