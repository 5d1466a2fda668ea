"""The header of the designer (study, problems, draft, undo, redo, save), and the banner below it."""

from PySide6.QtCore import QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.designer.new_study.study_list import StudyList
from study_app.designer.participant.play import PlayControls, PlayStrip
from study_app.designer.place.designer_view import Banner, HeaderState
from study_app.gui.kit.commands import tip, with_key
from study_app.gui.kit.dialogs import choose_protocol
from study_app.gui.theme.theme import RADIUS_CARD, Tone, font
from study_app.gui.theme.themed import Themed, apply_theme_within, remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card, Chip, Icon, chip_size, paint_chip
from study_app.gui.widgets.controls import ActionButton, IconButton, PressedByEnter
from study_app.gui.widgets.labels import label


class BannerCard(Card):
    """Draws a `Banner`; ``asked`` carries the action of a button, "close" of the one that closes it.

    ``keyboard_left`` is emitted before the line is hidden while it has the keyboard.
    Where the study is read-only, it is hidden while another line is shown; any other banner needs an answer.
    """

    asked = Signal(str)
    keyboard_left = Signal()

    def __init__(self) -> None:
        super().__init__(padding=10, gap=6)
        self.words = label("", "label", wraps=True)
        self.sign = Icon("info", "accent", 20)
        self.buttons: list[ActionButton] = []
        self.close_button = IconButton("cross", "Close this line", "Close (Esc)", size=36, role="plain")
        self.close_button.clicked.connect(lambda: self.asked.emit("close"))
        self._banner: Banner | None = None
        self._other = False
        self._row = hbox(self.sign, (self.words, 1), self.close_button, spacing=10)
        add_layout(self.column, self._row)
        self.hide()

    def make_room(self, *, other: bool) -> None:
        """Hide what needs no answer while another line is shown (``other``)."""
        self._other = other
        shown = self._banner is not None and not (other and self._banner.only_offers_copy)
        if not shown and self.isAncestorOf(self.window().focusWidget()):
            self.keyboard_left.emit()  # else Qt hands the keyboard to the next part
        self.setVisible(shown)

    def close_by_key(self) -> bool:
        """Close a line that can be closed; return whether there was one."""
        closes = self.isVisible() and self._banner is not None and self._banner.closes
        if closes:
            self.asked.emit("close")
        return closes

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(self.theme.accent))
        painter.setBrush(QColor(self.theme.selected))
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW - 1, -SHADOW, -SHADOW - 1).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)

    def show_banner(self, banner: Banner | None) -> None:
        self._banner = banner
        self.make_room(other=self._other)
        self.close_button.setVisible(banner is not None and banner.closes)
        if banner is None:
            self.words.clear()
            return
        if banner.words == self.words.text():
            return
        self.words.setText(banner.words)
        say(self, banner.words)
        for button in self.buttons:
            remove_widget(button)
        self.buttons = []
        for action, words in banner.actions:
            made = ActionButton("", words, role="primary" if action == "copy" else "", height=36)
            made.clicked.connect(lambda _checked=False, action=action: self.asked.emit(action))
            apply_theme_within(made, self.theme)
            self._row.insertWidget(self._row.count() - 1, made)
            self.buttons.append(made)


NEW, OPEN = "\0new", "\0open"
WIDE_FROM = 1180
NAME_MOST_PX, NAME_EDGES_PX = 300, 60
WIDEST_PROBLEMS, WIDEST_DRAFT, WIDEST_VERSION = "88 problems", "Draft kept 88:88", "1.8, was 1.8"
"""What there is room for in each chip, so that nothing moves where it says other words."""


class ChipButton(Themed, PressedByEnter):
    """A chip that is pressed; ``does`` says what follows."""

    def __init__(self, does: str) -> None:
        super().__init__()
        self._does = does
        self.setProperty("role", "plain")
        self.setProperty("dense", "true")
        self._state: tuple[Tone, str, str] = ("ok", "check", "")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def show_state(self, tone: Tone, icon: str, words: str) -> None:
        self._state = (tone, icon, words)
        self.setAccessibleName(f"{words}: {self._does}")
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(chip_size(self.words, small=False).width(), 32)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    @property
    def words(self) -> str:
        return self._state[2]

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(0, self.height() / 2 - 14, self.sizeHint().width(), 28)
        paint_chip(painter, body, self.theme, *self._state, small=False)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self.theme.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body.adjusted(1, 0, -1, 0), 13, 13)


class DesignerHeader(QWidget):
    """Signals: ``study_asked`` (source), ``new_asked``, ``problems_asked``, undo, redo, save.

    ``keyboard_left`` is emitted when a button that has the keyboard is about to be disabled, and after a click between
    the buttons or on one that is disabled.
    """

    study_asked = Signal(str)
    new_asked = Signal()
    problems_asked = Signal()
    keyboard_left = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Header")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.state = HeaderState()
        self.study = StudyList()
        self.study.setAccessibleName("Study")
        self.study.setFont(font("body"))
        self.study.setMinimumWidth(150)
        self.study.setMaxVisibleItems(24)
        self.study.setPlaceholderText("Choose a study")
        self.problems = ChipButton("show the list")
        self.problems.setToolTip(f"{tip('problems')}; {tip('next problem')}")
        self.version = ChipButton("show the changes")
        self.draft = Chip("neutral", "save", "")
        self.keys = IconButton("question", "Keys")
        self.undo = IconButton("undo", "Undo")
        self.redo = IconButton("redo", "Redo")
        self.save = ActionButton("save", "Save", role="primary")
        self.play = PlayControls()
        self.strip = PlayStrip()
        self.strip.left.connect(self.play.play.setFocus)
        self._row = hbox(spacing=10, margins=(SHADOW, 0, SHADOW, 0))
        vbox(self._row, self.strip, margins=0, parent=self)
        self.title = label("Study designer", "title")
        self.title.setContentsMargins(0, 0, 6, 0)  # room that goes with it where it is hidden
        left = self.title, self.study, self.problems, self.draft, self.version
        add_parts(self._row, *left, STRETCH, self.keys, self.undo, self.redo, self.play, self.save)
        self.study.activated.connect(self._choose)
        self.problems.clicked.connect(self.problems_asked)
        self.show_state(self.state)

    def show_state(self, state: HeaderState) -> None:
        before, self.state = self.state, state
        self._announce(before, state)
        if state.studies != before.studies or state.chosen != before.chosen or not self.study.count():
            with QSignalBlocker(self.study):
                self.study.clear()
                for study in state.studies:
                    self.study.add_study(study, opened=study.source == state.chosen)
                self.study.addItem("New study …", NEW)
                self.study.addItem("Open file …", OPEN)
                self.study.setCurrentIndex(self.study.findData(state.chosen) if state.chosen else -1)
        there = bool(state.chosen)
        for part in (self.problems, self.undo, self.redo, self.play, self.save):
            part.setVisible(there)
        self.problems.show_state(*state.problems)
        self.draft.show_state("neutral", "save", state.draft)
        self.version.show_state(state.version.tone, state.version.icon, state.version.words)
        self.version.setToolTip(state.version.tip)
        for button, action, what in ((self.undo, "undo", state.undo), (self.redo, "redo", state.redo)):
            words = ": ".join(filter(None, (action.capitalize(), what)))
            self._enable(button, on=bool(what) and not state.read_only)
            button.setAccessibleName(words)
            button.setToolTip(with_key(words, action))
        self.save.show_action("save", state.version.save)
        self._enable(self.save, on=state.can_save)
        self._make_room()

    def _enable(self, button: QWidget, *, on: bool) -> None:
        """Enable a button or not; Qt would give its keyboard to whatever is next."""
        if not on and self.window().focusWidget() is button:
            self.keyboard_left.emit()
        button.setEnabled(on)

    def _make_room(self) -> None:
        """Hide the title, then the version, if the name of the study is too long; the draft is always shown."""
        state = self.state
        named = min(NAME_MOST_PX, self.study.fontMetrics().horizontalAdvance(self.study.currentText()) + NAME_EDGES_PX)
        more = max(0, named - self.study.minimumWidth())
        widest = ((self.problems, WIDEST_PROBLEMS), (self.draft, WIDEST_DRAFT), (self.version, WIDEST_VERSION))
        for chip, words in widest:
            chip.setMinimumWidth(chip_size(words, small=False).width())
        self.title.show()
        self.draft.setVisible(bool(state.chosen and state.draft))
        self.version.setVisible(bool(state.chosen and state.version.words))
        for part in (self.title, self.version):
            self._row.invalidate()
            part.setVisible(part.isVisibleTo(self) and self._row.minimumSize().width() + more <= self.width())

    def _announce(self, before: HeaderState, state: HeaderState) -> None:
        """Have said once what changes by itself: the problems, and that a draft is kept."""
        if not state.chosen or state.chosen != before.chosen:
            return
        if state.problems != before.problems:
            say(self, state.problems[2])
        if state.draft.startswith("Draft") and not before.draft.startswith("Draft"):
            say(self, state.draft)

    def focusInEvent(self, _event: QFocusEvent) -> None:
        self.keyboard_left.emit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.play.show_wide(self.width() >= WIDE_FROM)
        self._make_room()

    def _choose(self, at: int) -> None:
        source = self.study.itemData(at)
        self.study.setCurrentIndex(self.study.findData(self.state.chosen) if self.state.chosen else -1)
        if source == NEW:
            self.new_asked.emit()
        elif source == OPEN:
            self.open_file()
        elif source != self.state.chosen:
            self.study_asked.emit(source)

    def open_file(self) -> None:
        if chosen := choose_protocol(self, "Open study"):
            self.study_asked.emit(chosen)
