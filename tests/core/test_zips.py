"""Archives are written whatever the clock says."""

import os
import time
import zipfile

from deepsea_cosim.core.zips import add, new_archive


def test_times_that_an_archive_does_not_know(tmp_path, monkeypatch):
    old, late = tmp_path / "old.csv", tmp_path / "late.csv"
    for file, when in ((old, 0), (late, 2**33)):
        file.write_text("1")
        os.utime(file, (when, when))
    monkeypatch.setattr(time, "time", lambda: 0.0)
    with new_archive(tmp_path / "a.zip") as archive:
        add(archive, "made.txt", "2")
        archive.write(old, "old.csv")
        archive.write(late, "late.csv")
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert [archive.read(name) for name in ("made.txt", "old.csv", "late.csv")] == [b"2", b"1", b"1"]
