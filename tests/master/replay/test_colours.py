"""Colours and labels stand for the values that the package names."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.display_units import DisplayUnits
from deepsea_cosim.master.replay.colours import RAMP, coloured_film, colours
from deepsea_cosim.master.replay.labels import arranged, labels
from deepsea_cosim.master.replay.stage import build
from deepsea_cosim.ssp.model import ReplayAsked, ReplayColour, ReplayLabel, ReplayScale

from .made import filmed, made_run, ram


def asked(least="", greatest="", geom="oil", formula="arm.p", labels=()):
    scale = ReplayScale("pressure", "pressure", "Pa", least, greatest, "p.ssd, line 1")
    return ReplayAsked((scale,), (ReplayColour("arm", geom, "pressure", formula, "p.ssd, line 2"),), labels)


@pytest.mark.parametrize(("ends", "times"), [(("", ""), (0.0, 2.0)), (("2.5", "arm.long * 7.5"), (0.5, 1.5))])
def test_the_ends_of_a_range_have_the_colours_of_its_ends(ends, times):
    run = made_run()
    stage = build([ram()], run)
    [scale], coloured, remarks = colours(asked(*ends), stage)
    assert remarks == []
    film = coloured_film(filmed(ram(), run, times), coloured, np.array(times))
    assert film.rgba[:, 0, :3] == pytest.approx(RAMP[[0, -1]])
    assert film.coloured.tolist() == [stage.model.geom("arm/oil").id]
    assert scale.rgba(np.array([-1e9, 1e9]))[:, :3] == pytest.approx(RAMP[[0, -1]])


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"geom": "oli"}, "did you mean 'oil'"),
        ({"formula": "arm.pp"}, "recorded no 'arm.pp'"),
        ({"formula": "1 +"}, "no formula"),
    ],
)
def test_what_cannot_be_coloured_is_told(wrong, told):
    scales, coloured, remarks = colours(asked(**wrong), build([ram()], made_run()))
    assert (scales, coloured, len(remarks)) == ((), (), 1)
    assert told in remarks[0]


def test_a_label_shows_its_value_in_the_units_of_the_reader():
    stage = build([ram()], made_run({"arm.angle": [0.0, 1.0], "arm.x": [0.0, 0.2]}))
    at = "p.ssd, line 3"
    told = tuple(ReplayLabel("arm", place, text, formula, "m", at) for place, text, formula in
                 (("eye", "rod {} out", "arm.x"), ("rod", "rod", ""), ("nose", "", "")))  # fmt: skip
    [rod, plain], remarks = labels(ReplayAsked(labels=told), stage, DisplayUnits())
    assert [rod.at(t) for t in (0.0, 1.0, 2.0)] == ["rod 0 mm out", "rod 100 mm out", "rod 200 mm out"]
    assert (plain.at(1.0), plain.place[0]) == ("rod", "body")
    assert "no place 'nose'" in remarks[0]


def test_labels_of_one_place_do_not_cover_each_other():
    anchors = np.full((5, 3, 2), 200.0)
    busy = np.full((5, 1, 2), 200.0)
    offsets = arranged(anchors, [(80.0, 20.0)] * 3, [(0, 0, 120, 60)], (400, 400), busy)
    boxes = [(x - 40, y - 10, x + 40, y + 10) for x, y in offsets]
    for k, one in enumerate(boxes):
        for other in boxes[:k]:
            assert one[2] < other[0] or other[2] < one[0] or one[3] < other[1] or other[3] < one[1]
