"""The home page: start a session, resume an interrupted one, or see the recorded ones."""

from dataclasses import replace
from datetime import datetime
from functools import partial
from itertools import pairwise
from pathlib import Path

from PySide6.QtCore import QEvent, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QDialog, QHBoxLayout, QLayout, QSizePolicy, QWidget

from study_app.devices.registry import descriptor_of
from study_app.errors import StudyError
from study_app.gui.display.screens import screens_shown
from study_app.gui.home.cards import (
    LEAST_HEIGHT,
    BrokenCard,
    CardGrid,
    DeviceCard,
    Facts,
    LabCard,
    ResumeBanner,
    SessionsCard,
    StudyCard,
)
from study_app.gui.home.dialogs import NewSessionDialog, RehearsalDialog
from study_app.gui.home.study_facts import (
    SHIPPED,
    DraftFacts,
    Interrupted,
    LoadWords,
    StudyFacts,
    file_states,
    holds_liquids_alone,
    interrupted_session,
    last_written_ns,
    read_studies,
    session_counts_text,
)
from study_app.gui.kit.commands import add_commands, key_cap, with_key
from study_app.gui.kit.devices import DeviceShown, device_before_search
from study_app.gui.kit.dialogs import choose_protocol
from study_app.gui.kit.opening import open_here
from study_app.gui.sessions.session_facts import SessionFacts, extent_of, sessions
from study_app.gui.theme.theme import SHADOW
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, scrolled
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, label
from study_app.gui.widgets.main_view import Place
from study_app.session.start import resumed_choices
from study_app.store.workstation import DEFAULTS, MachineSettings
from study_app.workspace import workspace

_STACKED_BELOW = 1080
_COLUMN_PX = 326
MARGIN, BAR_PX = 28, 12
_NEXT_ROW_PX = 30
"""The minimum visible height of the second row of cards, which reveals that there is one."""
_LOW_PX = 150
"""The minimum height of the sessions in a low window, for one or two rows."""
CARDS_SHARE, BELOW_SHARE = 4, 3
"""The stretch factors of the cards and of the sessions."""


class HomePlace(Place):
    """The page with studies, sessions, device and lab.

    ``session_asked`` carries the operator's choices, ``results_asked`` a study folder, and ``protocol_opened`` the file
    of a study that was opened here. ``edit_asked`` carries the source of a study to edit, ``discard_asked`` that of a
    draft to discard, and ``new_asked`` that of a study to copy, or "".

    Parameters
    ----------
    results : folder that contains the studies' folders; it need not exist
    draft_words : loads the object that describes drafts
    """

    session_asked = Signal(object)
    results_asked = Signal(object)
    protocol_opened = Signal(object)
    edit_asked = Signal(str)
    discard_asked = Signal(str)
    new_asked = Signal(str)

    def __init__(self, results: Path, draft_words: LoadWords = None) -> None:
        super().__init__()
        self.results = results
        self._draft_words = draft_words
        self.machine = DEFAULTS
        self.dialog: QDialog | None = None
        self._opened: list[str] = []
        self._facts: tuple[Facts, ...] = ()
        self._files: frozenset[tuple[Path, int, int]] | None = None  # their states when the studies were last read
        self._read_failed = False  # whether reading the studies failed
        self._latest: Path | None = None  # the folder of the latest session
        self._read_once = False
        self._studies = Background(self)
        self._studies.done.connect(self._show_studies)
        self._studies.failed.connect(self._show_read_error)
        self._reader = Background(self)
        self._reader.done.connect(self._show_read_sessions)
        self.banner = ResumeBanner()
        self.grid = CardGrid()
        self.sessions = SessionsCard()
        self.device = DeviceCard()
        self.lab = LabCard()
        self.open_protocol = ActionButton("file", "Open protocol…", cap=key_cap("open"))
        self.new_study = ActionButton("plus", "New study…", cap=key_cap("new"))
        self.folder = Elided("label", "text2")
        self.waiting = label("Reading studies…", "card", "text2")
        for button, action in ((self.open_protocol, "open"), (self.new_study, "new")):
            button.setToolTip(with_key(button.text(), action))
            button.setAccessibleName(button.toolTip())
        self._lay_out()
        add_commands(self, {"open": self.open_protocol.click, "new": self.new_study.click})
        self.open_protocol.clicked.connect(self._open_protocol)
        self.new_study.clicked.connect(lambda: self.new_asked.emit(""))
        self.banner.resume_asked.connect(self._ask_to_resume)
        self.sessions.all.clicked.connect(lambda: self.go_asked.emit("results"))
        self.sessions.open_asked.connect(self._open_session)
        self.sessions.emptied.connect(self._arrange)
        self.device.devices.clicked.connect(lambda: self.go_asked.emit("devices"))
        self.device.display.clicked.connect(lambda: self.go_asked.emit("machine"))
        self.lab.open.clicked.connect(lambda: self.go_asked.emit("lab"))
        self.show_machine(DEFAULTS, device_before_search(DEFAULTS.device))

    def show_machine(self, settings: MachineSettings, device: DeviceShown) -> None:
        """Use these settings for new sessions, and show ``device``, the preferred one."""
        self.machine = settings
        self.device.show_device(device)
        self.device.show_screens(_screen_lines(settings))

    def enter(self) -> None:
        """Read protocols, results and screens again."""
        self.device.show_screens(_screen_lines(self.machine))
        QTimer.singleShot(0, self, self.read_changes)
        QTimer.singleShot(0, self, self.show_sessions)

    def event(self, event: QEvent) -> bool:
        """Check for changed protocols when the window becomes active, for example after using a text editor."""
        if event.type() == QEvent.Type.WindowActivate and self.isVisible() and not self._read_failed:
            self.read_changes()
        return super().event(event)

    def read_changes(self) -> None:
        """Read the protocols again in the background if a file has changed."""
        if file_states(self._opened) != self._files:
            self.show_studies()

    def _lay_out(self) -> None:
        about = label("Start a session, or resume an interrupted one.", "body", "text2")
        titles = vbox(label("Studies", "title"), about, self.folder, spacing=4)
        head = hbox((titles, 1), self.open_protocol, self.new_study, margins=(SHADOW, 0, SHADOW, 0))
        self._below = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._below.setContentsMargins(0, 0, 0, 0)
        self._below.setSpacing(18)
        self._below.addWidget(self.sessions, 1)
        self._side_column = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        self._side_column.setSpacing(18)
        add_parts(self._side_column, self.device, self.lab, STRETCH)
        add_layout(self._below, self._side_column)
        self.below = _LowerPart()
        self.below.setLayout(self._below)
        self.cards_area = scrolled(self.grid)
        self.cards_area.setSizePolicy(
            QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Ignored
        )  # at most the available height
        inside = QWidget()
        self._below_row = _row_with_bar_margin(self.below)
        self._page = vbox(
            _row_with_bar_margin(head),
            _row_with_bar_margin(self.banner),
            (self.waiting, 1, Qt.AlignmentFlag.AlignCenter),
            (self.cards_area, CARDS_SHARE),
            (self._below_row, BELOW_SHARE),
            spacing=14,
            parent=inside,
        )
        self.area = scrolled(inside)
        vbox(self.area, margins=0, parent=self)
        self.below.hide()  # until the cards exist, which would move it
        self.area.verticalScrollBar().rangeChanged.connect(lambda _least, most: self._keep_margin(most > 0))
        bar = self.cards_area.verticalScrollBar()
        bar.rangeChanged.connect(lambda _least, most: self.grid.set_right_margin(0 if most > 0 else BAR_PX))
        self.grid.set_right_margin(BAR_PX)
        self.grid.laid_out.connect(self._share_height)
        self._keep_margin(bar=False)

    def _keep_margin(self, bar: bool) -> None:
        """Let the scroll bar use the right margin, so that nothing moves when it appears."""
        self._page.setContentsMargins(MARGIN, 20, MARGIN - BAR_PX * (1 + bar), 12)

    @property
    def is_reading(self) -> bool:
        return self._studies.busy or self._reader.busy

    def show_results(self, results: Path) -> None:
        """Show the workspace's protocols and the sessions of another results folder."""
        self.results = results
        self.show_studies()

    def show_studies(self) -> None:
        """Read the known protocols in the background; then show a card for each, and the sessions."""
        self.folder.show_text(f"Workspace: {workspace().folder}")
        self._files, self._read_failed = file_states(self._opened), False
        self._studies.run(partial(read_studies, tuple(self._opened), self._draft_words, self.results))

    def _show_studies(self, facts: tuple[Facts, ...]) -> None:
        self.waiting.hide()
        if facts != self._facts:
            self._show_facts(facts)
        self.show_sessions()

    def _show_read_error(self, error: Exception) -> None:
        self._show_studies(self._facts)
        self._files, self._read_failed = None, True  # to be read again at the next visit, not at each activation
        description = f"{type(error).__name__}: {error}"
        self.message.emit("The studies could not be read", f"{description}. The terminal shows the details.")

    def _show_facts(self, studies: tuple[Facts, ...]) -> None:
        self._facts = studies
        cards: list[QWidget] = []
        next_step = next((study for study in studies if study.draft is not None or isinstance(study, StudyFacts)), None)
        for facts in self._facts:
            ships, first = facts.origin == SHIPPED, facts is next_step
            card: StudyCard | BrokenCard
            if isinstance(facts, StudyFacts):
                card = StudyCard(facts, first=first, shipped=ships)
                card.new_session.connect(self.ask_for_session)
                card.rehearsal.connect(self.ask_for_rehearsal)
            else:
                card = BrokenCard(facts, first=first)
            signal = self.new_asked if ships else self.edit_asked
            card.edit.connect(lambda facts, signal=signal: signal.emit(facts.source))
            card.discard.connect(lambda facts: self.discard_asked.emit(facts.source))
            cards.append(card)
        focused, bar = self._focused_card(), self.cards_area.verticalScrollBar()
        scrolled_px = bar.value()
        self.grid.show_cards(cards)
        self._order_focus()
        self._mark_next_step()
        self._arrange()
        bar.setValue(scrolled_px)
        if focused is not None:
            self._focus_card(*focused)

    def _focused_card(self) -> tuple[int, str, int] | None:
        """Return the position, study and button number of the focused card, or None."""
        focused = self.window().focusWidget() if self.isVisible() else None
        for index, card in enumerate(self.grid.cards):
            if isinstance(card, StudyCard | BrokenCard) and focused in _card_buttons(card):
                return index, card.facts.source, _card_buttons(card).index(focused)
        return None

    def _focus_card(self, at: int, source: str, button: int) -> None:
        """Focus the card of a study, which may have moved, or else the card at its former position."""
        cards = [card for card in self.grid.cards if isinstance(card, StudyCard | BrokenCard)]
        card = next(
            (candidate for candidate in cards if candidate.facts.source == source),
            cards[at] if at < len(cards) else None,
        )
        if card is not None:
            _card_buttons(card)[min(button, len(_card_buttons(card)) - 1)].setFocus(Qt.FocusReason.OtherFocusReason)
            QTimer.singleShot(0, card, lambda: self.cards_area.ensureWidgetVisible(card))  # after the layout

    def _order_focus(self) -> None:
        """Make Tab follow the reading order, since Qt appends new cards at the end."""
        cards = [card for card in self.grid.cards if isinstance(card, StudyCard | BrokenCard)]
        sessions, device = self.sessions, self.device
        parts: tuple[QWidget, ...] = (
            self.open_protocol, self.new_study, self.banner.resume,
            *(button for card in cards for button in _card_buttons(card)),
            sessions.kind, sessions.details, sessions.all, sessions.rows.table,
            device.devices, device.display, self.lab.open,
        )  # fmt: skip
        for before, after in pairwise(parts):
            QWidget.setTabOrder(before, after)

    def show_sessions(self) -> None:
        """Read the results folder again in the background, unless the studies are being read, which does so later."""
        if not self._studies.busy:
            self._reader.run(partial(_read_sessions, self.results, self._facts))

    def _show_read_sessions(self, read: tuple[Path, tuple[SessionFacts, ...], Interrupted | None]) -> None:
        results, sessions, interrupted = read
        self.sessions.show_sessions(sessions, str(results), datetime.now().astimezone())
        self._show_latest(sessions)
        self.banner.show_interrupted(interrupted)
        self._mark_next_step()
        self.below.show()
        self._share_height()
        for card in self.grid.cards:
            if isinstance(card, StudyCard):
                card.held.setText(session_counts_text(sessions, card.facts.protocol.study.name))

    def _mark_next_step(self) -> None:
        """Make one button primary: that of the banner or, without an interrupted session, that of the first card."""
        cards = [card for card in self.grid.cards if isinstance(card, StudyCard | BrokenCard)]
        first = next((card for card in cards if card.facts.draft is not None or isinstance(card, StudyCard)), None)
        if first is None:
            return
        button = first.pen if first.facts.draft is not None or not isinstance(first, StudyCard) else first.new
        if isinstance(button, ActionButton):
            button.set_role("" if self.banner.isVisibleTo(self) else "primary")

    def _show_latest(self, sessions: tuple[SessionFacts, ...]) -> None:
        """After a new session, show the sessions of its kind, and move its study to the front."""
        last = max(
            (session for session in sessions if session.kind != "sample"),
            key=lambda session: last_written_ns(session.folder),
            default=None,
        )
        previous, self._latest = self._latest, None if last is None else last.folder
        if last is not None and last.folder != previous:
            self.sessions.show_kind(last.kind)
            if self._read_once:
                self.show_studies()
        self._read_once = True

    def ask_for_session(self, facts: StudyFacts) -> None:
        """Open the dialog for a new session; ``session_asked`` carries the answers."""
        dialog = NewSessionDialog(facts, self.results, machine=self.machine, theme=self.theme, parent=self)
        self._open_dialog(dialog)
        dialog.accepted.connect(lambda: self.session_asked.emit(dialog.chosen()))

    def _ask_to_resume(self, session: Interrupted) -> None:
        """Request to resume a session with its settings on the current screens."""
        try:
            names = [screen.name for screen in screens_shown()]
            chosen = resumed_choices(
                session.folder,
                protocol=session.source,
                windowed=len(names) == 1,
                screen=self.machine.screen_among(names),
            )
            options = descriptor_of(chosen.device).window_values(self.machine.device_options)
            self.session_asked.emit(replace(chosen, device_options=options))
        except StudyError as error:
            self.message.emit("The session cannot be resumed", f"{error}.")

    def ask_for_rehearsal(self, facts: StudyFacts) -> None:
        """Open the dialog for a rehearsal, and update the sessions afterwards."""
        dialog = RehearsalDialog(facts, self.results, theme=self.theme, parent=self)
        self._open_dialog(dialog)
        dialog.finished.connect(self.show_sessions)
        dialog.accepted.connect(lambda: self.results_asked.emit(dialog.folder))

    def _open_session(self, session: SessionFacts) -> None:
        from study_app.gui.sessions.session_page import SessionPage  # noqa: PLC0415 - only on demand, since it is slow

        page = SessionPage(self, self.theme, session, open_here)
        self._open_dialog(page)

    def end(self) -> None:
        for dialog in self.findChildren(RehearsalDialog):
            dialog.end()

    def _open_dialog(self, dialog: QDialog) -> None:
        self.dialog = dialog
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _open_protocol(self) -> None:
        chosen = choose_protocol(self, "Open protocol")
        if not chosen:
            return
        if holds_liquids_alone(chosen):
            self.message.emit("This is a liquid file", f"{chosen} is not a study: open it in the liquid lab.")
            return
        if chosen not in self._opened:
            self._opened.insert(0, chosen)
        self.protocol_opened.emit(Path(chosen))
        self.show_studies()

    def _arrange(self) -> None:
        stacked = self.width() < _STACKED_BELOW or self.sessions.is_empty
        self.below.shares = not self.sessions.is_empty
        self._page.setStretch(self._page.count() - 1, 0 if self.sessions.is_empty else BELOW_SHARE)
        down, right = QBoxLayout.Direction.TopToBottom, QBoxLayout.Direction.LeftToRight
        self._below.setDirection(down if stacked else right)
        self._side_column.setDirection(right if stacked else down)
        for index, stretch in enumerate((stacked, stacked, not stacked)):  # if stacked, two cards share a row
            self._side_column.setStretch(index, int(stretch))
        for card in (self.device, self.lab):
            card.setMinimumWidth(0 if stacked else _COLUMN_PX)
            card.setMaximumWidth(QWIDGETSIZE_MAX if stacked else _COLUMN_PX)
        self.grid.arrange(self.width() - 2 * MARGIN)
        self._share_height()

    def _share_height(self) -> None:
        """Divide the height between cards and sessions, so that at least the first row of cards is visible.

        In a low window, the lab, which is also in the rail, and most rows of the sessions are hidden. If the page still
        has to scroll, the cards get their full height, so that there is only one scroll bar.
        """
        if (whole := self.grid.whole_height) <= 0:  # new cards have no height yet
            return
        for low, beyond in ((False, _NEXT_ROW_PX), (True, _NEXT_ROW_PX), (True, 0)):
            self.lab.setVisible(not low or self.sessions.is_empty)
            if not self.sessions.is_empty:
                self.sessions.setMinimumHeight(_LOW_PX if low else LEAST_HEIGHT)
            self._invalidate_layouts()
            others = self._page.totalMinimumSize().height() - self.cards_area.minimumHeight()
            minimum = min(whole, self.grid.row_height + beyond)
            if fits := others + minimum <= self.area.viewport().height():
                break
        self.cards_area.setMinimumHeight(minimum if fits else whole)
        self.cards_area.setMaximumHeight(whole)
        self._invalidate_layouts()
        self._page.activate()

    def _invalidate_layouts(self) -> None:
        """Make the layouts recompute their heights now instead of after the next events."""
        for layout in (self._side_column, self._below, self._below_row, self._page):
            layout.invalidate()
        self.below.updateGeometry()

    def focusNextPrevChild(self, forward: bool) -> bool:
        moved = super().focusNextPrevChild(forward)
        focused = self.focusWidget()
        if moved and focused is not None and self.grid.isAncestorOf(focused):
            for area in (self.cards_area, self.area):
                area.ensureWidgetVisible(focused)
        return moved

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange()


class _LowerPart(QWidget):
    """Sessions, device and lab; if this part ``shares`` the height with the cards, it fills the available height.

    Its size hint is then its minimum size, because a layout gives a widget with wrapped text at least its hint.
    """

    shares = True

    def hasHeightForWidth(self) -> bool:
        return not self.shares and super().hasHeightForWidth()

    def sizeHint(self) -> QSize:
        return self.minimumSizeHint() if self.shares else super().sizeHint()


def _row_with_bar_margin(part: QWidget | QLayout) -> QHBoxLayout:
    """Return a row with a right margin as wide as the cards' scroll bar."""
    return hbox(part, margins=(0, 0, BAR_PX, 0))


def _card_buttons(card: StudyCard | BrokenCard) -> tuple[QWidget, ...]:
    buttons = (card.pen,) if card.bin is None else (card.pen, card.bin)
    return (*buttons, card.new, card.rehearse) if isinstance(card, StudyCard) else buttons


def _read_sessions(
    results: Path, studies: tuple[Facts, ...]
) -> tuple[Path, tuple[SessionFacts, ...], Interrupted | None]:
    """Return the results folder, the sessions in it, and the one that can be resumed, if any."""
    counts = {study.name: set(extent_of(study.protocol).answers) for study in studies if isinstance(study, StudyFacts)}
    answers = {name: max(numbers) for name, numbers in counts.items() if len(numbers) == 1}
    recorded = sessions(results, answers)
    saved = [study for study in studies if not isinstance(study, DraftFacts)]
    return results, recorded, interrupted_session(recorded, saved, datetime.now().astimezone())


def _screen_lines(settings: MachineSettings) -> tuple[str, ...]:
    """Return a line for each screen, with its user, size, rate and scaling."""
    screens = screens_shown()
    participants = settings.screen_among([screen.name for screen in screens])
    titles = {participants: "Participant's screen"} if len(screens) > 1 else {}
    return tuple(f"{titles.get(screen.number, 'Screen')} {screen.number}: {screen.words}" for screen in screens)
