"""The questions that a new study begins with: title, short name, languages, and those of the template."""

from typing import Any, Final

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QLineEdit, QWidget

from study_app.designer.new_study.template_choices import Answers, OwnQuestion, TemplateChoice, languages_offered
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed, apply_theme_within, remove_widget
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.controls import Check
from study_app.gui.widgets.labels import label
from study_app.ids import short_name_of
from study_app.number_text import number_of, typed_numbers

FIELD_PX, WORDS_PX = 36, 112
NAME_HINT: Final = "small letters and digits"


class Questions(Themed, QWidget):
    """Fields for the answers; ``entered`` when Enter is pressed in one."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._choice: TemplateChoice | None = None
        self.title, self.name = self._field("Title"), self._field("Short name of the new study")
        self._propose()
        self.title.textChanged.connect(self._propose)
        self.languages: dict[str, Check] = {}
        self.own: dict[OwnQuestion, QLineEdit] = {}
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(8)
        self._grid.setColumnStretch(1, 1)
        for row, (words, field) in enumerate((("Title", self.title), ("Short name", self.name))):
            self._add(row, words, field)
        box = QWidget()
        checks = QGridLayout(box)
        checks.setContentsMargins(0, 0, 0, 0)
        checks.setSpacing(2)
        for at, (code, name) in enumerate(languages_offered()):
            made = Check(name)
            made.setFont(font("label", weight=400))
            made.setAccessibleName(f"Language {name}")
            made.toggled.connect(self._show_first_texts)
            self.languages[code] = made
            checks.addWidget(made, at // 2, at % 2)
        self.first_texts = label("", "label", "text2", wraps=True)
        checks.addWidget(self.first_texts, checks.rowCount(), 0, 1, 2)
        self._show_first_texts()
        self._grid.addWidget(label("Languages", "label"), 2, 0, 1, 2)
        self._grid.addWidget(box, 3, 0, 1, 2)
        self._own: list[QWidget] = []

    def _field(self, name: str) -> QLineEdit:
        made = QLineEdit()
        made.setFont(font("label", weight=400))
        made.setProperty("dense", "true")
        made.setFixedHeight(FIELD_PX)
        made.setAccessibleName(name)
        made.returnPressed.connect(self.entered)
        return made

    def _add(self, row: int, words: str, field: QWidget) -> QWidget:
        shown = label(words, "label", wraps=True)
        shown.setFixedWidth(WORDS_PX)
        self._grid.addWidget(shown, row, 0)
        self._grid.addWidget(field, row, 1)
        return shown

    def clear(self) -> None:
        """Forget the answers for the study before."""
        self._choice = None
        self.title.clear()
        self.name.clear()

    def show_choice(self, choice: TemplateChoice) -> None:
        """Ask the questions of a template or copy; what was typed as a name stays."""
        before, self._choice = self._choice, choice
        if before is not None and before.source == choice.source:
            return
        self.title.setPlaceholderText(choice.study_title)
        self._propose()
        for code, check in self.languages.items():
            check.setChecked(code in choice.languages)
        for part in self._own:
            remove_widget(part)
        self._own, self.own = [], {}
        for row, question in enumerate(choice.questions, start=4):
            field = self._field(question.words)
            field.setText(question.value)
            field.setToolTip(question.bounds)
            field.setAccessibleDescription(question.bounds)
            beside = QWidget()
            across = hbox((field, 1), spacing=8, margins=0, parent=beside)
            if question.unit:
                across.addWidget(label(question.unit, "label", "text2"))
            self._own += [self._add(row, question.words, beside), beside]
            self.own[question] = field
            apply_theme_within(beside, self.theme)

    def _propose(self) -> None:
        """Show the short name that counts where none is typed."""
        self.name.setPlaceholderText(self._proposed or NAME_HINT)

    def _show_first_texts(self) -> None:
        """Say in which language the texts begin where none of the template's is chosen."""
        there = () if self._choice is None else self._choice.languages
        chosen = [code for code, check in self.languages.items() if check.isChecked()]
        without = bool(there and chosen) and set(there).isdisjoint(chosen)
        if without:
            self.first_texts.setText(f"The texts begin in {dict(languages_offered())[there[0]]}: translate them.")
        self.first_texts.setVisible(without)

    @property
    def _proposed(self) -> str:
        return short_name_of(self.title.text()) or ("" if self._choice is None else self._choice.name)

    def short_name(self) -> str:
        """Return the short name that was typed, else the one that the title gives, else that of a copy."""
        return self.name.text().strip() or self._proposed

    def answers(self) -> Answers | str:
        """Return the answers, or a sentence about one that cannot be taken."""
        chosen = tuple(code for code, check in self.languages.items() if check.isChecked())
        if not chosen:
            return "choose at least one language"
        values: list[tuple[Any, Any]] = []
        for question, field in self.own.items():
            text = field.text().strip()
            if not text or text == question.value:
                continue
            if not question.several:
                number = number_of(text) if len(text.split()) == 1 else None
                if number is None:
                    return f"{question.words}: “{text}” is not a number"
                values.append((question.path, number))
                continue
            try:
                values.append((question.path, [number for _, number in typed_numbers(text)]))
            except ValueError as unclear:
                return f"{question.words}: {unclear}"
        return Answers(self.title.text().strip(), chosen, tuple(values))
