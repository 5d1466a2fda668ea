"""What a new study can begin as: templates and copies, each with its session, and the questions that it begins with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from study_app.authoring.facts import facts
from study_app.authoring.fields import row_at, unit_of
from study_app.authoring.known_answers import KnownAnswer, known_answers
from study_app.authoring.new_study import Answers
from study_app.authoring.outline import outline, title_of
from study_app.authoring.study import Study
from study_app.authoring.templates import QUESTIONS
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.protocol.wording.languages import LANGUAGES
from study_app.viewmodels.designer.outline_rows import icon_of
from study_app.viewmodels.number_words import minutes

__all__ = [
    "Answers", "OwnQuestion", "Recovery", "TemplateChoice", "copy_choice", "languages_offered", "template_choice",
]  # fmt: skip

TEMPLATES: Final[Mapping[str, tuple[str, str]]] = {
    "compare-liquids": (
        "Compare liquids",
        "Do people tell liquids apart, and what do they call them? Statements after each one.",
    ),
    "viscosity-jnd": (
        "Viscosity JND",
        "How much thicker must a liquid be to feel thicker? Two intervals, adaptive levels.",
    ),
    "delay-detection": (
        "Delay detection",
        "From how many milliseconds on is a late picture noticed? Two intervals, adaptive levels.",
    ),
    "rate-realism": (
        "Rate realism",
        "How real does a liquid feel? A slider after each of four liquids, three times each.",
    ),
    "questionnaire-only": ("Questionnaire only", "Questions of every kind before, during and after a single trial."),
    "empty": ("Empty study", "One liquid, one block, a welcome and thanks: it runs as it is."),
}
"""Title and question of each template, in the order in which they are shown."""


@dataclass(frozen=True, slots=True)
class OwnQuestion:
    """A question of a template: its key, words, unit, what is permitted, and the value that the template has."""

    path: Path
    words: str
    unit: str
    bounds: str
    value: str
    several: bool = False


@dataclass(frozen=True, slots=True)
class Recovery:
    """The known answer of a template, for a bar from 0 to ``most``.

    Attributes
    ----------
    planted, low, high, most : float
        The planted threshold, the ends of the middle 90 % of what studies find, and the end of the axis, as shown.
    unit : str
        Their unit: "%", "ms".
    recovered : bool
        Whether the planted threshold is found.
    sentence : str
        All of it in words.
    """

    planted: float
    low: float
    high: float
    most: float
    unit: str
    recovered: bool
    sentence: str


@dataclass(frozen=True, slots=True)
class TemplateChoice:
    """What a new study can begin as.

    Attributes
    ----------
    source, title, description : str
        What it is opened by, what it is called, and what it is for.
    copy : bool
        Whether it is another study.
    note : str
        Of a copy: where the study is from.
    figures : tuple of (str, str)
        Icon and words of its length, people and trials.
    tags : tuple of (str, str)
        Icon and words of what it needs.
    session : tuple of (str, str, str)
        Icon, title and time of each step.
    recovery : Recovery or None
        Its known answer.
    name, study_title : str
        Short name and title that it has.
    questions : tuple of OwnQuestion
        What it asks beyond title, name and languages.
    """

    source: str
    title: str
    description: str
    copy: bool = False
    note: str = ""
    figures: tuple[tuple[str, str], ...] = ()
    tags: tuple[tuple[str, str], ...] = ()
    session: tuple[tuple[str, str, str], ...] = ()
    recovery: Recovery | None = None
    study_title: str = ""
    languages: tuple[str, ...] = ()
    questions: tuple[OwnQuestion, ...] = ()


def languages_offered() -> tuple[tuple[str, str], ...]:
    """Return code and name of each language that participants can be addressed in."""
    return tuple((code, language.name) for code, language in LANGUAGES.items())


def template_choice(name: str, study: Study) -> TemplateChoice:
    """Return what is shown of a template."""
    made = _choice(f"template:{name}", study)
    answer = known_answers().get(name)
    return TemplateChoice(
        made.source, *TEMPLATES.get(name, (name, made.description)), figures=made.figures, tags=made.tags,
        session=made.session, recovery=None if answer is None else _recovery(answer), study_title=made.study_title,
        languages=made.languages, questions=tuple(_questions(name, study)),
    )  # fmt: skip


def copy_choice(source: str, study: Study, note: str) -> TemplateChoice:
    """Return what is shown of a study that can be copied."""
    made = _choice(source, study)
    return TemplateChoice(
        source, made.study_title, made.description, copy=True, note=note, figures=made.figures, tags=made.tags,
        session=made.session, study_title=made.study_title, languages=made.languages,
    )  # fmt: skip


def _choice(source: str, study: Study) -> TemplateChoice:
    document, known, protocol = study.document, facts(study), study.protocol
    head = document.get("study", {})
    description = head.get("description", "") if isinstance(head, Mapping) else ""
    title = title_of({**document, "one": {"it": head}}, ("one", "it"))
    steps = (element for element in outline(study).session if element.depth == 0 and element.id in known.steps_s)
    session = tuple((icon_of(step.path), step.title, minutes(known.steps_s[step.id])) for step in steps)
    words = " ".join(str(description).split())
    if protocol is None:
        return TemplateChoice(source, title, words, study_title=title)
    return TemplateChoice(
        source, title, words, figures=tuple(_figures(protocol, known.expected_s or 0.0, known.trials or 0)),
        tags=_tags(protocol), session=session, study_title=title,
        languages=tuple(protocol.study.languages),
    )  # fmt: skip


def _figures(protocol: Protocol, expected_s: float, trials: int) -> Iterator[tuple[str, str]]:
    yield "clock", f"{max(1, round(expected_s / 60))} min"
    people = None if protocol.analysis is None else protocol.analysis.participants
    if people is not None:
        yield "people", str(people)
    yield "layers", f"{trials} trial{'s' * (trials != 1)}"


def _tags(protocol: Protocol) -> tuple[tuple[str, str], ...]:
    blind = "Double-blind" if protocol.study.blinding == "double" else "Single-blind"
    return (("device", f"Up to {protocol.device.force_limit_n:g} N"), ("lock", blind))


def _recovery(answer: KnownAnswer) -> Recovery:
    share = 100.0 if not answer.unit else 1.0
    unit = answer.unit or "%"
    planted, found, low, high = (share * one for one in (answer.planted, answer.found, answer.low, answer.high))
    sentence = (
        f"Planted: {planted:g} {unit} at 75 % correct (after {answer.source}). Found: {found:.3g} {unit}; in 9 of 10 "
        f"simulated studies of {answer.people} people {low:.3g} to {high:.3g} {unit}. A model, not measured."
    )
    most = 10.0 * (1 + int(1.5 * max(planted, high)) // 10)
    return Recovery(planted, low, high, most, unit, answer.recovered, sentence)


def _questions(name: str, study: Study) -> Iterator[OwnQuestion]:
    for words, path in QUESTIONS.get(name, ()):
        row = row_at(study.document, path)
        if row is not None:
            there = row.default if row.value is None else row.value
            several = isinstance(there, tuple)
            parts = there if isinstance(there, tuple) else (there,)
            value = ", ".join(f"{part:g}" for part in parts if isinstance(part, int | float))
            unit = row.unit or _unit_of(study, path)
            yield OwnQuestion(path, words, unit, ", ".join(row.bounds), value, several)


def _unit_of(study: Study, path: Path) -> str:
    """Return the unit of a stimulus's numbers, which is that of the key that it varies."""
    varied = study.document.get(path[0], {}).get(path[1], {}).get("vary") if path[0] == "stimuli" else None
    if isinstance(varied, str):
        return unit_of(varied)
    return "times" if path[-1] == "repetitions" else ""
