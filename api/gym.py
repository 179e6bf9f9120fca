"""A package as an environment of Gymnasium, for controllers that learn. Needs the extra `gym`.

>>> from deepsea_cosim.gym import CosimEnv                                          # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from .core.errors import SimulationError, UsageError
from .master.simulation.session import Session
from .master.simulation.stepped_run import SteppedRun

Observed = Mapping[str, float]
"""Signals by address."""


class CosimEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """The system of an SSP package: actions are inputs that nothing drives, observations are its signals.

    package: the SSP file. observe: addresses of signals. act: (least, greatest) by address of an input. reward: of what
    is observed after a step and the action, each by address. interval: time between two actions [s], a whole number of
    macro steps. stop_time: the episode is cut there [s] (None: the package's). ends: whether what is observed ends it.
    changes: parameters, e.g. `{"hydraulics.command.use_input": True}`; `reset(options={"changes": ...})` adds to them.
    step, method: macro step [s] and coupling.

    A run that has to stop (an FMU fails) ends the episode with the reward `failed`; info["error"] says why.
    """

    def __init__(
        self, package: str | Path, observe: Sequence[str], act: Mapping[str, tuple[float, float]],
        reward: Callable[[Observed, Observed], float], interval: float, *, stop_time: float | None = None,
        ends: Callable[[Observed], bool] = lambda seen: False, changes: Mapping[str, Any] | None = None,
        step: float | None = None, method: str | None = None, failed: float = 0.0,
    ):  # fmt: skip
        self._session = Session(package)
        try:
            self._observe, self._act = list(observe), dict(act)
            self._reward, self._ends, self._failed = reward, ends, failed
            self._changes, self._step, self._method = dict(changes or {}), step, method
            stop = self._session.structure.stop_time if stop_time is None else stop_time
            self._stop = np.inf if stop is None else float(stop)
            self._run: SteppedRun | None = None
            h = self._session.macro_step(step)
            self._count = round(interval / h)
            if self._count < 1 or abs(self._count * h - interval) > 1e-9 * interval:
                raise UsageError(f"interval {interval:g} s is no whole number of macro steps of {h:g} s")
        except BaseException:
            self._session.close()
            raise
        low, high = (np.array([pair[k] for pair in self._act.values()], np.float64) for k in (0, 1))
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float64)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (len(self._observe),), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin anew; inputs are at the middle of their range until the first action."""
        super().reset(seed=seed)
        changes = {**self._changes, **(options or {}).get("changes", {})}
        middle = {name: 0.5 * (low + high) for name, (low, high) in self._act.items()}
        self._run = self._session.start(self._observe, self._step, middle, changes, self._method)
        return self._run.values(), {"time": self._run.time}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold the action for an interval: observation, reward, terminated, truncated, info with the time [s]."""
        if self._run is None:
            raise UsageError("call reset before the first step")
        given = dict(zip(self._act, np.asarray(action, float).tolist(), strict=True))
        try:
            values = self._run.step(given, self._count)
        except SimulationError as error:
            return self._run.values(), self._failed, True, False, {"time": self._run.time, "error": str(error)}
        seen = dict(zip(self._observe, values.tolist(), strict=True))
        over = self._run.time >= self._stop - 1e-9 * max(1.0, abs(self._run.time))
        reward = float(self._reward(seen, given))
        return values, reward, bool(self._ends(seen)), bool(over), {"time": self._run.time}

    def close(self) -> None:
        """Free the FMUs."""
        self._session.close()
