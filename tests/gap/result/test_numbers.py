"""Numbers, units and names as a person reads them."""

import pytest
from deepsea_cosim.gap.result.numbers import (
    change,
    cleaned,
    listed,
    percent,
    pretty,
    printable,
    quantity,
    short,
    stated_value,
    with_interval,
)


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (short(0.0), "0"),
        (short(-0.012345), "−0.0123"),
        (short(123456.0), "1.23 × 10⁵"),
        (short(8.2e-5, 2), "8.2 × 10⁻⁵"),
        (short(999.96), "1000"),
        (short(float("nan")), "–"),
        (stated_value(1400000000.0), "1.4 × 10⁹"),
        (stated_value(True), "true"),
        (stated_value(3000.0), "3000"),
        (percent(0.003), "<1\u00a0%"),
        (percent(0.9999), ">99\u00a0%"),
        (percent(1.0), "100\u00a0%"),
        (percent(-0.25), "−25\u00a0%"),
        (change(-0.0001), "0\u00a0%"),
        (change(0.0312), "+3.1\u00a0%"),
        (pretty("m3/(s.Pa)"), "m³/(s·Pa)"),
        (pretty("1"), ""),
        (quantity(2.0, "1"), "2.00"),
        (with_interval(249.57, (246.5, 252.6)), ("249.6", "246.5 to 252.6", "")),
        (with_interval(3.66e-4, (1.4e-4, 5.9e-4)), ("3.7", "1.4 to 5.9", " × 10⁻⁴")),
        (with_interval(2.0e7, (1.9999e7, 2.0001e7)), ("2.0000", "1.9999 to 2.0001", " × 10⁷")),
        (with_interval(0.0, (0.0, 0.0)), ("0", "0 to 0", "")),
        (listed(["a"]), "a"),
        (listed(["a", "b", "c"], 2), "a, b and 1 more"),
        (listed(["a", "b"], word="or"), "a or b"),
    ],
)
def test_numbers(shown, expected):
    assert shown == expected


def test_names_lose_what_a_terminal_obeys():
    assert printable("a\x1b[31mb\u202ec\x00") == "a\ufffd[31mb\ufffdc\ufffd"
    assert printable("two\nlines\t") == "two lines"
    assert cleaned({"a\x07": ["b\x07", 1.5, None]}) == {"a\ufffd": ["b\ufffd", 1.5, None]}
