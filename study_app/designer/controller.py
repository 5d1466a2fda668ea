"""The study designer: its page in the main window, and one controller for each task.

Each edit is shown in the form at once; the outline, the warnings and the repairs follow after a pause in typing.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, QTimer

from study_app.designer.document.additions import number_rows
from study_app.designer.document.document import (
    NO_ANSWERS,
    Answers,
    Document,
    open_file,
    open_new,
    open_unsaved,
    template,
    with_answers,
)
from study_app.designer.document.fields import edits_to_rename
from study_app.designer.document.steps import DeleteElement, Do, DuplicateElement, RenameElement, Request, Step, Task
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_text import Refused
from study_app.designer.editing import Editing
from study_app.designer.file import file_text
from study_app.designer.form.form import form_of
from study_app.designer.header import DesignerView, HeaderState, StudyChoice
from study_app.designer.measures.study_facts import facts
from study_app.designer.measures_controller import MeasuresController
from study_app.designer.new_study_page import header_state, new_choices, source_of, study_choices
from study_app.designer.outline import addable_elements, outline_rows
from study_app.designer.participant.playable import Feeling
from study_app.designer.participant.preview import ParticipantPreview
from study_app.designer.problems import ProblemRow, RepairSearch, problem_rows, warning_rows
from study_app.designer.prompts import DeleteCard, SeriesCard, places_of_references
from study_app.designer.saving import Saving
from study_app.designer.versions import Changes, KnownRuns, Renaming
from study_app.designer.window import DesignerPlace
from study_app.errors import StudyError
from study_app.protocol.source import Path as Place
from study_app.protocol.source import protocol_file
from study_app.store.versions import draft_of, keep_original

_PAUSE_MS: Final = 200


class DesignerController(QObject):
    """Opens studies, carries out the requests of the page, and provides its content."""

    def __init__(self, results: Path) -> None:
        place = DesignerPlace()
        super().__init__(place)  # parented to the page, so that no timer or thread outlives its widgets
        self.place = place
        self.editing = editing = Editing(results, self)
        self.runs = KnownRuns(editing)
        self.saving = Saving(editing, place, self.runs)
        self.changes = Changes(editing, place, self.runs)
        self.feeling = Feeling(editing, place)
        Renaming(editing, place, self.runs)
        self._other_documents: dict[Path, Document] = {}
        self._warnings: tuple[str, ...] = ()
        self._search_text = ""
        self._choices: tuple[StudyChoice, ...] = ()
        self._repairs = RepairSearch(self)
        self._pause_timer = QTimer(self)
        self._pause_timer.setInterval(_PAUSE_MS)
        self._pause_timer.setSingleShot(True)
        self._pause_timer.timeout.connect(self.show_outline)
        place.entered.connect(self.enter)
        self._tasks: dict[Task, Callable[..., object]] = {
            "select": editing.select, "back": editing.go_back, "undo": editing.undo, "redo": editing.redo,
            "save": self.saving.save, "banner": self.saving.answer_banner, "open": self.open, "new": self.show_new_page,
            "begin": self.begin_study, "find": self.find_elements, "add": self._show_addable,
            "delete": self.ask_to_delete, "duplicate": self.ask_to_duplicate, "series": self.show_series_card,
            "judge id": self._check_id,
            "repair": self.make_repair, "leave entries": editing.leave_entries, "repairs": self._repairs.show_repairs,
        }  # fmt: skip
        place.asked.connect(self.handle_request)
        place.new_page.copy_asked.connect(self.show_new_page)
        editing.changed.connect(self.show_study)
        self.preview = ParticipantPreview(editing, place)
        editing.edited.connect(self._pause_timer.start)
        editing.refused.connect(self._show_refusal)
        editing.made.connect(self._show_step)
        self.saving.kept.connect(self._show_header)
        self.saving.copy_asked.connect(self.show_new_page)
        self.saving.continued.connect(self._show_document)
        self.saving.discarded.connect(self._close_document)
        self.saving.compare_asked.connect(self.changes.compare_with)
        self.runs.changed.connect(self._show_header)
        self._repairs.found.connect(place.show_repairs)
        self.measures = MeasuresController(editing, place)
        self.measures.warned.connect(self._show_header)
        self.measures.warned.connect(self._show_warnings)

    def handle_request(self, request: Request | Do) -> None:
        """Carry out a request or task that the page emits."""
        if isinstance(request, Do):
            self._tasks[request.what](*request.arguments)
        else:
            self.editing.handle_request(request)

    # opening

    def enter(self) -> None:
        """Reload the list of studies; reload a file that another program changed if it was not edited here."""
        self._choices = study_choices(self.editing.opened)
        self.saving.check_file()
        self.runs.read_in_background()
        self.show_study()

    def open(self, source: str) -> None:
        """Open a study of the workspace, a shipped one or a file; an open study keeps its undo steps."""
        self.place.message_over.emit()
        self.saving.leave()
        try:
            file = Path(source) if Path(source).suffix == ".toml" else protocol_file(source)
            if self.editing.opened is not None and self.editing.opened.file.resolve() == file.resolve():
                self.place.close_new()
                if not self.editing.opened.base:
                    self.saving.offer_to_discard()
                self.enter()
                return
            opened = self._other_documents.get(file.resolve())
            if opened is None or not opened.edited:
                draft = None if file.exists() else draft_of(file)
                opened = open_file(file, self.editing.results) if draft is None else open_unsaved(file, draft)
        except StudyError as error:
            self.place.message.emit(f"{Path(source).stem}.toml cannot be opened", f"{error}.")
            self._show_header()
            return
        self._show_document(opened)

    def begin_study(self, source: str, name: str, answers: Answers = NO_ANSWERS) -> None:
        """Create a named study as a copy of a template ("template:NAME") or of another study."""
        try:
            if source.startswith("template:"):
                study, copy_of = template(source.removeprefix("template:")), ""
            else:
                file = protocol_file(source)
                study, copy_of = read_study(file.read_bytes(), file.parent), file.stem
            opened = open_new(with_answers(study, answers), name)
        except StudyError as error:
            self.place.new_page.refuse(f"{error}.")
            return
        self.saving.leave()
        keep_original(opened.file, copy_of)
        opened.note_edit(0.0)
        self._show_document(opened)
        self.saving.leave()

    def show_new_page(self, source: str = "") -> None:
        self.place.message_over.emit()
        try:
            choices = new_choices(source)
        except (StudyError, OSError) as error:
            self.place.message.emit("This study cannot be copied", f"{error}.")
            return
        self.place.show_new(choices, source)

    def _show_document(self, opened: Document) -> None:
        if (previous := self.editing.opened) is not None:
            self._other_documents[previous.file.resolve()] = previous
        self._choices = study_choices(opened)
        self._warnings = ()
        self.editing.open(opened)
        self.place.reset_view()
        self.place.close_new()
        self.show_study()
        self.show_outline()
        if opened.study.is_unreadable:
            self.place.show_tab("file")  # needed if the problem has no line
            self.place.open_next_problem()
        else:
            self.place.parts.focus_element()

    def _close_document(self) -> None:
        if (closed := self.editing.opened) is not None:
            self._other_documents.pop(closed.file.resolve(), None)
        self.editing.open(None)
        self._choices = study_choices(None)
        self.place.reset_view()
        self.show_study()
        self.place.nothing.new.setFocus()

    # steps that ask first

    def ask_to_delete(self, path: Place) -> None:
        """Delete an element; if others refer to it, first ask what to do with them."""
        opened = self.editing.writable
        if opened is None or len(path) < 2:
            return
        if places := places_of_references(opened.study, path):
            card = DeleteCard(opened.study, path, places)
            card.answered.connect(self.editing.handle_request)
            self.place.show_prompt(card, card.first)
        else:
            self.editing.handle_request(DeleteElement(path))

    def ask_to_duplicate(self, path: Place) -> None:
        """Copy an element; if it compares conditions by a design, first ask how those of the copy differ."""
        opened = self.editing.writable
        if opened is None:
            return
        numbers = [row for row in number_rows(opened.study.document, path) if row.path[:2] != path]
        if numbers:
            card = SeriesCard(opened.study, path, numbers, duplicates=True)
            card.answered.connect(self.editing.handle_request)
            self.place.show_prompt(card, card.first)
        else:
            self.editing.handle_request(DuplicateElement(path))

    def show_series_card(self, path: Place) -> None:
        if (opened := self.editing.opened) is None:
            return
        numbers = number_rows(opened.study.document, path)
        if not numbers or opened.read_only:
            reason = opened.read_only or "This element does not have any numeric fields."
            self.place.message.emit("This element cannot be copied as a series", reason)
            return
        self.editing.select(path)
        card = SeriesCard(opened.study, path, numbers)
        card.answered.connect(self.editing.handle_request)
        self.place.show_prompt(card, card.first)

    def make_repair(self, row: ProblemRow, sentence: str) -> None:
        repair = self._repairs.find_repair(row, sentence)
        if repair is None:
            return
        try:
            self.editing.make_step(sentence, *repair.edits, select=row.element or None)
        except Refused as refusal:
            self.place.message.emit("This correction cannot be applied", f"{refusal}.")

    def _show_refusal(self, path: Place, sentence: str, request: Request) -> None:
        if isinstance(request, RenameElement):
            self._check_id(path, request.name)
        else:
            self.place.form.refuse(path, sentence)

    def _show_addable(self) -> None:
        if (opened := self.editing.writable) is not None:
            self.place.show_addable(addable_elements(opened.study, opened.selected))

    def _check_id(self, path: Place, name: str) -> None:
        opened, sentence = self.editing.writable, ""
        if opened is None:
            return
        try:
            if name != str(path[-1]):
                edits_to_rename(opened.study.document, path, name, self.editing.recorded(path))
        except Refused as refusal:
            sentence = f"{refusal}."
        self.place.form.head.refuse(sentence)

    def _show_step(self, step: Step) -> None:
        if step.fresh or step.announcement or step.removed:
            self.show_outline()
        self.place.show_step(step)

    # display

    def show_study(self) -> None:
        """Show the open study: header, form, file and problems at once, the outline after a pause in typing."""
        opened = self.editing.opened
        if opened is None:
            self.place.show_view(DesignerView(self._header_state()))
            return
        study, selected = opened.study, opened.selected
        problems = problem_rows(study)
        self.place.show_view(
            DesignerView(
                self._header_state(),
                form_of(study, selected, opened.to_write),
                file_text(study, opened.file.name, selected),
                problems,
                self.saving.banner,
            )
        )
        self._repairs.begin_search(study, () if opened.read_only else problems)

    def find_elements(self, text: str) -> None:
        self._search_text = text
        self.show_outline()

    def show_outline(self) -> None:
        if self.editing.opened is None:
            return
        study = self.editing.opened.study
        study_facts = facts(study)
        rows = outline_rows(study, study_facts.steps_s, self._search_text, session_s=study_facts.expected_s)
        self.place.outline.show_outline(rows, self.editing.selected)
        warnings = study_facts.warnings
        if study.unfinished:  # new warnings are shown when the entry is finished
            warnings = tuple(warning for warning in warnings if warning in self._warnings)
        if warnings != self._warnings:
            self._warnings = warnings
            self._show_header()
        self._show_warnings()

    def _show_warnings(self) -> None:
        if (opened := self.editing.opened) is not None:
            warnings = (*self._warnings, *self.measures.warnings)
            self.place.problems.show_warnings(warning_rows(opened.study, warnings))

    def _header_state(self) -> HeaderState:
        warnings = len({*self._warnings, *self.measures.warnings})
        opened = self.editing.opened
        if opened is not None:
            source = source_of(opened.file)
            listed_title = next((choice.title for choice in self._choices if choice.source == source), None)
            if listed_title != (
                opened.title or opened.file.stem
            ):  # the title has changed, or the file was saved for the first time
                self._choices = study_choices(opened)
        return header_state(opened, self._choices, warnings, self.runs.chip)

    def _show_header(self) -> None:
        self.place.header.show_state(self._header_state())
