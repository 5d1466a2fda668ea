"""What the operator needs where both windows share one screen: the state and the force stop, on the participant's."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.operator.session_header import OTHER_WINDOW, shown_state
from study_app.gui.theme.theme import PARTICIPANT
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.cards import Chip
from study_app.gui.widgets.controls import ActionButton, CompactStop
from study_app.gui.widgets.labels import Elided
from study_app.viewmodels.designer.keys import key_cap
from study_app.viewmodels.operator import OperatorView

HEIGHT = 52


class Strip(Themed, QWidget):
    """State, where the session is, the way to the operator's window and the force stop; it never takes the keyboard.

    A session that is ``played`` has no operator's window; its stop ends it.
    """

    stop_asked = Signal()
    operator_asked = Signal()

    def __init__(self, *, played: bool = False) -> None:
        super().__init__()
        self.setFixedHeight(HEIGHT)
        self.state = Chip("neutral", "clock", "Preparing")
        self.where = Elided("label", "text2")
        self.operator = ActionButton("", "Operator's window", key=OTHER_WINDOW, height=40)
        self.stop = CompactStop("Stop playing", key_cap("stop")) if played else CompactStop()
        self.operator.clicked.connect(self.operator_asked)
        self.stop.pressed.connect(self.stop_asked)
        row = hbox(self.state, (self.where, 1), spacing=12, margins=(16, 4, 8, 4), parent=self)
        for button in (self.operator, self.stop):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.addWidget(button)
        self.operator.setHidden(played)
        apply_theme_within(self, PARTICIPANT)

    def show_view(self, view: OperatorView) -> None:
        self.state.show_state(*shown_state(view))
        self.where.show_text(view.heading)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self.theme.surface))
        painter.fillRect(0, self.height() - 1, self.width(), 1, QColor(self.theme.border))
