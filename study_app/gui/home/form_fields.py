"""Fields of a form: a text field, a field with a button, and a labelled field in a grid."""

from PySide6.QtWidgets import QGridLayout, QLabel, QLineEdit, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox
from study_app.gui.widgets.labels import label


def text_field(name: str) -> QLineEdit:
    """Return an empty text field with an accessible name."""
    field = QLineEdit()
    field.setFont(font("body", tabular=True))
    field.setAccessibleName(name)
    return field


def field_with_button(field: QWidget, button: QWidget) -> QWidget:
    """Return a row with a field and a button."""
    both = QWidget()
    hbox((field, 1), button, spacing=8, margins=0, parent=both)
    return both


def add_field(
    grid: QGridLayout, row: int, place: int, name: str, field: QWidget, *, hint: str | QLabel = "", across: int = 1
) -> None:
    """Add a field below its label to column ``place``, with a hint on the right of the label."""
    named = label(name, "label", "text2")
    head = hbox(named, STRETCH, margins=(0, 6 if row else 0, 0, 0))
    if hint:
        head.addWidget(label(hint, "small", "text3") if isinstance(hint, str) else hint)
    named.setBuddy(field)
    add_layout(grid, head, row, place, 1, across)
    grid.addWidget(field, row + 1, place, 1, across)
