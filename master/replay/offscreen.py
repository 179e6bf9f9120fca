"""Pictures without a display. They are drawn in a process of their own (`painter`), for which driver MuJoCo draws with
is settled when it is imported; the next driver is tried where one cannot draw.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from typing import IO

import numpy as np

from ...core.errors import CosimError
from ...core.scratch import scratch
from .film import Eye, Film, save

BACKENDS = ("egl", "osmesa", "glfw")
READY, PICTURE, SAME = b"R", b"P", b"S"
"""What the painter says: it can draw; a picture follows; it would be the one before."""


class NoPictures(CosimError):
    """Nothing here can draw."""


def pictures(film: Film, eye: Eye, width: int, height: int) -> Iterator[np.ndarray]:
    """The frames of a film, each (height, width, 3) of bytes. Raises `NoPictures` where nothing can draw."""
    chosen = os.environ.get("MUJOCO_GL")
    told = ""
    with scratch("pictures") as folder:
        save(film, folder)
        (folder / "order.json").write_text(json.dumps({"eye": asdict(eye), "size": [width, height]}))
        for backend in [chosen] if chosen else BACKENDS:
            with (folder / "said.txt").open("w+b") as said:
                command = [sys.executable, "-m", f"{__package__}.painter", str(folder)]
                environment = {**os.environ, "MUJOCO_GL": backend}
                painter = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=said)
                assert painter.stdout is not None
                try:
                    if painter.stdout.read(1) == READY:
                        yield from _received(painter.stdout, len(film), (height, width, 3))
                        return
                finally:
                    painter.kill()
                    painter.stdout.close()
                    painter.wait()
                said.seek(0)
                lines = said.read().decode(errors="replace").strip().splitlines()
                told = (lines or [f"code {painter.returncode}"])[-1]
    raise NoPictures(f"nothing can be drawn here ({told}); set MUJOCO_GL to egl or osmesa")


def _received(pipe: IO[bytes], count: int, shape: tuple[int, int, int]) -> Iterator[np.ndarray]:
    size, shot = int(np.prod(shape)), np.empty(shape, np.uint8)
    for k in range(count):
        kind = pipe.read(1)
        if kind == PICTURE:
            content = pipe.read(size)
            if len(content) == size:
                shot = np.frombuffer(content, np.uint8).reshape(shape)
                yield shot
                continue
        elif kind == SAME:
            yield shot
            continue
        raise NoPictures(f"drawing ended at frame {k + 1} of {count}")
