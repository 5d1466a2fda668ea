"""The session step that shows an element, the part of a study to play, and liquids to feel in the lab."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path as File
from pathlib import Path as Folder
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from PySide6.QtCore import QObject, Signal

from study_app.designer.document.document import Document
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import written_references
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.designer.editing import Editing
from study_app.designer.measures.study_facts import valid_part
from study_app.designer.window import DesignerPlace
from study_app.errors import Problem, StudyError
from study_app.haptics.model.scene import Liquid
from study_app.lab.ab_comparison import Setting
from study_app.lab.ab_comparison import Side as LabSide
from study_app.lab.parameters import parameter
from study_app.protocol.model import Protocol
from study_app.protocol.orders import FormStep, PageStep, Step, Trial, build_schedule, variants
from study_app.protocol.source import Path, StudySource, has, value_at
from study_app.protocol.wording import language_name, languages_of
from study_app.session.pages import Page
from study_app.session.transitions.page_builder import PARTICIPANT, SEED, Moment, Preview, preview
from study_app.store.versions import kept_content, kept_versions


@dataclass(frozen=True, slots=True)
class ScreenSize:
    """A screen for the preview: name, label, size [logical px], and the minimum scale of its text."""

    name: str
    label: str
    width: int
    height: int
    text_scale: float = 1.0


SIZES: Final = (
    ScreenSize("small", "1366 × 768", 1366, 768),
    ScreenSize("full", "1920 × 1080", 1920, 1080),
    ScreenSize("touch", "Touch, 1280 × 800", 1280, 800),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantView:
    """The content of the tab Participant."""

    page: Page | None = None  # None if it cannot be shown
    language: str = "en"
    languages: tuple[str, ...] = ()  # the languages of the study
    step: str = ""  # such as "Liquids, trial 1 of 6"
    has_before: bool = False  # whether there is a previous step
    has_after: bool = False
    moments: tuple[tuple[Moment, str], ...] = ()  # the pages of the step, with their labels
    moment: Moment | None = None  # the shown page
    focused: str | None = None  # the id of the selected question
    note: str = ""  # the parts that are not shown as written, and why; "" if there are none
    photodiode: bool = True  # whether the tank has a corner for a photodiode

    @property
    def name(self) -> str:
        return f"Participant's page, {language_name(self.language)}"


def step_label(shown: Preview, step: Step, language: str) -> str:
    """Return the label of a step: "Welcome", "Liquids, trial 3 of 6"."""
    protocol = shown.protocol
    if isinstance(step, Trial):
        title = protocol.text(protocol.blocks[step.block].title, language)
        return title if step.of == 1 else f"{title}, trial {step.index} of {step.of}"
    if isinstance(step, PageStep):
        return protocol.text(protocol.pages[step.page_id].title, language)
    form = protocol.questionnaires[step.form].title
    return step.form.replace("_", " ").capitalize() if form is None else protocol.text(form, language)


def moment_labels(moments: tuple[Moment, ...]) -> tuple[tuple[Moment, str], ...]:
    """Return the pages of a step with their labels; empty if there is only one."""
    tank_count = sum(moment.kind == "tank" for moment in moments)
    labels = {
        "tank": "Tank",
        "questions": "Questions" if tank_count < 2 else "Question",
        "feedback": "Feedback",
        "text": "Text",
    }
    if len(moments) < 2:
        return ()
    return tuple(
        (moment, f"Interval {moment.interval}" if moment.kind == "tank" and tank_count > 1 else labels[moment.kind])
        for moment in moments
    )


_Graph: TypeAlias = Mapping[Path, frozenset[Path]]
"""The tables that each table refers to, by path: ``("conditions", "syrup")`` → ``{("liquids", "syrup")}``."""


def first_step(shown: Preview, path: Path) -> int | None:
    """Return the index of the first step that shows an element, or a part of it; None if none does."""
    graph = _graph_of(shown.protocol.model_dump())
    tables = (_tables_of_step(shown, step, graph) for step in shown.schedule.steps)
    return next((index for index, tables_of_step in enumerate(tables) if path[:2] in tables_of_step), None)


def _graph_of(document: Mapping[str, object]) -> _Graph:
    """Return the tables that each table of a study refers to."""
    names: dict[Path, set[Path]] = {}
    for place, named in written_references(document):
        names.setdefault(place[:2], set()).add(named[:2])
    return {table: frozenset(named) for table, named in names.items()}


def _reachable_tables(graph: _Graph, first: Iterable[Path]) -> frozenset[Path]:
    """Return tables and all tables that they refer to, directly or indirectly."""
    tables = dict.fromkeys(first)
    waiting = list(tables)
    for table in waiting:  # grows while it is read
        new_tables = [named for named in graph.get(table, ()) if named not in tables]
        tables |= dict.fromkeys(new_tables)
        waiting += new_tables
    return frozenset(tables)


def _tables_of_step(shown: Preview, step: Step, graph: _Graph) -> frozenset[Path]:
    """Return the tables that a step presents, and those that they refer to; of a trial only its own condition."""
    if isinstance(step, PageStep):
        return _reachable_tables(graph, [("pages", step.page_id)])
    if isinstance(step, FormStep):
        return _reachable_tables(graph, [("questionnaires", step.form)])
    block: Path = ("blocks", step.block)
    parts = [part for part in graph.get(block, ()) if part[0] not in {"conditions", "pages"}]
    condition_ids = (shown.codes[step.block][step.code], shown.protocol.blocks[step.block].standard)
    presented = [
        ("conditions", name) for name in condition_ids if name in shown.protocol.conditions
    ]  # a varied number has no condition
    return _reachable_tables(graph, [*parts, *presented]) | {block}


_TrialPage: TypeAlias = Literal["tank", "questions"]

STANDALONE: Final = "standalone"
_TRIAL_PAGES: Final[dict[str, _TrialPage]] = {
    "liquids": "tank", "tasks": "tank", "stimuli": "tank", "methods": "tank",
    "questionnaires": "questions", "scales": "questions", "designs": "questions",
}  # fmt: skip
"""The page of a trial that shows the elements of a section; elements of other sections are on both."""


class StepPosition(NamedTuple):
    """The position of a preview: the ID of a page, form or block, the block's trial (from 1), language and seed.

    Without an ID, it is the first step that shows the selected element.
    """

    name: str = ""
    trial: int = 1
    language: str = ""
    seed: int = SEED


@dataclass(frozen=True, slots=True)
class SessionStep:
    """A step of a session; ``session`` is the name of the session, "" for the first participant's first one."""

    shown: Preview
    index: int
    session: str = ""


def step_id(step: Step) -> str:
    """Return the id of a step's page, form or block."""
    return step.block if isinstance(step, Trial) else step.page_id if isinstance(step, PageStep) else step.form


def _previews(study: Protocol) -> Iterator[tuple[str, Preview]]:
    """Yield name and preview of each kind of session, first the first participant's first one with the name ""."""
    first = preview(study)
    yield "", first
    for variant in variants(study):
        if variant.protocol != first.protocol:
            schedule = build_schedule(variant.protocol, PARTICIPANT, SEED)
            yield variant.name, replace(first, protocol=variant.protocol, schedule=schedule)


def find_first_step(study: Protocol, path: Path) -> SessionStep | None:
    """Return the first step that shows an element, None if none does.

    A page or questionnaire that is not in any session is the only step of a session of its own.
    """
    for session, shown in _previews(study):
        if (index := first_step(shown, path)) is not None:
            return SessionStep(shown, index, session)
    if len(path) > 1 and path[0] in {"pages", "questionnaires"}:
        name = str(path[1])
        shown = preview(study)
        step: Step | None = None
        if path[0] == "pages" and name in study.pages:
            step = PageStep(name)
        elif path[0] == "questionnaires" and name in study.questionnaires:
            step = FormStep(name, tuple(item.id for item in study.questionnaires[name].items))
        if step is not None:
            return SessionStep(replace(shown, schedule=replace(shown.schedule, steps=(step,))), 0, STANDALONE)
    return None


def find_step(study: Protocol, name: str, trial: int, session: str) -> SessionStep | None:
    """Return the step with an ID in a session, as described in `_step_index`; None if there is none."""
    for session_name, shown in _previews(study):
        if session_name == session and (index := _step_index(shown, name, trial)) is not None:
            return SessionStep(shown, index, session)
    return None


def _step_index(shown: Preview, name: str, trial: int) -> int | None:
    """Return the index of the step with an ID; of a block, the given trial or else its last one; None without one."""
    candidates = [(index, step) for index, step in enumerate(shown.schedule.steps) if step_id(step) == name]
    exact = (pair for pair in candidates if isinstance(pair[1], Trial) and pair[1].index == trial)
    return next((index for index, _ in (*exact, *(candidates[::-1] if trial > 1 else candidates))), None)


def trial_page_of(path: Path) -> _TrialPage | None:
    """Return the page of a trial that shows an element; None for both."""
    return _TRIAL_PAGES.get(str(path[0])) if path else None


_MAX_EARLIER: Final = 5
"""Greatest number of stored versions that are searched for one without faults."""


def last_valid_study(opened: Document) -> Study | None:
    """Return the study in the file, or in its newest stored version without faults."""
    earlier = (kept_content(version.hash) or b"" for version in reversed(kept_versions(opened.file)[-_MAX_EARLIER:]))
    for text in (opened.saved.encode(), *(StudySource.split(content).file for content in earlier)):
        with suppress(Refused):
            study = read_study(text, opened.study.folder)
            if study.protocol is not None:
                return study
    return None


@dataclass(frozen=True, slots=True)
class Playable:
    """A part of a study to play."""

    source: bytes = field(repr=False)
    folder: Folder  # the folder of its videos
    protocol: Protocol = field(repr=False)
    step: int  # index in the preview's schedule of the first step shown
    words: str  # the label of that step, such as "Liquids, trial 3 of 6"
    position: StepPosition  # language and seed


class NotPlayableError(StudyError):
    """The study cannot be played; ``problems`` are the faults that prevent it, as ``check`` prints them."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        self.problems = problems
        super().__init__("; ".join(map(str, problems)))


def part_to_play(study: Study, path: Path, position: StepPosition | None = None) -> Playable:
    """Return the part to play from the preview's position, or from the first step that shows an element.

    Raises NotPlayableError if the study has faults other than missing texts in
    languages that are not shown.
    """
    position = position or StepPosition()
    if not study.is_toml:
        raise NotPlayableError(study.problems)
    language = position.language or languages_of(study.document)[0]
    edits = tuple(_edits_to_fill_in(study, language))
    completed = study.with_edits(*edits)[0] if edits else study
    if completed.protocol is None:
        known = {(problem.place, problem.message): problem for problem in study.problems}
        own = tuple(
            known_problem
            for problem in completed.problems
            if (known_problem := known.get((problem.place, problem.message)))
        )
        raise NotPlayableError(own or completed.problems)
    shown = preview(completed.protocol, position.seed)
    step = first_step(shown, path) or 0
    if position.name:
        step = _step_index(shown, position.name, position.trial) or 0
    return Playable(
        completed.source,
        completed.folder,
        completed.protocol,
        step,
        step_label(shown, shown.schedule.steps[step], language),
        StepPosition(position.name, position.trial, language, position.seed),
    )


def _edits_to_fill_in(study: Study, language: str) -> Iterator[Edit]:
    """Yield the edits that fill in missing texts of languages that are not shown."""
    for fault in study.faults:
        text = value_at(study.document, fault.path)
        missing_language = fault.missing_language
        if missing_language and missing_language != language and isinstance(text, Mapping) and text:
            yield Set((*fault.path, missing_language), text.get(language) or next(iter(text.values())))
        elif fault.kind == "one language" and isinstance(text, str):
            yield Set(fault.path, dict.fromkeys(languages_of(study.document), text))


_STUDY_TABLES: Final = frozenset({"scene", "velocity", "knee", "body"})
"""Parameter tables of the lab that apply to all liquids of a study."""


@dataclass(frozen=True, slots=True)
class LabLiquids:
    """Settings A and B for the lab; ``study`` is the study to which changes return, "" if it cannot be changed."""

    a: Setting
    b: Setting
    study: str


class Feeling(QObject):
    """Opens liquids of the open study in the lab.

    ``asked`` carries a `LabLiquids`, ``returned`` is emitted when a liquid was put back into the study.
    """

    asked = Signal(object)
    returned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self._sides: dict[LabSide, Liquid] = {}
        self._file = File()
        place.form.head.feel_asked.connect(self.feel_liquids)

    def feel_liquids(self, path: Path) -> None:
        """Open an element's liquids in the lab, with unsaved values: the first as A, the second as B."""
        self.place.flush()
        opened = self.editing.opened
        if opened is None:
            return
        study = opened.study
        protocol, problems = study.protocol or valid_part(study).protocol, study.problems
        is_valid = protocol is not None and str(path[1]) in getattr(protocol, str(path[0]))
        if protocol is None or not is_valid:
            self.place.message.emit(
                "The element cannot be opened in the lab yet", f"Correct this problem first: {problems[0]}."
            )
            return
        names = _liquid_ids(protocol, path)
        if not names:
            self.place.message.emit("The element cannot be opened in the lab", "It does not contain a liquid.")
            return
        titles_and_scenes = [
            (title_of(study.document, ("liquids", name)), protocol.scene_of(name)) for name in (names[0], names[-1])
        ]
        settings = [Setting(title, scene, scene) for title, scene in titles_and_scenes]
        self._sides = {"A": settings[0].scene.liquids[0], "B": settings[1].scene.liquids[0]}
        self._file = opened.file
        self.asked.emit(LabLiquids(settings[0], settings[1], "" if opened.read_only else opened.file.stem))

    def put_liquid_back(self, side: LabSide, setting: Setting) -> None:
        """Set the liquid of a side to the values of a setting, as one step."""
        opened, before = self.editing.opened, self._sides.get(side)
        if opened is None or before is None or opened.file != self._file:
            self.place.message.emit(
                "The liquid was not put back into the study", "A different study is now open in the designer."
            )
            return
        if opened.read_only:
            self.place.message.emit("The liquid was not put back into the study", opened.read_only)
            return
        path: Path = ("liquids", before.id)
        document = opened.study.document
        if value_at(document, path) is None:
            self.place.message.emit(
                "The liquid was not put back into the study", f"The study no longer contains the liquid {before.id}."
            )
            return
        title = title_of(document, path)
        if value_at(document, (*path, "file")) is not None:
            sentence = f"{title} is in a separate liquid file. Save it there as a preset."
            self.place.message.emit("The liquid was not put back into the study", sentence)
            return
        after = setting.scene.liquids[0]
        edits = tuple(_liquid_edits(document, path, _liquid_values(before), _liquid_values(after)))
        try:
            if edits:
                self.editing.make_step(f"Put {title} back from the lab", *edits, select=path)
        except Refused as refusal:
            self.place.message.emit("The liquid was not put back into the study", f"{refusal}.")
            return
        self._sides[side] = after.model_copy(update={"id": before.id})
        self.editing.select(path)
        self.returned.emit()
        shared_settings = [name for name in setting.changed_names() if name.partition(".")[0] in _STUDY_TABLES]
        if shared_settings:
            names = ", ".join(parameter(setting.scene, name).label.lower() for name in shared_settings)
            self.place.message.emit(
                f"{title} was put back into the study", f"These settings apply to all liquids in the study: {names}."
            )


def _liquid_ids(protocol: Protocol, path: Path) -> tuple[str, ...]:
    """Return the ids of at most two liquids of an element."""
    section, name = str(path[0]), str(path[1])
    if section == "liquids":
        return (name,)
    conditions = protocol.conditions_in(name) if section == "blocks" else (name,)
    ids = (liquid for condition in conditions for liquid in protocol.conditions[condition].liquid_ids)
    return tuple(dict.fromkeys(ids))[:2]


def _liquid_values(liquid: Liquid) -> dict[str, Any]:
    return liquid.model_dump(exclude_none=True, exclude={"id"})


def _liquid_edits(
    document: Mapping[str, Any], path: Path, before: Mapping[str, Any], after: Mapping[str, Any]
) -> Iterator[Edit]:
    """Yield the edits for the differences between two liquid tables."""
    for key in before:
        if key not in after and has(value_at(document, path), key):
            yield Unset((*path, key))
    for key, value in after.items():
        place, old = (*path, key), before.get(key)
        if old == value:
            continue
        if isinstance(value, Mapping) and isinstance(old, Mapping) and has(value_at(document, path), key):
            yield from _liquid_edits(document, place, old, value)
        else:
            yield Set(place, _toml_types(value))


def _toml_types(value: Any) -> Any:
    """Return a value in types that TOML has, with whole numbers as integers."""
    if isinstance(value, Mapping):
        return {key: _toml_types(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_toml_types(entry) for entry in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value
