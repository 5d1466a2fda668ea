"""The languages of a study: how many texts each lacks, and languages to add."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout

from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.row_fields import Field
from study_app.gui.designer.form.typed_fields import FIELD_PX
from study_app.gui.theme.theme import font
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.viewmodels.designer.form.form_rows import FormRow
from study_app.viewmodels.designer.requests import ChangeLanguage


class LanguageListField(Field):
    """The languages, each with what it lacks; a language is added to every text, and taken away with its texts."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(6)
        codes = [str(code) for code in row.row.value] if isinstance(row.row.value, tuple) else []
        first = row.entries[0].title if row.entries else ""
        self.copies: dict[str, ActionButton] = {}
        for at, (code, entry) in enumerate(zip(codes, row.entries, strict=True)):
            shown = EntryRow(entry, f"{entry.title}, {entry.note}, {at + 1} of {len(codes)}")
            if entry.faults and at:
                made = ActionButton("", f"Copy {first}", height=FIELD_PX - 2)
                made.setProperty("dense", "true")
                made.setFont(font("label"))
                made.setAccessibleName(f"Copy {first} where {entry.title} has no text")
                made.clicked.connect(lambda _checked=False, code=code: self.asked.emit(ChangeLanguage("copy", code)))
                shown.row.addWidget(made)
                self.copies[code] = made
            if len(codes) > 1:
                away = shown.button("cross", f"Remove {entry.title} from every text")
                away.clicked.connect(lambda _checked=False, code=code: self.asked.emit(ChangeLanguage("remove", code)))
            else:
                shown.row.addSpacing(10)
            self.box.addWidget(shown)
        self.names = Choice()
        self.names.setProperty("dense", "true")
        self.names.setFont(font("label", weight=400))
        self.names.setFixedHeight(FIELD_PX)
        self.names.setAccessibleName("Add a language to every text")
        self.names.setPlaceholderText("Language …")
        for choice in row.row.choices:
            if choice.value not in codes:
                self.names.addItem(choice.sentence, choice.value)
        self.names.setCurrentIndex(-1)
        self.names.setEnabled(bool(self.names.count()))
        self.names.activated.connect(self._add)
        self.box.addWidget(self.names, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.names)

    def show_value(self) -> None:
        """Do nothing: other languages make another field."""

    def _add(self, at: int) -> None:
        self.names.setCurrentIndex(-1)
        self.asked.emit(ChangeLanguage("add", self.names.itemData(at)))
