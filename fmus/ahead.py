"""Kernels compiled when the FMU is built, so that it needs no numba: `python -m deepsea_cosim.fmus.ahead CLASS
MODULE FOLDER`, or with `REPLACED=FILE` behind for a module of `fmus` that the FMU has another content of.

Each kernel that the FMU's Python code calls gets a C function over plain pointers (numba's cfunc), whose object code is
linked to kernels.so; kernels.json tells their arguments. In the FMU `jit_ahead.py.in` takes the place of `core/jit.py`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = __package__.rpartition(".")[0]


def exercised(module: str, name: str) -> list[Any]:
    """The kernels that the Python code of a model has called in a short life, compiled for their arguments."""
    from numba.core.registry import CPUDispatcher

    import_module(f"{ROOT}.core.jit").called = lambda step: step  # the kernel itself
    import_module(f"{ROOT}.fmus.instance").called = lambda step: step
    model = getattr(import_module(f"{ROOT}.fmus.{module}"), name)(
        instance_name="ahead", resources="", visible=False, logger=0
    )
    model.setup_experiment(0.0)
    model.enter_initialization_mode()
    model.exit_initialization_mode()
    for k in range(2):
        model.do_step(k * 1e-3, 1e-3)
    found = {}
    for loaded in [m for n, m in sys.modules.items() if n.startswith(f"{ROOT}.")]:
        for value in vars(loaded).values():
            if isinstance(value, CPUDispatcher) and value.signatures:
                found[key_of(value)] = value
    return [found[key] for key in sorted(found)]


def key_of(kernel: Any) -> str:
    """Module below the project's package, and name."""
    return f"{kernel.__module__.removeprefix(f'{ROOT}.')}.{kernel.__name__}"


def compiled(kernel: Any) -> tuple[bytes, dict[str, Any]] | None:
    """(object code, description) of a kernel of arrays and numbers; None for others, which run as Python."""
    from numba import carray, cfunc, types

    signature = kernel.nopython_signatures[0]
    result = types.unliteral(signature.return_type)
    plain = (types.int64, types.float64, types.boolean)
    arrays = [t for t in signature.args if isinstance(t, types.Array) and t.dtype == types.float64 and t.layout == "C"]
    if result not in (types.none, *plain) or any(t not in plain and t not in arrays for t in signature.args):
        return None
    names, kinds, arguments, told = [], [], [], []
    for i, kind in enumerate(signature.args):
        if isinstance(kind, types.Array):
            sizes = [f"n{i}_{d}" for d in range(kind.ndim)]
            names += [f"p{i}", *sizes]
            kinds += [types.CPointer(kind.dtype), *([types.intp] * kind.ndim)]
            arguments.append(f"carray(p{i}, ({', '.join(sizes)},))")
            told.append(f"array{kind.ndim}")
        else:
            names.append(f"x{i}")
            kinds.append(kind)
            arguments.append(f"x{i}")
            told.append(str(kind))
    space: dict[str, Any] = {"kernel": kernel, "carray": carray}
    exec(f"def call({', '.join(names)}):\n    return kernel({', '.join(arguments)})\n", space)  # noqa: S102  our own text
    made = cfunc(types.void(*kinds) if result == types.none else result(*kinds))(space["call"])
    code = made._library._get_compiled_object()
    return code, {"symbol": made.native_name, "arguments": told, "result": str(result)}


def build(name: str, module: str, folder: Path, compiler: str) -> None:
    """Write kernels.so and kernels.json of the model of that class and module of `fmus` into a folder."""
    table, objects = {}, []
    for kernel in exercised(module, name):
        made = compiled(kernel)
        if made is None:
            continue
        objects.append(folder / f"kernel{len(objects)}.o")
        objects[-1].write_bytes(made[0])
        table[key_of(kernel)] = made[1]
    runtime = HERE / "front" / "kernels.c"
    command = [compiler, "-O2", "-shared", "-fPIC", "-w", "-Wl,-z,notext", *map(str, objects), str(runtime), "-o",
               str(folder / "kernels.so"), "-lm"]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    (folder / "kernels.json").write_text(json.dumps(table, indent=1))


def main(arguments: list[str]) -> None:
    """Build the kernels of a model into a folder."""
    from ..core.ending import die_with_parent
    from .build import c_compiler

    die_with_parent()
    name, module, folder, *replaced = arguments
    for one in replaced:
        other, _, file = one.partition("=")
        exec(Path(file).read_text(), vars(import_module(f"{ROOT}.fmus.{other}")))  # noqa: S102  our own
    compiler = c_compiler()
    assert compiler
    build(name, module, Path(folder), compiler)


if __name__ == "__main__":
    main(sys.argv[1:])
