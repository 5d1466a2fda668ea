"""A new study: templates, the empty one, and copies of other studies; nothing is written before it is saved."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QAbstractButton,
    QButtonGroup,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QScrollArea,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CARD, font
from study_app.gui.theme.themed import Themed, dress
from study_app.gui.widgets.cards import SHADOW, Card
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.prompts import TemplateChoice

ACROSS, HEIGHT, COPY_HEIGHT = 3, 118, 76
SIDE_PX = 340


class TemplateButton(Themed, QAbstractButton):
    """One thing to begin from: its icon, title and description."""

    def __init__(self, choice: TemplateChoice) -> None:
        super().__init__()
        self.choice = choice
        self.setText(choice.title)
        self.setCheckable(True)
        self.setAccessibleName(f"{'Copy of' if choice.copy else 'Template'} {choice.title}")
        self.setAccessibleDescription(choice.description)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room of a card."""
        return QSize(220, COPY_HEIGHT if self.choice.copy else HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the card."""
        t, painter = self.theme, QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        chosen = self.isChecked() or self.hasFocus()
        painter.setPen(QPen(QColor(t.accent if chosen else t.border), 2 if chosen else 1))
        painter.setBrush(QColor(t.selected if self.isChecked() else t.hover if self.underMouse() else t.surface))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CARD, RADIUS_CARD)
        icon = "copy" if self.choice.copy else "plus" if self.choice.source.endswith(":empty") else "layers"
        draw_icon(painter, icon, QRectF(16, 18, 20, 20), t.accent, 1.9)
        painter.setPen(QColor(t.text))
        painter.setFont(font("strong"))
        title = painter.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, self.width() - 62)
        painter.drawText(QRectF(46, 14, self.width() - 60, 28), Qt.AlignmentFlag.AlignVCenter, title)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("label", weight=400))
        place = QRectF(16, 46, self.width() - 32, self.height() - 56)
        words = self.choice.description
        if self.choice.copy:
            words = painter.fontMetrics().elidedText(words, Qt.TextElideMode.ElideRight, int(place.width()))
        painter.drawText(place, Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop, words)


class NoStudyCard(Card):
    """What is shown while no study is open; ``new`` is its button."""

    def __init__(self) -> None:
        super().__init__("No study is open", padding=28, gap=12)
        self.column.addWidget(label("Choose a study above, or begin a new one.", "body", "text2"))
        self.new = ActionButton("plus", "New study …", role="primary")
        self.column.addWidget(self.new, 0, Qt.AlignmentFlag.AlignLeft)
        self.column.addStretch()


class NewStudyPage(Themed, QWidget):
    """Signals: ``begin_asked`` (source, name), ``given_up``."""

    begin_asked = Signal(str, str)
    given_up = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.buttons: list[TemplateButton] = []
        self._group = QButtonGroup(self)
        self.back = IconButton("chevron_left", "Back", role="plain")
        self.back.clicked.connect(self.given_up)
        head = QHBoxLayout()
        head.setContentsMargins(SHADOW, 0, SHADOW, 0)
        head.setSpacing(12)
        head.addWidget(self.back)
        head.addWidget(label("New study", "title"))
        head.addWidget(label("Choose what to begin from. Everything can be changed afterwards.", "body", "text2"))
        head.addStretch()
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.card = Card(padding=20, gap=10)
        self.card.setFixedWidth(SIDE_PX)
        self.title = label("", "card")
        self.about = label("", "body", "text2", wraps=True)
        self.name = QLineEdit()
        self.name.setFont(font("body"))
        self.name.setAccessibleName("Short name of the new study")
        self.name.setPlaceholderText("small letters and digits")
        self.refusal = label("", "label", "bad", wraps=True)
        self.make = ActionButton("plus", "Make study", role="primary", height=44)
        for part in (self.title, self.about, label("Short name", "label"), self.name, self.refusal):
            self.card.column.addWidget(part)
        self.card.column.addStretch()
        self.card.column.addWidget(self.make)
        self.card.column.addWidget(label("Nothing is written until you save it.", "small", "text2"))
        below = QHBoxLayout()
        below.setSpacing(12)
        below.addWidget(self.area, 1)
        below.addWidget(self.card)
        page = QVBoxLayout(self)
        page.setContentsMargins(0, 0, 0, 0)
        page.setSpacing(12)
        page.addLayout(head)
        page.addLayout(below, 1)
        self.make.clicked.connect(self._begin)
        self.name.returnPressed.connect(self._begin)
        self._group.buttonClicked.connect(lambda _button: self._show_choice())
        self._group.buttonToggled.connect(lambda _button, _on: self._show_choice())

    def show_choices(self, choices: tuple[TemplateChoice, ...], chosen: str) -> None:
        """Show what a study can begin from."""
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(SHADOW, 0, 12, 0)
        column.setSpacing(10)
        self.buttons = []
        for heading, copies in (("Templates", False), ("Or a copy of a study, with its comments", True)):
            column.addWidget(label(heading, "card"))
            grid = QGridLayout()
            grid.setSpacing(12)
            for at, choice in enumerate(one for one in choices if one.copy == copies):
                made = TemplateButton(choice)
                self._group.addButton(made)
                grid.addWidget(made, at // ACROSS, at % ACROSS)
                self.buttons.append(made)
            for across in range(ACROSS):
                grid.setColumnStretch(across, 1)
            column.addLayout(grid)
        column.addStretch()
        dress(inside, self.theme)
        self.area.setWidget(inside)
        self.name.clear()
        self.refuse("")
        first = next((button for button in self.buttons if button.choice.source == chosen), self.buttons[0])
        first.setChecked(True)
        self._show_choice()

    def refuse(self, sentence: str) -> None:
        """Say why a study cannot begin so."""
        self.refusal.setText(f"{sentence[:1].upper()}{sentence[1:]}")
        self.refusal.setVisible(bool(sentence))

    def _show_choice(self) -> None:
        chosen = self._chosen()
        if chosen is not None:
            self.title.setText(chosen.title)
            self.about.setText(chosen.description)

    def _chosen(self) -> TemplateChoice | None:
        return next((button.choice for button in self.buttons if button.isChecked()), None)

    def _begin(self) -> None:
        chosen = self._chosen()
        if chosen is not None:
            self.begin_asked.emit(chosen.source, self.name.text().strip())
