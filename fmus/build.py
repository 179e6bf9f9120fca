"""Builds the FMUs and packs the scenarios.

An FMU holds: the model description from the variable table; the project's code under a name made of its content
(`entry.py.in` says why), with the kernels already compiled for this machine; pythonfmu's library; and, where the system
has a C compiler, the front library that turns faults into fmi2Error.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import os
import shutil
import subprocess
import sys
import sysconfig
import uuid
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from ..core.errors import PackageError, UsageError, install
from ..core.files import held, make_folder, replacing
from ..core.scratch import scratch
from ..ssp import packer
from .helpers import run_python, side_by_side
from .scenes import Files, scene_within, shipped_scene

HERE = Path(__file__).parent
ROOT = __package__.rpartition(".")[0]
PLATFORM = {"linux": "linux64", "win32": "win64", "darwin": "darwin64"}.get(sys.platform, sys.platform)
"""Folder of the libraries in an FMU of FMI 2.0."""
RECIPE = (".py", ".in", ".c", ".h", ".md", ".xml", ".toml")
"""Files that an FMU is made of."""

FIXED_DATE = (2001, 9, 9, 1, 46, 40)


@dataclass(frozen=True)
class Model:
    """An FMU of the project: class, its modules in `fmus` (the class is in the first), the packages of physics it
    carries, what it needs installed."""

    name: str
    modules: tuple[str, ...]
    packages: tuple[str, ...]
    needs: tuple[str, ...]
    text: str = ""
    """Its README, where it has none of its own in `fmus`."""
    scene: Files = ()
    """What a replay draws (docs/fmus.md): names in resources/replay, and contents."""


MODELS = (
    Model("DeepseaHydraulics", ("hydraulics",), ("core", "hydraulics_fmu"), ("numpy", "numba")),
    Model(
        "DeepseaArm", ("arm",), ("core", "mechanics"), ("numpy", "numba", "mujoco"), scene=shipped_scene("DeepseaArm")
    ),
    Model("DeepseaSupply", ("supply",), ("core", "hydraulics_fmu"), ("numpy", "numba")),
)

CONTAINER = Model(
    "DeepseaMachine", ("machine", "hydraulics", "arm", "starts"), ("core", "hydraulics_fmu", "mechanics"),
    ("numpy", "numba", "mujoco"), scene=scene_within("arm", "DeepseaArm"),
)  # fmt: skip
"""Both in one; made by `container`."""


@dataclass(frozen=True)
class Version:
    """What differs between the FMI versions."""

    fmi: int
    builder: str
    """Module of pythonfmu's builder."""
    entry: str
    """End of the script in which pythonfmu looks for the class."""
    token: str
    """Attribute of the model description that identifies the FMU."""
    modules: tuple[str, ...]
    """Modules of `fmus` that only this version needs."""


VERSIONS = {
    2: Version(
        2, "pythonfmu.builder", "from @PACKAGE@.fmus.@MODULE@ import @CLASS@  # noqa: E402, F401\n", "guid",
        ("fmi2", "description"),
    ),
    3: Version(
        3, "pythonfmu3.builder",
        "from pythonfmu3 import Fmi3Slave  # noqa: E402\n"
        "from @PACKAGE@.fmus.@MODULE@ import @CLASS@ as Model  # noqa: E402\n\n\n"
        "class @CLASS@(Model, Fmi3Slave):\n    pass\n",
        "instantiationToken", ("fmi3", "description", "description3"),
    ),
}  # fmt: skip

SYSTEMS = ("deepsea", "two_axes")
"""Folders of the shipped systems below ssp/scenarios; every .ssv in one is a scenario."""


def system_folder(name: str) -> Path:
    """Folder of a shipped system."""
    return _folder("ssp") / "scenarios" / name


def _folder(package: str) -> Path:
    return Path(importlib.import_module(f"{ROOT}.{package}").__file__).parent


def _sources(model: Model, version: Version) -> dict[str, bytes]:
    """The model's code: path below the package -> content."""
    files = {}
    for package in model.packages:
        for path in sorted(_folder(package).rglob("*.py")):
            files[f"{package}/{path.relative_to(_folder(package)).as_posix()}"] = path.read_bytes()
    for name in ("__init__", "instance", "slave", "version", *version.modules, *model.modules):
        files[f"fmus/{name}.py"] = (HERE / f"{name}.py").read_bytes()
    files["fmus/version.py"] = files["fmus/version.py"].replace(b"FMI = 2", b"FMI = %d" % version.fmi)
    return files


def sources_of(model: Model) -> dict[str, bytes]:
    """The code that makes the model what it is, without what all FMUs share: path -> content."""
    own = [f"fmus/{name}.py" for name in model.modules]
    found = _sources(model, VERSIONS[2])
    return {name: content for name, content in found.items() if not name.startswith(("core/", "fmus/")) or name in own}


def _write_zip(target: Path | io.BytesIO, files: Iterable[tuple[str, bytes]], comment: str = "") -> None:
    with (
        nullcontext(target) if isinstance(target, io.BytesIO) else replacing(target) as place,
        zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, content in files:
            entry = zipfile.ZipInfo(name, FIXED_DATE)
            entry.external_attr = (0o100755 if name.endswith(".so") else 0o100644) << 16  # for `unzip`
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
        archive.comment = comment.encode()


def _zipped(files: Iterable[tuple[str, bytes]]) -> bytes:
    buffer = io.BytesIO()
    _write_zip(buffer, files)
    return buffer.getvalue()


def c_compiler() -> str | None:
    """The system's C compiler, or None."""
    candidates = [shutil.which(name) for name in (os.environ.get("CC"), "cc", "gcc", "clang") if name]
    return next(filter(None, candidates), None)


def front_library(folder: Path) -> dict[str, bytes]:
    """The front library and its helper, name suffix -> content, compiled in that folder.

    Without a compiler those that the wheel brought (pyproject.toml, `ext-modules`); empty on other systems than Linux,
    or where the wheel was built without one, too.
    """
    if sys.platform != "linux":
        return {}
    compiler = c_compiler()
    made = {}
    for sources, suffix in ((("front", "python"), ""), (("quiet",), "_quiet")):
        target = HERE / f"_{sources[0]}.abi3.so"
        if compiler is not None:
            target = folder / f"{sources[0]}.so"
            # never unloaded: Python and pythonfmu's library stay in the process, and know this library's functions
            flags = ["-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-Wl,-z,nodelete"]
            files = [str(HERE / "front" / f"{source}.c") for source in sources]
            command = [compiler, *flags, *files, "-o", str(target), "-ldl", "-lpthread", "-lm"]
            environment = {**os.environ, "TMPDIR": str(folder)}
            if subprocess.run(command, capture_output=True, env=environment).returncode:
                return {}
        elif not target.is_file():
            return {}
        made[suffix] = target.read_bytes()
    return made


def _compiled_kernels(fmu: Path, package: str, cache: Path) -> dict[str, bytes]:
    """Run the FMU once, in a process and a cache folder of its own, and collect what numba compiled."""
    # ended at once, because pythonfmu's library may crash while Python shuts down
    script = f"import os; from {__package__}.check import exercise; exercise({str(fmu)!r}); os._exit(0)"
    environment = {**os.environ, "DEEPSEA_COSIM_CACHE": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    run_python(["-c", script], environment, f"{fmu.name} does not run")
    root = cache / "deepsea-cosim"
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in sorted((root / package).rglob("__pycache__/*"))
        if path.suffix in (".nbi", ".nbc")
    }


def _kernels_ahead(model: Model, sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """kernels.so and kernels.json of a model, made for any processor of this kind (`ahead`).

    sources: modules of `fmus` that the model has another content of, as of `build_fmu`.
    """
    with scratch("kernels") as place:
        cache = {"NUMBA_CACHE_DIR": str(place)}
        environment = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", **cache}
        command = ["-m", f"{__package__}.ahead", model.name, model.modules[0], str(place)]
        for name, content in sources.items():
            (place / Path(name).name).write_bytes(content)
            command.append(f"{Path(name).stem}={place / Path(name).name}")
        run_python(command, environment, f"{model.name}: its kernels cannot be compiled ahead")
        return {name: (place / name).read_bytes() for name in ("kernels.so", "kernels.json")}


def interpreter() -> str:
    """What `front/python.c` reads: this interpreter and its shared library, a line each."""
    places = [(sysconfig.get_config_var(d), sysconfig.get_config_var(n)) for d in ("LIBDIR", "LIBPL")
              for n in ("INSTSONAME", "LDLIBRARY")]  # fmt: skip
    libraries = [Path(folder) / name for folder, name in places if folder and name and ".so" in name]
    library = next((path for path in libraries if path.exists()), None)
    if library is None:
        raise PackageError(
            f"--portable: {sys.executable} has no shared library (libpython3.x.so), without which no other program can "
            "run Python: install it (Debian: libpython3-dev) or build with an interpreter that has one"
        )
    return f"{sys.executable}\n{library}\n"


@dataclass(frozen=True)
class Way:
    """How FMUs are built.

    portable: they remember this interpreter, for importers that are not Python; standalone: they carry a Python;
    fmi: 2, or 3 for FMI 3.0.
    """

    portable: bool = False
    standalone: bool = False
    fmi: int = 2

    def __post_init__(self) -> None:
        if self.portable and self.standalone:
            raise UsageError("--portable --standalone: an FMU either remembers a Python or carries one")
        if (self.portable or self.standalone) and self.fmi != 2:
            option = "--portable" if self.portable else "--standalone"
            raise UsageError(f"{option}: only FMUs of FMI 2.0 have the front library that starts Python")


def build_fmu(
    model: Model, folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None,
    sources: Mapping[str, bytes] | None = None,
) -> Path:  # fmt: skip
    """Build one FMU into `folder` and return its path; `say` gets what the user should know.

    sources: code that takes the place of the model's, path below the package -> content.
    """
    way = way or Way()
    if way.standalone and c_compiler() is None:
        raise PackageError("--standalone needs a C compiler for its kernels: install gcc or clang, or let CC name one")
    version = VERSIONS[way.fmi]
    own = dict(sources or {})
    sources = _sources(model, version) | own
    if way.standalone:
        sources["core/jit.py"] = (HERE / "jit_ahead.py.in").read_bytes()
        sources |= {f"core/{name}": content for name, content in _kernels_ahead(model, own).items()}
    digest = hashlib.sha256()
    for name, content in sources.items():
        digest.update(name.encode() + b"\0" + content + b"\0")
    code = digest.hexdigest()[:12]
    package = f"deepsea_cosim_{code}"
    packed = [(f"{package}/{name}", content) for name, content in sources.items()]
    with scratch("fmu") as place:
        files = _raw(model, version, package, packed, place)
        # one identity for one content
        token = str(uuid.uuid5(uuid.NAMESPACE_URL, f"deepsea-cosim/{model.name}/{code}"))
        description = files["modelDescription.xml"].decode()
        start = description.index(f'{version.token}="') + len(version.token) + 2
        files["modelDescription.xml"] = (
            description[:start] + token + description[description.index('"', start) :]
        ).encode()
        # no code: the identity does not depend on it
        files |= {f"resources/replay/{name}": content for name, content in model.scene}
        if way.fmi == 2:
            files["resources/guid.txt"] = token.encode()
            _add_front(model, files, place, say, way)
        if not way.standalone:
            draft = place / f"{model.name}_draft.fmu"
            _write_zip(draft, files.items())
            kernels = _compiled_kernels(draft, package, place / "kernels")
            files["resources/code.zip"] = _zipped([*packed, *kernels.items()])
        target = folder / f"{model.name}.fmu"
        _write_zip(target, files.items(), recipe(model, way))
    return target


def recipe(model: Model, way: Way) -> str:
    """What an FMU is made of: the same recipe makes the same FMU. It stands in the archive's comment."""
    import llvmlite.binding

    made = hashlib.sha256(repr((model, way, sys.version, llvmlite.binding.get_host_cpu_name())).encode())
    for name in ("numba", "numpy", "mujoco", "pythonfmu", "pythonfmu3"):
        with suppress(metadata.PackageNotFoundError):
            made.update(f"{name} {metadata.version(name)}".encode())
    for folder in (HERE, *(_folder(package) for package in model.packages)):
        for path in sorted(p for p in folder.rglob("*") if p.suffix in RECIPE and p.is_file()):
            made.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return f"deepsea-cosim {made.hexdigest()}"


def is_current(fmu: Path, model: Model, way: Way) -> bool:
    """Whether an FMU is what `build_fmu` would make anew."""
    try:
        with zipfile.ZipFile(fmu) as archive:
            return archive.comment.decode(errors="replace") == recipe(model, way)
    except (OSError, zipfile.BadZipFile):
        return False


def _raw(
    model: Model, version: Version, package: str, packed: list[tuple[str, bytes]], room: Path
) -> dict[str, bytes]:
    """The files of the FMU as pythonfmu makes it."""
    from .readme import page, readme

    needed = version.builder.partition(".")[0]
    if importlib.util.find_spec(needed) is None:
        raise UsageError(f"--fmi {version.fmi} needs {needed}: {install('fmi3')}")
    entry = (HERE / "entry.py.in").read_text().replace("@ENTRY@\n", version.entry)
    for place, text in (("@PACKAGE@", package), ("@MODULE@", model.modules[0]), ("@CLASS@", model.name)):
        entry = entry.replace(place, text)
    script = room / f"{model.name}_{package.rpartition('_')[2]}.py"
    script.write_text(entry)
    (room / "code.zip").write_bytes(_zipped(packed))
    documentation = room / "documentation"
    documentation.mkdir()
    told = model.text or readme(model.name)
    (documentation / "README.md").write_text(told)
    (documentation / "index.html").write_text(page(model.name, told), encoding="utf-8")
    # in a process of its own: the builder imports the script, and what it imports stays
    script_name, place, code, pages = (str(p) for p in (script, room, room / "code.zip", documentation))
    call = f"build_FMU({script_name!r}, {place!r}, [{code!r}], {pages!r})"
    environment = {**os.environ, "DEEPSEA_COSIM_CACHE": str(room / "cache")}
    command = f"from {version.builder} import FmuBuilder; FmuBuilder.{call}"
    run_python(["-c", command], environment, f"{model.name} cannot be built")
    [raw] = room.glob("*.fmu")
    with zipfile.ZipFile(raw) as archive:
        # the sources that pythonfmu3 adds are those of its own library
        return {name: archive.read(name) for name in archive.namelist() if not name.startswith("sources/")}


def _add_front(
    model: Model, files: dict[str, bytes], room: Path, say: Callable[[str], None], way: Way
) -> None:
    """Put the front library before pythonfmu's, where there is one."""
    if front := front_library(room):
        binaries = f"binaries/{PLATFORM}/{model.name}"
        files[f"{binaries}_pythonfmu.so"] = files[f"{binaries}.so"]
        for suffix, content in front.items():
            files[f"{binaries}{suffix}.so"] = content
        files["resources/front.txt"] = sys.platform.encode()
        needs = [name for name in model.needs if not (way.standalone and name == "numba")]
        lines = (f"{name}=={metadata.version(name)}\n" for name in needs)
        files["resources/requirements.txt"] = "".join(lines).encode()
        if way.standalone:
            from . import standalone

            for name in [n for n in files if n.startswith("binaries/") and not n.startswith(f"binaries/{PLATFORM}/")]:
                del files[name]  # of systems whose Python it does not carry
            files |= standalone.files(needs)
            text = files["modelDescription.xml"]
            files["modelDescription.xml"] = text.replace(b'needsExecutionTool="true"', b'needsExecutionTool="false"')
        elif way.portable:
            files["resources/python.txt"] = interpreter().encode()
    elif way.portable or way.standalone:
        needs = "Linux and a C compiler, or a wheel that brought what it compiles"
        raise PackageError(f"--portable and --standalone need {needs}")
    else:
        say("there is no front library here (no C compiler, or not Linux): faults will be fmi2Fatal")


def build_fmus(
    models: Sequence[Model], folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None
) -> Iterator[Path]:
    """`build_fmu` of each, side by side, for the kernels of each are compiled in a process of its own."""
    yield from side_by_side(lambda model: build_fmu(model, folder, say, way), models)


def build(folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None) -> list[Path]:
    """Build all FMUs and all scenarios into `folder`; `say` gets a line per file. Returns the files.

    Raises `OutputError` where another build is at work in that folder: both would write to the same places.
    """
    make_folder(folder)
    with held(folder, "another build"):
        return _build_into(folder, say, way)


def _build_into(folder: Path, say: Callable[[str], None], way: Way | None) -> list[Path]:
    made = [folder / f"{model.name}.fmu" for model in MODELS]
    old = [m for m, path in zip(MODELS, made, strict=True) if not is_current(path, m, way or Way())]
    built = {path: f"{path.stat().st_size / 1024:.0f} kB" for path in build_fmus(old, folder, say, way)}
    for path in made:
        say(f"{path}  {built.get(path, 'is up to date')}")
    fmus = {f"resources/{path.name}": path for path in made}
    for name in SYSTEMS:
        system = system_folder(name)
        structure = system / "SystemStructure.ssd"
        own = {source: path for source, path in fmus.items() if f'"{source}"' in structure.read_text()}
        extra = {f"resources/{path.name}": path for path in system.glob("*.toml")}
        for parameters in sorted(system.glob("*.ssv")):
            target = folder / f"{parameters.stem}.ssp"
            packer.pack(structure, parameters, own, target, extra)
            made.append(target)
            say(str(target))
    return made
