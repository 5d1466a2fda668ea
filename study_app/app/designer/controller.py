"""The study designer: where its place meets the open study.

Each edit is shown in the form at once; the outline, the warnings and the repairs follow when the keyboard rests.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.open_study import OpenStudy, open_file, open_new, open_unsaved
from study_app.app.designer.repair_search import RepairSearch
from study_app.app.designer.steps import Step, Steps, delete_prompt
from study_app.app.designer.studies import header_state, new_choices, source_of, studies, there, time_words
from study_app.authoring.drafts import ChangedOutsideError, draft_of
from study_app.authoring.facts import facts
from study_app.authoring.history import History
from study_app.authoring.new_study import template
from study_app.authoring.study import read
from study_app.authoring.versions import next_version
from study_app.authoring.writer.refused import Refused
from study_app.errors import StudyError
from study_app.gui.designer.view import DesignerPlace
from study_app.protocol.source.document import Path as Place
from study_app.protocol.source.files import find
from study_app.viewmodels.designer.fact_cards import fact_cards
from study_app.viewmodels.designer.file_text import file_text, retyped
from study_app.viewmodels.designer.form_rows import form, value_at
from study_app.viewmodels.designer.outline_rows import outline_rows
from study_app.viewmodels.designer.problem_rows import ProblemRow, problem_rows
from study_app.viewmodels.designer.requests import DeleteElement, RenameElement, Request, RetypeFile
from study_app.viewmodels.designer.view import Banner, DesignerView, HeaderState, StudyChoice, addable

DRAFT_MS: Final = 50
REST_MS: Final = 200
JOIN_S: Final = 1.0  # typing in one field is one step until the keyboard rests for so long


class DesignerController(QObject):
    """Gives the designer's place what it shows, and carries out what is asked for there.

    Parameters
    ----------
    results
        Folder that holds the studies' results folders: versions that were run are not overwritten.

    ``saved`` carries the file that was written.
    """

    saved = Signal(object)

    def __init__(self, results: Path) -> None:
        super().__init__()
        self.results = results
        self.place = DesignerPlace()
        self.opened: OpenStudy | None = None
        self._others: dict[Path, OpenStudy] = {}
        self._steps = Steps()
        self._joins: tuple[object, float] = (None, 0.0)
        self._warnings: tuple[str, ...] = ()
        self._find = ""
        self._banner: Banner | None = None
        self._choices: tuple[StudyChoice, ...] = ()
        self._back: list[Place] = []
        self._repairs = RepairSearch(self)
        self._drafting = self._timer(DRAFT_MS, self._write_draft, single=False)
        self._resting = self._timer(REST_MS, self._show_outline)
        self._connect()

    def _timer(self, interval_ms: int, then: Callable[[], object], *, single: bool = True) -> QTimer:
        made = QTimer(self)
        made.setInterval(interval_ms)
        made.setSingleShot(single)
        made.timeout.connect(then)
        return made

    def _connect(self) -> None:
        place = self.place
        place.entered.connect(self.enter)
        place.left.connect(self.leave)
        place.asked.connect(self.ask)
        place.selected.connect(self.select)
        place.back_asked.connect(self.go_back)
        place.study_asked.connect(self.open)
        place.new_asked.connect(self.ask_for_new)
        place.begin_asked.connect(self.begin)
        place.undo_asked.connect(self.undo)
        place.redo_asked.connect(self.redo)
        place.save_asked.connect(self.save)
        place.save_as_version_asked.connect(self.save_as_version)
        place.delete_asked.connect(self.ask_to_delete)
        place.repair_asked.connect(self.repair)
        place.find_changed.connect(self.find)
        self._repairs.found.connect(place.show_repairs)
        place.banner_asked.connect(self.answer_banner)

    # opening

    def enter(self) -> None:
        """Look again at what there is; a file that another program changed is taken in where nothing was edited."""
        self._show_studies()
        opened = self.opened
        if opened is not None and not opened.read_only and opened.changed_outside():
            if opened.edited or not opened.file.exists():
                self._say_changed()
            else:
                self._try(opened.take_outside)
        self.show()

    def leave(self) -> None:
        """Write the draft at once."""
        self._write_draft(at_once=True)

    def open(self, source: str) -> None:
        """Open a study of the workspace, one that ships, or a file."""
        self.leave()
        try:
            file = Path(source) if Path(source).suffix == ".toml" else find(source)
            opened = self._others.get(file.resolve())
            if opened is None or not opened.edited:
                draft = None if file.exists() else draft_of(file)
                opened = open_file(file, self.results) if draft is None else open_unsaved(file, draft)
        except StudyError as error:
            self.place.message.emit("This study cannot be opened", f"{error}.")
            self._show_studies()
            return
        self._show_opened(opened)

    def begin(self, source: str, name: str) -> None:
        """Begin a study under a name, as a copy of a template ("template:NAME") or of another study."""
        try:
            if source.startswith("template:"):
                study = template(source.removeprefix("template:"))
            else:
                file = find(source)
                study = read(file.read_bytes(), file.parent)
            opened = open_new(study, name)
        except StudyError as error:
            self.place.refuse_new(f"{error}.")
            return
        self.leave()
        opened.note_edit(0.0)
        self._show_opened(opened)
        self._write_draft(at_once=True)

    def ask_for_new(self, source: str = "") -> None:
        """Show the templates and the studies that can be copied, with one of them chosen."""
        try:
            choices = new_choices(source)
        except (StudyError, OSError) as error:
            self.place.message.emit("This study cannot be copied", f"{error}.")
            return
        self.place.show_new(choices, source)

    def _show_opened(self, opened: OpenStudy) -> None:
        if self.opened is not None:
            self._others[self.opened.file.resolve()] = self.opened
        self.opened = opened
        self._choices = studies(opened.file)
        self._steps, self._joins, self._back = Steps(), (None, 0.0), []
        self._warnings, self._banner, self._find = (), None, ""
        self._drafting.start()
        if opened.read_only:
            self._banner = Banner(opened.read_only, (("copy", "Make a copy …"),))
        elif opened.changed_outside():
            self._say_changed()
        elif opened.draft is not None and opened.edited and opened.base:
            when = time_words(opened.draft.kept_at)
            self._banner = Banner(f"Draft of {when}, not saved", (("discard", "Discard the draft"),))
        self.place.close_new()
        self.show(outline=True)

    def _say_changed(self) -> None:
        self._banner = Banner(
            "Another program changed this file, and it was edited here, too",
            (("keep", "Keep mine"), ("take", "Take the file's")),
        )

    def answer_banner(self, action: str) -> None:
        """Carry out what a button of the banner asks for."""
        opened = self.opened
        if opened is None:
            return
        if action == "copy":
            self.ask_for_new(source_of(opened.file))
            return
        self._banner = None
        if action == "keep":
            self._try(lambda: opened.keep_mine(time.monotonic()))
        elif action == "take":
            self._try(opened.take_outside)
        else:
            self._try(opened.discard_draft)
        self.show(outline=True)

    # steps

    def select(self, path: Place, *, back: bool = False) -> None:
        """Show the form of an element."""
        opened = self.opened
        if opened is None or opened.history.selected == path:
            return
        if not back:
            self._back.append(opened.history.selected)
        self._steps.leave()
        self._joins = (None, 0.0)
        opened.history = replace(opened.history, selected=path)
        self.show()

    def go_back(self) -> None:
        """Select what was selected before."""
        if self._back:
            self.select(self._back.pop(), back=True)

    def ask(self, asked: Request) -> None:
        """Make a step; where it is refused, say why at its field."""
        opened = self.opened
        if opened is None or opened.read_only:
            return
        try:
            if isinstance(asked, RetypeFile):
                text = retyped(opened.study.text, asked.text)
                if text == opened.study.text:
                    return
                joins = self._joined("file")
                opened.history = opened.history.typed("Edit the file", text, joins=joins)
            else:
                self._make(self._steps.step(opened.study, asked))
        except Refused as refusal:
            path = asked.path if hasattr(asked, "path") else opened.history.selected
            sentence = f"{str(refusal)[:1].upper()}{str(refusal)[1:]}."
            self.place.refuse(path, sentence, renaming=isinstance(asked, RenameElement))
            return
        self._edited(self.opened)

    def _make(self, step: Step) -> None:
        opened = self.opened
        assert opened is not None  # noqa: S101 - asked for by its form
        joins = step.continues is not None and self._joined(step.continues)
        if step.continues is None:
            self._joins = (None, 0.0)
        opened.history = opened.history.edited(step.words, *step.edits, select=step.select, joins=joins)

    def _joined(self, key: object) -> bool:
        """Return whether an edit continues the last step, and remember it."""
        before, then = self._joins
        now = time.monotonic()
        self._joins = (key, now)
        return key == before and now - then < JOIN_S

    def _edited(self, opened: OpenStudy | None) -> None:
        if opened is not None:
            opened.note_edit(time.monotonic())
            self.show()
            self._resting.start()

    def undo(self) -> None:
        """Undo the last step."""
        self._travel(History.undo)

    def redo(self) -> None:
        """Redo the step that was undone last."""
        self._travel(History.redo)

    def _travel(self, to: Callable[[History], History]) -> None:
        if self.opened is not None and not self.opened.read_only:
            self.opened.history = to(self.opened.history)
            self._joins = (None, 0.0)
            self._edited(self.opened)

    def ask_to_delete(self, path: Place) -> None:
        """Delete an element, or show what refers to it and ask what to do with that."""
        opened = self.opened
        if opened is None or opened.read_only or len(path) < 2:
            return
        prompt = delete_prompt(opened.study, path)
        if prompt.references:
            self.place.ask_to_delete(prompt)
        else:
            self.ask(DeleteElement(path))

    def repair(self, row: ProblemRow, words: str) -> None:
        """Make a repair, as one step."""
        opened = self.opened
        offered = self._repairs.repair(row, words)
        if opened is None or offered is None or opened.read_only:
            return
        try:
            opened.history = opened.history.edited(words, *offered.edits, select=row.element or None)
        except Refused as refusal:
            self.place.message.emit("This repair cannot be made", f"{refusal}.")
            return
        self._joins = (None, 0.0)
        self._edited(opened)

    # drafts and saving

    def save(self) -> None:
        """Write the file; ask where the version was run, or another program changed the file."""
        opened = self.opened
        if opened is None or opened.read_only or (opened.base and not opened.edited):
            return
        try:
            opened.save(self.results)
        except Refused as refusal:
            version = next_version(str(value_at(opened.study.document, ("study", "version"))))
            self.place.ask_for_version(f"{refusal}.", version)
            return
        except ChangedOutsideError:
            self._say_changed()
            self.show()
            return
        except StudyError as error:
            self.place.message.emit("The study was not saved", f"{error}.")
            return
        self._banner = None
        self.show()
        self.saved.emit(opened.file)

    def save_as_version(self, version: str) -> None:
        """Give the study another version and save it."""
        if (opened := self.opened) is not None:
            self._try(lambda: opened.set_version(version))
            self.save()

    def _write_draft(self, *, at_once: bool = False) -> None:
        if self.opened is None:
            return
        try:
            written = self.opened.write_draft(None if at_once else time.monotonic())
        except StudyError as error:
            self._drafting.stop()
            self.place.message.emit("The draft is not kept", f"{error}.")
            return
        if written:
            self.place.show_header(self._header())

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except StudyError as error:
            self.place.message.emit("This was not done", f"{error}.")

    # what is shown

    def show(self, *, outline: bool = False) -> None:
        """Show the open study: header, form, file and problems now, the outline when the keyboard rests."""
        opened = self.opened
        if opened is None:
            return
        study = opened.study
        selected = there(study.document, opened.history.selected)
        if selected != opened.history.selected:
            opened.history = replace(opened.history, selected=selected)
        problems = problem_rows(study)
        self.place.show_view(
            DesignerView(
                self._header(),
                form(study, selected),
                file_text(study, opened.file.name, selected),
                problems,
                self._banner,
                addable(study, selected),
            )
        )
        self._repairs.begin(study, () if opened.read_only else problems)
        if outline:
            self._show_outline()

    def find(self, words: str) -> None:
        """Show only the elements that hold these words."""
        self._find = words
        self._show_outline()

    def _show_outline(self) -> None:
        if self.opened is None:
            return
        study = self.opened.study
        known = facts(study)
        rows = outline_rows(study, known.steps_s, self._find)
        self.place.show_outline(rows, self.opened.history.selected, fact_cards(known, study.document))
        if known.warnings != self._warnings:
            self._warnings = known.warnings
            self.place.show_header(self._header())

    def _header(self) -> HeaderState:
        return header_state(self.opened, self._choices, len(self._warnings))

    def _show_studies(self) -> None:
        self._choices = studies(None if self.opened is None else self.opened.file)
        if self.opened is None:
            self.place.show_view(DesignerView(self._header()))
        else:
            self.place.show_header(self._header())
