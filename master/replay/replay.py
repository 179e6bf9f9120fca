"""A replay: the run's scenes on their stage, its frames, its camera, and what is written beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core.display_units import DisplayUnits
from ...core.errors import PackageError, UsageError
from ...ssp.model import ReplayAsked
from ..system.package import read_package
from .camera import framing, projected
from .colours import Coloured, Scale, coloured_film, colours
from .film import Eye, Film
from .labels import Label, labels
from .lettering import Lettering
from .motion import Motion, corners, film, places, spines
from .offscreen import pictures
from .recorded import RecordedRun, recorded
from .scene import Scene, scene_of
from .stage import OPENING, Stage, build

if TYPE_CHECKING:
    from PIL import Image

MOST = 100_000
"""Most pictures: an hour of 30 a second."""

LOOKS = 60
"""Frames of the whole motion from which the camera's place is taken."""


@dataclass(frozen=True)
class Replay:
    """What can be shown of a run."""

    run: RecordedRun
    stage: Stage
    motions: tuple[Motion, ...]
    scales: tuple[Scale, ...]
    coloured: tuple[Coloured, ...]
    labels: tuple[Label, ...]
    legend: tuple[str, ...]
    remarks: tuple[str, ...]

    def film(self, times: np.ndarray) -> Film:
        """The frames at these times [s]."""
        return coloured_film(film(self.stage.model, self.motions, times), self.coloured, times)

    def eye(self, aspect: float, view: tuple[float, float] | None = None) -> Eye:
        """The camera that sees the whole motion of the run."""
        whole = film(self.stage.model, self.motions, np.linspace(self.run.times[0], self.run.times[-1], LOOKS))
        return framing(corners(whole).reshape(-1, 3), view or self.stage.view, OPENING, aspect)


def prepared(run: RecordedRun, display: DisplayUnits, other: RecordedRun | None = None) -> Replay:
    """Bring a run's scenes onto a stage, with those of another run as ghosts. Raises `PackageError` in one line where
    no FMU of the package carries a scene, or one is not as it should be."""
    scenes, asked = _carried(run)
    ghosts: list[tuple[Scene, RecordedRun]] = []
    if other is not None:
        own = {scene.component for scene in scenes}
        ghosts = [(scene, other) for scene in _carried(other)[0] if scene.component in own]
        if not ghosts:
            raise UsageError(
                f"{other.folder}: none of its components is called {' or '.join(sorted(own))}, as in {run.folder}"
            )
    stage = build(scenes, run, ghosts)
    motions = tuple(Motion(stage.model, p.scene, p.run, p.prefix) for p in stage.parts)
    scales, coloured, remarks = colours(asked, stage)
    shown, more = labels(asked, stage, display)
    legend = _legend(run.folder, other.folder) if other is not None else ()
    told = [*run.remarks, *(other.remarks if other is not None else ()), *remarks, *more]
    return Replay(run, stage, motions, scales, coloured, shown, legend, tuple(told))


def _legend(solid: Path, translucent: Path) -> tuple[str, str]:
    """Which run is which: names of the folders, or paths where the names are the same."""
    one, other = (path.resolve().name for path in (solid, translucent))
    return (f"solid: {one}", f"ghost: {other}") if one != other else (f"solid: {solid}", f"ghost: {translucent}")


def _carried(run: RecordedRun) -> tuple[list[Scene], ReplayAsked]:
    """The scenes that the package's FMUs carry, and what the package adds."""
    single = run.package.suffix.lower() in (".ssd", ".fmu", ".xml")
    with ExitStack() as stack:
        network = read_package(run.package, stack, None if single else run.variant)
        found = [scene_of(path, flat.component.source) for path, flat in network.components.items()]
    scenes = [scene for scene in found if scene is not None]
    if not scenes:
        raise PackageError(
            f"{run.package}: none of its FMUs carries a scene (resources/replay/scene.xml), so nothing can be drawn; "
            "docs/fmus.md says how one does"
        )
    return scenes, network.structure.replay


def times_of(run: RecordedRun, begin: float | None, end: float | None, every: float) -> np.ndarray:
    """Times (n,) [s] at distances of `every` [s], from beginning to end or those of the run."""
    first, last = float(run.times[0]), float(run.times[-1])
    start, stop = first if begin is None else begin, last if end is None else end
    if not first <= start <= stop <= last:
        raise UsageError(f"--from {start:g} --to {stop:g}: the run goes from {first:g} to {last:g} s")
    count = int((stop - start) / every + 1e-6) + 1
    if count > MOST:
        raise UsageError(
            f"these would be {count} pictures: give a higher --speed, or a part of the run with --from and --to"
        )
    return start + every * np.arange(count)


def drawn(
    replay: Replay, times: np.ndarray, size: tuple[int, int], display: DisplayUnits, speed: float = 1.0,
    view: tuple[float, float] | None = None, progress: Callable[[int, int], None] = lambda done, total: None,
) -> Iterator[Image.Image]:  # fmt: skip
    """The pictures at these times [s], one after the other, as they are drawn."""
    shot, eye = replay.film(times), replay.eye(size[0] / size[1], view)
    anchors = projected(places(shot, [label.place for label in replay.labels]), eye, OPENING, size)
    kept = range(0, len(shot), max(1, len(shot) // LOOKS))
    busy = projected(spines(shot, kept), eye, OPENING, size)
    lettering = Lettering(size, replay.scales, replay.labels, anchors, display, replay.legend, speed, (kept, busy))
    for k, picture in enumerate(pictures(shot, eye, *size)):
        yield lettering.written(picture, k, float(times[k]))
        progress(k + 1, len(times))


def replay(folder: Path, display: DisplayUnits, other: Path | None = None, package: Path | None = None) -> Replay:
    """The replay of the run in a folder, with that of another as a ghost; `package` where that of the run has been
    moved."""
    return prepared(recorded(folder, package), display, recorded(other) if other is not None else None)
