"""Pages of text: consent, instructions, breaks and the debrief of a study, pauses and notices."""

from __future__ import annotations

import html
import math

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QFontMetricsF, QKeyEvent, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QFrame, QLabel, QPushButton, QScrollArea, QScroller, QWidget

from study_app.gui.participant.pages.page_widget import (
    GoButton,
    LanguageSwitch,
    PageContext,
    PageWidget,
    ProgressLine,
    page_painter,
    page_scale,
)
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, font
from study_app.gui.widgets.accessible import HeadingLabel, PlainLabel, announce
from study_app.gui.widgets.boxes import STRETCH, vbox
from study_app.session.pages import EndPage, PausePage, TextPage, TroublePage
from study_app.session.transitions.events import Continue, EndRequested, LanguageChosen, ResumeRequested

_COLUMN = 700.0  # readable width of lines [logical px at scale 1]
_LINE_PERCENT = 140
_SCROLLBAR = 16
_LINE_STEP = 48
# Sizes of the text, with or without a badge, that are tried until the page fits; the latter if text must not shrink.
_SHRINKING = ((1.0, True), (0.94, True), (0.89, True), (0.89, False))
_CONSTANT = ((1.0, True), (1.0, False))
_LINE_KEYS = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}
_PAGE_KEYS = {Qt.Key.Key_PageUp: -1, Qt.Key.Key_PageDown: 1}


def _paragraphs_html(paragraphs: tuple[str, ...], gap: float, *, right_to_left: bool = False) -> str:
    """Return paragraphs with line spacing as HTML for a QLabel."""
    style = f"line-height: {_LINE_PERCENT}%; margin: 0 0 {round(gap)}px 0"
    way = "rtl" if right_to_left else "ltr"
    return "".join(f'<p dir="{way}" style="{style}">{html.escape(text)}</p>' for text in paragraphs)


class Badge(QWidget):
    """An icon in a disc that shows the kind of page at a glance."""

    def __init__(self, icon: str, colour: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._icon = icon
        self._colour = colour
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        side = round(56 * scale)
        self.setFixedSize(side, side)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = page_painter(self)
        disc = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        painter.setBrush(QColor(PARTICIPANT.surface))
        painter.drawEllipse(disc)
        inset = disc.width() * 0.27
        draw_icon(painter, self._icon, disc.adjusted(inset, inset, -inset, -inset), self._colour)
        painter.end()


class Column(QWidget):
    """A column of badge, title and paragraphs."""

    def __init__(
        self, icon: str, title: str, paragraphs: tuple[str, ...], colour: str = PARTICIPANT.accent, *, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self._paragraphs = paragraphs
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        self._start = Qt.AlignmentFlag.AlignRight if flip else Qt.AlignmentFlag.AlignLeft
        self._badge = Badge(icon, colour)
        self._title = HeadingLabel(title)
        self._title.setWordWrap(True)
        self._body = QLabel(wordWrap=True, textFormat=Qt.TextFormat.RichText)
        badge = (self._badge, 0, Qt.AlignmentFlag.AlignLeading)
        self._layout = vbox(badge, self._title, self._body, (STRETCH, 1), margins=0, parent=self)
        for label, ink in ((self._title, PARTICIPANT.text), (self._body, PARTICIPANT.text2)):
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setAlignment(Qt.AlignmentFlag.AlignAbsolute | self._start)

    def set_scale(self, scale: float, *, text: float = 1.0, badge: bool = True) -> None:
        self._badge.set_scale(scale)
        self._badge.setVisible(badge)
        self._title.setFont(font("display", scale=scale * text))
        self._body.setFont(font("statement", scale=scale * text * 1.125))
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        self._body.setText(_paragraphs_html(self._paragraphs, 10 * scale, right_to_left=flip))
        self._layout.setSpacing(round(14 * scale))

    def needed_height(self, width: int) -> int:
        """Return the height of the texts in a column of ``width`` [px]."""
        return self._layout.heightForWidth(width)


class ReadingPage(PageWidget):
    """A page with a progress line, a column of text, which scrolls in small windows, and at most one button."""

    def __init__(
        self,
        column: tuple[str, str, tuple[str, ...], str],
        context: PageContext,
        button: tuple[str, str] | None = None,
        progress: ProgressLine | None = None,
    ) -> None:
        super().__init__(context)
        icon, title, paragraphs, colour = column
        self.setAccessibleName(title)
        self.setAccessibleDescription("\n".join(paragraphs))
        self._progress = progress
        if progress is not None:
            progress.setParent(self)
        self._scroll = QScrollArea(self)
        self._scroll.setFrameShape(QFrame.Shape.NoFrame)
        self._scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._column = Column(icon, title, paragraphs, colour, parent=self._scroll)
        self._scroll.setWidget(self._column)
        self._scroll.viewport().setAutoFillBackground(False)
        self._column.setAutoFillBackground(False)
        self._content = QRectF()
        QScroller.grabGesture(self._scroll.viewport(), QScroller.ScrollerGestureType.TouchGesture)
        self.button = None
        if button is not None:
            text, key = button
            self.button = GoButton(text, key, parent=self)
            self.button.clicked.connect(self.go_on)

    def go_on(self) -> None:
        """Perform the action of the page's button; overridden by pages with a button."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        bar = self._scroll.verticalScrollBar()
        if (lines := _LINE_KEYS.get(Qt.Key(event.key()))) is not None:
            bar.setValue(bar.value() + lines * _LINE_STEP)
        elif (pages := _PAGE_KEYS.get(Qt.Key(event.key()))) is not None:
            bar.setValue(bar.value() + pages * (bar.pageStep() - _LINE_STEP))
        else:
            super().keyPressEvent(event)

    def lay_out(self, scale: float) -> None:
        """Place the column slightly above the middle, and the button below the start of its lines."""
        is_enlarged = self.font_scale > scale
        scale = self.font_scale
        margin = round((40 if self.width() >= 1100 else 24) * scale)
        top = round(20 * scale)
        if self._progress is not None:
            self._progress.set_scale(scale)
            self._progress.setGeometry(margin, top, self.width() - 2 * margin, self._progress.height())
            top += self._progress.height()
        top = self._lay_out_head(scale, margin, top)
        width = min(round(_COLUMN * scale), self.width() - 2 * margin)
        foot = below = 0
        if self.button is not None:
            self.button.set_scale(scale)
            below = self._below_button(width)
            foot = self.button.height() + below + round((16 if is_enlarged else 28) * scale)
        room = self.height() - top - round((28 if is_enlarged else 48) * scale) - foot
        for text, badge in _CONSTANT if is_enlarged else _SHRINKING:
            self._column.set_scale(scale, text=text, badge=badge)
            needed = self._column.needed_height(width)
            if needed <= room:
                break
        height = min(needed, room)
        self._column.setFixedSize(width, needed)
        y = top + round((12 if is_enlarged else 24) * scale) + round((room - height) * 0.42)
        x = (self.width() - width) // 2
        bar = _SCROLLBAR if needed > height else 0
        self._scroll.setGeometry(x - (bar if self.mirrored else 0), y, width + bar, height)
        policy = Qt.ScrollBarPolicy
        self._scroll.setVerticalScrollBarPolicy(
            policy.ScrollBarAlwaysOn if needed > height else policy.ScrollBarAlwaysOff
        )
        self._content = QRectF(x, y, width, height + foot)
        if self.button is not None:
            left = x + width - self.button.width() + 4 if self.mirrored else x - 4
            self.button.move(left, y + height + foot - below - self.button.height())

    def _below_button(self, _width: int) -> int:
        """Return the height below the button in a column of this width [px]."""
        return 0

    def _lay_out_head(self, _scale: float, _margin: int, top: int) -> int:
        """Lay out the head, starting at ``top``; return the top of the space for the column [px]."""
        return top


_ICONS = {"consent": "pen", "instructions": "drop", "break": "clock", "debrief": "check"}
_TICK_MS = 200


class _DeclineButton(QPushButton):
    """The outlined button of a consent that ends the session."""

    def __init__(self, text: str, parent: QWidget) -> None:
        super().__init__(text, parent)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAutoDefault(False)

    def set_scale(self, scale: float) -> None:
        self.setFont(font("card", scale=scale, weight=500))
        metrics = QFontMetricsF(self.font())
        self.setFixedSize(round(metrics.horizontalAdvance(self.text()) + 44 * scale), round(48 * scale))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Decline if Enter is pressed while the button has the focus, since Enter would otherwise agree."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)


class TextWidget(ReadingPage):
    """A page with consent, instructions, a break or the debrief.

    Space or Enter continues, but a consent requires Enter or its button, and has a second button that declines. A break
    with a minimum duration shows a countdown in place of its button. Another language can be chosen up to the consent.
    """

    def __init__(self, page: TextPage, context: PageContext) -> None:
        wording = context.words
        self._consent = page.kind == "consent"
        key = wording.enter_key if self._consent else wording.space_key
        progress = ProgressLine(page.progress, wording, 0.0) if page.progress is not None else None
        column = (_ICONS[page.kind], page.title, page.paragraphs, PARTICIPANT.accent)
        super().__init__(column, context, (page.button, key), progress)
        self._stays_until_s = page.stays_until_s
        self.count_label = PlainLabel("", self)
        self.count_label.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        self._ticker = QTimer(self, interval=_TICK_MS)
        self._ticker.timeout.connect(self.tick)
        self._stacked = False
        self.languages: LanguageSwitch | None = None
        if page.languages:
            self.languages = LanguageSwitch(page.languages, page.language, wording.choose_language, self)
            # Queued, since the page must not close while its button handles a key.
            self.languages.chosen.connect(self._choose_language, Qt.ConnectionType.QueuedConnection)
            for language in self.languages.buttons:
                assert self.button is not None  # noqa: S101  # text pages have a button
                QWidget.setTabOrder(language, self.button)  # above the button, so before it in the focus order
        self.decline = _DeclineButton(wording.decline, self) if self._consent else None
        if self.decline is not None:
            self.decline.clicked.connect(self._decline)
        if page.stays_until_s is not None:
            self._ticker.start()
        self.tick()

    @property
    def seconds_left(self) -> int:
        """Whole seconds until the page may be left, 0 afterwards."""
        if self._stays_until_s is None:
            return 0
        return max(0, math.ceil(self._stays_until_s - self._clock()))

    @property
    def count(self) -> str:
        return self.count_label.text()

    def tick(self) -> None:
        """Count down; at the end, show the button instead of the count."""
        assert self.button is not None  # noqa: S101  # text pages have a button
        left = self.seconds_left
        self.count_label.setText(self._words.continue_in.format(seconds=left) if left else "")
        self.count_label.adjustSize()
        self.count_label.setVisible(left > 0)
        self._place_count()
        if left:
            self.button.hide()
            return
        self._ticker.stop()
        if self.button.isHidden():
            self.button.show()
            if self.isVisible():
                self.focus_first()
                announce(self.button, self.button.text())

    def focus_first(self) -> None:
        """Focus the button, except that of a consent, because Space must not agree."""
        if self._consent or self.button is None or self.button.isHidden():
            self.setFocus()
        else:
            self.button.setFocus()

    def lay_out(self, scale: float) -> None:
        super().lay_out(scale)
        self.count_label.setFont(font("card", scale=self.font_scale * 1.125, weight=500, tabular=True))
        self.count_label.adjustSize()
        self._place_count()
        self._place_decline()

    def _below_button(self, width: int) -> int:
        """Return the height of the decline button if it does not fit beside the other one."""
        if self.decline is None or self.button is None:
            return 0
        self.decline.set_scale(self.font_scale)
        self._stacked = self.button.width() + self._gap + self.decline.width() > width
        return self.decline.height() + self._gap // 2 if self._stacked else 0

    @property
    def _gap(self) -> int:
        return round(16 * self.font_scale)

    def _place_decline(self) -> None:
        """Place the decline button next to the other one, or below it."""
        if self.decline is None or self.button is None:
            return
        place, size = self.button.geometry(), self.decline.size()
        if self._stacked:
            left, top = (place.right() - size.width() if self.mirrored else place.left()), place.bottom()
            self.decline.move(left, top + self._gap // 2)
        else:
            left = place.left() - self._gap - size.width() if self.mirrored else place.right() + self._gap
            self.decline.move(left, place.center().y() - size.height() // 2)

    def _decline(self) -> None:
        self.event_made.emit(EndRequested(self._clock(), "withdrawn", "no consent"))

    def _place_count(self) -> None:
        assert self.button is not None  # noqa: S101  # text pages have a button
        place, size = self.button.geometry(), self.count_label.size()
        left = place.right() - size.width() - 3 if self.mirrored else place.left() + 4
        self.count_label.move(left, place.center().y() - size.height() // 2)

    def _lay_out_head(self, scale: float, margin: int, top: int) -> int:
        if self.languages is None:
            return top
        self.languages.set_scale(min(scale, self._max_language_scale(margin)))
        width, height = self.languages.width(), self.languages.height()
        self.languages.move(margin if self.mirrored else self.width() - margin - width, top - 4)
        return top + height - 8

    def _max_language_scale(self, margin: int) -> float:
        """Return the largest scale at which the languages fit in one line."""
        assert self.languages is not None  # noqa: S101  # called only with languages
        self.languages.set_scale(1.0)
        return max(1.0, (self.width() - 2 * margin) / self.languages.width())

    def _choose_language(self, language: str) -> None:
        self.event_made.emit(LanguageChosen(self._clock(), language))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        space = event.key() == Qt.Key.Key_Space and not self._consent
        if enter or space:
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Emit that the participant continues, if the page may be left."""
        if not self.seconds_left:
            self.event_made.emit(Continue(self._clock()))


_VEIL = 0.80  # opacity of the pause page over the interrupted page


class PauseWidget(ReadingPage):
    """The pause page over a picture of the interrupted page; after a force stop it says that the force is off.

    It has no button if only the operator can resume. With a mouse, which has no force, it does not mention force.
    """

    def __init__(self, page: PausePage, context: PageContext, under: QPixmap | None = None) -> None:
        self.under, wording = under, context.words
        if page.force_off and not context.by_mouse:
            body = wording.force_off_body if page.held is None else wording.force_held_body
            column = ("stop", wording.force_off_title, (body,), PARTICIPANT.bad)
            label = wording.force_on
        else:
            body = wording.pause_body if page.held is None else wording.pause_held_body
            column = ("pause", wording.pause_title, (body,), PARTICIPANT.accent)
            label = wording.resume
        button = (label, wording.enter_key) if page.held is None else None
        super().__init__(column, context, button)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Continue with Enter, but not with Space, which may be meant for the previous page."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Request to resume the session if the participant may do so."""
        if self.button is not None:
            self.event_made.emit(ResumeRequested(self._clock(), "participant"))

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = page_painter(self)
        if self.under is not None and not self.under.isNull():
            painter.setOpacity(1 - _VEIL)
            painter.drawPixmap(self.rect(), self.under)
            painter.setOpacity(1.0)
        space = min(40 * page_scale(self.width(), self.height()), self._content.top(), self._content.left())
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        painter.setBrush(QColor(PARTICIPANT.window))
        painter.drawRoundedRect(self._content.adjusted(-space, -space, space, space), 2 * RADIUS_CARD, 2 * RADIUS_CARD)
        painter.end()


class NoticeWidget(ReadingPage):
    """The page after a failure or at the end of the session, with one sentence; the last page can be closed.

    The last page asks to let go of the device, unless it is a mouse.
    """

    def __init__(self, page: TroublePage | EndPage, context: PageContext) -> None:
        ended, wording = isinstance(page, EndPage), context.words
        icon, colour = ("check", PARTICIPANT.ok) if ended else ("info", PARTICIPANT.warn)
        paragraph = f"{page.paragraph} {wording.let_go}" if ended and not context.by_mouse else page.paragraph
        column = (icon, page.title, (paragraph,), colour)
        button = (wording.close, wording.space_key) if ended else None
        super().__init__(column, context, button)

    def focus_first(self) -> None:
        (self.button or self).setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        keys = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space)
        if self.button is not None and event.key() in keys:
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Close the window after the last page."""
        self.window().close()
