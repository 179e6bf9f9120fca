"""Names in archives that do not say how they are written, and XML files in other encodings than they declare."""

from __future__ import annotations

import codecs
import unicodedata
import zipfile

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import run
from deepsea_cosim.ssp.encoding import as_utf8

from benchmarks import native

from ..packages import binding, bindings, component, connector, description, pack, package, system, values
from .parts import constant

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


class Entry(zipfile.ZipInfo):
    """An entry whose name is written in some encoding, without the flag that says UTF-8."""

    encoding = "utf-8"

    def _encodeFilenameFlags(self):
        return self.filename.encode(self.encoding), self.flag_bits & ~0x800


def zipped(path, files, encoding):
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            entry = Entry(name)
            entry.encoding = encoding
            archive.writestr(entry, content)
    return path


def umlauts(fmus):
    """A component whose FMU and parameter set have other letters in their names: y1 = 4."""
    sets = bindings(binding(source="Werte/Größe.ssv"))
    root = system("root", component("a", "resources/Länge.fmu", connector("y1", "output"), bindings=sets))
    return {"SystemStructure.ssd": description(root), "resources/Länge.fmu": fmus[2].read_bytes(),
            "Werte/Größe.ssv": values({"C[1,1]": 1.0, "x0[1]": 4.0})}  # fmt: skip


@pytest.mark.parametrize("encoding", ["utf-8", "cp437"])
@pytest.mark.parametrize("form", ["NFC", "NFD"])
def test_names_without_the_flag(fmus, tmp_path, encoding, form):
    """UTF-8 without the flag, composed or (as a Mac writes) not; and what the format has without the flag, cp437."""
    if (form, encoding) == ("NFD", "cp437"):
        pytest.skip("cp437 has no combining letters")
    files = {unicodedata.normalize(form, name): content for name, content in umlauts(fmus).items()}
    path = zipped(tmp_path / "p.ssp", files, encoding)
    assert (run(path, tmp_path / "out").frame()["a.y1"] == 4.0).all()


def test_names_in_another_encoding_are_told_with_it(fmus, tmp_path):
    path = zipped(tmp_path / "p.ssp", umlauts(fmus), "cp1252")
    with pytest.raises(CosimError, match=r"'(Werte/Größe\.ssv|resources/Länge\.fmu)'.* cp1252"):
        run(path, tmp_path / "out")


def test_a_parameter_set_inside_an_fmu_with_such_a_name(fmus, tmp_path):
    with zipfile.ZipFile(fmus[2]) as old:
        files = {name: old.read(name) for name in old.namelist()}
    fmu = zipped(tmp_path / "L.fmu", {**files, "extra/Größe.ssv": values({"C[1,1]": 1.0, "x0[1]": 4.0})}, "utf-8")
    sets = bindings(binding(source="extra/Größe.ssv", sourceBase="component"))
    root = system("root", component("a", "resources/L.fmu", connector("y1", "output"), bindings=sets))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    assert (run(path, tmp_path / "out").frame()["a.y1"] == 4.0).all()


FILES = {  # declared, written: whether that is what is declared
    ("UTF-8", "utf-8"): True, ("UTF-8", "utf-8-sig"): True, ("UTF-16", "utf-16"): True, ("UTF-8", "utf-16"): True,
    ("UTF-16", "utf-16-le"): True, ("UTF-16", "utf-16-be"): True, ("UTF-32", "utf-32"): True,
    ("ISO-8859-1", "latin-1"): True, ("windows-1252", "cp1252"): True,
    ("UTF-8", "latin-1"): False, (None, "latin-1"): False, ("UTF-16", "utf-8"): False, ("ISO-8859-1", "utf-8"): False,
    ("US-ASCII", "utf-8"): False, ("no-such-code", "utf-8"): False,
}  # fmt: skip


def encoded(text, declared, written):
    says = f' encoding="{declared}"' if declared else ""
    return f'<?xml version="1.0"{says}?>{text.partition("?>")[2]}'.encode(written)


@pytest.mark.parametrize(("declared", "written"), FILES)
def test_a_description_is_read_in_the_encoding_that_it_has(fmus, tmp_path, declared, written):
    text = description(system("root", constant("a", 4.0).replace('name="a"', 'name="Größe"')))
    files = {"SystemStructure.ssd": encoded(text, declared, written), "resources/L.fmu": fmus[2]}
    path = pack(tmp_path / "p.ssp", files)
    result = run(path, tmp_path / "out")
    assert (result.frame()["Größe.y1"] == 4.0).all()
    told = any("encoding" in text for text in result.summary["warnings"])
    assert told != FILES[declared, written]
    assert bool(check(path).errors) == told


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize(("declared", "written"), FILES)
def test_a_model_description_is_read_in_the_encoding_that_it_has(fmus, tmp_path, version, declared, written):
    text = native.description(version).replace('name="y1"', 'name="Länge"')
    with zipfile.ZipFile(fmus[version]) as old:
        files = {name: old.read(name) for name in old.namelist()}
    fmu = pack(tmp_path / "M.fmu", {**files, "modelDescription.xml": encoded(text, declared, written)})
    sets = bindings(binding(values({"C[1,1]": 1.0, "x0[1]": 4.0})))
    root = system("root", component("a", "resources/M.fmu", connector("Länge", "output"), bindings=sets))
    frame = run(package(tmp_path / "p.ssp", root, {"resources/M.fmu": fmu}), tmp_path / "out").frame()
    assert (frame["a.Länge"] == 4.0).all()


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"<a/>", "<a/>"),
        (b'<?xml version="1.0" encoding="ISO-2022-JP"?><a>\x1b$B$\x22\x1b(B</a>', "あ"),
        ('<?xml version="1.0" encoding="Shift_JIS"?><a>あ</a>'.encode("shift_jis"), "あ"),
        (b'<?xml version="1.0" encoding="unicode_escape"?><a>\\x41</a>', "\\x41"),  # no encoding of texts
        (codecs.BOM_UTF16_LE + b"<", None),  # half a letter
    ],
)
def test_bytes_as_utf8(data, text):
    made = as_utf8(data)[0]
    assert made == data if text is None else text in made.decode()


@pytest.mark.parametrize("declared", ["UTF-8", "utf8", None])
def test_usual_files_are_taken_as_they_are(declared):
    data = encoded("<?xml?><a>Größe</a>", declared, "utf-8")
    assert as_utf8(data) == (data, "")
    assert as_utf8(data)[0] is data


def test_a_model_description_is_put_right_in_any_folder(fmus, tmp_path, monkeypatch):
    """It is written once more, into a folder whose name has what addresses have."""
    folder = tmp_path / "ü p%s#a?b"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    with zipfile.ZipFile(fmus[2]) as old:
        files = {name: old.read(name) for name in old.namelist()}
    files["modelDescription.xml"] = encoded(native.description(2), "UTF-16", "utf-16")
    fmu = pack(tmp_path / "M.fmu", files)
    path = package(tmp_path / "p.ssp", system("root", constant("a", 4.0)), {"resources/L.fmu": fmu})
    assert (run(path, tmp_path / "out").frame()["a.y1"] == 4.0).all()
