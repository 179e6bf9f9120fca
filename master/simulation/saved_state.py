"""A run at one of its communication points, in a file from which another run goes on.

The file is a zip archive of JSON and of arrays without pickle: nothing in it is executed here. The FMUs' states are the
bytes that they have serialised, for themselves.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import UsageError
from ...core.files import replacing
from ...core.zips import add

STATE_FILE = "state.zip"
"""Its name in a result folder."""

SCHEMA = 1
"""Of the file; a reader refuses any other."""

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class SavedState:
    """All that a run needs to go on as if it had never stopped."""

    time: float
    """Of the communication point [s]."""
    done: int
    """Macro steps from the start of the first run to there."""
    step: float
    """Macro step [s]."""
    identity: Mapping[str, Any]
    """What the run was made of, by what to call it; see `identity`."""
    stimuli: str | None
    """SHA-256 of what drove the system."""
    versions: Mapping[str, str]
    answers: Mapping[str, Mapping[str, list[str]]]
    """By component what was found out of its outputs: the inputs that each answers to at once."""
    values: np.ndarray
    """The slots of all signals (n,), as integers: bit for bit."""
    texts: list[str | bytes]
    memories: Mapping[str, Arrays]
    """What the coupling remembers, by name."""
    fmus: Mapping[str, bytes]
    """Serialised states by component."""


def write_state(path: Path, state: SavedState) -> None:
    """Write the file, all or nothing; raises `OutputError`."""
    memories = {name: list(arrays) for name, arrays in state.memories.items()}
    head = {
        "schema": SCHEMA, "time_s": state.time, "steps": state.done, "step_s": state.step, "identity": state.identity,
        "stimuli": state.stimuli, "versions": state.versions, "answers": state.answers,
        "texts": [{"hex": t.hex()} if isinstance(t, bytes) else t for t in state.texts], "memories": memories,
        "fmus": list(state.fmus),
    }  # fmt: skip
    with replacing(path) as part, part.open("wb") as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            add(archive, "state.json", json.dumps(head, indent=1))
            add(archive, "values.npy", _packed(state.values))
            for i, arrays in enumerate(state.memories.values()):
                for k, array in enumerate(arrays.values()):
                    add(archive, f"memory/{i}/{k}.npy", _packed(array))
            for i, content in enumerate(state.fmus.values()):
                add(archive, f"fmu/{i}.bin", content)
        file.flush()
        os.fsync(file.fileno())  # a run of days is worth it


def read_state(path: Path) -> SavedState:
    """The state in a file, or in the result folder of a run; raises `UsageError` for what is none."""
    file = state_file(path)
    try:
        with zipfile.ZipFile(file) as archive:
            head = json.loads(archive.read("state.json"))
            if head["schema"] != SCHEMA:
                raise UsageError(f"--resume {path}: it is of schema {head['schema']}, here {SCHEMA} is read")
            memories = {
                name: {key: _unpacked(archive.read(f"memory/{i}/{k}.npy")) for k, key in enumerate(keys)}
                for i, (name, keys) in enumerate(head["memories"].items())
            }
            texts = [bytes.fromhex(t["hex"]) if isinstance(t, dict) else t for t in head["texts"]]
            return SavedState(
                head["time_s"], head["steps"], head["step_s"], head["identity"], head["stimuli"], head["versions"],
                head["answers"], _unpacked(archive.read("values.npy")), texts, memories,
                {name: archive.read(f"fmu/{i}.bin") for i, name in enumerate(head["fmus"])},
            )  # fmt: skip
    except FileNotFoundError:
        reason = f"there is no {STATE_FILE} in it" if path.is_dir() else "no such file"
        raise UsageError(f"--resume {path}: {reason}; a run with --save-state makes one") from None
    except OSError as error:
        raise UsageError(f"--resume {path}: cannot be read ({error.strerror or error})") from None
    except (zipfile.BadZipFile, KeyError, TypeError, ValueError, AttributeError, EOFError) as error:
        raise UsageError(f"--resume {path}: it is no saved state, or damaged ({error})") from None


def state_file(path: Path) -> Path:
    """The file that a path means, which may be a result folder."""
    return path / STATE_FILE if path.is_dir() else path


def _packed(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def _unpacked(content: bytes) -> np.ndarray:
    array: np.ndarray = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    return array
