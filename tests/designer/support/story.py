"""Stories in the designer's window: acts of a user one after another; after each, what the window shows must agree."""

import re
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel

from study_app.designer.document.steps import Request
from study_app.designer.document.study import read_study
from study_app.designer.header import problems_chip
from study_app.designer.problems import problem_rows
from study_app.gui.widgets.background import wait_for_jobs
from study_app.protocol.source.document import Path, value_at
from study_app.store.versions.drafts import draft_of
from tests.designer.support.designer import DEMO
from tests.designer.support.inputs import name_of
from tests.gui.transcript import comes_and_goes, spoken

NEVER_MS = 10**8
TIME = re.compile(r"\b\d\d:\d\d\b")
ACT = re.compile(r"'(?P<typed>[^']*)'|\[(?P<pressed>[^]]*)\]|@(?P<selected>\S+)|:(?P<entered>\S+)|(?P<key>\S+)")
"""An act of a story: a typed text, a pressed button, a selected element, a field that is entered, or a key."""


def settle(designer: Any) -> None:
    """Run all pending timers and background jobs now."""
    quiet = 0
    while quiet < 2:
        wait_for_jobs(60)
        QApplication.processEvents()
        designer.saving.write_draft()
        timers = (*designer.controller.findChildren(QTimer), *designer.window.findChildren(QTimer))
        single = [timer for timer in timers if timer.isSingleShot()]
        due = [timer for timer in single if timer.isActive()]
        for timer in single:
            timer.setInterval(NEVER_MS)  # else a slow machine changes the order
        for timer in due:
            timer.stop()
            timer.timeout.emit()
        quiet = 0 if due else quiet + 1


class Story:
    """A designer with its messages since the last check, and optionally the recorded lines of its window."""

    def __init__(self, designer: Any, spoken: list[str], text: str = DEMO) -> None:
        self.designer, self.spoken, self.text = designer, spoken, text
        self.lines: list[str] | None = None
        self.drafts_are_kept = True  # False while a draft cannot be written or deleted
        self._before: list[str] = []
        self._checked = ""
        designer.file.write_text(text, encoding="utf-8", newline="\n")
        self.act("open", designer.open)

    def play(self, story: str) -> None:
        """Do the acts of a story one after another."""
        for act in ACT.finditer(story):
            match act.lastgroup, act[act.lastindex or 0]:
                case "typed", text:
                    self.act(f"type {text!r}", lambda text=text: self.designer.type(text))
                case "pressed", name:
                    self.press(name)
                case "selected", path:
                    self.select(*path_of(path))
                case "entered", path:
                    self.act(f"enter {path}", lambda path=path: self.designer.place.form.focus_row(path_of(path)))
                case _, keys:
                    self.act(f"key {keys}", lambda keys=keys: self.designer.key(keys))

    def act(self, name: str, act: Callable[[], Any]) -> None:
        """Run an act, and check that all parts of the window agree afterwards; record its lines if enabled."""
        if QApplication.activePopupWidget() is None and not self.designer.window.isActiveWindow():
            self.designer.window.activateWindow()
            QApplication.processEvents()
        act()
        settle(self.designer)
        for title, sentence in self.designer.messages:
            self.spoken.append(f"{title}: {sentence}")
        self.designer.messages.clear()
        try:
            self.check()
        except AssertionError as disagreement:
            raise AssertionError(f"after {name!r}: {disagreement}") from disagreement
        if self.lines is not None:
            front = QApplication.activePopupWidget() or self.designer.window
            after = [line for line in spoken(front) if not line.startswith("ScrollBar")]
            self.lines += [f"-- {name}", *comes_and_goes(self._before, after)]
            self._before = after

    def check(self) -> None:
        """Check that header, form, draft and keyboard agree with the text of the study."""
        designer, document = self.designer, self.designer.editing.opened
        focus = QApplication.focusWidget()
        assert focus is None or focus.isVisible(), f"the keyboard is at {name_of(focus)!r}, which is hidden"
        if document is None:
            return
        header, form, prompt = designer.place.header, designer.place.form, designer.place.prompt
        if prompt is not None and prompt.isVisible():
            heading = prompt.heading.text()
            assert (prompt.accessibleName(), heading.endswith((".", ":"))) == (heading, False), heading
            explanations = [part.text() for part in prompt.findChildren(QLabel) if part.text() != heading]
            assert explanations[0].endswith((".", ":")), explanations
        if document.study.text != self._checked:
            self._checked = document.study.text
            again = read_study(self._checked.encode(), document.file.parent)
            assert again.faults == document.study.faults
            rows = [row.fault for row in designer.place.view.problems if not row.warning]
            unfinished = again.with_unfinished(document.study.unfinished)
            assert rows == [row.fault for row in problem_rows(unfinished)], "the list of problems"
        count = len(problem_rows(document.study))
        words = header.problems.chip_text
        assert words == problems_chip(count, 0)[2] if count else not words.endswith("problem"), words
        for button, steps in ((header.undo, document.done), (header.redo, document.undone)):
            assert button.isEnabled() == (bool(steps) and not document.read_only), button.accessibleName()
            assert not steps or button.accessibleName().endswith(steps[-1].title), button.accessibleName()
        assert form.head.path == document.selected[: len(form.head.path)], (form.head.path, document.selected)
        for row in form.rows:
            assert row.row.value == value_at(document.study.document, row.row.path), row.row.path
        draft, text = draft_of(document.file), document.study.text
        if self.drafts_are_kept:
            kept = None if draft is None else draft.text
            assert kept == (None if self.kept == "saved" else text), f"the draft of a study that is {self.kept}"

    @property
    def kept(self) -> str:
        """Return "saved" if the text is that of the file, otherwise "edited", or "not saved" without a file."""
        file, text = self.designer.editing.opened.file, self.designer.text
        if not file.exists():
            return "not saved"
        return "saved" if file.read_bytes().decode(errors="replace") == text else "edited"

    def expect(self, *said: str, selected: str = "", undo: str | None = None, kept: str = "", at: str = "") -> None:
        """Check the messages since the last call, the selection, undo, the saved state and the focus."""
        heard = [TIME.sub("HH:MM", words) for words in self.spoken]
        self.spoken.clear()
        for words in said:
            assert any(words in sentence for sentence in heard), (words, heard)
        if selected:
            assert self.designer.editing.selected == path_of(selected)
        if undo is not None:
            assert (self.designer.steps or [""])[-1] == undo
        if kept:
            assert self.kept == kept
        if at:
            assert (now := name_of(QApplication.focusWidget() or self.designer.window)) == at, now

    def has(self, *lines: str) -> None:
        """Check that the text of the study has lines that begin so."""
        for line in lines:
            assert re.search(f"^ *{re.escape(line)}", self.designer.text, re.M), line

    def lacks(self, *texts: str) -> None:
        """Check that the text of the study has none of some texts."""
        for text in texts:
            assert text not in self.designer.text, text

    def undo_and_redo(self) -> None:
        """Undo all steps, then redo them: each restores the text before or after it."""
        document = self.designer.editing.opened
        if document is None or document.read_only:
            return
        texts = [document.study.text]
        for _ in tuple(document.done):
            self.designer.editing.undo()
            texts.append(document.study.text)
        for text in texts[-2::-1]:
            self.designer.editing.redo()
            assert document.study.text == text

    def press(self, name: str) -> None:
        """Press a button by the mouse."""
        buttons = self.designer.parts(name, QAbstractButton)
        assert buttons, (name, [name_of(button) for button in self.designer.parts("*", QAbstractButton)])
        self.act(f"press {name}", lambda: self.designer.click_on(buttons[0]))

    def press_row(self, *path: str | int, held: str = "") -> None:
        """Press an element's first row in the outline by the mouse."""
        tree, index = self.designer.outline.tree, self.designer.index(*path)
        tree.scrollTo(index)
        at = tree.visualRect(index).center()
        self.act(f"press {held} row {path}", lambda: self.designer.click_on(tree.viewport(), held, at))

    def choose(self, box: Any, words: str) -> None:
        """Choose an entry of a list that begins with some words, as a user does who opened it."""
        at = next(at for at in range(box.count()) if box.itemText(at).startswith(words))

        def act() -> None:
            box.setFocus()
            box.setCurrentIndex(at)
            box.activated.emit(at)

        self.act(f"choose {words}", act)

    def ask(self, request: Request) -> None:
        """Ask for a step, as a part of the window would."""
        self.act(f"ask {type(request).__name__}", lambda: self.designer.editing.handle_request(request))

    def select(self, *path: str | int) -> None:
        self.act(f"select {path}", lambda: self.designer.go_to(*path))


def path_of(words: str) -> Path:
    return tuple(int(step) if step.isdecimal() else step for step in words.split("."))
