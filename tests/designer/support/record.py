"""A designer's window as text: a story is played in it, and what changes with each act is noted for a golden file."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from study_app.designer.document.steps import Request
from study_app.gui.widgets.background import wait_for_jobs
from study_app.store.drafts import draft_of
from tests.designer.support.designer import DEMO
from tests.designer.support.inputs import name_of
from tests.golden_values import changed, one_line
from tests.gui.transcript import compare, painted, part_of, told

NEVER_MS = 10**8
TIME = re.compile(r"\b\d\d:\d\d\b")
TIP = re.compile(r"^(StaticText readOnly .+) \| = \|  \| =$")
"""A text with itself as its tip, which it has where it is cut."""
ACT = re.compile(r"'(?P<typed>[^']*)'|\[(?P<pressed>[^]]*)\]|@(?P<selected>\S+)|:(?P<entered>\S+)|(?P<key>\S+)")
"""An act of a story: a typed text, a pressed button, a selected element, a field that is entered, or a key."""


def settle(designer: Any) -> None:
    """Let all be done now that a timer would do later, or a job in the background."""
    quiet = 0
    while quiet < 2:
        wait_for_jobs(60)
        QApplication.processEvents()
        designer.saving.write_draft()
        found = (*designer.controller.findChildren(QTimer), *designer.window.findChildren(QTimer))
        single = [timer for timer in found if timer.isSingleShot()]
        due = [timer for timer in single if timer.isActive()]
        for timer in single:
            timer.setInterval(NEVER_MS)  # else a slow machine changes the order
        for timer in due:
            timer.stop()
            timer.timeout.emit()
        quiet = 0 if due else quiet + 1


class Record:
    """A designer, and what changes in its window, its study and its messages with each act."""

    def __init__(self, designer: Any, spoken: list[str], text: str = DEMO, part: str = "window") -> None:
        self.designer, self.spoken, self.lines, self.text, self.part = designer, spoken, list[str](), text, part
        designer.file.write_text(text, encoding="utf-8")
        self.before: dict[str, list[str]] = {}
        self.texts: dict[Path, str] = {}  # of each study, as it was last
        self.kept = ""
        self.note("open", designer.open)

    def play(self, story: str) -> None:
        """Do the acts of a story one after another."""
        for act in ACT.finditer(story):
            match act.lastgroup, act[act.lastindex or 0]:
                case "typed", text:
                    self.note(f"type {text!r}", lambda text=text: self.designer.type(text))
                case "pressed", name:
                    self.press(name)
                case "selected", path:
                    self.select(*_path(path))
                case "entered", path:
                    self.note(f"enter {path}", lambda path=path: self.designer.place.form.focus_row(_path(path)))
                case _, keys:
                    self.note(f"key {keys}", lambda keys=keys: self.designer.key(keys))

    def note(self, name: str, act: Callable[[], Any], *, paints: bool = False, of: QWidget | None = None) -> None:
        """Do something, and note what it changes: in the window, or in a part since the last act of that name.

        Only the form is painted: the height of the other cards depends on when they are laid out.
        """
        if QApplication.activePopupWidget() is None and not self.designer.window.isActiveWindow():
            self.designer.window.activateWindow()
            QApplication.processEvents()
        act()
        settle(self.designer)
        self.lines += [f"-- {name}", *self.said()]
        part = part_of(self.designer, self.part)
        shown, key = (of, name) if of else (QApplication.activePopupWidget() or part, "")
        heard = [TIP.sub(r"\1", line) for line in told(shown) if not line.startswith("ScrollBar")]
        seen = {f"{key} told": heard} | ({"painted": painted(self.designer.place.form)} if paints else {})
        for way, lines in seen.items():
            after = [TIME.sub("HH:MM", line).replace(f"{self.designer.file.parents[1]}/", "") for line in lines]
            self.lines += changed(self.before.get(way, []), after)
            self.before[way] = after

    def said(self) -> Iterator[str]:
        """Yield messages, what is selected, and what changed in the text since the last time."""
        designer = self.designer
        yield from (f"message {title}: {sentence!r}" for title, sentence in designer.messages)
        yield from (f"said {TIME.sub('HH:MM', words)!r}" for words in self.spoken)
        designer.messages.clear()
        self.spoken.clear()
        if designer.editing.opened is None:
            yield "no study"
            return
        focus = QApplication.focusWidget()
        at = f"{type(focus).__name__} {focus.accessibleName()!r}" if focus else "nothing"
        yield f"selected {'.'.join(map(str, designer.editing.selected))}, steps {designer.steps}, keyboard at {at}"
        opened, draft = designer.editing.opened, draft_of(designer.editing.opened.file)
        self.text = self.texts.get(opened.file, self.text)
        yield from changed(self.text.split("\n"), designer.text.split("\n"), numbered=True)
        self.text = self.texts[opened.file] = designer.text
        on_disk = opened.file.read_bytes().decode() if opened.file.exists() else None
        kept = "not saved" if on_disk is None else "saved" if on_disk == self.text else "edited"
        kept += ", no draft" if draft is None else ", draft"
        kept += "" if draft is None or draft.text == self.text else " of another text"
        yield from [kept] if kept != self.kept else ()
        self.kept = kept

    def compare(self, name: str, config: pytest.Config) -> None:
        """Compare what was noted with the golden file of a name."""
        compare(f"designer, {name}", [" / ".join(line.splitlines()) for line in self.lines], config)

    def press(self, name: str) -> None:
        """Press a button by the mouse."""
        found = self.designer.parts(name, QAbstractButton)
        assert found, (name, [name_of(one) for one in self.designer.parts("*", QAbstractButton)])
        self.note(f"press {name}", lambda: self.designer.click_on(found[0]))

    def press_row(self, *path: str | int, held: str = "") -> None:
        """Press an element's first row in the outline by the mouse."""
        tree, index = self.designer.outline.tree, self.designer.index(*path)
        tree.scrollTo(index)
        at = tree.visualRect(index).center()
        self.note(f"press {held} row {path}", lambda: self.designer.click_on(tree.viewport(), held, at))

    def choose(self, box: Any, words: str) -> None:
        """Choose an entry of a list that begins with some words, as a user does who opened it."""
        at = next(at for at in range(box.count()) if box.itemText(at).startswith(words))

        def act() -> None:
            box.setFocus()
            box.setCurrentIndex(at)
            box.activated.emit(at)

        self.note(f"choose {words}", act)

    def ask(self, request: Request) -> None:
        """Ask for a step, as a part of the window would."""
        self.note(f"ask {one_line(request)}", lambda: self.designer.editing.handle_request(request))

    def select(self, *path: str | int, paints: bool = False) -> None:
        self.note(f"select {path}", lambda: self.designer.go_to(*path), paints=paints)


def _path(words: str) -> tuple[str | int, ...]:
    return tuple(int(step) if step.isdecimal() else step for step in words.split("."))
