"""The machine's place: what this computer and its screens are like, apart from every study; kept at once, with undo.

It draws `MachineSettings` and the screens there are, and says what is to be changed; it reads and writes no file.
"""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QGuiApplication, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QBoxLayout, QWidget

from study_app.gui.display.screens import ScreenShown, screens_shown
from study_app.gui.settings.display_test import DisplayTest
from study_app.gui.settings.outlets_card import OutletsCard
from study_app.gui.settings.screen_numbers import ScreenNumber, identify
from study_app.gui.settings.setting_cards import OffsetCard, ScreensCard, SeenCard, SessionsCard, WindowsCard
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, scrolled
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, label
from study_app.gui.widgets.main_view import Place
from study_app.store.workstation import DEFAULTS, MachineSettings

STACKED_BELOW = 1000


class MachinePlace(Place):
    """What is set, under headings.

    ``changed(values)`` carries new values by their names in `MachineSettings`; ``offset_measured(mean [ms], spread
    [ms], how, screen)`` what a photodiode said of a screen; ``undo_asked`` takes the last change back;
    ``check_asked`` opens the check of this computer.
    """

    changed = Signal(dict)
    offset_measured = Signal(float, float, str, str)
    undo_asked = Signal()
    check_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.settings = DEFAULTS
        self._screens: tuple[ScreenShown, ...] = ()
        self.numbers: list[ScreenNumber] = []
        self.test: DisplayTest | None = None
        self.screens, self.seen, self.offset = ScreensCard(), SeenCard(), OffsetCard()
        self.sessions, self.windows, self.outlets = SessionsCard(), WindowsCard(), OutletsCard()
        self.undo = ActionButton("undo", "Undo")
        self.check = ActionButton("check", "Check this computer …")
        self.kept_in = Elided("label", "text2")
        self.kept_in.setFont(font("label", weight=400))
        self._lay_out()
        self._connect()

    def _lay_out(self) -> None:
        about = "Settings of this computer and its screens, independent of every study. Changes are saved immediately."
        titles = vbox(label("This machine", "title"), label(about, "body", "text2", wraps=True), spacing=4)
        head = hbox((titles, 1), self.check, self.undo, spacing=16, margins=(SHADOW, 0, SHADOW, 0))
        self._body = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._body.setSpacing(18)
        for cards in ((self.screens, self.seen, self.outlets), (self.offset, self.sessions, self.windows)):
            add_layout(self._body, vbox(*cards, STRETCH, spacing=18), 1)
        foot = hbox(self.kept_in, margins=(SHADOW, 0, SHADOW, 0))
        inside = QWidget()
        vbox(head, (self._body, 1), foot, spacing=20, margins=(30, 30, 30, 22), parent=inside)
        self._area = scrolled(inside)
        vbox(self._area, margins=0, parent=self)

    def _connect(self) -> None:
        for card in (self.seen, self.sessions, self.windows, self.offset, self.outlets):
            card.changed.connect(lambda name, value: self.changed.emit({name: value}))
        self.screens.chosen.connect(
            lambda screen: self.changed.emit({"screen": screen.name, "screen_number": screen.number})
        )
        self.screens.identify_asked.connect(self._identify)
        self.screens.test_asked.connect(self.open_test)
        self.sessions.devices_asked.connect(lambda: self.go_asked.emit("devices"))
        self.offset.form.kept.connect(self._measured)
        self.offset.form.forgotten.connect(lambda: self.changed.emit({"display_offset": None}))
        self.undo.clicked.connect(self.undo_asked)
        self.check.clicked.connect(self.check_asked)
        QShortcut(QKeySequence.StandardKey.Undo, self, self.undo.click, context=Qt.ShortcutContext.WindowShortcut)

    def enter(self) -> None:
        """Look at the screens again: one may have been plugged in."""
        self._show()

    def leave(self) -> None:
        """Take the numbers and the test off the screens."""
        for one in self.numbers:
            one.close()
            one.deleteLater()
        self.numbers = []
        if self.test is not None:
            self.test.close()

    @property
    def participants(self) -> ScreenShown:
        """The participant's screen."""
        return self._screens[self.settings.screen_among([screen.name for screen in self._screens]) - 1]

    def show_settings(self, settings: MachineSettings, *, folder: str, undo: str, kept_in: str) -> None:
        """Show what is set; ``undo`` names what can be taken back ("" where nothing), ``folder`` is the workspace."""
        self.settings = settings
        self.undo.setEnabled(bool(undo))
        self.undo.show_action("undo", f"Undo {undo}" if undo else "Undo")
        self.sessions.show_settings(settings, folder)
        self.windows.show_settings(settings)
        self.outlets.show_settings(settings)
        self.offset.patch.setChecked(settings.photodiode)
        self.kept_in.show_text(f"Saved in {kept_in}")
        self._show()

    def _show(self) -> None:
        """Show what depends on the screens."""
        self._screens = screens_shown()
        names = [screen.name for screen in self._screens]
        missing = self.settings.screen if self.settings.screen not in {"", *names} else ""
        there = self.participants
        self.screens.show_screens(self._screens, there.number, missing)
        self.seen.show_settings(self.settings, there)
        self.offset.form.show_offset(self.settings.display_offset, there.name)
        if self.test is not None:
            self.test.show_offset(self.settings.display_offset, there.name)
        apply_theme_within(self.screens, self.theme)

    def _measured(self, mean_ms: float, spread_ms: float, how: str) -> None:
        self.offset_measured.emit(mean_ms, spread_ms, how, self.participants.name)

    def _identify(self) -> None:
        self.leave()
        self.numbers = identify()

    def open_test(self) -> None:
        """Fill the participant's screen with the display test."""
        if self.test is not None:
            return
        there, screens = self.participants, QGuiApplication.screens()
        if there.number > len(screens):  # it was unplugged
            self._show()
            return
        self.test = DisplayTest(
            "  ·  ".join(filter(None, (f"Screen {there.number}", there.name, there.words))), there.refresh_hz
        )
        self.test.kept.connect(self._measured)
        self.test.forgotten.connect(lambda: self.changed.emit({"display_offset": None}))
        self.test.left.connect(self._test_left)
        self.test.show_offset(self.settings.display_offset, there.name)
        self.test.open_on(screens[there.number - 1])

    def _test_left(self) -> None:
        test, self.test = self.test, None
        if test is not None:
            test.deleteLater()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 - Qt's name
        """Make room: the second column goes below the first."""
        super().resizeEvent(event)
        stacked = self.width() < STACKED_BELOW
        self._body.setDirection(QBoxLayout.Direction.TopToBottom if stacked else QBoxLayout.Direction.LeftToRight)
