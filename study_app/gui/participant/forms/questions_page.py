"""A page of questions, divided into parts if they do not fit: the base of questionnaires, and forms."""

from __future__ import annotations

import math
from collections.abc import Sequence

from PySide6.QtCore import QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QAccessible, QColor, QFont, QFontMetrics, QFontMetricsF, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QLayout, QPushButton, QStyle, QWidget

from study_app.discovery import by_name
from study_app.gui.key_presses import key_presses
from study_app.gui.participant.forms.question_field import MARGIN, QuestionField, question_of, target_px
from study_app.gui.participant.forms.questions import FIELDS
from study_app.gui.participant.pages.page_widget import (
    GoButton,
    PageContext,
    PageWidget,
    ProgressLine,
    draw_key,
    key_size,
    line_start,
    page_painter,
)
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.accessible import HeadingLabel, PlainLabel, announce, give_role
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.protocol.questions import ItemView, shown_questions
from study_app.protocol.wording import Words
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown, Retracted, Submitted

_MARK = 22.0
_MOVE_KEYS = "↑ ↓"
_LINE = 1  # height of the line above the foot [px]
_GAP = 9.0
_MAX_EXTENT = 2000  # of wrapped text [px]
_WRAPPED = int(Qt.TextFlag.TextWordWrap)


class _Foot(QWidget):
    """The foot of a page: message, key hints, which are hidden if the message needs their space, count and button."""

    def __init__(self, wording: Words, parent: QWidget) -> None:
        super().__init__(parent)
        self._words = wording
        self._scale = 1.0
        self._message, self._count, self._answer_keys = "", "", ""
        self.button = GoButton(wording.continue_, wording.enter_key, self)
        self._row = hbox((STRETCH, 1), self.button, parent=self)
        give_role(self, QAccessible.Role.StaticText)

    def set_scale(self, scale: float, margin: int, *, tight: bool) -> None:
        self._scale = scale
        self._strong = font("statement", scale=scale, weight=600)
        self._small = font("body", scale=scale * 0.94)
        self._tabular = font("cell", scale=scale * 0.95)
        self.button.set_scale(scale * (0.95 if tight else 1.0))
        self._row.setContentsMargins(margin, _LINE, margin - 4, 0)
        self.setFixedHeight(_LINE + round((72 if tight else 96) * scale))
        self.update()

    def show_state(self, message: str, done: int, of: int, keys: str) -> None:
        self._message, self._answer_keys = message, keys
        self._count = self._words.answered.format(done=done, of=of)
        kept = self._words.answers_kept if message else ""
        hints = ((_MOVE_KEYS, self._words.key_move), (keys, self._words.key_answer)) if keys else ()
        self.setAccessibleName(" ".join(filter(None, (message, kept, self._count))))
        self.setAccessibleDescription(", ".join(f"{key} {text}" for key, text in hints))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the line and, below it from its end, the count of answers, the keys and the message."""
        painter = page_painter(self)
        painter.setLayoutDirection(Qt.LayoutDirection.LayoutDirectionAuto)  # the text has its own language's direction
        painter.fillRect(0, 0, self.width(), _LINE, QColor(PARTICIPANT.border))
        gap = round(_GAP * self._scale)
        line = self._row.contentsRect()
        end = self._paint_count(painter, line.right() + 1 - self.button.width() - gap)
        room = end - 2 * gap - line.left()
        room_after_sign = room - round(_MARK * self._scale) - gap
        kept_width = QFontMetricsF(self._small).horizontalAdvance(self._words.answers_kept)
        message_width = QFontMetricsF(self._strong).horizontalAdvance(self._message) + 4
        needed = max(message_width, kept_width) if self._message else 0.0
        end = self._paint_keys(painter, end - gap, room_after_sign - needed if self._message else room)
        if self._message:
            lines = math.ceil(needed / max(1.0, room_after_sign))
            height = lines * QFontMetricsF(self._strong).height() + QFontMetricsF(self._small).height()
            kept = kept_width <= room_after_sign and height <= self.height() - _LINE
            self._paint_message(painter, end - gap, kept=kept)
        painter.end()

    def _paint_count(self, painter: QPainter, end: int) -> int:
        """Draw the count of answers up to ``end``; return its start [px]."""
        left_gap, right_gap = round(14 * self._scale), round(4 * self._scale)
        width = left_gap + self._width(self._tabular, self._count) + right_gap
        place = self._place_in_line(end - width, width).adjusted(left_gap, 0, -right_gap, 0)
        self._draw_text(painter, place, self._count, self._tabular, PARTICIPANT.text2)
        return end - width

    def _paint_keys(self, painter: QPainter, end: int, room: float) -> int:
        """Draw the key hints up to ``end`` if they fit ``room``; return their start [px]."""
        gap, wording = round(_GAP * self._scale), self._words
        hints = ((_MOVE_KEYS, wording.key_move), (self._answer_keys, wording.key_answer))
        caps = [round(key_size(key, self._scale)[0]) + 2 for key, _ in hints]
        line = self._row.contentsRect()
        height = round(key_size(_MOVE_KEYS, self._scale)[1]) + 2
        middle = line.top() + (line.height() - height) // 2 + height / 2
        widths = [self._width(self._small, text) for _, text in hints]
        if not self._answer_keys or sum(caps) + sum(widths) + 6 * gap > room:
            return end + gap
        for (key, text), cap, width in zip(hints, caps, widths, strict=True):
            self._draw_text(painter, self._place_in_line(end - width, width), text, self._small, PARTICIPANT.text2)
            end -= width + gap
            draw_key(painter, self._place_in_line(end - cap, cap).left() + 1, middle, key, self._scale)
            end -= cap + gap
        return end + gap

    def _paint_message(self, painter: QPainter, end: int, *, kept: bool) -> None:
        """Draw the message up to ``end``; if ``kept``, with a line that says that answers are kept."""
        side = round(_MARK * self._scale)
        left = self._row.contentsRect().left() + side + round(_GAP * self._scale)
        sign = self._place_in_line(self._row.contentsRect().left(), side)
        top = sign.top() + (sign.height() - side) // 2
        size = _MARK * self._scale
        x = sign.right() + 1 - size if self.layoutDirection() == Qt.LayoutDirection.RightToLeft else sign.left()
        draw_icon(painter, "warning", QRectF(x, top, size, size), PARTICIPANT.warn)
        place = self._place_in_line(left, end - left)
        message_height = self._bounds(self._strong, self._message, end - left).height()
        kept_height = self._bounds(self._small, self._words.answers_kept, end - left).height() if kept else 0
        place.setTop(place.top() + (place.height() - message_height - kept_height + 1) // 2)
        place.setHeight(message_height)
        self._draw_text(painter, place, self._message, self._strong, PARTICIPANT.text)
        if kept:
            place.translate(0, message_height)
            place.setHeight(kept_height)
            self._draw_text(painter, place, self._words.answers_kept, self._small, PARTICIPANT.text2)

    def _draw_text(self, painter: QPainter, place: QRect, text: str, face: QFont, ink: str) -> None:
        painter.setFont(face)
        painter.setPen(QColor(ink))
        flags = int(line_start(self) | Qt.AlignmentFlag.AlignVCenter) | _WRAPPED
        painter.drawText(QRectF(place), flags, text)

    def _place_in_line(self, left: int, width: int) -> QRect:
        """Return a rectangle as high as the foot, ``left`` px from the start of the line."""
        line = self._row.contentsRect()
        return QStyle.visualRect(self.layoutDirection(), line, QRect(left, line.top(), width, line.height()))

    def _width(self, face: QFont, text: str) -> int:
        """Return the width of a text on one line [px]."""
        return self._bounds(face, text, _MAX_EXTENT).width()

    def _bounds(self, face: QFont, text: str, width: int) -> QRect:
        return QFontMetrics(face).boundingRect(0, 0, width, _MAX_EXTENT, int(line_start(self)) | _WRAPPED, text)


_ANSWERING = 0.8  # filled fraction of the current trial's bar
_TAB_WIDTH = 60.0
_TAB_STYLE = (
    "QPushButton {{ background: transparent; border-radius: 8px; padding: 0; min-height: {height}px;"
    " color: {text2}; border: 1px solid {ctl}; }}"
    " QPushButton:checked {{ color: {text}; border: 2px solid {text}; }}"
)


class QuestionsPage(PageWidget):
    """Shows a page of questions and emits its events.

    Nothing is preset except earlier answers after a pause. ``ItemShown`` is emitted once per question, when it is first
    painted, ``Chosen`` when an answer is given or changed, ``Retracted`` when an entry was emptied, and ``Submitted``
    once, when no answer is missing. Questions that depend on an answer appear and disappear at once.
    """

    def __init__(self, page: QuestionnairePage, context: PageContext) -> None:
        super().__init__(context)
        self._page = page
        self._part = 0
        self.parts: list[list[QuestionField]] = []
        self._submitted = False
        self._unsent: list[ItemShown] = []
        self.setAccessibleName(page.title)
        self.setAccessibleDescription(page.intro)
        self._progress = ProgressLine(page.progress, context.words, _ANSWERING, self)
        self._title, self._intro = HeadingLabel(page.title, self), PlainLabel(page.intro, self)
        self._intro.setWordWrap(True)
        self._intro.setVisible(bool(page.intro))
        for label, ink in ((self._title, PARTICIPANT.text), (self._intro, PARTICIPANT.text2)):
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setAlignment(line_start(self) | Qt.AlignmentFlag.AlignVCenter)
        self.fields = tuple(self.make_field(item) for item in page.items)
        self.foot = _Foot(context.words, self)
        self.foot.button.clicked.connect(self.submit)
        self.tabs: list[QPushButton] = []
        self._tab_parts: list[int] = []
        self._make_layout()
        self._sender = QTimer(self, singleShot=True, interval=0)
        self._sender.timeout.connect(self._send_shown)
        chosen = dict(page.chosen)
        for field in self.fields:
            if field.view.id in chosen:
                field.show_answer(chosen[field.view.id])
            field.answered.connect(lambda value, field=field: self._emit_answer(field, value))
            field.retracted.connect(lambda field=field: self._emit_retraction(field))
            field.left.connect(lambda field=field: self._focus_next(field))
            field.seen.connect(lambda field=field: self._record_shown(field))

    def make_field(self, item: ItemView) -> QuestionField:
        raise NotImplementedError

    def arrange_parts(self, asked: Sequence[QuestionField]) -> list[list[QuestionField]]:
        """Set the sizes of the asked questions and return the parts that contain them."""
        raise NotImplementedError

    def missing_message(self, numbers: Sequence[int]) -> str:
        raise NotImplementedError

    def _make_layout(self) -> None:
        self._tab_row = hbox()
        self._head_row = hbox((self._title, 1), self._tab_row)
        self._head = vbox(self._progress, self._head_row, self._intro)
        self.questions = vbox(*self.fields, (STRETCH, 1), spacing=0)
        for field in self.fields:
            field.hide()
        whole = vbox(self._head, (self.questions, 1), self.foot, spacing=0, margins=0, parent=self)
        whole.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)  # so that the parts do not resize the page

    @property
    def asked(self) -> tuple[QuestionField, ...]:
        answers = {field.view.id: field.value for field in self.fields if field.is_answered}
        names = shown_questions(self._page.items, answers)
        return tuple(field for field in self.fields if field.view.id in names)

    @property
    def missing(self) -> tuple[int, ...]:
        return tuple(field.view.number for field in self.asked if field.view.required and not field.is_answered)

    @property
    def message(self) -> str:
        """The message at the foot: the questions without a required answer, once Continue was pressed."""
        numbers = [field.view.number for field in self.asked if field.missing]
        return self.missing_message(numbers) if numbers else ""

    @property
    def part(self) -> tuple[QuestionField, ...]:
        return tuple(self.parts[self._part]) if self.parts else ()

    @property
    def button(self) -> QPushButton:
        return self.foot.button

    @property
    def tight(self) -> bool:
        """Whether margins are reduced because the window is low for its text size."""
        return self.height() < 740 * self.font_scale

    @property
    def margin(self) -> float:
        """The margin between the window's edges and the text [px]."""
        return (40 if self.width() >= 1100 else 24) * self.space_scale

    def room_height(self, *, tabs: bool) -> int:
        """Return the height available for questions, with or without the parts' tabs [px]."""
        self._head.invalidate()
        title = self._title.sizeHint().height()
        head = self._head.heightForWidth(self.width())  # -1 without a wrapping introduction
        head = (head if head >= 0 else self._head.sizeHint().height()) - self._head_row.sizeHint().height() + title
        tab_height = max(0, round(target_px(self.font_scale)) - title) if tabs else 0
        return self.height() - head - tab_height - self.foot.height()

    def focus_first(self) -> None:
        self.go_to(self._first_to_answer)

    @property
    def _first_to_answer(self) -> QuestionField:
        asked = self.asked
        return next((field for field in asked if not field.is_answered), asked[0])

    def submit(self) -> None:
        """Confirm the answers, go to the next part, or show the first missing answer."""
        for field in self.part:
            if not field.finish():
                field.setFocus(Qt.FocusReason.OtherFocusReason)
                return
        unanswered = [field for field in self.part if field.view.required and not field.is_answered]
        if not unanswered and self._part + 1 < len(self.parts):
            self.go_to(self.parts[self._part + 1][0])
            return
        if not unanswered:
            unanswered = [field for field in self.asked if field.view.required and not field.is_answered]
        if unanswered:
            for field in unanswered:
                field.set_missing(missing=True)
            self.go_to(unanswered[0])
            self.button.setAccessibleDescription(self.message)
            announce(self, self.message)
            self._update_foot()
        elif not self._submitted:
            self._submitted = True
            self._send_shown()
            self.event_made.emit(Submitted(self._clock()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.submit()
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Backspace):
            self._move_focus(1 if event.key() == Qt.Key.Key_Down else -1)
        else:
            super().keyPressEvent(event)

    def lay_out(self, scale: float) -> None:
        """Set the size of all parts and divide the questions into parts."""
        self.space_scale = scale
        text, margin = self.font_scale, round(self.margin)
        side = round(self.margin - MARGIN * scale)
        self._head.setContentsMargins(margin, round((12 if self.tight else 20) * scale), margin, round(4 * scale))
        self._head.setSpacing(round((0 if self.tight else 6) * scale))
        self._progress.set_scale(text)
        self._title.setFont(font("title", scale=text * (0.86 if self.tight else 1.0)))
        self._intro.setFont(font("statement", scale=text))
        self._tab_row.setSpacing(round(8 * scale))
        self.foot.set_scale(text, margin, tight=self.tight)
        self._show_parts()
        self.questions.setContentsMargins(side, self.lead_height(), side, 0)

    def lead_height(self) -> int:
        """Return the height above the questions [px]; 0 unless overridden."""
        return 0

    def _show_parts(self) -> None:
        """Divide the questions into parts that fit, and show the part with the focus."""
        focused = self.focusWidget()
        focused_question = question_of(focused) if focused is not None else None
        self.parts = self.arrange_parts(self.asked)
        index = next(
            (n for n, part in enumerate(self.parts) if focused_question in part), min(self._part, len(self.parts) - 1)
        )
        self._show_part(index)

    def _show_part(self, index: int) -> None:
        self._part = index
        part = self.part
        for field in self.fields:
            field.setVisible(field in part)
            field.last = field is part[-1]
        for previous, following in zip(part, (*part[1:], self.button), strict=True):
            QWidget.setTabOrder(previous.focusProxy() or previous, following.focusProxy() or following)
        self._make_tabs()
        self._update_foot()

    def _make_tabs(self) -> None:
        text, face = self.font_scale, font("label", scale=self.font_scale)
        names = [_range_text(part) for part in self.parts]
        widest = max(map(QFontMetricsF(face).horizontalAdvance, names))
        size = QSize(round(max(_TAB_WIDTH * text, widest + 12 * text)), round(target_px(text)))
        shown = self._parts_with_tab(size.width())
        while len(self.tabs) > len(shown):
            remove_widget(self.tabs.pop())
        while len(self.tabs) < len(shown):
            self.tabs.append(self._make_tab(len(self.tabs)))
        theme = PARTICIPANT
        style = _TAB_STYLE.format(text=theme.text, text2=theme.text2, ctl=theme.ctl, height=size.height() - 2)
        for tab, part in zip(self.tabs, shown, strict=True):
            tab.setText(names[part])
            tab.setFont(face)
            tab.setStyleSheet(style)
            tab.setFixedSize(size)
            tab.setChecked(part == self._part)
        self._tab_parts = shown

    def _parts_with_tab(self, tab_px: int) -> list[int]:
        """Return the parts with a tab: all if they fit next to the title, else the first, last and nearest."""
        count = len(self.parts)
        room = self.width() - 2 * round(self.margin) - self._title.sizeHint().width()
        fitting = max(3, room // (tab_px + self._tab_row.spacing()))
        if count <= fitting:
            return list(range(count)) if count > 1 else []
        first = min(max(1, self._part - (fitting - 2) // 2), count - 1 - (fitting - 2))
        return [0, *range(first, first + fitting - 2), count - 1]

    def _make_tab(self, place: int) -> QPushButton:
        tab = QPushButton(self)
        tab.setCheckable(True)
        tab.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        tab.clicked.connect(lambda: self.go_to(self.parts[self._tab_parts[place]][0]))
        self._tab_row.addWidget(tab)
        return tab

    def _update_foot(self) -> None:
        asked = self.asked
        focused = self.focusWidget()
        question = (
            question_of(focused) if focused is not None else self._first_to_answer
        )  # the question that will get the focus
        keys = "" if question is None else question.answer_keys
        self.foot.show_state(self.message, sum(field.is_answered for field in asked), len(asked), keys)

    def go_to(self, field: QuestionField) -> None:
        index = next((n for n, part in enumerate(self.parts) if field in part), self._part)
        if index != self._part:
            self._show_part(index)
            key_presses().begin_page(self)
        field.setFocus(Qt.FocusReason.OtherFocusReason)
        self._update_foot()

    def _move_focus(self, by: int) -> None:
        """Focus the next or previous question; the button follows the last one."""
        focused = self.focusWidget()
        question = question_of(focused) if focused is not None else None
        asked = self.asked
        target = (asked.index(question) if question in asked else len(asked)) + by
        if target >= len(asked):
            self.button.setFocus(Qt.FocusReason.TabFocusReason)
        elif target >= 0:
            self.go_to(asked[target])

    def _focus_next(self, field: QuestionField) -> None:
        """Focus the next question of the part after an answer by key; the button follows the last one."""
        part = self.part
        following = part.index(field) + 1 if field in part else len(part)
        if following < len(part):
            self.go_to(part[following])
        else:
            self.button.setFocus(Qt.FocusReason.TabFocusReason)
            self._update_foot()

    def _emit_answer(self, field: QuestionField, value: object) -> None:
        self._send_shown()
        self.event_made.emit(Chosen(self._clock(), field.view.id, value))  # type: ignore[arg-type]
        self._update_questions()

    def _emit_retraction(self, field: QuestionField) -> None:
        self._send_shown()
        self.event_made.emit(Retracted(self._clock(), field.view.id))
        self._update_questions()

    def _update_questions(self) -> None:
        """Show the questions that depend on an answer, and clear those that it hides."""
        asked = self.asked
        for field in self.fields:
            if field not in asked and field.is_answered:
                field.forget_answer()
        if asked != tuple(field for part in self.parts for field in part):
            self._show_parts()
        self._update_foot()

    def _record_shown(self, field: QuestionField) -> None:
        """Record when a question was shown; the event is emitted after painting."""
        self._unsent.append(ItemShown(self._clock(), field.view.id))
        self._sender.start()

    def _send_shown(self) -> None:
        seen, self._unsent = self._unsent, []
        for event in seen:
            self.event_made.emit(event)


_MAX_EXCESS = 0.2  # height of the second part, relative to the page, up to which smaller text is tried
_SHRINKING = (0.94, 0.88, 0.82)  # factors by which text is reduced so that all questions fit

_Parts = list[list[QuestionField]]


class FormWidget(QuestionsPage):
    """A page of questions of any kind, each with its own height."""

    def make_field(self, item: ItemView) -> QuestionField:
        return by_name(FIELDS, item.widget)(item, self._words, self)

    def missing_message(self, numbers: Sequence[int]) -> str:
        return self._words.questions_missing(numbers)

    def arrange_parts(self, asked: Sequence[QuestionField]) -> _Parts:
        """Return the questions in parts that fit; smaller text is used if it avoids a second part."""
        is_required = self.font_scale > 1.0 and self._text_scale > 1.0
        parts = self._pack_parts(asked, self.font_scale)
        if len(parts) == 2 and not is_required:
            return self._single_part(asked) or self._pack_parts(asked, self.font_scale)
        return parts

    def _single_part(self, asked: Sequence[QuestionField]) -> _Parts | None:
        """Return all questions in one part with slightly smaller text, or None if they do not fit."""
        for shrink in _SHRINKING:
            parts = self._pack_parts(asked, self.font_scale * shrink)
            if len(parts) == 1:
                return parts
            if sum(field.minimumHeight() for field in parts[1]) > _MAX_EXCESS * self.height():
                return None
        return None

    def _pack_parts(self, asked: Sequence[QuestionField], scale: float) -> _Parts:
        """Set the text size of the questions, and return them in parts that fit the page."""
        margins = self.questions.contentsMargins()
        width = self.width() - margins.left() - margins.right()
        whole, divided = self.room_height(tabs=False), self.room_height(tabs=True)
        heights = [_fit_text(field, scale, width, divided if len(asked) > 1 else whole) for field in asked]
        parts = _divide_into_parts(asked, heights, whole)
        return parts if len(parts) == 1 else _divide_into_parts(asked, heights, divided)


def _fit_text(field: QuestionField, scale: float, width: int, room: int) -> int:
    """Set the text size of a question, reduced if it does not fit a part of its own; return its height [px]."""
    for percent in range(100, 45, -5):
        field.set_scale(scale * percent / 100)
        if (height := max(field.height_in(width, room), round(target_px(scale * percent / 100)))) <= room:
            break
    field.setMinimumHeight(height)
    return height


def _range_text(part: Sequence[QuestionField]) -> str:
    """Return the range of a part's question numbers: "6–10"."""
    first, last = part[0].view.number, part[-1].view.number
    return str(first) if first == last else f"{first}–{last}"


def _divide_into_parts(asked: Sequence[QuestionField], heights: Sequence[int], room: int) -> _Parts:
    """Return the questions in parts of at most ``room`` px, with as many questions in each as fit."""
    parts: _Parts = []
    total = 0
    for field, height in zip(asked, heights, strict=True):
        if not parts or total + height > room:
            parts.append([])
            total = 0
        parts[-1].append(field)
        total += height
    return parts
