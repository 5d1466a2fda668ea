"""The card that lists the keys of the designer, over the place; Esc closes it."""

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QHBoxLayout, QWidget
from shiboken6 import isValid

from study_app.gui.kit.commands import COMMANDS, GROUPS, Command
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule, scrolled
from study_app.gui.widgets.controls import Cap, IconButton
from study_app.gui.widgets.labels import label

HIGHEST, WIDEST, MARGIN = 560, 980, 12
COLUMNS = ((0,), (1,), (2, 3))
"""The groups of each column."""
SCROLLS = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1, Qt.Key.Key_PageUp: -10, Qt.Key.Key_PageDown: 10}


class KeysCard(Card):
    """A list of the keys, in groups; it closes when the keyboard goes elsewhere."""

    def __init__(self, place: QWidget) -> None:
        super().__init__(padding=18, gap=8)
        self.setParent(place)
        self._place = place
        self.setAccessibleName("Keys")
        self._before: QWidget | None = None
        self.close_button = IconButton("cross", "Close the list of keys", "Close (Esc)", size=36, role="plain")
        self.close_button.clicked.connect(self.put_away)
        top = hbox(label("Keys", "card"), STRETCH, self.close_button)
        across = hbox(spacing=28, margins=(0, 0, 8, 0))
        for groups in COLUMNS:
            column = vbox(spacing=5)
            for group in groups:
                column.addWidget(label(GROUPS[group], "strong"))
                for one in (one for one in COMMANDS if one.group == group):
                    add_layout(column, self._row(one))
                column.addSpacing(10)
            column.addStretch()
            add_layout(across, column, 1)
        self.area = scrolled(across)
        add_parts(self.column, top, Rule(), (self.area, 1))
        self.hide()
        application = QApplication.instance()
        assert isinstance(application, QApplication)  # noqa: S101 - a window has one
        application.focusChanged.connect(self._follow_focus)

    @staticmethod
    def _row(one: Command) -> QHBoxLayout:
        where = f" ({one.within})" if "outline" in one.within else ""
        words = label(f"{one.words}{where}", "label", "text2", wraps=True)
        words.setAccessibleName(f"{one.words}{where}: {' or '.join(one.shown)}")
        return hbox((words, 1), *(Cap(key) for key in one.shown), spacing=5)

    def switch(self) -> None:
        """Show the list, or put it away."""
        if self.isVisible():
            self.put_away()
            return
        self._before = self.window().focusWidget()
        self.make_room()
        self.show()
        self.raise_()
        self.close_button.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def put_away(self) -> None:
        """Hide the list; the keyboard goes back to where it was."""
        before, self._before = self._before, None
        if before is not None and isValid(before) and before.isVisible():
            before.setFocus(Qt.FocusReason.OtherFocusReason)
        self.hide()

    def make_room(self) -> None:
        """Stand in the middle of the place."""
        around = self._place.rect()
        inner = self.area.widget().sizeHint().height() + self.sizeHint().height() - self.area.sizeHint().height()
        wide, high = min(WIDEST, around.width() - 2 * MARGIN), min(HIGHEST, inner + 4, around.height() - 2 * MARGIN)
        self.setGeometry(QRect((around.width() - wide) // 2, (around.height() - high) // 2, wide, high))

    def _follow_focus(self, _left: QWidget | None, now: QWidget | None) -> None:
        if self.isVisible() and now is not None and not self.isAncestorOf(now):
            self._before = None
            self.hide()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.put_away()
        elif lines := SCROLLS.get(Qt.Key(event.key()), 0):
            bar = self.area.verticalScrollBar()
            bar.setValue(bar.value() + lines * bar.singleStep())
        else:
            super().keyPressEvent(event)
