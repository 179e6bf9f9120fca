"""The search for all calibrations: a scrambled Sobol sample, a local fit from its best points, a walk along lam_crit.

Each stage costs less than the one before would in its place: the sample takes a run of two machines a point, a fit some
fifteen of them, and only what has been fitted is run at 1 ms, and only what differs is judged by the paper's claims.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..calibrate import PUBLISHED
from .buildable import HIGH, LOW, Linkage, linkage, point
from .local import fit
from .machine import COARSE, EXACT, QUICK, Machine

WITHIN = 0.2
"""Greatest error of a time of a calibration [%]."""

GOOD = 0.1
"""Greatest error with which a fit ends [%]; the step of the search is off by another 0.03 %."""

FACTOR = 1.03
"""From one critical flow number to the next beyond those found."""

APART = 0.08
"""Two linkages differ when one of their numbers does by this much of its range."""

FREE = np.ones(6, dtype=bool)
BUT_LAM = np.array([True] * 5 + [False])

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Calibration:
    """A point (6,) of the unit cube, its linkage and the errors (4,) of its times [%] at 1 ms."""

    u: np.ndarray
    linkage: Linkage
    errors: np.ndarray

    @property
    def worst(self) -> float:
        """Greatest error of a time [%]."""
        return float(np.abs(self.errors).max())


def errors(machine: Machine, of: Linkage, how: tuple[float, str] = QUICK) -> np.ndarray | None:
    """Errors (4,) of the times [%]; None where the machine cannot be run."""
    found = machine.times(of, how)
    return None if found is None else 100.0 * (found / PUBLISHED - 1.0)


def starts(machine: Machine, samples: int, most: int, seed: int, tell: Tell) -> list[np.ndarray]:
    """The points (6,) of a scrambled Sobol sample whose times are least wrong, the best first."""
    from scipy.stats import qmc

    misfit = []
    points = qmc.Sobol(6, seed=seed).random(samples)
    for k, u in enumerate(points):
        found = errors(machine, linkage(u), COARSE)
        misfit.append(np.inf if found is None else float(np.abs(found).max()))
        tell(f"sample {k + 1} of {samples}")
    order = np.argsort(misfit, kind="stable")[:most]
    return [points[k] for k in order if np.isfinite(misfit[k])]


def fitted(machine: Machine, u: np.ndarray, free: np.ndarray = FREE) -> Calibration | None:
    """The calibration that is found from a point (6,); None where the times stay further off than `WITHIN`."""
    end, worst = fit(lambda v: errors(machine, linkage(v)), u, free, GOOD)
    return checked(machine, end) if worst <= WITHIN else None


def checked(machine: Machine, u: np.ndarray) -> Calibration | None:
    """The point (6,) as a calibration, with the shipped step; None where a time is off by more than `WITHIN`."""
    found = errors(machine, linkage(u), EXACT)
    if found is None or np.abs(found).max() > WITHIN:
        return None
    return Calibration(u, linkage(u), found)


def beyond(machine: Machine, found: Sequence[Calibration], sign: int, tell: Tell) -> Iterator[Calibration]:
    """Calibrations with ever smaller (sign -1) or greater (+1) critical flow numbers than those found.

    Each is fitted with the number held, from the three before that are furthest out; ends where none comes.
    """
    known = sorted(found, key=lambda c: -sign * c.u[5])
    step = sign * np.log(FACTOR) / (HIGH[5] - LOW[5])
    while known:
        out = known[0].u[5] + step
        if not 0.0 <= out <= 1.0:
            return
        tell(f"lam_crit = {linkage(np.append(known[0].u[:5], out)).lam_crit:.0f}")
        tried = (fitted(machine, np.append(c.u[:5], out), BUT_LAM) for c in known[:3])
        new = next((c for c in tried if c is not None), None)
        if new is None:
            return
        known.insert(0, new)
        yield new


def distinct(found: Sequence[Calibration], first: Sequence[Calibration], most: int) -> list[Calibration]:
    """Up to `most` calibrations that differ: the first ones, then always the one furthest from all that are taken."""
    taken = list(first)
    left = list(found)
    while left and len(taken) < most:
        away = [min((float(np.abs(c.u - t.u).max()) for t in taken), default=np.inf) for c in left]
        k = int(np.argmax(away))
        if away[k] < APART:
            break
        taken.append(left.pop(k))
    return taken


def calibrations(machine: Machine, samples: int, most_fits: int, seed: int, tell: Tell) -> list[Calibration]:
    """All calibrations that the search finds."""
    found = []
    points = starts(machine, samples, most_fits, seed, tell)
    for k, u in enumerate(points):
        if (new := fitted(machine, u)) is not None:
            found.append(new)
        tell(f"fit {k + 1} of {len(points)}: {len(found)} calibrations")
    for sign in (-1, 1):
        found += beyond(machine, found, sign, tell)
    return found


def as_calibration(machine: Machine, of: Linkage) -> Calibration:
    """A known linkage, whatever its errors are."""
    found = errors(machine, of, EXACT)
    return Calibration(point(of), of, np.full(4, np.inf) if found is None else found)
