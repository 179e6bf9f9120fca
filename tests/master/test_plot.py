"""What overview.png shows, by the lines and names that are drawn."""

from __future__ import annotations

import io

import numpy as np
import pytest
from deepsea_cosim.master.simulation import plot
from deepsea_cosim.master.simulation.plot import Panel, draw, panels

T = np.linspace(0.0, 1.0, 11)


def shown(columns, units=(), connected=(), asked=False):
    """The figure of these columns: texts of each panel's legend, lines of each panel, its title."""
    from matplotlib.figure import Figure

    made = []

    class Kept(Figure):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            made.append(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure", Kept)
        rows = np.stack([T, *columns.values()], axis=1)
        draw(io.BytesIO(), "title", ["time", *columns], dict(units), list(connected), rows, asked)
    axes = [axis for axis in made[0].axes if axis.get_visible()]
    legends = [[t.get_text() for t in axis.get_legend().get_texts()] if axis.get_legend() else [] for axis in axes]
    lines = [[line.get_ydata() for line in axis.get_lines() if len(line.get_xdata())] for axis in axes]
    return legends, lines, made[0].get_suptitle()


def test_a_constant_is_drawn_where_nothing_changes_or_it_is_asked_for():
    legends, lines, _ = shown({"a.x": np.full(11, 3.0), "a.y": np.full(11, 0.0)})
    assert legends == [["a.x", "a.y"]]
    assert lines[0][0].tolist() == [3.0] * 11
    assert shown({"a.x": np.full(11, 3.0), "a.y": T})[0] == [["a.y"]]
    assert shown({"a.x": np.full(11, 3.0), "a.y": T}, asked=True)[0] == [["a.x", "a.y"]]


def test_elements_of_arrays_are_drawn_where_asked_for_or_where_they_drive_or_alone():
    columns = {"a.x[1]": T, "a.x[2]": 2 * T, "a.y": 3 * T}
    assert shown(columns)[0] == [["a.y", "and 2 more"]]
    assert shown(columns, connected=["a.x[2]"])[0] == [["a.x[2]", "a.y", "and 1 more"]]
    assert shown(columns, asked=True)[0] == [["a.x[1]", "a.x[2]", "a.y"]]
    assert shown({"a.x[1]": T, "a.x[2]": 2 * T})[0] == [["a.x[1]", "a.x[2]"]]
    assert shown(columns, {"a.x[1]": "K", "a.x[2]": "K"})[0] == [["a.y"], ["a.x[1]", "a.x[2]"]]


def test_signals_beyond_what_is_drawn_are_counted():
    many = {f"a.y{k}": k + T for k in range(30)}
    assert shown(many)[0][0][-2:] == ["a.y7", "and 22 more"]
    legend = shown(many, asked=True)[0][0]
    assert legend[-2:] == ["a.y19", "and 10 more"]
    units = {name: f"u{k}" for k, name in enumerate(many)}
    legends, _, title = shown(many, units)
    assert len(legends) == 6
    assert "24 more" in title
    assert "1 in u6" in title
    legends, _, title = shown(many, units, asked=True)
    assert len(legends) == 12
    assert "18 more" in title


def test_texts_are_no_lines():
    texts = np.full(11, np.nan)
    assert shown({"a.s": texts, "a.y": T})[0] == [["a.y"]]
    assert shown({"a.s": texts})[1] == [[]]


@pytest.mark.parametrize(("size", "unit", "factor"), [(1e6, "MPa", 1e-6), (1.0, "Pa", 1.0)])
def test_the_unit_suits_the_numbers(size, unit, factor):
    lines = shown({"a.p": size * T}, {"a.p": "Pa"})[1]
    assert lines[0][0][-1] == pytest.approx(size * factor)


@pytest.mark.parametrize("name", ["_a.y", "a.$x$", "a.$\\frac", "a.y" * 60])
def test_names_are_shown_as_they_are(name):
    legend = shown({name: T})[0][0]
    assert legend[0].strip().replace("\\$", "$") == name


def test_panels_of_a_run_with_few_signals():
    rows = np.stack([T, T, 2 * T], axis=1)
    made = panels(["time", "a.v", "a.F"], {"a.v": "m/s", "a.F": "N"}, ["a.F"], rows, False)
    assert made == ([Panel("N", ("a.F",)), Panel("m/s", ("a.v",))], {})
    assert plot.MAX_LINES == 8
