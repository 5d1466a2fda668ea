"""The participant's window, driven by keys, mouse and touch, which finds widgets by the names on them."""

import json
import os
import subprocess
import sys
from typing import Any

from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QAccessible, QKeyEvent, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QWidget

from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import Words, words
from study_app.session.pages import Page
from study_app.session.transitions.events import Chosen, ItemShown
from tests.documented import ROOT
from tests.end_to_end.real_windows import virtual_display
from tests.gui.small import ManualClock

KEY = Qt.Key


class Participant:
    """The window on a screen and its events; by default it has the size of a pilot."""

    def __init__(
        self,
        qtbot: Any,
        page: Page | None = None,
        size: tuple[int, int] | None = None,
        said: str | Words = "en",
        text_scale: float = 1.0,
        *,
        captures_pointer: bool = False,
    ) -> None:
        self.clock = ManualClock()
        self.window = ParticipantWindow(
            words(said) if isinstance(said, str) else said,
            clock=self.clock,
            windowed=True,
            captures_pointer=captures_pointer,
            text_scale=text_scale,
        )
        qtbot.addWidget(self.window)
        self.events: list[Any] = []
        self.buttons: list[int] = []
        self.window.event.connect(self.events.append)
        self.window.buttons.connect(self.buttons.append)
        if size is None:
            self.window.open_on()
        else:
            self.window.setMinimumSize(1, 1)
            self.window.resize(*size)
            self.window.show()
            self.window.activateWindow()
        qtbot.waitExposed(self.window)
        QApplication.processEvents()
        if page is not None:
            self.show(page)

    def show(self, page: Page) -> None:
        self.window.show_page(page)
        self.settle()

    def settle(self) -> None:
        QApplication.processEvents()
        self.window.grab()
        QApplication.processEvents()

    @property
    def page(self) -> Any:
        """Return the widget of the page."""
        return self.window.widget

    @property
    def kinds(self) -> list[type]:
        return [type(event) for event in self.told]

    @property
    def told(self) -> list[Any]:
        """Return the events except `ItemShown`."""
        return [event for event in self.events if not isinstance(event, ItemShown)]

    @property
    def answers(self) -> list[tuple[str, Any]]:
        return [(event.item, event.value) for event in self.told if isinstance(event, Chosen)]

    @property
    def texts(self) -> str:
        """Return the texts of all labels and buttons of the page."""
        widgets = (widget for kind in (QLabel, QAbstractButton) for widget in self.page.findChildren(kind))
        return " ".join(widget.text() for widget in widgets)

    @property
    def focus(self) -> QWidget:
        return self.window.focusWidget() or self.window

    def question(self, number: int) -> Any:
        """Return the question with a number."""
        return next(field for field in self.page.fields if field.accessibleName().startswith(f"{number}. "))

    def find(self, name: str, question: int | None = None) -> QAbstractButton:
        """Return the button with this text or name on the page or in a question."""
        inside = self.page if question is None else self.question(question)
        for button in inside.findChildren(QAbstractButton):
            if button.isVisible() and name in (button.text(), button.accessibleName()):
                return button
        raise LookupError(name)

    def press(self, *keys: KEY) -> None:
        """Press keys on the focused widget."""
        for key in keys:
            QTest.keyClick(self.focus, key)
        QApplication.processEvents()

    def type(self, text: str) -> None:
        if text.isascii():
            QTest.keyClicks(self.focus, text)
            return
        for letter in text:  # QTest aborts if it does not know the key
            for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
                QApplication.sendEvent(self.focus, QKeyEvent(kind, 0, Qt.KeyboardModifier.NoModifier, letter))

    def click(self, target: str | QWidget, question: int | None = None, place: QPoint | None = None) -> None:
        widget = self.find(target, question) if isinstance(target, str) else target
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=place or widget.rect().center())
        QApplication.processEvents()

    def close(self) -> None:
        QTest.mouseMove(self.window, QPoint(1, 1))  # or the next test's page comes with the mouse on a cell
        self.window.may_close = True
        self.window.close()


def tap(finger: QPointingDevice, widget: QWidget, place: QPoint | None = None) -> None:
    """Touch a widget with one finger and let go, as a touch screen tells it to the window."""
    window = widget.window()
    at = widget.mapTo(window, place or widget.rect().center())
    QTest.touchEvent(window, finger).press(0, at, window).commit()
    QTest.touchEvent(window, finger).release(0, at, window).commit()
    QApplication.processEvents()


def told_of(widget: Any) -> Any:
    """Return the accessibility interface of a widget."""
    return QAccessible.queryAccessibleInterface(widget)


def name_of(widget: Any) -> str:
    return str(told_of(widget).text(QAccessible.Text.Name))


def description_of(widget: Any) -> str:
    return str(told_of(widget).text(QAccessible.Text.Description))


def on_a_display(script: str) -> Any:
    """Run a script with a virtual display, and return the JSON of its last line."""
    with virtual_display() as display:
        environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb", "PYTHONPATH": str(ROOT)}
        process = subprocess.run(
            [sys.executable, "-c", script], env=environment, cwd=ROOT, capture_output=True, text=True, check=False
        )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout.splitlines()[-1])
