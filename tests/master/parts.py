"""Components and runs that tests of the master are put together from; all are the native linear FMU."""

from __future__ import annotations

import zipfile

from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values


def gain(name, g, *more, source="resources/L.fmu", kind="Real", unit_in=None, unit_out=None, **other):
    """y1 = g u1."""
    return component(
        name, source, connector("u1", "input", kind, unit=unit_in), connector("y1", "output", kind, unit=unit_out),
        *more,
        bindings=bindings(binding(values({"D[1,1]": g}))), **other,
    )  # fmt: skip


def constant(name, value, *more, source="resources/L.fmu", unit_out=None):
    """y1 = value, from a state that stands still."""
    return component(
        name, source, connector("y1", "output", unit=unit_out), *more,
        bindings=bindings(binding(values({"C[1,1]": 1.0, "x0[1]": value}))),
    )  # fmt: skip


def linear(name, source="resources/L.fmu", **matrices):
    """A linear component with two inputs and an output in use; matrices A, B, C, D and x0."""
    given = {k.removeprefix("."): v for k, v in native.values("", **matrices).items()}
    return component(
        name, source, connector("u1", "input"), connector("u2", "input"), connector("y1", "output"),
        bindings=bindings(binding(values(given))),
    )  # fmt: skip


def redescribed(fmu, target, *changes):
    """The FMU at `target` with replacements (old, new) in its modelDescription.xml, each of which must apply."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                text = content.decode()
                for before, after in changes:
                    assert before in text, before
                    text = text.replace(before, after)
                content = text.encode()
            new.writestr(name, content)
    return target


def rewritten(folder, version, *changes, before="", more=(), beside=None, **told):
    """The linear FMU in a folder, with replacements (old, new) in its source, each of which must apply; `before` stands
    at its beginning, `more` are options of the compiler, `told` of the description."""
    text = (native.HERE / "fmus" / "linear.c").read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (folder / "m.c").write_text(before + text)
    built = native.compiled(folder / "m.c", version, folder / "Linear.so", *more)
    return native.packed(folder / "m.fmu", version, built, beside, **told)


def two(path, fmu, trouble=0.0, when=1e300, stop=1.0, step=0.01):
    """A ramp, y1 = t, that a second FMU doubles; the second one makes trouble from a time on."""
    ramp = component("a", "resources/L.fmu", connector("y1", "output"),
                     bindings=bindings(binding(values({"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}))))  # fmt: skip
    twice = component("b", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bindings(
        binding(values({"D[1,1]": 2.0, "trouble": trouble, "when": when}))))  # fmt: skip
    root = system("root", ramp, twice, links=(link("a.y1", "b.u1"),))
    return package(path, root, {"resources/L.fmu": fmu}, stop=stop, step=step)


def last(tmp_path, path, column, **options):
    frame = run(path, tmp_path / "out", Options(**options)).frame()
    return frame[column].iloc[-1]


def with_fmu(fmus, version=2):
    return {"resources/L.fmu": fmus[version]}


def with_input(*made, name="in", inner="", type="Real", **other):
    """A gain of 3 behind an input of the system."""
    own = bindings(binding(values({"D[1,1]": 3.0})), *([inner] if inner else []))
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=own)
    return system("root", a, made=(connector(name, "input", type), *made), links=(link(name, "a.u1"),), **other)
