"""A form in the participant's window, and a hand for it."""

from typing import Any

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.forms.question_form import FormWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.forms.show_if import ShowIf
from study_app.protocol.questions.choice import ChoiceView
from study_app.protocol.questions.number import NumberView
from study_app.protocol.questions.question import ItemView
from study_app.protocol.questions.rating import RatingView
from study_app.protocol.questions.slider import SliderView
from study_app.protocol.questions.text import TextView
from study_app.protocol.wording.languages import words
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown
from tests.gui.small import ManualClock

KEY = Qt.Key
FIVE = ("Not at all", "Slightly", "Somewhat", "Rather", "Very")
HANDS = (("left", "Left"), ("right", "Right"), ("both", "Both"))
DEVICES = (("mouse", "A mouse"), ("falcon", "A haptic device"), ("other", "Another one"))
QUESTIONS: tuple[ItemView, ...] = (
    NumberView("age", 1, "How old are you?", True, least=16, most=99, whole=True, unit="years"),
    ChoiceView("hand", 2, "Which hand do you write with?", True, options=HANDS),
    NumberView("since", 3, "Since when?", True, whole=True, show_if=ShowIf(item="hand", values="both")),
    ChoiceView("used", 4, "What have you used before?", False, options=DEVICES, several=True),
    RatingView("thick", 5, "How thick was it?", True, labels=FIVE, cannot_judge="Cannot judge"),
    SliderView("pleasant", 6, "How pleasant was it?", True, low="Unpleasant", high="Pleasant", step=5),
    TextView("comment", 7, "Anything else?", False, lines=1, longest=20),
)


def form(items: tuple[ItemView, ...] = QUESTIONS, **changed: Any) -> QuestionnairePage:
    fields: dict[str, Any] = {
        "trial": None,
        "title": "About you",
        "intro": "Please tell us about yourself.",
        "items": items,
        "labels": (),
        "cannot_judge": None,
        "progress": None,
        "form": "start",
    }
    return QuestionnairePage(**(fields | changed))


class Opened:
    """A form in the participant's window, and what it told."""

    def __init__(
        self,
        qtbot: Any,
        page: QuestionnairePage,
        size: tuple[int, int] = (1366, 768),
        language: str = "en",
        text_scale: float = 1.0,
    ) -> None:
        said = words(language)
        self.window = ParticipantWindow(said, clock=ManualClock(), windowed=True, text_scale=text_scale)
        qtbot.addWidget(self.window)
        self.events: list[Any] = []
        self.window.event.connect(self.events.append)
        self.window.resize(*size)
        self.window.show()
        self.window.activateWindow()
        qtbot.waitExposed(self.window)
        self.window.show_page(page)
        self.settle()

    def settle(self) -> None:
        QApplication.processEvents()
        self.window.grab()
        QApplication.processEvents()

    @property
    def page(self) -> FormWidget:
        assert isinstance(self.window.widget, FormWidget)
        return self.window.widget

    @property
    def told(self) -> list[Any]:
        """The events but for those that say what was shown."""
        return [event for event in self.events if not isinstance(event, ItemShown)]

    @property
    def answers(self) -> list[tuple[str, Any]]:
        return [(event.item, event.value) for event in self.told if isinstance(event, Chosen)]

    @property
    def asked(self) -> list[str]:
        return [field.view.id for field in self.page.asked]

    def field(self, item: str) -> Any:
        return next(field for field in self.page.fields if field.view.id == item)

    def press(self, *keys: KEY) -> None:
        for key in keys:
            focused = QApplication.focusWidget()
            assert focused is not None
            QTest.keyClick(focused, key)
        QApplication.processEvents()

    def type(self, text: str) -> None:
        focused = QApplication.focusWidget()
        assert focused is not None
        QTest.keyClicks(focused, text)

    def close(self) -> None:
        QTest.mouseMove(self.window, QPoint(1, 1))
        self.window.may_close = True
        self.window.close()


def click(widget: QWidget, place: QPoint | None = None) -> None:
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=place or widget.rect().center())
    QApplication.processEvents()


def tap(finger: QPointingDevice, widget: QWidget, place: QPoint | None = None) -> None:
    window = widget.window()
    at = widget.mapTo(window, place or widget.rect().center())
    QTest.touchEvent(window, finger).press(0, at, window).commit()
    QTest.touchEvent(window, finger).release(0, at, window).commit()
    QApplication.processEvents()


def place_of(opened: Opened, widget: QWidget) -> Any:
    return widget.rect().translated(widget.mapTo(opened.page, QPoint(0, 0)))
