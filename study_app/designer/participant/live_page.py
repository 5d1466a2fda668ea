"""The participant's window within the designer: its real widgets at their real size, scaled as a whole."""

import atexit
import math
import time
from dataclasses import replace
from typing import Final
from weakref import WeakSet

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFocusEvent,
    QHideEvent,
    QKeyEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QShowEvent,
    QTransform,
)
from PySide6.QtWidgets import (
    QAbstractScrollArea,
    QApplication,
    QFrame,
    QGraphicsProxyWidget,
    QGraphicsScene,
    QGraphicsView,
)
from shiboken6 import isValid

from study_app.designer.participant.shown_step import SIZES, ParticipantView, ScreenSize
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX
from study_app.protocol.wording.languages import words
from study_app.session.pages import Page, QuestionnairePage, TaskPage
from study_app.session.trial import TankView

FRAME_MS: Final = 33
RING: Final = 2
LEAVES: Final = "Esc leaves the page"


class LivePage(Themed, QGraphicsView):
    """Shows a page in a `ParticipantWindow` that the mouse and the keys reach, at 100 % or as large as there is room.

    The page has a keyboard focus of its own, whatever the designer's is on, so that it looks as in a session: it
    receives keys while this view is focused. ``happened`` carries the session's events of the page, ``left`` comes at
    Esc, ``frame_due`` while a tank is seen, ``shown`` when the view is.
    """

    happened = Signal(object)
    left = Signal()
    frame_due = Signal()
    shown = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._scene = QGraphicsScene(self)
        self.setScene(self._scene)
        QApplication.sendEvent(self._scene, QEvent(QEvent.Type.WindowActivate))
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setRenderHints(QPainter.RenderHint.SmoothPixmapTransform | QPainter.RenderHint.TextAntialiasing)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleDescription(f"{LEAVES}, and so does Tab after its last control.")
        self.setMinimumHeight(120)
        self.setTransformationAnchor(QGraphicsView.ViewportAnchor.NoAnchor)
        self.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        self.page_window: ParticipantWindow | None = None
        self._proxy: QGraphicsProxyWidget | None = None
        self._view = ParticipantView()
        self._screen = SIZES[0]
        self._fits = True
        self._since_s = 0.0
        _OPEN.add(self)
        self._frames = QTimer(self)
        self._frames.setInterval(FRAME_MS)
        self._frames.timeout.connect(self.frame_due)

    # what is shown

    def show_view(self, view: ParticipantView) -> None:
        """Show a page; one that is the same but for its answers stays, with what was typed into it."""
        before, self._view = self._view, view
        self.setAccessibleName(view.name)
        self._colour_ground()
        if view.page is None:
            self._frames.stop()
            self.close_page()
            return
        another = (view.step, view.moment) != (before.step, before.moment)
        if another:
            self._since_s = time.monotonic()
        window = self.page_window
        if window is None or view.language != before.language or view.photodiode != before.photodiode:
            window = self._open(view)
        elif _stays_in_tank(before.page, view.page):
            window = window if isinstance(before.page, TaskPage) and before.page == view.page else self._open(view)
        elif _bare(view.page) == _bare(before.page) and not another:
            if view.focused != before.focused:
                self._go_to(view.focused)
            return
        kept = None if another else self._question_now()
        if window.page != view.page:
            window.show_page(view.page)
        if window.tank is not None:
            window.tank.unsetCursor()
        self._go_to(
            view.focused if view.focused is not None and view.focused != before.focused else kept or view.focused
        )
        self._time_frames()

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self._colour_ground()

    def _colour_ground(self) -> None:
        """Be dark around a page, as in a session, and like a card without one."""
        colour = self.theme.surface if self._view.page is None else PARTICIPANT.window
        self.setBackgroundBrush(QBrush(QColor(colour)))

    def show_screen(self, screen: ScreenSize) -> None:
        self._screen = screen
        if self._view.page is not None:
            self._open(self._view).show_page(self._view.page)
            self._go_to(self._view.focused)
            self._time_frames()
        self._scale()

    def show_fitted(self, *, fits: bool) -> None:
        """Show the whole page, or it at 100 %."""
        self._fits = fits
        self._scale()
        if not fits:
            self.horizontalScrollBar().setValue(0)
            self.verticalScrollBar().setValue(0)
            self._go_to(self._view.focused)

    def show_tank(self, view: TankView) -> None:
        if self.page_window is not None:
            self.page_window.show_view(view)

    @property
    def page_size(self) -> QSize:
        """The size that the page is made for [logical px]."""
        return QSize(self._screen.width, self._screen.height)

    @property
    def scale_now(self) -> float:
        """How large the page is drawn: 1 is 100 %."""
        if not self._fits:
            return 1.0
        return min(self.width() / self._screen.width, self.height() / self._screen.height)

    def _open(self, view: ParticipantView) -> ParticipantWindow:
        """Open another window in place of the present one."""
        self.close_page()
        made = ParticipantWindow(
            words(view.language),
            clock=lambda: time.monotonic() - self._since_s,
            windowed=True,
            text_scale=self._screen.text_scale,
            photodiode=view.photodiode,
        )
        made.event.connect(self.happened)
        made.resize(self.page_size)
        self.page_window = made
        self._proxy = self._scene.addWidget(made)
        self._scene.setFocusItem(self._proxy)
        self._scale()
        return made

    def close_page(self) -> None:
        if self.page_window is not None and self._proxy is not None:
            window, proxy = self.page_window, self._proxy
            self.page_window = self._proxy = None
            window.may_close = True
            window.event.disconnect(self.happened)
            proxy.hide()
            self._scene.removeItem(proxy)
            proxy.deleteLater()

    def _question_now(self) -> str | None:
        """Return the id of the question that has the page's focus."""
        page = None if self.page_window is None else self.page_window.widget
        if not isinstance(page, QuestionsPage):
            return None
        focused = page.window().focusWidget()
        return next(
            (one.view.id for one in page.fields if focused and (one is focused or one.isAncestorOf(focused))), None
        )

    def _go_to(self, question: str | None) -> None:
        if self._proxy is not None and self._scene.focusItem() is not self._proxy:
            self._scene.setFocusItem(self._proxy)
        page = None if self.page_window is None else self.page_window.widget
        if question is not None and isinstance(page, QuestionsPage):
            field = next((one for one in page.asked if one.view.id == question), None)
            if field is not None:
                page.go_to(field)
                if not self._fits:
                    top = field.mapTo(page.window(), QPoint(0, 0)).y()
                    self.ensureVisible(QRectF(0, top, 1, field.height()))

    def make_room(self, width: int) -> None:
        """Be as high as the page is in so much width, where it is shown whole."""
        high = math.ceil(width * self._screen.height / self._screen.width)
        self.setMaximumHeight(high if self._fits else QWIDGETSIZE_MAX)
        self._scale()

    def _scale(self) -> None:
        scale = self.scale_now
        self.setSceneRect(0, 0, self._screen.width, self._screen.height)
        policy = Qt.ScrollBarPolicy.ScrollBarAlwaysOff if self._fits else Qt.ScrollBarPolicy.ScrollBarAsNeeded
        self.setHorizontalScrollBarPolicy(policy)
        self.setVerticalScrollBarPolicy(policy)
        self.setTransform(QTransform.fromScale(scale, scale))

    def _time_frames(self) -> None:
        """Ask for frames only while a tank is seen."""
        seen = self.isVisible() and isinstance(self._view.page, TaskPage)
        if seen and not self._frames.isActive():
            self._frames.start()
        elif not seen:
            self._frames.stop()

    # Qt's events

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.left.emit()
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape:
            super().keyReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        QAbstractScrollArea.focusInEvent(self, event)
        say(self, LEAVES)
        self.viewport().update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        QAbstractScrollArea.focusOutEvent(self, event)
        self.viewport().update()

    def viewportEvent(self, event: QEvent) -> bool:
        if event.type() in {QEvent.Type.WindowActivate, QEvent.Type.WindowDeactivate}:
            return True
        return super().viewportEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = QPainter(self.viewport())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        whole = QRectF(self.viewport().rect())
        if self._fits:
            corners, inside = QPainterPath(), QPainterPath()
            corners.addRect(whole)
            inside.addRoundedRect(whole, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.fillPath(corners.subtracted(inside), QColor(self.theme.surface))
        if self.hasFocus():
            painter.setPen(QPen(QColor(self.theme.accent), RING))
            inset = whole.adjusted(1, 1, -1, -1)
            painter.drawRoundedRect(inset, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.setFont(font("small", weight=600))
            words = QRectF(painter.fontMetrics().boundingRect(LEAVES)).adjusted(-10, -4, 10, 4)
            words.moveBottomLeft(inset.bottomLeft() + QPointF(6, -6))
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(self.theme.accent))
            painter.drawRoundedRect(words, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.setPen(QColor(self.theme.on_accent))
            painter.drawText(words, Qt.AlignmentFlag.AlignCenter, LEAVES)
        painter.end()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._scale()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self._proxy is not None:
            self._proxy.show()
            self._scene.setFocusItem(self._proxy)
        self._time_frames()
        self.shown.emit()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._frames.stop()
        if self._proxy is not None and isValid(self._proxy):  # the scene is freed before a view that is still shown
            self._proxy.hide()


_OPEN: WeakSet[LivePage] = WeakSet()


@atexit.register
def _close_pages() -> None:
    """Close what is still open when the program ends: Qt cannot free a visible window within a scene after Python."""
    for page in tuple(_OPEN):
        if isValid(page):
            page.close_page()


def _bare(page: Page | None) -> Page | None:
    return replace(page, chosen=()) if isinstance(page, QuestionnairePage) else page


def _stays_in_tank(before: Page | None, page: Page) -> bool:
    """Return whether a session would keep the tank between two pages, with the interval alone changed."""
    return isinstance(before, TaskPage) and isinstance(page, TaskPage) and before.trial == page.trial
