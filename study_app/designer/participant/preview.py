"""The participant's page of the study that is edited: its real widgets, with language, screen, steps and pages."""

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
    Found,
    ParticipantView,
    ScreenSize,
    StepPosition,
    first_showing,
    last_valid_study,
    moment_labels,
    same_step,
    side_of,
    step_label,
    step_name,
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
_LEAVES: Final = "Esc leaves the page"


class _LivePage(Coloured, QGraphicsView):
    """Shows a page in an interactive `ParticipantWindow`, at 100 % or as large as it fits.

    The page has its own keyboard focus, independent of the designer's, so that it looks as in a session; it receives
    keys while this view is focused. ``happened`` carries the page's session events, ``left`` is emitted at Esc,
    ``frame_due`` while a tank is visible, ``shown`` when the view is.
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
        self.setAccessibleDescription(f"{_LEAVES}, as does Tab after the last control.")
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
        self._frames.setInterval(_FRAME_MS)
        self._frames.timeout.connect(self.frame_due)

    # display

    def show_view(self, view: ParticipantView) -> None:
        """Show a page; if only its answers differ, it is kept with the typed text."""
        before, self._view = self._view, view
        self.setAccessibleName(view.name)
        self.viewport().setAccessibleName(view.name)
        self._colour_ground()
        if view.page is None:
            self._frames.stop()
            self.close_page()
            return
        another = (view.step, view.moment) != (before.step, before.moment)
        if another:
            self._since_s = time.perf_counter()
        window = self.page_window
        if window is None or view.language != before.language or view.photodiode != before.photodiode:
            window = self._open_page(view)
        elif (
            isinstance(before.page, TaskPage)
            and isinstance(view.page, TaskPage)
            and before.page.trial == view.page.trial
        ):
            window = window if before.page == view.page else self._open_page(view)
        elif _without_answers(view.page) == _without_answers(before.page) and not another:
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
        self._colour_ground()

    def _colour_ground(self) -> None:
        """Set the background: dark around a page, as in a session, and that of a card without one."""
        colour = self.theme.surface if self._view.page is None else PARTICIPANT.window
        self.setBackgroundBrush(QBrush(QColor(colour)))

    def show_screen(self, screen: ScreenSize) -> None:
        self._screen = screen
        if self._view.page is not None:
            self._open_page(self._view).show_page(self._view.page)
            self._go_to(self._view.focused)
            self._time_frames()
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
        made = ParticipantWindow(
            LANGUAGES[view.language],
            clock=lambda: time.perf_counter() - self._since_s,
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
        """Return the id of the focused question."""
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

    def make_room(self, width: int) -> None:
        """Use the page's height at this width if it is shown completely."""
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
        announce(self, _LEAVES)
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
            painter.setPen(QPen(QColor(self.theme.accent), _RING))
            inset = whole.adjusted(1, 1, -1, -1)
            painter.drawRoundedRect(inset, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.setFont(font("small", weight=600))
            label = QRectF(painter.fontMetrics().boundingRect(_LEAVES)).adjusted(-10, -4, 10, 4)
            label.moveBottomLeft(inset.bottomLeft() + QPointF(6, -6))
            fill_rounded(painter, label, RADIUS_CONTROL, self.theme.accent)
            painter.setPen(QColor(self.theme.on_accent))
            painter.drawText(label, Qt.AlignmentFlag.AlignCenter, _LEAVES)
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


_OPEN: WeakSet[_LivePage] = WeakSet()


@atexit.register
def _close_pages() -> None:
    """Close open pages when the program ends: Qt cannot free a visible window in a scene after Python."""
    for page in tuple(_OPEN):
        if isValid(page):
            page.close_page()


def _without_answers(page: Page | None) -> Page | None:
    return replace(page, chosen=()) if isinstance(page, QuestionnairePage) else page


_NO_ANSWERS: Final[Mapping[str, Value]] = {}
_MOST_IN_ROW: Final = 2


class ParticipantPreview(Card):
    """The tab Participant: the page that shows the selected element, with language, screen, steps and pages.

    It is drawn with the seed of `session.preview`; no sealed key is read. Answers are kept while the study is open, so
    that an edit does not clear the page, and are not stored.
    """

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(padding=12, gap=10)
        self.editing, self.place = editing, place
        self.view = ParticipantView()
        self._screens_shown: tuple[ScreenSize, ...] = ()
        self._high = 0
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
        self._found: Found | None = None
        self._moment: Moment | None = None
        self._side = "questions"
        self._selected: Path = ()
        self._protocol: Protocol | None = None
        self._study: Study | None = None
        self._valid: Study | None = None
        self._answers: dict[tuple[str, int], dict[str, Value]] = {}
        self._ball: ProgrammedBall | None = None
        self._ball_of: object = None
        self._since_s = 0.0
        self._photodiode = False
        self._after_form = delayed_call(
            self, 0, self._show_if_visible
        )  # after another selection the form is painted first
        editing.opened_other.connect(self._forget_study)
        editing.changed.connect(self._after_form.start)
        editing.edited.connect(self._show_if_visible)
        place.entered.connect(self._look_at_screen)
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
        page = PanePage(name="participant", words="Participant", body=self, aside=self.aside,
                        most_px=lambda: self.most_px, tip=command_tip("page"))  # fmt: skip
        place.pane.add_page(page, first=True)
        add_commands(place, {"page": self.enter_page, "language": self.show_next_language})
        self._look_at_screen()

    @property
    def position(self) -> StepPosition | None:
        """The previewed position; None if there is none, or the page is not in the first session."""
        self._find_step()
        shown = self._found
        if shown is None or shown.session:
            return None
        step = shown.shown.schedule.steps[shown.index]
        trial = step.index if isinstance(step, Trial) else 1
        return StepPosition(step_name(step), trial, self._language, shown.shown.schedule.seed)

    # requests

    def enter_page(self) -> None:
        self._show_tab()
        self.page.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _leave_page(self) -> None:
        """Focus the first control below the page; the first step has no previous one."""
        part = next(part for part in (self.before, self.after, self.zoom) if part.isEnabled())
        part.setFocus(Qt.FocusReason.OtherFocusReason)

    def _show_tab(self) -> None:
        self.place.sides.chosen.emit("pane")
        self.place.pane.show_tab("participant")

    def show_next_language(self) -> None:
        """Show the pages in the next language; the keyboard focus stays, if its part is still visible."""
        form = self.place.form
        hides = form.isVisible()
        self._show_tab()
        if hides and not form.isVisible():
            self.place.pane.tabs.setFocus(Qt.FocusReason.ShortcutFocusReason)
        languages = self.view.languages
        if len(languages) > 1:
            self.show_language(languages[(languages.index(self.view.language) + 1) % len(languages)])

    def show_language(self, language: str) -> None:
        self._language = language
        self._show_step()

    def _follow_focus(self, _left: QWidget | None, now: QWidget | None) -> None:
        """Show the pages in the language of the text that is edited."""
        language = now.property(LANGUAGE) if now is not None and self.place.form.isAncestorOf(now) else None
        if language in self.view.languages and language != self._language:
            self._language = language
            self._after_form.start()

    def go(self, by: int) -> None:
        if (shown := self._found) is None:
            return
        index = shown.index + by
        if 0 <= index < len(shown.shown.schedule.steps):
            self._found = Found(shown.shown, index, shown.session)
            self._moment = None
            self._show_step()

    def show_moment(self, moment: Moment) -> None:
        self._moment = moment
        self._side = "tank" if moment.kind == "tank" else "questions"
        self._show_step()

    def _handle_page_event(self, event: object) -> None:
        """Keep an answer for this page; go to the next page when the participant would."""
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
        if (shown := self._found) is None:
            return
        pages = pages_of_step(shown.shown, shown.index)
        at = pages.index(self._moment) if self._moment in pages else 0
        if at + 1 < len(pages):
            self.show_moment(pages[at + 1])
        elif shown.index + 1 < len(shown.shown.schedule.steps):
            self._side = "tank"
            self.go(1)

    # updates

    def _forget_study(self) -> None:
        self._found = self._moment = self._protocol = self._study = self._valid = None
        self._selected, self._answers, self._language = (), {}, ""
        self._side = "questions"
        self._after_form.start()

    def _look_at_screen(self) -> None:
        """Offer this computer's participant screen, which may have been changed elsewhere."""
        settings, _ = settings_here()
        self._photodiode = settings.photodiode
        screen = choose_screens(screen_number(settings))[0]
        size = screen.size()
        own = ScreenSize("own", f"This machine's, {size.width()} × {size.height()}", size.width(), size.height(),
                         text_scale_on(settings, screen))  # fmt: skip
        self.offer_screens((*SIZES, own))

    def _show_if_visible(self) -> None:
        self._after_form.stop()
        if self.editing.opened is not None and self.isVisible():
            self._show_step()

    def _find_step(self) -> None:
        """Find the displayed step in the current study; another step if another element was selected."""
        opened = self.editing.opened
        if opened is None:
            return
        study, selected = opened.study, opened.selected
        if study is not self._study:
            self._study, before = study, self._protocol
            if study.protocol is not None:
                self._valid = study
            elif self._valid is None and before is None:
                self._valid = last_valid_study(opened)
            valid = {} if self._valid is None else self._valid.document
            self._protocol = study.protocol or restored_part(study, valid).protocol
            if self._protocol is None and self._valid is not None:
                self._protocol = self._valid.protocol
            if self._protocol is not None and before is not None and self._found is not None:
                self._found = self._same_step(self._found)
        if self._protocol is None:
            self._found = None
        elif selected != self._selected or self._found is None:
            step = first_showing(self._protocol, selected)
            if step is None and self._found is None:
                shown = preview(self._protocol)
                step = Found(shown, 0) if shown.schedule.steps else None
            if step is not None:
                self._found = step if not self._is_shown(step) else self._found
            if (side := side_of(selected)) is not None and selected != self._selected:
                self._side, self._moment = side, None
            self._selected = selected
        if self._protocol is not None and self._language not in self._protocol.study.languages:
            self._language = self._protocol.study.languages[0]

    def _is_shown(self, step: Found) -> bool:
        """Return whether the displayed step belongs to the same block, so that its trial is kept."""
        now = self._found
        if now is None or now.session != step.session or step.session == STANDALONE:
            return False
        old, other = (here.shown.schedule.steps[here.index] for here in (now, step))
        whole = self._selected[:1] in {("questionnaires",), ("blocks",), ("scales",)}
        return step_name(old) == step_name(other) and (not isinstance(old, Trial) or whole)

    def _same_step(self, previous: Found) -> Found | None:
        assert self._protocol is not None  # noqa: S101 - the caller has looked
        step = previous.shown.schedule.steps[previous.index]
        if previous.session == STANDALONE:
            return first_showing(self._protocol, self._selected)
        return same_step(
            self._protocol, step_name(step), step.index if isinstance(step, Trial) else 1, previous.session
        )

    # display

    def _show_step(self) -> None:
        self._find_step()
        study, place = self._study, self._found
        if study is None:
            return
        if place is None:
            faults = study.faults if study.is_toml else ()
            hiding = next((fault for fault in faults if fault.kind != "no text"), None)  # a missing text hides no page
            found = study.problems[:1] if hiding is None else (hiding.located(Places.of(study.text)),)
            problem = next(map(str, found), "the session does not have any steps")
            note = f"The page cannot be shown: {problem}"
            if hiding is not None and study.is_unfinished(hiding):
                note = "The page will be shown when its entry is complete"
            self.show_view(ParticipantView(note=note))
            return
        shown, index = place.shown, place.index
        pages = pages_of_step(shown, index)
        if self._moment not in pages:
            of_side = [moment for moment in pages if (moment.kind == "tank") == (self._side == "tank")]
            self._moment = (of_side or list(pages))[0]
        page = previewed_page(
            shown, index, self._moment, self._language, self._answers.get(self._page_key, _NO_ANSWERS)
        )
        if isinstance(page, TaskPage):
            self._place_ball(page, presented_condition(shown, index))
        now = shown.schedule.steps[index]
        step = step_label(shown, now, shown.protocol.study.languages[0])
        if place.session and place.session != STANDALONE:
            step = f"{step} ({place.session})"
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
                note=self._page_note(study, place),
                photodiode=self._photodiode,
            )
        )

    @property
    def _page_key(self) -> tuple[str, int]:
        """The key of the page's answers: a form, or a trial of a block."""
        assert self._found is not None  # noqa: S101 - a page is shown
        step = self._found.shown.schedule.steps[self._found.index]
        return step_name(step), step.index if isinstance(step, Trial) else 0

    def _selected_question(self, study: Study) -> str | None:
        if "items" not in self._selected:
            return None
        item = value_at(study.document, self._selected[: self._selected.index("items") + 2])
        name = item.get("id") if isinstance(item, Mapping) else None
        return name if isinstance(name, str) else None

    def _page_note(self, study: Study, step: Found) -> str:
        """Return a note, in the page's language, on parts that are not shown as written."""
        first = step.shown.protocol.study.languages[0]
        faults = [fault for fault in study.shown_faults if fault.concerns(self._language, first)]
        count = sum(row.fault.concerns(self._language, first) for row in problem_rows(study))  # as the header counts
        if not count:
            return "This page is not part of any session." if step.session == STANDALONE else ""
        values = "only the valid parts" if self._valid is None else "the last valid values"
        own = next((fault for fault in faults if fault.path[: len(self._selected)] == self._selected), None)
        if own is None:
            are = f"There {'is' if count == 1 else 'are'} {counted(count, 'problem')} elsewhere"
            first_name = unique_name(study.document, element_of(study, faults[0].path))
            are += f" ({first_name})" if count == 1 else f" (the first: {first_name})"
            return f"{are}, so {values} are shown."
        shown = f"{values} are shown"
        if own.kind == "alike":
            shown = "the text is shown as written"
        elif own.missing_language or own.kind == "one language":
            shown = "the text is shown in another language"
        return f"{unique_name(study.document, self._selected)} has a problem ({own.message}), so {shown}."

    def _place_ball(self, page: TaskPage, condition: str | None) -> None:
        """Move the ball to the start of its path if the tank has changed."""
        assert self._found is not None  # noqa: S101 - a page is shown
        hides = condition is not None and self._found.shown.protocol.conditions[condition].ball == "hidden"
        tank = (page.task, page.workspace_m, page.trial, self._moment, hides)
        if tank != self._ball_of:
            self._ball_of = tank
            self._ball = ProgrammedBall(page.task, page.workspace_m, hidden_after_lead=hides)
            self._since_s = time.perf_counter()

    def _move_ball(self) -> None:
        if self._ball is not None:
            self.page.show_tank(self._ball.view(time.perf_counter() - self._since_s))

    # the widgets

    def show_view(self, view: ParticipantView) -> None:
        before, self.view = self.view, view
        self.setAccessibleName(view.name)
        if before.language and view.language != before.language:
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
        if len(view.moments) > _MOST_IN_ROW:
            self._second.insertWidget(0, self.moments)
        else:
            self._row.insertWidget(self._row.indexOf(self.after) + 1, self.moments)
        self.page.show_view(view)
        if view.languages != before.languages:
            self.place.pane.make_room()  # the controls beside the tabs have another width
        if (high := self.column.minimumSize().height()) != self._high:  # another note, or another row of pages
            self._high = high
            self.place.pane.make_room()

    def offer_screens(self, sizes: tuple[ScreenSize, ...]) -> None:
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
        self.place.pane.make_room()

    @property
    def most_px(self) -> int:
        """The largest height that it can use, for a page shown completely the height of the page [px]."""
        other = self.column.minimumSize().height() - self.page.minimumHeight()
        return min(QWIDGETSIZE_MAX, self.page.maximumHeight() + other)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()
