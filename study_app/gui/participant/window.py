"""The participant's window, which shows one page at a time, and the capture of a pointer that is the device."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread
from typing import Any, Final

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QCloseEvent,
    QColor,
    QCursor,
    QGuiApplication,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QRegion,
    QResizeEvent,
    QScreen,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from study_app.gui.display.screens import place_window
from study_app.gui.key_presses import ignores_clicks, key_presses
from study_app.gui.participant.forms.questionnaire import QuestionnaireWidget
from study_app.gui.participant.forms.questions_page import FormWidget
from study_app.gui.participant.intervals.answer_page import ChoiceWidget, FeedbackWidget, NumberWidget, SettingControls
from study_app.gui.participant.pages.page_widget import PageContext, PageWidget
from study_app.gui.participant.pages.text_page import NoticeWidget, PauseWidget, ReadingPage, TextWidget
from study_app.gui.participant.tank_widget import TankWidget, paint_ahead
from study_app.gui.theme.theme import PARTICIPANT, font, load_fonts, stylesheet
from study_app.gui.widgets.accessible import give_role
from study_app.gui.widgets.main_view import EscapeKey
from study_app.protocol.wording import Words, words
from study_app.session.pages import (
    ChoicePage,
    DesignPage,
    EndPage,
    FeedbackPage,
    NumberPage,
    Page,
    PausePage,
    QuestionnairePage,
    TaskPage,
    TextPage,
    TroublePage,
)
from study_app.session.tasks import TankView
from study_app.session.transitions.events import Continue, ForceStopped, PauseRequested

SHARE_OF_SCREEN = 0.6  # part of the screen's height over which the pointer moves the hand through the workspace
NOTCHES = 24  # wheel notches from the front to the back of the workspace
_NOTCH = 120  # turn of the wheel per notch [eighths of a degree]
_WITHOUT_GRAB = ("offscreen", "minimal")  # platforms without another window that could take the pointer
_BUTTONS = {Qt.MouseButton.LeftButton: 1 << 0, Qt.MouseButton.RightButton: 1 << 1}


class PointerCapture(QObject):
    """Captures the pointer while a widget is shown.

    ``moved(x, y, z)`` carries the hand's position [m, hand frame], which is kept between captures, and
    ``pressed(bits)`` the held buttons, of which bit 0 is the left one. The wheel, and motion with Shift, change the
    depth; forwards moves the hand away.
    """

    moved = Signal(float, float, float)
    pressed = Signal(int)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._widget: QWidget | None = None
        self._hand = [0.0, 0.0, 0.0]
        self._half = (0.0, 0.0, 0.0)
        self.gain = 0.0
        self._bits = 0
        self._last = QPoint()
        self._awaits_jump = False

    @property
    def is_held(self) -> bool:
        return self._widget is not None

    def capture(self, widget: QWidget, workspace_m: tuple[float, float, float]) -> None:
        """Hide the pointer in ``widget``; its motion moves the hand within the workspace (full sizes)."""
        self.release()
        self._widget = widget
        width, height, depth = workspace_m
        self._half = (width / 2, height / 2, depth / 2)
        self.gain = height / (SHARE_OF_SCREEN * widget.screen().geometry().height())
        widget.setCursor(Qt.CursorShape.BlankCursor)
        widget.setMouseTracking(True)
        widget.installEventFilter(self)
        if QGuiApplication.platformName() not in _WITHOUT_GRAB:
            widget.grabMouse()
        self._last = self._widget_centre()
        self._awaits_jump = False
        QCursor.setPos(self._last)
        self._move_hand(0.0, 0.0, 0.0)

    def release(self) -> None:
        """Release the pointer, and report its buttons as released."""
        if self._widget is None:
            return
        widget, self._widget = self._widget, None
        widget.removeEventFilter(self)
        if QWidget.mouseGrabber() is widget:
            widget.releaseMouse()
        widget.unsetCursor()
        if self._bits:
            self._bits = 0
            self.pressed.emit(0)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is not self._widget:
            return False
        if isinstance(event, QWheelEvent):
            self._move_hand(0.0, 0.0, -2 * self._half[2] * event.angleDelta().y() / _NOTCH / NOTCHES)
            return True
        if isinstance(event, QMouseEvent):
            if event.type() == QEvent.Type.MouseMove:
                self._follow_pointer(event.globalPosition().toPoint(), event.modifiers())
            else:
                bit = _BUTTONS.get(event.button(), 0)
                bits = self._bits & ~bit if event.type() == QEvent.Type.MouseButtonRelease else self._bits | bit
                if bits != self._bits:
                    self._bits = bits
                    self.pressed.emit(bits)
            return True
        return False

    def _widget_centre(self) -> QPoint:
        assert self._widget is not None  # noqa: S101  # called only while captured
        return self._widget.mapToGlobal(self._widget.rect().center())

    def _follow_pointer(self, position: QPoint, modifiers: Qt.KeyboardModifier) -> None:
        """Move the hand by the pointer's step; recentre the pointer if it is far from the centre."""
        assert self._widget is not None  # noqa: S101  # called only while captured
        centre = self._widget_centre()
        if self._awaits_jump and _distance_px(position, centre) < _distance_px(position, self._last):
            self._last, self._awaits_jump = centre, False
        step = position - self._last
        self._last = position
        right, down = step.x() * self.gain, step.y() * self.gain
        if modifiers & Qt.KeyboardModifier.ShiftModifier:
            self._move_hand(right, 0.0, down)
        else:
            self._move_hand(right, -down, 0.0)
        if (
            not self._awaits_jump
            and _distance_px(position, centre) > min(self._widget.width(), self._widget.height()) // 4
        ):
            self._recentre_pointer(centre)

    def _recentre_pointer(self, centre: QPoint) -> None:
        """Move the pointer to the centre and follow it from there.

        On X11, querying the position waits until the pointer has moved, so that the next motion starts at the centre.
        On other systems, motions from before may still arrive; they are relative to the last position, until one is
        closer to the centre than to the last position.
        """
        QCursor.setPos(centre)
        if QGuiApplication.platformName() == "xcb":
            QCursor.pos()
            self._last = centre
        else:
            self._awaits_jump = True

    def _move_hand(self, right: float, up: float, near: float) -> None:
        for axis, step in enumerate((right, up, near)):
            half = self._half[axis]
            self._hand[axis] = min(max(self._hand[axis] + step, -half), half)
        self.moved.emit(*self._hand)


def _distance_px(first: QPoint, other: QPoint) -> int:
    return (first - other).manhattanLength()


_WIDGETS: Final[dict[type[Page], Callable[[Any, PageContext], PageWidget]]] = {
    ChoicePage: ChoiceWidget,
    NumberPage: NumberWidget,
    FeedbackPage: FeedbackWidget,
    TextPage: TextWidget,
    TroublePage: NoticeWidget,
    EndPage: NoticeWidget,
}
LEAST_SIZE = QSize(1024, 640)
_WINDOWED_SIZE = QSize(1366, 768)
_PILOT_FRAME = 10
_WAITING_MS = 15
_TIME_UP_MS = 1500  # duration of "Time is up" before the questions
_AHEAD_MS = 100  # delay after which the next page is painted in advance
_SETTLING_MS = 100  # longest time without focus while it moves between the program's windows


class ParticipantWindow(QWidget):
    """Shows pages and emits the participant's actions.

    Parameters
    ----------
    wording : the interface's texts in the participant's language, until a page has another language
    clock : returns the seconds since the session's origin, for the times of events
    windowed : whether to open a window of at least 1024 × 640 instead of using the whole screen
    captures_pointer : whether to capture and hide the pointer in the tank, because it is the device
    pilot : whether a coloured frame and the title mark the session as a pilot
    text_scale : minimum scale of text for this screen and viewing distance
    on_card : whether the tank is drawn on a surface of the graphics card, in step with the screen
    photodiode : whether the tank has a corner for a photodiode
    strip : a widget above every page, if the operator has no separate screen

    While ``may_close`` is false, closing the window during a session pauses it.

    ``event`` carries the session's events; while the pointer is captured, ``pointer`` carries the hand's position [m]
    and ``buttons`` the held buttons; ``painted`` carries the sample time [ns] of every painted view. ``swapped`` is
    emitted after each buffer swap, ``left`` when the participant has closed the last page. ``painting`` is the last
    thread that painted a page in advance.
    """

    event = Signal(object)  # type: ignore[assignment]  # hides QWidget.event() from Python, not from Qt
    pointer = Signal(float, float, float)
    buttons = Signal(int)
    painted = Signal(object)
    swapped = Signal()
    left = Signal()

    def __init__(
        self,
        wording: Words,
        *,
        clock: Callable[[], float],
        windowed: bool = False,
        captures_pointer: bool = False,
        pilot: bool = False,
        text_scale: float = 1.0,
        on_card: bool = False,
        strip: QWidget | None = None,
        photodiode: bool = True,
    ) -> None:
        super().__init__()
        load_fonts()
        self.strip = strip
        self._on_card = on_card
        self._photodiode = photodiode
        self._words = wording
        self._clock = clock
        self.text_scale = text_scale
        self._windowed = windowed
        self._captures = captures_pointer
        self.may_close = False
        self.painting: Thread | None = None
        self.frame_px = _PILOT_FRAME if pilot else 0
        self._page: Page | None = None
        self._presses = key_presses()
        self._widget: PageWidget | TankWidget = self._make_waiting_page(wording.preparing)
        self._capture = PointerCapture(self)
        self._capture.moved.connect(self.pointer)
        self._capture.pressed.connect(self._handle_click)
        self.settling = QTimer(self, interval=_SETTLING_MS)
        self.settling.timeout.connect(self._pause_if_left)
        self.waiting = QTimer(self, interval=_WAITING_MS)
        self.waiting.timeout.connect(self._show_if_painted)
        self.time_up = QTimer(self, singleShot=True, interval=_TIME_UP_MS)
        self.time_up.timeout.connect(self._show_questions)
        self._ahead_timer = QTimer(self, singleShot=True, interval=_AHEAD_MS)
        self._ahead_timer.timeout.connect(self._paint_ahead)
        self._escape = EscapeKey(self)
        self._escape.held.connect(self._stop_force)
        self._escape.tapped.connect(self._ask_to_pause)
        self.installEventFilter(self._escape)
        self._pilot = pilot
        self._set_title()
        self.setObjectName("participant")
        self.setFont(font("body"))
        self.given_theme = PARTICIPANT
        self.setStyleSheet(stylesheet(PARTICIPANT))
        self.setMinimumSize(LEAST_SIZE)
        give_role(self, QAccessible.Role.Window)
        if strip is not None:
            strip.setParent(self)

    @property
    def page(self) -> Page | None:
        """The current page; None before the first and while "Time is up" is shown."""
        return None if self.time_up.isActive() else self._page

    @property
    def widget(self) -> PageWidget | TankWidget:
        return self._widget

    @property
    def tank(self) -> TankWidget | None:
        """The tank if it is shown."""
        return self._widget if isinstance(self._widget, TankWidget) else None

    def open_on(self, screen: QScreen | None = None) -> None:
        """Open the window on ``screen`` (None: the system's choice), full-screen unless windowed."""
        give_role(self, QAccessible.Role.Window)  # again, since connecting signals to its methods removes it
        if screen is not None:
            self.setScreen(screen)
            self.move(screen.geometry().topLeft())
        if self._windowed:
            self.resize(_WINDOWED_SIZE)
            place_window(self, self.screen(), corner=False)
            self.show()
        else:
            self.setGeometry(self.screen().geometry())
            self.showFullScreen()
        self.activateWindow()

    def bring_forward(self) -> None:
        self.raise_()
        self.activateWindow()

    def show_page(self, page: Page) -> None:
        """Replace the current page at once, but keep the tank during the intervals of a trial."""
        tank = self.tank
        if isinstance(page, TaskPage) and page.interval and tank is not None and tank.page.trial == page.trial:
            self._page = page
            tank.show_interval(page)
            return
        self._capture.release()
        self.waiting.stop()
        self.time_up.stop()
        if isinstance(page, TextPage) and page.language != self._words.language:
            self._words = words(page.language)
            self._set_title()
        self._page = page
        is_time_up = tank is not None and tank.page.interval is None and tank.time_is_up
        if isinstance(page, QuestionnairePage) and is_time_up:
            self.time_up.start()
            self._show_widget(self._make_waiting_page(self._words.time_is_up))
        elif isinstance(page, TaskPage) and self.painting is not None and self.painting.is_alive():
            self.waiting.start()
            self._show_widget(self._make_waiting_page(self._words.trouble_title))
        else:
            self._show_widget(self._make_widget(page, self._widget))

    def _show_widget(self, widget: PageWidget | TankWidget) -> None:
        self._presses.begin_page(widget)
        old = self._widget
        if isinstance(old, TankWidget):
            old.painted.disconnect(self.painted)  # so that a late frame of this trial does not begin the next one
        widget.setGeometry(self._page_area())
        if isinstance(widget, TankWidget):
            widget.paint_ahead()
        self._widget = widget
        widget.show()
        widget.raise_()
        if isinstance(widget, TankWidget):
            self.activateWindow()
            self.setFocus()
            widget.setCursor(Qt.CursorShape.BlankCursor)
            if self._captures:
                self._capture.capture(widget, widget.page.workspace_m)
        else:
            widget.focus_first()
        old.hide()  # after the new widget has the focus, which Qt would move otherwise
        old.deleteLater()
        if isinstance(widget, TankWidget):
            widget.repaint()  # completely, so that the first view is not delayed
        self._ahead_timer.start()

    def show_view(self, view: TankView) -> None:
        if self.tank is not None:
            self.tank.show_view(view)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        controls = None if self.tank is None else self.tank.controls
        if controls is not None and controls.press_key(event):
            return
        key = event.key()
        if key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._can_leave_tank():
            self.event.emit(Continue(self._clock()))
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        super().keyReleaseEvent(event)
        if self.tank is not None and self.tank.controls is not None:
            self.tank.controls.release_key(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.tank is not None and self.tank.controls is not None:
            self.tank.controls.turn_wheel(event)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() != QEvent.Type.ActivationChange or self.tank is None:
            return
        if self.tank.controls is not None and not self.isActiveWindow():
            self.tank.controls.stop_stepping()
        if not self._captures:
            return
        if self.isActiveWindow() and self.isVisible() and not self._capture.is_held:
            self._capture.capture(self.tank, self.tank.page.workspace_m)
        elif not self.isActiveWindow() and self._capture.is_held:
            self._capture.release()
            self.tank.setCursor(Qt.CursorShape.BlankCursor)
            self.settling.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self.strip is not None:
            area = self._page_area()
            self.strip.setGeometry(area.left(), self.frame_px, area.width(), self.strip.height())
        self._widget.setGeometry(self._page_area())
        self._ahead_timer.start()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Pause instead of closing, since the participant must not end a session by accident."""
        if not self.may_close and not isinstance(self._page, EndPage | None):
            event.ignore()
            self._ask_to_pause()
            return
        self._capture.release()
        super().closeEvent(event)
        if not self.may_close:
            self.left.emit()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Fill the area around the page, or paint a pilot's frame."""
        painter = QPainter(self)
        painter.setClipRegion(QRegion(self.rect()) - QRegion(self._widget.geometry()))
        painter.fillRect(self.rect(), QColor(PARTICIPANT.warn if self.frame_px else PARTICIPANT.window))
        painter.end()

    def _paint_ahead(self) -> None:
        """Paint the tank that follows a text or a pause while that page is shown."""
        if isinstance(self._page, TextPage | PausePage) and self._page.coming is not None:
            size, ratio = self._page_area().size(), self.devicePixelRatioF()
            self.painting = paint_ahead(self._page.coming, self._words, self.text_scale, size, ratio)

    def _make_waiting_page(self, title: str) -> ReadingPage:
        column = ("clock", title, (), PARTICIPANT.accent)
        return ReadingPage(column, self._context)

    def _show_if_painted(self) -> None:
        """Replace the waiting page by the tank once it is painted."""
        if isinstance(self._page, TaskPage) and self.painting is not None and not self.painting.is_alive():
            self.waiting.stop()
            self._show_widget(self._make_widget(self._page, self._widget))

    def _show_questions(self) -> None:
        """Replace the page "Time is up" by the questions."""
        if isinstance(self._page, QuestionnairePage):
            self._show_widget(self._make_widget(self._page, self._widget))

    def _set_title(self) -> None:
        self.setWindowTitle(self._words.window_title + (" – pilot" if self._pilot else ""))
        self.setAccessibleName(self.windowTitle())

    def _page_area(self) -> QRect:
        frame = self.frame_px
        above = self.strip.height() if self.strip is not None else 0
        return self.rect().adjusted(frame, frame + above, -frame, -frame)

    @property
    def _context(self) -> PageContext:
        return PageContext(self._words, self._clock, self, self.text_scale, by_mouse=self._captures)

    def _make_widget(self, page: Page, old: QWidget) -> PageWidget | TankWidget:
        if isinstance(page, TaskPage):
            return self._make_tank(page)
        context = self._context
        if isinstance(page, PausePage):  # over a picture of the page, or that of the pause before
            picture = old.grab() if old.width() > 0 else None
            widget: PageWidget = PauseWidget(page, context, old.under if isinstance(old, PauseWidget) else picture)
        elif isinstance(page, QuestionnairePage):
            widget = (QuestionnaireWidget if page.labels else FormWidget)(page, context)
        else:
            widget = _WIDGETS[type(page)](page, context)
        widget.event_made.connect(self.event)
        return widget

    def _make_tank(self, page: TaskPage) -> TankWidget:
        tank = TankWidget(
            page,
            self._words,
            self,
            text_scale=self.text_scale,
            on_card=self._on_card,
            photodiode=self._photodiode,
            by_mouse=self._captures,
        )
        tank.painted.connect(self.painted)
        tank.swapped.connect(self.swapped)
        if page.question:
            tank.controls = SettingControls(page, self._words, self._clock, tank, buttons=not self._captures)
            tank.controls.event_made.connect(self.event)
        return tank

    def _can_leave_tank(self) -> bool:
        return self.tank is not None and self.tank.may_leave

    def _handle_click(self, bits: int) -> None:
        """Handle a click of the captured mouse: continue as with Space if allowed, otherwise emit the device button."""
        if bits and ignores_clicks(self._widget):
            return
        if bits & _BUTTONS[Qt.MouseButton.LeftButton] and self._can_leave_tank():
            self.event.emit(Continue(self._clock()))
        else:
            self.buttons.emit(bits)

    def _pause_if_left(self) -> None:
        """Pause if the pointer is the device and another program, not the operator's window, is active."""
        if self.tank is None or self._capture.is_held:
            self.settling.stop()
        elif QGuiApplication.focusWindow() is None:
            self.settling.stop()
            self._ask_to_pause()

    def _ask_to_pause(self) -> None:
        """Pause the session, or close the last page."""
        if isinstance(self._page, TextPage | TaskPage | QuestionnairePage | DesignPage | FeedbackPage):
            self.event.emit(PauseRequested(self._clock(), "participant"))
        elif isinstance(self._page, EndPage):
            self.close()

    def _stop_force(self) -> None:
        if self._page is not None:
            self.event.emit(ForceStopped(self._clock(), "participant"))
