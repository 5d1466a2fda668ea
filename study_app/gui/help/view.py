"""The place Help: the list of pages, a search, and one page."""

from pathlib import Path

from PySide6.QtCore import QEvent, QObject, QSize, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QFrame, QLineEdit, QListWidget, QListWidgetItem

from study_app import documentation
from study_app.gui.help.reader import PageReader
from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place
from study_app.viewmodels.help import FIRST_PAGE, HelpEntry, entries, found

LIST_WIDTH, ROW_PX, HEAD_PX = 280, 30, 40
PAGE = Qt.ItemDataRole.UserRole
MOVES = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
ENTERS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


class HelpPlace(Place):
    """The documentation; ``open_page`` goes to one of its pages."""

    def __init__(self, folder: Path | None = None) -> None:
        super().__init__()
        self._before: list[str] = []
        self._came_from = ""
        self.words = QLineEdit()
        self.words.setPlaceholderText("Search the pages")
        self.words.setAccessibleName("Search the pages")
        self.words.setFont(font("label", weight=400))
        self.words.setClearButtonEnabled(True)
        self.list = QListWidget()
        self.list.setAccessibleName("Pages")
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.nothing = label("No page contains all of these words.", "label", "text2", wraps=True)
        self.reader = PageReader(documentation.folder() if folder is None else folder)
        self.back = ActionButton("chevron_left", "Back", height=38)
        self.back.setEnabled(False)
        self._lay_out()
        self.words.textChanged.connect(lambda text: self._show_rows(found(text)))
        self.words.installEventFilter(self)
        self.list.currentItemChanged.connect(self._chosen)
        self.reader.page_asked.connect(self.open_page)
        self.back.clicked.connect(self.go_back)
        self.back.setToolTip("Back (Alt+←); Esc leads to where Help was opened")
        QShortcut(QKeySequence("Alt+Left"), self, self.go_back)
        QShortcut(QKeySequence("Esc"), self, self._go_to_origin)
        QShortcut(QKeySequence(QKeySequence.StandardKey.Find), self, self.words.setFocus)
        self._show_rows(entries())
        self.open_page(FIRST_PAGE)

    def _lay_out(self) -> None:
        pages, page = Card(padding=14, gap=10), Card(padding=6, gap=0)
        pages.setFixedWidth(LIST_WIDTH)
        add_parts(pages.column, self.words, self.nothing, (self.list, 1))
        page.column.addWidget(self.reader, 1)
        head = hbox((label("Help", "title"), 1), self.back, margins=(SHADOW, 0, SHADOW, 0))
        body = hbox(pages, (page, 1), spacing=14)
        vbox(head, (body, 1), spacing=14, margins=(24, 24, 24, 18), parent=self)

    def apply_theme(self, theme: Theme) -> None:
        """Take the colours of ``theme``."""
        super().apply_theme(theme)
        row = f"border-radius: 6px; padding-left: 6px; color: {theme.text};"
        chosen = f"background: {theme.selected}; color: {theme.accent};"
        self.list.setStyleSheet(
            f"QListWidget {{ background: transparent; }} QListWidget::item {{ {row} }}"
            f"QListWidget::item:selected {{ {chosen} }}"
        )

    def open_page(self, name: str, anchor: str = "") -> None:
        """Show a page, at a heading that an anchor names; a page that does not exist is not shown."""
        if name not in documentation.names():
            return
        if self.reader.page and self.reader.page != name:
            self._before.append(self.reader.page)
            self.back.setEnabled(True)
        self.reader.show_page(name, anchor)
        self._select(name)

    def open_from(self, place: str, name: str) -> None:
        """Show a page from another place, to which *Back* leads."""
        self.open_page(name)
        self._before, self._came_from = [], place
        self.back.setEnabled(True)

    def go_back(self) -> None:
        """Show the page that was shown before; before the first one, the place where help was asked for."""
        if self._before:
            name = self._before.pop()
            self.back.setEnabled(bool(self._before or self._came_from))
            self.reader.show_page(name)
            self._select(name)
        else:
            self._go_to_origin()

    def _go_to_origin(self) -> None:
        """Go to the place where help was asked for."""
        if self._came_from:
            self.go_asked.emit(self._came_from)

    def leave(self) -> None:
        """Forget where help was asked for."""
        self._came_from = ""
        self.back.setEnabled(bool(self._before))

    def _show_rows(self, rows: tuple[HelpEntry, ...]) -> None:
        self.list.blockSignals(True)
        self.list.clear()
        for row in rows:
            item = QListWidgetItem(row.title)
            item.setData(PAGE, row.page)
            item.setToolTip(row.title)
            item.setFont(font("label", weight=600 if row.heads else 400))
            item.setSizeHint(QSize(LIST_WIDTH - 60, HEAD_PX if row.heads else ROW_PX))
            self.list.addItem(item)
        self.list.blockSignals(False)
        self.nothing.setVisible(not rows)
        self._select("" if self.words.text().strip() else self.reader.page)

    def _select(self, name: str) -> None:
        rows = [row for row in range(self.list.count()) if self.list.item(row).data(PAGE) == name]
        self.list.blockSignals(True)
        self.list.setCurrentRow(rows[0] if rows else -1)
        if not rows:
            self.list.clearSelection()
        self.list.blockSignals(False)

    def _chosen(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.open_page(item.data(PAGE))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Let arrows in the search field act on the list; the first one, and Enter, open its first page."""
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent) and event.key() in (*MOVES, *ENTERS):
            if not self.list.selectedItems():
                self.list.setCurrentRow(0)
            elif event.key() in MOVES:
                self.list.keyPressEvent(event)
            return True
        return super().eventFilter(watched, event)
