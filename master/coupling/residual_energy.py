"""How far a run can be trusted, from its own record: residual energy, frequency and numerical damping of the coupling.

What one side of a power bond believes to hand over in a step differs from what the other side believes: the difference
is energy that the coupling creates or destroys (Sadjina et al. 2017, ECCO). Each side counts the mean of its output
times the input that it held; the paper takes the output at the step's end, which finds a residual of first order in
methods that have none.

A component answers to an input u that is held during a step with its output at the end, y_1 = y_0 + D u + what it does
of its own. Second differences of y against first differences of u give D (least squares), for what a component does of
its own changes slowly. Two components that answer to each other with D_a and D_b (D_a D_b < 0: inertia against
stiffness) swing with

    omega h = sqrt(-D_a D_b),

and their energy is E = h / 2 |y_a^2 / D_a| + h / 2 |y_b^2 / D_b|. What does not arrive at the other side, at the mean
rate P, is a numerical damping ratio of -P / (2 omega E), negative where the coupling drives the swing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .power_bonds import Bond

CERTAIN = 0.5
"""Share of the second differences that D has to explain to be told."""

TRUSTED = 0.1
"""Share of residual energy above which a run warns."""

AT_ONCE = 0.02
"""Share of an output's answer that may be to a position rather than a speed, for a damping to be told: what comes with
a jump of the position is not in the products of the bond."""

OVERFLOW = 1e100
"""Sums of energies and squares that are larger belong to a run that has exploded."""

STILL = 1e-10
"""Range of an output, as a share of its largest value, within which it rests: what changes then is rounding."""

CHANGED = 0.5
"""Share by which a swing's energy has to change through a run to be warned of; in logarithms, at least half of the
change has to be what the coupling would do alone."""

MAX_EXPONENT = 200.0
"""Of the growth that is told."""

PIECES, FINE, MAX_PIECES = 8, 64, 256
"""Pieces of time in which a swing is followed: those of a block of rows as long as they are few, how many are few (each
later block is one), and how many there may be before neighbours are put together."""

NYQUIST = 1.0
"""omega h from which a step is too long for the swing, whatever the method."""


@dataclass
class CouplingOscillation:
    """Sums over a run for one bond; a is the component that gives the first link."""

    gear: float = 1.0
    feedthrough_slopes: tuple[float, float] = (0.0, 0.0)
    """How much the outputs of a and b answer at once to what the other side's flow is the rate of
    (`feedthrough.feedthrough_slopes`)."""
    sums: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    """For a and b: sum of u' y'', of u'^2 and of y''^2."""
    pieces: list[np.ndarray] = field(default_factory=list)
    """For pieces of the run, one after the other: sums of y_a^2, y_b^2, y_a, y_b, energy that does not arrive, what
    means of y_b and y_a make of that, h, and steps."""

    def add(
        self, h: np.ndarray, y: tuple[np.ndarray, np.ndarray], u: tuple[np.ndarray, np.ndarray], lost: np.ndarray,
        drift: tuple[np.ndarray, np.ndarray],
    ) -> None:  # fmt: skip
        """Take in rows, all in SI units: step lengths (n - 1,), outputs and held inputs (n,) of a and b.

        lost: the energy that does not arrive at b in the last steps, the new ones [J]; drift: how much of it a constant
        part of y_b makes, and one of y_a, both for 1.
        """
        new = len(lost)
        even = np.abs(h[1:] - h[:-1]) < 1e-9 * h[1:]
        for i in range(2):
            second = np.diff(y[i], 2)[even]
            first = np.diff(u[i])[:-1][even]
            self.sums[i] += first @ second, first @ first, second @ second
        ends = [new] if len(self.pieces) > FINE else np.unique(np.linspace(0, new, PIECES + 1, dtype=int)[1:])
        y_a, y_b, h, begin = y[0][-new:], y[1][-new:], h[-new:], 0
        for end in ends:
            a, b, part = y_a[begin:end], y_b[begin:end], slice(begin, end)
            energy = [x[part].sum() for x in (lost, *drift, h)]
            self.pieces.append(np.array([a @ a, b @ b, a.sum(), b.sum(), *energy, end - begin]))
            begin = end
        if len(self.pieces) > MAX_PIECES:
            self.pieces = [np.sum(self.pieces[k : k + 2], axis=0) for k in range(0, len(self.pieces), 2)]

    def answer(self, i: int) -> float | None:
        """D of side i, or None where the record does not show it."""
        uy, uu, yy = self.sums[i]
        if uu <= 0.0 or yy <= 0.0 or uy * uy < CERTAIN * uu * yy:
            return None
        return float(uy / uu)

    def summary(self) -> dict[str, float | None]:
        """What the record shows, else None: omega h, numerical damping ratio, and how the run went on.

        energy_ratio: the swing's energy in the run's last quarter over that in its first; by_coupling: what that ratio
        would be by the numerical damping alone.
        """
        summary: dict[str, float | None] = dict.fromkeys(
            ("omega_h", "numerical_damping", "energy_ratio", "energy_ratio_by_coupling"))  # fmt: skip
        pieces = np.reshape(self.pieces, (-1, 9))
        if not np.abs([*self.sums.ravel(), *pieces.sum(axis=0)]).max() < OVERFLOW:
            return summary
        a, b = self.answer(0), self.answer(1)
        seconds, count = pieces[:, 7:].sum(axis=0)
        if a is None or b is None or count < 10:
            return summary
        loop = a * b
        if loop >= 0.0:
            return summary
        omega_h = float(np.sqrt(-loop))
        h = float(seconds / count)
        weights = 0.5 * h * self.gear / np.abs([a, b])

        def energy_of(part: np.ndarray) -> float:
            """Mean energy of the swing around the mean in these pieces."""
            squares, means = part[:, :2].sum(axis=0), part[:, 2:4].sum(axis=0)
            n = part[:, 8].sum()
            around_mean = squares - means**2 / n
            return float(np.where(around_mean > STILL * squares, around_mean, 0.0) @ weights / n)

        energy = energy_of(pieces)
        summary["omega_h"] = omega_h
        jumps = float(np.max(np.divide(self.feedthrough_slopes, np.abs([a, b])))) * h  # NaN where one is not known
        if energy > 0.0 and seconds > 0.0 and jumps <= AT_ONCE:
            # what a takes up is sign(D_a) y_a u_a: its energy h y^2 / |2 D| grows with that
            mean_a, mean_b = pieces[:, 2:4].sum(axis=0) / count
            lost = pieces[:, 4:7].sum(axis=0) @ [1.0, -mean_b, -mean_a]  # of the swing around the mean
            rate = float(np.sign(a) * lost / (energy * seconds))
            summary["numerical_damping"] = -rate / (2.0 * omega_h / h)
            length = pieces[:, 7]
            middle = np.cumsum(length) - 0.5 * length
            first, last = middle < 0.25 * seconds, middle > 0.75 * seconds
            if first.any() and last.any():
                before, after = energy_of(pieces[first]), energy_of(pieces[last])
                far = np.average(middle[last], weights=length[last]) - np.average(middle[first], weights=length[first])
                if before > 0.0 and after > 0.0:
                    summary["energy_ratio"] = after / before
                    summary["energy_ratio_by_coupling"] = float(
                        np.exp(np.clip(rate * far, -MAX_EXPONENT, MAX_EXPONENT))
                    )
        return summary


def _held(u: np.ndarray, interpolating: bool) -> np.ndarray:
    """Means of an input over the steps (n - 1,) from its values at their starts (n,)."""
    if not interpolating:
        return u[:-1]
    before = np.concatenate([u[:1], u[:-2]])
    means: np.ndarray = u[:-1] + 0.5 * (u[:-1] - before)
    return means


class ResidualEnergy:
    """Sums up the residual energy of each bond from blocks of recorded communication points."""

    def __init__(
        self, bonds: list[Bond], outputs: Sequence[int], inputs: Sequence[int],
        feedthrough_slopes: Sequence[tuple[float, float]], interpolating: Collection[str] = (),
    ):  # fmt: skip
        """outputs, inputs: slots of a row's columns, the outputs first.

        interpolating: components that carry their inputs on through a step, along the slope of the last change.
        """
        self.bonds = bonds
        self._interpolating = [
            (b.back.target.component in interpolating, b.forth.target.component in interpolating) for b in bonds
        ]
        out = {place: i for i, place in enumerate(outputs)}
        into = {place: len(outputs) + i for i, place in enumerate(inputs)}
        self._columns = [
            [out[b.forth.source.place], into[b.back.target.place], into[b.forth.target.place],
             out[b.back.source.place]]
            for b in bonds
        ]  # fmt: skip
        self._si = [np.transpose(b.to_si()) for b in bonds]
        self.absolute = np.zeros(len(bonds))
        self.net = np.zeros(len(bonds))
        self.exchanged = np.zeros(len(bonds))
        self._low, self._high = np.full((len(bonds), 2), np.inf), np.full((len(bonds), 2), -np.inf)
        self._last: list[tuple[float, np.ndarray]] = []
        self.swings = [CouplingOscillation(b.gear, slopes) for b, slopes in zip(bonds, feedthrough_slopes, strict=True)]

    def add(self, time: np.ndarray, rows: np.ndarray) -> None:
        """Take in rows (n, outputs + inputs): outputs at times (n,) and inputs held from then on."""
        if self.bonds and len(time):
            with np.errstate(over="ignore", invalid="ignore"):
                self._add(time, rows)

    def _add(self, time: np.ndarray, rows: np.ndarray) -> None:
        carried_over = len(self._last)
        if carried_over:
            time = np.concatenate([[t for t, _ in self._last], time])
            rows = np.concatenate([[row for _, row in self._last], rows])
        self._last = [(float(t), row.copy()) for t, row in zip(time[-2:], rows[-2:], strict=True)]
        h = np.diff(time)
        fresh = slice(max(0, carried_over - 1), None)  # steps that have not been counted yet
        for i, bond in enumerate(self.bonds):
            factors, offsets = self._si[i]
            y_a, u_a, u_b, y_b = (rows[:, self._columns[i]] * factors + offsets).T
            outputs = np.stack([y_a, y_b])
            self._low[i] = np.minimum(self._low[i], outputs.min(axis=1))
            self._high[i] = np.maximum(self._high[i], outputs.max(axis=1))
            held = [
                _held(u, interpolating) for u, interpolating in zip((u_a, u_b), self._interpolating[i], strict=True)
            ]
            mean = [0.5 * (y[1:] + y[:-1]) for y in (y_a, y_b)]
            left = (bond.gear * mean[0] * held[0] * h)[fresh]
            right = (bond.gear * held[1] * mean[1] * h)[fresh]
            self.absolute[i] += np.sum(np.abs(left - right))
            self.net[i] += np.sum(left - right)
            self.exchanged[i] += np.sum(0.5 * np.abs(left + right))
            if len(left):
                drift = [(bond.gear * h * x)[fresh] for x in (mean[0] - held[1], held[0] - mean[1])]
                self.swings[i].add(h, (y_a, y_b), (u_a, u_b), left - right, (drift[0], drift[1]))

    def moves(self, i: int) -> bool:
        """Whether both sides of a bond have changed by more than rounding."""
        largest = np.maximum(np.abs(self._low[i]), np.abs(self._high[i]))
        return bool(np.all(self._high[i] - self._low[i] > STILL * largest))

    def summary(self) -> list[dict[str, Any]]:
        """Per bond: name, residual energy (sum of absolute values, and net), energy exchanged [J], and its swing.

        Where one side rests there is nothing to follow: no share of energy and no swing are told.
        """
        entries = []
        for i, bond in enumerate(self.bonds):
            moves = self.moves(i)
            swing = self.swings[i].summary()
            share = 0.0
            if not self.absolute[i] + self.exchanged[i] < OVERFLOW:
                share = float("inf")
            elif moves and self.exchanged[i] > 0.0:
                share = float(self.absolute[i] / self.exchanged[i])
            entries.append({
                "bond": bond.name,
                "residual_energy_J": float(self.absolute[i]),
                "net_residual_energy_J": float(self.net[i]),
                "exchanged_energy_J": float(self.exchanged[i]),
                "relative": share,
                **(swing if moves else dict.fromkeys(swing)),
            })  # fmt: skip
        return entries

    def warnings(self) -> list[str]:
        """Bonds over which the coupling is not to be trusted."""
        lines = []
        for bond in self.summary():
            if bond["relative"] == float("inf"):
                lines.append(
                    f"the energy exchanged over {bond['bond']} grew beyond all numbers: the coupling is unstable; "
                    "take a shorter step or another method"
                )
            elif bond["relative"] > TRUSTED:
                lines.append(
                    f"the coupling created or destroyed {bond['relative']:.0%} of the energy exchanged over "
                    f"{bond['bond']}: do not trust this run; take a shorter step"
                )
            if bond["energy_ratio"] is not None:
                change, by_coupling = (float(np.log(bond[key])) for key in ("energy_ratio", "energy_ratio_by_coupling"))
                if abs(change) > np.log(1.0 + CHANGED) and by_coupling / change > 0.5:
                    does, by = ("grows", "makes") if change > 0.0 else ("shrinks", "takes")
                    lines.append(
                        f"the swing over {bond['bond']} {does} {np.exp(0.5 * abs(change)):.2g}-fold from the run's "
                        f"first quarter to its last, and the coupling {by} as much energy: it may be of its making; "
                        "see what a shorter step or another method gives"
                    )
            if bond["omega_h"] is not None and bond["omega_h"] > NYQUIST:
                lines.append(
                    f"the coupling over {bond['bond']} swings with omega h = {bond['omega_h']:.2g}: the step is too "
                    "long to follow it"
                )
        return lines
