"""The tab Participant: the live page, with language, screen, steps and pages."""

from typing import Final

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QWidget

from study_app.designer.participant.live_page import LivePage
from study_app.designer.participant.participant_page import ParticipantView, ScreenSize
from study_app.designer.place.segments import Segments
from study_app.gui.kit.commands import key_cap, tip
from study_app.gui.theme.theme import font
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card
from study_app.gui.widgets.controls import Cap, Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.numbers import NumberField
from study_app.session.trial import TankView

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
