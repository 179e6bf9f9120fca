"""Numbers as people write them, and nothing else."""

from __future__ import annotations

import math

import pytest
from deepsea_cosim.core.plain_numbers import plain_number, plain_whole


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1.0), ("-1.5e-3", -0.0015), (" +.5 ", 0.5), ("2.", 2.0), ("1E9", 1e9), ("INF", math.inf)],
)
def test_numbers(text, value):
    assert plain_number(text) == value


@pytest.mark.parametrize("text", ["1_0", "\u0661", "1,5", "0x10", "1e", "e5", "", "1 2", "one", "1" * 500, "1\x00"])
def test_what_is_none(text):
    with pytest.raises(ValueError, match="is not a number") as error:
        plain_number(text)
    assert len(str(error.value)) < 120


@pytest.mark.parametrize("text", ["1e400", "-1e999", "9" * 400])
def test_larger_than_a_number_can_be(text):
    with pytest.raises(ValueError, match="is larger than a number can be") as error:
        plain_number(text)
    assert len(str(error.value)) < 120


def test_whole_numbers():
    assert [plain_whole(t) for t in ("007", "-3", "+12")] == [7, -3, 12]
    for text in ("1.0", "1_0", "\u0661", ""):
        with pytest.raises(ValueError, match="is not a whole number"):
            plain_whole(text)
