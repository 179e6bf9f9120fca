"""With which steps a problem's simulations run: a value that is passed, never rewritten."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...master.algorithms import DEFAULT


@dataclass(frozen=True)
class Discretisation:
    """Macro step and method of exact runs, the longer step of a fit, and the step of finite differences."""

    macro_step: float
    """Of exact runs [s]."""
    coarsening: int = 1
    """Macro steps of a fit's runs, in those of exact ones."""
    method: str = DEFAULT
    """Coupling algorithm."""
    richardson_order: int = 0
    """Order by which exact runs are extrapolated to a step of 0; 0 where the step's error is too small to matter."""
    difference_step: float = 1e-4
    """Step of a finite difference, in normalised parameters."""

    @property
    def fit_step(self) -> float:
        """Macro step of a fit's runs [s]."""
        return self.macro_step * self.coarsening

    def richardson(self, double: np.ndarray, single: np.ndarray) -> np.ndarray:
        """What runs tend to as the macro step goes to 0, from those at some step and at twice it (Richardson 1911)."""
        limit: np.ndarray = single + (single - double) / (2.0**self.richardson_order - 1.0)
        return limit
