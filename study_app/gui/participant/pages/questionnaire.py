"""The questionnaire: all statements of a setting on one page, answered with mouse, keyboard or touch alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QFontMetricsF, QKeyEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QPushButton, QWidget

from study_app.gui.participant.pages.column_labels import Heading, label_height, widest_word
from study_app.gui.participant.pages.key_caps import GoButton, draw_key, key_size
from study_app.gui.participant.pages.page_widget import PageWidget, page_painter
from study_app.gui.participant.pages.progress_line import ProgressLine
from study_app.gui.participant.pages.questionnaire_grid import LEAST_CELL, Asked, Grid, grid, holds, parts
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.participant.pages.statement_row import WRAP_LEFT, Row
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, TYPE, font
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown, Submitted

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

LEFT = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
CENTRE = int(Qt.AlignmentFlag.AlignCenter)


class QuestionnaireWidget(PageWidget):
    """Draws a questionnaire page and says what happens on it.

    Nothing is preset but what the page brings back after a pause. ``ItemShown`` comes once for every statement, when it
    is first painted; ``Chosen`` when an answer is made or changed; ``Submitted`` once, when nothing is missing.
    """

    def __init__(
        self,
        page: QuestionnairePage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(words, clock, parent, text_scale=text_scale)
        self._page = page
        self._first = 0
        self._submitted = False
        self._unsent: list[ItemShown] = []
        self._grid: Grid | None = None
        self.setAccessibleName(page.title)
        self.setAccessibleDescription(page.intro)
        self._progress = ProgressLine(page.progress, words, 0.8, self)
        self._heading = Heading(page.labels, page.cannot_judge, self)
        self.rows = tuple(Row(item, page.labels, page.cannot_judge, words, self) for item in page.items)
        for row in self.rows:
            row.chosen.connect(lambda changed, by_key, row=row: self._chose(row, changed=changed, by_key=by_key))
            row.wandered.connect(self._heading.point)
            row.seen.connect(lambda row=row: self._saw(row))
        self._tabs: list[QPushButton] = []
        self.button = GoButton(words.continue_, words.enter_key, self)
        self.button.clicked.connect(self.submit)
        self._sender = QTimer(self)
        self._sender.setSingleShot(True)
        self._sender.setInterval(0)
        self._sender.timeout.connect(self._send_seen)
        chosen = dict(page.chosen)
        for row in self.rows:
            if row.item.id in chosen:
                row.answer(chosen[row.item.id])

    @property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the required statements without an answer."""
        return tuple(row.item.number for row in self.rows if row.item.required and not row.answered)

    @property
    def message(self) -> str:
        """What the foot says: which statements still need an answer, once Continue was pressed too early."""
        asked = [row.item.number for row in self.rows if row.missing]
        return self._words.missing(asked) if asked else ""

    @property
    def heading(self) -> tuple[str, ...]:
        """The labels over the columns that can be read now."""
        return self._heading.shown

    def focus_first(self) -> None:
        """Put the keyboard on the first statement without an answer."""
        row = next((row for row in self.rows if not row.answered), self.rows[0])
        self._go_to(row)

    def submit(self) -> None:
        """Confirm the answers, or name what is missing and go there."""
        waiting = [row for row in self._shown() if row.item.required and not row.answered]
        if not waiting and self._first + len(self._shown()) < len(self.rows):
            self._go_to(self.rows[self._first + len(self._shown())])
            return
        if not waiting:
            waiting = [row for row in self.rows if row.item.required and not row.answered]
        if waiting:
            for row in waiting:
                row.ask(missing=True)
            self._go_to(waiting[0])
            self.button.setAccessibleDescription(self.message)
            say(self, self.message)
            self.update()
        elif not self._submitted:
            self._submitted = True
            self._send_seen()
            self.event_made.emit(Submitted(self._clock()))

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        """Move with up and down, go back with Backspace, confirm with Enter."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self.submit()
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Backspace):
            self._move(1 if event.key() == Qt.Key.Key_Down else -1)
        else:
            super().keyPressEvent(event)

    def lay_out(self, scale: float) -> None:
        """Place head, rows and foot; decide how many statements a page shows."""
        self._grid = places = self._places()
        self._progress.set_scale(places.text)
        self._progress.setGeometry(
            round(places.margin), round(places.top), round(self.width() - 2 * places.margin), self._progress.height()
        )
        self._heading.place(places, places.rows_top - places.heading_height - (4 if places.tight else 8) * scale)
        self.button.set_scale(places.text * (0.95 if places.tight else 1.0))
        foot, size = self.height() - places.foot_top, self.button.size()
        top = places.foot_top + (foot - size.height()) / 2
        left = self.width() - places.margin - size.width() + 4
        self.button.move(self.placed(QRectF(left, round(top), size.width(), size.height())).topLeft().toPoint())
        self._tab_pages()
        self._show_part(self._first)

    def _places(self) -> Grid:
        """Return where everything lies, with as many statements on a part as can be read and hit."""
        page = self._page
        bare, label = QFontMetricsF(font("statement")), QFontMetricsF(font("label", weight=600))
        off = () if page.cannot_judge is None else (page.cannot_judge,)
        asked = Asked(
            items=len(self.rows),
            statement=max(bare.horizontalAdvance(row.item.text) for row in self.rows),
            heading=lambda wide, judge: max(label_height(page.labels, wide), label_height(off, judge)),
            intro=lambda width: bare.boundingRect(QRectF(0, 0, width, 1e3), WRAP_LEFT, page.intro).height(),
            judge=widest_word(label, page.cannot_judge or ""),
            word=max(widest_word(label, text) for text in page.labels),
        )
        note = self._words.please_answer
        for per_page in parts(len(self.rows), self.width()):
            places = grid(self.width(), self.height(), asked, per_page, text_scale=self._text_scale)
            if holds(places) and all(row.fits(places, note) for row in self.rows):
                break
        return places.mirrored() if self.mirrored else places

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802
        """Draw the words of head and foot."""
        super().paintEvent(event)
        if self._grid is None:
            return
        painter = page_painter(self)
        self._paint_head(painter, self._grid)
        self._paint_foot(painter, self._grid)
        painter.end()

    def _paint_head(self, painter: QPainter, places: Grid) -> None:
        left, width = places.margin, self.width() - 2 * places.margin
        face = font("title", scale=places.title / TYPE["title"].size)
        painter.setFont(face)
        painter.setPen(QColor(PARTICIPANT.text))
        height = QFontMetricsF(face).height()
        painter.drawText(QRectF(left, places.title_top, width, height), LEFT, self._page.title)
        painter.setFont(font("statement", scale=places.text))
        painter.setPen(QColor(PARTICIPANT.text2))
        below = QRectF(left, places.intro_top, width, places.rows_top - places.intro_top)
        painter.drawText(below, WRAP_LEFT, self._page.intro)

    def _paint_foot(self, painter: QPainter, places: Grid) -> None:
        """Draw, from the end of the line to its beginning: count, keys where there is room, what is missing."""
        text, words = places.text, self._words
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        y = round(places.foot_top) + 0.5
        painter.drawLine(QPointF(0, y), QPointF(self.width(), y))
        middle = self.button.geometry().center().y()
        right = self.width() - places.margin - self.button.width() + 4 - 18 * text
        done = sum(row.answered for row in self.rows)
        counted = words.answered.format(done=done, of=len(self.rows))
        painter.setFont(font("cell", scale=text * 0.95))
        width = QFontMetricsF(painter.font()).horizontalAdvance(counted) + 2
        painter.setPen(QColor(PARTICIPANT.text2))
        painter.drawText(self.placed(QRectF(right - width, middle - 20 * text, width, 40 * text)), CENTRE, counted)
        right -= width + 28 * text
        room = right - places.margin
        if self.message:
            room -= self._paint_message(painter, places, room, middle)
        self._paint_hints(painter, places, right, middle, room)

    def _paint_message(self, painter: QPainter, places: Grid, room: float, middle: float) -> float:
        """Draw what is missing; return the width that is taken [px]."""
        scale, start = places.text, places.margin
        mark = 22 * scale
        face, small = font("statement", scale=scale, weight=600), font("body", scale=scale * 0.94)
        strong, light = QFontMetricsF(face), QFontMetricsF(small)
        beside = start + mark + 11 * scale
        wide = min(strong.horizontalAdvance(self.message) + 4, room - mark - 11 * scale)
        height = strong.boundingRect(QRectF(0, 0, wide, 1e3), WRAP_LEFT, self.message).height()
        kept = self._words.answers_kept
        whole = height + light.height() + 2 * scale
        roomy = whole <= self.height() - places.foot_top and light.horizontalAdvance(kept) <= room - mark - 11 * scale
        top = middle - (whole if roomy else height) / 2
        icon = self.placed(QRectF(start, middle - mark / 2, mark, mark))
        draw_icon(painter, "warning", icon, PARTICIPANT.warn)
        painter.setFont(face)
        painter.setPen(QColor(PARTICIPANT.text))
        painter.drawText(self.placed(QRectF(beside, top, wide, height + 2)), WRAP_LEFT, self.message)
        if not roomy:
            return wide + mark + 36 * scale
        painter.setFont(small)
        painter.setPen(QColor(PARTICIPANT.text2))
        below = QRectF(beside, top + height + 2 * scale, room - mark - 11 * scale, light.height() + 2)
        painter.drawText(self.placed(below), LEFT, kept)
        return max(wide, light.horizontalAdvance(kept)) + mark + 36 * scale

    def _paint_hints(self, painter: QPainter, places: Grid, right: float, middle: float, room: float) -> None:
        """Draw which keys answer and move, as far as there is room; side notes give way first."""
        scale, words = places.text, self._words
        face = font("body", scale=scale * 0.94)
        metrics = QFontMetricsF(face)
        hints = (("1–7", words.key_answer), ("↑ ↓", words.key_move))
        widths = [key_size(key, scale)[0] + 8 * scale + metrics.horizontalAdvance(text) for key, text in hints]
        total = sum(widths) + 20 * scale
        if total > room:
            return
        left = right - total - 8 * scale
        for (key, text), width in zip(hints, widths, strict=True):
            cap, _ = key_size(key, scale)
            draw_key(painter, self.placed(QRectF(left, 0, cap, 1)).left(), middle, key, scale)
            painter.setFont(face)
            painter.setPen(QColor(PARTICIPANT.text2))
            beside = QRectF(left + cap + 8 * scale, middle - 20 * scale, width - cap - 6 * scale, 40 * scale)
            painter.drawText(self.placed(beside), LEFT, text)
            left += width + 20 * scale

    def _shown(self) -> tuple[Row, ...]:
        """Return the rows of the part that is shown."""
        many = self._grid.per_page if self._grid is not None else len(self.rows)
        return self.rows[self._first : self._first + many]

    def _show_part(self, first: int) -> None:
        """Show the part of the questionnaire in which row ``first`` is."""
        if self._grid is None:
            return
        places = self._grid
        self._first = first - first % places.per_page
        shown = self._shown()
        for row in self.rows:
            row.setVisible(row in shown)
        for index, row in enumerate(shown):
            row.place(places, places.rows_top + index * places.pitch, last=index == len(shown) - 1)
        for before, after in zip(shown, (*shown[1:], self.button), strict=True):
            QWidget.setTabOrder(before, after)
        for index, tab in enumerate(self._tabs):
            tab.setChecked(index == self._first // places.per_page)

    def _tab_pages(self) -> None:
        """Offer the parts of a questionnaire that a small window cannot show at once, by their numbers."""
        assert self._grid is not None  # noqa: S101  # lay_out has just set it
        places, many = self._grid, self._grid.per_page
        starts = range(0, len(self.rows), many) if many < len(self.rows) else range(0)
        while len(self._tabs) > len(starts):
            self._tabs.pop().deleteLater()
        while len(self._tabs) < len(starts):
            self._tabs.append(self._new_tab(len(self._tabs)))
        for index, (tab, start) in enumerate(zip(self._tabs, starts, strict=True)):
            last = min(start + many, len(self.rows))
            tab.setText(str(last) if last == start + 1 else f"{start + 1}–{last}")
            tab.setFont(font("label", scale=places.text))
            width, height = 60 * places.text, max(LEAST_CELL * places.scale, 32 * places.text)
            top = self._heading.geometry().bottom() - height
            place = QRectF(places.margin + index * (width + 8 * places.scale), top, width, height)
            tab.setGeometry(self.placed(place).toRect())

    def _new_tab(self, part: int) -> QPushButton:
        theme = PARTICIPANT
        tab = QPushButton(self)
        tab.setCheckable(True)
        tab.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        tab.setStyleSheet(
            "QPushButton { background: transparent; border-radius: 8px; padding: 0; min-height: 0;"
            f" color: {theme.text2}; border: 1px solid {theme.ctl}; }}"
            f" QPushButton:checked {{ color: {theme.text}; border: 2px solid {theme.text}; }}"
        )
        tab.clicked.connect(lambda: self._go_to(self.rows[part * self._part_size()]))
        tab.show()
        return tab

    def _part_size(self) -> int:
        return self._grid.per_page if self._grid is not None else len(self.rows)

    def _go_to(self, row: Row) -> None:
        index = self.rows.index(row)
        if row not in self._shown():
            self._show_part(index)
        row.setFocus(Qt.FocusReason.OtherFocusReason)

    def _move(self, by: int) -> None:
        """Put the keyboard on the next or the previous statement; after the last comes the button."""
        focused = self.focusWidget()
        place = self.rows.index(focused) if isinstance(focused, Row) else len(self.rows)
        target = place + by
        if target >= len(self.rows):
            self.button.setFocus(Qt.FocusReason.TabFocusReason)
        elif target >= 0:
            self._go_to(self.rows[target])

    def _chose(self, row: Row, *, changed: bool, by_key: bool) -> None:
        self._send_seen()
        if changed:
            self.event_made.emit(Chosen(self._clock(), row.item.id, row.value))
        self.update()
        if by_key:
            following = self.rows.index(row) + 1
            if following < len(self.rows) and self.rows[following] in self._shown():
                self._go_to(self.rows[following])
            else:
                self.button.setFocus(Qt.FocusReason.TabFocusReason)

    def _saw(self, row: Row) -> None:
        """Keep the moment; tell it after the painting."""
        self._unsent.append(ItemShown(self._clock(), row.item.id))
        self._sender.start()

    def _send_seen(self) -> None:
        seen, self._unsent = self._unsent, []
        for event in seen:
            self.event_made.emit(event)
