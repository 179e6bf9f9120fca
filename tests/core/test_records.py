"""Numbers by name in a row of float64, for Python and for compiled code."""

import numpy as np
import pytest
from deepsea_cosim.core.jit import kernel
from deepsea_cosim.core.records import places, record, row_of, size_of

MACHINE = record(("depth", "valve.k_q", "line.length", "valve.land.pa", "valve.curve[3]", "line.segments"))
VALUES = {"depth": 3.0, "valve.k_q": 0.5, "line.length": 4.0, "valve.land.pa": 7.0, "valve.curve": [1.0, 2.0, 6.0],
          "line.segments": 5.0}  # fmt: skip


@kernel
def told(row, out):
    c = row.view(MACHINE)[0]
    c.depth = 11.0
    out[0], out[1], out[2], out[3] = c.valve.k_q, c.valve.land.pa, c.valve.curve[2], c.line.segments


@pytest.mark.parametrize("run", [told, told.py_func], ids=["compiled", "python"])
def test_a_row_is_read_and_written_by_name(run):
    row, out = row_of(MACHINE, VALUES), np.zeros(4)
    run(row, out)
    assert out.tolist() == [0.5, 7.0, 6.0, 5.0]
    assert row[places(MACHINE)["depth"]].item() == 11.0


def test_every_number_has_a_place_of_its_own():
    row = row_of(MACHINE, VALUES)
    assert (len(row), size_of(MACHINE)) == (8, 8)
    taken = [k for at in places(MACHINE).values() for k in range(at.start, at.stop)]
    assert sorted(taken) == list(range(8))
    for name, at in places(MACHINE).items():
        assert row[at].tolist() == np.atleast_1d(VALUES[name]).tolist()


def test_a_value_that_is_missing_is_named():
    with pytest.raises(KeyError, match="segments"):
        row_of(MACHINE, {k: v for k, v in VALUES.items() if k != "line.segments"})


def test_a_name_that_numpy_uses_is_refused():
    """Compiled code would find the number, Python numpy's own."""
    with pytest.raises(ValueError, match="'T'"):
        record(("spool.T",))
