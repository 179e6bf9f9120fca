"""Inputs and outputs that agree at one point in time, where outputs depend on inputs at once (feed-through).

An output that is read after a step answers to the input that was held in that step. `refresh` hands over the present
inputs and reads again, in the order of what depends on what, for the outputs of which the FMU declares that they
depend on a connected input. Loops are swept until nothing changes, or solved by Newton's method.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from graphlib import CycleError

import numpy as np

from ...core.errors import SimulationError
from ...ssp.flat_system import End
from ..engine.program import Memory, Program, SlotConversion
from ..engine.runner import Runner
from ..engine.values import REAL, TEXT, Signal
from ..slaves.variables import ALWAYS
from ..system.connections import SignalConnection
from ..system.strongly_connected import in_order
from ..system.system import System
from .algebraic_loops import graph
from .single_changes import SingleChanges

MAX_SWEEPS = 100
SETTLED = 1e-12

ROUNDING = 1e-15
"""Share of the largest value below which a value is rounding."""

FEW_SWEEPS = 5
"""A loop that takes more than these is worth being learned."""

MAX_LEARNED = 64
"""Inputs of such a loop: each has to be changed once."""

RELEARN_AFTER = 20
"""Points in time after which a loop whose slopes have not helped since is learned anew."""

CHANGE = 1.5e-8
"""Share of a value by which it is changed to see what follows."""


def input_output_runners(system: System, name: str) -> tuple[Runner, Runner]:
    """What hands a component the inputs in the buffer, and what then reads its outputs, if it lets itself be read."""
    inputs, instance = system.writer.program(), system.instances[name]
    inputs.set_inputs(instance)
    return Runner(inputs), reader(system, name) if instance.readable == ALWAYS else Runner(system.writer.program())


def reader(system: System, name: str) -> Runner:
    """What reads the outputs of a component."""
    outputs = system.writer.program()
    outputs.get_outputs(system.instances[name])
    return Runner(outputs)


def visit_order(nodes: Iterable[End]) -> list[str]:
    """Components to visit so that these outputs are read one after the other."""
    names: list[str] = []
    for component, _ in nodes:
        if not names or names[-1] != component:
            names.append(component)
    return names


class AlgebraicLoop:
    """Visits of components: take what others give, read what follows from it."""

    def __init__(self, system: System, names: Iterable[str]):
        self.system, self.names = system, list(names)
        self.visits: dict[str, tuple[list[tuple[SignalConnection, Runner]], Runner, Runner]] = {}
        for name in dict.fromkeys(self.names):
            links = []
            for link in system.connections.into(name):
                program = system.writer.program()
                system.writer.pass_on(program, link)
                links.append((link, Runner(program)))
            self.visits[name] = links, *input_output_runners(system, name)
        everything = [*system.outputs.values(), *system.inputs.values()]
        self._signals = [s for s in everything if s.family == REAL]
        self._reals = _slots(self._signals)
        self._whole = _slots([s for s in everything if s.family not in (REAL, TEXT)])
        every = [visit for links_into, _, _ in self.visits.values() for visit in links_into]
        self._round = [(link, carry) for link, carry in every if self._solvable(link)]
        self._given = [(link, carry) for link, carry in every if not link.source.component]
        self._targets = _slots(link.target for link, _ in self._round)
        ends = [link for link, _ in self._round for _ in range(link.target.size)]
        taken = [(system.instances[k.target.component], k.target.name) for k in ends]
        self._nominal = np.array([instance.nominal(name, otherwise=np.nan) for instance, name in taken])
        self._bounds = np.array([instance.bounds(name) for instance, name in taken]).reshape(-1, 2).T
        self._single = SingleChanges(
            self._round_trip, [link.source.component for link in ends], [link.target.component for link in ends]
        )
        all_reals = len(self._round) + len(self._given) == len(every)
        self._learns = all_reals and 0 < len(self._targets) <= MAX_LEARNED
        self.forget()

    def forget(self) -> None:
        """A new run begins: what was learned in the one before does not count."""
        self._largest = np.zeros(len(self.system.buffer.reals))
        self._inverse: np.ndarray | None = None
        self._tries = 0

    def learned(self) -> dict[str, np.ndarray]:
        """All that was learned in the run."""
        inverse = np.zeros((0, 0)) if self._inverse is None else self._inverse
        return {"largest": self._largest[self._reals], "inverse": inverse, "tries": np.array([self._tries])}

    def recall(self, learned: Mapping[str, np.ndarray]) -> None:
        """Go on with what `learned` gave."""
        self.forget()
        self._largest[self._reals] = learned["largest"]
        self._inverse = learned["inverse"].copy() if learned["inverse"].size else None
        self._tries = int(learned["tries"][0])

    def sweep(self) -> None:
        """Visit all components in turn."""
        for name in self.names:
            links, inputs, outputs = self.visits[name]
            for link, carry in links:
                if self.system.values.has_value(link):
                    carry.once()
            inputs.once()
            outputs.once()

    def _usual(self, size: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Sizes of the inputs that go round, where they are known; for the others, which have been 0, what their FMUs
        declare, else the largest of all."""
        other = np.where(np.isnan(self._nominal), size.max(initial=0.0) or 1.0, self._nominal)
        return np.where(known, size, other)

    def _beside(self, x: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Inputs x with changes to the side that their FMUs allow; as they are where none is."""
        (low, high), up, down = self._bounds, x + change, x - change
        return np.where(up <= high, up, np.where(down >= low, down, x))

    def inputs(self) -> np.ndarray:
        """The real inputs that go round, as they are."""
        inputs: np.ndarray = self.system.buffer.reals[self._targets].copy()
        return inputs

    def solve(self, when: str = "", near: np.ndarray | None = None) -> str | None:
        """Sweep until nothing changes; a loop that does not settle so is solved, or the error says which it is.

        when: for the error, where that is not in a step; near: what the inputs that go round began with, where another
        solution than that of the sweeps may be nearer to it. Then a remark is returned if there is one.

        Reals count relative to the largest value that a slot has had; whole numbers and texts have to be the same.
        """
        if self._solve_quickly():
            return None
        buffer = self.system.buffer
        begin, first = (self.inputs() if near is None else near), np.zeros(0)
        scale, change, last = np.abs(buffer.reals[self._reals]), np.zeros(0), np.inf
        for k in range(MAX_SWEEPS):
            reals, whole = buffer.reals[self._reals].copy(), buffer.integers[self._whole].copy()
            texts = list(buffer.texts)
            self.sweep()
            reals_now = buffer.reals[self._reals]
            with np.errstate(invalid="ignore", over="ignore"):
                change = np.where(reals_now == reals, 0.0, np.abs(reals_now - reals))
                scale = np.fmax(scale, np.abs(reals_now))
            first = scale if k == 0 else first
            same = np.array_equal(whole, buffer.integers[self._whole]) and texts == buffer.texts
            if same and np.all(change <= SETTLED * scale):
                remark = None if near is None or k == 0 else self._prefer_near(near, scale, when)
                if k > FEW_SWEEPS:
                    self._learn(scale)
                return remark
            largest = float(np.max(change / np.fmax(scale, 1e-300), initial=0.0))
            if not np.isfinite(change).all() or (same and largest > 0.999 * last):
                break  # it does not come nearer: no use to go on
            last = largest if same else np.inf
        if not self._round:
            raise SimulationError(
                f"the algebraic loop{when} through {', '.join(dict.fromkeys(self.names))} does not settle by "
                "repetition, and its values are no reals that could be solved for"
            )
        buffer.reals[self._targets] = begin
        self.newton(change, first, when)
        whole, texts = buffer.integers[self._whole].copy(), list(buffer.texts)
        self.sweep()
        if not (np.array_equal(whole, buffer.integers[self._whole]) and texts == buffer.texts):
            raise SimulationError(
                f"the algebraic loop{when} through {', '.join(dict.fromkeys(self.names))} does not settle: where its "
                "reals agree, its whole numbers or texts do not"
            )
        self._learn(scale)
        return None

    def _prefer_near(self, near: np.ndarray, scale: np.ndarray, when: str) -> str | None:
        """Of two solutions take the one nearer to what the inputs began with; what to say of that."""
        settled = self.inputs()
        size = np.maximum(np.abs(settled), np.abs(near))
        size = np.maximum(size, max(1e-9 * size.max(initial=0.0), 1e-300))
        if not len(settled) or np.all(np.abs(settled - near) <= 1e-6 * size):
            return None
        before = self.system.buffer.reals.copy()
        if not any(self._goes_round(x, 1e-6 * size) for x in (settled, near)):
            self._residual(settled)
            self.system.buffer.reals[:] = before
            return None
        self.system.buffer.reals[self._targets] = near
        try:
            self.newton(np.zeros(len(self._reals)), scale, when)
        except SimulationError:
            solved = settled
        else:
            solved = self.inputs()
        if np.all(np.abs(solved - settled) <= 1e-6 * size) or np.linalg.norm((solved - near) / size) >= np.linalg.norm(
            (settled - near) / size
        ):
            self._residual(settled)
            self.system.buffer.reals[:] = before
            return None
        through = ", ".join(dict.fromkeys(self.names))
        return (
            f"the algebraic loop{when} through {through} has more than one solution; the one nearer to the start "
            "values is taken"
        )

    def _goes_round(self, x: np.ndarray, change: np.ndarray) -> bool:
        """Whether it is a loop where the inputs are x, or cannot be asked: else there is one solution, which sweeps
        find."""
        try:
            return self._single.go_round(x, x + change)
        except SimulationError:
            return True

    @staticmethod
    def _solvable(link: SignalConnection) -> bool:
        return link.target.family == REAL and not link.conversion.from_integer and bool(link.source.component)

    def _residual(self, x: np.ndarray) -> np.ndarray:
        """What comes round for inputs x, less these."""
        residual: np.ndarray = self._round_trip(x) - x
        return residual

    def _round_trip(self, x: np.ndarray) -> np.ndarray:
        """What comes round for inputs x."""
        reals = self.system.buffer.reals
        reals[self._targets] = x
        for _, inputs, outputs in self.visits.values():
            inputs.once()
            outputs.once()
        for _, carry in self._round:
            carry.once()
        returned: np.ndarray = reals[self._targets]
        return returned

    def _solve_quickly(self) -> bool:
        """Whether a few steps with the slopes of an earlier point in time settle the loop."""
        if self._inverse is None:
            return False
        reals = self.system.buffer.reals
        before = reals.copy()
        for link, carry in (*self._given, *self._round):
            if self.system.values.has_value(link):
                carry.once()
        x = reals[self._targets].copy()
        for _ in range(FEW_SWEEPS):
            with np.errstate(invalid="ignore", over="ignore"):
                residual = self._residual(x)
                if np.all(np.abs(residual) <= SETTLED * np.abs(x)):
                    self._tries = 0
                    return True
                x = x - self._inverse @ residual
            if not np.isfinite(x).all():
                break
        reals[:] = before
        return False

    def _learn(self, scale: np.ndarray) -> None:
        """Keep the slopes of a loop that is settled but took long to, for the steps to come; see `solve` for scale."""
        self._tries += 1
        if not self._learns or (self._inverse is not None and 1 < self._tries < RELEARN_AFTER):
            return
        self._largest[self._reals] = np.fmax(self._largest[self._reals], np.where(scale < 1e12, scale, 0.0))
        x, largest = self.system.buffer.reals[self._targets].copy(), self._largest[self._targets]
        returned = self._round_trip(x)
        shifted = self._beside(x, 1e-6 * self._usual(largest, largest > 0.0))
        changed = self._single.residuals(x, returned, shifted, lambda left, _: left) - (returned - x)[:, None]
        slopes = changed / np.where(shifted != x, shifted - x, np.inf)
        self._residual(x)
        self._tries, self._inverse = 1, None
        if np.isfinite(slopes).all():
            with suppress(np.linalg.LinAlgError):
                self._inverse = np.linalg.inv(slopes)

    def newton(self, change: np.ndarray, scale: np.ndarray, when: str) -> None:
        """Newton's method for the reals that go round; `change` is what the last sweep did to the reals, `scale` their
        largest values on the way."""
        from scipy.optimize import root

        reals, targets = self.system.buffer.reals, self._targets

        def finite(left: np.ndarray) -> np.ndarray:
            replaced: np.ndarray = np.nan_to_num(left, nan=1e30, posinf=1e30, neginf=-1e30)
            return replaced

        def left(x: np.ndarray) -> np.ndarray:
            return finite(self._residual(x))

        start = np.nan_to_num(reals[targets], nan=0.0, posinf=0.0, neginf=0.0)
        start[np.abs(start) > 1e12] = 0.0
        self._largest[self._reals] = np.fmax(self._largest[self._reals], np.where(scale < 1e12, scale, 0.0))
        first = np.abs(left(start))
        # each in units of what it was in the run, so that flows of 1e-6 m3/s and pressures of 1e8 Pa are the same to
        # the solver, and what passes zero is not taken for small
        size = np.maximum(np.maximum(self._largest[targets], np.abs(start)), np.where(first < 1e29, first, 0.0))
        size = self._usual(size, size > ROUNDING * size.max())

        def slopes(x: np.ndarray) -> np.ndarray:
            shifted = self._beside(x * size, CHANGE * np.maximum(np.abs(x), 1.0) * size) / size
            returned = self._round_trip(x * size)
            residual_here = finite(returned - x * size) / size
            shifted_residuals = self._single.residuals(
                x * size, returned, shifted * size, lambda left, rows: finite(left) / size[rows]
            )
            slopes: np.ndarray = (shifted_residuals - residual_here[:, None]) / np.where(
                shifted != x, shifted - x, np.inf
            )
            return slopes

        solution = root(lambda x: left(x * size) / size, start / size, jac=slopes, tol=1e-13)
        rest, solved = np.abs(left(solution.x * size)) / size, np.abs(solution.x)
        allowed = 1e-8 * np.maximum(solved, 1e-3)
        if not np.all(rest <= allowed):  # what is the small difference of large values is no more certain than these
            allowed = np.maximum(allowed, 1e3 * ROUNDING * np.abs(slopes(solution.x)) @ solved)
            rest = np.abs(left(solution.x * size)) / size
        if not np.all(rest <= allowed):
            names = np.array([s.address for s in self._signals for _ in range(s.size)])
            worst = int(np.argmax(np.nan_to_num(change, nan=np.inf)))
            raise SimulationError(
                f"the algebraic loop{when} does not settle by repetition, and Newton's method finds no "
                f"solution; '{names[worst]}' still changes by {change[worst]:g}"
            )


def _slots(signals: Iterable[Signal]) -> np.ndarray:
    return np.array([s.place + k for s in signals for k in range(s.size)], np.int64)


def outdated_components(system: System) -> tuple[list[str], bool]:
    """(components in the order in which to bring them up to date, whether some depend on each other in a loop)."""
    driven = {link.end for link in system.links if system.values.has_value(link)}
    outdated_outputs = {
        end for end in system.outputs
        if system.writer.is_read(end)
        and any((end[0], name) in driven for name in system.instances[end[0]].direct_feedthrough(end[1]) or ())
    }  # fmt: skip
    try:
        order = in_order(graph(system, doubtful=False))
    except CycleError:
        members = {component for component, _ in outdated_outputs}
        return [name for name in system.order if name in members], True
    return visit_order(node for node in order if node in outdated_outputs), False


def drives_itself(system: System, name: str) -> bool:
    """Whether an output of a component is connected to an input of the same."""
    return any(link.source.component == name for link in system.writer.links_to(name))


def driven_at_end(system: System, program: Program, names: Iterable[str]) -> dict[int, int]:
    """Write: what stimuli drive these components with at the end of the step, in slots of its own; slot: that slot."""
    signals = [s for name in names for s in system.instances[name].inputs]
    signals += [link.source for name in names for link in system.writer.links_to(name)]
    used = set(_slots(s for s in signals if s.family != TEXT).tolist())
    slots = {}
    for slot, column, family in sorted(program.drives):  # an array's values side by side, in whatever order they come
        if slot in used:
            slots[slot] = system.layout.scratch()
            program.drive_at_end(slots[slot], column, family)
    return slots


def refresh(system: System, program: Program, driven: dict[int, int] | None = None, loops_only: bool = False) -> None:
    """Write: outputs agree with the present inputs; the inputs that were held stay in the buffer, for the record.

    What stimuli drive has the value that it has at the end of the step, which stands in `driven` if another program
    has written it (`driven_at_end`). loops_only: where there is no algebraic loop, only components that drive
    themselves are brought up to date, which no order of the components does.
    """
    names, in_loop = outdated_components(system)
    if loops_only and not in_loop:
        names = [name for name in names if drives_itself(system, name)]
    if not names:
        return
    links = [
        link for name in dict.fromkeys(names) for link in system.writer.links_to(name) if link.target.family != TEXT
    ]
    if driven is None:
        driven = driven_at_end(system, program, names)
    if not in_loop:
        refresh_in_order(system, program, names, links, driven)
        return
    with _preserved(
        system, program, [*((slot, 1) for slot in driven), *((link.target.place, link.target.size) for link in links)]
    ):
        for slot, end in driven.items():
            program.convert(slot, end, 1, SlotConversion())
        loop = AlgebraicLoop(system, names)
        program.remember(Memory("algebraic loop", loop.forget, loop.learned, loop.recall))

        def solve(_t: float, _h: float) -> int:
            loop.solve()
            return 0

        program.python(solve)


def refresh_in_order(
    system: System, program: Program, names: Sequence[str], links: Sequence[SignalConnection], instead: dict[int, int]
) -> None:
    """Write: in this order, the components get what these links carry now, and are read again; then all inputs are as
    they were in the buffer. `instead` gives the slots that stand for some sources, or for inputs of the components."""
    slots_of = {
        name: [p for p in _slots(s for s in system.instances[name].inputs if s.family != TEXT).tolist() if p in instead]
        for name in dict.fromkeys(names)
    }
    places = [(link.target.place, link.target.size) for link in links]
    into: dict[str, list[SignalConnection]] = {}
    for link in links:
        into.setdefault(link.target.component, []).append(link)
    with _preserved(system, program, [*places, *((slot, 1) for slots in slots_of.values() for slot in slots)]):
        for name in names:
            for slot in slots_of[name]:
                program.convert(slot, instead[slot], 1, SlotConversion())
            for link in into.get(name, ()):
                system.writer.pass_on(program, link, instead)
            program.set_inputs(system.instances[name])
            program.get_outputs(system.instances[name])


@contextmanager
def _preserved(system: System, program: Program, places: Sequence[tuple[int, int]]) -> Iterator[None]:
    """What is written inside leaves these (slot, count) as they were."""
    copies = [(place, system.layout.scratch(size), size) for place, size in places]
    for place, copy, size in copies:
        program.convert(copy, place, size, SlotConversion())
    yield
    for place, copy, size in copies:
        program.convert(place, copy, size, SlotConversion())
