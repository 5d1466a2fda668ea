"""The tab Changes: a version to compare with, and how the study differs from it, in sentences or side by side."""

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QStackedWidget, QWidget

from study_app.gui.designer.segments import Segments
from study_app.gui.designer.versions.change_list import ChangeList
from study_app.gui.designer.versions.side_by_side_view import SideBySideView
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import Choice
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.versions.changes_view import ChangesView

NOTHING = "There is no version to compare with: no session was run, and nothing was saved before."


class ChangesCard(Card):
    """Draws a `ChangesView`.

    Signals: ``version_chosen`` (key); ``go_asked`` and ``revert_asked`` (a `ChangeRow`); ``revert_text_asked``
    (a `Hunk`).
    """

    version_chosen = Signal(str)
    go_asked = Signal(object)
    revert_asked = Signal(object)
    revert_text_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__(padding=14, gap=8)
        self.setAccessibleName("Changes")
        self.view = ChangesView()
        self._side = "sentences"
        self.version = Choice()
        self.version.setFont(font("label"))
        self.version.setAccessibleName("Version to compare with")
        self.version.setMinimumWidth(120)
        self.how = Segments("Show changes", height=32)
        self.note = label("", "label", "text2", wraps=True)
        self.list = ChangeList()
        self.sides = SideBySideView()
        self.stack = QStackedWidget()
        self.stack.addWidget(self.list)
        self.stack.addWidget(self.sides)
        self._of = label("Compare with", "label")
        self.top = QWidget()
        hbox(self._of, (self.version, 1), self.how, spacing=10, margins=0, parent=self.top)
        self.nothing = label(NOTHING, "body", "text2", wraps=True)
        add_parts(self.column, self.top, self.nothing, (vbox(self.note, (self.stack, 1)), 1))
        self.setFocusProxy(self.version)
        self.version.activated.connect(lambda at: self.version_chosen.emit(str(self.version.itemData(at))))
        self.how.chosen.connect(lambda how: self.show_how(str(how)))
        self.list.go_asked.connect(self.go_asked)
        self.list.revert_asked.connect(self.revert_asked)
        self.sides.revert_asked.connect(self.revert_text_asked)
        self.show_view(self.view)

    def show_view(self, view: ChangesView) -> None:
        """Show another comparison."""
        before, self.view = self.view, view
        if view.versions != before.versions or view.chosen != before.chosen:
            with QSignalBlocker(self.version):
                self.version.clear()
                for one in view.versions:
                    self.version.addItem(one.words, one.key)
                self.version.setCurrentIndex(self.version.findData(view.chosen) if view.chosen else -1)
        there = bool(view.versions)
        for part in (self.top, self.stack):
            part.setVisible(there)
        self.nothing.setVisible(not there)
        self.note.setText(view.note)
        self.note.setVisible(there and bool(view.note))
        self.how.setVisible(view.sides is not None)
        self.list.show_groups(view.groups, can_revert=view.can_revert)
        if view.sides is not None:
            self.sides.show_sides(view.sides, can_revert=view.can_revert)
        self.show_how(self._side)

    def show_how(self, how: str) -> None:
        """Show the differences in sentences, or side by side."""
        self._side = how
        both = how == "both" and self.view.sides is not None
        fresh = both and self.stack.currentWidget() is not self.sides
        self.how.show_values((("sentences", "Sentences"), ("both", "Side by side")), how)
        self.stack.setCurrentWidget(self.sides if both else self.list)
        if fresh:
            self.sides.go(0)
