"""The main window: the navigation rail, and one page at a time."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent, QColor, QGuiApplication, QKeySequence, QPaintEvent, QPen, QResizeEvent, QShortcut
from PySide6.QtWidgets import QDialog, QMainWindow, QSizePolicy, QStackedWidget, QWidget
from shiboken6 import isValid

from study_app.discovery import explain_error
from study_app.errors import StudyError
from study_app.gui.kit.dialogs import Question
from study_app.gui.kit.opening import open_here
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import DARK, LIGHT, RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Coloured, Themed, apply_theme, give_ground, name_scroll_bars
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Logo, smooth_painter
from study_app.gui.widgets.controls import ActionButton, PressedByEnter
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place, last_focused

WIDE_RAIL, NARROW_RAIL = 216, 72
WIDE_MARGIN, NARROW_MARGIN = 12, 4
_FOCUS_RING = 2  # px


class _Destination(NamedTuple):
    """A page of the main window: its name, icon, label, and the short label for a narrow rail."""

    name: str
    icon: str
    word: str
    short: str


DESTINATIONS = (
    _Destination(name="home", icon="home", word="Home", short="Home"),
    _Destination(name="designer", icon="designer", word="Study designer", short="Designer"),
    _Destination(name="results", icon="bars", word="Results", short="Results"),
    _Destination(name="lab", icon="sliders", word="Liquid lab", short="Lab"),
    _Destination(name="devices", icon="device", word="Devices", short="Devices"),
    _Destination(name="machine", icon="screen", word="This machine", short="Machine"),
    _Destination(name="help", icon="info", word="Help", short="Help"),
)


class _RailButton(Themed, PressedByEnter):
    """A button in the rail for a page or a switch; its label is next to its icon, or below it in a narrow rail."""

    def __init__(self, icon: str, word: str, short: str) -> None:
        super().__init__(word)
        self.icon_name, self.word, self.short = icon, word, short
        self._is_current = False
        self._narrow = False
        self.setProperty("role", "plain")
        self.setAccessibleName(word)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.set_narrow(False)

    def set_narrow(self, narrow: bool) -> None:
        self._narrow = narrow
        self.setText(self.short if narrow else self.word)
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """Return the size of icon and label; a fixed height would be lost when the theme changes."""
        return QSize(NARROW_RAIL - 2 * NARROW_MARGIN, 58) if self._narrow else QSize(WIDE_RAIL - 2 * WIDE_MARGIN, 42)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    @property
    def is_current(self) -> bool:
        return self._is_current

    @is_current.setter
    def is_current(self, current: bool) -> None:
        self._is_current = current
        self.setAccessibleDescription("You are here" if current else "")
        self.update()

    def set_texts(self, icon: str, word: str, short: str) -> None:
        self.icon_name, self.word, self.short = icon, word, short
        self.setAccessibleName(word)
        self.set_narrow(self._narrow)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        painter.setPen(Qt.PenStyle.NoPen)
        rect = QRectF(self.rect())
        if self.is_current or self.underMouse():
            painter.setBrush(QColor(t.selected if self.is_current else t.hover))
            painter.drawRoundedRect(rect, RADIUS_CONTROL, RADIUS_CONTROL)
        if self.is_current and not self._narrow:
            painter.setBrush(QColor(t.accent))
            painter.drawRoundedRect(QRectF(0, 6, 3, rect.height() - 12), 1.5, 1.5)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.accent), _FOCUS_RING))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(rect.adjusted(1, 1, -1, -1), RADIUS_CONTROL - 1, RADIUS_CONTROL - 1)
        ink = t.accent if self.is_current else t.text2
        if self._narrow:
            draw_icon(painter, self.icon_name, QRectF(rect.width() / 2 - 10, 8, 20, 20), ink)
            room, align = QRectF(0, 30, rect.width(), 22), Qt.AlignmentFlag.AlignCenter
            painter.setFont(font("key"))
        else:
            draw_icon(painter, self.icon_name, QRectF(14, rect.height() / 2 - 10, 20, 20), ink)
            room, align = QRectF(46, 0, rect.width() - 46, rect.height()), Qt.AlignmentFlag.AlignVCenter
            painter.setFont(font("label", weight=600 if self.is_current else 500))
        painter.setPen(QColor(ink))
        painter.drawText(room, align, self.text())


class _Rail(Coloured, QWidget):
    """The navigation rail; ``go_asked`` carries the name of a page.

    Parameters
    ----------
    names : the available pages, of `DESTINATIONS`
    """

    go_asked = Signal(str)

    def __init__(self, names: Iterable[str]) -> None:
        super().__init__()
        give_ground(self, "rail")
        names = set(names)
        self.name = label("Liquid Study", "card")
        self.switch = _RailButton("moon", "Dark theme", "Dark")
        self._head = hbox(Logo(), self.name, STRETCH, spacing=10)
        self.buttons = {place.name: self._make_button(place) for place in DESTINATIONS if place.name in names}
        self._column = vbox(self._head, 22, *self.buttons.values(), STRETCH, self.switch, spacing=6, parent=self)

    def _make_button(self, place: _Destination) -> _RailButton:
        button = _RailButton(place.icon, place.word, place.short)
        button.clicked.connect(lambda: self.go_asked.emit(place.name))
        return button

    def mark_page(self, name: str) -> None:
        for other, button in self.buttons.items():
            button.is_current = other == name

    def set_narrow(self, narrow: bool) -> None:
        self.setFixedWidth(NARROW_RAIL if narrow else WIDE_RAIL)
        margin = NARROW_MARGIN if narrow else WIDE_MARGIN
        self._column.setContentsMargins(margin, 20, margin, 16)
        self._head.setContentsMargins(20 - margin, 0, 0, 0)
        self.name.setVisible(not narrow)
        for button in (*self.buttons.values(), self.switch):
            button.set_narrow(narrow)

    def apply_theme(self, theme: Theme) -> None:
        word = "Light" if theme.dark else "Dark"
        self.switch.set_texts("sun" if theme.dark else "moon", f"{word} theme", word)


FULL = QSize(1440, 900)
_LEAST = QSize(1024, 640)
_NARROW_BELOW = 1680


def bug_sentence(error: BaseException) -> str:
    """Return a sentence about an unexpected error in the program or a plug-in."""
    if isinstance(explanation := explain_error(error), StudyError):
        return f"{explanation}."
    return f"{type(error).__name__}: {error}. This is a bug: please report it and include the terminal output."


class MainWindow(Themed, QMainWindow):
    """The navigation rail and the pages, each of which is created at its first visit.

    Parameters
    ----------
    makers : functions that create the pages, by name; the first page is shown initially

    ``closed`` is emitted when the operator closes the window; ``theme_changed`` carries the chosen `Theme`.
    """

    closed = Signal()
    theme_changed = Signal(object)

    def __init__(self, makers: Mapping[str, Callable[[], Place]], *, theme: Theme = LIGHT) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setMinimumSize(_LEAST)
        self.notice: Question | None = None
        self._notice_page = ""
        self._in_session = False  # whether a session uses the screen
        self.not_opened: BaseException | None = None  # the shown error of a page that could not be opened
        self._focused: QWidget | None = None
        self._makers = makers
        self._places: dict[str, Place] = {}
        self._here = next(iter(makers))
        self.rail = _Rail(makers)
        self.stack = QStackedWidget()
        central = QWidget(accessibleName="Liquid Study")
        central.setProperty("role", "window")
        hbox(self.rail, (self.stack, 1), spacing=0, margins=0, parent=central)
        self.setCentralWidget(central)
        central.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.rail.switch.clicked.connect(self._change_theme)
        self.rail.go_asked.connect(self.go)
        QShortcut(QKeySequence("Ctrl+Q"), self, self.close)  # not every window manager has a key for this
        apply_theme(self, theme)
        self.resize(FULL)
        self.go(self._here)
        central.setFocus()

    @property
    def here(self) -> str:
        return self._here

    def place(self, name: str) -> Place:
        """Return a page, creating it on first use; if that fails, show the error and raise it."""
        if name not in self._places:
            QGuiApplication.setOverrideCursor(Qt.CursorShape.WaitCursor)
            try:
                page = self._makers[name]()
            except Exception as error:
                self._show_not_opened(name, error)
                raise
            finally:
                QGuiApplication.restoreOverrideCursor()
            page.message.connect(lambda title, sentence: self.show_message(title, sentence, page=name))
            page.file_message.connect(
                lambda title, sentence, file: self.show_message(title, sentence, page=name, file=file)
            )
            page.message_over.connect(lambda: self._close_notice(name))
            page.go_asked.connect(self.go)
            self._places[name] = page
            self.stack.addWidget(page)
            name_scroll_bars(page)
        return self._places[name]

    def go(self, name: str) -> None:
        """Leave the current page and show another one."""
        page = self.place(name)
        if name != self._here or not page.isVisible():
            if name != self._here:
                self._close_notice(self._here)
                self._places[self._here].leave()
            self._here = name
            self.rail.mark_page(name)
            self.stack.setCurrentWidget(page)
            page.enter()
        self._focus_page(self.rail.buttons[name], page)

    def _focus_page(self, button: QWidget, page: Place) -> None:
        """Move the focus from a button of the rail into its page, to the widget that last had it, or the first one."""
        if self.focusWidget() is not button:
            return
        if (last := last_focused(page)) is not None:
            last.setFocus(Qt.FocusReason.OtherFocusReason)
            return
        page.setFocus()
        page.focusNextChild()
        if not page.isAncestorOf(self.focusWidget()):
            button.setFocus()

    def _show_not_opened(self, name: str, error: BaseException) -> None:
        if not self.isVisible():
            return
        self.not_opened = error
        word = next(place.word for place in DESTINATIONS if place.name == name)
        again = ActionButton("", "Try again", role="primary")
        title = f"“{word}” could not be opened"
        notice = Question(self, self.theme, title, bug_sentence(error), again, back="Close")
        notice.accepted.connect(lambda: self.go(name))
        self._show_notice(notice)

    def hide_for_session(self) -> None:
        """Leave the current page and hide the window during a session."""
        self._places[self._here].leave()
        self._focused = self.focusWidget()
        self._in_session = True
        self.hide()

    def return_from_session(self) -> None:
        """Show the window again with the same page and focus.

        The focus is restored explicitly: Qt moves it if the window is activated while hidden, for example when the
        dialog before a session closes.
        """
        self.show()
        self._in_session = False
        if self.notice is not None and isValid(self.notice):
            self.notice.show()
        if self._focused is not None and isValid(self._focused):
            self._focused.setFocus()
        self._places[self._here].enter()

    def show_message(self, title: str, sentence: str, *, page: str = "", file: Path | None = None) -> None:
        """Show a message, with a button that opens ``file``; it closes when ``page`` is left."""
        open_file = None if file is None else ActionButton("file", "Open the file")
        if open_file is not None and file is not None:
            open_file.clicked.connect(lambda: open_here(file))
        self._show_notice(Question(self, self.theme, title, sentence, other=open_file), page)

    def ask_about_device(
        self, title: str, sentence: str, retry: Callable[[], object], diagnose: Callable[[], object] | None
    ) -> None:
        """Show that a device failed, and offer to try again and, if possible, to diagnose it."""
        try_again = ActionButton("repeat", "Try again", role="primary")
        other = None if diagnose is None else ActionButton("pulse", "Diagnose…")
        if other is not None and diagnose is not None:
            other.clicked.connect(diagnose)
        notice = Question(self, self.theme, title, sentence, try_again, back="Close", other=other)
        notice.accepted.connect(retry)
        self._show_notice(notice)

    def _show_notice(self, notice: Question, page: str = "") -> None:
        notice.finished.connect(notice.deleteLater)
        self.notice, self._notice_page = notice, page
        if not self._in_session:  # it would cover the session
            notice.show()

    def _close_notice(self, page: str) -> None:
        if self.notice is not None and self._notice_page == page and isValid(self.notice):
            self.notice.accept()

    def show_theme(self, theme: Theme) -> None:
        if theme is not self.theme:
            apply_theme(self, theme)

    def _change_theme(self) -> None:
        self.show_theme(LIGHT if self.theme.dark else DARK)
        self.theme_changed.emit(self.theme)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.rail.set_narrow(self.width() < _NARROW_BELOW)

    def closeEvent(self, event: QCloseEvent) -> None:
        for place in self._places.values():
            place.leave()
        for dialog in self.findChildren(QDialog):
            dialog.close()
        super().closeEvent(event)
        self.closed.emit()
