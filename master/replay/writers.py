"""Pictures into a file that moves: MP4 by ffmpeg, GIF by Pillow. A file appears when it is complete."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import OutputError, UsageError, install
from ...core.files import make_folder, replacing

if TYPE_CHECKING:
    from PIL import Image

TICK = 0.01
"""Times in a GIF are multiples of this [s]; shorter ones than two are shown slowly by most viewers."""


def check_video() -> None:
    """Raise `UsageError` where nothing here writes MP4."""
    if find_spec("imageio_ffmpeg") is None:
        raise UsageError(f"--video needs imageio-ffmpeg: {install('replay')}; --gif needs nothing more")


def write_video(path: Path, pictures: Iterable[Image.Image], size: tuple[int, int], fps: float) -> None:
    """H.264 that every player and browser shows; `size` is (width, height), both even."""
    import imageio_ffmpeg

    make_folder(path.parent)
    how = {"codec": "libx264", "quality": None, "macro_block_size": 2, "ffmpeg_log_level": "error"}
    more = ["-crf", "20", "-preset", "veryfast", "-movflags", "+faststart"]
    with replacing(path) as part:
        try:
            with closing(
                imageio_ffmpeg.write_frames(str(part), size, fps=fps, output_params=more, **how)
            ) as file:  # fmt: skip
                file.send(None)
                for picture in pictures:
                    file.send(picture.tobytes())
        except OSError as error:  # it says in many lines what went wrong
            raise OutputError(f"{path}: cannot be written ({' '.join(str(error).split())[-200:]})") from None


def write_gif(path: Path, pictures: Iterable[Image.Image], fps: float) -> None:
    """A GIF that repeats itself, each picture with colours of its own."""
    from PIL import Image

    make_folder(path.parent)
    way = Image.Quantize.MAXCOVERAGE  # or floor and water take all colours, and the scale has steps
    frames = [picture.quantize(255, way, dither=Image.Dither.NONE) for picture in pictures]
    ends = [round((k + 1) / fps / TICK) for k in range(len(frames))]
    shown = [max(1, end - begin) * round(1000 * TICK) for begin, end in zip([0, *ends], ends, strict=False)]
    with replacing(path) as part:
        frames[0].save(part, save_all=True, append_images=frames[1:], duration=shown, loop=0, optimize=False)
