"""The outline: what the study is made of, as a tree to choose from, with a field to find."""

from PySide6.QtCore import QEvent, QItemSelectionModel, QModelIndex, QObject, QPoint, Qt, Signal
from PySide6.QtGui import QKeyEvent, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QLineEdit, QMenu

from study_app.designer.outline.outline_rows import ElementPath, OutlineRow
from study_app.designer.outline.rows import ROW_ROLE, Index
from study_app.designer.outline.tree import Tree
from study_app.gui.kit.commands import key_cap, key_words, keys_of, tip, with_key
from study_app.gui.theme.icons import icon
from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_parts, hbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided


class OutlineCard(Card):
    """Draws outline rows.

    Signals: ``chosen`` (path), ``element_clicked``, ``form_asked`` (Enter), ``find_changed`` (words), ``add_asked``,
    ``duplicate_asked``, ``delete_asked``, ``copy_asked``, ``paste_asked``, ``rename_asked``, ``move_asked`` (by how
    many places), ``field_asked`` (path of a field that was found, instead of the first two), ``dropped`` (entries of a
    list, and the index of the one that they come before), ``several_changed`` (what else is selected).
    """

    chosen = Signal(object)
    find_changed = Signal(str)
    add_asked = Signal()
    duplicate_asked = Signal()
    delete_asked = Signal()
    element_clicked = Signal()
    form_asked = Signal()
    copy_asked = Signal()
    paste_asked = Signal()
    rename_asked = Signal()
    move_asked = Signal(int)
    dropped = Signal(object, int)
    several_changed = Signal()
    field_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__(padding=12, gap=8)
        self.setAccessibleName("Outline")
        self.rows: tuple[OutlineRow, ...] = ()
        self._opened: set[object] = set()
        self._filling = self._finding = False
        self.words = QLineEdit()
        self.words.setAccessibleName("Find in the study")
        self.words.setPlaceholderText(tip("find"))
        self.words.setFont(font("label", weight=400))
        self.words.setProperty("dense", "true")
        self.words.setFixedHeight(36)
        self.words.setClearButtonEnabled(True)
        self._sign = self.words.addAction(
            icon("search", self.theme.text2, 16), QLineEdit.ActionPosition.LeadingPosition
        )
        self.nothing = Elided("label", "text2")
        self.nothing.hide()
        self.tree = Tree()
        self.items = QStandardItemModel(self.tree)
        self.tree.setModel(self.items)
        self.add = ActionButton("plus", "Add", cap=key_cap("add"), height=40)
        self.add.setAccessibleName(f"Add an element ({keys_of('add')[0]})")
        self.add.setToolTip(tip("add"))
        self.duplicate = ActionButton("", "Duplicate", cap=key_cap("duplicate"), height=40)  # no room for an icon, too
        self.duplicate.setAccessibleName(with_key("Duplicate the selected element", "duplicate"))
        self.duplicate.setToolTip(tip("duplicate"))
        for button in (self.add, self.duplicate):
            button.setFont(font("label", weight=600))
        self.add.setMaximumWidth(self.add.minimumSizeHint().width())
        foot = hbox(self.add, (self.duplicate, 1), spacing=8)
        add_parts(self.column, self.words, self.nothing, (self.tree, 1), foot)
        self.words.textChanged.connect(self.find_changed)
        self.words.returnPressed.connect(self._open_first)
        self.words.installEventFilter(self)
        self.tree.selectionModel().currentChanged.connect(self._choose)
        self.tree.selectionModel().selectionChanged.connect(lambda _now, _before: self.several_changed.emit())
        self.tree.clicked.connect(self._click)
        self.tree.expanded.connect(lambda index: None if self._finding else self._opened.add(self._key(index)))
        self.tree.collapsed.connect(lambda index: self._opened.discard(self._key(index)))
        self.tree.delete_asked.connect(self.delete_asked)
        self.tree.entered_row.connect(self._enter_row)
        self.tree.copy_asked.connect(self.copy_asked)
        self.tree.paste_asked.connect(self.paste_asked)
        self.tree.dropped.connect(self.dropped)
        self.tree.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.tree.customContextMenuRequested.connect(self._open_menu)
        self.menu: QMenu | None = None
        self.add.clicked.connect(self.add_asked)
        self.duplicate.clicked.connect(self.duplicate_asked)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self._sign.setIcon(icon("search", theme.text2, 16))

    @property
    def selected(self) -> tuple[ElementPath, ...]:
        """The selected elements, in the order of the outline."""
        order = {row.path: at for at, row in reversed([*enumerate(self.rows)])}
        found = {row.path for row in self.tree.selected_rows()}
        return tuple(sorted(found, key=lambda path: order.get(path, 0)))

    def select_several(self, paths: tuple[ElementPath, ...], *, selects: bool = True) -> None:
        """Select elements together with the current one, or no longer."""
        flags = QItemSelectionModel.SelectionFlag
        flag = flags.Select if selects else flags.Deselect
        self._filling = True
        for index in self.indexes():
            if index.data(ROW_ROLE).path in paths and index.data(ROW_ROLE).path:
                if index.parent().isValid():
                    self.tree.expand(index.parent())
                self.tree.selectionModel().select(index, flag)
        self._filling = False

    def begin(self) -> None:
        """Begin with the next rows as if there had been none: at the top, everything closed, nothing to find."""
        self.rows, self._opened = (), set()
        self._filling = True
        self.items.clear()
        self._filling = False
        self.words.clear()

    def show_outline(self, rows: tuple[OutlineRow, ...], selected: object) -> None:
        """Show rows; what was open stays open. Where nothing was found, a line says so."""
        self._say_whether_found(rows)
        if rows != self.rows:
            several, current = self.selected, self.tree.currentIndex()
            before = current.data(ROW_ROLE).path if current.isValid() else None
            self.rows = rows
            self._filling = True
            scrolled = self.tree.verticalScrollBar().value()
            self.items.clear()
            above: list[QStandardItem] = [self.items.invisibleRootItem()]
            for row in rows:
                item = QStandardItem(row.title)
                item.setData(row, ROW_ROLE)
                item.setData(row.name, Qt.ItemDataRole.AccessibleTextRole)
                item.setToolTip(row.title)  # it may be cut
                if not row.path:
                    item.setFlags(Qt.ItemFlag.ItemIsEnabled)
                depth = max(row.depth - 1, 0)
                del above[depth + 1 :]
                above[-1].appendRow(item)
                above.append(item)
            self._finding = bool(self.words.text().strip())
            for index in self.indexes():
                if self._key(index) in self._opened or self._finding:
                    self.tree.expand(index)
            self._finding = False
            self.tree.doItemsLayout()  # without it there is nothing to scroll
            self.tree.verticalScrollBar().setValue(scrolled)
            self._filling = False
            self.mark(selected, reveals=selected != before)
            if selected in several and len(several) > 1:
                self.select_several(several)
        self.mark(selected)

    def _say_whether_found(self, rows: tuple[OutlineRow, ...]) -> None:
        words = self.words.text().strip()
        sentence = f'Nothing called "{words}" in this study' if words and not rows else ""
        if sentence and sentence != self.nothing.whole:
            say(self.words, sentence)
        self.nothing.show_text(sentence)
        self.nothing.setVisible(bool(sentence))

    def mark(self, path: object, *, reveals: bool = True) -> None:
        """Mark the row of an element; ``reveals`` opens what it is in, and scrolls to it."""
        current = self.tree.currentIndex()
        if current.isValid() and current.data(ROW_ROLE).path == path:
            return
        found = next((index for index in self.indexes() if index.data(ROW_ROLE).path == path), None)
        self._filling = True
        if found is None:
            self.tree.clearSelection()
            self.tree.setCurrentIndex(QModelIndex())
        else:
            if reveals and found.parent().isValid():
                self.tree.expand(found.parent())
            if reveals and "blocks" in path[:1]:  # type: ignore[index]  # a path
                self.tree.expand(found)
            down = self.tree.verticalScrollBar().value()
            flags = QItemSelectionModel.SelectionFlag
            self.tree.selectionModel().setCurrentIndex(found, flags.ClearAndSelect)
            if reveals:
                self.tree.scrollTo(found)
            else:  # Qt scrolls to it, too
                self.tree.verticalScrollBar().setValue(down)
        self._filling = False

    def _open_menu(self, at: QPoint) -> None:
        """Show what can be done with the selected elements, each with its key."""
        menu = self.menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.setFont(font("label"))
        writable = self.add.isEnabled()
        row = self.tree.currentIndex().data(ROW_ROLE) if self.tree.currentIndex().isValid() else None
        ordered = writable and row is not None and bool(row.step)
        for words, name, act, possible in (
            ("Add …", "add", self.add_asked.emit, writable),
            ("Duplicate", "duplicate", self.duplicate_asked.emit, self.duplicate.isEnabled()),
            ("Copy", "copy", self.copy_asked.emit, row is not None and len(row.path) > 1),
            ("Paste", "paste", self.paste_asked.emit, writable),
            ("Move up", "up", lambda: self.move_asked.emit(-1), ordered),
            ("Move down", "down", lambda: self.move_asked.emit(1), ordered),
            ("Rename", "rename", self.rename_asked.emit, writable and row is not None and len(row.path) > 1),
            ("Delete", "delete", self.delete_asked.emit, self.duplicate.isEnabled()),
        ):
            action = menu.addAction(f"{words}\t{key_words(keys_of(name)[0])}")
            action.setEnabled(possible)
            action.triggered.connect(lambda _checked=False, act=act: act())
        menu.popup(self.tree.viewport().mapToGlobal(at))

    def indexes(self) -> list[QModelIndex]:
        """Return the rows in their order, those of branches that are closed included."""
        found: list[QModelIndex] = []
        waiting = [self.items.index(row, 0) for row in range(self.items.rowCount())]
        while waiting:
            index = waiting.pop(0)
            found.append(index)
            waiting[:0] = [self.items.index(row, 0, index) for row in range(self.items.rowCount(index))]
        return found

    def _key(self, index: Index) -> object:
        row, parent = index.data(ROW_ROLE), index.parent()
        return row.path, row.depth, parent.data(ROW_ROLE).path if parent.isValid() else None

    def _choose(self, index: QModelIndex) -> None:
        if not self._filling and index.isValid() and index.data(ROW_ROLE).path:
            self.chosen.emit(index.data(ROW_ROLE).path)

    def _click(self, index: QModelIndex) -> None:
        """Open or close the heading of several, or what its arrow is clicked of; else go to what was found."""
        heading = self.items.hasChildren(index) and len(index.data(ROW_ROLE).path) == 1
        if heading or self.tree.arrow_pressed:
            self.tree.setExpanded(index, not self.tree.isExpanded(index))
        else:
            self.tree.expand(index)
            if not self._open_field():
                self.element_clicked.emit()

    def _enter_row(self) -> None:
        if not self._open_field():
            self.form_asked.emit()

    def _open_field(self) -> bool:
        """Go to the field of the current row that was found; return whether there is one."""
        current = self.tree.currentIndex()
        field: ElementPath = current.data(ROW_ROLE).field if current.isValid() else ()
        if field:
            self.field_asked.emit(field)
        return bool(field)

    def _go_to_first(self) -> bool:
        """Select the first element that is called so, else the first with a field that is; return whether one is."""
        rows = [(index, index.data(ROW_ROLE)) for index in self.indexes() if index.data(ROW_ROLE).path]
        called = [index for index, row in rows if row.named]
        with_field = [index for index, row in rows if row.field]
        first = next(iter((*called, *with_field, *(index for index, _ in rows))), None)
        if first is not None:
            self.tree.selectionModel().setCurrentIndex(first, QItemSelectionModel.SelectionFlag.ClearAndSelect)
        return first is not None

    def _open_first(self) -> None:
        """Select the first element that was found, and go to its field."""
        if self.words.text().strip() and self._go_to_first() and not self._open_field():
            self.tree.setFocus(Qt.FocusReason.OtherFocusReason)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        down = event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Down
        if down and (not self.words.text().strip() or self._go_to_first()):
            self.tree.setFocus(Qt.FocusReason.OtherFocusReason)
            return True
        return super().eventFilter(watched, event)
