"""The command `cosim-gap diagnose`: progress while it works, then verdict, ranking and reduction."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from typing import Any

from ..core.cli import need
from ..core.files import make_folder


def diagnose_command(options: argparse.Namespace) -> int:
    """Run the diagnosis and print it; returns the exit code."""
    need("gap", "scipy", "sklearn", "arch", "ruptures", *(() if options.no_report else ("jinja2", "PIL")))
    from ..master.pool import cluster
    from .campaign.read import read
    from .diagnose import diagnose
    from .problem.stop import StopToken
    from .result.diagnosis import write

    campaign = read(options.campaign)
    make_folder(options.out)
    show = _Progress(options.quiet)
    with _Patience(options.time_limit) as patience, cluster(options.dask) as executor:
        d = diagnose(campaign, executor, show.stage, show.run, options.processes, StopToken(patience.ended))
    show.clear()
    data = write(d, options.out)
    if not options.no_report:
        from .report import write_report

        write_report(d, data, options.out)
    if not options.quiet:
        print("\n".join(lines(data)))
        names = ["diagnosis.json", "calibrated.ssv"] + ([] if options.no_report else ["report.html"])
        print(f"\n{options.out}: {', '.join(names)}")
    return 130 if patience.interrupted else 0


class _Patience:
    """How long to look for causes: until a time limit [s] or the first Ctrl-C; the second one ends everything."""

    def __init__(self, limit: float | None):
        self.until = float("inf") if limit is None else time.monotonic() + limit
        self.interrupted = False

    def ended(self) -> bool:
        """Whether what has been found is to be judged now."""
        return self.interrupted or time.monotonic() > self.until

    def __enter__(self) -> _Patience:
        self._before = signal.signal(signal.SIGINT, self._first)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _first(self, *_: object) -> None:
        self.interrupted = True
        signal.signal(signal.SIGINT, signal.default_int_handler)
        print("\ncosim-gap: judging what has been found (Ctrl-C again: end without a result)", file=sys.stderr)


class _Progress:
    """One line on stderr with stage, runs and seconds, where that is a terminal."""

    def __init__(self, quiet: bool):
        self.on = not quiet and sys.stderr.isatty()
        self.plain = not quiet and not self.on
        self.text, self.runs = "", 0
        self.begin = self.last = time.monotonic()

    def stage(self, text: str) -> None:
        self.text = text
        if self.plain:
            print(f"[{time.monotonic() - self.begin:5.1f} s] {text}", file=sys.stderr)
        self._draw(True)

    def run(self, runs: int) -> None:
        self.runs = runs
        self._draw(False)

    def _draw(self, now: bool) -> None:
        if self.on and (now or time.monotonic() - self.last > 0.2):
            self.last = time.monotonic()
            line = f"[{self.last - self.begin:5.1f} s, {self.runs} runs] {self.text}"
            print(f"\r{line:<78}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        if self.on:
            print(f"\r{'':<78}\r", end="", file=sys.stderr, flush=True)


def lines(data: dict[str, Any]) -> list[str]:
    """The diagnosis as text."""
    gap = data["gap"]
    low, high = gap["reduction_ci95"]
    made = [data["sentence"], ""]
    made.append(f"{'cause':<46}{'probability':>12}{'gap after':>11}{'reduction':>11}  parameters")
    for c in data["causes"][:8]:
        if c["probability"] < 5e-4 and len(made) > 5:
            break
        gap_after = f"{c['gap_after']:.2f}" if "gap_after" in c else ""
        reduction = f"{c['reduction']:.0%}" if "reduction" in c else ""
        values = "; ".join(
            f"{name.rsplit('.', 1)[-1]} {p['value']:.4g} [{p['ci95'][0]:.4g}, {p['ci95'][1]:.4g}]"
            + (f" {p['unit']}" if p["unit"] != "1" else "")
            + (" (at bound)" if p["at_bound"] else "")
            for name, p in c.get("parameters", {}).items()
        )
        made.append(f"{' + '.join(c['effects']):<46}{c['probability']:>12.1%}{gap_after:>11}{reduction:>11}  {values}")
    made += [
        "",
        f"gap (held out: {gap['held_out']}), in noise floors: {gap['before']:.2f} as delivered, "
        f"{gap['after_calibration']:.2f} refitted, {gap['after']:.2f} with the cause",
        f"reduction {gap['reduction']:.1%}, 95 % interval {low:.1%} to {high:.1%}; "
        f"{gap['explainable_reduction']:.1%} of what is above the floor",
    ]
    others = {n: r["after_from_other_runs"] for n, r in gap["per_run"].items() if "after_from_other_runs" in r}
    if others:
        made.append("each run foretold by the others: " + ", ".join(f"{n} {v:.2f}" for n, v in others.items()))
    for name, c in gap["per_channel"].items():
        made.append(f"  {name:<28}{c['rms_before']:>12.4g} -> {c['rms_after']:<12.4g}{c['unit']}")
    if data.get("events"):
        made += ["", f"{'moments [s]':<60}{'measured':>18}{'delivered':>11}{'refitted':>11}{'with cause':>11}"]
        for e in data["events"]:
            measured = f"{e['limit']} {e['measured']:.3f}".strip()
            made.append(
                f"  {e['run'] + ', ' + e['event']:<58}{measured:>18}{e['delivered']:>11.3f}{e['refitted']:>11.3f}"
                f"{e['with_cause']:>11.3f}"
            )
        if data["contrasts"]:
            made += ["", "how much longer than in the run that differs in one condition only [s]"]
        for e in data["contrasts"]:
            made.append(
                f"  {' than '.join(e['runs']) + ', ' + e['event']:<58}{e['measured']:>18.3f}{e['delivered']:>11.3f}"
                f"{e['refitted']:>11.3f}{e['with_cause']:>11.3f}"
            )
    made += ["", "where the refitted model still misses"]
    for w in data["where"][:4]:
        made.append(f"  {w['share']:>6.1%}  {w['channel']:<26}{w['region']}")
    for r in data["replay"]:
        parts = ", ".join(f"{name.rsplit('.', 1)[-1]} {value:.1f}" for name, value in r["rms"].items())
        made.append(f"  {r['component']} alone, driven by what was measured, misses by (floors): {parts}")
    if data["next_experiment"]:
        n = data["next_experiment"]
        change = ", ".join(f"{k} = {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in n["change"].items())
        sets = " from ".join(" + ".join(e) or "no effect" for e in n["separates"])
        made += ["", f"measure next: {change}; it tells {sets} ({n['expected_separation']:.1f} floors apart)"]
    if data.get("next_channel") and data["next_channel"] != data["next_experiment"]:
        n = data["next_channel"]
        made.append(f"channel to add: {n['change']['channel']} ({n['expected_separation']:.1f} floors apart)")
    if data["warnings"]:
        made += ["", *(f"note: {w}" for w in data["warnings"])]
    t = data["timing"]
    made += ["", f"{t['simulations']} runs in {t['wall_s']:.1f} s"]
    return made
