"""A new study: what it can begin as at the left, the chosen one with its questions at the right."""

import math
from functools import partial
from typing import Any, Final

from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFontMetricsF,
    QKeyEvent,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QResizeEvent,
)
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import (
    QAbstractButton,
    QButtonGroup,
    QHBoxLayout,
    QLayout,
    QLineEdit,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from study_app.designer.new_study.known_studies import (
    PLANNED,
    SHIPPED,
    KnownAnswer,
    OwnQuestion,
    TemplateChoice,
    languages_offered,
)
from study_app.designer.new_study.new_study import Answers
from study_app.designer.new_study.templates import FOLDER
from study_app.designer.place.header import StudyChoice
from study_app.designer.place.segments import cut_text
from study_app.designer.problems.problems import NameRefusal
from study_app.gui.kit.commands import key_cap, tip
from study_app.gui.kit.dialogs import choose_protocol
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, TANK, font
from study_app.gui.theme.themed import Themed, name_bars, remove_widget, replace_inside
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.boxes import grid as grid_of
from study_app.gui.widgets.cards import SHADOW, Card, Chip, Icon, Rule, fill_rounded, scrolled, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Check, IconButton
from study_app.gui.widgets.labels import clamped, figures, label
from study_app.gui.widgets.main_view import last_focused
from study_app.ids import short_name_of
from study_app.number_text import number_of, typed_numbers

DEEP: Final = "#142E40"


def paint_picture(painter: QPainter, name: str, body: QRectF) -> None:
    """Paint the picture of a template into the upper part of its card: what a participant feels or answers."""
    ground = QPainterPath()
    ground.addRoundedRect(body.adjusted(0, 0, 0, RADIUS_CARD), RADIUS_CARD, RADIUS_CARD)
    painter.save()
    painter.setClipRect(body)
    if name == "questionnaire-only":
        painter.fillPath(ground, QColor(PARTICIPANT.window))
    else:
        water = QLinearGradient(body.topLeft(), body.bottomLeft())
        water.setColorAt(0, QColor(TANK.water_light))
        water.setColorAt(1, QColor(DEEP))
        painter.fillPath(ground, water)
        glass = QColor(TANK.glass)
        glass.setAlpha(70)
        painter.setPen(QPen(glass, 1))
        for high, depth in ((0.12, 2.2), (0.17, 1.6)):
            top, across = body.top() + high * body.height(), [step / 60 for step in range(61)]
            points = (QPointF(body.left() + x * body.width(), top + depth * math.sin(6 * math.pi * x)) for x in across)
            painter.drawPolyline(list(points))
    scale = min(body.width() / 340, body.height() / 180)
    size = QSizeF(340 * scale, 190 * scale)
    picture = QRectF(body.center() - QPointF(size.width() / 2, size.height() / 2), size)
    QSvgRenderer(str(FOLDER / f"{name}.svg")).render(painter, picture)
    painter.restore()


PICTURE_PX, CARD_WORDS_PX, COPY_PX = 150, 132, 76
RING = 4
"""The room around a card for the ring [px]."""


class TemplateButton(Themed, QAbstractButton):
    """One thing to begin from: its picture or icon, title, description and figures.

    ``came`` is emitted when it gets the keyboard; it says whether by a click. ``passed`` asks for the card after it or,
    by -1, before it.
    """

    came = Signal(bool)
    passed = Signal(int)

    def __init__(self, choice: TemplateChoice) -> None:
        super().__init__()
        self.choice = choice
        self.setText(choice.title)
        self.setCheckable(True)
        self.setAccessibleName(f"{'Copy of' if choice.copy else 'Template'} {choice.title}")
        words = ", ".join(words for _, words in choice.figures)
        self.setAccessibleDescription(". ".join(filter(None, (choice.description.rstrip("."), choice.note, words))))
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def picture(self) -> str:
        name = self.choice.source.removeprefix("template:")
        return name if FOLDER.joinpath(f"{name}.svg").exists() and not self.choice.copy else ""

    def sizeHint(self) -> QSize:
        return QSize(200, 2 * RING + (COPY_PX if self.choice.copy else PICTURE_PX + CARD_WORDS_PX))

    @property
    def _wide(self) -> int:
        return self.width() - 2 * RING

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.came.emit(event.reason() == Qt.FocusReason.MouseFocusReason)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Left, Qt.Key.Key_Right}:
            self.passed.emit(1 if event.key() == Qt.Key.Key_Right else -1)
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t, painter = self.theme, smooth_painter(self)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.accent), 2))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CARD + RING, RADIUS_CARD + RING)
        painter.translate(RING, RING)
        body = QRectF(0, 0, self._wide, self.height() - 2 * RING).adjusted(1, 1, -1, -1)
        marked, empty = self.isChecked(), not self.picture and not self.choice.copy
        fill_rounded(painter, body, RADIUS_CARD, t.hover if self.underMouse() or (empty and not marked) else t.surface)
        if self.choice.copy:
            self._paint_copy(painter)
        elif empty:
            self._paint_empty(painter)
        else:
            paint_picture(painter, self.picture, QRectF(1, 1, self._wide - 2, PICTURE_PX))
            self._paint_words(painter, PICTURE_PX)
        style = Qt.PenStyle.DashLine if empty and not marked else Qt.PenStyle.SolidLine
        edge = t.accent if marked else t.ctl if empty else t.border
        painter.setPen(QPen(QColor(edge), 2 if marked else 1, style))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)

    def _paint_words(self, painter: QPainter, top: int) -> None:
        t, wide = self.theme, self._wide - 32
        painter.setPen(QColor(t.text))
        painter.setFont(font("strong"))
        painter.drawText(
            QRectF(16, top + 10, wide, 24),
            Qt.AlignmentFlag.AlignVCenter,
            painter.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, wide),
        )
        painter.setPen(QColor(t.text2))
        painter.setFont(font("label", weight=400))
        words = Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop
        painter.drawText(QRectF(16, top + 36, wide, 56), words, self.choice.description)
        self._paint_figures(painter, top + CARD_WORDS_PX - 32)

    def _paint_figures(self, painter: QPainter, top: int) -> None:
        x = 16.0
        painter.setFont(font("small", weight=500))
        for icon, spoken in self.choice.figures:
            words = spoken.removesuffix(PLANNED)
            draw_icon(painter, icon, QRectF(x, top, 16, 16), self.theme.text2, 1.8)
            painter.setPen(QColor(self.theme.text2))
            painter.drawText(QRectF(x + 22, top - 2, 120, 20), Qt.AlignmentFlag.AlignVCenter, words)
            x += 22 + QFontMetricsF(painter.font()).horizontalAdvance(words) + 16

    def _paint_copy(self, painter: QPainter) -> None:
        t = self.theme
        fill_rounded(painter, QRectF(16, 18, 40, 40), 8, t.sunk)
        draw_icon(painter, "lock" if self.choice.note == SHIPPED else "layers", QRectF(27, 29, 18, 18), t.text2)
        painter.setPen(QColor(t.text))
        wide = self._wide - 80
        painter.setFont(font("label", weight=600))
        lines = clamped(self.text(), 2, painter.font(), wide)
        box = QRectF(68, 8, wide, 36) if len(lines) > 1 else QRectF(68, 16, wide, 22)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, "\n".join(lines))
        painter.setPen(QColor(t.text2))
        painter.setFont(font("small"))
        note = painter.fontMetrics().elidedText(self.choice.note, Qt.TextElideMode.ElideRight, wide)
        painter.drawText(QRectF(68, box.bottom(), wide, 20), Qt.AlignmentFlag.AlignVCenter, note)

    def _paint_empty(self, painter: QPainter) -> None:
        t, middle = self.theme, self._wide / 2
        painter.setPen(QPen(QColor(t.ctl), 1))
        painter.setBrush(QColor(t.surface))
        painter.drawEllipse(QRectF(middle - 22, 78, 44, 44))
        draw_icon(painter, "plus", QRectF(middle - 9, 91, 18, 18), t.text, 2.0)
        painter.setPen(QColor(t.text))
        painter.setFont(font("strong"))
        painter.drawText(QRectF(16, 134, self._wide - 32, 24), Qt.AlignmentFlag.AlignCenter, self.text())
        painter.setPen(QColor(t.text2))
        painter.setFont(font("label", weight=400))
        words = Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        painter.drawText(QRectF(28, 166, self._wide - 56, 80), words, self.choice.description)


TICKS = 4


class RecoveryBar(Themed, QWidget):
    """An axis from 0 with the middle 90 % of what is found as a bar, and the planted value as a line."""

    def __init__(self, shown: KnownAnswer) -> None:
        super().__init__()
        self.shown = shown
        self.setFixedHeight(46)
        self.setAccessibleName("Known answer")
        self.setAccessibleDescription(shown.sentence)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t, painter, shown = self.theme, smooth_painter(self), self.shown
        left, wide = 12.0, self.width() - 44.0

        def place(value: float) -> float:
            return left + wide * value / shown.most

        painter.setPen(QPen(QColor(t.border), 1))
        painter.drawLine(QPointF(left, 28), QPointF(left + wide, 28))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.accent))
        painter.setOpacity(0.45)
        painter.drawRoundedRect(QRectF(place(shown.low), 9, max(4.0, place(shown.high) - place(shown.low)), 12), 6, 6)
        painter.setOpacity(1)
        painter.setPen(QPen(QColor(t.text), 2, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(place(shown.planted), 3), QPointF(place(shown.planted), 28))
        painter.setFont(font("small", tabular=True))
        painter.setPen(QColor(t.text2))
        for tick in range(TICKS + 1):
            value = shown.most * tick / TICKS
            words = f"{value:g} {shown.unit}" if tick == TICKS else f"{value:g}"
            painter.drawText(QRectF(place(value) - 30, 30, 60, 16), Qt.AlignmentFlag.AlignCenter, words)


FIELD_PX, WORDS_PX = 36, 112
NAME_HINT: Final = "small letters and digits"


class Questions(Themed, QWidget):
    """Fields for the answers; ``entered`` when Enter is pressed in one."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._choice: TemplateChoice | None = None
        self.title, self.name = self._field("Title"), self._field("Short name of the new study")
        self._propose()
        self.title.textChanged.connect(self._propose)
        self.languages: dict[str, Check] = {}
        self.own: dict[OwnQuestion, QLineEdit] = {}
        self._grid = grid_of(8, 8, margins=0, parent=self)
        self._grid.setColumnStretch(1, 1)
        for row, (words, field) in enumerate((("Title", self.title), ("Short name", self.name))):
            self._add(row, words, field)
        box = QWidget()
        checks = grid_of(2, 2, margins=0, parent=box)
        for at, (code, name) in enumerate(languages_offered()):
            made = Check(name)
            made.setFont(font("label", weight=400))
            made.setAccessibleName(f"Language {name}")
            made.toggled.connect(self._show_first_texts)
            self.languages[code] = made
            checks.addWidget(made, at // 2, at % 2)
        self.first_texts = label("", "label", "text2", wraps=True)
        checks.addWidget(self.first_texts, checks.rowCount(), 0, 1, 2)
        self._show_first_texts()
        self._grid.addWidget(label("Languages", "label"), 2, 0, 1, 2)
        self._grid.addWidget(box, 3, 0, 1, 2)
        self._own: list[QWidget] = []

    def _field(self, name: str) -> QLineEdit:
        made = QLineEdit()
        made.setFont(font("label", weight=400))
        made.setProperty("dense", "true")
        made.setFixedHeight(FIELD_PX)
        made.setAccessibleName(name)
        made.returnPressed.connect(self.entered)
        return made

    def _add(self, row: int, words: str, field: QWidget) -> QWidget:
        shown = label(words, "label", wraps=True)
        shown.setFixedWidth(WORDS_PX)
        self._grid.addWidget(shown, row, 0)
        self._grid.addWidget(field, row, 1)
        return shown

    def clear(self) -> None:
        self._choice = None
        self.title.clear()
        self.name.clear()

    def show_choice(self, choice: TemplateChoice) -> None:
        """Ask the questions of a template or copy; what was typed as a name stays."""
        before, self._choice = self._choice, choice
        if before is not None and before.source == choice.source:
            return
        self.title.setPlaceholderText(choice.study_title)
        self._propose()
        for code, check in self.languages.items():
            check.setChecked(code in choice.languages)
        for part in self._own:
            remove_widget(part)
        self._own, self.own = [], {}
        for row, question in enumerate(choice.questions, start=4):
            field = self._field(question.words)
            field.setText(question.value)
            field.setToolTip(question.bounds)
            field.setAccessibleDescription(question.bounds)
            beside = QWidget()
            across = hbox((field, 1), spacing=8, margins=0, parent=beside)
            if question.unit:
                across.addWidget(label(question.unit, "label", "text2"))
            self._own += [self._add(row, question.words, beside), beside]
            self.own[question] = field
            name_bars(beside)

    def _propose(self) -> None:
        self.name.setPlaceholderText(self._proposed or NAME_HINT)

    def _show_first_texts(self) -> None:
        """Say in which language the texts begin where none of the template's is chosen."""
        there = () if self._choice is None else self._choice.languages
        chosen = [code for code, check in self.languages.items() if check.isChecked()]
        without = bool(there and chosen) and set(there).isdisjoint(chosen)
        if without:
            self.first_texts.setText(f"The texts begin in {dict(languages_offered())[there[0]]}: translate them.")
        self.first_texts.setVisible(without)

    @property
    def _proposed(self) -> str:
        return short_name_of(self.title.text()) or ("" if self._choice is None else self._choice.name)

    def short_name(self) -> str:
        """Return the short name that was typed, else the one that the title gives, else that of a copy."""
        return self.name.text().strip() or self._proposed

    def answers(self) -> Answers | str:
        """Return the answers, or a sentence about one that cannot be taken."""
        chosen = tuple(code for code, check in self.languages.items() if check.isChecked())
        if not chosen:
            return "choose at least one language"
        values: list[tuple[Any, Any]] = []
        for question, field in self.own.items():
            text = field.text().strip()
            if not text or text == question.value:
                continue
            if not question.several:
                number = number_of(text) if len(text.split()) == 1 else None
                if number is None:
                    return f"{question.words}: “{text}” is not a number"
                values.append((question.path, number))
                continue
            try:
                values.append((question.path, [number for _, number in typed_numbers(text)]))
            except ValueError as unclear:
                return f"{question.words}: {unclear}"
        return Answers(self.title.text().strip(), chosen, tuple(values))


SIDE_PX, SIDE_NARROW_PX, NARROW_BELOW = 400, 330, 1200
LOW_BELOW = 880
ACROSS, COPIES_ACROSS = 3, 4


class NoStudyCard(Card):
    """What is shown while no study is open: drafts to continue (``study_asked``), and the button ``new``."""

    study_asked = Signal(str)

    def __init__(self) -> None:
        super().__init__(padding=28, gap=12)
        self.drafts: list[ActionButton] = []
        self.new = ActionButton("plus", "New study …", cap=key_cap("new"), role="primary")
        self.new.setAccessibleName(tip("new"))
        self.new.setToolTip(tip("new"))
        parts = (
            Icon("designer", "accent", 44),
            label("No study is open", "card"),
            label("Choose a study above, or begin a new one.", "body", "text2"),
            self.new,
        )
        centred = ((part, 0, Qt.AlignmentFlag.AlignHCenter) for part in parts)
        add_parts(self.column, (STRETCH, 2), *centred, (STRETCH, 3))

    def show_studies(self, studies: tuple[StudyChoice, ...]) -> None:
        for old in self.drafts:
            remove_widget(old)
        self.drafts = []
        for study in (one for one in studies if one.drafted):
            made = ActionButton("save", f"Continue {study.title} ({study.file}) with its unsaved changes")
            made.clicked.connect(lambda _on=False, source=study.source: self.study_asked.emit(source))
            name_bars(made)
            self.column.insertWidget(self.column.indexOf(self.new), made, 0, Qt.AlignmentFlag.AlignHCenter)
            self.drafts.append(made)


class ChosenCard(Card):
    """The chosen template: description, session, known answer and questions."""

    def __init__(self) -> None:
        super().__init__(padding=20, gap=10)
        self.questions = Questions()
        self.title = label("", "card")
        self.refusal = NameRefusal("Make")
        self.make = ActionButton("plus", "Make study", cap="Enter", role="primary", height=44)
        inside = QWidget()
        self.about, self.details, self.begin = QWidget(), QWidget(), QWidget()
        _column(self.begin, label("Begin with", "strong"), self.questions)
        parts = (self.about, self.details, self.begin, STRETCH)
        self.inside = vbox(*parts, spacing=10, margins=(0, 0, 8, 0), parent=inside)
        self.area = scrolled(inside)
        foot = label("Nothing is written until you save it.", "small", "text2")
        foot.setAlignment(Qt.AlignmentFlag.AlignCenter)
        add_parts(self.column, self.title, (self.area, 1), self.refusal, self.make, foot)

    def show_choice(self, choice: TemplateChoice) -> None:
        self.title.setText(choice.title)
        before = (self.about, self.details)
        self.about, self.details = QWidget(), QWidget()
        tags = (Chip("neutral", icon, words, small=True) for icon, words in choice.tags)
        described = label(choice.description, "label", "text2", wraps=True)
        _column(self.about, described, hbox(*tags, STRETCH, spacing=8), Rule())
        column = _column(self.details)
        if choice.session:
            column.addWidget(label("The session", "strong"))
        for icon, title, time in choice.session:
            add_layout(column, _step(icon, title, time))
        if choice.session:
            column.addWidget(Rule())
        if choice.recovery is not None:
            good = choice.recovery.recovered
            state = ("ok", "check", "recovered") if good else ("warn", "warning", "not recovered")
            chip = Chip(*state, small=True)  # type: ignore[arg-type]  # a tone
            head = hbox(label("Known answer", "strong"), STRETCH, chip)
            add_parts(
                column,
                head,
                RecoveryBar(choice.recovery),
                label(choice.recovery.sentence, "small", "text2", wraps=True),
                Rule(),
            )
        for old, new in zip(before, (self.about, self.details), strict=True):
            name_bars(new)
            at = self.inside.indexOf(old)
            self.inside.removeWidget(old)
            self.inside.insertWidget(at, new)
            remove_widget(old)
        self.questions.show_choice(choice)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.inside.removeWidget(self.begin)
        self.inside.insertWidget(1 if self.height() < LOW_BELOW else 2, self.begin)


def _column(of: QWidget, *parts: QWidget | QLayout) -> QVBoxLayout:
    return vbox(*parts, spacing=8, margins=0, parent=of)


def _step(icon: str, title: str, time: str) -> QHBoxLayout:
    shown = cut_text(title, "label")
    return hbox(Icon(icon, "text2", 16), (shown, 1), figures(time, "label", "text2"), spacing=10)


class NewStudyPage(Themed, QWidget):
    """Signals: ``begin_asked`` (source, name, answers), ``copy_asked`` (a file to copy), ``given_up``."""

    begin_asked = Signal(str, str, object)
    copy_asked = Signal(str)
    given_up = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.buttons: list[TemplateButton] = []
        self._choices: tuple[TemplateChoice, ...] = ()
        self._group = QButtonGroup(self)
        self.back = IconButton("chevron_left", "Back", role="plain")
        self.back.clicked.connect(self.given_up)
        aside = cut_text("Choose what you want to find out. Everything can be changed afterwards.", "label", "text2")
        self.file = ActionButton("file", "From a file …")
        self.file.clicked.connect(self._open_file)
        parts = (self.back, label("New study", "title"), (aside, 1), self.file)
        head = hbox(*parts, spacing=12, margins=(SHADOW, 0, SHADOW, 0))
        self.area = scrolled(QWidget())
        self.card = ChosenCard()
        self.name, self.make, self.refusal = self.card.questions.name, self.card.make, self.card.refusal
        vbox(head, (hbox((self.area, 1), self.card, spacing=12), 1), spacing=12, margins=0, parent=self)
        self.card.make.clicked.connect(self._begin)
        self.card.questions.entered.connect(self._begin)
        self.card.refusal.chosen.connect(self._take_name)
        self._group.buttonToggled.connect(lambda _button, on: self._show_choice() if on else None)

    def show_choices(self, choices: tuple[TemplateChoice, ...], chosen: str) -> None:
        self._choices = choices
        inside = QWidget()
        column = vbox(spacing=12, margins=(0, 0, 12 - RING, 0), parent=inside)
        self.buttons = []
        for heading, aside, copies, across in (
            ("Templates", "", False, ACROSS),
            ("Or a copy of a study", "with its comments; the original stays as it is", True, COPIES_ACROSS),
        ):
            words = label(heading, "card"), label(aside, "small", "text2")
            add_layout(column, hbox(*words, STRETCH, spacing=10, margins=(RING, 0, 0, 0)))
            grid = grid_of(14 - 2 * RING, 14 - 2 * RING)
            columns = across if self.width() >= NARROW_BELOW else 2
            for at, choice in enumerate(one for one in choices if one.copy == copies):
                made = TemplateButton(choice)
                made.came.connect(partial(self._come, made))
                made.passed.connect(partial(self._pass, made))
                self._group.addButton(made)
                grid.addWidget(made, at // columns, at % columns)
                self.buttons.append(made)
            for one in range(columns):
                grid.setColumnStretch(one, 1)
            add_layout(column, grid)
        column.addStretch()
        name_bars(inside)
        replace_inside(self.area, inside)
        self.refuse("")
        first = next((button for button in self.buttons if button.choice.source == chosen), self.buttons[0])
        for button in self.buttons:  # Tab goes to the chosen one, and arrows to the others
            button.setFocusPolicy(Qt.FocusPolicy.StrongFocus if button is first else Qt.FocusPolicy.ClickFocus)
        first.setChecked(True)
        QTimer.singleShot(0, first, lambda: self.area.ensureWidgetVisible(first))  # once it has its place

    def _come(self, button: TemplateButton, by_mouse: bool) -> None:
        """Show the card that the keyboard came to; after a click the keyboard stays in the questions."""
        if by_mouse:
            (last_focused(self.card) or self.card.questions.title).setFocus()
        else:
            self.area.ensureWidgetVisible(button)

    def _pass(self, button: TemplateButton, by: int) -> None:
        to = self.buttons.index(button) + by
        if 0 <= to < len(self.buttons):
            self.buttons[to].setChecked(True)
            self.buttons[to].setFocus(Qt.FocusReason.OtherFocusReason)

    def refuse(self, sentence: str, free: str = "") -> None:
        self.card.refusal.show_refusal(sentence, free)

    def _take_name(self, name: str) -> None:
        self.card.questions.name.setText(name)
        self._begin()

    def _open_file(self) -> None:
        if chosen := choose_protocol(self, "Copy a study"):
            self.copy_asked.emit(chosen)

    def _show_choice(self) -> None:
        chosen = self._chosen()
        if chosen is not None:
            self.refuse("")
            self.card.show_choice(chosen)

    def _chosen(self) -> TemplateChoice | None:
        return next((button.choice for button in self.buttons if button.isChecked()), None)

    def _begin(self) -> None:
        chosen, answers = self._chosen(), self.card.questions.answers()
        if isinstance(answers, str):
            self.refuse(f"{answers}.")
        elif chosen is not None:
            self.begin_asked.emit(chosen.source, self.card.questions.short_name(), answers)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        begins = isinstance(self.focusWidget(), Check | TemplateButton)
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter} and begins:
            self._begin()
        elif event.key() == Qt.Key.Key_Escape:
            self.given_up.emit()
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        narrow = self.width() < NARROW_BELOW
        self.card.setFixedWidth(SIDE_NARROW_PX if narrow else SIDE_PX)
        if self._choices and (event.oldSize().width() < NARROW_BELOW) != narrow:
            chosen = self._chosen()
            self.show_choices(self._choices, "" if chosen is None else chosen.source)
