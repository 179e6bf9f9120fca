"""The oscillator that the diagnoses of the tests simulate."""

import numpy as np
import pytest
from deepsea_cosim.master.simulation.session import Session

from ..toys import package
from .oscillator import RATE, STOP, pushed

CHANGES = {
    "linear": {"m": 2.05, "k": 78.0, "d": 3.1},
    "rubs": {"F_c": 0.4, "uneven": 0.3},
    "stiffens": {"k3": 900.0, "gain": 0.9},
    "swings": {"mu": 8.0},
    "a curve": {f"y{k}": 0.1 * (k - 4.5) ** 3 for k in range(1, 9)},
}


@pytest.mark.parametrize("change", CHANGES)
def test_in_c_it_is_what_it_is_in_python(change, toys, tmp_path):
    if not (toys / "PythonOscillator.fmu").exists():
        pytest.skip("it is in Python only: there is no C compiler, or this is not Linux")
    t = np.arange(round(STOP * RATE) + 1) / RATE
    made = []
    for name in ("PythonOscillator", "Oscillator"):
        with Session(package(tmp_path / f"{name}.ssp", {"o": toys / f"{name}.fmu"})) as session:
            changes = {f"o.{parameter}": value for parameter, value in CHANGES[change].items()}
            for step in (0.02, 4e-3):
                made.append(session.run(["o.x", "o.v"], STOP, step, changes, {"o.u": (t, pushed(t, 1))})[1])
    assert np.ptp(made[0], axis=0).min() > 0.01
    np.testing.assert_array_equal(made[0], made[2])
    np.testing.assert_array_equal(made[1], made[3])
