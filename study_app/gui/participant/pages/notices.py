"""Pages that the program writes: the pause, trouble, the end."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QKeyEvent, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter, page_scale
from study_app.gui.participant.pages.reading_page import ReadingPage
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD
from study_app.session.pages import EndPage, PausePage, TroublePage
from study_app.session.transitions.events import ResumeAsked

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

VEIL = 0.80  # how much of the page under a pause is hidden


class PauseWidget(ReadingPage):
    """The pause, over the page that it interrupts; after a force stop it says that the force is off.

    Where the operator stopped, there is nothing to press: the operator goes on. Of a mouse, which gives no force, it
    never speaks of one.
    """

    def __init__(
        self,
        page: PausePage,
        words: Words,
        clock: Callable[[], float],
        *,
        under: QPixmap | None = None,
        parent: QWidget | None = None,
        text_scale: float = 1.0,
        by_mouse: bool = False,
    ) -> None:
        self.under = under
        if page.force_off and not by_mouse:
            title = words.force_held_title if page.held == "force" else words.force_off_title
            body = words.force_off_body if page.held is None else words.force_held_body
            column = ("stop", title, (body,), PARTICIPANT.bad)
            label = words.force_on
        else:
            body = words.pause_body if page.held is None else words.pause_held_body
            column = ("pause", words.pause_title, (body,), PARTICIPANT.accent)
            label = words.resume
        button = (label, words.enter_key) if page.held is None else None
        super().__init__(column, words, clock, button=button, parent=parent, text_scale=text_scale)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go on with Enter; Space alone could still be the key of the page before."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Ask to go on with the session, where that is the participant's to do."""
        if self.button is not None:
            self.event_made.emit(ResumeAsked(self._clock(), "participant"))

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = page_painter(self)
        if self.under is not None and not self.under.isNull():
            painter.setOpacity(1 - VEIL)
            painter.drawPixmap(self.rect(), self.under)
            painter.setOpacity(1.0)
        space = min(40 * page_scale(self.width(), self.height()), self._content.top(), self._content.left())
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        painter.setBrush(QColor(PARTICIPANT.window))
        painter.drawRoundedRect(self._content.adjusted(-space, -space, space, space), 2 * RADIUS_CARD, 2 * RADIUS_CARD)
        painter.end()


class NoticeWidget(ReadingPage):
    """Something broke, or the session is over: a calm sentence; the last page can be closed.

    Where the mouse is the device, the last page does not ask to let go of it.
    """

    def __init__(
        self,
        page: TroublePage | EndPage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
        by_mouse: bool = False,
    ) -> None:
        ended = isinstance(page, EndPage)
        icon, colour = ("check", PARTICIPANT.ok) if ended else ("info", PARTICIPANT.warn)
        said = f"{page.paragraph} {words.let_go}" if ended and not by_mouse else page.paragraph
        column = (icon, page.title, (said,), colour)
        button = (words.close, words.space_key) if ended else None
        super().__init__(column, words, clock, button=button, parent=parent, text_scale=text_scale)

    def focus_first(self) -> None:
        """Put the keyboard on the button, where there is one."""
        (self.button or self).setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        keys = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space)
        if self.button is not None and event.key() in keys and not event.isAutoRepeat():
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Close the window after the last page."""
        self.window().close()
