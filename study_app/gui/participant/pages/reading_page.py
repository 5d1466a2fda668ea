"""What all pages to read are: a column of text in the middle, perhaps a button, and a head."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QLabel, QScrollArea, QScroller, QWidget

from study_app.gui.participant.pages.key_caps import GoButton
from study_app.gui.participant.pages.page_widget import PageWidget, page_painter
from study_app.gui.participant.pages.progress_line import ProgressLine
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import HeadingLabel
from study_app.gui.widgets.boxes import STRETCH, vbox

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

COLUMN = 700.0  # a line that reads well [logical px at scale 1]
LINE_PERCENT = 140
SCROLLBAR = 16
LINE_STEP = 48
GIVING_WAY = ((1.0, True), (0.94, True), (0.89, True), (0.89, False))  # size of the text, whether with a badge
MUST_BE_READ = ((1.0, True), (1.0, False))  # where words are as small as they may be
LINE_KEYS = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}
PAGE_KEYS = {Qt.Key.Key_PageUp: -1, Qt.Key.Key_PageDown: 1}


def paragraphs_html(paragraphs: tuple[str, ...], gap: float, *, right_to_left: bool = False) -> str:
    """Return paragraphs with room between their lines, for a QLabel."""
    style = f"line-height: {LINE_PERCENT}%; margin: 0 0 {round(gap)}px 0"
    way = "rtl" if right_to_left else "ltr"
    return "".join(f'<p dir="{way}" style="{style}">{html.escape(text)}</p>' for text in paragraphs)


class Badge(QWidget):
    """An icon in a disc: what kind of page this is, before a word is read."""

    def __init__(self, icon: str, colour: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._icon = icon
        self._colour = colour
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
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
    """Badge, title and paragraphs under each other; scrolls only if a small window cannot show them all."""

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
        self._body = QLabel()
        self._body.setWordWrap(True)
        self._body.setTextFormat(Qt.TextFormat.RichText)
        badge = (self._badge, 0, Qt.AlignmentFlag.AlignLeading)
        self._layout = vbox(badge, self._title, self._body, (STRETCH, 1), margins=0, parent=self)
        for label, ink in ((self._title, PARTICIPANT.text), (self._body, PARTICIPANT.text2)):
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setAlignment(Qt.AlignmentFlag.AlignAbsolute | self._start)

    def set_scale(self, scale: float, *, text: float = 1.0, badge: bool = True) -> None:
        """Grow with the page; in a small window with smaller text, then without the badge."""
        self._badge.set_scale(scale)
        self._badge.setVisible(badge)
        self._title.setFont(font("display", scale=scale * text))
        self._body.setFont(font("statement", scale=scale * text * 1.125))
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        self._body.setText(paragraphs_html(self._paragraphs, 10 * scale, right_to_left=flip))
        self._layout.setSpacing(round(14 * scale))

    def needed(self, width: int) -> int:
        """Return the height [px] that the texts need in a column of ``width``."""
        return self._layout.heightForWidth(width)


class ReadingPage(PageWidget):
    """A progress line, a column of text in the middle, and perhaps one button."""

    def __init__(
        self,
        column: tuple[str, str, tuple[str, ...], str],
        words: Words,
        clock: Callable[[], float],
        *,
        button: tuple[str, str] | None = None,
        progress: ProgressLine | None = None,
        parent: QWidget | None = None,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(words, clock, parent, text_scale=text_scale)
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
        self.button = GoButton(*button, parent=self) if button is not None else None
        if self.button is not None:
            self.button.clicked.connect(self.go_on)

    def go_on(self) -> None:
        """Do what the page's button says."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        bar = self._scroll.verticalScrollBar()
        if (lines := LINE_KEYS.get(Qt.Key(event.key()))) is not None:
            bar.setValue(bar.value() + lines * LINE_STEP)
        elif (pages := PAGE_KEYS.get(Qt.Key(event.key()))) is not None:
            bar.setValue(bar.value() + pages * (bar.pageStep() - LINE_STEP))
        else:
            super().keyPressEvent(event)

    def lay_out(self, scale: float) -> None:
        """Put the column into the middle, a little above it, the button under the edge where its lines begin."""
        least = self.words_scale > scale
        scale = self.words_scale
        margin = round((40 if self.width() >= 1100 else 24) * scale)
        top = round(20 * scale)
        if self._progress is not None:
            self._progress.set_scale(scale)
            self._progress.setGeometry(margin, top, self.width() - 2 * margin, self._progress.height())
            top += self._progress.height()
        top = self._lay_out_head(scale, margin, top)
        width = min(round(COLUMN * scale), self.width() - 2 * margin)
        foot = below = 0
        if self.button is not None:
            self.button.set_scale(scale)
            below = self._below_button(width)
            foot = self.button.height() + below + round((16 if least else 28) * scale)
        room = self.height() - top - round((28 if least else 48) * scale) - foot
        for text, badge in MUST_BE_READ if least else GIVING_WAY:
            self._column.set_scale(scale, text=text, badge=badge)
            needed = self._column.needed(width)
            if needed <= room:
                break
        height = min(needed, room)
        self._column.setFixedSize(width, needed)
        y = top + round((12 if least else 24) * scale) + round((room - height) * 0.42)
        x = (self.width() - width) // 2
        bar = SCROLLBAR if needed > height else 0
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
        """Return the height [px] of what stands under the button in a column of a width."""
        return 0

    def _lay_out_head(self, _scale: float, _margin: int, top: int) -> int:
        """Place what stands above the column from ``top`` on; return where the column's room begins [px]."""
        return top
