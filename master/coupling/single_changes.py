"""What becomes of the inputs of a loop when each is changed by itself, from as few visits of the FMUs as it takes.

What a component gives follows from its own inputs only: so inputs of different components are changed in one go, and
there are as many goes as a component has inputs, however many components there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..system.strongly_connected import strongly_connected_components


class SingleChanges:
    """One-at-a-time changes of the inputs x (n,) of a loop; `round_trip(x)` (n,) gives the inputs after one pass."""

    def __init__(self, round_trip: Callable[[np.ndarray], np.ndarray], givers: Sequence[str], takers: Sequence[str]):
        """givers, takers: the components at the ends of the connection that each input hangs on."""
        self._round_trip = round_trip
        driven: dict[str, list[int]] = {}
        for i, name in enumerate(givers):
            driven.setdefault(name, []).append(i)
        nothing = np.zeros(0, np.int64)
        inputs_of = {name: np.array(places, np.int64) for name, places in driven.items()}
        self._answering = [inputs_of.get(name, nothing) for name in takers]
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
            trial = x.copy()
            trial[group] = changed[group]
            returned = self._round_trip(trial)
            for j in group.tolist():
                yield j, self._answering[j], returned[self._answering[j]]

    def residuals(
        self, x: np.ndarray, returned: np.ndarray, changed: np.ndarray,
        value: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ) -> np.ndarray:  # fmt: skip
        """value(what comes round - the inputs, rows) in column j (n, n) with `changed[j]` for x[j]; `returned` of x."""
        base = value(returned - x, np.arange(len(x)))
        columns = np.repeat(base[:, None], len(x), axis=1)
        for j, rows, changed_rows in self.each(x, changed):
            columns[rows, j] = value(changed_rows - x[rows], rows)
            itself = changed_rows[rows == j] if len(rows) else changed_rows
            itself = itself if len(itself) else returned[[j]]
            columns[[j], j] = value(itself - changed[[j]], np.array([j]))
        return columns

    def go_round(self, x: np.ndarray, changed: np.ndarray) -> bool:
        """Whether a change of an input, from x to `changed`, comes back to it by way of others."""
        returned = self._round_trip(x)
        follows = {j: rows[~(values == returned[rows])].tolist() for j, rows, values in self.each(x, changed)}
        return bool(strongly_connected_components(follows))
