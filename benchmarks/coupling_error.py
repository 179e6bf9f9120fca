"""How far the coupled run is from the monolithic reference, by step and method, and how much damping the coupling adds.

    python benchmarks/coupling_error.py [BUILD_FOLDER] [TABLE ...]

The folder holds the packages made by `cosim-fmus build`; without it they are built anew. Run from the repository. The
tables: shipped (every scenario as it is shipped), trapped (trapped oil after fast ramps), methods, damping; without a
name all of them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from deepsea_cosim.fmus.build import SYSTEMS, system_folder
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from tests.reference import monolith
from tests.reference.compare import deviation

SPACING, ORDER = 8e-3, 4
"""Samples [s] and number of poles for the ring-down."""


RAMPS = (5.0, 4.0, 3.3, 3.0, 2.75, 2.5, 2.0, 1.0)
"""Ramps of the command after which oil is trapped or not, at 3 km [s]."""

TRAPPED = (("gauss-seidel", 1.0), ("gauss-seidel", 0.5), ("nepce", 2.0), ("nepce", 1.0))
"""Methods and steps [ms] for them."""


def coupled(package: Path, **options: object) -> dict[str, np.ndarray]:
    """Columns of a run by name."""
    with tempfile.TemporaryDirectory() as folder:
        result = run(package, Path(folder), Options(**options))
        table = np.loadtxt(Path(folder) / "results.csv", delimiter=",", skiprows=1)
    return {name: table[:, i] for i, name in enumerate(result.names)}


def machine_of(package: Path) -> monolith.Machine:
    """The monolith of a scenario with one axis."""
    with Session(package) as session:
        values = session.values()
    start, ramp, hold = (float(values[f"hydraulics.command.{n}"]) for n in ("t_start", "ramp_time", "hold_time"))
    return monolith.Machine(
        depth=float(values["hydraulics.depth"]) / 1e3,
        variable_viscosity=bool(values["hydraulics.line.variable_viscosity"]),
        extend_start=start, extend_end=start + ramp, retract_start=start + ramp + hold,
        retract_end=start + 2.0 * ramp + hold,
    )  # fmt: skip


def shipped(build: Path) -> None:
    """Table of every scenario with the method and the step that it comes with."""
    from benchmarks import two_axes

    print("| scenario | method | step | max x_h error | max pressure error |\n| --- | --- | --- | --- | --- |")
    for name in [path.stem for system in SYSTEMS for path in sorted(system_folder(system).glob("*.ssv"))]:
        package = build / f"{name}.ssp"
        with tempfile.TemporaryDirectory() as folder:
            summary = run(package, Path(folder), Options(results="", stop_time=0.01)).summary
        method, step = summary["method"], summary["step_s"]
        if name == "two_axes":
            error = two_axes.errors(package, runs=((method, step),))[0]
            x, p = max(error[[0, 3]]), max(error[[1, 2, 4, 5]])
        else:
            machine, stride = machine_of(package), round(step / 1e-3)
            truth = monolith.solve(machine, np.arange(22001) * 1e-3, rtol=1e-9)
            x, _, p = deviation(coupled(package), truth, stride, machine.corners)
        pressure = f"{p / 1e3:.1f} kPa ({p / 20e4:.2f} %)"
        print(f"| `{name}` | {method} | {1e3 * step:g} ms | {1e3 * x:.4f} mm | {pressure} |", flush=True)


def trapped(build: Path) -> None:
    """Table of what ramps of other lengths leave trapped at 3 km, and of what the runs say of it."""
    package = build / "deepsea_3km.ssp"
    print("| ramp | method | step | max x_h error | max pressure error | the run says |\n" + "| --- " * 6 + "|")
    for ramp in RAMPS:
        stop = 12.0 + 2.0 * ramp
        corners = 2.0, 2.0 + ramp, 7.0 + ramp, 7.0 + 2.0 * ramp
        machine = monolith.Machine(3.0, True, 5, **dict(zip(
            ("extend_start", "extend_end", "retract_start", "retract_end"), corners, strict=True)))  # fmt: skip
        truth = monolith.solve(machine, np.arange(round(stop * 2000) + 1) * 0.5e-3, rtol=1e-9)
        for method, ms in TRAPPED:
            options = Options(
                step=ms * 1e-3, method=method, stop_time=stop, changes=(("hydraulics.command.ramp_time", str(ramp)),)
            )
            with tempfile.TemporaryDirectory() as folder:
                result = run(package, Path(folder), options)
                table = np.loadtxt(Path(folder) / "results.csv", delimiter=",", skiprows=1)
            c = {name: table[:, i] for i, name in enumerate(result.names)}
            x, _, p = deviation(c, truth, round(ms / 0.5), corners)
            doubt = result.summary["doubt"]
            off = f"{100 * doubt['signal_off']:.0f} % of {doubt['signal']}" if doubt else ""
            loud = any("leaves a rest" in text for text in result.summary["warnings"])
            print(
                f"| {ramp:g} s | {method} | {ms:g} ms | {1e3 * x:.4f} mm | {p / 1e3:.0f} kPa ({p / 20e4:.1f} %) | "
                f"{off if loud else ''} |", flush=True,
            )  # fmt: skip


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


TABLES = {"shipped": shipped, "trapped": trapped, "methods": errors, "damping": damping}


def main() -> None:
    """Print the tables."""
    given = sys.argv[1:]
    asked = [word for word in given if word in TABLES] or list(TABLES)
    folders = [word for word in given if word not in TABLES]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(folders[0] if folders else scratch)
        if not folders:
            from deepsea_cosim.fmus.build import build

            build(folder)
        elif not (folder / "deepsea_11km.ssp").is_file():
            sys.exit(f"{folder}: no folder with the packages of `cosim-fmus build --out FOLDER`")
        for name in asked:
            TABLES[name](folder)


if __name__ == "__main__":
    main()
