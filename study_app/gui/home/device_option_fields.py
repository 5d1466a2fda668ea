"""The fields for a device's options, such as the file of its firmware."""

from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFileDialog, QGridLayout, QLineEdit, QWidget

from study_app.devices.descriptor import DeviceOption
from study_app.devices.registry import descriptor_of
from study_app.gui.home.form_fields import add_field, field_with_button, text_field
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.viewmodels.devices.list_view import window_options


class DeviceOptionFields(QWidget):
    """One field for each option of the chosen device; ``changed`` comes when one is edited.

    Parameters
    ----------
    values
        What the fields begin with, by the option's name.
    """

    changed = Signal()

    def __init__(self, values: Mapping[str, str | Path]) -> None:
        super().__init__()
        self.fields: dict[str, QLineEdit] = {}
        self._rows: dict[str, QWidget] = {}
        self._asked: tuple[DeviceOption, ...] = ()
        column = vbox(margins=0, parent=self)
        for option in window_options():
            field = text_field(option.title)
            field.setText(str(values.get(option.name, "")))
            field.setPlaceholderText(option.placeholder)
            field.textChanged.connect(self.changed)
            self.fields[option.name] = field
            self._rows[option.name] = self._row(option, field)
            column.addWidget(self._rows[option.name])

    def _row(self, option: DeviceOption, field: QLineEdit) -> QWidget:
        row = QWidget()
        inside = QGridLayout(row)
        inside.setContentsMargins(0, 0, 0, 0)
        inside.setVerticalSpacing(6)
        shown: QWidget = field
        if option.file_filter:
            find = ActionButton("", "Choose …", height=40)
            find.setAutoDefault(False)
            find.clicked.connect(lambda: self._choose(option))
            shown = field_with_button(field, find)
        add_field(inside, 1, 0, option.title, shown, hint=option.hint)
        return row

    def show_device(self, device: str) -> None:
        self._asked = descriptor_of(device).window_options
        names = {option.name for option in self._asked}
        for name, row in self._rows.items():
            row.setVisible(name in names)
        self.setVisible(bool(names))

    def values(self) -> dict[str, str | Path]:
        """Return what was filled in for the device, by the option's name."""
        texts = {option: self.fields[option.name].text().strip() for option in self._asked}
        return {option.name: Path(text) if option.file_filter else text for option, text in texts.items() if text}

    def fault(self) -> str:
        """Return which file is missing, "" where none is."""
        for option in self._asked:
            path = self.values().get(option.name)
            if isinstance(path, Path) and not path.is_file():
                return f"there is no {option.name} in {path}: choose the file, or leave the field empty"
        return ""

    def _choose(self, option: DeviceOption) -> None:
        field = self.fields[option.name]
        chosen, _ = QFileDialog.getOpenFileName(self, option.title, field.text(), option.file_filter)
        if chosen:
            field.setText(chosen)
