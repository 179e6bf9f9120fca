"""Metrics on signals whose answers are closed forms."""

import numpy as np
import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.study.sweep.metrics import parse_metric

T = np.linspace(0.0, 10.0, 1001)
RISE = np.minimum(T / 4.0, 1.0)
WAVE = np.sin(2 * np.pi * T)


def of(text, x, t=T):
    return parse_metric(text).of(t, x)


@pytest.mark.parametrize(
    ("text", "x", "value"),
    [
        ("initial(a.x)", RISE + 3, 3.0),
        ("final(a.x)", RISE, 1.0),
        ("min(a.x)", WAVE, -1.0),
        ("max(a.x)", WAVE, 1.0),
        ("range(a.x)", WAVE, 2.0),
        ("mean(a.x)", RISE, (0.5 * 4 + 6) / 10),
        ("integral(a.x)", RISE, 8.0),
        ("rms(a.x)", WAVE, 0.5**0.5),
        ("at(a.x, 2)", RISE, 0.5),
        ("above(a.x, 0.5)", RISE, 8.0),
        ("above(a.x, 0)", WAVE, 5.0),
        ("reaches(a.x, 1, 0.1)", RISE, 3.6),
        ("reaches(a.x, 1, 0.1, 3)", RISE, 0.6),
        ("reaches(a.x, 0, 0.1)", RISE, 0.0),
        ("settles(a.x, 1, 0.1)", RISE, 3.6),
        ("settles(a.x, 0, 1.5)", WAVE, 0.0),
        ("reaches(a.x, 0.5004, 1e-6)", RISE, 2.0016),  # passed between two samples
        ("reaches(a.x, 0.5, 0.1, 1.005)", RISE, 0.595),
        ("settles(a.x, 1, 0.1, 1.005)", RISE, 2.595),
        ("settles(a.x, 1, 0.1, 0, 3.75005)", RISE, 3.6),  # until between two samples
    ],
)
def test_closed_forms(text, x, value):
    assert of(text, x) == pytest.approx(value, abs=2e-3)


def test_what_never_happens_is_empty():
    assert of("reaches(a.x, 2, 0.1)", RISE) is None
    assert of("settles(a.x, 0, 0.5)", WAVE + 1) is None
    assert of("at(a.x, 11)", RISE) is None
    assert of("settles(a.x, 1, 0.1, 11)", RISE) is None


def test_settling_differs_from_reaching_when_it_overshoots():
    x = 1.0 - np.exp(-T) * np.cos(4 * T)
    assert of("reaches(a.x, 1, 0.05)", x) < of("settles(a.x, 1, 0.05)", x)
    leaves = np.where(T < 5, RISE, 0.0)
    assert of("settles(a.x, 1, 0.1)", leaves) is None
    assert of("settles(a.x, 1, 0.1, 0, 4.9)", leaves) == pytest.approx(3.6)


def test_labels():
    assert parse_metric(" late = reaches( arm.x_h , 0.2, 1e-3,2 ) ").label == "late"
    assert parse_metric("reaches(arm.x_h, 0.20, 1e-3)").label == "reaches(arm.x_h, 0.2, 0.001)"


@pytest.mark.parametrize(
    ("text", "word"),
    [("arm.x_h", "expected"), ("finale(a.x)", "did you mean 'final'"), ("at(a.x)", "takes"), ("final(a.x, 1)", "takes"),
     ("at(a.x, soon)", "numbers"), ("at(, 1)", "takes"), ("reaches(a.x, 1, nan)", "takes")],
)  # fmt: skip
def test_nonsense_is_one_line(text, word):
    with pytest.raises(UsageError, match=word):
        parse_metric(text)


def test_what_jumps_across_arrives_at_the_near_edge():
    """From 0 to 1 between 1 s and 2 s, on a straight line: within 0.1 of 0.4 from 0.3 on."""
    t, x = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0, 1.0])
    assert of("reaches(a.x, 0.4, 0.1)", x, t) == pytest.approx(1.3)
    assert of("reaches(a.x, 0.4, 0.1)", 1.0 - x, t) == pytest.approx(1.5)
    assert of("reaches(a.x, 0.4, 0.1, 1.35)", x, t) == 0.0
    assert of("reaches(a.x, 0.4, 0.1, 1.6)", x, t) is None


def test_names_may_have_brackets_and_commas():
    for name in ("b.D[1,2]", "pump (left).q", "a.x[3]", "f(x, y).z"):
        metric = parse_metric(f"late = at({name}, 2)")
        assert (metric.label, metric.connector, metric.numbers) == ("late", name, (2.0,))
        assert parse_metric(str(metric)).connector == name
