"""The study's languages to choose from, each in its own words."""

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QKeyEvent, QPaintEvent, QPen
from PySide6.QtWidgets import QGroupBox, QRadioButton, QWidget

from study_app.gui.participant.pages.key_caps import LitButton
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font
from study_app.protocol.wording.languages import words

CENTRE = int(Qt.AlignmentFlag.AlignCenter)
LEAST_HEIGHT = 44
RING = 4


class LanguageButton(LitButton, QRadioButton):
    """One language: an outline, and a check mark where it is the page's. Enter and Space choose it."""

    def __init__(self, language: str, parent: QWidget) -> None:
        super().__init__(words(language).name, parent)
        self.language = language
        self._scale = 1.0
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setLayoutDirection(
            Qt.LayoutDirection.RightToLeft if words(language).right_to_left else Qt.LayoutDirection.LeftToRight
        )

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.setFont(font("body", scale=scale, weight=600 if self.isChecked() else 500))
        self.setFixedSize(self.sizeHint())

    def sizeHint(self) -> QSize:
        wide = QFontMetricsF(self.font()).horizontalAdvance(self.text()) + (30 + 24 * self.isChecked()) * self._scale
        return QSize(round(wide) + 2 * RING, round(LEAST_HEIGHT * self._scale) + 2 * RING)

    def hitButton(self, _place: object) -> bool:
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self.click()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        theme, scale, radius = PARTICIPANT, self._scale, RADIUS_CONTROL * self._scale
        body = QRectF(self.rect()).adjusted(RING + 0.5, RING + 0.5, -RING - 0.5, -RING - 0.5)
        painter.setPen(QPen(QColor(theme.text if self.isChecked() else theme.ctl), 1))
        painter.setBrush(QColor(theme.hover if self.underMouse() else theme.surface))
        painter.drawRoundedRect(body, radius, radius)
        if self.hasFocus() and self.ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.accent), 2))
            painter.drawRoundedRect(body.adjusted(-3, -3, 3, 3), radius + 3, radius + 3)
        name = QRectF(body)
        if self.isChecked():
            side = 18 * scale
            mark = QRectF(body.left() + 14 * scale, body.center().y() - side / 2, side, side)
            name.setLeft(mark.right())
            if self.layoutDirection() == Qt.LayoutDirection.RightToLeft:
                mark.moveRight(body.right() - 14 * scale)
                name = QRectF(body.left(), body.top(), mark.left() - body.left(), body.height())
            draw_icon(painter, "check", mark, theme.accent, 2.4)
        painter.setFont(self.font())
        painter.setPen(QColor(theme.text if self.isChecked() else theme.text2))
        painter.drawText(name, CENTRE, self.text())
        painter.end()


class LanguageSwitch(QGroupBox):
    """The languages in one line: Tab comes to the page's own, arrows choose its neighbour.

    ``chosen`` comes with the code of another than the page's.
    """

    chosen = Signal(str)

    def __init__(self, languages: tuple[str, ...], present: str, name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.buttons = tuple(LanguageButton(language, self) for language in languages)
        for button in self.buttons:
            button.setChecked(button.language == present)
            policy = Qt.FocusPolicy.StrongFocus if button.isChecked() else Qt.FocusPolicy.ClickFocus
            button.setFocusPolicy(policy)  # Qt does so itself, but not for a button that is checked this early
            button.clicked.connect(lambda _=False, code=button.language: self._choose(code, present))

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        x = 0
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        for button in reversed(self.buttons) if flip else self.buttons:
            button.set_scale(scale)
            button.move(x, 0)
            x += button.width() + round(4 * scale)
        self.resize(x - round(4 * scale), self.buttons[0].height())

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw nothing: the buttons are all."""

    def _choose(self, code: str, present: str) -> None:
        if code != present:
            self.chosen.emit(code)
