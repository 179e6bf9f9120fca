"""Runs of the toy oscillator as loggers leave them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.gap.oscillator import EFFECTS, STOP, measure
from tests.toys import package


@dataclass(frozen=True, eq=False)
class Rig:
    """The package without a catalogue and with one, and columns time [s], force [N], position [m] of two runs."""

    plain: Path
    packed: Path
    runs: list[np.ndarray]


@pytest.fixture(scope="session")
def rig(toys, tmp_path_factory):
    import zipfile

    folder = tmp_path_factory.mktemp("rig")
    plain = package(folder / "plain.ssp", {"o": toys / "Oscillator.fmu"}, stop=STOP, step=4e-3)
    packed = package(folder / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=STOP, step=4e-3)
    with zipfile.ZipFile(packed, "a") as archive:
        archive.writestr("resources/effects.toml", EFFECTS)
    return Rig(plain, packed, [measure(seed, lambda t, x, v: -0.4 * np.tanh(v / 0.01)) for seed in (1, 2)])


@pytest.fixture
def written(rig, tmp_path):
    """Writes a run as a file: head, columns of the toy's table times factors, and how numbers are written."""

    def write(name, head, columns, run=0, delimiter=",", decimal=".", encoding="utf-8", above="", change=None):
        table = rig.runs[run].copy()
        if change is not None:
            table = change(table)
        rows = [delimiter.join(f"{k * row[j]:.7g}".replace(".", decimal) for j, k in columns) for row in table]
        path = tmp_path / "data" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(above + head + "\n" + "\n".join(rows) + "\n", encoding=encoding)
        return path

    return write
