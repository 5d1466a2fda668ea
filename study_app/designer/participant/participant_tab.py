"""The tab Participant: the live page at its real size, with language, screen, steps and pages."""

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
    QWidget,
)
from shiboken6 import isValid

from study_app.designer.participant.shown_step import SIZES, ParticipantView, ScreenSize
from study_app.designer.place.segments import Segments
from study_app.gui.kit.commands import key_cap, tip
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card
from study_app.gui.widgets.controls import Cap, Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.numbers import NumberField
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
        """Draw the ball."""
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
            view.words,
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
        """Close the participant's window."""
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
        """Put the page's focus on a question."""
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
    """Return a page without answers."""
    return replace(page, chosen=()) if isinstance(page, QuestionnairePage) else page


def _stays_in_tank(before: Page | None, page: Page) -> bool:
    """Return whether a session would keep the tank between two pages, with the interval alone changed."""
    return isinstance(before, TaskPage) and isinstance(page, TaskPage) and before.trial == page.trial


MOST_IN_ROW: Final = 2
TRIAL_PX: Final = 48
BAR_PX: Final = 34
"""The height of what stands beside the tabs."""


class ParticipantTab(Card):
    """Draws a `ParticipantView`.

    ``aside`` holds language and screen, for the right of the tabs; `fit_aside` gives it room.

    Signals: ``language_asked`` (code), ``step_asked`` (−1 or 1), ``trial_asked`` (its number in its block),
    ``moment_asked`` (moment), ``resized`` when it needs another height or ``aside`` another width; ``happened``,
    ``frame_due`` and ``shown`` as of `LivePage`.
    """

    language_asked = Signal(str)
    step_asked = Signal(int)
    trial_asked = Signal(int)
    moment_asked = Signal(object)
    happened = Signal(object)
    frame_due = Signal()
    shown = Signal()
    resized = Signal()

    def __init__(self) -> None:
        super().__init__(padding=12, gap=10)
        self.view = ParticipantView()
        self._screens_shown: tuple[ScreenSize, ...] = ()
        self._high = 0
        self.page = LivePage()
        self.setFocusProxy(self.page)
        self.note = label("", "small", "warn", wraps=True)
        self.note.hide()
        self.languages = Segments("Language of the page")
        self.language_key = Cap(key_cap("language"))
        self.language_key.setToolTip(tip("language"))
        self.screens = Choice()
        self.screens.setAccessibleName("Screen")
        self.screens.setFont(font("label"))
        self.screens.setProperty("dense", "true")
        self.screens.setFixedHeight(BAR_PX)
        self.screens.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.screens.setMinimumContentsLength(9)
        self.aside = QWidget()
        hbox(self.languages, self.language_key, self.screens, spacing=10, margins=0, parent=self.aside)
        self.before = IconButton("chevron_left", "Previous step", "Previous step", size=36)
        self.after = IconButton("chevron", "Next step", "Next step", size=36)
        for button in (self.before, self.after):
            button.setAutoRepeat(True)
        self.step = label("", "label", wraps=True)
        self.trial, self.trials = NumberField(), label("", "label")
        self.trial.setFixedWidth(TRIAL_PX)
        self.trial.setToolTip("Trial of the block; Play from here begins with it")
        self.moments = Segments("Page of the trial")
        self.zoom = Segments("Size of the page")
        self.zoom.show_values(((True, "Fit"), (False, "100 %")), chosen=True)
        parts = (self.before, (self.step, 1), self.trial, self.trials, self.after, self.moments, self.zoom)
        self._row, self._second = hbox(*parts, spacing=8), hbox(STRETCH)
        add_parts(self.column, self.note, (self.page, 1), self._row, self._second, STRETCH)
        self._connect()

    def _connect(self) -> None:
        page = self.page
        page.happened.connect(self.happened)
        page.frame_due.connect(self.frame_due)
        page.shown.connect(self.shown)
        page.left.connect(lambda: self.before.setFocus(Qt.FocusReason.OtherFocusReason))
        self.languages.chosen.connect(lambda code: self.language_asked.emit(str(code)))
        self.screens.activated.connect(self._choose_screen)
        self.before.clicked.connect(lambda: self.step_asked.emit(-1))
        self.after.clicked.connect(lambda: self.step_asked.emit(1))
        self.trial.entered.connect(lambda number: self.trial_asked.emit(round(number)))
        self.trial.unread.connect(lambda _text: self.trial.put_back())
        self.trial.stepped.connect(lambda steps: self.trial_asked.emit(self.view.trial + steps))
        self.moments.chosen.connect(self.moment_asked)
        self.zoom.chosen.connect(self._show_fitted)

    def show_view(self, view: ParticipantView) -> None:
        before, self.view = self.view, view
        self.setAccessibleName(view.name)
        if before.language and view.language != before.language:
            say(self.languages, view.name)
        self.languages.tips = dict.fromkeys(view.languages, tip("language"))
        self.languages.setVisible(len(view.languages) > 1)
        self.languages.show_values([(code, code.upper()) for code in view.languages], view.language)
        self.note.setText(view.note)
        self.note.setVisible(bool(view.note))
        self._show_step(view)
        self.before.setEnabled(view.has_before)
        self.after.setEnabled(view.has_after)
        self.moments.setVisible(bool(view.moments))
        self.moments.show_values(view.moments, view.moment)
        if len(view.moments) > MOST_IN_ROW:
            self._second.insertWidget(0, self.moments)
        else:
            self._row.insertWidget(self._row.indexOf(self.after) + 1, self.moments)
        self.page.show_view(view)
        if view.languages != before.languages:
            self.resized.emit()  # the controls beside the tabs have another width
        if (high := self.column.minimumSize().height()) != self._high:  # another note, or another row of pages
            self._high = high
            self.resized.emit()

    def _show_step(self, view: ParticipantView) -> None:
        """Name the step; the number of a trial is a field."""
        before, after = view.around_trial if view.trials else (view.step, "")
        sides = Qt.AlignmentFlag.AlignVCenter
        self.step.setText(before)
        self.step.setAlignment(sides | (Qt.AlignmentFlag.AlignRight if after else Qt.AlignmentFlag.AlignHCenter))
        self.trials.setText(after)
        for part in (self.trial, self.trials):
            part.setVisible(bool(after))
        self.trial.setAccessibleName(f"{before}, 1 to {view.trials}; Play from here begins with it")
        self.trial.show_text(str(view.trial))

    def fit_aside(self, room_px: int) -> None:
        """Show the key of the languages where there is room for it."""
        self.language_key.setVisible(len(self.view.languages) > 1)
        self.language_key.setVisible(len(self.view.languages) > 1 and self.aside.sizeHint().width() <= room_px)

    def show_tank(self, view: TankView) -> None:
        """Draw the ball in the tank."""
        self.page.show_tank(view)

    def offer_screens(self, sizes: tuple[ScreenSize, ...]) -> None:
        """Offer screens to show the page for."""
        if sizes == self._screens_shown:
            return
        chosen = self.screens.currentData()
        self._screens_shown = sizes
        self.screens.clear()
        for size in sizes:
            self.screens.addItem(size.words, size.name)
        self.screens.setCurrentIndex(max(self.screens.findData(chosen), 0))
        self._choose_screen(self.screens.currentIndex())

    def _choose_screen(self, at: int) -> None:
        self.page.show_screen(self._screens_shown[at])
        self._make_room()

    def _show_fitted(self, fits: object) -> None:
        self.zoom.show_values(((True, "Fit"), (False, "100 %")), fits)
        self.page.show_fitted(fits=bool(fits))
        self._make_room()

    def _make_room(self) -> None:
        margins = self.column.contentsMargins()
        self.page.make_room(self.width() - margins.left() - margins.right())
        self.resized.emit()

    @property
    def most_px(self) -> int:
        """The height that it can use: where the page is shown whole, no more than that needs [px]."""
        other = self.column.minimumSize().height() - self.page.minimumHeight()
        return min(QWIDGETSIZE_MAX, self.page.maximumHeight() + other)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()
