"""A case for every row that no edition before the third had."""

from benchmarks.blind.effects import known
from benchmarks.blind.every import found, rows


def test_rows_are_those_that_no_edition_before_had():
    before = {e.id for e in known(2)}
    assert {e.id for e in rows()} == {e.id for e in known(3) if e.drawn} - before


def test_a_line_a_row_says_what_was_found_by_name_or_by_its_group(tmp_path):
    table = tmp_path / "cases.csv"
    table.write_text(
        "case,kind,true,shares,size,left,said,exact,missed,false,search_gap,drawer,wall_s\n"
        "case_0000,single,silt_lock,1,2.9,,valve_dead_zone|silt_lock,1,0,0,,,60\n"
        "case_0001,single,tether,1,9,,payload_error,0,0,0,,,60\n"
        "case_0002,single,viv,1,3,,,0,1,0,,,60\n"
    )
    by_name, by_group, missed = found(table).splitlines()
    assert "found by name" in by_name
    assert "found " in by_group
    assert "by name" not in by_group
    assert missed.split() == ["viv", "3.0", "missed", "-"]
