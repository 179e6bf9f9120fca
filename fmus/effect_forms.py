"""Effects that a machine has and its model lacks, ready for an FMU script of your own.

One file that needs Python alone, so that it can go into an FMU: `cosim-fmus forms` puts it beside the script, which
imports it in one line and is built with it as a project file (docs/first-diagnosis.md).

    from effect_forms import Friction, add
    ...
    add(self, "rub", Friction(), "the slide rubs", F_c=0.3)         # in __init__: parameters rub.F_c, rub.F_s, ...
    force = drive - spring - self.rub.force(v)                      # in do_step

Each is exactly absent while its parameters are neutral, which they are at first: a force or a flow is then 0.0, a
signal passes unchanged. `add` makes their parameters those of the FMU. Where it is given the usual size of one, in the
FMU's unit, the FMU's model description says beside it what a catalogue of effects needs, and `cosim-gap effects FILE
--rows` writes effects.toml from it, as `cosim-gap new` does by itself.
"""

import json
from collections import deque
from collections.abc import Iterable
from math import exp, sqrt, tanh
from typing import Any, NamedTuple

MARK = "@effect "
"""Stands in a parameter's description before what the catalogue needs, as JSON."""

REACH = 20.0
"""Times its usual size that a parameter may be, or its neutral value, where that is a shape."""


class Parameter(NamedTuple):
    """A parameter of a form: attribute, meaning with its unit, and the effect that it makes."""

    name: str
    text: str
    effect: str
    """What of the form's effects: its name is put behind that of the form; "" for the form's own."""
    text_of_effect: str = ""
    group: str = "friction"
    shape_of: str = ""
    """The parameter without which this one does nothing; "" for one with an effect of its own."""


class Friction:
    """Friction that resists a velocity: dry, one that fades with speed (Stribeck), and viscous.

    (F_c + F_s exp(-|v| / v_s)) tanh(v / v_0) + b v. The sign turns within v_0 [m/s], which is no parameter: an explicit
    solver needs steps below 2 m v_0 / (F_c + F_s).
    """

    PARAMETERS = (
        Parameter("F_c", "dry friction [N]", "coulomb", "dry friction"),
        Parameter("F_s", "friction that fades with speed [N]", "stribeck", "more friction the slower it moves"),
        Parameter("v_s", "speed at which it has faded to 1/e [m/s]", "stribeck", shape_of="F_s"),
        Parameter("b", "viscous friction [N.s/m]", "viscous", "friction grows with speed"),
    )

    def __init__(self, v_s: float = 0.02, v_0: float = 1e-3):
        """v_s: to begin with [m/s]; v_0: speed within which the sign turns [m/s]."""
        self.F_c, self.F_s, self.v_s, self.b, self.v_0 = 0.0, 0.0, v_s, 0.0, v_0

    def force(self, v: float) -> float:
        """The force against a velocity [m/s]; subtract it."""
        if not (self.F_c or self.F_s or self.b):
            return 0.0
        dry = self.F_c + (self.F_s * exp(-abs(v) / self.v_s) if self.F_s else 0.0)
        return dry * tanh(v / self.v_0) + self.b * v


class Hysteresis:
    """Friction that gives way before it slides (Prandtl): a force up to F_h, turned round over a way of 2 x_h.

    It remembers the last position: ask it once a step.
    """

    PARAMETERS = (
        Parameter("F_h", "friction that gives way before it slides [N]", "", "it gives way before it slides"),
        Parameter("x_h", "way over which its force rises from 0 to that [m]", "", shape_of="F_h"),
    )

    def __init__(self, x_h: float = 1e-3):
        """x_h: to begin with [m]."""
        self.F_h, self.x_h = 0.0, x_h
        self.last: float | None = None
        self.now = 0.0

    def force(self, x: float) -> float:
        """The force against the motion to a position [m]; subtract it."""
        if not self.F_h:
            return 0.0
        moved = 0.0 if self.last is None else x - self.last
        self.last = x
        self.now = min(max(self.now + moved * self.F_h / self.x_h, -self.F_h), self.F_h)
        return self.now


class Play:
    """Play between what drives and what is driven, as of worn gears: the output rests while the input crosses `width`.

    It remembers where it stands: ask it once a step.
    """

    PARAMETERS = (Parameter("width", "play, from one side to the other", "", "play in the drive", "play"),)

    def __init__(self) -> None:
        self.width = 0.0
        self.at: float | None = None

    def __call__(self, x: float) -> float:
        """Where the driven side is while the driving side is at x; it begins in the middle of the play."""
        if not self.width:
            return x
        half = 0.5 * self.width
        self.at = x if self.at is None else min(max(self.at, x - half), x + half)
        return self.at


class DeadZone:
    """A zone to both sides of 0 in which a signal does nothing, as of a valve's overlapping lands."""

    PARAMETERS = (Parameter("half_width", "dead zone, to each side of 0", "", "small signals do nothing", "valve"),)

    def __init__(self) -> None:
        self.half_width = 0.0

    def __call__(self, x: float) -> float:
        """What is left of a signal."""
        if not self.half_width:
            return x
        return x - min(max(x, -self.half_width), self.half_width)


class Leakage:
    """Flow through a gap: laminar, and turbulent as through an orifice, with a smooth change of sign within p_0."""

    PARAMETERS = (
        Parameter("G", "laminar leakage [m3/(s.Pa)]", "laminar", "leakage in proportion to pressure", "leakage"),
        Parameter("K", "turbulent leakage [m3/(s.Pa0.5)]", "turbulent", "leakage as through an orifice", "leakage"),
    )

    def __init__(self, p_0: float = 1e3):
        """p_0: pressure difference within which the turbulent part changes its sign [Pa]."""
        self.G, self.K, self.p_0 = 0.0, 0.0, p_0

    def flow(self, p: float) -> float:
        """The flow [m3/s] that a pressure difference [Pa] drives through the gap."""
        if not (self.G or self.K):
            return 0.0
        turbulent = self.K * p / sqrt(sqrt(p * p + self.p_0 * self.p_0)) if self.K else 0.0
        return self.G * p + turbulent


class Delay:
    """A signal that comes late by `time`, joined by straight lines between the moments at which it was given."""

    PARAMETERS = (Parameter("time", "delay [s]", "", "it comes late", "timing"),)

    def __init__(self) -> None:
        self.time = 0.0
        self.past: deque[tuple[float, float]] = deque()

    def __call__(self, t: float, x: float) -> float:
        """The signal as it was `time` ago, of one that is x at t [s]; before the first moment it was as then."""
        if not self.time:
            return x
        if self.past and t <= self.past[-1][0]:  # asked again
            self.past.pop()
        self.past.append((t, x))
        wanted = t - self.time
        while len(self.past) > 2 and self.past[1][0] <= wanted:
            self.past.popleft()
        (t_0, x_0), (t_1, x_1) = self.past[0], self.past[min(1, len(self.past) - 1)]
        if wanted <= t_0 or t_1 == t_0:
            return x_0
        return x_0 + (x_1 - x_0) * min((wanted - t_0) / (t_1 - t_0), 1.0)


def add(slave: Any, name: str, form: Any, text: str = "", **sizes: float) -> Any:
    """Make a form the attribute `name` of an FMU of pythonfmu, and its parameters those of the FMU; returns the form.

    text: the effect in a sentence for people. sizes: the usual size of parameters, in the FMU's unit; those that have
    one are effects of the catalogue. Raises `ValueError` for a size that is not positive or of no parameter.
    """
    from pythonfmu import Fmi2Causality, Fmi2Variability, Real

    known = [p.name for p in form.PARAMETERS if not p.shape_of]
    for key, size in sizes.items():
        if key not in known or not size > 0.0:
            raise ValueError(f"{name}: {key} = {size!r}: a usual size is a positive number of {', '.join(known)}")
    setattr(slave, name, form)
    for p in form.PARAMETERS:
        said = _said(name, form, p, text, sizes)
        description = p.text if said is None else f"{p.text} {MARK}{json.dumps(said)}"
        slave.register_variable(
            Real(
                f"{name}.{p.name}", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed,
                description=description,
            )
        )  # fmt: skip
    return form


def _said(name: str, form: Any, p: Parameter, text: str, sizes: dict[str, float]) -> dict[str, Any] | None:
    """What a catalogue needs of a parameter; None where no usual size says that it is to be in one."""
    if (p.shape_of or p.name) not in sizes:
        return None
    neutral = getattr(form, p.name)
    main = next(q for q in form.PARAMETERS if q.name == (p.shape_of or p.name))
    id = f"{name}_{p.effect}" if p.effect and len(_effects(form.PARAMETERS)) > 1 else name
    about = ": ".join(part for part in (text, main.text_of_effect) if part)
    said = {"id": id, "text": about, "group": main.group, "neutral": neutral}
    if p.shape_of:
        starts = [_short(neutral * k) for k in (0.3, 1.0, 3.0)]
        return {**said, "bounds": [_short(neutral / REACH), _short(neutral * REACH)], "prior": neutral, "shape": True,
                "starts": starts}  # fmt: skip
    return {**said, "bounds": [0.0, _short(REACH * sizes[p.name])], "prior": sizes[p.name]}


def _effects(parameters: Iterable[Parameter]) -> set[str]:
    return {p.effect for p in parameters}


def _short(x: float) -> float:
    return float(f"{x:.6g}")
