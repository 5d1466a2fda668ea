"""The foot of the form: what the focused field means, where it is in the file, and what is permitted."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import RADIUS_CONTROL
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.labels import Elided, label

WORDS_PX = 50


class FormFoot(Themed, QWidget):
    """Label and place of a field, and its description."""

    def __init__(self) -> None:
        super().__init__()
        self.title = label("", "label")
        self.place = Elided("small", "text2")
        self.place.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.words = label("", "small", "text2", wraps=True)
        self.words.setMinimumHeight(WORDS_PX)
        self.words.setAlignment(Qt.AlignmentFlag.AlignTop)
        vbox(hbox(self.title, (self.place, 1)), self.words, spacing=3, margins=(12, 8, 12, 8), parent=self)

    def show_help(self, title: str, place: str, words: str) -> None:
        self.title.setText(title)
        self.place.show_text(place)
        self.words.setText(words)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.sunk))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
