"""The header of the designer (study, problems, draft, undo, redo, save), and the banner below it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QFontMetrics, QKeyEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QStyle, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from study_app.designer.form.rows import Form
from study_app.designer.participant.play import PLAY, PLAY_NARROW, Notice, NoticeCard, PlayControls
from study_app.designer.place.file import FileText
from study_app.designer.problems.problems import ProblemRow
from study_app.designer.versions.version_rows import VersionChip
from study_app.gui.kit.commands import tip, with_key
from study_app.gui.kit.dialogs import choose_protocol
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import Tone, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Chip, chip_size, paint_chip, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Choice, IconButton, PressedByEnter
from study_app.gui.widgets.labels import label
from study_app.number_text import counted

BETWEEN: Final = "  ·  "
"""What is between the title of a study and its file."""
BEFORE_ORIGIN: Final = "  ("
"""What is between its file and where it is from."""
NO_FILE: Final = FileText()
NO_VERSION: Final = VersionChip()


@dataclass(frozen=True, slots=True)
class StudyChoice:
    """A study that can be opened."""

    # what it is called, the name of its file, and what it is opened by
    title: str
    file: str
    source: str
    # whether it ships with the program, and whether a draft of it was kept that is not saved
    shipped: bool = False
    drafted: bool = False
    original: str = ""  # the name of the study that it is a copy of; "" where it is not known to be one

    @property
    def words(self) -> str:
        origin = "shipped" if self.shipped else self.original and f"copy of {self.original}"
        return f"{self.title}{BETWEEN}{self.file}" + (f"{BEFORE_ORIGIN}{origin})" if origin else "")


@dataclass(frozen=True, slots=True)
class HeaderState:
    """The header."""

    studies: tuple[StudyChoice, ...] = ()  # what can be opened
    chosen: str = ""  # what is open, by its source; "" where nothing is
    problems: tuple[Tone, str, str] = ("ok", "check", "No problems")  # tone, icon and words of the chip
    draft: str = ""  # what is said of the draft, "" where nothing is
    # what would be undone and redone; "" where nothing is
    undo: str = ""
    redo: str = ""
    can_save: bool = False  # whether the file differs and may be written
    read_only: bool = False  # whether the study cannot be changed
    version: VersionChip = NO_VERSION  # the chip of the version, and what the button that saves says


@dataclass(frozen=True, slots=True)
class DesignerView:
    """What the place shows, but the outline, which follows a moment later; without a form no study is open."""

    header: HeaderState = HeaderState()
    form: Form | None = None
    file: FileText = NO_FILE
    problems: tuple[ProblemRow, ...] = ()
    banner: Notice | None = None


def problems_chip(count: int, warnings: int) -> tuple[Tone, str, str]:
    """Return tone, icon and words of the chip of problems."""
    if count:
        return "bad", "warning", counted(count, "problem")
    if warnings:
        return "warn", "warning", counted(warnings, "warning")
    return "ok", "check", "No problems"


MARK_PX = 28
TITLE_ROLE = Qt.ItemDataRole.UserRole + 1
"""How many letters of a line are the title."""
OPENS = {
    Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Home, Qt.Key.Key_End,
    Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space, Qt.Key.Key_F4,
}  # fmt: skip
Index = QModelIndex | QPersistentModelIndex


def cut_title(words: str, length: int, metrics: QFontMetrics, room_px: int) -> str:
    """Return the first letters of words, the title, as many as leave room for the rest."""
    rest_px = metrics.horizontalAdvance(words[length:])
    return metrics.elidedText(words[:length], Qt.TextElideMode.ElideRight, max(0, room_px - rest_px))


class StudyLine(QStyledItemDelegate):
    """A study in the list of all: its file is less prominent than its title, and the open one has a check mark."""

    def __init__(self, studies: StudyList) -> None:
        super().__init__(studies)
        self._studies = studies

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        wanted = super().sizeHint(option, index) + QSize(MARK_PX, 0)
        return QSize(min(wanted.width(), self._studies.window().width() * 2 // 3), wanted.height())

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        shown = QStyleOptionViewItem(option)
        self.initStyleOption(shown, index)
        style, words, title = self._studies.style(), index.data(), index.data(TITLE_ROLE)
        room = style.subElementRect(QStyle.SubElement.SE_ItemViewItemText, shown, self._studies.view())
        room.setLeft(room.left() + style.pixelMetric(QStyle.PixelMetric.PM_FocusFrameHMargin) + 1)  # as Qt does
        shown.text = "" if title else words  # type: ignore[attr-defined]  # missing in the stubs
        style.drawControl(QStyle.ControlElement.CE_ItemViewItem, shown, painter, self._studies.view())
        if title:
            painter.setFont(shown.font)  # type: ignore[attr-defined]
            called = cut_title(words, title, painter.fontMetrics(), room.width() - MARK_PX)
            for part, ink in ((called, "text"), (words[title:], "text2")):
                painter.setPen(QColor(getattr(self._studies.theme, ink)))
                painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, part)
                room.setLeft(room.left() + painter.fontMetrics().horizontalAdvance(part))
        if index.row() == self._studies.currentIndex():
            place = QRectF(option.rect)  # type: ignore[attr-defined]  # missing in the stubs
            mark = QRectF(place.right() - MARK_PX, place.center().y() - 8, 16, 16)
            draw_icon(painter, "check", mark, self._studies.theme.accent, 2.2)


class StudyList(Choice):
    """The studies that can be opened; keys open the list, none of them opens another study."""

    def __init__(self) -> None:
        super().__init__()
        self.setItemDelegate(StudyLine(self))

    def add_study(self, study: StudyChoice, *, opened: bool) -> None:
        self.addItem(study.words, study.source)
        self.setItemData(self.count() - 1, len(study.title), TITLE_ROLE)
        if opened:
            self.setItemData(self.count() - 1, f"{study.words}, open", Qt.ItemDataRole.AccessibleTextRole)

    def fitted(self, words: str, room_px: int) -> str:
        """Return title and file; where there is no room for both, the title alone unless another study has it, too."""
        shown = super().fitted(words, room_px)
        if shown == words:
            return shown
        length = self.currentData(TITLE_ROLE) or len(words)
        titles = [self.itemText(at)[: self.itemData(at, TITLE_ROLE)] for at in range(self.count())]
        if titles.count(title := words[:length]) < 2:
            return super().fitted(title, room_px)
        file = words[length:].partition(BEFORE_ORIGIN)[0]
        return super().fitted(cut_title(title + file, length, self.fontMetrics(), room_px) + file, room_px)

    def showPopup(self) -> None:
        super().showPopup()
        if self.currentIndex() < 0:
            self.view().setCurrentIndex(self.model().index(0, self.modelColumn()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        shift_or_pad = Qt.KeyboardModifier.KeypadModifier | Qt.KeyboardModifier.ShiftModifier
        letter = event.text().strip() if event.text().isprintable() else ""
        if (event.key() in OPENS or letter) and not event.modifiers() & ~shift_or_pad:
            self.showPopup()
            if letter:
                self.view().keyboardSearch(letter)
        else:
            event.ignore()


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
        painter = smooth_painter(self)
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
        self.strip = NoticeCard(of_playing=True)
        self.strip.setAccessibleName("Playing")
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
        self.play.play.show_action("play", PLAY if self.width() >= WIDE_FROM else PLAY_NARROW)
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
