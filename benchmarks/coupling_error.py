"""How far the coupled run is from the monolithic reference, by step and method, and how much damping the coupling adds.

    python benchmarks/coupling_error.py [BUILD_FOLDER]

The folder holds the packages made by `cosim-fmus build`; without it they are built anew. Run from the repository.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulate import Options, run

from tests.reference import monolith
from tests.reference.compare import deviation

SPACING, ORDER = 8e-3, 4
"""Samples [s] and number of poles for the ring-down."""


def coupled(package: Path, **options: object) -> dict[str, np.ndarray]:
    """Columns of a run by name."""
    with tempfile.TemporaryDirectory() as folder:
        result = run(package, Path(folder), Options(**options))
        table = np.loadtxt(Path(folder) / "results.csv", delimiter=",", skiprows=1)
    return {name: table[:, i] for i, name in enumerate(result.names)}


def errors(build: Path) -> None:
    """Table of deviations from the monolith."""
    t = np.arange(22001) * 1e-3
    print("| depth | method | step | max x_h error | order | max v_h error | max pressure error |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for km in (0, 11):
        truth = monolith.solve(monolith.Machine(depth=float(km)), t, rtol=1e-9)
        for method in NAMES:
            last = None
            for ms in (8, 4, 2, 1):
                c = coupled(build / f"deepsea_{km}km.ssp", step=ms * 1e-3, method=method)
                x, v, p = deviation(c, truth, ms)
                order = "" if last is None else f"{np.log2(last / x):.2f}"
                print(
                    f"| {km} km | {method} | {ms} ms | {1e3 * x:.4f} mm | {order} | {1e3 * v:.3f} mm/s | "
                    f"{p / 1e3:.1f} kPa ({p / 20e6:.2%} of 20 MPa) |"
                )
                last = x


def poles(signal: np.ndarray, h: float, order: int) -> np.ndarray:
    """Poles [1/s] of a noise-free sum of exponentials, by the matrix pencil."""
    n = len(signal)
    L = n // 2
    hankel = np.lib.stride_tricks.sliding_window_view(signal, L + 1)
    _, _, v = np.linalg.svd(hankel, full_matrices=False)
    v = v[:order].T
    return np.log(np.linalg.eigvals(np.linalg.pinv(v[:-1]) @ v[1:]).astype(complex)) / h


def damping(build: Path) -> None:
    """The slowest oscillation at rest after a tap on the command, against the monolith's eigenvalue."""
    c_l = 5e-13
    machine = monolith.Machine(depth=11.0, leakage=c_l)
    frequency, ratio = monolith.slowest_oscillation(monolith.mode(machine))
    print(f"\nslowest oscillation of the monolith at rest, 11 km, c_l = {c_l:g}:", end=" ")
    print(f"{frequency:.3f} Hz, damping {ratio:.4f}\n")
    print("| method | step | omega h | frequency | damping | numerical damping | per omega h |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    omega = 2 * np.pi * frequency
    tap = (
        ("hydraulics.cylinder.c_l", str(c_l)), ("hydraulics.command.target", "1e-5"),
        ("hydraulics.command.t_start", "0.05"), ("hydraulics.command.ramp_time", "0.01"),
    )  # fmt: skip
    for method in NAMES:
        for ms in (4.0, 2.0, 1.0, 0.5):
            h = ms * 1e-3
            c = coupled(build / "deepsea_11km.ssp", step=h, method=method, stop_time=0.6, changes=tap)
            ring = c["arm.v_h"][c["time"] > 0.12][:: round(SPACING / h)]
            found = poles(ring, SPACING, ORDER)
            pole = found[np.argmin(np.abs(found - omega * complex(-ratio, np.sqrt(1 - ratio**2))))]
            zeta = -pole.real / abs(pole)
            numerical = zeta - ratio
            print(
                f"| {method} | {ms:g} ms | {omega * h:.3f} | {abs(pole) / 2 / np.pi:.3f} Hz | {zeta:.4f} | "
                f"{numerical:+.4f} | {numerical / (omega * h):+.2f} |"
            )


def main() -> None:
    """Print both tables."""
    if len(sys.argv) > 1:
        if not (Path(sys.argv[1]) / "deepsea_11km.ssp").is_file():
            sys.exit(f"{sys.argv[1]}: no folder with the packages of `cosim-fmus build --out FOLDER`")
        errors(Path(sys.argv[1]))
        damping(Path(sys.argv[1]))
        return
    from deepsea_cosim.fmus.build import build

    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        errors(Path(folder))
        damping(Path(folder))


if __name__ == "__main__":
    main()
