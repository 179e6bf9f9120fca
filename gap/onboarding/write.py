"""The draft of a campaign as campaign.toml, with a comment for each guess and a question for what was not guessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..settings import ONBOARDING
from .draft import Draft, RunDraft, Unmatched
from .toml_text import quoted, value, with_comment

HEAD = """#:schema ./campaign.schema.json
# Written by cosim-gap new. Why it has guessed so stands behind the lines; '# ?' begins a question.
# Format: docs/gap.md. `cosim-gap check` draws it against the model and tells what looks wrong.
"""


def campaign_text(draft: Draft, system: str, effects: str | None, files: Sequence[str]) -> str:
    """The text of campaign.toml; system, effects, files: as it is to name the package, catalogue and runs."""
    lines = [*HEAD.splitlines(), "", f"name = {quoted(draft.name)}", f"system = {quoted(system)}"]
    if effects is not None:
        lines.append(f"effects = {quoted(effects)}")
    common = _common(draft.runs)
    lines += [f"{key} = {value(x)}" for key, x in common.items()]
    for m in draft.matches:
        lines += ["", "[[channel]]", f"column = {quoted(m.column)}"]
        lines.append(with_comment(f"connector = {quoted(m.connector.address)}", m.why))
        lines.append(f"unit = {quoted(m.unit)}")
        if m.connector.is_input:
            lines.append('role = "input"')
        lines += [f"# ? {doubt}" for doubt in m.doubts]
        if m.scale != 1.0:
            lines.append(f"scale = {m.scale!r}")
        if m.column in draft.noise:
            estimated = f"# noise_std = {draft.noise[m.column]:.3g}"
            lines.append(with_comment(estimated, "as estimated from its readings; a data sheet knows better"))
    lines += [line for u in draft.unmatched for line in _question(u)]
    for run, file in zip(draft.runs, files, strict=True):
        lines += _run(run, file, common)
    if all(r.use is None for r in draft.runs) and len(draft.runs) >= ONBOARDING.holdout_from:
        lines += ["", '# ? Which runs are kept to test the others? use = "holdout" in them']
    lines += _base(draft)
    return "\n".join(lines) + "\n"


def _question(u: Unmatched) -> list[str]:
    connector = u.candidates[0] if u.candidates else "component.name"
    return [
        "",
        f"# ? Column {quoted(u.column)} ({u.least:.4g} to {u.greatest:.4g}): which connector is it, if any?",
        "# [[channel]]",
        f"# column = {quoted(u.column)}",
        f"# connector = {quoted(connector)}" + (f"    # or {', '.join(u.candidates[1:])}" if u.candidates[1:] else ""),
        f"# unit = {quoted(u.unit or '1')}",
    ]


def _clock_keys(run: RunDraft) -> dict[str, object]:
    """What the file does not say itself, or what is not as usual."""
    keys: dict[str, object] = {}
    if not run.clock.stated and run.clock.unit != "s":
        keys["time_unit"] = run.clock.unit
    if run.clock.start is not None:
        keys["start"] = run.clock.start if run.clock.doubt else "first"
    return keys


def _common(runs: Sequence[RunDraft]) -> dict[str, object]:
    """The keys that all runs have alike."""
    keys = [_clock_keys(run) for run in runs]
    return {k: x for k, x in keys[0].items() if len(runs) > 1 and all(k in other and other[k] == x for other in keys)}


def _run(run: RunDraft, file: str, common: Mapping[str, object]) -> list[str]:
    lines = ["", "[[run]]", f"file = {quoted(file)}"]
    lines += [f"{key} = {value(x)}" for key, x in _clock_keys(run).items() if key not in common]
    if run.conditions:
        values = {c.parameter: c.value for c in run.conditions}
        lines.append(with_comment(f"parameters = {value(values)}", "; ".join(c.said for c in run.conditions)))
    lines += [f"# ? {doubt}" for doubt in run.doubts]
    if any("which parameter" in doubt for doubt in run.doubts) and not run.conditions:
        lines.append('# parameters = { "component.parameter" = 0.0 }')
    if run.use is not None:
        lines.append(f"use = {quoted(run.use)}")
    return lines


def _base(draft: Draft) -> list[str]:
    lines: list[str] = []
    for parameter, tolerance in draft.base_said.items():
        lines += ["", "[[base]]", f"parameter = {quoted(parameter)}", f"tolerance = {tolerance!r}"]
    rest = [p for p in draft.base if p.address not in draft.base_said]
    if rest and not draft.base_said:
        lines += ["", "# ? Which parameters are not exactly known? They are refitted within a share of their value:"]
    for p in rest:
        unit = f" {p.unit}" if p.unit else ""
        lines += ["# [[base]]", with_comment(f"# parameter = {quoted(p.address)}", f"{p.value:g}{unit}"),
                  f"# tolerance = {ONBOARDING.usual_tolerance:g}"]  # fmt: skip
    return lines
