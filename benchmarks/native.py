"""Native FMUs for tests and benchmarks, compiled from one C source: a linear system, exact for held inputs.

All FMI versions.

`linear(folder, version)` gives the FMU; `values(A=..., B=...)` the parameters of its matrices. Tests that need it skip
where there is no C compiler.
"""

from __future__ import annotations

import atexit
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from deepsea_cosim.core.unit_names import named

HERE = Path(__file__).parent
N = 6

BINARIES = {1: "binaries/linux64", 2: "binaries/linux64", 3: "binaries/x86_64-linux"}
"""Where a library lies in an FMU, by version."""

compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@cache
def library(version: int) -> Path:
    """The compiled library of an FMI version."""
    assert compiler
    folder = mkdtemp(prefix="native_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return compiled(HERE / "fmus" / "linear.c", version, Path(folder) / f"Linear{version}.so")


def compiled(source: Path, version: int, target: Path, *more: str) -> Path:
    """A library of an FMI version from a source like linear.c; `more` options of the compiler."""
    assert compiler
    command = [compiler, "-O2", "-w", "-shared", "-fPIC", f"-DFMI={version}", str(source), "-o", str(target), "-lm"]
    subprocess.run([*command, *more], check=True)
    return target


def _variables(plain: bool) -> list[tuple[str, int, str, str]]:
    """(name, reference, causality, type); plain: reals only, one input and two outputs."""
    made = [(f"u{i + 1}", i, "input", "Real") for i in range(1 if plain else N)]
    made += [(f"y{i + 1}", 10 + i, "output", "Real") for i in range(2 if plain else N)]
    made += [(f"x0[{i + 1}]", 20 + i, "parameter", "Real") for i in range(N)]
    for name, base in (("A", 100), ("B", 200), ("C", 300), ("D", 400)):
        made += [
            (f"{name}[{i + 1},{j + 1}]", base + 10 * i + j, "parameter", "Real") for i in range(N) for j in range(N)
        ]
    made += [(name, 600 + k, "parameter", "Real") for k, name in enumerate(("trouble", "when", "square"))]
    if plain:
        return made
    for name, base, kind in (("integer", 500, "Integer"), ("boolean", 510, "Boolean"), ("string", 520, "String"),
                             ("item", 530, "Enumeration")):  # fmt: skip
        made += [(f"{name}_in", base, "input", kind), (f"{name}_out", base + 1, "output", kind)]
    return made


START = {"Real": "0", "Integer": "0", "Boolean": "false", "String": "", "Enumeration": "1"}


@dataclass(frozen=True)
class _Wanted:
    """What a description is to say, see `description`."""

    units: dict[str, str]
    through: bool | None
    plain: bool
    slopes: bool
    negated: str
    direct: bool
    derivatives: bool


def description(
    version: int, units: dict[str, str] | None = None, through: bool | None = True, plain: bool = False,
    slopes: bool = False, negated: str = "", direct: bool = False, derivatives: bool = False,
) -> str:  # fmt: skip
    """modelDescription.xml.

    units: unit by variable name; through: outputs depend on inputs, None does not say;
    plain: see `_variables`; slopes: takes slopes of its inputs; negated: a variable of FMI 1.0 that is a negated
    alias; direct: FMI 1.0 tells on which inputs the outputs depend; derivatives: directional ones are given.
    """
    wanted = _Wanted(units or {}, through, plain, slopes, negated, direct, derivatives)
    return {1: _description_1, 2: _description_2, 3: _description_3}[version](wanted)


ITEMS = "".join(f'<Item name="{name}" value="{k}"/>' for k, name in enumerate(("red", "green", "blue"), start=1))


def _unit_definitions(wanted: _Wanted, written: Callable[[str], str]) -> str:
    used = "".join(written(u) for u in dict.fromkeys(wanted.units.values()))
    return f"<UnitDefinitions>{used}</UnitDefinitions>" if used else ""


def _unit(wanted: _Wanted, name: str) -> str:
    return f' unit="{wanted.units[name]}"' if name in wanted.units else ""


def _description_1(wanted: _Wanted) -> str:
    types = "".join(f'<Item name="{n}"/>' for n in ("red", "green", "blue"))
    interpolates = ' canInterpolateInputs="true"' if wanted.slopes else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="1.0" modelName="Linear" '
        'modelIdentifier="Linear" guid="{linear}" numberOfContinuousStates="0" numberOfEventIndicators="0">'
        + _unit_definitions(wanted, lambda u: f'<BaseUnit unit="{u}"/>')
        + f'<TypeDefinitions><Type name="Colour"><EnumerationType min="1" max="3">{types}</EnumerationType></Type>'
        f"</TypeDefinitions><ModelVariables>{_scalars(wanted, 1)}</ModelVariables><Implementation>"
        f'<CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"{interpolates}/>'
        "</CoSimulation_StandAlone></Implementation></fmiModelDescription>"
    )


def _description_2(wanted: _Wanted) -> str:
    unknowns = "".join(
        f'<Unknown index="{i}"{_depends(r, wanted.through, 2)}/>'
        for i, (_, r, c, _) in enumerate(_variables(wanted.plain), 1)
        if c == "output"
    )
    able = ' canInterpolateInputs="true"' if wanted.slopes else ""
    able += f' providesDirectionalDerivative="{str(wanted.derivatives).lower()}"'
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="Linear" '
        'guid="{linear}">'
        '<CoSimulation modelIdentifier="Linear" canHandleVariableCommunicationStepSize="true" '
        f'canGetAndSetFMUstate="true" canSerializeFMUstate="true"{able}/>'
        + _unit_definitions(wanted, _defined)
        + f'<TypeDefinitions><SimpleType name="Colour"><Enumeration>{ITEMS}</Enumeration></SimpleType>'
        "</TypeDefinitions>"
        f"<ModelVariables>{_scalars(wanted, 2)}</ModelVariables><ModelStructure><Outputs>{unknowns}</Outputs>"
        f"<InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )


def _scalars(wanted: _Wanted, version: int) -> str:
    """The variables in FMI 1.0 and 2.0."""
    rows = []
    for name, reference, causality, kind in _variables(wanted.plain):
        variability = {"parameter": "parameter" if version == 1 else "fixed"}.get(causality)
        variability = variability or ("continuous" if kind == "Real" else "discrete")
        cause = "internal" if version == 1 and causality == "parameter" else causality
        value = "1e300" if name == "when" else START[kind]
        start = "" if causality == "output" else f' start="{value}"'
        alias = ' alias="negatedAlias"' if name == wanted.negated else ""
        declared = ' declaredType="Colour"' if kind == "Enumeration" else ""
        rows.append(f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{cause}" '
                    f'variability="{variability}"{alias}><{kind}{declared}{start}{_unit(wanted, name)}/>'
                    f"{_direct(reference, wanted.direct)}</ScalarVariable>")  # fmt: skip
    return "".join(rows)


def _description_3(wanted: _Wanted) -> str:
    outputs = [r for _, r, c, _ in _variables(wanted.plain) if c == "output"] + [701, 711, 721, 731, 751]
    structure = "".join(
        f'<{tag} valueReference="{r}"{_depends(r, wanted.through, 3)}/>'
        for tag in ("Output", "InitialUnknown")
        for r in outputs
    )
    derivatives = str(wanted.derivatives).lower()
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="Linear" '
        'instantiationToken="{linear}"><CoSimulation modelIdentifier="Linear" '
        'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true" canSerializeFMUState="true" '
        f'providesDirectionalDerivatives="{derivatives}"/>'
        + _unit_definitions(wanted, _defined)
        + f'<TypeDefinitions><EnumerationType name="Colour">{ITEMS}</EnumerationType></TypeDefinitions>'
        f"<ModelVariables>{_typed(wanted)}{_more_types()}</ModelVariables>"
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


def _typed(wanted: _Wanted) -> str:
    """The variables of all versions in FMI 3.0."""
    rows = []
    for name, reference, causality, kind in _variables(wanted.plain):
        tag = {"Real": "Float64", "Integer": "Int32"}.get(kind, kind)
        variability = "tunable" if causality == "parameter" else "continuous" if kind == "Real" else "discrete"
        extra = ' declaredType="Colour"' if kind == "Enumeration" else ""
        value = "1e300" if name == "when" else START[kind]
        start = "" if causality == "output" or kind == "String" else f' start="{value}"'
        inside = '<Start value=""/>' if kind == "String" and causality != "output" else ""
        rows.append(f'<{tag} name="{name}" valueReference="{reference}" causality="{causality}" '
                    f'variability="{variability}"{start}{extra}{_unit(wanted, name)}>{inside}</{tag}>')  # fmt: skip
    return "".join(rows)


def _more_types() -> str:
    """What only FMI 3.0 has: arrays, one of them of a size that can be set, and types of other widths."""
    rows = []
    for name, base, kind, size in (
        ("array", 700, "Float64", 3),
        ("wide", 710, "Int64", 0),
        ("single", 720, "Float32", 0),
        ("huge", 730, "UInt64", 0),
    ):
        inside = f'<Dimension start="{size}"/>' if size else ""
        variability = "continuous" if kind.startswith("Float") else "discrete"
        rows.append(f'<{kind} name="{name}_in" valueReference="{base}" causality="input" '
                    f'variability="{variability}" start="{" ".join(["0"] * max(1, size))}">{inside}</{kind}>'
                    f'<{kind} name="{name}_out" valueReference="{base + 1}" causality="output" '
                    f'variability="{variability}">{inside}</{kind}>')  # fmt: skip
    size = '<Dimension valueReference="740"/>'
    rows.append('<UInt64 name="size" valueReference="740" causality="structuralParameter" variability="fixed" '
                'start="2"/>')  # fmt: skip
    rows.append(f'<Float64 name="many_in" valueReference="750" causality="input" start="1 2">{size}</Float64>')
    rows.append(f'<Float64 name="many_out" valueReference="751" causality="output">{size}</Float64>')
    rows.append('<Float64 name="time" valueReference="999" causality="independent" variability="continuous"/>')
    return "".join(rows)


def _defined(name: str) -> str:
    """A unit of a known name, as FMI 2.0 and 3.0 write it."""
    unit = named(name)
    scaled = {"factor": unit.factor} if unit.factor != 1.0 else {}
    scaled |= {"offset": unit.offset} if unit.offset else {}
    given = " ".join(f'{k}="{v!r}"' for k, v in {**(unit.exponents or {}), **scaled}.items())
    return f'<Unit name="{name}"><BaseUnit {given}/></Unit>'


def _direct(reference: int, direct: bool) -> str:
    """What an output of FMI 1.0 depends on: all inputs."""
    if not (direct and 10 <= reference < 16):
        return ""
    return f"<DirectDependency>{''.join(f'<Name>u{k + 1}</Name>' for k in range(N))}</DirectDependency>"


def _depends(reference: int, through: bool | None, version: int) -> str:
    """The dependencies of an output: all real inputs, none, or nothing said."""
    if through is None:
        return ""
    if 10 <= reference < 16:
        inputs = [str(k + 1) if version == 2 else str(k) for k in range(N)]
        return f' dependencies="{" ".join(inputs)}"' if through else ' dependencies=""'
    return ""


def linear(folder: Path, version: int = 2, name: str = "Linear", **options: object) -> Path:
    """The FMU of a version in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    return packed(folder / f"{name}{version}.fmu", version, library(version), **options)


def packed(target: Path, version: int, built: Path, beside: Path | None = None, **options: object) -> Path:
    """The FMU of a version around a compiled library, with another library beside that."""
    folder = BINARIES[version]
    assert sys.platform.startswith("linux")
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(version, **options))  # type: ignore[arg-type]
        archive.write(built, f"{folder}/Linear.so")
        if beside is not None:
            archive.write(beside, f"{folder}/{beside.name}")
    return target


def values(component: str, **matrices: object) -> dict[str, float]:
    """Parameters by address: A, B, C, D as nested lists, x0 as a list."""
    made = {}
    for key, given in matrices.items():
        m = np.asarray(given, float)
        if m.ndim == 1:
            made |= {f"{component}.{key}[{i + 1}]": float(m[i]) for i in range(len(m))}
        else:
            made |= {
                f"{component}.{key}[{i + 1},{j + 1}]": float(m[i, j])
                for i in range(m.shape[0]) for j in range(m.shape[1]) if m[i, j]
            }  # fmt: skip
    return made
