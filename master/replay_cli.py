"""The command cosim-master replay. Everything heavy is imported only when there is something to draw."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.cli import OneLineParser, decimal, exit_code, positive
from ..core.console import add_output, conclude
from ..core.plain_numbers import plain_number

if TYPE_CHECKING:
    from ..core.display_units import DisplayUnits
    from .replay.replay import Replay

EXAMPLES = """examples:
  cosim-master replay results/deepsea_11km                      in MuJoCo's viewer, in real time
  cosim-master replay results/deepsea_11km --speed 2 --from 5 --to 15
  cosim-master replay results/deepsea_11km --video stroke.mp4   without a display; needs pip install ".[replay]"
  cosim-master replay results/deepsea_11km --gif stroke.gif --speed 4
  cosim-master replay results/deepsea_11km results/deepsea_0km --video both.mp4    the second as a ghost

exit codes: 0 done, 2 bad input or nothing to draw with, 130 interrupted (143 by SIGTERM, 129 by SIGHUP)
"""

VIDEO, GIF = ((1280, 720), 30.0), ((640, 360), 15.0)
"""Size and pictures a second where they are not stated: a GIF keeps every picture whole."""

LARGEST = 8192


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise argparse.ArgumentTypeError(f"'{text}': expected width x height in pixels, e.g. 1280x720")
    size = int(width), int(height)
    if min(size) < 64 or max(size) > LARGEST or size[0] % 2 or size[1] % 2:
        raise argparse.ArgumentTypeError(f"{text}: width and height have to be even, from 64 to {LARGEST}")
    return size


def _ending(suffix: str) -> Callable[[str], Path]:
    """A path whose name ends so, for what is written follows from the option."""

    def path(text: str) -> Path:
        if not text.lower().endswith(suffix):
            raise argparse.ArgumentTypeError(f"'{text}': the name has to end in {suffix}")
        return Path(text)

    return path


def _view(text: str) -> tuple[float, float]:
    try:
        azimuth, elevation = (plain_number(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}': expected azimuth,elevation in degrees, e.g. 90,-10") from None
    if not (math.isfinite(azimuth) and -89.0 <= elevation <= 89.0):
        raise argparse.ArgumentTypeError(f"{text}: the elevation has to be from -89 to 89 degrees")
    return azimuth, elevation


def _above_zero(text: str) -> float:
    value = decimal(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: it has to be positive")
    return value


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-master replay", epilog=EXAMPLES,
        description="Show the machine in motion, from the results of a run. Its FMUs carry what is drawn.",
    )  # fmt: skip
    p.add_argument("run", metavar="DIR", type=Path, help="result folder of a run")
    p.add_argument("other", metavar="OTHER", type=Path, nargs="?", help="of another run, which is drawn as a ghost")
    p.add_argument(
        "--video", metavar="FILE.mp4", type=_ending(".mp4"), help="write a video instead of opening the viewer"
    )
    p.add_argument("--gif", metavar="FILE.gif", type=_ending(".gif"), help="write a GIF instead; both is possible")
    p.add_argument("--speed", metavar="X", type=_above_zero, default=1.0, help="times as fast as it was (default: 1)")
    p.add_argument("--from", metavar="S", type=decimal, dest="begin", help="begin at this time in seconds")
    p.add_argument("--to", metavar="S", type=decimal, dest="end", help="end at this time in seconds")
    p.add_argument("--size", metavar="WxH", type=_size, help="pixels (default: 1280x720 of a video, 640x360 of a GIF)")
    p.add_argument("--fps", metavar="N", type=positive, help="pictures a second (default: 30 of a video, 15 of a GIF)")
    p.add_argument("--view", metavar="A,E", type=_view, help="look from azimuth,elevation in degrees, e.g. 90,-10")
    p.add_argument("--package", metavar="FILE.ssp", type=Path, help="the package of the run, where it has been moved")
    p.add_argument("--units", metavar="LIST", help="units of labels and scales, as for a run")
    add_output(p)
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    return exit_code("cosim-master replay", lambda: _replay(options), as_json=options.json)


def _replay(options: argparse.Namespace) -> int:
    from ..core.display_units import display_units
    from .replay import viewer, writers

    in_window = options.video is None and options.gif is None
    if in_window:
        viewer.check_display()
    if options.video is not None:
        writers.check_video()
    from .replay.replay import replay, times_of

    display = display_units(options.units)
    found = replay(options.run, display, options.other, options.package)
    for remark in found.remarks:
        print(f"cosim-master replay: {remark}", file=sys.stderr)
    if in_window:
        times = times_of(found.run, options.begin, options.end, options.speed / viewer.RATE)
        viewer.show(found, times, display, options.speed, options.view)
    wanted = ((options.video, VIDEO), (options.gif, GIF))
    made = [_write(options, found, display, path, usual) for path, usual in wanted if path is not None]

    def lines() -> list[str]:
        return [
            f"{m['file']}: {m['pictures']} pictures of {m['width']} x {m['height']}, {m['seconds']:.1f} s" for m in made
        ]

    conclude(options, lambda: {"files": made, "remarks": list(found.remarks)}, lines)
    return 0


def _write(
    options: argparse.Namespace, found: Replay, display: DisplayUnits, path: Path, usual: tuple[tuple[int, int], float]
) -> dict[str, Any]:
    """Draw what is asked for into a file; says what is in it."""
    from .replay.replay import drawn, times_of
    from .replay.writers import write_gif, write_video
    from .terminal import Progress

    size, fps = options.size or usual[0], float(options.fps or usual[1])
    times = times_of(found.run, options.begin, options.end, options.speed / fps)
    progress = Progress(options.quiet or options.json, "picture")
    shots = drawn(found, times, size, display, options.speed, options.view, progress)
    if usual is VIDEO:
        write_video(path, shots, size, fps)
    else:
        write_gif(path, shots, fps)
    return {
        "file": path, "pictures": len(times), "width": size[0], "height": size[1], "seconds": len(times) / fps,
    }  # fmt: skip
