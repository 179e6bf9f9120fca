"""What the terminal shows: few short lines, whatever the diagnosis holds and whatever the output can show."""

import pytest
from deepsea_cosim.gap.report.parts import pieces
from deepsea_cosim.gap.settings import TerminalSettings
from deepsea_cosim.gap.summary import BLOCKS, _mark_of, bar, lines

from .report.made import NASTY, VERDICTS, diagnosis, effect, signals, unexplained

LAYOUT = TerminalSettings()
EVENT = {
    "run": "run01", "event": "x reaches 0.2", "limit": "", "measured": 7.625, "std": 0.02, "delivered": 6.206,
    "calibrated": 7.729, "explained": 7.634,
}  # fmt: skip


def crowded():
    """More of everything than fits, with long names."""
    data = diagnosis(headline="word " * 400, campaign=NASTY, events=[EVENT] * 9, contrasts=[])
    data["budget"]["parts"] = [effect(f"group{k}" * 5, {f"effect{k}" * 9: 0.5, "b": 0.5}, 0.1) for k in range(9)]
    data["budget"]["parts"].append({**unexplained(0.1, 3.7), "character": "word " * 90})
    channels = data["budget"]["per_channel"]
    channels |= {f"long.{'name' * 20}{k}": channels["arm.x_h"] for k in range(9)}
    data["where"] = [{**data["where"][0], "region": "while " * 40}] * 5
    data["next_experiment"]["change"] = {f"parameter{k}": 1.0 for k in range(40)}
    return data


@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "cp1252", None])
@pytest.mark.parametrize("make", [crowded, *(lambda v=v: diagnosis(v) for v in VERDICTS)])
def test_never_more_than_fits(make, encoding):
    found = lines(make(), signals(), encoding, "results/pool: diagnosis.json")
    assert len(found) <= 25
    assert max(map(len, found)) <= 100
    assert found[-1] == "results/pool: diagnosis.json"
    for line in found:
        line.encode(encoding or "ascii")
        assert line.isprintable()


def test_tells_the_budget_in_units():
    text = "\n".join(lines(diagnosis(), signals()))
    for told in ("Explained in part.", "14.2 → 9.70 → 3.70 times the noise",
                 "friction (cylinder_stribeck_friction or cylinder_coulomb_friction) 62 % (56 to 66 %)",
                 "█ friction", "▓ valve_dead_zone", "F_extra 510 N (430 to 600)", "14 % (13 to 15 %) in no effect",
                 "0.426 mm → 0.291 mm → 0.111 mm; noise 0.0300 mm", "x 54 % (extending)", "depth = 6000 m",
                 "900 runs in 41 s; 1 warning"):  # fmt: skip
        assert told in text, told


def test_moments_come_with_seconds():
    text = "\n".join(lines(diagnosis(events=[EVENT]), signals()))
    assert "run01, x reaches 0.2: measured 7.625 s; 6.206 → 7.729 → 7.634 s" in text


def test_units_of_the_file_where_no_signals_are_known():
    assert "2.84 × 10⁵ Pa" in "\n".join(lines(diagnosis()))


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_part_that_is_not_minor_is_on_the_bar(verdict):
    budget = diagnosis(verdict)["budget"]
    budget["delivered"] = 1000.0  # calibration takes nearly all
    whole = pieces(budget, budget["parts"])
    mark = _mark_of(whole, BLOCKS)
    drawn = bar(whole, mark, 60)
    assert len(drawn) == 60
    assert all(mark[p.key] in drawn for p in whole if not p.minor and p.energy > 0.0)
