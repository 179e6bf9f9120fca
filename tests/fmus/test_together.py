"""Several FMUs in one process compute what each computes alone: two versions of ours beside FMUs of others."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import zipfile
from pathlib import Path

from deepsea_cosim.master.simulation.run import Options, run

from ..toys import package


def another_version(fmu: Path, target: Path) -> Path:
    """The arm with half as much force again, as a later version of the project might build it."""
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    code = re.search(rb"deepsea_cosim_([0-9a-f]{12})", files["resources/slavemodule.txt"] + files["resources/code.zip"])
    assert code
    old, new = code[1], b"0123456789ab"
    with zipfile.ZipFile(io.BytesIO(files["resources/code.zip"])) as archive:
        inner = {n: archive.read(n) for n in archive.namelist() if n.endswith(".py")}
    changed = 0
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, content in inner.items():
            if name.endswith("mechanics/stepping.py"):
                changed = content.count(b"v[FORCE]")
                content = content.replace(b"v[FORCE]", b"(1.5 * v[FORCE])")
            archive.writestr(name.replace(old.decode(), new.decode()), content)
    assert changed
    files["resources/code.zip"] = made.getvalue()
    with zipfile.ZipFile(target, "w") as archive:
        for name, content in files.items():
            if name.startswith("resources/") and name.endswith((".py", ".txt")):
                content = content.replace(old, new)
            archive.writestr(name.replace(old.decode(), new.decode()), content)
    return target


def test_versions_and_foreign_fmus_do_not_touch_each_other(built, toys, tmp_path):
    fmus = {
        "ours": built / "DeepseaArm.fmu",
        "later": another_version(built / "DeepseaArm.fmu", tmp_path / "Later.fmu"),
        "mass": toys / "Mass.fmu",
        "spring": toys / "Spring.fmu",
        "hydraulics": built / "DeepseaHydraulics.fmu",
    }
    links = ("mass.x -> spring.x", "mass.v -> spring.v", "spring.F -> mass.F")
    path = package(tmp_path / "all.ssp", fmus, links, stop=0.2, step=1e-3)
    force = (("ours.F_h", "1000"), ("later.F_h", "1000"))
    together = run(path, tmp_path / "together", Options(changes=force)).frame()
    apart = run(path, tmp_path / "apart", Options(changes=force, isolate=True)).frame()  # a process for each
    assert together.equals(apart)
    assert together["ours.x_h"].iloc[-1] != together["later.x_h"].iloc[-1]


def test_an_fmu_of_others_keeps_its_own_pythonfmu(built, toys, tmp_path):
    """Which may be an older one, that cannot run with what ours carries."""
    with zipfile.ZipFile(toys / "Spring.fmu") as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    files["resources/pythonfmu/__init__.py"] += b"\nOLDER = True\n"
    script = next(name for name in files if name.startswith("resources/toy_"))
    files[script] = files[script].replace(b"import Fmi2", b"import OLDER, Fmi2")
    with zipfile.ZipFile(tmp_path / "Spring.fmu", "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    ours = {name: built / f"{name}.fmu" for name in ("DeepseaArm", "DeepseaHydraulics")}
    fmus = {"arm": ours["DeepseaArm"], "spring": tmp_path / "Spring.fmu", "hydraulics": ours["DeepseaHydraulics"]}
    path = package(tmp_path / "p.ssp", fmus, stop=0.01, step=1e-3)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True)  # this process has a pythonfmu
    assert done.returncode == 0, done.stderr
