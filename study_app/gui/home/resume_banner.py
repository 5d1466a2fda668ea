"""The banner above all cards: an interrupted session, what of it is saved, and the button that resumes it."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import RADIUS_CARD
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.home import Interrupted


class ResumeBanner(Themed, QWidget):
    """A tinted strip; hidden while there is nothing to go on with. ``resume_asked`` carries the session."""

    resume_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self._shown: Interrupted | None = None
        self.heading = label("", "strong", "text", wraps=True)
        self.line = label("", "label", "warn", wraps=True)
        self.resume = ActionButton("play", "Resume", role="primary")
        self.resume.clicked.connect(lambda: self.resume_asked.emit(self._shown))
        words = vbox(self.heading, self.line, spacing=4)
        margins = (SHADOW + 22, 14, SHADOW + 18, 14)
        hbox(Icon("clock", "warn", 26), (words, 1), self.resume, spacing=18, margins=margins, parent=self)
        self.hide()

    def show_interrupted(self, session: Interrupted | None) -> None:
        """Offer to go on with a session, or nothing."""
        self._shown = session
        self.setVisible(session is not None)
        if session is None:
            return
        self.heading.setText(session.heading)
        self.line.setText(session.line)
        self.resume.show_action("play", f"Resume {session.participant}")
        self.resume.setAccessibleName(f"Resume {session.participant}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.warn_bg))
        strip = QRectF(self.rect()).adjusted(SHADOW, 0, -SHADOW, 0)
        painter.drawRoundedRect(strip, RADIUS_CARD, RADIUS_CARD)
