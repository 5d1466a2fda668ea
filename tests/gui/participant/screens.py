"""The participant's window on a screen, and what it emitted."""

from typing import Any

from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from tests.gui.small import ManualClock


class Opened:
    """A window on a screen, and what it told."""

    def __init__(self, qtbot: Any, *, captures_pointer: bool = False, language: str = "en") -> None:
        self.window = ParticipantWindow(
            words(language), clock=ManualClock(), windowed=True, captures_pointer=captures_pointer
        )
        qtbot.addWidget(self.window)
        self.events: list[Any] = []
        self.places: list[tuple[float, float, float]] = []
        self.buttons: list[int] = []
        self.window.event.connect(self.events.append)
        self.window.pointer.connect(lambda *place: self.places.append(place))
        self.window.buttons.connect(self.buttons.append)
        self.window.open_on()
        qtbot.waitExposed(self.window)
        QApplication.processEvents()

    @property
    def kinds(self) -> list[type]:
        return [type(event) for event in self.events]

    @property
    def focus(self) -> QWidget:
        return self.window.focusWidget() or self.window
