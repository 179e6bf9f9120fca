"""A case of the benchmark: which machine, which runs, which channels, what is wrong with it and how strongly.

Everything is drawn from one random generator made of (seed, index), so a case is reproducible from these alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .effects import CATALOGUE, SENSORS, UNKNOWN, Effect
from .machine import Machine
from .measure import BIAS_SHARE, DELAY_MOST, Channel, draw_channels, ideal
from .plant import PlantError, simulate
from .refit import left_by_refit
from .system import KEYS

Array = NDArray[np.float64]

BASE = {
    "hydraulics.oil.nu0": "nu0",
    "hydraulics.oil.alpha": "alpha",
    "hydraulics.oil.beta": "beta",
    "hydraulics.cylinder.B_h": "cylinder_damping",
    "hydraulics.cylinder.c_l": "leakage",
    "hydraulics.valve.q_rated": "rated_flow",
    "hydraulics.line.length": "line_length",
    "hydraulics.relief.p_crack": "relief_pressure",
    "arm.C_D": "drag_coefficient",
    "arm.C_M": "inertia_coefficient",
    "arm.load_weight": "load_weight",
    "arm.beam_mass": "beam_mass",
}
"""Base parameters: SSP address and the plant's name."""

KINDS_OF_CASE = {"none": 0.2, "single": 0.4, "pair": 0.2, "unknown": 0.2}
SMALLEST, LARGEST = 0.3, 30.0
"""Range of the sizes that are aimed at, in noise floors."""
GRID = 1e-3
"""Time between the simulated points (s)."""


@dataclass(frozen=True)
class Conditions:
    """What is known of a run: conditions, its length (s) and its rate of sampling (1/s)."""

    depth: float
    load_weight: float
    current: float
    target: float
    t_start: float
    ramp_time: float
    hold_time: float
    stop: float
    rate: float

    @property
    def at(self) -> Array:
        """Times of the samples (s)."""
        return np.arange(int(self.stop * self.rate) + 1) / self.rate

    def parameters(self) -> dict[str, float]:
        """The known conditions by SSP address."""
        return {
            "depth": self.depth,
            "arm.load_weight": self.load_weight,
            "arm.current_speed": self.current,
            "hydraulics.command.target": self.target,
            "hydraulics.command.t_start": self.t_start,
            "hydraulics.command.ramp_time": self.ramp_time,
            "hydraulics.command.hold_time": self.hold_time,
        }

    def machine(self) -> Machine:
        """The plain machine in these conditions."""
        names = ("depth", "load_weight", "current", "target", "t_start", "ramp_time", "hold_time")
        return Machine(**{name: getattr(self, name) for name in names})


def draw_conditions(rng: np.random.Generator, rate: float) -> Conditions:
    """Conditions of a run; rounded, as a log of a test would give them."""
    depth = 0.0 if rng.random() < 0.12 else float(np.round(rng.uniform(0.0, 11000.0), -2))
    ramp = round(float(rng.uniform(3.5, 8.0)), 1)
    start = round(float(rng.uniform(1.0, 2.0)), 1)
    hold = round(float(rng.uniform(1.5, min(5.0, 22.5 - start - 2 * ramp))), 1)
    stop = min(24.0, max(18.0, start + 2 * ramp + hold + round(float(rng.uniform(1.0, 3.0)), 1)))
    return Conditions(
        depth,
        round(float(rng.uniform(500.0, 1000.0)), 0),
        round(float(rng.uniform(0.1, 0.9)), 2),
        round(float(rng.uniform(0.1, 0.2)), 3),
        start, ramp, hold, round(stop, 1), rate,
    )  # fmt: skip


@dataclass(frozen=True)
class Wrong:
    """An effect at work: knob and shapes, or for sensors the channel's error; its size in noise floors."""

    effect: Effect
    sign: float
    shapes: dict[str, float]
    amplitude: float
    column: str | None = None
    """Column of the sensor that errs; None: an effect of the machine."""
    size: float = np.nan
    """Whitened RMS of what it changes beyond the best refit of the base parameters within their tolerance."""
    size_linear: float = np.nan
    """The same beyond a linear refit, which overstates what is large and alike to a base parameter."""
    size_net: float = np.nan
    """The latter beyond sensors' own biases and the recording's delay, too."""
    wanted: float = np.nan

    @property
    def plant(self) -> dict[str, float]:
        """Parameters of the plant, or of the sensor."""
        return self.effect.plant(self.sign, self.amplitude, self.shapes)


@dataclass(frozen=True)
class Case:
    """All that makes a case; see `draw`."""

    seed: int
    index: int
    kind: str
    runs: tuple[Conditions, ...]
    channels: tuple[Channel, ...]
    delay: float
    tolerance: float
    factors: dict[str, float]
    noise_stated: bool
    wrong: tuple[Wrong, ...] = ()
    size_all: float = 0.0
    notes: list[str] = field(default_factory=list)


def machine_of(run: Conditions, factors: dict[str, float], wrong: tuple[Wrong, ...] = ()) -> Machine:
    """The machine in a run, with its true base parameters and effects."""
    m = run.machine()
    m = replace(m, **{BASE[address]: getattr(m, BASE[address]) * factor for address, factor in factors.items()})
    for w in wrong:
        if w.column is None:
            m = replace(m, **w.plant)
    return m


def span_of(run_signals: list[Array], channel: Channel) -> float:
    """Largest less smallest value of a channel over all runs (SI)."""
    k = KEYS.index(channel.kind.key)
    return max(s[:, k].max() for s in run_signals) - min(s[:, k].min() for s in run_signals)


def erring(channels: tuple[Channel, ...], wrong: tuple[Wrong, ...], spans: dict[str, float]) -> tuple[Channel, ...]:
    """The channels with the sensor effects in them; `spans` (SI) turn the bias from a share into a value."""
    result = []
    for channel in channels:
        error: dict[str, float] = {}
        for w in wrong:
            if w.column == channel.kind.key:
                error |= w.plant
                if "bias" in w.plant:
                    error["bias"] = w.plant["bias"] * spans[channel.kind.key]
        result.append(replace(channel, error=error))
    return tuple(result)


class Ruler:
    """Measures how much an effect changes the readings beyond what a refit of the base parameters takes up.

    The size is the root mean square, in noise floors, of what the best refit within the tolerances leaves (`refit`). To
    find an amplitude a linear one serves: the change of all readings, divided by each channel's noise, is projected off
    the sensitivities of the base parameters (finite differences of the plant) by ridge regression with their tolerances
    (uniform: standard deviation tolerance/sqrt 3).
    """

    def __init__(self, case: Case):
        self.case = case
        self.plain = self._signals(case.factors, ())
        self.spans = {c.kind.key: span_of(self.plain, c) for c in case.channels}
        self.reading = self._readings(self.plain, case.channels)
        columns = []
        for address in BASE:
            step = 0.5 * case.tolerance
            moved = {**case.factors, address: case.factors[address] + step}
            change = self._readings(self._signals(moved, ()), case.channels) - self.reading
            columns.append(change / (step / case.tolerance) / np.sqrt(3.0))
        self.base = np.column_stack(columns)
        self.net = np.column_stack([self.base, *self._nuisances()])

    def _signals(self, factors: dict[str, float], wrong: tuple[Wrong, ...]) -> list[Array]:
        return [
            simulate(machine_of(run, factors, wrong), np.arange(round(run.stop / GRID) + 1) * GRID)
            for run in self.case.runs
        ]

    def _readings(self, signals: list[Array], channels: tuple[Channel, ...], delay: float = 0.0) -> Array:
        parts = []
        for run, s in zip(self.case.runs, signals, strict=True):
            grid = np.arange(s.shape[0]) * GRID
            parts += [ideal(c, grid, s, run.at, delay) / c.std for c in channels]
        return np.concatenate(parts)

    def _nuisances(self) -> list[Array]:
        later = self._readings(self.plain, self.case.channels, DELAY_MOST) - self.reading
        columns = [later / np.sqrt(12.0)]
        for channel in self.case.channels:
            parts = []
            for run in self.case.runs:
                for other in self.case.channels:
                    value = BIAS_SHARE * other.kind.span / other.std if other is channel else 0.0
                    parts.append(np.full(run.at.size, value))
            columns.append(np.concatenate(parts))
        return columns

    def change(self, wrong: tuple[Wrong, ...]) -> Array:
        """Whitened change of all readings."""
        machine = any(w.column is None for w in wrong)
        signals = self._signals(self.case.factors, wrong) if machine else self.plain
        return self._readings(signals, erring(self.case.channels, wrong, self.spans)) - self.reading

    @staticmethod
    def beyond(change: Array, columns: Array) -> float:
        """Root mean square of what ridge regression on the columns, each of unit prior, leaves."""
        weights = np.linalg.solve(columns.T @ columns + np.eye(columns.shape[1]), columns.T @ change)
        return float(np.sqrt(np.mean((change - columns @ weights) ** 2)))

    def sizes(self, wrong: tuple[Wrong, ...]) -> tuple[float, float]:
        """Size beyond the base parameters, and beyond base parameters, biases and the common delay."""
        change = self.change(wrong)
        return max(self.beyond(change, self.base), 1e-9), self.beyond(change, self.net)

    def size(self, wrong: tuple[Wrong, ...], enough: float = 0.0) -> float:
        """What the best refit of the base parameters leaves; not looked for below `enough`."""
        return left_by_refit(
            lambda b: self._readings(self._signals(dict(zip(BASE, b.tolist(), strict=True)), ()), self.case.channels),
            self.reading + self.change(wrong),
            np.array([self.case.factors[address] for address in BASE]),
            self.case.tolerance,
            [(run.at.size, run.rate) for run in self.case.runs for _ in self.case.channels],
            enough,
        )

    def scaled(self, w: Wrong, wanted: float, tries: int = 4) -> Wrong | None:
        """The effect with its amplitude such that its linear size is about the wanted one, by a secant in logarithms.

        At the greatest amplitude allowed when more would be needed; None when even that cannot be seen.
        """
        most = w.effect.most(w.sign)
        amplitude, history = min(w.effect.usual, most), []
        best = None
        for _ in range(tries):
            try:
                size, net = self.sizes((replace(w, amplitude=amplitude),))
            except PlantError:
                most = min(most, 0.5 * amplitude)
                amplitude = 0.3 * amplitude
                continue
            now = replace(w, amplitude=amplitude, size_linear=size, size_net=net, wanted=wanted)
            history.append((np.log(amplitude), np.log(size)))
            if best is None or abs(np.log(size / wanted)) < abs(np.log(best.size_linear / wanted)):
                best = now
            if abs(np.log(size / wanted)) < 0.1 or (size < wanted and amplitude >= 0.999 * most):
                break
            slope = 1.0
            if len(history) > 1 and abs(history[-1][0] - history[-2][0]) > 1e-6:
                slope = (history[-1][1] - history[-2][1]) / (history[-1][0] - history[-2][0])
            slope = min(max(slope, 0.4), 3.0)
            amplitude = min(amplitude * np.exp((np.log(wanted) - np.log(size)) / slope), most)
        return best if best is not None and best.size_linear >= SMALLEST * 0.9 else None


def _pick(rng: np.random.Generator, pool: tuple[Effect, ...], channels: tuple[Channel, ...]) -> Wrong:
    effect = pool[int(rng.integers(len(pool)))]
    sign = effect.draw_sign(rng)
    column = None
    if effect in SENSORS:
        column = channels[int(rng.integers(len(channels)))].kind.key
    elif effect.knob == "wave":
        column = "x_h"
    return Wrong(effect, sign, effect.draw_shapes(rng), 0.0, column)


def _pool(kind: str) -> tuple[Effect, ...]:
    if kind == "unknown":
        return tuple(e for e in UNKNOWN if e.drawn)
    return (*CATALOGUE, *SENSORS)


def plan(seed: int, index: int) -> tuple[Case, np.random.Generator]:
    """The case of that index, still without anything wrong, and the generator to go on with."""
    rng = np.random.default_rng([seed, index])
    kind = str(rng.choice(list(KINDS_OF_CASE), p=list(KINDS_OF_CASE.values())))
    channels = draw_channels(rng)
    count = int(rng.choice([1, 2, 3, 4], p=[0.35, 0.25, 0.25, 0.15]))
    rate = float(rng.choice([50.0, 100.0, 200.0], p=[0.25, 0.5, 0.25]))
    runs = tuple(draw_conditions(rng, rate) for _ in range(count))
    tolerance = 0.05 if rng.random() < 0.7 else 0.10
    factors = {address: float(1.0 + rng.uniform(-tolerance, tolerance)) for address in BASE}
    delay, stated = float(rng.uniform(0.0, DELAY_MOST)), bool(rng.random() < 0.5)
    return Case(seed, index, kind, runs, channels, delay, tolerance, factors, stated), rng


def draw(seed: int, index: int, refit: bool = True) -> Case:
    """The case of that index; refit: sizes are what the best refit leaves, else, which takes no time, what a linear one
    does."""
    case, rng = plan(seed, index)
    needed = {"none": 0, "single": 1, "pair": 2, "unknown": 1}[case.kind]
    if needed == 0:
        return case
    ruler = Ruler(case)
    wrong: tuple[Wrong, ...] = ()
    for _ in range(40):
        wanted = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
        trial = _pick(rng, _pool(case.kind), case.channels)
        if any(trial.effect.group == w.effect.group for w in wrong):
            continue
        scaled = ruler.scaled(trial, wanted)
        if scaled is None:
            case.notes.append(f"{trial.effect.id} cannot be seen in this case")
            continue
        scaled = replace(scaled, size=ruler.size((scaled,), 0.9 * SMALLEST) if refit else scaled.size_linear)
        if scaled.size <= 0.9 * SMALLEST:
            case.notes.append(f"{trial.effect.id} is within the tolerance of the base parameters in this case")
            continue
        size = scaled.size_linear
        if wrong:
            try:
                size, _ = ruler.sizes((*wrong, scaled))
            except PlantError:
                case.notes.append(f"{trial.effect.id} stops the machine")
                continue
            if size > 10 * LARGEST:
                continue
        wrong = (*wrong, scaled)
        if len(wrong) == needed:
            return replace(case, wrong=wrong, size_all=size)
    raise PlantError(f"case {index} of seed {seed}: no effect could be made visible")
