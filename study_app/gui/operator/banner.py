"""What went wrong and what to do, above everything else in the middle; away while all is well."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from study_app.gui.cards import SHADOW, Icon
from study_app.gui.labels import label
from study_app.gui.theme import RADIUS_CARD
from study_app.gui.themed import Themed

WHAT_TO_DO = "The force is off and every answer so far is on disk. End the session, mend the cause, then begin anew."
WAITS = "The force is off and nothing is lost. Make room or bring the drive back: the session then goes on, paused."
AFTERWARDS = "The session is closed and the force is off. What the journal holds is safe."


class Banner(Themed, QWidget):
    """A tinted strip with a sign, what happened and what to do."""

    def __init__(self) -> None:
        super().__init__()
        self.what = label("", "strong", "bad", wraps=True)
        self.then = label(WHAT_TO_DO, "label", "text", wraps=True)
        words = QVBoxLayout()
        words.setSpacing(4)
        words.addWidget(self.what)
        words.addWidget(self.then)
        row = QHBoxLayout(self)
        row.setContentsMargins(20, 14, 20, 14)
        row.setSpacing(14)
        row.addWidget(Icon("warning", "bad", 24), 0, Qt.AlignmentFlag.AlignTop)
        row.addLayout(words, 1)
        self.hide()

    def show_trouble(self, what: str, *, over: bool, waits: bool = False) -> None:
        """Say ``what`` happened, or nothing where nothing did."""
        if what != self.what.text():
            self.what.setText(what[:1].upper() + what[1:])
        self.then.setText(WAITS if waits and not over else AFTERWARDS if over else WHAT_TO_DO)
        self.setVisible(bool(what))

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the tint."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.bad_bg))
        strip = QRectF(self.rect()).adjusted(SHADOW, 0, -SHADOW, 0)
        painter.drawRoundedRect(strip, RADIUS_CARD, RADIUS_CARD)
