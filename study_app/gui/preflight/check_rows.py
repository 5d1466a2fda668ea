"""One thing that was looked at, as a row: its verdict, its name, of what, how much of its limit, and the value."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Bar
from study_app.gui.widgets.labels import Ink, figures, label
from study_app.session.preflight import Check

ROW_HEIGHT = 42
DOT = 13.0
LEFT = 70
NAME, BAR = 148, 160
LEAST_WORDS = 160  # narrower, wrapped words would ask for room that they do not need
LOOKS: dict[str, tuple[str, Ink, str]] = {
    "ok": ("check", "ok", "passed"),
    "warning": ("warning", "warn", "warning"),
    "failure": ("cross", "bad", "cannot start"),
}


class CheckRow(Themed, QWidget):
    """A check; one that needs a decision is tinted and says below what to do."""

    def __init__(self, check: Check, *, last: bool) -> None:
        super().__init__()
        self.check, self._last = check, last
        _, ink, word = LOOKS[check.verdict]
        name = label(check.name, "body")
        name.setFont(font("body", weight=600, scale=0.97))
        name.setFixedWidth(NAME)
        about = label(check.about, "label", "text2", wraps=True)
        about.setFont(font("label", weight=400, tabular=True))
        about.setMinimumWidth(LEAST_WORDS)
        value = figures(check.value, "body", "text" if check.verdict == "ok" else ink)
        value.setFont(font("body", weight=600, tabular=True, scale=0.97))
        value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        said = vbox(STRETCH, about, spacing=6)
        if check.share is not None:
            share = Bar(height=6)
            share.setFixedWidth(BAR)
            share.show_share(min(1.0, check.share))
            said.addWidget(share, 0, Qt.AlignmentFlag.AlignLeft)
        said.addStretch()
        self._head = holder = QWidget()
        holder.setMinimumHeight(ROW_HEIGHT)
        hbox(name, (said, 1), value, spacing=14, margins=(0, 4, 0, 4), parent=holder)
        column = vbox(holder, spacing=0, margins=(LEFT, 0, 24, 0 if check.verdict == "ok" else 14), parent=self)
        if check.advice:
            advice = label(check.advice, "label", "text", wraps=True)
            advice.setFont(font("label", weight=500))
            column.addWidget(advice)
        self.setAccessibleName(f"{check.name}, {word}, {check.said}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        icon, ink, _ = LOOKS[self.check.verdict]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        tint = QColor(getattr(t, f"{ink}_bg"))
        if self.check.verdict != "ok":
            painter.fillRect(self.rect().adjusted(4, 0, -4, 0), tint)
        middle = QPointF(40, self._head.geometry().center().y() + 0.5)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(tint if self.check.verdict == "ok" else QColor(t.surface))
        painter.drawEllipse(middle, DOT, DOT)
        draw_icon(painter, icon, QRectF(middle.x() - 8, middle.y() - 8, 16, 16), getattr(t, ink), 2.4)
        if self._last:
            return
        painter.setPen(QPen(QColor(t.grid), 1))
        painter.drawLine(24, self.height() - 1, self.width() - 24, self.height() - 1)
