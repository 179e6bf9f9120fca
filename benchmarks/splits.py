"""Every coupling algorithm on two linear machines cut in two, against the closed form: error and numerical damping.

    python -m benchmarks.splits

The quarter car is cut between chassis and suspension, the two masses between the second mass and the spring that
couples them: one side gets a force, the other position and speed. The truth is the matrix exponential. The numerical
damping of a mode is what its amplitude, the projection on the mode's left eigenvector, decays faster than it should,
as a damping ratio.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulation.run import Options, run
from scipy.linalg import eig, expm

from benchmarks import native
from tests.packages import binding, bindings, component, connector, link, package, system, values


@dataclass(frozen=True)
class Split:
    """Two linear components: the force of `spring` acts on `mass`, whose position and speed come back.

    Parts are (A, B, C, D, x0). The states of the mass are position and speed.
    """

    name: str
    mass: tuple[np.ndarray, ...]
    spring: tuple[np.ndarray, ...]
    steps: tuple[float, float, float]
    stop: float

    @property
    def whole(self) -> tuple[np.ndarray, np.ndarray]:
        """(A, x0) of both together, states of the mass first."""
        (a, b, c, _, x), (aa, bb, cc, dd, xx) = self.mass, self.spring
        A = np.block([[a + b @ dd @ c, b @ cc], [bb @ c, aa]])
        return A, np.concatenate([x, xx])


def quarter_car() -> Split:
    """300 kg on 20 kN/m and 1 kNs/m, wheel of 40 kg on a tyre of 180 kN/m, onto a step of 0.1 m in the road."""
    m, k, c, wheel, tyre = 300.0, 20e3, 1e3, 40.0, 180e3
    chassis = (np.array([[0, 1], [0, 0]]), np.array([[0], [1 / m]]), np.eye(2), np.zeros((2, 1)), np.zeros(2))
    # states: wheel's position and speed, height of the road; input: chassis's position and speed; output: the force
    suspension = (
        np.array([[0, 1, 0], [-(k + tyre) / wheel, -c / wheel, tyre / wheel], [0, 0, 0]]),
        np.array([[0, 0], [k / wheel, c / wheel], [0, 0]]),
        np.array([[k, c, 0]]),
        np.array([[-k, -c]]),
        np.array([0, 0, 0.1]),
    )
    return Split("quarter car", chassis, suspension, (4e-3, 2e-3, 1e-3), 1.5)


def two_masses() -> Split:
    """Two masses of 1 kg, each on 100 N/m to a wall, a spring of 400 N/m and little damping between them."""
    m, k, c, between, loss = 1.0, 100.0, 0.1, 400.0, 0.2
    first = (np.array([[0, 1], [-k / m, -c / m]]), np.array([[0], [1 / m]]), np.eye(2), np.zeros((2, 1)),
             np.array([0.1, 0]))  # fmt: skip
    second = (
        np.array([[0, 1], [-(k + between) / m, -(c + loss) / m]]),
        np.array([[0, 0], [between / m, loss / m]]),
        np.array([[between, loss]]),
        np.array([[-between, -loss]]),
        np.array([0, 0]),
    )
    return Split("two masses", first, second, (8e-3, 4e-3, 2e-3), 4.0)


def packed(split: Split, folder: Path) -> Path:
    """The package of a split, of native FMUs."""
    mass = native.linear(folder, 2, "mass", through=False, units={"u1": "N", "y1": "m", "y2": "m/s"})
    spring = native.linear(folder, 2, "spring", units={"u1": "m", "u2": "m/s", "y1": "N"})
    fmus = {"resources/mass.fmu": mass, "resources/spring.fmu": spring}
    given = {}
    for name, part in (("mass", split.mass), ("spring", split.spring)):
        A, B, C, D, x = part
        outputs = np.vstack([C, np.eye(len(A))]) if name == "spring" else C  # the states too, to look at
        through = np.vstack([D, np.zeros((len(A), D.shape[1]))]) if name == "spring" else D
        given |= native.values(name, A=A, B=B, C=outputs, D=through, x0=x)
    places = [connector(f"{kind[0]}{i}", name) for kind, name in (("u", "input"), ("y", "output")) for i in range(1, 5)]
    root = system(
        "split", component("mass", "resources/mass.fmu", *places), component("spring", "resources/spring.fmu", *places),
        links=(link("spring.y1", "mass.u1"), link("mass.y1", "spring.u1"), link("mass.y2", "spring.u2")),
        bindings=bindings(binding(values(given))),
    )  # fmt: skip
    return package(folder / "split.ssp", root, fmus, stop=split.stop, step=split.steps[0])


def trajectory(split: Split, path: Path, method: str, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and states (n, k) of a run, those of the mass first."""
    frame = run(path, path.parent / "out", Options(method=method, step=h)).frame()
    names = ["mass.y1", "mass.y2", *(f"spring.y{i + 2}" for i in range(len(split.spring[0])))]
    return frame["time"].to_numpy(), frame[names].to_numpy()


def truth(split: Split, times: np.ndarray) -> np.ndarray:
    """States (n, k) at equidistant times."""
    A, x = split.whole
    over = expm(A * (times[1] - times[0]))
    made = [x]
    for _ in times[1:]:
        made.append(over @ made[-1])
    return np.array(made)


def damping(split: Split, times: np.ndarray, states: np.ndarray) -> float:
    """Numerical damping ratio of the fastest mode that swings."""
    A, x = split.whole
    roots, left = eig(A, left=True, right=False)
    swinging = [i for i in range(len(roots)) if roots[i].imag > 1e-6 and abs(left[:, i].conj() @ x) > 1e-9]
    fastest = max(swinging, key=lambda i: abs(roots[i]))
    size = np.abs(states @ left[:, fastest].conj())
    seen = size > 0.1 * size[0]  # further on what the other modes leave in the projection would count
    last = len(seen) if seen.all() else int(np.argmin(seen))
    slope = np.polyfit(times[2:last], np.log(size[2:last]), 1)[0]
    return float((roots[fastest].real - slope) / abs(roots[fastest]))


def row(split: Split, path: Path, method: str) -> tuple[list[float], list[float]]:
    """(largest error of the mass's position relative to its largest value, numerical damping) for the step sizes."""
    errors, losses = [], []
    for h in split.steps:
        times, states = trajectory(split, path, method, h)
        exact = truth(split, times)
        errors.append(float(np.abs(states[:, 0] - exact[:, 0]).max() / np.abs(exact[:, 0]).max()))
        losses.append(damping(split, times, states))
    return errors, losses


def table(split: Split, methods: Sequence[str] = NAMES) -> str:
    """A table in Markdown."""
    with TemporaryDirectory() as folder:
        path = packed(split, Path(folder))
        A, _ = split.whole
        fastest = max(abs(np.linalg.eigvals(A)))
        heads = [f"h = {1e3 * h:g} ms" for h in split.steps]
        lines = [f"{split.name}, fastest mode {fastest:.0f} rad/s (omega h = {fastest * split.steps[0]:.2g}, ...)", ""]
        lines.append("| method | " + " | ".join(f"error, {x}" for x in heads) + " | "
                     + " | ".join(f"damping, {x}" for x in heads) + " |")  # fmt: skip
        lines.append("| --- |" + " --- |" * (2 * len(heads)))
        for method in methods:
            errors, losses = row(split, path, method)
            cells = [f"{100 * e:.2g} %" for e in errors] + [f"{d:+.1e}" for d in losses]
            lines.append(f"| `{method}` | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    for made in (quarter_car(), two_masses()):
        print(table(made), end="\n\n")
