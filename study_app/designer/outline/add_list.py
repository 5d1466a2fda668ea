"""The list of what can be added, filtered by typing."""

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QLineEdit, QListWidget, QListWidgetItem, QWidget

from study_app.designer.document.elements import words_sought
from study_app.designer.outline.addable import Addable
from study_app.gui.theme.icons import icon
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label

WIDTH, HIGHEST, ROW_PX, HELP_PX = 360, 520, 34, 78
MOVES = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class AddList(Themed, QFrame):
    """A list over the place; ``chosen`` carries an `Addable`, ``typed`` the words that it is filtered by."""

    chosen = Signal(object)
    typed = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAccessibleName("Add")
        self.setProperty("role", "card")
        self._every: tuple[Addable, ...] = ()
        self._fields: tuple[Addable, ...] = ()
        self.words = QLineEdit()
        self.words.setFont(font("label", weight=400))
        self.words.setProperty("dense", "true")
        self.words.setFixedHeight(36)
        self.words.setPlaceholderText("Type to filter")
        self.words.setAccessibleName("Filter what can be added")
        self.list = QListWidget()
        self.list.setAccessibleName("What can be added")
        self.list.setFont(font("label"))
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setIconSize(QSize(18, 18))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.help = label("", "small", "text2", wraps=True)
        self.help.setMinimumHeight(HELP_PX)
        self.help.setAlignment(Qt.AlignmentFlag.AlignTop)
        vbox(self.words, (self.list, 1), self.help, spacing=8, margins=10, parent=self)
        self.words.textChanged.connect(self._type)
        self.words.installEventFilter(self)
        self.list.currentItemChanged.connect(lambda item: self.help.setText(item.toolTip() if item else ""))
        self.list.itemClicked.connect(lambda _item: self._choose())
        self.list.itemActivated.connect(lambda _item: self._choose())

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        row = f"border-radius: 6px; color: {theme.text};"
        chosen = f"background: {theme.selected}; color: {theme.accent};"
        self.list.setStyleSheet(f"QListWidget::item {{ {row} }} QListWidget::item:selected {{ {chosen} }}")

    def open(self, every: tuple[Addable, ...], above: QPoint) -> None:
        """Show what can be added, with its lower left corner at a place of the screen."""
        self._every = every
        self.words.clear()
        self._type("")
        height = min(HIGHEST, 82 + HELP_PX + ROW_PX * len(every))
        screen = self.screen().availableGeometry()
        at = QPoint(min(above.x(), screen.right() - WIDTH), max(screen.top(), above.y() - height))
        self.setGeometry(at.x(), at.y(), WIDTH, height)
        self.show()
        self.words.setFocus(Qt.FocusReason.PopupFocusReason)

    def offer_fields(self, fields: tuple[Addable, ...]) -> None:
        """Take the fields that have the words that were ``typed``; they come last."""
        self._fields = fields

    def _type(self, words: str) -> None:
        self._fields = ()
        self.typed.emit(words)
        wanted = words_sought(words)
        self.list.clear()
        fitting = [one for one in self._every if all(part in f"{one.words} {one.help}".casefold() for part in wanted)]
        typed = words.casefold().split()
        fitting.sort(key=lambda one: one.words.casefold().split()[: len(typed)] != typed)  # whole words come first
        for one in (*fitting, *self._fields):
            item = QListWidgetItem(icon(one.icon, self.theme.text2, 18), one.words)
            item.setData(Qt.ItemDataRole.UserRole, one)
            item.setToolTip(one.help)
            item.setData(Qt.ItemDataRole.AccessibleDescriptionRole, one.help)
            item.setSizeHint(QSize(WIDTH - 40, ROW_PX))
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        if not self.list.count():
            self.help.setText("Nothing that can be added here has this name")

    def _choose(self) -> None:
        if (item := self.list.currentItem()) is not None:
            self.close()
            self.chosen.emit(item.data(Qt.ItemDataRole.UserRole))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            if event.key() in MOVES:
                self.list.keyPressEvent(event)
                return True
            if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
                self._choose()
                return True
        return super().eventFilter(watched, event)
