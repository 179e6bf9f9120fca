"""manifest.json: what a run was made of, so that it can be repeated exactly."""

from __future__ import annotations

import hashlib
import json
import platform
import shlex
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.files import replacing
from ...core.versions import versions
from ...ssp.flat_system import FlatSystem
from .saved_state import state_file

if TYPE_CHECKING:
    from ..options import Options


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            found.update(block)
    return found.hexdigest()


def manifest(package: Path, network: FlatSystem, options: Options) -> dict[str, Any]:
    """Inputs with their hashes, options, versions, and the command that repeats the run."""
    files = sorted({flat_component.component.source for flat_component in network.components.values()})
    root = network.structure.file.parent
    names = [path.relative_to(root).as_posix() if path.is_relative_to(root) else path.name for path in files]
    whole = network.structure.file if package.is_dir() else package
    inputs = {str(package): digest(whole), **{n: digest(path) for n, path in zip(names, files, strict=True)}}
    if options.stimuli is not None:
        inputs[str(options.stimuli)] = digest(options.stimuli)
    inputs |= {str(path): digest(path) for path in options.parameters}
    if options.resume is not None:
        inputs[str(state_file(options.resume))] = digest(state_file(options.resume))
    return {
        "sha256": inputs,
        "options": {k: _plain(v) for k, v in asdict(options).items()},
        "command": shlex.join(["cosim-master", str(package), *_arguments(options)]),
        "versions": versions(),
        "platform": platform.platform(),
    }


def _plain(value: Any) -> Any:
    """For JSON: paths as texts."""
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return str(value) if isinstance(value, Path) else value


def _arguments(options: Options) -> list[str]:
    made: list[str] = []
    for name, value in (
        ("variant", options.variant), ("step", options.step), ("stop-time", options.stop_time),
        ("stimuli", options.stimuli), ("step-timeout", options.step_timeout), ("resume", options.resume),
        ("save-state-every", options.save_state_every),
    ):  # fmt: skip
        if value is not None:
            made += [f"--{name}", str(value)]
    assert options.method is not None  # the one that is used
    made += ["--method", options.method]
    for path in options.parameters:
        made += ["--parameters", str(path)]
    for address, value in options.changes:
        made += ["--set", f"{address}={value}"]
    for component, ratio in options.substeps:
        made += ["--substeps", f"{component}={ratio}"]
    for pattern in options.record:
        made += ["--record", pattern]
    for pattern in options.record_parameters:
        made += ["--record-parameters", pattern]
    if options.record_every != 1:
        made += ["--record-every", str(options.record_every)]
    made += ["--results", options.results] if options.results != "results.csv" else []
    for option, given in (("log", options.log), ("log-level", options.log_level)):
        made += [f"--{option}", given] if given else []
    for category in options.log_categories:
        made += ["--log-category", category]
    for pattern in options.plot:
        made += ["--plot", pattern]
    for name in ("isolate", "sandbox", "parallel", "realtime", "check_step", "save_state"):
        made += [f"--{name.replace('_', '-')}"] if getattr(options, name) else []
    return made


def write_manifest(folder: Path, content: dict[str, Any]) -> None:
    """Write manifest.json."""
    with replacing(folder / "manifest.json") as part:
        part.write_text(json.dumps(content, indent=2) + "\n")
