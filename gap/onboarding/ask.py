"""Asks on the terminal for what could not be guessed; an empty answer leaves a question in the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ...core.plain_numbers import plain_number
from ...core.units import UNITS, unit
from .columns import Match
from .draft import Draft, RunDraft, Unmatched
from .model import Connector, Model

Ask = Callable[[str], str]
"""Shows a question and gives the answer."""


def ask_all(draft: Draft, model: Model, ask: Ask) -> Draft:
    """The draft with the answers; end of input leaves the rest as it is."""
    try:
        draft = _columns(draft, model, ask)
        draft = _doubts(draft, model, ask)
        draft = _runs(draft, ask)
        return _base(draft, ask)
    except EOFError:
        return draft


def _columns(draft: Draft, model: Model, ask: Ask) -> Draft:
    """Columns that are no channel yet."""
    for u in draft.unmatched:
        taken = {m.connector.address for m in draft.matches}
        known = {c.address: c for c in (*model.outputs, *model.inputs) if c.address not in taken}
        proposed = f" ({', '.join(u.candidates)})" if u.candidates else ""
        answer = _valid(
            ask, f"Column '{u.column}', {u.least:.4g} to {u.greatest:.4g}: which connector{proposed}? Enter: none: ",
            known.__contains__, f"there are {', '.join(list(known)[:12])}",
        )  # fmt: skip
        if not answer:
            continue
        match = Match(u.column, known[answer], _asked_unit(ask, u, known[answer]), "as you said")
        rest = tuple(x for x in draft.unmatched if x is not u)
        draft = replace(draft, matches=(*draft.matches, match), unmatched=rest)
    return draft


def _asked_unit(ask: Ask, u: Unmatched, connector: Connector) -> str:
    usual = u.unit or connector.declared or connector.hint or "1"
    return _valid(ask, f"  its unit? Enter: {usual}: ", _is_unit, "there are mm, bar, N, V, 1, ...") or usual


def _is_unit(text: str) -> bool:
    return text in UNITS


def _is_unit_of(connector: Connector, text: str) -> bool:
    return _is_unit(text) and (connector.quantity is None or unit(text).same_dimension(connector.quantity))


_OF_UNITS, _OF_SIGNS = ("is it in ", "in which unit"), "moves against"
"""How doubts begin, or what they say."""


def _doubts(draft: Draft, model: Model, ask: Ask) -> Draft:
    """Channels whose unit or sign is a guess."""
    matches = []
    for m in draft.matches:
        if any(doubt.startswith(_OF_UNITS) for doubt in m.doubts):
            said = _valid(
                ask, f"Column '{m.column}' ({m.connector.address}): in which unit? Enter: {m.unit}: ",
                partial(_is_unit_of, m.connector),
                "it has to be a unit of that quantity",
            )  # fmt: skip
            m = replace(m, unit=said or m.unit, doubts=tuple(d for d in m.doubts if not d.startswith(_OF_UNITS)))
        if any(_OF_SIGNS in doubt for doubt in m.doubts):
            turned = ask(f"Column '{m.column}' moves against the model. Turn its sign? y/N: ").strip().lower()
            rest = tuple(d for d in m.doubts if _OF_SIGNS not in d)
            m = replace(m, scale=-1.0 if turned in ("y", "yes") else 1.0, doubts=rest)
        matches.append(m)
    return replace(draft, matches=tuple(matches))


def _runs(draft: Draft, ask: Ask) -> Draft:
    """Which runs are kept to test the others."""
    if len(draft.runs) < 2 or any(r.use for r in draft.runs):
        return draft
    names = [r.source.name for r in draft.runs]
    answer = _valid(
        ask, f"Runs {', '.join(names[:12])}: which are kept to test the others? Names with commas, Enter: none: ",
        lambda text: all(n.strip() in names for n in text.split(",")) and len(text.split(",")) < len(names),
        "names of runs, not all of them",
    )  # fmt: skip
    held = {n.strip() for n in answer.split(",")} if answer else set()

    def used(run: RunDraft) -> RunDraft:
        return replace(run, use="holdout") if run.source.name in held else run

    return replace(draft, runs=tuple(used(r) for r in draft.runs))


def _base(draft: Draft, ask: Ask) -> Draft:
    """How well parameters are known."""
    if draft.base_said:
        return draft
    said: dict[str, float] = {}
    for p in draft.base:
        unit_name = f" {p.unit}" if p.unit else ""
        answer = _valid(
            ask, f"{p.address} = {p.value:g}{unit_name}: known within what share (0.05)? Enter: exactly: ",
            _is_share, "a number between 0 and 1",
        )  # fmt: skip
        if answer:
            said[p.address] = float(answer)
    return replace(draft, base_said=said)


def _is_share(text: str) -> bool:
    try:
        return 0.0 < plain_number(text) < 1.0
    except ValueError:
        return False


def _valid(ask: Ask, question: str, is_valid: Callable[[str], bool], remedy: str) -> str:
    """The answer, asked again until it is valid; "" where none is given."""
    while True:
        answer = ask(question).strip()
        if not answer or is_valid(answer):
            return answer
        print(f"  '{answer}': {remedy}")
