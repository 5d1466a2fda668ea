"""The tab Participant: a preview with the real widgets of the participant's pages, and its controls."""

import atexit
import math
import time
from collections.abc import Mapping
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

from study_app.designer.document.elements import element_of, unique_name
from study_app.designer.document.study import Study
from study_app.designer.editing import Editing
from study_app.designer.form.fields import LANGUAGE
from study_app.designer.measures.study_facts import restored_part
from study_app.designer.participant.playable import (
    SIZES,
    STANDALONE,
    ParticipantView,
    ScreenSize,
    SessionStep,
    StepPosition,
    find_first_step,
    find_step,
    last_valid_study,
    moment_labels,
    step_id,
    step_label,
    trial_page_of,
)
from study_app.designer.parts import Segments, make_dense
from study_app.designer.problems import problem_rows
from study_app.designer.window import DesignerPlace, PanePage
from study_app.gui.display import choose_screens
from study_app.gui.kit import add_commands, command_tip, screen_number, settings_here, text_scale_on
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme import PARTICIPANT, RADIUS_CONTROL, Coloured, Theme, font
from study_app.gui.widgets import (
    QWIDGETSIZE_MAX,
    STRETCH,
    Card,
    Choice,
    IconButton,
    add_parts,
    announce,
    delayed_call,
    fill_rounded,
    hbox,
    label,
)
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Trial
from study_app.protocol.questions import Value
from study_app.protocol.source import Path, Places, value_at
from study_app.protocol.wording import LANGUAGES
from study_app.session.pages import DesignPage, Page, QuestionnairePage, TaskPage
from study_app.session.simulated.observers import ProgrammedBall
from study_app.session.tasks import TankView
from study_app.session.transitions.events import Chosen, Continue, LanguageChosen, Retracted, Submitted
from study_app.session.transitions.page_builder import (
    Moment,
    pages_of_step,
    presented_condition,
    preview,
    previewed_page,
)

_FRAME_MS: Final = 33
_RING: Final = 2
_LEAVE_HINT: Final = "Esc leaves the page"


class _LivePage(Coloured, QGraphicsView):
    """Shows a page in an interactive `ParticipantWindow`, at 100 % or scaled to fit.

    The page has its own keyboard focus, independent of the designer's, so that it looks as in a session; it receives
    keys while this view has the focus. Signals: ``happened`` (a session event of the page), ``left`` (Esc was
    pressed), ``frame_due`` (for each frame of a visible tank), ``shown`` (the view became visible and needs
    the current page).
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
        self.setAccessibleDescription(f"{_LEAVE_HINT}, as does Tab after the last control.")
        self.setMinimumHeight(120)
        self.setTransformationAnchor(QGraphicsView.ViewportAnchor.NoAnchor)
        self.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        self.page_window: ParticipantWindow | None = None
        self._proxy: QGraphicsProxyWidget | None = None
        self._view = ParticipantView()
        self._screen = SIZES[0]
        self._fits = True
        self._start_s = 0.0
        _OPEN_PAGES.add(self)
        self._frames = QTimer(self)
        self._frames.setInterval(_FRAME_MS)
        self._frames.timeout.connect(self.frame_due)

    # display

    def show_view(self, view: ParticipantView) -> None:
        """Show a page; if only the answers differ, the page is kept with its typed text."""
        previous, self._view = self._view, view
        self.setAccessibleName(view.name)
        self.viewport().setAccessibleName(view.name)
        self._colour_ground()
        if view.page is None:
            self._frames.stop()
            self.close_page()
            return
        is_other_page = (view.step, view.moment) != (previous.step, previous.moment)
        if is_other_page:
            self._start_s = time.perf_counter()
        window = self.page_window
        if window is None or view.language != previous.language or view.photodiode != previous.photodiode:
            window = self._open_page(view)
        elif (
            isinstance(previous.page, TaskPage)
            and isinstance(view.page, TaskPage)
            and previous.page.trial == view.page.trial
        ):
            window = window if previous.page == view.page else self._open_page(view)
        elif _without_answers(view.page) == _without_answers(previous.page) and not is_other_page:
            if view.focused != previous.focused:
                self._go_to(view.focused)
            return
        focused_question = None if is_other_page else self._focused_question()
        if window.page != view.page:
            window.show_page(view.page)
        if window.tank is not None:
            window.tank.unsetCursor()
        self._go_to(
            view.focused
            if view.focused is not None and view.focused != previous.focused
            else focused_question or view.focused
        )
        self._run_or_stop_frames()

    def apply_theme(self, theme: Theme) -> None:
        self._colour_ground()

    def _colour_ground(self) -> None:
        """Set the background: that of a session around a page, and that of a card if there is no page."""
        colour = self.theme.surface if self._view.page is None else PARTICIPANT.window
        self.setBackgroundBrush(QBrush(QColor(colour)))

    def show_screen(self, screen: ScreenSize) -> None:
        self._screen = screen
        if self._view.page is not None:
            self._open_page(self._view).show_page(self._view.page)
            self._go_to(self._view.focused)
            self._run_or_stop_frames()
        self._scale()

    def show_fitted(self, *, fits: bool) -> None:
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
        """The size for which the page is laid out [logical px]."""
        return QSize(self._screen.width, self._screen.height)

    @property
    def scale_now(self) -> float:
        """The scale of the displayed page: 1 is 100 %."""
        if not self._fits:
            return 1.0
        return min(self.width() / self._screen.width, self.height() / self._screen.height)

    def _open_page(self, view: ParticipantView) -> ParticipantWindow:
        self.close_page()
        window = ParticipantWindow(
            LANGUAGES[view.language],
            clock=lambda: time.perf_counter() - self._start_s,
            windowed=True,
            text_scale=self._screen.text_scale,
            photodiode=view.photodiode,
        )
        window.event.connect(self.happened)
        window.resize(self.page_size)
        self.page_window = window
        self._proxy = self._scene.addWidget(window)
        self._scene.setFocusItem(self._proxy)
        self._scale()
        return window

    def close_page(self) -> None:
        if self.page_window is not None and self._proxy is not None:
            window, proxy = self.page_window, self._proxy
            self.page_window = self._proxy = None
            window.may_close = True
            window.event.disconnect(self.happened)
            proxy.hide()
            self._scene.removeItem(proxy)
            proxy.deleteLater()

    def _focused_question(self) -> str | None:
        """Return the ID of the focused question, or None."""
        page = None if self.page_window is None else self.page_window.widget
        if not isinstance(page, QuestionsPage):
            return None
        focused = page.window().focusWidget()
        return next(
            (field.view.id for field in page.fields if focused and (field is focused or field.isAncestorOf(focused))),
            None,
        )

    def _go_to(self, question: str | None) -> None:
        if self._proxy is not None and self._scene.focusItem() is not self._proxy:
            self._scene.setFocusItem(self._proxy)
        page = None if self.page_window is None else self.page_window.widget
        if question is not None and isinstance(page, QuestionsPage):
            field = next((field for field in page.asked if field.view.id == question), None)
            if field is not None:
                page.go_to(field)
                if not self._fits:
                    top = field.mapTo(page.window(), QPoint(0, 0)).y()
                    self.ensureVisible(QRectF(0, top, 1, field.height()))

    def fit_height(self, width: int) -> None:
        """Limit the height to that of the page at this width, if the page is scaled to fit."""
        height = math.ceil(width * self._screen.height / self._screen.width)
        self.setMaximumHeight(height if self._fits else QWIDGETSIZE_MAX)
        self._scale()

    def _scale(self) -> None:
        scale = self.scale_now
        self.setSceneRect(0, 0, self._screen.width, self._screen.height)
        policy = Qt.ScrollBarPolicy.ScrollBarAlwaysOff if self._fits else Qt.ScrollBarPolicy.ScrollBarAsNeeded
        self.setHorizontalScrollBarPolicy(policy)
        self.setVerticalScrollBarPolicy(policy)
        self.setTransform(QTransform.fromScale(scale, scale))

    def _run_or_stop_frames(self) -> None:
        is_tank_visible = self.isVisible() and isinstance(self._view.page, TaskPage)
        if is_tank_visible and not self._frames.isActive():
            self._frames.start()
        elif not is_tank_visible:
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
        announce(self, _LEAVE_HINT)
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
        view_rect = QRectF(self.viewport().rect())
        if self._fits:
            corners, inside = QPainterPath(), QPainterPath()
            corners.addRect(view_rect)
            inside.addRoundedRect(view_rect, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.fillPath(corners.subtracted(inside), QColor(self.theme.surface))
        if self.hasFocus():
            painter.setPen(QPen(QColor(self.theme.accent), _RING))
            inset = view_rect.adjusted(1, 1, -1, -1)
            painter.drawRoundedRect(inset, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.setFont(font("small", weight=600))
            label = QRectF(painter.fontMetrics().boundingRect(_LEAVE_HINT)).adjusted(-10, -4, 10, 4)
            label.moveBottomLeft(inset.bottomLeft() + QPointF(6, -6))
            fill_rounded(painter, label, RADIUS_CONTROL, self.theme.accent)
            painter.setPen(QColor(self.theme.on_accent))
            painter.drawText(label, Qt.AlignmentFlag.AlignCenter, _LEAVE_HINT)
        painter.end()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._scale()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self._proxy is not None:
            self._proxy.show()
            self._scene.setFocusItem(self._proxy)
        self.shown.emit()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._frames.stop()
        if self._proxy is not None and isValid(self._proxy):  # at exit, Qt frees the scene before a visible view
            self._proxy.hide()


_OPEN_PAGES: WeakSet[_LivePage] = WeakSet()


@atexit.register
def _close_pages() -> None:
    """Close open pages at exit, because Qt cannot free a visible window in a scene after Python has ended."""
    for page in tuple(_OPEN_PAGES):
        if isValid(page):
            page.close_page()


def _without_answers(page: Page | None) -> Page | None:
    return replace(page, chosen=()) if isinstance(page, QuestionnairePage) else page


_NO_ANSWERS: Final[Mapping[str, Value]] = {}
_MAX_IN_ROW: Final = 2


class ParticipantPreview(Card):
    """The tab Participant: the page that shows the selected element, with language, screen, steps and pages.

    Orders are drawn with the seed of `session.preview`; no sealed key is read. Answers are kept while the study is
    open, so that an edit does not clear the page, but are not stored.
    """

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(padding=12, gap=10)
        self.editing, self.place = editing, place
        self.view = ParticipantView()
        self._screens_shown: tuple[ScreenSize, ...] = ()
        self._minimum_px = 0
        self.page = _LivePage()
        self.setFocusProxy(self.page)
        self.note = label("", "small", "warn", wraps=True)
        self.note.hide()
        self.languages = Segments("Page language")
        self.screens = make_dense(Choice(), "Screen")
        self.screens.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.screens.setMinimumContentsLength(9)
        self.aside = QWidget()
        hbox(self.languages, self.screens, spacing=10, margins=0, parent=self.aside)
        self.before = IconButton("chevron_left", "Previous step", "Previous step", size=36)
        self.after = IconButton("chevron", "Next step", "Next step", size=36)
        for button in (self.before, self.after):
            button.setAutoRepeat(True)
        self.step = label("", "label", wraps=True)
        self.step.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.moments = Segments("Trial page")
        self.zoom = Segments("Page size")
        self.zoom.show_values(((True, "Fit"), (False, "100 %")), chosen=True)
        parts = (self.before, (self.step, 1), self.after, self.moments, self.zoom)
        self._row, self._second = hbox(*parts, spacing=8), hbox(STRETCH)
        add_parts(self.column, self.note, (self.page, 1), self._row, self._second, STRETCH)

        self._language = ""
        self._step: SessionStep | None = None
        self._moment: Moment | None = None
        self._trial_page = "questions"
        self._selected: Path = ()
        self._protocol: Protocol | None = None
        self._study: Study | None = None
        self._valid: Study | None = None
        self._answers: dict[tuple[str, int], dict[str, Value]] = {}
        self._ball: ProgrammedBall | None = None
        self._ball_state: object = None
        self._start_s = 0.0
        self._photodiode = False
        self._update_timer = delayed_call(
            self, 0, self._show_if_visible
        )  # so that the form is painted first after another selection
        editing.opened_other.connect(self._forget_study)
        editing.changed.connect(self._update_timer.start)
        editing.edited.connect(self._show_if_visible)
        place.entered.connect(self._update_screens)
        application = QApplication.instance()
        assert isinstance(application, QApplication)  # noqa: S101 - a window has one
        application.focusChanged.connect(self._follow_focus)
        self.page.shown.connect(self._show_if_visible)
        self.page.happened.connect(self._handle_page_event)
        self.page.frame_due.connect(self._move_ball)
        self.page.left.connect(self._leave_page)
        self.languages.chosen.connect(lambda code: self.show_language(str(code)))
        self.screens.activated.connect(self._choose_screen)
        self.before.clicked.connect(lambda: self.go(-1))
        self.after.clicked.connect(lambda: self.go(1))
        self.moments.chosen.connect(self.show_moment)
        self.zoom.chosen.connect(self._show_fitted)
        page = PanePage(name="participant", title="Participant", body=self, aside=self.aside,
                        max_body_px=lambda: self.max_body_px, tip=command_tip("page"))  # fmt: skip
        place.pane.add_page(page, first=True)
        add_commands(place, {"page": self.enter_page, "language": self.show_next_language})
        self._update_screens()

    @property
    def position(self) -> StepPosition | None:
        """The position of the preview; None without a page, or if the page is not in the first session."""
        self._find_step()
        current = self._step
        if current is None or current.session:
            return None
        step = current.shown.schedule.steps[current.index]
        trial = step.index if isinstance(step, Trial) else 1
        return StepPosition(step_id(step), trial, self._language, current.shown.schedule.seed)

    # requests

    def enter_page(self) -> None:
        self._show_tab()
        self.page.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _leave_page(self) -> None:
        """Focus the first enabled control below the page."""
        part = next(part for part in (self.before, self.after, self.zoom) if part.isEnabled())
        part.setFocus(Qt.FocusReason.OtherFocusReason)

    def _show_tab(self) -> None:
        self.place.sides.chosen.emit("pane")
        self.place.pane.show_tab("participant")

    def show_next_language(self) -> None:
        """Show the pages in the next language; the focus moves to the tabs if the form is hidden."""
        form = self.place.form
        was_visible = form.isVisible()
        self._show_tab()
        if was_visible and not form.isVisible():
            self.place.pane.tabs.setFocus(Qt.FocusReason.ShortcutFocusReason)
        languages = self.view.languages
        if len(languages) > 1:
            self.show_language(languages[(languages.index(self.view.language) + 1) % len(languages)])

    def show_language(self, language: str) -> None:
        self._language = language
        self._show_step()

    def _follow_focus(self, _left: QWidget | None, focused: QWidget | None) -> None:
        """Show the pages in the language of the focused text."""
        language = focused.property(LANGUAGE) if focused is not None and self.place.form.isAncestorOf(focused) else None
        if language in self.view.languages and language != self._language:
            self._language = language
            self._update_timer.start()

    def go(self, offset: int) -> None:
        if (current := self._step) is None:
            return
        index = current.index + offset
        if 0 <= index < len(current.shown.schedule.steps):
            self._step = SessionStep(current.shown, index, current.session)
            self._moment = None
            self._show_step()

    def show_moment(self, moment: Moment) -> None:
        self._moment = moment
        self._trial_page = "tank" if moment.kind == "tank" else "questions"
        self._show_step()

    def _handle_page_event(self, event: object) -> None:
        """Keep an answer of this page, or go to the next page, as a session would."""
        if isinstance(event, LanguageChosen):
            self.show_language(event.language)
        elif isinstance(event, Chosen):
            self._answers.setdefault(self._page_key, {})[event.item] = event.value
            if isinstance(self.view.page, DesignPage):
                self._go_to_next()
        elif isinstance(event, Retracted):
            self._answers.get(self._page_key, {}).pop(event.item, None)
        elif isinstance(event, Submitted | Continue):
            self._go_to_next()

    def _go_to_next(self) -> None:
        if (current := self._step) is None:
            return
        pages = pages_of_step(current.shown, current.index)
        index = pages.index(self._moment) if self._moment in pages else 0
        if index + 1 < len(pages):
            self.show_moment(pages[index + 1])
        elif current.index + 1 < len(current.shown.schedule.steps):
            self._trial_page = "tank"
            self.go(1)

    # updates

    def _forget_study(self) -> None:
        self._step = self._moment = self._protocol = self._study = self._valid = None
        self._selected, self._answers, self._language = (), {}, ""
        self._trial_page = "questions"
        self._update_timer.start()

    def _update_screens(self) -> None:
        """Update the list of screens with this computer's participant screen, which may have changed."""
        settings, _ = settings_here()
        self._photodiode = settings.photodiode
        screen = choose_screens(screen_number(settings))[0]
        size = screen.size()
        own_size = ScreenSize("own", f"This machine's, {size.width()} × {size.height()}", size.width(), size.height(),
                         text_scale_on(settings, screen))  # fmt: skip
        self.offer_screens((*SIZES, own_size))

    def _show_if_visible(self) -> None:
        self._update_timer.stop()
        if self.editing.opened is not None and self.isVisible():
            self._show_step()

    def _find_step(self) -> None:
        """Find the shown step in the current study, or the step of another element if the selection changed."""
        opened = self.editing.opened
        if opened is None:
            return
        study, selected = opened.study, opened.selected
        if study is not self._study:
            self._study, previous_protocol = study, self._protocol
            if study.protocol is not None:
                self._valid = study
            elif self._valid is None and previous_protocol is None:
                self._valid = last_valid_study(opened)
            valid = {} if self._valid is None else self._valid.document
            self._protocol = study.protocol or restored_part(study, valid).protocol
            if self._protocol is None and self._valid is not None:
                self._protocol = self._valid.protocol
            if self._protocol is not None and previous_protocol is not None and self._step is not None:
                self._step = self._find_same_step(self._step)
        if self._protocol is None:
            self._step = None
        elif selected != self._selected or self._step is None:
            step = find_first_step(self._protocol, selected)
            if step is None and self._step is None:
                shown = preview(self._protocol)
                step = SessionStep(shown, 0) if shown.schedule.steps else None
            if step is not None:
                self._step = step if not self._keeps_trial(step) else self._step
            if (side := trial_page_of(selected)) is not None and selected != self._selected:
                self._trial_page, self._moment = side, None
            self._selected = selected
        if self._protocol is not None and self._language not in self._protocol.study.languages:
            self._language = self._protocol.study.languages[0]

    def _keeps_trial(self, step: SessionStep) -> bool:
        """Return whether the shown step is in the same block as ``step``, so that its trial is kept."""
        current = self._step
        if current is None or current.session != step.session or step.session == STANDALONE:
            return False
        current_step, new_step = (
            session_step.shown.schedule.steps[session_step.index] for session_step in (current, step)
        )
        shows_block = self._selected[:1] in {("questionnaires",), ("blocks",), ("scales",)}
        return step_id(current_step) == step_id(new_step) and (not isinstance(current_step, Trial) or shows_block)

    def _find_same_step(self, previous: SessionStep) -> SessionStep | None:
        assert self._protocol is not None  # noqa: S101 - checked by the caller
        step = previous.shown.schedule.steps[previous.index]
        if previous.session == STANDALONE:
            return find_first_step(self._protocol, self._selected)
        return find_step(self._protocol, step_id(step), step.index if isinstance(step, Trial) else 1, previous.session)

    # display

    def _show_step(self) -> None:
        self._find_step()
        study, current = self._study, self._step
        if study is None:
            return
        if current is None:
            faults = study.faults if study.is_toml else ()
            hiding_fault = next(
                (fault for fault in faults if fault.kind != "no text"), None
            )  # a missing text does not hide a page
            problems = study.problems[:1] if hiding_fault is None else (hiding_fault.located(Places.of(study.text)),)
            problem = next(map(str, problems), "the session does not have any steps")
            note = f"The page cannot be shown: {problem}"
            if hiding_fault is not None and study.is_unfinished(hiding_fault):
                note = "The page will be shown when its entry is complete"
            self.show_view(ParticipantView(note=note))
            return
        shown, index = current.shown, current.index
        pages = pages_of_step(shown, index)
        if self._moment not in pages:
            matching_pages = [moment for moment in pages if (moment.kind == "tank") == (self._trial_page == "tank")]
            self._moment = (matching_pages or list(pages))[0]
        page = previewed_page(
            shown, index, self._moment, self._language, self._answers.get(self._page_key, _NO_ANSWERS)
        )
        if isinstance(page, TaskPage):
            self._restart_ball(page, presented_condition(shown, index))
        session_step = shown.schedule.steps[index]
        step = step_label(shown, session_step, shown.protocol.study.languages[0])
        if current.session and current.session != STANDALONE:
            step = f"{step} ({current.session})"
        self.show_view(
            ParticipantView(
                page=page,
                language=self._language,
                languages=shown.protocol.study.languages,
                step=step,
                has_before=index > 0,
                has_after=index + 1 < len(shown.schedule.steps),
                moments=moment_labels(pages),
                moment=self._moment,
                focused=self._selected_question(study),
                note=self._page_note(study, current),
                photodiode=self._photodiode,
            )
        )

    @property
    def _page_key(self) -> tuple[str, int]:
        """The key of the page's answers: the ID of a page, form or block, and the trial (0 without one)."""
        assert self._step is not None  # noqa: S101 - a page is shown
        step = self._step.shown.schedule.steps[self._step.index]
        return step_id(step), step.index if isinstance(step, Trial) else 0

    def _selected_question(self, study: Study) -> str | None:
        if "items" not in self._selected:
            return None
        item = value_at(study.document, self._selected[: self._selected.index("items") + 2])
        name = item.get("id") if isinstance(item, Mapping) else None
        return name if isinstance(name, str) else None

    def _page_note(self, study: Study, step: SessionStep) -> str:
        """Return a note on parts of the page that are not shown as written in the study."""
        first = step.shown.protocol.study.languages[0]
        faults = [fault for fault in study.shown_faults if fault.concerns(self._language, first)]
        count = sum(
            row.fault.concerns(self._language, first) for row in problem_rows(study)
        )  # as counted in the header
        if not count:
            return "This page is not part of any session." if step.session == STANDALONE else ""
        values = "only the valid parts" if self._valid is None else "the last valid values"
        own_fault = next((fault for fault in faults if fault.path[: len(self._selected)] == self._selected), None)
        if own_fault is None:
            note = f"There {'is' if count == 1 else 'are'} {counted(count, 'problem')} elsewhere"
            first_name = unique_name(study.document, element_of(study, faults[0].path))
            note += f" ({first_name})" if count == 1 else f" (the first: {first_name})"
            return f"{note}, so {values} are shown."
        shown = f"{values} are shown"
        if own_fault.kind == "alike":
            shown = "the text is shown as written"
        elif own_fault.missing_language or own_fault.kind == "one language":
            shown = "the text is shown in another language"
        return f"{unique_name(study.document, self._selected)} has a problem ({own_fault.message}), so {shown}."

    def _restart_ball(self, page: TaskPage, condition: str | None) -> None:
        """Restart the ball on its path if the tank has changed."""
        assert self._step is not None  # noqa: S101 - a page is shown
        is_hidden = condition is not None and self._step.shown.protocol.conditions[condition].ball == "hidden"
        tank = (page.task, page.workspace_m, page.trial, self._moment, is_hidden)
        if tank != self._ball_state:
            self._ball_state = tank
            self._ball = ProgrammedBall(page.task, page.workspace_m, hidden_after_lead=is_hidden)
            self._start_s = time.perf_counter()

    def _move_ball(self) -> None:
        if self._ball is not None:
            self.page.show_tank(self._ball.view(time.perf_counter() - self._start_s))

    # the widgets

    def show_view(self, view: ParticipantView) -> None:
        previous, self.view = self.view, view
        self.setAccessibleName(view.name)
        if previous.language and view.language != previous.language:
            announce(self.languages, view.name)
        self.languages.tips = dict.fromkeys(view.languages, command_tip("language"))
        self.languages.setVisible(len(view.languages) > 1)
        self.languages.show_values([(code, code.upper()) for code in view.languages], view.language)
        self.note.setText(view.note)
        self.note.setVisible(bool(view.note))
        self.step.setText(view.step)
        self.before.setEnabled(view.has_before)
        self.after.setEnabled(view.has_after)
        self.moments.setVisible(bool(view.moments))
        self.moments.show_values(view.moments, view.moment)
        if len(view.moments) > _MAX_IN_ROW:
            self._second.insertWidget(0, self.moments)
        else:
            self._row.insertWidget(self._row.indexOf(self.after) + 1, self.moments)
        self.page.show_view(view)
        if view.languages != previous.languages:
            self.place.pane.arrange_parts()  # the width of the controls beside the tabs has changed
        if (
            minimum_px := self.column.minimumSize().height()
        ) != self._minimum_px:  # the note or the row of pages has changed
            self._minimum_px = minimum_px
            self.place.pane.arrange_parts()

    def offer_screens(self, sizes: tuple[ScreenSize, ...]) -> None:
        if sizes == self._screens_shown:
            return
        chosen = self.screens.currentData()
        self._screens_shown = sizes
        self.screens.clear()
        for size in sizes:
            self.screens.addItem(size.label, size.name)
        self.screens.setCurrentIndex(max(self.screens.findData(chosen), 0))
        self._choose_screen(self.screens.currentIndex())

    def _choose_screen(self, index: int) -> None:
        self.page.show_screen(self._screens_shown[index])
        self._fit_page()

    def _show_fitted(self, fits: object) -> None:
        self.zoom.show_values(((True, "Fit"), (False, "100 %")), fits)
        self.page.show_fitted(fits=bool(fits))
        self._fit_page()

    def _fit_page(self) -> None:
        margins = self.column.contentsMargins()
        self.page.fit_height(self.width() - margins.left() - margins.right())
        self.place.pane.arrange_parts()

    @property
    def max_body_px(self) -> int:
        """Maximum useful height; if the page is scaled to fit, that with the whole page [px]."""
        other = self.column.minimumSize().height() - self.page.minimumHeight()
        return min(QWIDGETSIZE_MAX, self.page.maximumHeight() + other)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_page()
