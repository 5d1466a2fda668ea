"""The main window: the rail, and one view at a time."""

from collections.abc import Callable, Mapping

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QDialog, QMainWindow, QStackedWidget, QWidget
from shiboken6 import isValid

from study_app.errors import StudyError
from study_app.gui.home.navigation import DESTINATIONS, Rail
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.gui.theme.themed import apply_theme, apply_theme_within
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.dialogs import Notice, Question
from study_app.gui.widgets.main_view import Place, last_focused

FULL = QSize(1440, 900)
LEAST = QSize(1024, 640)
NARROW_BELOW = 1400


def bug_words(error: BaseException) -> str:
    """Return what is said of an exception that is a bug."""
    return f"{type(error).__name__}: {error}. This is a bug: please report it, with what the terminal shows."


class MainWindow(QMainWindow):
    """The rail and the places; a place is made when one first goes there.

    Parameters
    ----------
    makers
        What makes each place, by its name; the first is where one begins.

    ``closed`` comes when the operator is done, ``theme_changed`` with the `Theme` that was asked for here.
    """

    closed = Signal()
    theme_changed = Signal(object)

    def __init__(self, makers: Mapping[str, Callable[[], Place]], *, theme: Theme = LIGHT) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setMinimumSize(LEAST)
        self.theme = theme
        self.notice: Question | None = None
        self._notice_of = ""  # the place that has it said
        self._resting = False  # whether a session has the screen
        self.not_opened: BaseException | None = None  # why a place could not be opened: a notice has said so
        self._had_keyboard: QWidget | None = None
        self._makers = makers
        self._places: dict[str, Place] = {}
        self._here = next(iter(makers))
        self.rail = Rail(makers)
        self.stack = QStackedWidget()
        whole = QWidget()
        whole.setProperty("role", "window")
        whole.setAccessibleName("Liquid Study")
        hbox(self.rail, (self.stack, 1), spacing=0, margins=0, parent=whole)
        self.setCentralWidget(whole)
        whole.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.rail.theme_asked.connect(self._change_theme)
        self.rail.go_asked.connect(self.go)
        QShortcut(QKeySequence("Ctrl+Q"), self, self.close)  # not every window has a frame whose keys close it
        apply_theme(self, theme)
        self.resize(FULL)
        self.go(self._here)
        whole.setFocus()

    @property
    def here(self) -> str:
        """The name of the place one is at."""
        return self._here

    def place(self, name: str) -> Place:
        """Return a place, made on first use; what making it raises is said, too."""
        if name not in self._places:
            QGuiApplication.setOverrideCursor(Qt.CursorShape.WaitCursor)
            try:
                made = self._makers[name]()
            except Exception as error:
                self._say_not_opened(name, error)
                raise
            finally:
                QGuiApplication.restoreOverrideCursor()
            made.message.connect(lambda title, sentence: self.show_message(title, sentence, of=name))
            made.message_over.connect(lambda: self._close_notice(name))
            made.go_asked.connect(self.go)
            self._places[name] = made
            self.stack.addWidget(made)
            apply_theme_within(made, self.theme)
        return self._places[name]

    def go(self, name: str) -> None:
        """Leave the place one is at and show another, which is made at its first visit."""
        asked = self.place(name)
        if name != self._here or not asked.isVisible():
            if name != self._here:
                self._close_notice(self._here)
                self._places[self._here].leave()
            self._here = name
            self.rail.mark(name)
            self.stack.setCurrentWidget(asked)
            self._arrange()
            asked.enter()
        self._lead_in(self.rail.buttons[name], asked)

    def _lead_in(self, button: QWidget, place: Place) -> None:
        """Give a place the keyboard of its button in the rail: to the part that had it last, else to the first."""
        if self.focusWidget() is not button:
            return
        if (last := last_focused(place)) is not None:
            last.setFocus(Qt.FocusReason.OtherFocusReason)
            return
        place.setFocus()
        place.focusNextChild()
        if not place.isAncestorOf(self.focusWidget()):
            button.setFocus()

    def _say_not_opened(self, name: str, error: BaseException) -> None:
        if not self.isVisible():
            return
        self.not_opened = error
        word = next(place.word for place in DESTINATIONS if place.name == name)
        what = f"{error}." if isinstance(error, StudyError) else bug_words(error)
        notice = Question(self, self.theme, f"“{word}” could not be opened", what)
        notice.add_buttons("Close", ActionButton("", "Try again", role="primary"))
        notice.accepted.connect(lambda: self.go(name))
        self._show_notice(notice)

    def rest(self) -> None:
        """Leave the place one is at, and the screen: a session takes over."""
        self._places[self._here].leave()
        self._had_keyboard = self.focusWidget()
        self._resting = True
        self.hide()

    def come_back(self) -> None:
        """Be there again, where one was.

        A window that becomes the active one while it is hidden, as when the dialog before a session closes, gives the
        keyboard to the part after the one that had it.
        """
        self.show()
        self._resting = False
        if self.notice is not None and isValid(self.notice):
            self.notice.show()
        if self._had_keyboard is not None and isValid(self._had_keyboard):
            self._had_keyboard.setFocus()
        self._places[self._here].enter()

    def show_message(self, title: str, sentence: str, *, of: str = "") -> None:
        """Say what went wrong, with one button; what the place ``of`` has said is closed when one leaves it."""
        self._show_notice(Notice(self, self.theme, title, sentence), of)

    def _show_notice(self, notice: Question, of: str = "") -> None:
        notice.finished.connect(notice.deleteLater)
        self.notice, self._notice_of = notice, of
        if not self._resting:  # else it would be in front of a session
            notice.show()

    def _close_notice(self, of: str) -> None:
        """Close what a place has said."""
        if self.notice is not None and self._notice_of == of and isValid(self.notice):
            self.notice.accept()

    def show_theme(self, theme: Theme) -> None:
        """Wear a theme from now on."""
        if theme is not self.theme:
            self.theme = theme
            apply_theme(self, theme)

    def _change_theme(self) -> None:
        self.show_theme(LIGHT if self.theme.dark else DARK)
        self.theme_changed.emit(self.theme)

    def _arrange(self) -> None:
        here = self._places.get(self._here)
        self.rail.narrow(self.width() < NARROW_BELOW or (here is not None and here.wants_narrow_rail()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Make room: the rail becomes narrow in a small window."""
        super().resizeEvent(event)
        self._arrange()

    def closeEvent(self, event: QCloseEvent) -> None:
        for place in self._places.values():
            place.leave()
        for dialog in self.findChildren(QDialog):
            dialog.close()
        super().closeEvent(event)
        self.closed.emit()
