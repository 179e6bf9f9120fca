"""Packages that were damaged, or made to do harm: one clear line, no traceback, no hang, nothing outside the folder."""

from __future__ import annotations

import io
import os
import random
import re
import subprocess
import sys
import zipfile

import pytest
from deepsea_cosim.master.cli import main

from benchmarks import native

from ..packages import binding, bindings, component, connector, description, link, package, system, values

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

COUNT = 150
VALUES = ("", "-1", "nan", "inf", "1e999", "x", "..", "../../etc/passwd", "%2e%2e/x", "true", "0", "é" * 50, "a" * 5000,
          "input", "output", "parameter", "application/x-ssp-package", "2.0", "9.9", "4294967296")  # fmt: skip
TAGS = ("Real", "Integer", "Boolean", "String", "Enumeration", "Float64", "Connector", "Component", "System", "Gadget")
BOMB = (
    '<!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>'
)
OUTSIDE = '<!DOCTYPE b [<!ENTITY x SYSTEM "file:///etc/passwd">]>'


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A sound package with a bit of everything, as entries by name."""
    folder = tmp_path_factory.mktemp("sound")
    fmus = {f"resources/L{v}.fmu": native.linear(folder, v) for v in (1, 2, 3)}

    def part(name, version, g):
        return component(name, f"resources/L{version}.fmu", connector("u1", "input", unit="m"),
                         connector("y1", "output"),
                         bindings=bindings(binding(values({"D[1,1]": g, "C[1,1]": 1.0, "x0[1]": 0.5}))))  # fmt: skip

    inner = system("inner", part("b", 2, 3.0), made=(connector("in", "input"), connector("out", "output")),
                   links=(link("in", "b.u1"), link("b.y1", "out")))  # fmt: skip
    root = system("root", part("a", 1, 2.0), inner, part("c", 3, 4.0), made=(connector("in", "input"),),
                  links=(link("in", "a.u1"), link("a.y1", "inner.in", '<ssc:LinearTransformation factor="2"/>'),
                         link("inner.out", "c.u1")),
                  bindings=bindings(binding(source="resources/v.ssv", prefix="c.")))  # fmt: skip
    path = package(folder / "p.ssp", root, {**fmus, "resources/v.ssv": values({"D[1,1]": 5.0})})
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def rezip(entries, links=()):
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
        for name in links:
            info = zipfile.ZipInfo(name)
            info.external_attr = 0o120777 << 16
            archive.writestr(info, "/etc/passwd")
    return made.getvalue()


def damaged_xml(text, rng):
    """One XML file with one thing wrong."""
    kind = rng.randrange(8)
    if kind == 0:  # an attribute's value
        found = list(re.finditer(r'(\w+)="([^"]*)"', text))
        m = rng.choice(found)
        return f"{text[: m.start(2)]}{rng.choice(VALUES)}{text[m.end(2) :]}"
    if kind == 1:  # an attribute's name
        m = rng.choice(list(re.finditer(r' (\w+)="', text)))
        return f"{text[: m.start(1)]}zz{text[m.end(1) :]}"
    if kind == 2:  # an attribute is gone
        m = rng.choice(list(re.finditer(r' \w+="[^"]*"', text)))
        return text[: m.start()] + text[m.end() :]
    if kind == 3:  # a tag's name
        m = rng.choice(list(re.finditer(r"<(\w+:)?(\w+)", text)))
        return f"{text[: m.start(2)]}{rng.choice(TAGS)}{text[m.end(2) :]}"
    if kind == 4:  # an element without children is gone, or stands twice
        m = rng.choice(list(re.finditer(r"<[^<>/?!]+/>", text)) or [re.match("^", text)])
        return text[: m.start()] + (m.group() * 2 if rng.random() < 0.5 else "") + text[m.end() :]
    if kind == 5:  # cut
        return text[: rng.randrange(len(text))]
    if kind == 6:  # entities
        head, mark, rest = text.partition("?>")
        return (
            f"{head}{mark}{rng.choice((BOMB, OUTSIDE))}{rest.replace('>', '>&c;', 1) if rng.random() < 0.5 else rest}"
        )
    place = rng.randrange(len(text))  # noise
    return text[:place] + chr(rng.randrange(1, 300)) + text[place + rng.randrange(3) :]


def damaged(entries, rng):
    """The bytes of a package with something wrong."""
    kind = rng.random()
    if kind < 0.1:
        whole = rezip(entries)
        return whole[: rng.randrange(len(whole))]
    if kind < 0.2:
        whole = bytearray(rezip(entries))
        for _ in range(rng.randrange(1, 20)):
            whole[rng.randrange(len(whole))] = rng.randrange(256)
        return bytes(whole)
    if kind < 0.28:
        gone = rng.choice(list(entries))
        return rezip({name: content for name, content in entries.items() if name != gone})
    if kind < 0.36:
        trick = rng.choice(("../evil", "/tmp/evil_of_a_test", "a/../../evil", "..\\evil", "C:\\evil", "resources"))
        return rezip({**entries, trick: b"x"}, links=("resources/link",) if rng.random() < 0.3 else ())
    if kind < 0.7:
        name = rng.choice([n for n in entries if n.endswith((".ssd", ".ssv"))])
        return rezip({**entries, name: damaged_xml(entries[name].decode(), rng).encode("utf-8", "replace")})
    name = rng.choice([n for n in entries if n.endswith(".fmu")])
    with zipfile.ZipFile(io.BytesIO(entries[name])) as archive:
        inside = {n: archive.read(n) for n in archive.namelist()}
    if rng.random() < 0.2:
        inside.pop(rng.choice(list(inside)))
    else:
        text = damaged_xml(inside["modelDescription.xml"].decode(), rng)
        inside["modelDescription.xml"] = text.encode("utf-8", "replace")
    return rezip({**entries, name: rezip(inside)})


def test_damaged_packages_are_one_line(sound, tmp_path, capsys):
    rng = random.Random(int(os.environ.get("DEEPSEA_COSIM_FUZZ", "1")))
    codes = {0: 0, 1: 0, 2: 0}
    (tmp_path / "in").mkdir()
    for k in range(COUNT):
        path = tmp_path / "in" / "p.ssp"
        path.write_bytes(damaged(sound, rng))
        code = main([str(path), "--out", str(tmp_path / "out"), "--quiet", "--no-plot"])
        told = capsys.readouterr().err.strip()
        assert code in codes, (k, told)
        codes[code] += 1
        lines = [line for line in told.splitlines() if not line.startswith("cosim-master: warning:")]
        if code:
            assert len(lines) == 1, (k, told)
            assert lines[0].startswith("cosim-master: "), (k, told)
            assert "Traceback" not in told
        assert {p.name for p in tmp_path.iterdir()} <= {"in", "out"}, k
        assert {p.name for p in (tmp_path / "in").iterdir()} == {"p.ssp"}, k
    assert codes[2] > COUNT / 4  # most damage is noticed before anything runs
    assert codes[0] > 0  # and some does no harm


def test_checking_tells_the_same(sound, tmp_path, capsys):
    rng = random.Random(2)
    path = tmp_path / "p.ssp"
    for k in range(60):
        path.write_bytes(damaged(sound, rng))
        code = main([str(path), "--check"])
        told = capsys.readouterr()
        assert code in (0, 2), k
        assert "Traceback" not in told.err + told.out
        if code == 2:
            assert "error: " in told.err, (k, told.err)


def test_a_small_archive_that_grows_is_refused(tmp_path, capsys):
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("SystemStructure.ssd", description(system("root")))
        archive.writestr("big", b"\0" * 200_000_000)
    (tmp_path / "p.ssp").write_bytes(made.getvalue())
    code = main([str(tmp_path / "p.ssp"), "--out", str(tmp_path / "out")])
    assert code == 2
    assert "would grow" in capsys.readouterr().err


def test_packages_in_packages_share_one_budget(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_GB", "2e-5")
    inner = package(tmp_path / "inner.ssp", system("inner"), {"padding": bytes(random.Random(3).randbytes(9_000))})
    root = system("root", component("s", "resources/s.ssp", type="application/x-ssp-package"),
                  component("t", "resources/t.ssp", type="application/x-ssp-package"))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/s.ssp": inner, "resources/t.ssp": inner})
    assert main([str(path), "--out", str(tmp_path / "out")]) == 2
    assert "would unpack to" in capsys.readouterr().err


def test_an_attribute_that_is_nearly_a_namespace_is_one_line(sound, tmp_path, capsys):
    """libxml reads `xmlns` with a letter replaced as an attribute, and cannot read again what it writes of that."""
    text = sound["SystemStructure.ssd"].decode()
    assert text.count("<ssv:ParameterSet xmlns:ssd=") > 0
    broken = text.replace("<ssv:ParameterSet xmlns:ssd=", "<ssv:ParameterSet xmln\u00e9ssd=", 1)
    (tmp_path / "p.ssp").write_bytes(rezip({**sound, "SystemStructure.ssd": broken.encode()}))
    assert main([str(tmp_path / "p.ssp"), "--check"]) == 2
    told = capsys.readouterr().err
    assert "SystemStructure.ssd, line 1" in told
    assert "Traceback" not in told


def test_an_fmu_without_an_identifier_is_one_line(sound, tmp_path, capsys):
    with zipfile.ZipFile(io.BytesIO(sound["resources/L2.fmu"])) as archive:
        fmu = {name: archive.read(name) for name in archive.namelist()}
    fmu["modelDescription.xml"] = re.sub(rb'modelIdentifier="\w+"', b"", fmu["modelDescription.xml"])
    (tmp_path / "p.ssp").write_bytes(rezip({**sound, "resources/L2.fmu": rezip(fmu)}))
    for more in (["--check", "--quiet"], ["--out", str(tmp_path / "out")]):
        assert main([str(tmp_path / "p.ssp"), *more]) == 2
        assert "L2.fmu: modelIdentifier '' is not a name" in capsys.readouterr().err


@pytest.mark.parametrize("file", ["SystemStructure.ssd", "modelDescription.xml"])
def test_a_name_that_no_file_can_have_is_one_line(sound, tmp_path, file):
    """Run as a command: what the operating system refuses must not end as if all were well."""
    text = sound["SystemStructure.ssd"].decode()
    inside = dict(sound)
    if file.endswith(".ssd"):
        inside[file] = text.replace("resources/L2.fmu", f"resources/{'a' * 5000}.fmu").encode()
    else:
        with zipfile.ZipFile(io.BytesIO(sound["resources/L2.fmu"])) as archive:
            fmu = {name: archive.read(name) for name in archive.namelist()}
        long = re.sub(rb'modelIdentifier="\w+"', b'modelIdentifier="' + b"a" * 5000 + b'"', fmu[file])
        inside["resources/L2.fmu"] = rezip({**fmu, file: long})
    (tmp_path / "p.ssp").write_bytes(rezip(inside))
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", tmp_path / "p.ssp", "--out", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert "too long" in done.stderr or "is not a name" in done.stderr
