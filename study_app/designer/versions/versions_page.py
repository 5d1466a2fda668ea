"""Versions in the designer: the tab Changes, the card that asks before saving, and cards about a new id."""

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QColor, QFontDatabase, QSyntaxHighlighter, QTextCharFormat
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QScrollArea, QWidget

from study_app.designer.place.prompts import Prompt
from study_app.designer.problems.card import NameRefusal
from study_app.designer.versions.version_rows import ChangesView, SavePrompt
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label

NOTHING = "There is no version to compare with: no session was run, and nothing was saved before."
LETTERS_PX = 12


class _Colours(QSyntaxHighlighter):
    """Lines that are gone, new, and the places where lines were left out."""

    theme: Theme | None = None

    def highlightBlock(self, text: str) -> None:
        if self.theme is None or text[:1] not in {"-", "+", "@"}:
            return
        made = QTextCharFormat()
        ink, ground = {
            "-": (self.theme.bad, self.theme.bad_bg),
            "+": (self.theme.ok, self.theme.ok_bg),
            "@": (self.theme.text2, self.theme.sunk),
        }[text[0]]
        made.setForeground(QColor(ink))
        made.setBackground(QColor(ground))
        self.setFormat(0, len(text), made)


class DifferenceText(Themed, QPlainTextEdit):
    """A difference of texts, to be read and copied: lines that are gone begin with "-", new ones with "+"."""

    def __init__(self) -> None:
        super().__init__()
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        fixed.setPixelSize(LETTERS_PX)
        self.setFont(fixed)
        self.setAccessibleName("Differences")
        self.setReadOnly(True)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setTabChangesFocus(True)
        self._colours = _Colours(self.document())

    def show_lines(self, lines: Sequence[str]) -> None:
        if (text := "\n".join(lines)) != self.toPlainText():
            scrolled = self.verticalScrollBar().value()
            self.setPlainText(text)
            self.verticalScrollBar().setValue(scrolled)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self._colours.theme = theme
        self._colours.rehighlight()


class ChangesCard(Card):
    """Draws a `ChangesView`; ``version_chosen`` carries a key."""

    version_chosen = Signal(str)
    restore_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=14, gap=8)
        self.setAccessibleName("Changes")
        self.view = ChangesView()
        self.version = Choice()
        self.version.setFont(font("label"))
        self.version.setAccessibleName("Version to compare with")
        self.version.setMinimumWidth(120)
        self.restore = ActionButton("undo", "Restore", height=34)
        self.restore.setProperty("dense", "true")
        self.restore.setToolTip("Give the study the text of this version, as one step")
        self.note = label("", "label", "text2", wraps=True)
        self.difference = DifferenceText()
        self.top = QWidget()
        of = label("Compare with", "label")
        hbox(of, (self.version, 1), self.restore, spacing=10, margins=0, parent=self.top)
        self.nothing = label(NOTHING, "body", "text2", wraps=True)
        add_parts(self.column, self.top, self.nothing, self.note, (self.difference, 1))
        self.setFocusProxy(self.version)
        self.version.activated.connect(lambda at: self.version_chosen.emit(str(self.version.itemData(at))))
        self.restore.clicked.connect(self.restore_asked)
        self.show_view(self.view)

    def show_view(self, view: ChangesView) -> None:
        before, self.view = self.view, view
        if view.versions != before.versions or view.chosen != before.chosen:
            with QSignalBlocker(self.version):
                self.version.clear()
                for one in view.versions:
                    self.version.addItem(one.words, one.key)
                self.version.setCurrentIndex(self.version.findData(view.chosen) if view.chosen else -1)
        self.top.setVisible(bool(view.versions))
        self.difference.setVisible(bool(view.difference.lines))
        self.nothing.setVisible(not view.versions)
        self.note.setText(view.difference.note)
        self.note.setVisible(bool(view.difference.note))
        self.restore.setEnabled(view.can_restore)
        self.difference.show_lines(view.difference.lines)


class SaveCard(Prompt):
    """Signals: ``save_asked`` (version), ``another_asked`` (name), ``changes_asked``."""

    save_asked = Signal(str)
    another_asked = Signal(str)
    changes_asked = Signal()

    def __init__(self, asked: SavePrompt) -> None:
        super().__init__("Save another version", asked.explanation)
        self.asked = asked
        self.difference = DifferenceText()
        self.difference.show_lines(asked.difference.lines)
        self.column.addWidget(self.difference, 1)
        self.difference.setVisible(bool(asked.difference.lines))
        for icon, words in (("info", asked.difference.note), ("warning", asked.problems)):
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
        self._naming = False
        self._show_name(naming=False)
        self.first: QWidget = self.save
        self.version.textEdited.connect(lambda _text: self._say())
        self.version.returnPressed.connect(self._save)
        self.name.returnPressed.connect(self._save)
        self.save.clicked.connect(self._save)
        self.another.clicked.connect(lambda: self._show_name(naming=True))
        self.changes.clicked.connect(self.changes_asked)

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
        self.another.setVisible(not naming)
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


class UnlockCard(Prompt):
    """What another id of a question breaks; ``answered`` comes where it is to be changed all the same."""

    def __init__(self, name: str, why: str, breaks: Sequence[str]) -> None:
        super().__init__(f"Change the id “{name}”?", f"{why} With another id:")
        for words in breaks:
            self.column.addWidget(label(f"•  {words}", "label", wraps=True))
        self.go_on = ActionButton("", "Change the id", role="danger", height=40)
        self.go_on.clicked.connect(lambda: self.answered.emit(name))
        self.buttons.addWidget(self.go_on)
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


class CommentsCard(Prompt):
    """Comments that mention a name that is no longer there; ``line_asked`` carries a line, from 1."""

    line_asked = Signal(int)

    def __init__(self, name: str, comments: Sequence[tuple[int, str]]) -> None:
        super().__init__(
            title_of(name, comments), "Renaming does not change comments. Correct them in the file where needed."
        )
        inside = QWidget()
        column = vbox(spacing=2, margins=0, parent=inside)
        self.lines: list[ActionButton] = []
        for line, text in comments:
            made = ActionButton("", f"Line {line}:  {_cut(text)}", role="plain", height=34)
            made.setProperty("dense", "true")
            made.setAccessibleName(f"Go to line {line}: {text}")
            made.setToolTip(text)
            made.clicked.connect(lambda _checked=False, line=line: self.line_asked.emit(line))
            column.addWidget(made, 0, Qt.AlignmentFlag.AlignLeft)
            self.lines.append(made)
        column.addStretch()
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setMinimumHeight(min(160, 38 * len(comments) + 6))
        self.column.addWidget(area, 1)
        self.cancel.setText("Close")
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


def title_of(name: str, comments: Sequence[tuple[int, str]]) -> str:
    """Return how many comments mention a name."""
    count = "1 comment mentions" if len(comments) == 1 else f"{len(comments)} comments mention"
    return f"{count} “{name}”"


def _cut(text: str) -> str:
    return text if len(text) <= 90 else f"{text[:89].rstrip()}…"
