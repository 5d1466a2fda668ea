"""The card that asks before a study that was run is saved: what differs, under which version, or as another study."""

from PySide6.QtCore import Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QLineEdit, QWidget

from study_app.gui.designer.prompts import Prompt
from study_app.gui.designer.repair_button import NameRefusal
from study_app.gui.designer.versions.change_list import LEAST, ChangeList
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.versions.standing import SavePrompt

MOST = 240
REST_PX = 760
"""So much of the window is for the rest of the card, and for form and pane."""


class SaveCard(Prompt):
    """Signals: ``save_asked`` (version), ``another_asked`` (name), ``changes_asked``."""

    save_asked = Signal(str)
    another_asked = Signal(str)
    changes_asked = Signal()

    def __init__(self, asked: SavePrompt) -> None:
        super().__init__("Save another version", asked.explanation)
        self.asked = asked
        self.list = ChangeList(can_go=False)
        self.list.show_groups(asked.groups, can_revert=False)
        self.column.addWidget(self.list, 1)
        self.list.setVisible(bool(asked.groups))
        for icon, words in (("info", asked.note), ("warning", asked.problems)):
            if words:
                self.column.addWidget(_line(icon, words))
        self.version = _field("Version to save as", asked.version, 110)
        self.name = _field("Short name of the other study", "", 220)
        self.name.setPlaceholderText("small letters and digits")
        self.refusal = NameRefusal("Save as")
        self.refusal.chosen.connect(self._take_name)
        self.changes = ActionButton("", "Show in Changes", role="plain", height=40)
        self.another = ActionButton("copy", "Save as another study …", height=40)
        self.save = ActionButton("save", "", role="primary", height=40)
        self._of_version = label("Version", "label")
        self._of_name = label("Short name", "label")
        line = hbox(self._of_version, self.version, self._of_name, self.name, (self.refusal, 1), STRETCH, spacing=10)
        add_parts(self.buttons, self.changes, self.another, self.save)
        add_parts(self.column, line, self.buttons)
        self.another.setVisible(asked.another)
        self._naming = False
        self._show_name(naming=False)
        self.first: QWidget = self.save
        self.version.textEdited.connect(lambda _text: self._say())
        self.version.returnPressed.connect(self._save)
        self.name.returnPressed.connect(self._save)
        self.save.clicked.connect(self._save)
        self.another.clicked.connect(lambda: self._show_name(naming=True))
        self.changes.clicked.connect(self.changes_asked)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802 - Qt's name
        """Give the differences as much room as the window has."""
        super().showEvent(event)
        room = min(MOST, max(LEAST, self.window().height() - REST_PX))
        self.list.setMinimumHeight(min(self.list.sizeHint().height(), room))

    def refuse(self, sentence: str, free: str = "") -> None:
        """Say why it cannot be saved so, and offer a short name that is free."""
        self.refusal.show_refusal(sentence, free)

    def _take_name(self, name: str) -> None:
        self.name.setText(name)
        self._save()

    def _show_name(self, *, naming: bool) -> None:
        self._naming = naming
        for part in (self._of_version, self.version):
            part.setVisible(not naming)
        for part in (self._of_name, self.name):
            part.setVisible(naming)
        self.another.setVisible(self.asked.another and not naming)
        self._say()
        if naming:
            self.name.setFocus()

    def _say(self) -> None:
        self.refuse("")
        words = "Save the new study" if self._naming else f"Save {self.version.text().strip()}"
        self.save.show_action("save", words)

    def _save(self) -> None:
        if self._naming:
            self.another_asked.emit(self.name.text().strip())
        else:
            self.save_asked.emit(self.version.text().strip())


def _field(name: str, text: str, width: int) -> QLineEdit:
    made = QLineEdit(text)
    made.setFont(font("body"))
    made.setAccessibleName(name)
    made.setFixedWidth(width)
    return made


def _line(icon: str, words: str) -> QWidget:
    made = QWidget()
    parts = (Icon(icon, "warn" if icon == "warning" else "text2", 18), (label(words, "label", wraps=True), 1))
    hbox(*parts, spacing=8, margins=0, parent=made)
    return made
