"""The base classes of question widgets, which show the question at one side and its answer at the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple, TypeAlias

from PySide6.QtCore import QEvent, QPoint, QRect, QRectF, QSignalBlocker, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QColor,
    QEnterEvent,
    QFocusEvent,
    QFont,
    QFontMetrics,
    QFontMetricsF,
    QImage,
    QInputDevice,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
)
from PySide6.QtWidgets import QButtonGroup, QCheckBox, QRadioButton, QSizePolicy, QStyle, QWidget

from study_app.gui.key_presses import digit_of
from study_app.gui.participant.pages.page_widget import Button, line_start, page_painter, point_screen_reader_at
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font
from study_app.gui.widgets.accessible import announce, give_role
from study_app.gui.widgets.boxes import grid
from study_app.protocol.questions import ItemView, Value
from study_app.protocol.wording import Words

if TYPE_CHECKING:
    Widget = QWidget
else:
    Widget = object

_MAX_HEIGHT = 2000  # of wrapped text [px]


class _QuestionText(QWidget):
    """The number, text and note of a question in a single widget, since a page has many questions.

    The number has its own column, so that the texts of all questions are aligned. If the answer is missing, a sign
    precedes the note.
    """

    def __init__(self, number: int, text: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.text, self.note, self.missing = text, "", False
        self._number = str(number)
        self._number_width = 0
        self._faces = (QFont(), QFont(), QFont())
        self._sign, self._sign_gap = 0.0, 0.0
        self._cached_heights: dict[int, tuple[int, int]] = {}  # heights by width
        policy = QSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)

    def fill_row(self) -> None:
        """Fill a row of fixed height, without a minimum size."""
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)

    def show_note(self, note: str, *, missing: bool) -> None:
        """Show a note below the text, or none; ``missing`` marks it with a sign and a colour."""
        if (note, missing) != (self.note, self.missing):
            self.note, self.missing = note, missing
            self._forget_sizes()

    def set_fonts(self, text: QFont, note: QFont, number: QFont, sign_gap: float) -> None:
        """Set the fonts, and the gap after the sign [px]."""
        if (text, note, number) == self._faces:
            return
        self._faces, self._sign_gap = (text, note, number), sign_gap
        self._sign = QFontMetricsF(note).height() - 1
        self._forget_sizes()

    def set_number_width(self, width: int) -> None:
        """Set the width of the number's column [px]."""
        if width != self._number_width:
            self._number_width = width
            self._forget_sizes()

    def sizeHint(self) -> QSize:
        """Return the minimum size; the width is a fraction of the row and determines the height."""
        return self.minimumSizeHint()

    def minimumSizeHint(self) -> QSize:
        if not self.sizePolicy().hasHeightForWidth():
            return QSize(0, 0)
        text, note, _ = self._faces
        longest = self._note_left + self._bounds(note, self.note, 0).width()
        return QSize(self._number_width + max(longest, self._bounds(text, self.text, 0).width()), 0)

    def heightForWidth(self, width: int) -> int:
        return sum(self._heights(width))

    def paintEvent(self, _event: QPaintEvent) -> None:
        width, left = self.width(), self._number_width
        text_height, note_high = self._heights(width)
        top = (self.height() - text_height - note_high + 1) // 2
        painter = page_painter(self)
        painter.setLayoutDirection(Qt.LayoutDirection.LayoutDirectionAuto)  # the text has its own language's direction
        ink = PARTICIPANT.warn if self.missing else PARTICIPANT.text3
        note_top, note_left = top + text_height, left + self._note_left
        text_face, note_face, number_face = self._faces
        for face, colour, place, text in (
            (number_face, ink, QRect(0, top, left, text_height), self._number),
            (text_face, PARTICIPANT.text, QRect(left, top, width - left, text_height), self.text),
            (note_face, ink, QRect(note_left, note_top, width - note_left, note_high), self.note),
        ):
            painter.setFont(face)
            painter.setPen(QColor(colour))
            painter.drawText(self._mirror_place(place), self._text_flags, text)
        if self.missing:
            room = self._mirror_place(
                QRect(left, note_top + (note_high - round(self._sign)) // 2, self._note_left, note_high)
            )
            mirrored = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
            x = room.right() - self._sign if mirrored else room.left()
            draw_icon(painter, "warning", QRectF(x, room.top(), self._sign, self._sign), PARTICIPANT.warn)
        painter.end()

    @property
    def _text_flags(self) -> int:
        return int(line_start(self) | Qt.AlignmentFlag.AlignTop) | int(Qt.TextFlag.TextWordWrap)

    @property
    def _note_left(self) -> int:
        """The distance of the note from the number's column, which the sign needs [px]."""
        return round(self._sign + self._sign_gap) if self.missing else 0

    def _mirror_place(self, place: QRect) -> QRectF:
        return QRectF(QStyle.visualRect(self.layoutDirection(), self.rect(), place))

    def _bounds(self, face: QFont, text: str, width: int) -> QRect:
        return QFontMetrics(face).boundingRect(0, 0, width, _MAX_HEIGHT, self._text_flags, text)

    def _heights(self, width: int) -> tuple[int, int]:
        """Return the height of number and text, and that of the note [px]."""
        if width not in self._cached_heights:
            self._cached_heights[width] = self._measure_heights(width)
        return self._cached_heights[width]

    def _measure_heights(self, width: int) -> tuple[int, int]:
        text, note, number = self._faces
        room = width - self._number_width
        text_height = max(self._bounds(text, self.text, room).height(), QFontMetrics(number).height())
        if not self.note:
            return text_height, 0
        note_high = self._bounds(note, self.note, room - self._note_left).height()
        return text_height, max(note_high, round(self._sign)) if self.missing else note_high

    def _forget_sizes(self) -> None:
        self._cached_heights.clear()
        self.updateGeometry()
        self.update()


_LEAST_TARGET = 44.0  # minimum size of clickable parts [logical px]


def target_px(scale: float) -> float:
    """Return the minimum height and width of clickable parts, regardless of the text size [logical px]."""
    return _LEAST_TARGET * max(1.0, scale)


WORDS_SHARE, ANSWER_SHARE = 5, 6
MARGIN = 16.0
_NUMBER_WIDTH = 32.0
_NOTE_GAP = 5.0


class QuestionField(QWidget):
    """A question and its answer; it is a single Tab stop, and for screen readers a group of its answers.

    ``answered(value)`` is emitted when an answer is given or changed, ``retracted`` when an entry was emptied, ``left``
    when a key has answered the question, so that the next one can get the focus, and ``seen`` when it is first painted.
    """

    ANSWER: ClassVar[int] = 2
    """The column of the answer in ``grid``."""
    widget_id: ClassVar[str] = ""
    last = False
    """Whether the question is the last of its part, which has no line below it."""

    answered = Signal(object)
    retracted = Signal()
    left = Signal()
    seen = Signal()

    def __init__(self, view: ItemView, wording: Words, parent: QWidget) -> None:
        super().__init__(parent)
        self.view = view
        self.value: Value = None
        self.is_answered = False
        self.missing = False
        self._words = wording
        self._seen = False
        self._answer: QWidget | None = None
        self.scale = 1.0
        give_role(self, QAccessible.Role.Grouping)
        self.statement = _QuestionText(view.number, view.text, self)
        self.grid = grid(0, parent=self)
        self.grid.addWidget(self.statement, 0, 0)
        self.grid.setColumnStretch(0, WORDS_SHARE)
        self.grid.setColumnStretch(self.ANSWER, ANSWER_SHARE)
        self.setAccessibleName(f"{view.number}. {view.text}")
        self._update_state()

    @property
    def note(self) -> str:
        if self.missing:
            return self._words.please_answer
        return "" if self.view.required else self._words.optional

    @property
    def answer_keys(self) -> str:
        return self.view.keys

    def put_answer_part(self, answer: QWidget) -> None:
        """Insert the widget with the answer after the question's text."""
        self._answer = answer
        self.grid.addWidget(answer, 0, self.ANSWER, Qt.AlignmentFlag.AlignVCenter)

    def show_answer(self, value: Value) -> None:
        self.set_answer(value)

    def spoken_answer(self) -> str:
        return str(self.value)

    def finish(self) -> bool:
        """Accept typed text; return whether it is a valid answer."""
        return True

    def set_scale(self, scale: float) -> None:
        self.scale = scale
        self.set_fonts(font("statement", scale=scale), font("label", scale=scale, weight=600), scale)
        margin, gap = self.horizontal_margin, round(8 * scale)
        self.grid.setContentsMargins(margin, gap, margin, gap)
        self.set_column_widths(_NUMBER_WIDTH * scale, 24 * scale)

    @property
    def horizontal_margin(self) -> int:
        """The margin at the row's left and right edges [px]."""
        return round(MARGIN * self.scale)

    def set_fonts(self, statement: QFont, note: QFont, scale: float) -> None:
        """Set the fonts of statement and note; the number has the same size in all rows of a page."""
        number = font("cell", scale=scale * 0.9, weight=700 if self.missing else 400)
        self.statement.set_fonts(statement, note, number, _NOTE_GAP * scale)

    def set_column_widths(self, number: float, after: float) -> None:
        """Set the width of the number's column and the space after the text [px]."""
        self.statement.set_number_width(round(number))
        self.grid.setColumnMinimumWidth(1, round(after))

    def height_in(self, width: int, room: int) -> int:
        """Return the height that text, note and answer need at a width, if ``room`` is available [px]."""
        self.statement.show_note(self.note or self._words.please_answer, missing=True)  # as after Continue
        if self._answer is not None:
            self._answer.updateGeometry()  # the layout caches its size hint
        self.grid.invalidate()
        height = self.grid.totalHeightForWidth(width)
        self._update_state()
        return height

    def point_at(self, place: int) -> None:
        """Point at an answer, or at none (-1); overridden by questions with options."""

    def set_missing(self, *, missing: bool) -> None:
        self.missing = missing and not self.is_answered
        self._update_state()

    def give_answer(self, value: Value) -> None:
        """Set the answer, and emit ``answered`` if it has changed."""
        changed = not self.is_answered or value != self.value
        self.value, self.is_answered, self.missing = value, True, False
        self._update_state()
        if changed:
            announce(self, self.accessibleDescription())
            self.answered.emit(value)

    def retract_answer(self) -> None:
        if self.is_answered:
            self.value, self.is_answered = None, False
            self._update_state()
            self.retracted.emit()

    def forget_answer(self) -> None:
        """Discard the answer without a signal, because another answer has hidden the question."""
        self.value, self.is_answered, self.missing = None, False, False
        self.clear_answer()
        self._update_state()

    def clear_answer(self) -> None:
        """Show no answer; overridden by fields that do not paint `value`."""

    def set_answer(self, value: Value) -> None:
        """Set the answer without a signal."""
        self.value, self.is_answered, self.missing = value, True, False
        self._update_state()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        self._paint_ground(painter)
        painter.end()
        if not self._seen and self.window().isVisible():
            self._seen = True
            self.seen.emit()

    def _contains_focus(self) -> bool:
        focused = self.window().focusWidget()
        return focused is not None and (focused is self or self.isAncestorOf(focused))

    def _paint_ground(self, painter: QPainter) -> None:
        theme, scale = PARTICIPANT, self.scale
        ring = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        focus = self._contains_focus()
        if focus or self.missing:
            painter.setPen(QPen(QColor(theme.accent), 2) if focus else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.selected))
            painter.drawRoundedRect(ring, 10 * scale, 10 * scale)
        elif not self.last:
            painter.setPen(QPen(QColor(theme.grid), 1))
            y = self.height() - 0.5
            painter.drawLine(round(MARGIN * scale), round(y), round(self.width() - MARGIN * scale), round(y))
        if self.missing:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.warn))
            flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
            left = self.width() - 8 * scale if flip else 4 * scale
            bar = QRectF(left, self.height() * 0.19, 4 * scale, self.height() * 0.62)
            painter.drawRoundedRect(bar, 2 * scale, 2 * scale)

    def _update_state(self) -> None:
        wording = self._words
        self.statement.show_note(self.note, missing=self.missing)
        if self.is_answered:
            state = f"{wording.chosen}: {self.spoken_answer()}"
        else:
            state = (self.note or wording.please_answer) if self.missing else wording.no_answer_yet
        if self.note and not self.missing:
            state = f"{self.note}, {state}"
        self.setAccessibleDescription(state)
        self.update()


def question_of(part: QWidget) -> QuestionField | None:
    """Return the question that contains a widget."""
    widget: QWidget | None = part
    while widget is not None and not isinstance(widget, QuestionField):
        widget = widget.parentWidget()
    return widget


_CENTRE = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
_MARK = 19.0
ROOM = 14.0  # between edge and text
_TAKEN = _MARK + 6 + ROOM  # width of mark and margins
NO_WORDS = "–"
_EXPANDING = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
Look: TypeAlias = Literal["words", "point", "off scale"]
"""An option with a text, a point of a scale, or an answer off the scale, which has a dashed edge."""


@lru_cache(maxsize=1024)
def _widest_word(text: str, scale: float) -> float:
    """Return the width of an answer's widest word [px]; cached, since rows repeat their points."""
    metrics = QFontMetricsF(font("chosen", scale=scale))
    return max((metrics.horizontalAdvance(word) for word in text.split()), default=0.0)


@lru_cache(maxsize=1024)
def _size_of(text: str, scale: float) -> QSize:
    """Return the size of an answer, which fits its longest word and is large enough to be clicked [px]."""
    target = target_px(scale)
    return QSize(round(max(target, _widest_word(text, scale) + _TAKEN * scale)), round(target))


@lru_cache(maxsize=1024)
def _height_of(text: str, scale: float, width_px: float) -> float:
    """Return the height of an answer wrapped at a width [px]."""
    room = QRectF(0, 0, width_px, 1e4)
    return QFontMetricsF(font("chosen", scale=scale)).boundingRect(room, _CENTRE, text).height()


class _UnchosenLook(NamedTuple):
    """The appearance of an answer that is not chosen; sizes in px."""

    words: str
    look: Look
    scale: float
    width: int
    height: int
    pointed: bool
    strong: bool

    def paint(self, painter: QPainter) -> None:
        theme, scale, pointed = PARTICIPANT, self.scale, self.pointed
        inset = 0.75 if pointed else 0.5
        body = QRectF(0, 0, self.width, self.height).adjusted(inset, inset, -inset, -inset)
        edge = QPen(QColor(theme.text if pointed else theme.ctl), 1.5 if pointed else 1.0)
        is_hollow = self.look == "off scale" and not pointed
        if is_hollow:
            edge.setDashPattern([3, 3])
        painter.setPen(edge)
        painter.setBrush(Qt.BrushStyle.NoBrush if is_hollow else QColor(theme.hover if pointed else theme.surface))
        painter.drawRoundedRect(body, RADIUS_CONTROL * scale, RADIUS_CONTROL * scale)
        painter.setFont(font("cell", scale=scale))
        painter.setPen(QColor(theme.text if self.strong else theme.text2))
        painter.drawText(body.adjusted(4, 0, -4, 0), _CENTRE, self.words)


@lru_cache(maxsize=256)
def _answer_picture(look: _UnchosenLook, ground: str) -> QImage:
    """Return the picture of an answer that is not chosen, on the background ``ground``."""
    image = QImage(look.width, look.height, QImage.Format.Format_RGB32)
    image.fill(QColor(ground))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    look.paint(painter)
    painter.end()
    return image


class OptionLook(Button):
    """The appearance of an answer; its whole rectangle is clickable, and shape, fill and check mark show the choice.

    ``place`` is the index among the answers of the question, which is notified when the pointer enters or leaves.
    """

    place = -1

    def __init__(
        self, text: str, name: str, description: str, parent: QWidget | None = None, *, look: Look = "words"
    ) -> None:
        super().__init__(parent)
        self._words = text
        self._look = look
        self._scale = 1.0
        self.pointed = False
        self.setAccessibleName(name)
        self.setAccessibleDescription(description)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # the question has the keyboard focus
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(_EXPANDING)

    def set_scale(self, scale: float) -> None:
        self._scale = scale
        self.updateGeometry()
        self.update()

    def show_pointed(self, pointed: bool) -> None:
        """Show whether mouse or keyboard point at this answer."""
        if pointed != self.pointed:
            self.pointed = pointed
            self.update()

    def hitButton(self, position: QPoint) -> bool:
        return self.rect().contains(position)

    def sizeHint(self) -> QSize:
        return _size_of(self._words, self._scale)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def hasHeightForWidth(self) -> bool:
        """Return whether the text wraps; points of a scale are too short to wrap."""
        return self._look != "point"

    def heightForWidth(self, width: int) -> int:
        needed = _height_of(self._words, self._scale, max(1.0, width - _TAKEN * self._scale))
        return round(max(target_px(self._scale), needed + 12 * self._scale))

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self._notify_question(self.place)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._notify_question(-1)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        super().mouseReleaseEvent(event)
        if event.device().type() == QInputDevice.DeviceType.TouchScreen:
            self._notify_question(-1)

    def _notify_question(self, place: int) -> None:
        if (question := question_of(self)) is not None:
            question.point_at(place)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the answer; pictures of points are cached, since they look the same in all questions."""
        painter = page_painter(self)
        in_focus = self._has_focus()
        strong = self._look == "words" or self.pointed or in_focus
        look = _UnchosenLook(self._words, self._look, self._scale, self.width(), self.height(), self.pointed, strong)
        if self.isChecked():
            self._paint_chosen(painter)
        elif self._look == "point" and self.devicePixelRatioF() == 1 and self.window().graphicsProxyWidget() is None:
            question = question_of(self)
            lit = in_focus or (question is not None and question.missing)
            painter.drawImage(0, 0, _answer_picture(look, PARTICIPANT.selected if lit else PARTICIPANT.window))
        else:
            look.paint(painter)
        painter.end()

    def _has_focus(self) -> bool:
        focused = self.window().focusWidget()
        return focused is not None and focused.isAncestorOf(self)

    def _paint_chosen(self, painter: QPainter) -> None:
        theme, scale = PARTICIPANT, self._scale
        text = "" if self._words == NO_WORDS else self._words
        body = QRectF(self.rect())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.accent))
        radius = body.height() / 2 if self._look != "words" else min(body.height() / 2, target_px(scale) / 2)
        painter.drawRoundedRect(body, radius, radius)
        face = font("chosen", scale=scale)
        mark = min(_MARK * scale, body.width() * 0.34)
        gap = min(6 * scale, body.width() * 0.06) if text else 0.0
        room = QRectF(0, 0, max(1.0, body.width() - mark - gap - ROOM * scale), body.height())
        width = QFontMetricsF(face).boundingRect(room, _CENTRE, text).width()
        left = body.center().x() - (mark + gap + width) / 2
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        mark_x, text_x = (left + width + gap, left) if flip else (left, left + mark + gap)
        draw_icon(painter, "check", QRectF(mark_x, body.center().y() - mark / 2, mark, mark), theme.on_accent, 2.4)
        painter.setFont(face)
        painter.setPen(QColor(theme.on_accent))
        painter.drawText(QRectF(text_x - 1, 0, width + 2, body.height()), _CENTRE, text)


class RadioOption(OptionLook, QRadioButton):
    """An answer that excludes the others."""


class CheckOption(OptionLook, QCheckBox):
    """An answer that can be combined with others."""


_MOST_DIGITS = 9


class OptionsField(QuestionField):
    """A question with options, which digits, mouse and touch choose; arrows move a pointer, at which Space chooses.

    ``pointed_at(place)`` carries the index of the option at which mouse or keyboard point, -1 for none.
    """

    several = False
    options: Sequence[OptionLook] = ()
    pointed = -1

    pointed_at = Signal(int)

    def set_options(self, options: Sequence[OptionLook]) -> None:
        self.options = options
        self._group = QButtonGroup(self, exclusive=not self.several)
        # Connecting the methods themselves would make Qt forget the role of this widget (`give_role`).
        self._group.idClicked.connect(lambda place: self._choose_by_click(place))  # noqa: PLW0108
        self._group.idToggled.connect(lambda place, on: self._toggle(place, on))  # noqa: PLW0108
        for place, option in enumerate(options):
            self._group.addButton(option, place)
            option.place = place
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    @property
    def digits(self) -> int:
        return min(_MOST_DIGITS, len(self.options))

    @property
    def forward(self) -> int:
        """The direction of the key →: 1 for the next option, -1 for the previous one."""
        return 1

    @property
    def chosen(self) -> tuple[int, ...]:
        raise NotImplementedError

    def value_at(self, place: int) -> Value:
        raise NotImplementedError

    def show_answer(self, value: Value) -> None:
        self.set_answer(value)
        self._check()

    def clear_answer(self) -> None:
        self._group.setExclusive(False)
        self._check()
        self._group.setExclusive(not self.several)

    def set_scale(self, scale: float) -> None:
        super().set_scale(scale)
        for option in self.options:
            option.set_scale(scale)

    def point_at(self, place: int) -> None:
        """Point at the option with an index, or at none (-1)."""
        if place == self.pointed:
            return
        self.pointed = place
        for number, option in enumerate(self.options):
            option.show_pointed(number == place)
        self.pointed_at.emit(place)

    def choose(self, place: int, *, by_key: bool) -> None:
        """Answer with an option; after an answer ``by_key``, the next question gets the focus."""
        self.give_answer(self.value_at(place))
        self._check()
        point_screen_reader_at(self.options[place])
        if by_key:
            self.left.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose with digits and Space, and point with left and right; the page handles other keys."""
        number = digit_of(event)
        has_no_control = not event.modifiers() & Qt.KeyboardModifier.ControlModifier
        if number is not None and 1 <= number <= self.digits and has_no_control:
            self.choose(number - 1, by_key=True)
        elif event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            self._point_by(self.forward if event.key() == Qt.Key.Key_Right else -self.forward)
        elif event.key() == Qt.Key.Key_Space:
            if self.pointed >= 0:
                self.choose(self.pointed, by_key=True)
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.point_at(-1)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def _check(self) -> None:
        with QSignalBlocker(self._group):
            for place, option in enumerate(self.options):
                option.setChecked(place in self.chosen)

    def _choose_by_click(self, place: int) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if not self.several:
            self.choose(place, by_key=False)

    def _toggle(self, place: int, on: bool) -> None:
        """Choose an option that was checked by a click or a screen reader."""
        if on != (place in self.chosen) and (on or self.several):
            self.choose(place, by_key=False)

    def _point_by(self, by: int) -> None:
        start = self.pointed
        if start < 0:
            start = self.chosen[0] if self.chosen else (-1 if by > 0 else len(self.options))
        self.point_at(min(max(start + by, 0), len(self.options) - 1))
        announce(self.options[self.pointed], self.options[self.pointed].accessibleName())


class ScaleField(OptionsField):
    """A question with a row of points and, separately at the end, "cannot judge"."""

    labels: tuple[str, ...] = ()

    def build_options(self, labels: tuple[str, ...], judge_name: str | None, judge_text: str | None) -> None:
        """Create the options: the points of the scale, and the off-scale answer if there is one."""
        self.labels = labels
        names = [f"{point} {label}" for point, label in enumerate(labels, start=1)]
        text = self.view.text
        self.points = [RadioOption(str(n), name, text, self, look="point") for n, name in enumerate(names, start=1)]
        self.judge = None
        if judge_name is not None:
            self.judge = RadioOption(judge_text or "", judge_name, text, self, look="off scale")
        self.set_options([*self.points, *([] if self.judge is None else [self.judge])])

    @property
    def digits(self) -> int:
        """The number of points that digits choose; the off-scale answer has no digit."""
        return min(_MOST_DIGITS, len(self.labels))

    @property
    def answer_keys(self) -> str:
        """The digits of the points; arrows reach points beyond 9."""
        return f"1–{self.digits}"

    @property
    def chosen(self) -> tuple[int, ...]:
        if not self.is_answered:
            return ()
        return (self.value - 1 if isinstance(self.value, int) else len(self.points),)

    def value_at(self, place: int) -> Value:
        """Return the number of the point, or None for the off-scale answer."""
        return place + 1 if place < len(self.points) else None

    def spoken_answer(self) -> str:
        return self.options[self.chosen[0]].accessibleName()


ENTER = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_VERTICAL = (Qt.Key.Key_Up, Qt.Key.Key_Down)


class EntryKeys(Widget):
    """A text widget that leaves Esc to the window and some keys to the page, and updates its question's focus ring."""

    def is_left_to_page(self, event: QKeyEvent) -> bool:
        """Return whether the page handles a key, because it has no meaning in the field."""
        return event.key() in (*ENTER, *_VERTICAL)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        escape = event.key() == Qt.Key.Key_Escape
        if escape and (question := question_of(self)) is not None:
            question.finish()  # now, since a pause will replace the page
        if escape or self.is_left_to_page(event):
            event.ignore()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if (question := question_of(self)) is not None:
            question.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if (question := question_of(self)) is not None:
            question.finish()
            question.update()


class TypedField(QuestionField):
    """A question with a typed answer, which is accepted when typing pauses or the question loses the focus."""

    def set_entry(self, entry: QWidget, wait_ms: int, accept: Callable[[], object]) -> None:
        """Make ``entry`` the question's entry; call ``accept`` when typing has paused for ``wait_ms``."""
        self.setFocusProxy(entry)
        self._timer = QTimer(self, singleShot=True, interval=wait_ms)
        self._timer.timeout.connect(accept)

    def typed_text(self) -> str:
        raise NotImplementedError

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in ENTER and self.typed_text():
            if self.finish():
                self.left.emit()
        else:
            super().keyPressEvent(event)
