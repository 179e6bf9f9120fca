"""What FMUs leave behind in the processes of a sweep or a diagnosis, which is nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from deepsea_cosim.master.parallel.pool import Job, Pool

from benchmarks import native

from ..packages import package, system
from .parts import linear, rewritten

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

BEGIN = "(void)name; (void)type; (void)guid; (void)where; (void)functions;"


@pytest.fixture
def noted(tmp_path):
    """A package whose FMU notes its life in a file, and writes another one where it is."""
    notes = tmp_path / "notes.txt"
    note = f'{{ FILE *f = fopen("{notes}", "a"); fprintf(f, "%s %s\\n", WHAT, NAME); fclose(f); }}'
    here = '{ FILE *f = fopen("mine.txt", "a"); fclose(f); }'
    changes = []
    for old, what, more in (
        (BEGIN, "begin", f'snprintf(NAME, 99, "%s", name); {here} '), ("int fmi2Terminate(Model *m) {", "end", ""),
        ("void fmi2FreeInstance(Model *m) {", "free", ""),
    ):  # fmt: skip
        changes.append((old, f"{old} {more}{note.replace('WHAT', chr(34) + what + chr(34))}"))
    fmu = rewritten(tmp_path, 2, *changes, before="static char NAME[99];\n")
    root = system("root", linear("a", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1]))
    return package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, stop=1.0, step=0.1), notes


@pytest.mark.parametrize("interrupted", [False, True])
def test_each_frees_what_it_made_and_has_its_own_folder_and_name(noted, tmp_path, monkeypatch, interrupted):
    package_file, notes = noted
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.chdir(tmp_path)
    job = Job(("a.y1",), 1.0, 0.1)
    try:
        with Pool(Path(package_file.name), processes=2) as pool:
            found = pool.run([job] * 20)
            if interrupted:
                raise KeyboardInterrupt
    except KeyboardInterrupt:
        assert interrupted
    assert all(rows[-1, 0] == pytest.approx(1.0) for rows in found)
    life = [line.split() for line in notes.read_text().splitlines()]
    begun = sorted(name for what, name in life if what == "begin")
    assert 1 <= len(begun) <= 2
    assert len(set(begun)) == len(begun)
    assert all(name.startswith("a_") for name in begun)
    assert sorted(name for what, name in life if what == "end") == begun
    assert sorted(name for what, name in life if what == "free") == begun
    assert not Path("mine.txt").exists()
    assert list(scratch.iterdir()) == []
