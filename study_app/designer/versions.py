"""The versions of the open study that were run: the tab Changes, the card for saving, locked question IDs."""

import contextlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from difflib import unified_diff
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from PySide6.QtCore import QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QWidget

from study_app.designer.document.document import Document, Standing
from study_app.designer.document.study import Study
from study_app.designer.document.toml_text import with_line_feeds
from study_app.designer.editing import Editing
from study_app.designer.file import Colours
from study_app.designer.parts import make_dense, small_button
from study_app.designer.prompts import ConfirmCard, Prompt
from study_app.designer.version_rows import FILE, Comparison, VersionChip, run_counts, version_chip, version_choices
from study_app.designer.window import DesignerPlace, PanePage
from study_app.errors import StoreError
from study_app.gui.theme import Coloured, Theme, font
from study_app.gui.widgets import (
    ActionButton,
    Background,
    Card,
    Choice,
    Icon,
    add_layout,
    add_parts,
    delayed_call,
    hbox,
    label,
)
from study_app.number_text import capitalised, counted
from study_app.protocol.descriptions import differences
from study_app.protocol.source import Path as Place
from study_app.protocol.source import StudySource, value_at
from study_app.store.files import SessionFolder
from study_app.store.receipt import without_conditions
from study_app.store.versions import (
    Run,
    content_hash,
    keep_run_content,
    kept_content,
    kept_versions,
    recorded_items,
    run_of,
    runs_of_study,
    source_of,
)

_DELAY_MS: Final = 150


class KnownRuns(QObject):
    """The versions of the open study that were run; ``changed`` is emitted when they or the version chip change.

    ``items`` has the number of participants' sessions by questionnaire and question ID.
    """

    changed = Signal()

    def __init__(self, editing: Editing) -> None:
        super().__init__(editing)
        self.editing = editing
        self.known: tuple[Run, ...] = ()
        self.items: Mapping[tuple[str, str], int] = {}
        self.chip = VersionChip()
        self._reader = Background(self)
        self._reader.done.connect(self._apply_runs)
        self._pause_timer = delayed_call(self, _DELAY_MS, self._show_standing)
        editing.opened_other.connect(self._forget_runs)
        editing.edited.connect(self._pause_timer.start)

    def read_in_background(self) -> None:
        """Read the existing sessions in the background."""
        if (opened := self.editing.opened) is not None:
            self._reader.run(partial(_read_runs, self.editing.results, opened.name, opened.file))

    def read(self) -> tuple[Run, ...]:
        if (opened := self.editing.opened) is not None:
            self.known = runs_of_study(self.editing.results, opened.name)
        return self.known

    def standing(self) -> Standing | None:
        return None if self.editing.opened is None else self.editing.opened.standing(self.known)

    def _forget_runs(self) -> None:
        self.known, self.items, self.chip = (), {}, VersionChip()
        self.read_in_background()

    def _apply_runs(self, answer: tuple[str, tuple[Run, ...], Mapping[tuple[str, str], int]]) -> None:
        if self.editing.opened is not None and self.editing.opened.name == answer[0]:
            is_new = answer[1:] != (self.known, self.items)
            _, self.known, self.items = answer
            self._show_standing()
            if is_new:
                self.changed.emit()

    def _show_standing(self) -> None:
        standing = self.standing()
        chip = VersionChip() if standing is None else version_chip(standing, self.known)
        if chip != self.chip:
            self.chip = chip
            self.changed.emit()


def _read_runs(results: Path, study: str, file: Path) -> tuple[str, tuple[Run, ...], Mapping[tuple[str, str], int]]:
    known = runs_of_study(results, study)
    with contextlib.suppress(StoreError):  # the draft itself reports that it cannot be written
        keep_run_content(file, known)
    return study, known, recorded_items(known)


_NOTHING = "There is no version to compare with, because the study has not yet been run or saved."
_FONT_PX = 12


class _DifferenceText(Coloured, QPlainTextEdit):
    """A text difference that can be copied: removed lines begin with "-", new ones with "+"."""

    def __init__(self) -> None:
        super().__init__()
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        fixed.setPixelSize(_FONT_PX)
        self.setFont(fixed)
        self.setAccessibleName("Differences")
        self.setReadOnly(True)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setTabChangesFocus(True)
        inks = ("bad", "bad_bg", 400), ("ok", "ok_bg", 400), ("text2", "sunk", 400)
        self._colours = Colours(
            self.document(), r"(^-.*)|(^\+.*)|(^@.*)", *inks
        )  # removed lines, new lines, and line numbers

    def show_lines(self, lines: Sequence[str]) -> None:
        if (text := "\n".join(lines)) != self.toPlainText():
            scrolled = self.verticalScrollBar().value()
            self.setPlainText(text)
            self.verticalScrollBar().setValue(scrolled)

    def apply_theme(self, theme: Theme) -> None:
        self._colours.apply_theme(theme)


class SaveCard(Prompt):
    """The card for saving. Signals: ``save_asked`` (version), ``another_asked`` (name), ``changes_asked``."""

    save_asked = Signal(str)
    another_asked = Signal(str)
    changes_asked = Signal()

    def __init__(self, standing: Standing, known: Iterable[Run], difference: Comparison, problems: int) -> None:
        sessions = "; ".join(f"{run_counts(run)} with version {run.version}" for run in known if run.sessions)
        super().__init__(
            "Save as a new version",
            f"This study has been run: {sessions}. A version that has been run is never overwritten, so the study "
            "will be saved under a different number.",
        )
        self.difference = _DifferenceText()
        self.difference.show_lines(difference.lines)
        self.column.addWidget(self.difference, 1)
        self.difference.setVisible(bool(difference.lines))
        pronoun = "it is" if problems == 1 else "they are"
        problem_note = (
            f"{counted(problems, 'problem')}: correct {pronoun} before you start a new session." if problems else ""
        )
        for icon, ink, text in (("info", "text2", difference.note), ("warning", "warn", problem_note)):
            if text:
                icon_widget = Icon(icon, ink, 18)  # type: ignore[arg-type]  # an ink
                add_layout(self.column, hbox(icon_widget, (label(text, "label", wraps=True), 1), spacing=8))
        self.version = _field("Version to save as", standing.version, 110)
        self.name = _field("Short name for the new study", "", 220)
        self.name.setPlaceholderText("lowercase letters and digits")
        self.refusal = label("", "label", "bad", wraps=True)
        self.changes = ActionButton("", "Show in Changes", role="plain", height=40)
        self.another = ActionButton("copy", "Save as another study…", height=40)
        self.save = ActionButton("save", "", role="primary", height=40)
        self._of_version = label("Version", "label")
        self._of_name = label("Short name", "label")
        fields = hbox(self._of_version, self.version, self._of_name, self.name, (self.refusal, 1), spacing=10)
        add_parts(self.buttons, self.changes, self.another, self.save)
        add_parts(self.column, fields, self.buttons)
        self._naming = False
        self._show_name(naming=False)
        self.first: QWidget = self.save
        self.version.textEdited.connect(lambda _text: self._show_action())
        self.version.returnPressed.connect(self._ask_to_save)
        self.name.returnPressed.connect(self._ask_to_save)
        self.save.clicked.connect(self._ask_to_save)
        self.another.clicked.connect(lambda: self._show_name(naming=True))
        self.changes.clicked.connect(self.changes_asked)

    def refuse(self, sentence: str) -> None:
        self.refusal.setText(capitalised(sentence))

    def _show_name(self, *, naming: bool) -> None:
        self._naming = naming
        for part in (self._of_version, self.version):
            part.setVisible(not naming)
        for part in (self._of_name, self.name):
            part.setVisible(naming)
        self.another.setVisible(not naming)
        self._show_action()
        if naming:
            self.name.setFocus()

    def _show_action(self) -> None:
        self.refuse("")
        text = "Save the new study" if self._naming else f"Save {self.version.text().strip()}"
        self.save.show_action("save", text)

    def _ask_to_save(self) -> None:
        if self._naming:
            self.another_asked.emit(self.name.text().strip())
        else:
            self.save_asked.emit(self.version.text().strip())


def _field(name: str, text: str, width: int) -> QLineEdit:
    field = QLineEdit(text)
    field.setFont(font("body"))
    field.setAccessibleName(name)
    field.setFixedWidth(width)
    return field


_TAB_NAME: Final = "changes"
_PAUSE_MS: Final = 200
_NO_COPY: Final = (
    "This computer does not have a copy of this version. The differences are based on a receipt, which does not "
    "contain the conditions."
)
_STUDY_FAULTY: Final = (
    "This computer does not have a copy of this version. To list the differences, correct the study's problems first."
)
_EQUAL: Final = "The study is identical to this version."


class Version(NamedTuple):
    """A version to compare with: its source (text and liquid files) if known, and a run with its receipt."""

    source: str | None
    run: Run | None = None

    @property
    def text(self) -> str | None:
        return None if self.source is None else StudySource.split(self.source.encode()).file.decode()


def version_of(opened: Document, run: Run) -> Version:
    """Return a version that was run; its source is a stored copy or the file, if they have this version."""
    source = source_of(run)
    if source is None:
        file = opened.saved_source
        source = file.decode() if content_hash(file) == run.hash else None
    return Version(source, run)


def _kept_version(hash_: str) -> Version:
    """Return a stored version that was not run."""
    content = kept_content(hash_)
    return Version(None if content is None else content.decode("utf-8", "replace"))


def _file_version(file: Path) -> Version:
    """Return the current content of a study's file."""
    try:
        return Version(file.read_bytes().decode("utf-8", "replace"))
    except OSError:
        return Version(None)


def compare(version: Version, study: Study) -> Comparison:
    """Return the differences between a study and a version: lines, or sentences if only a receipt is known."""
    if version.source is None:
        run_protocol = None if version.run is None else version.run.protocol
        if run_protocol is None or study.protocol is None:
            return Comparison((), _STUDY_FAULTY)
        return Comparison(
            differences(run_protocol, json.loads(json.dumps(without_conditions(study.protocol)))), _NO_COPY
        )
    has_liquids = bool(
        StudySource.split(version.source.encode()).liquids
    )  # the stored source then contains the liquid files
    current = study.source.decode() if has_liquids else study.text
    before, after = (with_line_feeds(text).split("\n") for text in (version.source, current))
    _, _, *lines = unified_diff(before, after, lineterm="") if before != after else ("", "")
    return Comparison(tuple(lines), "" if lines else _EQUAL)


def latest_run(known: Iterable[Run]) -> Run | None:
    """Return the last run with participants, else the last pilot or rehearsal, else None."""
    runs = tuple(known)
    return next((run for run in reversed(runs) if run.sessions), runs[-1] if runs else None)


class Changes(Card):
    """The tab with the differences between the open study and a version."""

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(padding=14, gap=8)
        self.editing, self.place, self.runs = editing, place, runs
        self.chosen = ""
        """The key of the version that is compared with the study: its hash, or `FILE`."""
        self._preferred = ""
        self._session_run: Run | None = None
        self._choices: tuple[tuple[str, str], ...] = ()
        self.setAccessibleName("Changes")
        self.version = make_dense(Choice(), "Version to compare with")
        self.version.setMinimumWidth(120)
        self.restore = small_button("undo", "Restore", height=34)
        self.restore.setToolTip("Replace the study's text with the text of this version (one undo step)")
        self.note = label("", "label", "text2", wraps=True)
        self.difference = _DifferenceText()
        self.top = QWidget()
        prompt_label = label("Compare with", "label")
        hbox(prompt_label, (self.version, 1), self.restore, spacing=10, margins=0, parent=self.top)
        self.nothing = label(_NOTHING, "body", "text2", wraps=True)
        add_parts(self.column, self.top, self.nothing, self.note, (self.difference, 1))
        self.setFocusProxy(self.version)
        for part in (self.top, self.note, self.difference):
            part.hide()
        place.pane.add_page(PanePage(name=_TAB_NAME, title="Changes", body=self, with_facts=False))
        self._pause_timer = delayed_call(self, _PAUSE_MS, self.compare_now)
        place.pane.tab_shown.connect(lambda _tab: self.compare_now())
        place.header.version.clicked.connect(lambda: self.compare_with(""))
        editing.opened_other.connect(self._forget_choice)
        editing.edited.connect(self._pause_timer.start)
        runs.changed.connect(self.compare_now)
        self.version.activated.connect(lambda index: self.compare_with(str(self.version.itemData(index))))
        self.restore.clicked.connect(self._restore_version)

    def compare_with(self, key: str) -> None:
        self._preferred = key or self._preferred
        self.place.show_tab(_TAB_NAME)
        self.compare_now()

    def compare_with_session(self, study: str, folder: Path) -> None:
        """Compare the open study with the version of a session, if that is one of this study."""
        opened = self.editing.opened
        run = run_of(SessionFolder(folder, "", 0).receipt)
        if opened is None or run is None or opened.name != study:
            return
        self._session_run = run
        self.compare_with(run.hash)

    def _forget_choice(self) -> None:
        self._preferred, self._session_run = "", None
        self._pause_timer.start()

    def compare_now(self) -> None:
        """Update the comparison if the tab is shown."""
        opened = self.editing.opened
        if opened is None or self.place.pane.tab != _TAB_NAME:
            return
        shown_before, self._choices = (self._choices, self.chosen), self._version_choices(opened)
        keys = [key for key, _ in self._choices]
        newest_run = latest_run(self.runs.known)
        preferred = (self._preferred, "" if newest_run is None else newest_run.hash, *keys)
        self.chosen = next((key for key in preferred if key in keys), "")
        if (self._choices, self.chosen) != shown_before:
            with QSignalBlocker(self.version):
                self.version.clear()
                for key, title in self._choices:
                    self.version.addItem(title, key)
                self.version.setCurrentIndex(self.version.findData(self.chosen) if self.chosen else -1)
        version = self._version(opened, self.chosen) if self.chosen else Version(None)
        comparison = compare(version, opened.study) if self.chosen else Comparison()
        self.top.setVisible(bool(keys))
        self.nothing.setVisible(not keys)
        self.note.setText(comparison.note)
        self.note.setVisible(bool(comparison.note))
        self.difference.setVisible(bool(comparison.lines))
        self.difference.show_lines(comparison.lines)
        self.restore.setEnabled(not opened.read_only and version.text not in {None, opened.study.text})

    def _version_choices(self, opened: Document) -> tuple[tuple[str, str], ...]:
        file = ""
        with suppress(StoreError):  # an unreadable file is not offered for comparison
            if opened.base and opened.file.exists():
                if opened.changed_outside():
                    file = "The file as changed by the other program"
                elif opened.edited:
                    file = "The file without the edits"
        now = datetime.now().astimezone()
        return version_choices(self._known_runs(), kept_versions(opened.file), file, now)

    def _known_runs(self) -> tuple[Run, ...]:
        """Return the versions that were run, including that of the requested session in another results folder."""
        known = self.runs.known
        session_run = self._session_run
        return (
            known
            if session_run is None or any(run.hash == session_run.hash for run in known)
            else (session_run, *known)
        )

    def _version(self, opened: Document, key: str) -> Version:
        if key == FILE:
            return _file_version(opened.file)
        run = next((run for run in self._known_runs() if run.hash == key), None)
        return _kept_version(key) if run is None else version_of(opened, run)

    def _restore_version(self) -> None:
        self.place.flush()
        opened = self.editing.writable
        text = None if opened is None else self._version(opened, self.chosen).text
        if text is not None:
            self.editing.make_step(f"Restore {dict(self._choices)[self.chosen]}", text=text)
            self.compare_now()


BREAKS: Final = (
    "answers from before and after the change will be in different columns of the tables",
    "figures and tests will treat them as two questions",
    "a planned analysis that uses the old ID will not find the new one",
)


class Renaming(QObject):
    """Locks the IDs of questions with recorded answers until the user confirms the consequences of a change."""

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(editing)
        self.editing, self.place, self.runs = editing, place, runs
        self._unlocked: Place = ()
        editing.recorded = self._recorded_ids
        editing.changed.connect(self._update_lock)
        runs.changed.connect(self._update_lock)
        place.form.head.unlock_asked.connect(self._ask_to_unlock)

    def _item_id(self, path: Place) -> str:
        opened = self.editing.opened
        value = None if opened is None else value_at(opened.study.document, path)
        if not isinstance(value, dict):
            return ""
        return str(value.get("id", path[-1]))

    def _lock_reason(self, path: Place) -> str:
        if len(path) != 4 or path[2] != "items" or path == self._unlocked:
            return ""
        sessions = self.runs.items.get((str(path[1]), self._item_id(path)), 0)
        return f"Answers from {counted(sessions, 'session')} have been recorded under this ID." if sessions else ""

    def _recorded_ids(self, element: Place) -> frozenset[str]:
        """Return the IDs with recorded answers in the questionnaire of a question."""
        known = self.runs.items if element[2:3] == ("items",) else ()
        return frozenset(name for form, name in known if form == element[1])

    def _update_lock(self) -> None:
        path = self.editing.selected
        if path != self._unlocked:
            self._unlocked = ()
        self.place.form.head.show_lock(path, self._lock_reason(path))

    def _ask_to_unlock(self) -> None:
        path = self.editing.selected
        title, reason = f"Change the ID “{self._item_id(path)}”?", f"{self._lock_reason(path)} If you change it:"
        card = ConfirmCard(title, reason, "Change the ID", breaks=BREAKS)
        card.answered.connect(lambda _action: self._unlock(path))
        self.place.show_prompt(card, card.first)

    def _unlock(self, path: Place) -> None:
        self._unlocked = path
        self._update_lock()
        self.place.form.head.edit_id()
