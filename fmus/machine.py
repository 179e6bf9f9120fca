"""DeepseaMachine: hydraulics and arm coupled in one FMU, for tools that read no SSP."""

from __future__ import annotations

import weakref
from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from ..core.errors import ParameterError
from ..core.variables import Variable, VariableTable
from .arm import DeepseaArm
from .hydraulics import DeepseaHydraulics
from .slave import Slave
from .starts import STARTS

STEP = 1e-3
"""Longest step between hydraulics and arm [s]; a longer communication step is cut into equal ones."""

LONGEST = 3600.0
"""Longest communication step [s]."""

PARTS = {"hydraulics": DeepseaHydraulics, "arm": DeepseaArm}
CONNECTED = {"arm": {"F_h": ("hydraulics", "F_h")},
             "hydraulics": {"x_h": ("arm", "x_h"), "v_h": ("arm", "v_h"), "F_hold": ("arm", "F_hold")}}  # fmt: skip
"""Inputs of the parts and the outputs that drive them."""


def _table() -> VariableTable:
    """The variables of both parts under <part>.<name>, without the connected inputs."""
    found: dict[str, list[Variable]] = {"input": [], "output": [], "parameter": []}
    for part, kind in PARTS.items():
        free = [v.name for v in kind.table.of("input") if v.name not in CONNECTED[part]]
        for v in kind.table:
            if v.name in CONNECTED[part]:
                continue
            name = f"{part}.{v.name}"
            at_once = tuple(f"{part}.{x}" for x in v.feedthrough if x in free)
            start = STARTS.get(name, v.start)
            rate_of = f"{part}.{v.rate_of}" if v.rate_of else None
            own = replace(v, name=name, start=start, feedthrough=at_once, initial=(), rate_of=rate_of)
            found[v.causality].append(own)
    return VariableTable([v for group in found.values() for v in group])


class DeepseaMachine(Slave):
    """Gauss-Seidel between the parts: the hydraulics first, with the arm's motion, then the arm with the new force."""

    table = _table()

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Deep-sea valve-controlled hydraulic cylinder and the arm it moves, coupled"
        self.parts = {name: kind(**{**kwargs, "resources": ""}) for name, kind in PARTS.items()}
        me = weakref.proxy(self)  # a cycle of references would keep a freed instance until Python looks for such
        for part in self.parts.values():
            part.warn = lambda text: me.warn(text)  # type: ignore[method-assign]
        # places of the parts' variables, here and there
        self._given = {name: self._places(name, ("input", "parameter")) for name in PARTS}
        self._told = {name: self._places(name, ("output",)) for name in PARTS}
        self._wires = {
            name: [(part.table.index(x), self.parts[other], self.parts[other].table.index(y))
                   for x, (other, y) in CONNECTED[name].items()]
            for name, part in self.parts.items()
        }  # fmt: skip

    def _places(self, part: str, kinds: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
        own = [v.name for v in self.parts[part].table if v.causality in kinds and v.name not in CONNECTED[part]]
        here = [self.table.index(f"{part}.{name}") for name in own]
        return np.array(here), np.array([self.parts[part].table.index(name) for name in own])

    def _hand_over(self, name: str) -> None:
        """Bring a part's inputs up to date."""
        part = self.parts[name]
        for place, other, source in self._wires[name]:
            part.values[place] = other.values[source]

    def _collect(self) -> None:
        for name, part in self.parts.items():
            here, there = self._told[name]
            self.values[here] = part.values[there]

    def build(self, parameters: dict[str, float]) -> None:
        for name, part in self.parts.items():
            here, there = self._given[name]
            part.values[there] = self.values[here]
            part.time = self.time
        for name in ("arm", "hydraulics"):  # the arm knows where it rests and what holds it there
            part = self.parts[name]
            self._hand_over(name)
            part.build(part._parameters())
            part.outputs()
        self._hand_over("arm")

    def advance(self, t: float, h: float) -> None:
        self._take_inputs()
        if h > LONGEST:
            raise ParameterError(f"communication step size = {h:g} s; at most {LONGEST:g} s")
        n = max(1, ceil(h / STEP * (1.0 - 1e-12)))
        for k in range(n):
            begin = t + k * (h / n)
            for name, part in self.parts.items():
                self._hand_over(name)
                part.advance(begin, h / n)
                part.time = begin + h / n
        self._collect()

    def outputs(self) -> None:
        self._take_inputs()
        for part in self.parts.values():
            part.outputs()
        self._collect()

    def _take_inputs(self) -> None:
        for name, part in self.parts.items():
            here, there = self._given[name]
            part.values[there] = self.values[here]

    def get_model_state(self) -> dict[str, Any]:
        return {
            name: {"model": part.get_model_state(), "values": part.values.copy(), "time": part.time}
            for name, part in self.parts.items()
        }

    def set_model_state(self, state: dict[str, Any]) -> None:
        for name, part in self.parts.items():
            part.set_model_state(state[name]["model"])
            part.values[:] = state[name]["values"]
            part.time = state[name]["time"]
