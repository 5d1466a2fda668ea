"""Runs the program with its windows, and looks at them every 20 ms."""

from collections.abc import Callable
from typing import Any, TypeVar

from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.forms.questions import SliderField
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import ChoicePage, EndPage, QuestionnairePage, TextPage

W = TypeVar("W", bound=QWidget)


def window(kind: type[W]) -> W | None:
    """Return the window of that kind that is shown."""
    return next(
        (widget for widget in QApplication.topLevelWidgets() if isinstance(widget, kind) and widget.isVisible()), None
    )


def answer(participant: ParticipantWindow, page: QuestionnairePage) -> None:
    """Answer every question, sliders with an arrow, every second statement with a click, the others with a digit."""
    widget: Any = participant.widget
    for number, row in enumerate(widget.fields):
        if not row.isVisible():  # on the next part of the page
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_Return)
        if isinstance(row, SliderField):
            QTest.keyClick(row.line, Qt.Key.Key_Right)
        elif number % 2:
            QTest.mouseClick(row.options[number % len(row.options)], Qt.MouseButton.LeftButton)
        else:
            QTest.keyClick(row, Qt.Key(Qt.Key.Key_1 + number % len(row.options)))
    QTest.keyClick(widget, Qt.Key.Key_Return)


class Person(QObject):
    """Goes through a session with keys and clicks; before every look calls ``watch``, which may act in its place."""

    def __init__(self, watch: Callable[[ParticipantWindow, OperatorWindow], object], *, every_ms: int = 20) -> None:
        super().__init__()
        self._watch = watch
        self._answered: Any = None
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(every_ms)

    def leave(self) -> None:
        """Stop watching."""
        self._timer.stop()
        self.deleteLater()

    def look(self) -> None:
        participant, operator = window(ParticipantWindow), window(OperatorWindow)
        if participant is None or operator is None or participant.page is None:
            return
        if self._watch(participant, operator):
            return
        page = participant.page
        if isinstance(page, TextPage):
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, QuestionnairePage) and page is not self._answered:
            self._answered = page
            answer(participant, page)
        elif isinstance(page, ChoicePage) and page is not self._answered:
            self._answered = page
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_1)
        elif isinstance(page, EndPage):
            QTest.mouseClick(operator.buttons.close_session, Qt.MouseButton.LeftButton)


def words_of(top: QWidget) -> set[str]:
    """Return the titles, texts, tips and accessible names of a window."""
    words = {top.windowTitle()}
    for widget in (top, *top.findChildren(QWidget)):
        words |= {widget.accessibleName(), widget.accessibleDescription(), widget.toolTip(), widget.windowTitle()}
        words |= {widget.objectName(), widget.statusTip(), widget.whatsThis()}
        text = getattr(widget, "text", None)
        if callable(text):
            words.add(str(text()))
    return words


def traces_of(operator: OperatorWindow) -> set[str]:
    """Return names and labels of all that is plotted, and what stands where the force would be."""
    named = set()
    cards = (operator.lateness, operator.position, operator.force)
    for plot in (card.plot for card in cards if hasattr(card, "plot")):
        for item in plot.items():
            named |= {str(getattr(item, "toPlainText", str)()), str(getattr(item, "labelText", ""))}
    return named | {label.text() for label in operator.force.findChildren(QLabel)}
