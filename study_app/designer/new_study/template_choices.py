"""What a new study can begin as: templates and copies, their sessions and questions, and known answers."""

import json
import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final

import numpy as np

from study_app.designer.document.elements import study_title, title_of
from study_app.designer.document.fields import row_at, unit_of
from study_app.designer.document.names import Document
from study_app.designer.document.study import Study
from study_app.designer.new_study.known_answers import KnownAnswer, known_answers
from study_app.designer.new_study.new_study import Answers
from study_app.designer.new_study.templates import FOLDER, QUESTIONS
from study_app.designer.outline.outline_rows import icon_of
from study_app.ids import MAX_SHORT_NAME, free_short_name, short_name_of
from study_app.number_text import counted, duration
from study_app.number_text import counted
from study_app.protocol.checks.expected_precision import threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s, step_duration_s
from study_app.protocol.source.document import Path, entries, names
from study_app.protocol.wording.languages import LANGUAGES
from study_app.psychophysics.precision import BETWEEN_PEOPLE
from study_app.viewmodels.number_words import duration

FILE: Final = FOLDER / "known_answers.json"
STUDIES: Final = 100
SEED: Final = 1
MIDDLE: Final = (0.05, 0.95)


@dataclass(frozen=True, slots=True)
class KnownAnswer:
    """A planted threshold, and what simulated studies find of it.

    ``planted``: mean threshold of the simulated people, in the unit of the levels; ``unit``: that unit; "" of a Weber
    fraction; ``source``: where the planted threshold is from; ``people``: how many take part in each study; ``found``,
    ``low``, ``high``: mean of the studies' thresholds, and the ends of the middle 90 % of them.
    """

    planted: float
    unit: str
    source: str
    people: int
    found: float
    low: float
    high: float

    @property
    def recovered(self) -> bool:
        """Whether the mean is within 10 % of the planted threshold, which is among the middle 90 %."""
        return abs(self.found / self.planted - 1) <= 0.1 and self.low <= self.planted <= self.high


@cache
def known_answers() -> dict[str, KnownAnswer]:
    """Return the known answers of the templates that have one, as they were computed when the templates were made."""
    found: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: KnownAnswer(**values) for name, values in found.items()}


def simulated(protocol: Protocol, planted: float, unit: str, source: str) -> KnownAnswer:
    """Simulate studies of a protocol's first block with levels, and return what they find.

    ``protocol``: the study; its plan says how many people take part; ``planted``: mean threshold of the people; each
    person's own differs from it by a factor of `BETWEEN_PEOPLE`; ``unit``, ``source``: unit of the levels, and where
    the planted threshold is from. Raises ValueError if the study has no thresholds, or does not say how many people
    take part.
    """
    plan = next((one for block in protocol.main_blocks if (one := threshold_plan(protocol, block)) is not None), None)
    people = protocol.analysis.participants if protocol.analysis is not None else None
    if plan is None or people is None or plan.stimulus.spacing != "log":
        raise ValueError("the study has no thresholds on logarithmic levels, or does not say how many take part")
    rng = np.random.default_rng(SEED)
    apart = math.log10(BETWEEN_PEOPLE) * rng.standard_normal((STUDIES, people))
    estimates = plan.simulate((plan.stimulus.coordinate(planted) + apart).ravel(), rng)
    means = 10.0 ** estimates.medians.reshape(STUDIES, people).mean(axis=1)
    low, high = np.quantile(means, MIDDLE)
    figures = (round(float(one), 4) for one in (means.mean(), low, high))
    return KnownAnswer(planted, unit, source, people, *figures)


__all__ = [
    "Answers", "OwnQuestion", "Recovery", "TemplateChoice", "copy_choice", "languages_offered", "template_choice",
]  # fmt: skip

COPY: Final = "copy"
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


SHIPPED: Final = "shipped study"
PLANNED: Final = " planned"
"""Follows a number of participants; a picture of people says the same."""
STEPS: Final = ("pages", "blocks", "questionnaires")
"""Sections whose tables are steps of a session."""


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

    ``planted``, ``low``, ``high``, ``most``: the planted threshold, the ends of the middle 90 % of what
    studies find, and the end of the axis, as shown; ``unit``: their unit: "%", "ms"; ``recovered``: whether the planted
    threshold is found; ``sentence``: all of it in words.
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

    ``source``, ``title``, ``description``: what it is opened by, what it is called, and what it is for; ``copy``:
    whether it is another study; ``note``: of a copy: where the study is from; ``figures``: icon and words of its
    length, people and trials; ``tags``: icon and words of what it needs; ``session``: icon, title and time of each
    step; ``recovery``: its known answer; ``name``, ``study_title``: short name that a copy gets where none is given,
    and title that it has; ``questions``: what it asks beyond title, name and languages.
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
    name: str = ""
    study_title: str = ""
    languages: tuple[str, ...] = ()
    questions: tuple[OwnQuestion, ...] = ()


def languages_offered() -> tuple[tuple[str, str], ...]:
    """Return code and name of each language that participants can be addressed in."""
    return tuple((code, language.english_name) for code, language in LANGUAGES.items())


def copy_name(name: str, taken: Collection[str]) -> str:
    """Return a short name for a copy of a study that is free: "kitchencopy", "kitchencopy2"."""
    stem = re.sub(f"{COPY}[0-9]*$", "", short_name_of(name)) or "study"
    return free_short_name(taken, f"{stem[: MAX_SHORT_NAME - len(COPY)]}{COPY}")


def template_choice(name: str, study: Study) -> TemplateChoice:
    """Return what is shown of a template."""
    title, words = _described(study.document)
    shown, question = TEMPLATES.get(name, (name, words))
    answer, protocol = known_answers().get(name), study.protocol
    found = TemplateChoice(
        f"template:{name}", shown, question, recovery=None if answer is None else _recovery(answer),
        study_title=title, languages=_languages(study.document), questions=tuple(_questions(name, study)),
    )  # fmt: skip
    if protocol is None:
        return found
    language, document = protocol.study.languages[0], study.document
    session = (
        (
            icon_of((section, step), document),
            title_of(document, (section, step)),
            duration(step_duration_s(protocol, step, language)),
        )
        for step in protocol.steps
        for section in STEPS
        if step in names(document, section)
    )
    return replace(found, figures=tuple(_figures(protocol)), tags=_tags(protocol), session=tuple(session))


def copy_choice(source: str, document: Document, note: str, name: str) -> TemplateChoice:
    """Return what is shown of a study that can be copied."""
    title, words = _described(document)
    return TemplateChoice(
        source, title or source, words, copy=True, note=note, name=name, study_title=title,
        languages=_languages(document),
    )  # fmt: skip


def _described(document: Document) -> tuple[str, str]:
    """Return title and description of a study."""
    head = document.get("study", {})
    description = head.get("description", "") if isinstance(head, Mapping) else ""
    return study_title(document), " ".join(str(description).split())


def _languages(document: Document) -> tuple[str, ...]:
    return tuple(str(code) for _, code in entries(document, "study.languages.*")) or ("en",)


def _figures(protocol: Protocol) -> Iterator[tuple[str, str]]:
    trials = sum(block.trials for block in orders_of(protocol).blocks)
    yield "clock", duration(expected_duration_s(protocol))
    people = None if protocol.analysis is None else protocol.analysis.participants
    if people is not None:
        yield "people", f"{people}{PLANNED}"
    yield "layers", counted(trials, "trial")


def _tags(protocol: Protocol) -> tuple[tuple[str, str], ...]:
    blind = "Double-blind" if protocol.study.blinding == "double" else "Single-blind"
    return (("device", f"Up to {protocol.device.force_limit_n:g} N"), ("lock", blind))


def _recovery(answer: KnownAnswer) -> Recovery:
    share = 100.0 if not answer.unit else 1.0
    unit = answer.unit or "%"
    planted, found, low, high = (share * one for one in (answer.planted, answer.found, answer.low, answer.high))
    sentence = (
        f"Simulated: {planted:g} {unit} at 75 % correct (after {answer.source}). Estimated: {found:.3g} {unit}; in 9 "
        f"of 10 simulated studies of {answer.people} people {low:.3g} to {high:.3g} {unit}. A model, not measured."
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
