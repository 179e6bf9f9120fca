"""Makes a case with chosen effects, to look at one kind of machine; its conditions are drawn as those of any case.

    python -m benchmarks.blind.chosen --seed 777 --out DIR --package build/deepsea_0km.ssp \\
        --effect valve_dead_zone/unequal_lands=8 --effect sensor_delay@x_h=6

An effect is ID[/FORM][@COLUMN]=SIZE: in the plain form or another one, of which channel's sensor, and what it changes
alone, in noise, beyond a linear refit. The case is the first of the seed with two runs and the wanted columns.
"""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import effect_forms
from .case import Case, Wrong
from .draw import KINDS_OF_CASE, LATEST, plan
from .effects import known
from .generate import write
from .ruler import Ruler

TRIED = 200
"""Cases of the seed among which one with the wanted columns is looked for."""


def chosen(text: str, rng: np.random.Generator, edition: int = LATEST) -> tuple[Wrong, float]:
    """The effect that a text names, and its wanted size [noise]; raises `ValueError`."""
    match = re.fullmatch(r"(\w+)(?:/(\w+))?(?:@(\w+))?=([\d.]+)", text)
    if match is None:
        raise ValueError(f"'{text}' is no ID[/FORM][@COLUMN]=SIZE")
    id, name, column, size = match.groups()
    effect = next((e for e in known(edition) if e.id == id), None)
    form = next((f for f in effect_forms.FORMS if (f.effect, f.id) == (id, name)), None)
    if effect is None or (name is not None and form is None):
        raise ValueError(f"'{text}': no such effect, or it has no such form")
    shapes = effect.draw_shapes(rng) | (form.draw(rng) if form else {})
    return Wrong(effect, 1.0, shapes, 0.0, column, form=form), float(size)


def case_with(seed: int, wanted: list[str], edition: int = LATEST) -> Case:
    """The first case of the seed with two runs and all wanted columns, with the effects in it; raises `ValueError`."""
    columns = set(re.findall(r"@(\w+)", " ".join(wanted)))
    for index in range(TRIED):
        case, rng = plan(seed, index, edition)
        if len(case.runs) == 2 and columns <= {c.kind.key for c in case.channels}:
            break
    else:
        raise ValueError(f"no case of seed {seed} measures {', '.join(sorted(columns))}")
    ruler, wrong = Ruler(case), []
    for text in wanted:
        trial, size = chosen(text, rng, edition)
        scaled = ruler.scaled(trial, size)
        if scaled is None:
            raise ValueError(f"'{text}' cannot be seen in case {index}")
        wrong.append(replace(scaled, size=scaled.size_linear))
    kind = {1: "single", 2: "pair", 3: "triple"}[len(wrong)]
    return replace(case, kind=kind, wrong=tuple(wrong), size_all=max(w.size for w in wrong))


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.chosen", description="Makes a case with chosen effects.")
    p.add_argument("--seed", type=int, required=True)
    p.add_argument("--effect", action="append", required=True, metavar="ID[/FORM][@COLUMN]=SIZE", help="one to three")
    p.add_argument("--out", type=Path, required=True, help="folder for the case and its answer")
    p.add_argument("--package", type=Path, required=True, help="the package that the diagnosis compares with")
    p.add_argument("--edition", type=int, default=LATEST, choices=list(KINDS_OF_CASE), help="of the benchmark")
    p.add_argument("--budget", action="store_true", help="with the true budget, which takes minutes")
    options = p.parse_args()
    try:
        case = case_with(options.seed, options.effect, options.edition)
    except ValueError as error:
        p.error(str(error))
    options.out.mkdir(parents=True, exist_ok=True)
    write(case, options.out, options.package.resolve(), options.budget)
    print(f"{options.out / f'case_{case.index:04d}'}: {' + '.join(w.effect.id for w in case.wrong)}")


if __name__ == "__main__":
    main()
