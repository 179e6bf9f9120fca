"""The bar of the budget: pieces that add up, labels that do not overlap, sentences with units."""

from itertools import combinations

import pytest
from deepsea_cosim.gap.report import bar, budget
from deepsea_cosim.gap.report.parts import amplitude, pieces
from deepsea_cosim.gap.result.channels import leading_channel

from .made import VERDICTS, diagnosis, effect, levels, signals, unexplained


def overlapping(labels):
    """Pairs of labels of one row that touch each other."""
    return [
        (a.text, b.text)
        for a, b in combinations(labels, 2)
        if a.row == b.row and a.x < b.x + b.width and b.x < a.x + a.width
    ]


@pytest.mark.parametrize("verdict", VERDICTS)
def test_pieces_add_up_to_the_squared_deviation_as_delivered(verdict):
    data = diagnosis(verdict)["budget"]
    if verdict == "no_significant_gap":
        data["parts"] = [unexplained(1.0, data["explained"])]
    assert sum(p.energy for p in pieces(data, data["parts"])) == pytest.approx(data["delivered"] ** 2)


def test_a_form_is_a_piece_of_its_effect():
    found = pieces(levels("explained_in_part"), diagnosis()["budget"]["parts"])
    spool = [p for p in found if "dead zone" in p.name]
    left = 9.7**2 - 1.0
    assert [p.kind for p in spool] == ["effect", "form"]
    assert [p.energy for p in spool] == pytest.approx([0.12 * left, 0.09 * left])
    assert [p.kind for p in found][-2:] == ["unexplained", "noise"]


@pytest.mark.parametrize(
    "changed",
    [
        {"delivered": 5.0, "calibrated": 9.0},  # held-out data that calibration takes further away
        {"delivered": 0.9, "calibrated": 0.8},  # below the noise
        {"delivered": 1e6, "calibrated": 1.0001},
    ],
)
def test_levels_out_of_order_make_no_negative_piece(changed):
    found = pieces({**levels("explained"), **changed}, [effect("a", {"x": 1.0}, -0.05), unexplained(1.05, 3.0)])
    assert all(p.energy >= 0.0 for p in found)
    drawn = bar.boxes(found, bar.colours(found))
    assert sum(b.width for b in drawn) == pytest.approx(bar.SIZE.width)


def test_labels_never_overlap():
    names = [f"group number {k}" for k in range(9)]
    small = [effect(n, {f"effect_{n}": 1.0}, 0.011) for n in names]
    parts = [effect("large", {"large_effect": 1.0}, 0.9), *({**p, "minor": False} for p in small)]
    for delivered in (9.8, 12.0, 900.0):
        numbers = {"noise": 1.0, "delivered": delivered, "calibrated": 9.7, "explained": 1.0}
        whole = pieces(numbers, parts)
        for strip in bar.budget_strips(numbers, whole, {p.key: f"{p.name} 1 %" for p in whole}):
            for labels in (strip.above, strip.below):
                assert not overlapping(labels)
                assert not [(a.text, b.text) for a, b in combinations(labels, 2) if a.collides(b)]
                assert all(label.x >= 0.0 and label.x + label.width <= bar.SIZE.width for label in labels)
            for text in strip.inside:
                box = max((b for b in strip.boxes if b.x <= text.x), key=lambda b: b.x)
                assert len(text.text) * bar.SIZE.character < box.width


def test_a_part_has_one_colour_in_all_bars_and_the_first_ones_differ():
    data = diagnosis()
    whole = pieces(data["budget"], data["budget"]["parts"])
    colour = bar.colours(whole)
    assert len({colour[p.key] for p in whole if p.kind != "form"}) == len([p for p in whole if p.kind != "form"])
    for row in budget.context(data, signals())["channels"]:
        widths = [b for b in row["boxes"] if b.width > 0.0]
        assert {b.colour for b in widths} <= set(colour.values())


def test_the_bar_is_drawn_again_where_calibration_takes_most_of_it():
    numbers = {"noise": 1.0, "delivered": 20.0, "calibrated": 5.0, "explained": 1.5}
    whole = pieces(numbers, [effect("friction", {"f": 1.0}, 0.9), unexplained(0.1, 1.5)])
    assert len(bar.budget_strips(numbers, whole, {})) == 2
    assert len(bar.budget_strips({**numbers, "delivered": 5.5}, whole[1:], {})) == 1


def test_context_in_the_unit_that_was_measured():
    found = budget.context(diagnosis(), signals())
    assert [c["delivered"] for c in found["channels"]] == ["0.426\u00a0mm", "2.84\u00a0bar", "2.84\u00a0bar"]
    assert found["channels"][0]["multiples"] == ["14.2", "9.70", "3.70"]
    friction = found["parts"][0]
    assert (friction["share"], friction["interval"]) == ("62\u00a0%", "56 to 66\u00a0%")
    assert friction["alone"] == "1.52\u00a0bar"  # sqrt(0.62 (9.7^2 - 1)) times 0.2 bar
    assert friction["parameters"][0]["neutral"] == "0\u00a0N"
    assert "2.84\u00a0bar" in found["sentence"]
    assert "friction and valve dead zone" in found["sentence"]
    assert "timing" not in found["sentence"]  # minor


def test_without_signals_units_are_those_of_the_file():
    found = budget.context(diagnosis(), budget.Signals())
    assert found["channels"][1]["noise"] == "20000\u00a0Pa"
    assert found["channels"][1]["column"] == "hydraulics.P1"


def test_amplitudes_add_up_as_squares():
    numbers = levels("explained_in_part")
    parts = [amplitude(s, numbers) for s in (0.62, 0.21, 0.03, 0.14)]
    assert sum(x**2 for x in parts) == pytest.approx(9.7**2 - 1.0)


def test_the_channel_that_effects_explain_speaks_else_the_one_furthest_off():
    far = {"delivered": 80.0, "calibrated": 1.0, "explained": 1.0, "noise": 1.0}
    told = {"delivered": 9.0, "calibrated": 6.0, "explained": 1.0, "noise": 1.0}
    found = {"per_channel": {"far": far, "told": told}, "parts": [{"kind": "effect", "minor": False}]}
    assert leading_channel(found) == "told"
    assert leading_channel({**found, "parts": [{"kind": "effect", "minor": True}]}) == "far"
    assert leading_channel({"per_channel": {}, "parts": []}) == ""
