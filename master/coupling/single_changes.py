"""What becomes of the inputs of a loop when each is changed by itself, from as few visits of the FMUs as it takes.

What a component gives follows from its own inputs only: so inputs of different components are changed in one go, and
there are as many goes as a component has inputs, however many components there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..system.strongly_connected import together


class SingleChanges:
    """Of inputs x (n,), for which `came(x)` (n,) comes round."""

    def __init__(self, came: Callable[[np.ndarray], np.ndarray], givers: Sequence[str], takers: Sequence[str]):
        """givers, takers: the components at the ends of the connection that each input hangs on."""
        self._came = came
        driven: dict[str, list[int]] = {}
        for i, name in enumerate(givers):
            driven.setdefault(name, []).append(i)
        nothing = np.zeros(0, np.int64)
        given = {name: np.array(found, np.int64) for name, found in driven.items()}
        self._answering = [given.get(name, nothing) for name in takers]
        count: dict[str, int] = {}
        groups: list[list[int]] = []
        for i, name in enumerate(takers):
            number = count[name] = count.get(name, -1) + 1
            if number == len(groups):
                groups.append([])
            groups[number].append(i)
        self._groups = [np.array(group, np.int64) for group in groups]

    def each(self, x: np.ndarray, changed: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """(j, rows, what comes round there) with the value `changed[j]` for x[j]; elsewhere it is as for x."""
        for group in self._groups:
            there = x.copy()
            there[group] = changed[group]
            came = self._came(there)
            for j in group.tolist():
                yield j, self._answering[j], came[self._answering[j]]

    def left(
        self, x: np.ndarray, came: np.ndarray, changed: np.ndarray,
        value: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ) -> np.ndarray:  # fmt: skip
        """value(what comes round - the inputs, rows) in column j (n, n) with `changed[j]` for x[j]; `came` of x."""
        here = value(came - x, np.arange(len(x)))
        made = np.repeat(here[:, None], len(x), axis=1)
        for j, rows, found in self.each(x, changed):
            made[rows, j] = value(found - x[rows], rows)
            own = found[rows == j] if len(rows) else found
            own = own if len(own) else came[[j]]
            made[[j], j] = value(own - changed[[j]], np.array([j]))
        return made

    def go_round(self, x: np.ndarray, changed: np.ndarray) -> bool:
        """Whether a change of an input, from x to `changed`, comes back to it by way of others."""
        came = self._came(x)
        follows = {j: rows[~(found == came[rows])].tolist() for j, rows, found in self.each(x, changed)}
        return bool(together(follows))
