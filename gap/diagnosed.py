"""A diagnosis with its files: run into a folder, and what came of it as a value to look at."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.cli import need
from ..core.figures import in_notebooks
from ..core.files import held, make_folder, write_together
from .campaign.campaign import Campaign
from .problem.stop import StopToken
from .report.signals import Signals

REPORT = "report.html"


@dataclass(frozen=True)
class Diagnosed:
    """What a diagnosis found, and the folder that has its files."""

    folder: Path
    summary: dict[str, Any]
    """The content of diagnosis.json (schema 2)."""
    signals: Signals
    """What was measured and modelled, for pictures."""
    files: tuple[str, ...]
    """Names of the files in the folder."""

    def __repr__(self) -> str:
        """In a notebook or at a prompt: what the command prints."""
        return self.text

    @property
    def text(self) -> str:
        """What the command prints."""
        from .summary import lines

        return "\n".join(lines(self.summary, self.signals, "utf-8", f"{self.folder}: {', '.join(self.files)}"))

    def frame(self) -> Any:
        """The parts of the gap as a pandas frame, the largest first: share with its 95 % interval, probability."""
        import pandas as pd

        rows = []
        for part in self.summary["budget"]["parts"]:
            low, high = part["ci95"]
            rows.append({
                "what": ", ".join(part["effects"]) if part["kind"] == "effect" else part["kind"],
                "group": part.get("group"), "share": part["share"], "low": low, "high": high,
                "probability": part.get("inclusion_probability"),
            })  # fmt: skip
        return pd.DataFrame(rows).set_index("what").sort_values("share", ascending=False)

    def plot(self) -> Any:
        """A matplotlib figure of the parts with their intervals."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        parts = self.frame().iloc[::-1]
        made = Figure(figsize=(7.0, 1.0 + 0.45 * len(parts)), layout="constrained")
        FigureCanvasAgg(made)
        axes = made.subplots()
        around = [100 * side.clip(lower=0) for side in (parts["share"] - parts["low"], parts["high"] - parts["share"])]
        axes.barh(parts.index, 100 * parts["share"], xerr=around, color="0.6", ecolor="0.2", capsize=3)
        axes.set_xlabel("share of what calibration leaves of the gap [%]")
        axes.set_xlim(0, None)
        return in_notebooks(made)


def diagnose_into(
    campaign: Campaign | str | Path, folder: Path | None = None, *, processes: int | None = None,
    dask: str | None = None, time_limit: float | None = None, resume: Path | None = None, report: bool = True,
    stop: StopToken | None = None, on_stage: Callable[[str], None] = lambda text: None,
    progress: Callable[[int], None] = lambda runs: None, on_finding: Callable[[str], None] = lambda text: None,
    on_end: Callable[[], None] = lambda: None,
) -> Diagnosed:  # fmt: skip
    """Diagnose a campaign and write its files into a folder (`diagnosis` beside the campaign where none is named).

    time_limit: judge what has been found after so long [s], as does `stop` when it is requested; resume: the folder of
    an earlier diagnosis; on_stage, progress, on_finding: see `diagnose`; on_end: called when nothing more is simulated.
    """
    need("gap", "scipy", "sklearn", "arch", "ruptures", *(("jinja2",) if report else ()))
    from ..master.parallel.pool import cluster
    from .campaign.packed import campaign_at
    from .diagnose import diagnose
    from .report.collect import collect
    from .result.read import load_earlier
    from .result.write import texts

    place = campaign.file if isinstance(campaign, Campaign) else Path(campaign)
    folder = place.parent / "diagnosis" if folder is None else folder
    if stop is None and time_limit is not None:
        until = time.monotonic() + time_limit
        stop = StopToken(lambda: time.monotonic() > until)
    with ExitStack() as stack:
        read_campaign = campaign if isinstance(campaign, Campaign) else stack.enter_context(campaign_at(place))
        earlier = None if resume is None else load_earlier(resume)
        make_folder(folder)
        stack.enter_context(held(folder, "another diagnosis"))
        executor = stack.enter_context(cluster(dask))
        d = diagnose(
            read_campaign, executor, on_stage, progress, processes, stop, on_finding=on_finding, earlier=earlier
        )
        on_end()
        data, made = texts(d)
        signals = collect(d.state)
        if report:
            from .report import render

            made[REPORT] = render(data, signals)
        write_together(folder, made)
    return Diagnosed(folder, data, signals, tuple(made))
