"""What can be opened, and what a new study can begin as: templates and studies, and how they are described."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

from study_app.designer.document.document import Document
from study_app.designer.document.elements import study_title, title_of
from study_app.designer.document.fields import row_at, unit_of
from study_app.designer.document.names import languages_of
from study_app.designer.document.study import Study, read
from study_app.designer.new_study.new_study import taken_names, template
from study_app.designer.new_study.templates import FOLDER, QUESTIONS, templates
from study_app.designer.outline.outline_rows import icon_of
from study_app.designer.place.header import HeaderState, StudyChoice, problems_chip
from study_app.designer.versions.version_rows import VersionChip
from study_app.errors import StudyError
from study_app.gui.home.study_facts import holds_liquids_alone, is_shipped, sources
from study_app.ids import MAX_SHORT_NAME, free_short_name, short_name_of
from study_app.number_text import counted, duration
from study_app.protocol.load import read_document
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s, step_duration_s
from study_app.protocol.source.document import Path as Place
from study_app.protocol.source.document import names
from study_app.protocol.source.files import find, shipped, shipped_file
from study_app.protocol.wording.languages import LANGUAGES
from study_app.store.drafts import draft_of, drafted_files, unsaved_files
from study_app.store.study_settings import kept_original
from study_app.workspace import workspace

FILE: Final = FOLDER / "known_answers.json"


@dataclass(frozen=True, slots=True)
class KnownAnswer:
    """A planted threshold (mean of ``people``), and what simulated studies find of it, in ``unit``.

    ``found`` is the mean of the studies' thresholds, ``low`` and ``high`` the ends of the middle 90 % of them.
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

    @property
    def most(self) -> float:
        return 10.0 * (1 + int(1.5 * max(self.planted, self.high)) // 10)

    @property
    def sentence(self) -> str:
        return (
            f"Simulated: {self.planted:g} {self.unit} at 75 % correct (after {self.source}). Estimated: "
            f"{self.found:.3g} {self.unit}; in 9 of 10 simulated studies of {self.people} people {self.low:.3g} to "
            f"{self.high:.3g} {self.unit}. A model, not measured."
        )


@cache
def known_answers() -> dict[str, KnownAnswer]:
    """Return the known answers of the templates that have one, as they were computed when the templates were made."""
    found: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: KnownAnswer(**values) for name, values in found.items()}


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

    path: Place
    words: str
    unit: str
    bounds: str
    value: str
    several: bool = False


@dataclass(frozen=True, slots=True)
class TemplateChoice:
    """What a new study can begin as."""

    source: str  # what it is opened by
    title: str
    description: str
    copy: bool = False  # whether it is another study
    note: str = ""  # of a copy: where the study is from
    figures: tuple[tuple[str, str], ...] = ()  # icon and words of its length, people and trials
    tags: tuple[tuple[str, str], ...] = ()  # icon and words of what it needs
    session: tuple[tuple[str, str, str], ...] = ()  # icon, title and time of each step
    recovery: KnownAnswer | None = None
    name: str = ""  # short name that a copy gets where none is given
    study_title: str = ""  # title that it gets where none is given
    languages: tuple[str, ...] = ()
    questions: tuple[OwnQuestion, ...] = ()  # beyond title, name and languages


def languages_offered() -> tuple[tuple[str, str], ...]:
    """Return code and name of each language that participants can be addressed in."""
    return tuple((code, language.english_name) for code, language in LANGUAGES.items())


def template_choice(name: str, study: Study) -> TemplateChoice:
    """Return what is shown of a template."""
    title, words = _described(study.document)
    shown, question = TEMPLATES.get(name, (name, words))
    protocol = study.protocol
    found = TemplateChoice(
        f"template:{name}", shown, question, recovery=known_answers().get(name),
        study_title=title, languages=languages_of(study.document), questions=tuple(_questions(name, study)),
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
    blind = "Double-blind" if protocol.study.blinding == "double" else "Single-blind"
    tags = (("device", f"Up to {protocol.device.force_limit_n:g} N"), ("lock", blind))
    return replace(found, figures=tuple(_figures(protocol)), tags=tags, session=tuple(session))


def copy_choice(source: str, document: Mapping[str, Any], note: str, name: str) -> TemplateChoice:
    """Return what is shown of a study that can be copied."""
    title, words = _described(document)
    return TemplateChoice(
        source, title or source, words, copy=True, note=note, name=name, study_title=title,
        languages=languages_of(document),
    )  # fmt: skip


def _described(document: Mapping[str, Any]) -> tuple[str, str]:
    head = document.get("study", {})
    description = head.get("description", "") if isinstance(head, Mapping) else ""
    return study_title(document), " ".join(str(description).split())


def _figures(protocol: Protocol) -> Iterator[tuple[str, str]]:
    trials = sum(block.trials for block in orders_of(protocol).blocks)
    yield "clock", duration(expected_duration_s(protocol))
    people = None if protocol.analysis is None else protocol.analysis.participants
    if people is not None:
        yield "people", f"{people}{PLANNED}"
    yield "layers", counted(trials, "trial")


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


def _unit_of(study: Study, path: Place) -> str:
    """Return the unit of a stimulus's numbers, which is that of the key that it varies."""
    varied = study.document.get(path[0], {}).get(path[1], {}).get("vary") if path[0] == "stimuli" else None
    if isinstance(varied, str):
        return unit_of(varied)
    return "times" if path[-1] == "repetitions" else ""


def studies(opened: Document | None) -> tuple[StudyChoice, ...]:
    """Return what can be opened: the open file, drafts that were never saved, recent files, names at hand.

    They are in the order of their titles; studies that ship with the program come last.
    """
    found = dict.fromkeys([*map(str, unsaved_files(workspace().protocols)), *sources()])
    own = "" if opened is None else source_of(opened.file)
    if opened is not None:
        found[own] = None
    drafted = {file.resolve() for file in drafted_files()}
    choices = []
    for source in found:
        file = _resolved(source)
        if Path(source).suffix == ".toml" and Path(source).exists() and holds_liquids_alone(source):
            continue
        title = _title(file, drafted=file in drafted) if opened is None or source != own else opened.title
        stem = Path(source).stem
        ships, original = is_shipped(source), "" if file is None else kept_original(file)
        choices.append(StudyChoice(title or stem, f"{stem}.toml", source, ships, file in drafted, original))
    return tuple(sorted(choices, key=lambda choice: (choice.shipped, choice.title.casefold(), choice.source)))


def _title(file: Path | None, *, drafted: bool) -> str:
    """Return the title of a study, of its draft where one is kept; "" where it has none or cannot be read."""
    if file is not None and drafted and (draft := draft_of(file)) is not None:
        return study_title(read(draft.text.encode(), file.parent).document)
    try:
        state = None if file is None else file.stat()
    except OSError:
        return ""
    return "" if file is None or state is None else _title_of_file(file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _title_of_file(file: Path, _changed_ns: int, _size: int) -> str:
    try:
        document, _places = read_document(file.read_bytes(), file.name)
    except (StudyError, OSError):
        return ""
    return study_title(document)


def header_state(
    opened: Document | None, choices: tuple[StudyChoice, ...], warnings: int, version: VersionChip
) -> HeaderState:
    """Return the header's state of the open study; ``warnings`` is how many it has."""
    if opened is None:
        return HeaderState(choices)
    draft = "Saved" if not opened.edited and opened.base else "Not saved yet"
    if opened.kept is not None and (opened.edited or not opened.base):
        draft = f"Draft kept {opened.kept:%H:%M}"
    return HeaderState(
        choices,
        source_of(opened.file),
        problems_chip(len(opened.study.faults), warnings),
        "" if opened.read_only else draft,
        opened.done[-1].words if opened.done else "",
        opened.undone[-1].words if opened.undone else "",
        not opened.read_only and (opened.edited or not opened.base),
        bool(opened.read_only),
        version,
    )


def source_of(file: Path) -> str:
    """Return what a study's file is opened by: its name at hand, else its path."""
    found = _file(file.stem)
    return file.stem if found is not None and found.resolve() == file.resolve() else str(file)


def new_choices(source: str = "") -> tuple[TemplateChoice, ...]:
    """Return what a new study can begin as: templates, the empty one last, then studies to copy.

    Raises StudyError if the study ``source`` cannot be read.
    """
    in_order = [name for name in TEMPLATES if name in templates()]
    choices = [_template_choice(name) for name in dict.fromkeys((*in_order, *templates()))]
    taken = taken_names()
    copied = dict.fromkeys([source, *shipped()] if source and not source.startswith("template:") else shipped())
    for name in copied:
        file = shipped_file(name) if name in shipped() else find(name)
        note = SHIPPED if name in shipped() else str(file.name)
        document, _places = read_document(file.read_bytes(), name)
        stem = re.sub(f"{COPY}[0-9]*$", "", short_name_of(file.stem)) or "study"
        free = free_short_name(taken, f"{stem[: MAX_SHORT_NAME - len(COPY)]}{COPY}")
        choices.append(copy_choice(name, document, note, free))
    return tuple(choices)


@cache
def _template_choice(name: str) -> TemplateChoice:
    return template_choice(name, template(name))


def _resolved(source: str) -> Path | None:
    file = Path(source) if Path(source).suffix == ".toml" else _file(source)
    return None if file is None else file.resolve()


def _file(source: str) -> Path | None:
    try:
        return find(source)
    except StudyError:
        return None
