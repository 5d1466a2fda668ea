"""A text in each language of the study, side by side or below each other."""

from functools import cached_property

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLabel, QVBoxLayout

from study_app.designer.form.form_rows import FormRow, is_right_to_left
from study_app.designer.form.row_fields import Field
from study_app.designer.form.typed_fields import TypedLine, TypedText
from study_app.designer.place.requests import LeaveText, SetText
from study_app.gui.widgets.boxes import add_layout
from study_app.gui.widgets.labels import label


class LanguagesField(Field):
    """A text in each language, side by side, or below each other where there are more than two or several lines."""

    one: type[TypedLine | TypedText] = TypedLine
    """What a text of one paragraph is typed into."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        several, down = row.row.kind == "paragraphs", stacked(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(4)
        self.outer = self.box
        self.box = QVBoxLayout() if down else QHBoxLayout()
        self.box.setSpacing(8)
        add_layout(self.outer, self.box)
        self.lines: dict[str, TypedLine | TypedText] = {}
        for code, language in row.languages:
            name = row.row.label if len(row.languages) == 1 else f"{row.row.label}, {language}"
            made = (TypedText if several else self.one)(name)
            if len(row.languages) > 1:
                made.setPlaceholderText(f"Missing in {language}")
                made.setToolTip(language)
            if is_right_to_left(code):
                made.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
            made.typed.connect(lambda text, code=code: self.asked.emit(SetText(self.row.row.path, code, text)))
            made.left.connect(lambda: self.asked.emit(LeaveText(self.row.row.path)))
            made.came.connect(self.came)
            self.lines[code] = made
            if down and len(row.languages) > 1:
                self.box.addWidget(label(language, "small", "text2"))
            self.box.addWidget(made)
        if len(self.lines) > 1:
            for line in self.lines.values():
                line.beside = tuple(self.lines.values())
        self.setFocusProxy(next(iter(self.lines.values())))
        self.show_value()

    @cached_property
    def copied(self) -> QLabel:
        """Which texts are those of the first language; made when it is first needed."""
        made = label("", "small", "warn")
        made.hide()
        self.outer.addWidget(made)
        return made

    @property
    def some_missing(self) -> bool:
        """Whether a language has a text and another one has none."""
        written = [bool(line.words().strip()) for line in self.lines.values()]
        return any(written) and not all(written)

    def show_value(self) -> None:
        """Show each text; a plain one stands for the first language. A text that is that of the first one is marked."""
        value = self.row.row.value
        named, copies = self.row.languages[0][1], self.row.copied
        if copies or "copied" in self.__dict__:
            self.copied.setText(f"As in {named}, not translated yet: {', '.join(copies)}")
            self.copied.setVisible(bool(copies))
        for number, (code, line) in enumerate(self.lines.items()):
            text = value.get(code, "") if isinstance(value, dict) else value if number == 0 else ""
            line.show_text(text if isinstance(text, str) else "")

    def take_keyboard(self) -> None:
        """Give the keyboard to the first empty text."""
        first = next((line for line in self.lines.values() if not line.words()), self)
        first.setFocus(Qt.FocusReason.OtherFocusReason)


def stacked(row: FormRow) -> bool:
    """Return whether texts in several languages are below each other, each with its language."""
    return len(row.languages) > 2 or row.row.kind == "paragraphs"
