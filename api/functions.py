"""The functions of the public door; each imports what it needs when it is called."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .gap.campaign.campaign import Campaign
    from .gap.diagnosed import Diagnosed
    from .master.simulation.check import Checked
    from .master.simulation.result import Result
    from .study.sweep.result import Sweep


def simulate(
    package: str | Path, out: str | Path | None = None, progress: Callable[[int, int], None] = lambda *_: None,
    **options: Any,
) -> Result:  # fmt: skip
    """Run an SSP package, a folder like one, an .ssd, or an FMU on its own, as `cosim-master` does.

    out: the folder of the results; without it results/<name of the package>. progress: gets (steps done, steps in all).

    The options are those of the command, with their defaults: step, stop_time [s]; method; changes: parameters by
    address, what --set takes (`{"arm.load_weight": 1000, "target": "200mm"}`); parameters: .ssv files; variant;
    stimuli: a CSV file; record, record_parameters: patterns; record_every; results: name of the file, "" for none;
    log: name of a file for what FMUs say; log_level; log_categories; substeps: by component; check_step, realtime,
    isolate, sandbox, parallel and save_state: True or False; step_timeout, save_state_every [s]; resume: a saved state,
    or the folder that has one.

    Returns the result: `.frame()` is a pandas frame of the signals, `.plot()` a figure, `.summary` what summary.json
    says. Raises `CosimError`, one line, for whatever is wrong; what was recorded until then is on disk.

    >>> result = simulate("deepsea_11km.ssp", changes={"arm.load_weight": "1kN"})   # doctest: +SKIP
    >>> result.frame()["arm.x_h"].max(), result.summary["warnings"]                 # doctest: +SKIP
    """
    from .core.files import name_of_results
    from .master.options import as_path, options_of
    from .master.simulation.run import run

    path = as_path("package", package)
    folder = as_path("out", out) if out is not None else Path("results") / name_of_results(path)
    return run(path, folder, options_of(options), progress=progress)


def write_page(folder: str | Path, units: str | None = None) -> Path:
    """Write results.html, a run as an interactive page in one file, into its result folder; returns its path.

    units: what `--units` takes ("si", "bar,mm"). Raises `CosimError` where the folder holds no result.

    >>> write_page("results/deepsea_11km", units="bar")                             # doctest: +SKIP
    """
    from .core.display_units import display_units
    from .master.page.write import write_page as made

    return made(Path(folder), display_units(units))


def compose(
    target: str | Path, fmus: Mapping[str, str | Path], links: Sequence[tuple[str, str]] = (),
    values: Mapping[str, Any] | None = None, *, stop: float = 10.0, step: float | None = None,
    method: str | None = None, catalogue: str | Path | None = None,
) -> Path:  # fmt: skip
    """Make an SSP package of FMUs, the connections between them and values.

    fmus: files by the names of the components; links: pairs ("component.output", "component.input"); values: parameters
    by "component.parameter", in the FMU's units; stop, step [s] and method: how it is meant to be run; catalogue: a
    file effects.toml of what the real system may have that the FMUs lack, for `diagnose`.

    Returns the package's path. Raises `CosimError` that names the component or variable that is not there.

    >>> compose("swing.ssp", {"body": "Body.fmu", "spring": "Spring.fmu"},          # doctest: +SKIP
    ...         [("body.x", "spring.x"), ("spring.F", "body.F")], {"body.m": 2.0}, step=1e-3)
    """
    from .ssp.compose import compose as made

    extra = {} if catalogue is None else {"resources/effects.toml": Path(catalogue)}
    files = {name: Path(path) for name, path in fmus.items()}
    return made(Path(target), files, links, values, stop, step, method, extra)


def check(package: str | Path, **options: Any) -> Checked:
    """Look for all that is wrong with a package and with how it is to be run, without loading an FMU.

    The options are those of `simulate`. The result has `.errors`, `.warnings` and `.notes`, a line each.

    >>> check("anyones.ssp").errors                                                 # doctest: +SKIP
    """
    from .master.options import as_path, options_of
    from .master.simulation.check import check as checked

    return checked(as_path("package", package), options_of(options))


def sweep(
    package: str | Path, vary: Mapping[str, Any], metrics: Sequence[str] | Mapping[str, str] = (),
    out: str | Path | None = None, *, fixed: Mapping[str, Any] | None = None, sample: str | None = None, seed: int = 0,
    progress: Callable[[int, int], None] = lambda *_: None, plots: bool = False, **options: Any,
) -> Sweep:  # fmt: skip
    """Run a package over a grid or a sample of its parameters, as `cosim-study sweep` does.

    vary: by name of a parameter a list of values, a text as --vary takes it ("8000:11000:500"), or with a sample a pair
    (low, high). metrics: texts such as "max(hydraulics.P1)", or such texts by label; without any, first, least and
    greatest value of what is connected. fixed: parameters that are the same in all runs. sample: "sobol:256", "lhs:40"
    or "saltelli:64", with a seed. progress: gets (cases done, cases failed). plots: draw a picture of each metric.

    Options: step, stop_time, case_time [s]; method; stimuli; processes; dask: address of a scheduler; retry_failed.
    Cases that the folder `out` has already (results/sweep_<name> without it) are not run again.

    Returns the sweep: `.frame()` has a row a case, `.plot(metric)` draws one, `.summary` is summary.json. A case that
    fails is a row with the reason. Raises `CosimError`. Scripts that call it need `if __name__ == "__main__":`, for it
    starts processes that import the script again.

    >>> found = sweep("deepsea_11km.ssp", {"depth": [9000, 11000]},                 # doctest: +SKIP
    ...               {"out": "reaches(arm.x_h, 0.2, 0.001, 2)"})
    """
    from .core.errors import UsageError
    from .master.options import as_path
    from .study.sweep.request import SweepRequest, make_plan
    from .study.sweep.result import run_sweep

    if not isinstance(vary, Mapping):
        raise UsageError("vary has to give values by the names of parameters, as {'depth': [9000, 11000]}")
    if isinstance(metrics, str) or not isinstance(metrics, Mapping | Sequence):
        raise UsageError("metrics has to be a list of texts such as 'max(hydraulics.P1)', or such texts by label")
    named = [f"{k}={v}" for k, v in metrics.items()] if isinstance(metrics, Mapping) else list(metrics)
    request = SweepRequest(
        as_path("package", package), tuple(f"{name}={_axis(name, values)}" for name, values in vary.items()),
        tuple(named),
        tuple(f"{name}={value}" for name, value in (fixed or {}).items()), sample, seed, **_known(options, _SWEEP),
    )  # fmt: skip
    folder = as_path("out", out) if out is not None else request.usual_folder
    return run_sweep(request, make_plan(request), folder, progress, plots)


_SWEEP = ("step", "stop_time", "method", "stimuli", "processes", "dask", "case_time", "retry_failed")
"""Options of `sweep`, by the names that `SweepRequest` has."""


def _axis(name: str, values: Any) -> str:
    """Values as --vary has them."""
    from .core.errors import UsageError
    from .study.sweep.axes import MOST

    if isinstance(values, str):
        return values
    if isinstance(values, tuple) and len(values) == 2:
        return f"{values[0]}:{values[1]}"
    if not hasattr(values, "__len__") or not hasattr(values, "__iter__"):
        raise UsageError(f"vary: '{name}' = {values!r} has to be a list of values, a pair (low, high) or a text")
    if len(values) > MOST:
        raise UsageError(f"vary: '{name}' has {len(values)} values; {MOST} cases are taken at most")
    return ",".join(str(v).lower() if isinstance(v, bool) else str(v) for v in values)


def _known(options: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    from .core.errors import UsageError, did_you_mean

    for name in options:
        if name not in names:
            raise UsageError(f"there is no option '{name}'{did_you_mean(name, names)}")
    return {name: Path(v) if name == "stimuli" and v is not None else v for name, v in options.items()}


def read_campaign(file: str | Path) -> Campaign:
    """What was measured, and with which package it is compared: the content of a campaign.toml and its run files.

    Raises `CosimError` with file, place and remedy. Needs the extra `formats` for files that are no text.

    >>> campaign = read_campaign("campaign/campaign.toml")                          # doctest: +SKIP
    >>> [run.name for run in campaign.runs]                                         # doctest: +SKIP
    """
    from .gap.campaign.read import read

    return read(Path(file))


def diagnose(
    campaign: Campaign | str | Path, out: str | Path | None = None, *, processes: int | None = None,
    dask: str | None = None, time_limit: float | None = None, resume: str | Path | None = None, report: bool = True,
    on_finding: Callable[[str], None] = lambda text: None,
) -> Diagnosed:  # fmt: skip
    """Say where the gap between measurement and model lies and which effects cause it, as `cosim-gap diagnose` does.

    campaign: its file campaign.toml, or what `read_campaign` gives of it. out: the folder for diagnosis.json, the
    calibrated parameters and, with `report`, report.html; without it `diagnosis` beside the campaign. time_limit: judge
    what has been found after so long [s]. resume: the folder of an earlier diagnosis of it. on_finding: gets a sentence
    on what is known so far, as it grows.

    Returns what was found: `.summary` is diagnosis.json, `.frame()` the parts of the gap, `.plot()` a figure of them,
    `.text` what the command prints. Raises `CosimError`. It starts processes, so a script needs
    `if __name__ == "__main__":`. Needs the extra `gap`.

    >>> found = diagnose("campaign/campaign.toml")                                  # doctest: +SKIP
    >>> found.frame()[["share", "probability"]]                                     # doctest: +SKIP
    """
    from .gap.diagnosed import diagnose_into

    return diagnose_into(
        campaign, None if out is None else Path(out), processes=processes, dask=dask, time_limit=time_limit,
        resume=None if resume is None else Path(resume), report=report, on_finding=on_finding,
    )  # fmt: skip


def build_fmus(
    out: str | Path, *, portable: bool = False, standalone: bool = False, fmi: int = 2,
    say: Callable[[str], None] = lambda text: None,
) -> list[Path]:  # fmt: skip
    """Build the machine's FMUs and pack every scenario into the folder `out`, as `cosim-fmus build` does.

    portable: they remember this interpreter, for importers that are not Python; standalone: they carry a Python; fmi: 2
    or 3. say: gets a line per file. Returns the files. Raises `CosimError`.

    >>> build_fmus("build")                                                         # doctest: +SKIP
    """
    from .fmus.build import Way, build

    return build(Path(out), say, Way(portable, standalone, fmi))
