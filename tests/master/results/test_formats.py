"""Result files: the same frame from every format, and what is left when the disk is full or the process dies."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest
from deepsea_cosim import simulate
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.master.results import by_suffix, open_writer
from deepsea_cosim.master.results.blocks import whole
from deepsea_cosim.master.results.columns import TIME, Column
from deepsea_cosim.master.results.frame import frame

from tests.toys import package

pytest.importorskip("pandas")

COLUMNS = [TIME, Column("b.y", "float", "m"), Column("a.n", "integer"), Column("a/x", "float"), Column("a.s", "text")]


@pytest.fixture(params=[".csv", ".parquet", ".h5"])
def suffix(request):
    pytest.importorskip({".parquet": "pyarrow", ".h5": "h5py"}.get(request.param, "csv"))
    return request.param


def rows(n, first=0):
    t = np.arange(first, first + n, dtype=float)
    return [t, np.sin(t), np.arange(n), t / 3.0, ["two words, ü"] * n]


def test_a_frame_is_what_was_written(tmp_path, suffix):
    """Columns in their order, numbers bit for bit, texts as texts."""
    path = tmp_path / f"r{suffix}"
    writer = open_writer(path, COLUMNS)
    writer.write(rows(5000))
    writer.write(rows(10, 5000))
    writer.close(True)
    read = frame(path)
    assert list(read) == [c.name for c in COLUMNS]
    assert read["time"].tolist() == list(range(5010))
    assert read["a/x"].tolist() == (np.arange(5010.0) / 3.0).tolist()
    assert set(read["a.s"]) == {"two words, ü"}
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_every_suffix_has_a_format():
    assert set(by_suffix()) >= {".csv", ".parquet", ".h5", ".hdf5"}
    assert next(iter(by_suffix())) == ".csv"


PROGRAM = """
import resource, sys, os, signal
from pathlib import Path
from deepsea_cosim.core.errors import OutputError
from deepsea_cosim.master.results import open_writer
from deepsea_cosim.master.results.formats import parquet
sys.path.insert(0, {root!r})
from tests.master.results.test_formats import COLUMNS, rows
path = Path({path!r})
writer = open_writer(path, COLUMNS)
"""

FULL = """
resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))
try:
    for k in range(100_000):
        writer.write(rows(1000, 1000 * k))
except OutputError as error:
    print(k)
writer.close(False)
"""

KILLED = """
swap = parquet.exchange
def exchange(one, other):
    if {after}:
        swap(one, other)
    os.kill(os.getpid(), signal.SIGKILL)
parquet.exchange = exchange
parquet.MAX_PARTS = {most}
writer = open_writer(path, COLUMNS)
for k in range(20):
    writer.write(rows(10, 10 * k))
    print(k, flush=True)
writer.close(True)
"""


def python(request, path, text, **given):
    program = (PROGRAM + text).format(root=str(request.config.rootpath), path=str(path), **given)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no limits of resources")
def test_a_disk_that_is_full_leaves_the_rows_before(request, tmp_path, suffix):
    """A limit of the file's size stands for the disk: the writer says so, and the file can be read."""
    if suffix == ".parquet":
        pytest.skip("its parts are small files")
    done = python(request, tmp_path / f"r{suffix}", FULL)
    assert done.returncode == 0, done.stderr
    read = frame(tmp_path / f"r{suffix}")
    assert len(read) == 1000 * int(done.stdout)
    assert read["time"].tolist() == list(range(len(read)))


def test_the_columns_are_there_before_the_first_row(request, tmp_path, suffix):
    """A process that dies before it has written a row leaves a file that can be read, too."""
    done = python(request, tmp_path / f"r{suffix}", "os.kill(os.getpid(), signal.SIGKILL)")
    assert done.returncode == -signal.SIGKILL, done.stderr
    read = frame(tmp_path / f"r{suffix}")
    assert list(read) == [c.name for c in COLUMNS]
    assert len(read) == 0


@pytest.mark.skipif(sys.platform != "linux", reason="files can be exchanged on Linux only")
@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("most", [8, 256])
def test_a_parquet_file_can_be_read_whenever_its_writer_dies(request, tmp_path, after, most):
    """While parts are joined (8 of them), and while the run's end makes one file of them."""
    pytest.importorskip("pyarrow")
    done = python(request, tmp_path / "r.parquet", KILLED, after=after, most=most)
    assert done.returncode == -signal.SIGKILL, done.stderr
    read = frame(tmp_path / "r.parquet")
    written = 80 if most == 8 else 200
    assert read["time"].tolist() == list(range(written))


def test_a_missing_library_is_told_before_anything_is_touched(toys, tmp_path, monkeypatch):
    path = package(tmp_path / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=0.1)
    simulate(path, tmp_path / "out")
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    for module, name in (("pyarrow", "r.parquet"), ("h5py", "r.h5")):
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(UsageError, match=f"need {module}"):
            simulate(path, tmp_path / "out", results=name)
    assert {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()} == before


WHOLE = b'time,a.y,a.s\n0.1,2.5,"one\ntwo"\n0.2,3.456,three\n'


@pytest.mark.parametrize("cut", range(len(b"0.2,3.456,three") + 1))
@pytest.mark.parametrize("status", [None, "failed", "interrupted"])
def test_a_row_of_a_broken_run_that_is_cut_off_is_none(tmp_path, cut, status):
    """Wherever the cut is: what is left of a number may be one as well."""
    (tmp_path / "manifest.json").write_text('{"options": {"results": "r.csv"}}')
    if status is not None:
        (tmp_path / "summary.json").write_text(f'{{"status": "{status}"}}')
    (tmp_path / "r.csv").write_bytes(WHOLE[: -1 - cut])
    assert frame(tmp_path / "r.csv", ["a.s"])["a.y"].tolist() == [2.5]
    assert np.asarray(whole(tmp_path / "r.csv", ["a.s"])["a.y"]).tolist() == [2.5]


@pytest.mark.parametrize("cut", [b'"\n0.2,3.456,three\n', b'\ntwo"\n0.2,3.456,three\n'])
def test_a_text_of_a_broken_run_that_is_cut_off_is_no_row(tmp_path, cut):
    (tmp_path / "manifest.json").write_text('{"options": {"results": "r.csv"}}')
    (tmp_path / "r.csv").write_bytes(WHOLE.removesuffix(cut))
    assert frame(tmp_path / "r.csv", ["a.s"])["time"].tolist() == []
    assert np.asarray(whole(tmp_path / "r.csv", ["a.s"])["time"]).tolist() == []


@pytest.mark.parametrize("manifest", [None, '{"options": {"results": "r.csv"}}', '{"options": {"results": "q.csv"}}'])
def test_the_last_row_of_another_tool_needs_no_end(tmp_path, manifest):
    if manifest is not None:
        (tmp_path / "manifest.json").write_text(manifest)
        (tmp_path / "summary.json").write_text('{"status": "ok"}')
    (tmp_path / "r.csv").write_bytes(b"time,a.y\n0.1,2.5\n0.2,3.4")
    assert frame(tmp_path / "r.csv")["a.y"].tolist() == [2.5, 3.4]
    assert np.asarray(whole(tmp_path / "r.csv")["a.y"]).tolist() == [2.5, 3.4]
