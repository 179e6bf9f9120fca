"""Least squares of chosen effects on a campaign, apart from cosim-gap: what can its answer be expected to be?

    python -m benchmarks.real.check FOLDER/NAME/campaign.toml [EFFECT[+EFFECT...] ...]

Base parameters move within their tolerances in every row, and so does each run's clock where a channel states
`clock_jitter`. Prints RMS on the held-out runs, over all channels in noise_std and per channel in the unit of the FMU,
and the parameters found. Without effects, every single one is tried.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.gap.campaign import read as reader
from deepsea_cosim.gap.campaign.catalogue import Parameter, SensorEffect
from deepsea_cosim.gap.campaign.read_catalogue import load_from_package
from deepsea_cosim.gap.problem.noise import estimate_channel_noise
from deepsea_cosim.gap.problem.sensors import Sensor
from deepsea_cosim.gap.settings import NoiseSettings
from deepsea_cosim.master.simulation.session import Session
from scipy.optimize import least_squares

REACH, SD = 1.0, 0.6
"""How far a base parameter may go, and the standard deviation of its prior, in tolerances."""

CLOCK = 1e-3
"""Usual error of a run's clock [s], where a channel states `clock_jitter`: the most that the tool allows for."""


class Problem:
    """A campaign with its package loaded; unknowns count in tolerances (base) or usual sizes (effects)."""

    def __init__(self, path: Path, session: Session):
        self.campaign = reader.read(path)
        self.session = session
        self.catalogue = load_from_package(self.campaign.system)
        self.outputs = [c.connector for c in self.campaign.outputs]
        self.base = {b.parameter: b.tolerance for b in self.catalogue.base}
        self.start = session.values()
        self.noise, self.span = {}, {}
        for c in self.campaign.outputs:
            series = [r.series[c.connector][1] for r in self.campaign.runs if c.connector in r.series]
            estimated = [estimate_channel_noise(y, NoiseSettings()) for y in series]
            self.noise[c.connector] = c.noise_std or float(np.median(estimated))
            self.span[c.connector] = float(np.ptp(np.concatenate(series)))
        self.jitter = {c.connector: c.clock_jitter for c in self.campaign.outputs if c.clock_jitter is not None}

    def parameters(self, name: str) -> tuple[Parameter | SensorEffect, ...]:
        """Of an effect, or of a sensor's effect written as id(connector)."""
        if effect := self.catalogue.effect(name):
            return effect.parameters
        return (next(s for s in self.catalogue.sensors if s.id == name.partition("(")[0]),)

    def singles(self) -> list[str]:
        """Every single effect."""
        sensors = [f"{s.id}({c})" for s in self.catalogue.sensors for c in self.outputs]
        return [e.id for e in self.catalogue.effects] + sensors

    def residuals(
        self, use: str, values: Mapping[str, float], readings: Mapping[str, Sensor]
    ) -> dict[str, np.ndarray]:
        """Model less measurement of each output over the runs of that use, in its unit."""
        return {c: error for c, (error, _) in self.deviations(use, values, readings).items()}

    def deviations(
        self, use: str, values: Mapping[str, float], readings: Mapping[str, Sensor]
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Model less measurement of each output over the runs of that use, and its noise (n,), in its unit."""
        made: dict[str, list[np.ndarray]] = {c: [] for c in self.outputs}
        step = self.session.structure.step_size
        for run in self.campaign.runs:
            if run.use != use:
                continue
            stop = np.ceil(max(run.series[c][0][-1] for c in self.outputs if c in run.series) / step - 1e-6) * step
            inputs = {c.connector: run.series[c.connector] for c in self.campaign.inputs}
            t, rows = self.session.run(self.outputs, stop, step, {**values, **run.parameters}, inputs)
            models = {
                c: readings.get(c, Sensor()).observe(t, rows[:, k], run.series[c][0])
                for k, c in enumerate(self.outputs)
                if c in run.series
            }
            for c, pair in self.on_time(run.series, models).items():
                made[c].append(pair)
        return {c: tuple(np.concatenate(pairs, axis=1)) for c, pairs in made.items()}

    def on_time(
        self, measured: Mapping[str, tuple[np.ndarray, np.ndarray]], models: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Error and noise (2, n) of each channel of a run, with the run's clock where it fits best.

        Only where times of readings are stated to be uncertain; they make noise where the signal moves, too.
        """
        made, up, down = {}, 0.0, CLOCK**-2
        slopes = {c: np.gradient(y, t) for c, (t, y) in measured.items() if c in self.jitter}
        for c, model in models.items():
            error, slope = model - measured[c][1], slopes.get(c, 0.0)
            noise = np.sqrt(self.noise[c] ** 2 + (self.jitter.get(c, 0.0) * slope) ** 2) * np.ones_like(error)
            made[c] = np.stack([error, noise])
            up += float(np.sum(slope * error / noise**2))
            down += float(np.sum((slope / noise) ** 2))
        for c, slope in slopes.items():
            made[c][0] -= up / down * slope
        return made

    def values(self, names: Sequence[str], u: Sequence[float]) -> tuple[dict[str, float], dict[str, Sensor]]:
        """Parameters and sensors at a point: base first, then the effects' parameters in order."""
        values = {a: self.start[a] * (1.0 + tol * x) for (a, tol), x in zip(self.base.items(), u, strict=False)}
        rest = iter(u[len(self.base) :])
        sensors: dict[str, dict[str, float]] = {}
        for name in names:
            for p in self.parameters(name):
                x = p.neutral + p.prior * next(rest)
                if isinstance(p, Parameter):
                    values.update(p.values(x))
                else:
                    connector = name.partition("(")[2][:-1]
                    size = self.span[connector] if p.quantity == "bias" else 1.0
                    sensors.setdefault(connector, {})[p.quantity] = x * size
        return values, {c: Sensor(**q) for c, q in sensors.items()}

    def fit(self, names: Sequence[str], evaluations: int = 12) -> tuple[dict[str, float], dict[str, Sensor]]:
        """The best point over all starts of the shapes."""
        parameters = [p for name in names for p in self.parameters(name)]
        low = [-REACH] * len(self.base) + [(p.low - p.neutral) / p.prior for p in parameters]
        high = [REACH] * len(self.base) + [(p.high - p.neutral) / p.prior for p in parameters]

        def cost(u: np.ndarray) -> np.ndarray:
            prior = u[: len(self.base)] / SD
            try:
                errors = self.deviations("fit", *self.values(names, u))
            except SimulationError:
                return np.full(self.size + len(prior), 1e3)
            self.size = sum(len(error) for error, _ in errors.values())
            return np.concatenate([*(error / noise for error, noise in errors.values()), prior])

        best = None
        for shape in itertools.product(*(
            [(s - p.neutral) / p.prior for s in p.starts] if getattr(p, "shape", False) and p.starts else [1.0]
            for p in parameters
        )):  # fmt: skip
            u = np.clip([0.0] * len(self.base) + list(shape), np.add(low, 1e-6), np.subtract(high, 1e-6))
            found = least_squares(cost, u, bounds=(low, high), diff_step=1e-3, max_nfev=evaluations, x_scale=1.0)
            if best is None or found.cost < best.cost:
                best = found
        return self.values(names, best.x)

    def row(self, title: str, values: Mapping[str, float], readings: Mapping[str, Sensor]) -> str:
        """One line: RMS on the held-out runs, and what was found."""
        errors = self.deviations("holdout", values, readings)
        rms = {c: float(np.sqrt(np.mean(e * e))) for c, (e, _) in errors.items()}
        whole = np.sqrt(np.mean(np.concatenate([(e / noise) ** 2 for e, noise in errors.values()])))
        shown = "  ".join(f"{c.partition('.')[2]} {v:9.4g}" for c, v in rms.items())
        found = ", ".join(f"{a.partition('.')[2]} {v:.4g}" for a, v in values.items())
        sensors = ", ".join(f"{c} {r}" for c, r in readings.items())
        return f"{title:<52} {whole:8.3f}  {shown}   {found} {sensors}"


def main(arguments: Sequence[str]) -> None:
    """Print a row per model."""
    path = Path(arguments[0])
    with Session(reader.read(path).system) as session:
        problem = Problem(path, session)
        print("noise:", ", ".join(f"{c} {n:.3g}" for c, n in problem.noise.items()))
        print(problem.row("as delivered", {}, {}), flush=True)
        print(problem.row("base refitted", *problem.fit(())), flush=True)
        for title in arguments[1:] or problem.singles():
            print(problem.row(title, *problem.fit(title.split("+"))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
