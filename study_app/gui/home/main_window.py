"""The main window: the rail, and one view at a time."""

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QDialog, QMainWindow, QStackedWidget, QWidget
from shiboken6 import isValid

from study_app.errors import StudyError
from study_app.gui.home.navigation import DESTINATIONS, Rail
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.gui.theme.themed import apply_theme, apply_theme_within
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.dialogs import Notice, Question
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place, last_focused

FULL = QSize(1440, 900)
LEAST = QSize(1024, 640)
NARROW_BELOW = 1400
NONE: Mapping[str, Callable[[], Iterator[None] | None]] = MappingProxyType({})


def bug_words(error: BaseException) -> str:
    """Return what is said of an exception that is a bug."""
    return f"{type(error).__name__}: {error}. This is a bug: please report it, with what the terminal shows."


def _waiting_place() -> Place:
    """Return a line in the middle, in place of what is being prepared."""
    made = Place()
    vbox((label("Preparing …", "card", "text2"), 0, Qt.AlignmentFlag.AlignCenter), parent=made)
    return made


class MainWindow(QMainWindow):
    """The rail and the places; a place is made when one first goes there.

    Parameters
    ----------
    makers
        What makes each place, by its name; the first is where one begins.
    prepares
        For a place that takes long to make, what prepares it outside the window's thread and, once that is done,
        returns the steps by which it is filled before it is seen; until `prepared` is called, a line stands in its
        place.

    ``closed`` comes when the operator is done, ``theme_changed`` with the `Theme` that was asked for here, ``went``
    with the name of a place that was asked for.
    """

    closed = Signal()
    went = Signal(str)
    theme_changed = Signal(object)

    def __init__(
        self,
        makers: Mapping[str, Callable[[], Place]],
        *,
        theme: Theme = LIGHT,
        prepares: Mapping[str, Callable[[], Iterator[None] | None]] = NONE,
    ) -> None:
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
        self._prepares = dict(prepares)  # of places that are not filled yet
        self._filling: set[str] = set()
        self._places: dict[str, Place] = {}
        self._made: dict[str, Place] = {}  # and not yet among the places
        self._waiting = _waiting_place()
        self._here = next(iter(makers))
        self._asked = self._here
        self.rail = Rail(makers)
        self.stack = QStackedWidget()
        self.stack.addWidget(self._waiting)
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
            try:
                made = self._made.pop(name, None) or self._makers[name]()
            except Exception as error:
                self._asked = self._here
                self._say_not_opened(name, error)
                raise
            made.message.connect(lambda title, sentence: self.show_message(title, sentence, of=name))
            made.message_over.connect(lambda: self._close_notice(name))
            made.go_asked.connect(self.go)
            self._places[name] = made
            self.stack.addWidget(made)
            apply_theme_within(made, self.theme)
        return self._places[name]

    def go(self, name: str) -> None:
        """Leave the place one is at and show another.

        A place that was prepared is made and filled in steps, with other events between them: no step takes 50 ms.
        """
        self._asked = name
        self.went.emit(name)
        if name not in self._prepares:
            self._show(name, self.place(name))
        elif name in self._filling:
            return  # it is shown after the last step
        elif (steps := self._prepares[name]()) is not None:
            self._filling.add(name)
            self._fill(name, steps)
        else:
            self._show(name, self._waiting)

    def _fill(self, name: str, steps: Iterator[None]) -> None:
        """Take the next step to a place; show the place after the last."""
        try:
            filled = self._take_step(name, steps)
        except Exception as error:  # say what failed, and let the hook for exceptions log it
            self._filling.remove(name)
            if self._asked == name:
                self.not_prepared(error)
            raise
        if filled:
            del self._prepares[name]
            self._filling.remove(name)
            self.prepared(name)
        else:
            QTimer.singleShot(1, self, lambda: self._fill(name, steps))  # a 0 ms timer may fire in the same iteration

    def _take_step(self, name: str, steps: Iterator[None]) -> bool:
        """Make a place, then add it, then fill it step by step; return whether it is filled."""
        if name in self._made:
            self.place(name)
        elif name not in self._places:
            self._made[name] = self._makers[name]()
        else:
            return next(steps, self) is self
        return False

    def _show(self, name: str, asked: Place) -> None:
        if self.stack.currentWidget() is not asked or name != self._here or not asked.isVisible():
            if name != self._here:
                self._close_notice(self._here)
                self._now().leave()
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

    def prepared(self, name: str) -> None:
        """Show a place that was waited for, if one is still there."""
        if self._asked == name:
            self.go(name)

    def not_prepared(self, error: BaseException) -> None:
        """Say what failed, at the first place, if one waits for a place; asked for again, it is prepared again."""
        name, first = self._asked, next(iter(self._makers))
        if name in self._prepares:
            self._asked = first
            self._show(first, self.place(first))  # what waits for the place waits for a second try
            self._say_not_opened(name, error)

    def _say_not_opened(self, name: str, error: BaseException) -> None:
        if not self.isVisible():
            return
        self.not_opened = error
        word = next(place.word for place in DESTINATIONS if place.name == name)
        what = f"{error}." if isinstance(error, StudyError) else bug_words(error)
        notice = Question(self, self.theme, f"“{word}” could not be opened", what)
        notice.add_buttons("Close", ActionButton("", "Try again", role="primary"))
        notice.accepted.connect(lambda: self.go(name))
        notice.rejected.connect(lambda: self.went.emit(self._here))
        self._show_notice(notice)

    def _now(self) -> Place:
        """Return the place one is at, or the line that stands there until it is prepared."""
        return self._waiting if self.stack.currentWidget() is self._waiting else self._places[self._here]

    def rest(self) -> None:
        """Leave the place one is at, and the screen: a session takes over."""
        self._now().leave()
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
        self._now().enter()

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
        self.rail.narrow(self.width() < NARROW_BELOW or self._now().wants_narrow_rail())

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
