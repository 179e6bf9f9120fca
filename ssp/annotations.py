"""Annotations: ours, what of other tools' is used, and the names of all that is not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from lxml import etree

from ..core.errors import PackageError
from .document import SSC, SSD, Document, local
from .model import (
    AnswersAsked,
    AnswerSentence,
    AnswerValue,
    ReplayAsked,
    ReplayColour,
    ReplayLabel,
    ReplayScale,
)

STEP_ANNOTATION = "org.deepsea-cosim.master"
"""Annotation of DefaultExperiment: <Master stepSize="..." method="..."/> suggests the macro step [s] and the coupling,
<Bond a="..." b="..."/> in it names two outputs whose product is a power."""

ANSWERS_ANNOTATION = "org.deepsea-cosim.answers"
"""Annotation of DefaultExperiment: <Answers> with <Value name="..." is="formula" unit="..."/> and
<Say if="formula">text with {names}</Say> is what the package wants said after a run (master/simulation/answers.py),
<Show>names of signals</Show> what plots show at first."""

REPLAY_ANNOTATION = "org.deepsea-cosim.replay"
"""Annotation of DefaultExperiment: <Replay> with <Scale name="..." text="..." unit="..." from="formula" to="formula"/>,
<Colour component="..." geom="..." scale="..." is="formula"/> and <Label component="..." at="..." is="formula"
unit="..."/>, which holds a text, are what a replay of a run shows beside the motion (master/replay)."""

OURS = (STEP_ANNOTATION, ANSWERS_ANNOTATION, REPLAY_ANNOTATION)

OTHER_STEPS = {"FixedStepMaster": "stepSize", "FixedStepAlgorithm": "baseStepSize"}
"""Elements in annotations of OMSimulator, Vico and the Open Simulation Platform, and where they tell the step."""

STEP_HINT, HINT = "StepSizeHint", "value"
"""The element in a component's annotation by which OSP and Vico tell that component's own step, and where."""


def answers_asked(document: Document, annotation: etree._Element) -> AnswersAsked:
    """What an annotation of the type `ANSWERS_ANNOTATION` holds."""
    values, sentences, signals = [], [], list[str]()
    for element in annotation.iterfind("{*}Answers/*"):
        where = document.where(element)
        if local(element) == "Value":
            name, formula = document.name(element), document.name(element, "is")
            values.append(AnswerValue(name, formula, element.get("unit", ""), where))
        elif local(element) == "Say":
            text = " ".join("".join(map(str, element.itertext())).split())
            sentences.append(AnswerSentence(text, element.get("if", ""), where))
        elif local(element) == "Show":
            signals += "".join(map(str, element.itertext())).split()
        else:
            known = "<Value>, <Say> or <Show>"
            raise document.error(element, f"<{local(element)}> is no part of <Answers>: expected {known}")
    return AnswersAsked(tuple(values), tuple(sentences), tuple(signals))


def replay_asked(document: Document, annotation: etree._Element) -> ReplayAsked:
    """What an annotation of the type `REPLAY_ANNOTATION` holds."""
    scales, colours, labels = [], [], []
    for element in annotation.iterfind("{*}Replay/*"):
        where = document.where(element)

        def needed(name: str, element: etree._Element = element) -> str:
            return document.name(element, name)

        if local(element) == "Scale":
            least, greatest, unit = (element.get(name, "") for name in ("from", "to", "unit"))
            scales.append(ReplayScale(needed("name"), element.get("text", ""), unit, least, greatest, where))
        elif local(element) == "Colour":
            colours.append(ReplayColour(needed("component"), needed("geom"), needed("scale"), needed("is"), where))
        elif local(element) == "Label":
            text = " ".join("".join(map(str, element.itertext())).split())
            formula, unit = element.get("is", ""), element.get("unit", "")
            labels.append(ReplayLabel(needed("component"), needed("at"), text, formula, unit, where))
        else:
            known = "<Scale>, <Colour> or <Label>"
            raise document.error(element, f"<{local(element)}> is no part of <Replay>: expected {known}")
    names = {scale.name for scale in scales}
    for colour in colours:
        if colour.scale not in names:
            raise PackageError(f"{colour.where}: there is no <Scale> called '{colour.scale}'")
    return ReplayAsked(tuple(scales), tuple(colours), tuple(labels))


def step_of_others(document: Document, owners: Iterable[etree._Element]) -> float | None:
    """The macro step [s] that the annotations of other masters suggest."""
    for owner in owners:
        for element in _inside(owner):
            attribute = OTHER_STEPS.get(local(element))
            if attribute is not None and element.get(attribute) is not None:
                return document.number(element, attribute)
    return None


def step_hint(document: Document, component: etree._Element) -> float | None:
    """The step [s] of its own that an annotation of a component asks for; None where none does, or it is no step."""
    for element in _inside(component):
        if local(element) == STEP_HINT and (hint := document.number(element, HINT)) is not None and hint > 0.0:
            return hint
    return None


def _inside(owner: etree._Element) -> Iterator[etree._Element]:
    return (e for sections in owner.findall(f"{SSD}Annotations") for e in sections.iter())


@dataclass
class Unused:
    """The annotations of a package that mean nothing here, by type and names of their elements, and where they are."""

    places: dict[str, dict[str, None]] = field(default_factory=dict)

    def add(self, document: Document, root: etree._Element) -> None:
        """Look through a file's elements."""
        for annotation in root.iter(f"{SSC}Annotation"):
            unread = [local(e) for e in annotation if not any(_used(part) for part in e.iter())]
            if annotation.get("type") not in OURS and (unread or not len(annotation)):
                names = f" ({', '.join(dict.fromkeys(unread))})" if unread else ""
                self.places.setdefault(f"{annotation.get('type', '')}{names}", {})[document.where(annotation)] = None

    def lines(self) -> tuple[str, ...]:
        """A line for each kind, with the first place."""
        more = {kind: f" and {len(places) - 1} more" if len(places) > 1 else "" for kind, places in self.places.items()}
        return tuple(f"{kind}: {next(iter(places))}{more[kind]}" for kind, places in self.places.items())


def _used(element: etree._Element) -> bool:
    return local(element) in OTHER_STEPS or local(element) == STEP_HINT
