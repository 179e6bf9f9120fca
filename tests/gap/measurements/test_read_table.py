"""Files of measurements in every format that is read, written here by the libraries of those formats."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import datetime, timedelta
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.gap.measurements import delimited_text
from deepsea_cosim.gap.measurements.binary import as_floats, from_datetimes
from deepsea_cosim.gap.measurements.read_table import read_table
from deepsea_cosim.gap.measurements.table import MeasurementError, TextFormat
from deepsea_cosim.gap.settings import FILE_LIMITS

T = np.arange(40) * 0.25
X = np.sin(T)


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_text(text, encoding=encoding)
    return path


def lines(delimiter: str, decimal: str, head: list[str], times: list[str] | None = None) -> str:
    numbers = [str(t) for t in T] if times is None else times
    rows = [[t, str(x), str(10 + k)] for k, (t, x) in enumerate(zip(numbers, X, strict=True))]
    if times is None or decimal == ",":
        rows = [[cell.replace(".", decimal) for cell in row] for row in rows]
    return "\n".join(delimiter.join(row) for row in [head, *rows]) + "\n"


@pytest.mark.parametrize(("delimiter", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")])
def test_delimiter_and_decimal_are_recognised(tmp_path, delimiter, decimal):
    table = read_table(write(tmp_path / "a.csv", lines(delimiter, decimal, ["time", "x", "n"])))
    assert table.names == ["x", "n"]
    assert np.array_equal(table.columns["x"].time, T)
    assert np.array_equal(table.columns["x"].values, X)
    assert table.place(3).endswith("a.csv, line 5")


@pytest.mark.parametrize(("delimiter", "decimal"), [("|", ","), (" ", "."), (" ", ","), (";", ","), (",", ".")])
def test_delimiter_and_decimal_as_told(tmp_path, delimiter, decimal):
    path = write(tmp_path / "a.txt", lines(delimiter, decimal, ["time", "x", "n"]))
    assert np.array_equal(read_table(path, TextFormat(delimiter, decimal)).columns["x"].values, X)


def test_a_name_with_another_delimiter_in_it(tmp_path):
    table = read_table(write(tmp_path / "a.csv", 'time,"x; filtered",P\n0,1,2\n1,2,3\n'))
    assert table.names == ["x; filtered", "P"]


def test_row_of_units(tmp_path):
    text = "time;x;flow [l/min]\n[ms];mm;\n\n0,5;1;2\n1,5;;3\n"
    table = read_table(write(tmp_path / "a.csv", text))
    assert table.time_unit == "ms"
    assert table.columns["x"].unit == "mm"
    assert table.columns["flow"] is table.columns["flow [l/min]"]
    assert table.columns["flow"].unit == "l/min"
    assert np.array_equal(table.columns["x"].values, [1.0, np.nan], equal_nan=True)
    assert table.lines.tolist() == [4, 5]


@pytest.mark.parametrize(
    ("first", "written"),
    [
        (datetime(2024, 5, 31, 23, 59, 58), lambda s: s.isoformat()),
        (datetime(2024, 5, 31, 23, 59, 58), lambda s: s.isoformat(" ", "milliseconds")),
        (datetime(2024, 5, 31, 23, 59, 58), lambda s: s.isoformat(timespec="milliseconds") + "+02:00"),
        (datetime(2024, 5, 31, 23, 59, 58), lambda s: s.strftime("%d.%m.%Y %H:%M:%S.%f")),
        (datetime(2024, 5, 31, 23, 59, 58), lambda s: s.strftime("%H:%M:%S.%f")),  # over midnight
    ],
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_time_stamps(tmp_path, first, written, decimal):
    stamps = [written(first + timedelta(seconds=t)) for t in T]
    if decimal == ",":
        stamps = [s[:-7] + s[-7:].replace(".", ",") for s in stamps]
    text = lines(";", ".", ["When", "x", "n"], stamps)
    table = read_table(write(tmp_path / "a.csv", text))
    assert np.array_equal(table.columns["x"].time, T)
    assert table.first_stamp is not None
    assert np.array_equal(table.columns["x"].values, X)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,x\n0,1_0\n", "line 2: '1_0' is not a number"),
        ("time,x\n0,\u0661\u0662\n", "is not a number"),
        ("time,x\n0,0x1F\n", "is not a number"),
        ("time,x\n0,five\n", "line 2: 'five' is not a number"),
        ("time;x\n0;1,5\n1;2.5\n", "line 3: '2.5' is not a number; the fraction begins with ','"),
        ("time;x\n0;1.234,5\n", "is not a number"),
        ("time,x\n0,5,1,5\n", "4 cells where the head has 2: where commas are in the numbers, semicolons"),
        ("time,x\n0,1e200\n", "line 2: 1e200 is no quantity of a machine"),
        ("zeit,x\n0,1\n", "first column is 'zeit'"),
        ("When,x\n05/03/2024 10:00:00,1\n", "leaves open which is the day"),
        ("When,x\n10:00:00,1\n2024-05-31T10:00:01,2\n", "line 3: .* of another kind"),
        ("When,x\n10:00:00,1\n5,2\n", "line 3: '5' is no time stamp"),
        ("", "is empty"),
        ("time,x,x\n0,1,2\n", "two columns 'x'"),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path, text, message):
    with pytest.raises(MeasurementError, match=message) as error:
        read_table(write(tmp_path / "a.csv", text))
    assert "\n" not in str(error.value)
    assert "a.csv" in str(error.value)


def test_other_encodings_and_spreadsheets(tmp_path):
    files = {"u.csv": "time,x\n0,1\n".encode("utf-16"), "s.xlsx": b"PK\x03\x04abc", "z.gz": b"\x1f\x8b0"}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(MeasurementError, match=r"save|unpack"):
            read_table(tmp_path / name)


def test_regular_files_only(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, kind in ((tmp_path / "pipe", "pipe"), (tmp_path, "folder"), (Path("/dev/zero"), "device")):
        with pytest.raises(MeasurementError, match=f"is a {kind}"):
            read_table(path)
    with pytest.raises(MeasurementError, match=r"none.csv: cannot be read"):
        read_table(tmp_path / "none.csv")


def test_matlab_5(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"t": T[:, None], "x": X, "both": np.c_[X, 2 * X], "note": "text", "k": 3.0})
    table = read_table(tmp_path / "a.mat")
    assert table.names == ["x", "both(:,1)", "both(:,2)"]
    assert np.array_equal(table.columns["both(:,2)"].values, 2 * X)
    savemat(tmp_path / "s.mat", {"log": {"time": T, "x": X, "short": X[:5]}})
    table = read_table(tmp_path / "s.mat")
    assert np.array_equal(table.columns["x"].time, T)
    assert table.names == ["x"]
    assert "short" in table.unusable


def test_matlab_7_3(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        group = file.create_group("log")  # as MATLAB writes a struct of columns: rows and columns exchanged
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in (("time", T[None, :]), ("x", X[None, :]), ("both", np.c_[X, 2 * X].T)):
            group.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_("double")
        group.create_dataset("note", data=np.array([[72, 73]], "u2")).attrs["MATLAB_class"] = np.bytes_("char")
    content = bytearray((tmp_path / "a.mat").read_bytes())
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64"
    content[: len(head)] = head
    (tmp_path / "a.mat").write_bytes(content)
    table = read_table(tmp_path / "a.mat")
    assert sorted(table.names) == ["both(:,1)", "both(:,2)", "x"]
    assert np.array_equal(table.columns["both(:,2)"].values, 2 * X)
    assert np.array_equal(table.columns["x"].time, T)


def test_parquet(tmp_path):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    schema = pa.schema([pa.field("time", pa.float64()), pa.field("x", pa.float64(), metadata={"unit": "mm"})])
    parquet.write_table(pa.table({"time": T, "x": [None, *X[1:]]}, schema=schema), tmp_path / "a.parquet")
    table = read_table(tmp_path / "a.parquet")
    assert table.columns["x"].unit == "mm"
    assert np.isnan(table.columns["x"].values[0])
    assert np.array_equal(table.columns["x"].values[1:], X[1:])
    stamps = np.datetime64("2024-05-31T10:00:00") + (T * 1e3).astype("timedelta64[ms]")
    parquet.write_table(pa.table({"when": stamps, "x": X, "name": ["a"] * len(T)}), tmp_path / "b.parquet")
    table = read_table(tmp_path / "b.parquet")
    assert np.array_equal(table.columns["x"].time, T)
    assert table.first_stamp == datetime(2024, 5, 31, 10)
    assert table.unusable == {"name": "is not of numbers"}


def test_tdms(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    start = np.datetime64("2024-05-31T10:00:00")
    timing = {"wf_increment": 0.25, "wf_start_offset": 0.0, "unit_string": "bar"}
    channels = [
        nptdms.ChannelObject("slow", "p", X, {**timing, "wf_start_time": start}),
        nptdms.ChannelObject("late", "q", X[:10], {**timing, "wf_start_time": start + np.timedelta64(500, "ms")}),
        nptdms.ChannelObject("late", "r", X[:10], {"wf_start_time": start}),
    ]
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(channels)
    table = read_table(tmp_path / "a.tdms")
    assert table.columns["p"].unit == "bar"
    assert np.array_equal(table.columns["p"].time, T)
    assert np.allclose(table.columns["q"].time, 0.5 + T[:10])
    assert np.array_equal(table.columns["q"].values, X[:10])
    assert list(table.unusable) == ["r"]
    assert table.first_stamp == datetime(2024, 5, 31, 10)
    with nptdms.TdmsWriter(tmp_path / "b.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("g", "time", T), nptdms.ChannelObject("g", "x", X)])
    table = read_table(tmp_path / "b.tdms")
    assert np.array_equal(table.columns["x"].time, T)
    assert table.time_unit is None


def test_tdms_with_times_in_several_units(tmp_path):
    nptdms = pytest.importorskip("nptdms")

    def written(stated):
        with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
            of_time = {"unit_string": stated} if stated else {}
            writer.write_segment([
                nptdms.ChannelObject("g", "time", 1e3 * T, of_time), nptdms.ChannelObject("g", "x", X),
                nptdms.ChannelObject("h", "y", X, {"wf_increment": 0.25}),
            ])  # fmt: skip
        return tmp_path / "a.tdms"

    table = read_table(written("ms"))
    assert table.time_unit == "s"
    assert np.allclose(table.columns["x"].time, T)
    assert np.array_equal(table.columns["y"].time, T)
    for stated, told in (("", "in no unit that is told"), ("bar", "in 'bar'")):
        with pytest.raises(MeasurementError, match=rf"a\.tdms: the times of 'x' are {told}, .*: state the unit"):
            read_table(written(stated))


def test_mdf4(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, T, name="x", unit="mm"), asammdf.Signal(2 * X, T, name="y")])
        file.append([asammdf.Signal(X[::2].copy(), T[::2].copy(), name="half", unit="bar")])
        file.save(tmp_path / "a.mf4")
    table = read_table(tmp_path / "a.mf4")
    assert sorted(table.names) == ["half", "x", "y"]
    assert np.array_equal(table.columns["half"].time, T[::2])
    assert np.array_equal(table.columns["y"].values, 2 * X)
    assert table.columns["x"].unit == "mm"


@pytest.mark.parametrize(
    ("begin", "module"),
    [(b"TDSm", "nptdms"), (b"MDF     4.10", "asammdf"), (b"PAR1", "pyarrow.parquet"), (b"\x89HDF\r\n\x1a\n", "h5py")],
)
def test_a_missing_library_says_which_extra_and_a_broken_file_that_it_is(tmp_path, monkeypatch, begin, module):
    (tmp_path / "a.bin").write_bytes(begin + b"rest")
    if _installed(module):
        with pytest.raises(MeasurementError, match=r"is it complete|has no channels"):
            read_table(tmp_path / "a.bin")
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MeasurementError, match=r"\[formats\]"):
        read_table(tmp_path / "a.bin")


def _installed(module: str) -> bool:
    try:
        import_module(module)
    except ImportError:
        return False
    return True


def test_a_cut_off_mdf_file(tmp_path, capfd):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, T, name="x")])
        file.save(tmp_path / "a.mf4")
    content = (tmp_path / "a.mf4").read_bytes()
    for size in (70, 1000, len(content) - 5):
        (tmp_path / "b.mf4").write_bytes(content[:size])
        with pytest.raises(MeasurementError, match="is it complete"):
            read_table(tmp_path / "b.mf4")
    assert capfd.readouterr().err == ""


def one_by_one(monkeypatch):
    """Reading without the fast way."""
    monkeypatch.setattr(delimited_text, "plain_rows", lambda *_: None)


@pytest.mark.parametrize(
    ("delimiter", "mark", "odd"),
    [(",", ".", {}), (";", ",", {}), ("\t", ".", {}), (";", ".", {40: "nan"}),
     (",", ".", {7: "", 30: "+1.5", 55: ".5"}), (",", ".", {20: "007", 21: "", 22: ""}),
     (";", ",", {10: '"3,5"'}), (",", ".", {0: "1", 1: "2"})],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_many_rows_at_once_are_those_one_by_one(tmp_path, monkeypatch, delimiter, mark, odd, end):
    """Whatever the blocks: bit for bit, with the lines."""
    x = np.random.default_rng(1).normal(size=(60, 2)) * [1.0, 1e9]
    cells = [[f"{k}", *(repr(v).replace(".", mark) for v in row)] for k, row in enumerate(x.tolist())]
    for k, text in odd.items():
        cells[k][2] = text
    path = tmp_path / "run.csv"
    path.write_bytes(end.join(delimiter.join(row) for row in [["time", "a", "b"], *cells, []]).encode())
    read = []
    for size in (1, 100, 10**6):
        monkeypatch.setattr(delimited_text, "FILE_LIMITS", replace(FILE_LIMITS, block=size))
        read.append(read_table(path))
    one_by_one(monkeypatch)
    slow = read_table(path)
    for table in read:
        assert table.lines.tolist() == slow.lines.tolist()
        for name in ("a", "b"):
            assert np.array_equal(table.columns[name].values, slow.columns[name].values, equal_nan=True)


@pytest.mark.parametrize("wrong", ["1,2", "1,2,3,4", "1,true,3", "1,[2],3", "1,1_0,3", "1,1e200,3", "1,2 3,4"])
def test_what_is_wrong_in_many_rows_is_told_with_its_line(tmp_path, monkeypatch, wrong):
    lines = ["time,a,b", *(f"{k},{k}.5,2" for k in range(40)), wrong, *(f"{k},1,2" for k in range(50, 60))]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(MeasurementError, match="line 42") as fast:
        read_table(path)
    one_by_one(monkeypatch)
    with pytest.raises(MeasurementError) as slow:
        read_table(path)
    assert str(fast.value) == str(slow.value)


def test_a_time_that_is_missing_is_none():
    stamps = np.array(["2024-05-01T00:00:00", "NaT", "2024-05-01T00:00:02"], "datetime64[s]")
    seconds, _ = from_datetimes(stamps)
    assert np.isnan(seconds).tolist() == [False, True, False]
    assert np.isnan(as_floats(stamps - stamps[0])).tolist() == [False, True, False]
