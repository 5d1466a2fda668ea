"""The liquid lab: parameters on the left, tank and plots in the middle, cost and limiters on the right.

It shows a `LabView` and emits requests; it does not depend on device or servo.
"""

from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QHideEvent, QKeySequence, QResizeEvent, QShortcut, QShowEvent
from PySide6.QtWidgets import QFileDialog, QGridLayout

from study_app.gui.lab.cards import CostCard, ErrorCard, ForceCard, LimiterCard, SpeedCard
from study_app.gui.lab.lab_state import LabView
from study_app.gui.lab.lab_tank import LabTank, TankNote
from study_app.gui.lab.parameters import KEY, FormPanel, LabHeader
from study_app.gui.theme.theme import SHADOW, SPACE
from study_app.gui.widgets.boxes import add_layout, grid, vbox
from study_app.gui.widgets.cards import scrolled
from study_app.gui.widgets.main_view import EscapeKey, Place
from study_app.lab.ab_comparison import Setting
from study_app.workspace import workspace

FORM_WIDTH, FORM_WIDTH_NARROW, SIDE_WIDTH = 404, 388, 300
_PLOTS_STRETCH = 39
_LEAST = QSize(928, 560)
WIDE, ONE_ROW = 1240, 1460
_GAP = 14
_SUFFIX = ".toml"


class LabPlace(Place):
    """The lab as a page of the main window.

    ``asked(request, details)`` carries requests by name: changes of parameters in SI units (``held`` while a slider is
    dragged), positions of the mouse [m, hand frame], files with the felt `Setting`, and requests about device and
    force; "enter" and "leave" when the page is shown and hidden. ``put_back_asked`` carries the felt side and its
    `Setting` for the edited study.
    """

    asked = Signal(str, tuple)
    put_back_asked = Signal(str, object)

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "window")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName("Liquid lab")
        self.setMinimumSize(_LEAST)
        self._view: LabView | None = None
        self._wide: bool | None = None
        self.dialog: QFileDialog | None = None
        self.header = LabHeader()
        self.form = FormPanel()
        self.tank = LabTank()
        self.note = TankNote(self.tank)
        self.force, self.speed = ForceCard(), SpeedCard()
        self.cost, self.error, self.limiters = CostCard(), ErrorCard(), LimiterCard()
        self._escape = EscapeKey(self, anywhere=True)
        self._lay_out()
        self._connect()
        for sequence, request in ((KEY, "switch"), ("Ctrl+Z", "undo"), ("Ctrl+Shift+Z", "redo"), ("Ctrl+Y", "redo")):
            shortcut = QShortcut(QKeySequence(sequence), self, context=Qt.ShortcutContext.WidgetWithChildrenShortcut)
            shortcut.activated.connect(partial(self.ask, request))
        self._arrange(wide=True)

    def _lay_out(self) -> None:
        self._side = grid(_GAP, _GAP, margins=0)
        self._middle = grid(_GAP, _GAP, margins=0)
        self._middle.setColumnStretch(0, 1)
        self._middle.setColumnStretch(1, 1)
        framed = vbox(self.tank, margins=(SHADOW, SHADOW - 1, SHADOW, SHADOW))  # aligned with the neighbouring cards
        add_layout(self._middle, framed, 0, 0, 1, 2)
        self._middle.addWidget(self.force, 1, 0)
        self._middle.addWidget(self.speed, 1, 1)
        add_layout(self._middle, self._side, 2, 0, 1, 2)
        self._middle.setRowStretch(0, 61)
        self._middle.setRowStretch(1, _PLOTS_STRETCH)
        self.area = scrolled(self._middle)
        self._column = QGridLayout()
        self._side_area = scrolled(self._column)
        self._body = grid(_GAP, _GAP, margins=(SPACE[4] - 3, _GAP, SPACE[4] - 3, _GAP))
        self._body.addWidget(self.form, 0, 0)
        self._body.addWidget(self.area, 0, 1)
        self._body.addWidget(self._side_area, 0, 2)
        self._body.setColumnStretch(1, 1)
        vbox(self.header, (self._body, 1), spacing=0, margins=0, parent=self)

    def _arrange(self, *, wide: bool) -> None:
        """Place the right column next to the middle if ``wide``, otherwise below it."""
        if wide == self._wide:
            return
        self._wide = wide
        cards = (self.cost, self.error, self.limiters)
        self._column.setSpacing(_GAP)
        self._column.setContentsMargins(0, 0, 0, 0)
        for number, card in enumerate(cards):
            if wide:
                self._column.addWidget(card, number, 0)
                self._column.setRowStretch(number, int(card is self.limiters))
            else:
                row, column = divmod(number, 2)
                self._side.addWidget(card, row, column, 1, 2 if card is self.limiters else 1)
        self._side_area.setVisible(wide)
        self._side_area.setFixedWidth(SIDE_WIDTH)

    def _connect(self) -> None:
        header, form, tank = self.header, self.form, self.tank
        for part, request in (
            (header.blind_asked, "blind"),
            (header.device_chosen, "device"),
            (header.path_chosen, "path"),
            (form.changed, "change"),
            (form.liquid_chosen, "liquid"),
            (tank.moved, "point"),
            (tank.pressed, "press"),
        ):
            part.connect(partial(self.ask, request))
        for pressed, request in (
            (header.sides.switched, "switch"),
            (header.undo.clicked, "undo"),
            (header.redo.clicked, "redo"),
            (header.stop.pressed, "stop"),
            (form.copy.clicked, "copy"),
            (self.note.fade_in.clicked, "fade in"),
            (self.note.cancel.clicked, "cancel"),
            (self.note.diagnose.clicked, "diagnose"),
        ):
            pressed.connect(lambda *_checked, request=request: self.ask(request))
        for button, ask in (
            (header.save, self.ask_where_to_save),
            (form.open, self.ask_which_to_open),
            (form.back, self.ask_to_put_back),
        ):
            button.clicked.connect(ask)
        self._escape.held.connect(self._ask_to_stop)

    def ask(self, request: str, *details: Any) -> None:
        """Emit a request with its details."""
        self.asked.emit(request, details)

    @property
    def view(self) -> LabView | None:
        return self._view

    def show_view(self, view: LabView) -> None:
        self._view = view
        for part in (
            self.header, self.form, self.tank, self.note, self.force, self.speed, self.cost, self.error, self.limiters,
        ):  # fmt: skip
            part.show_view(view)

    def ask_where_to_save(self) -> None:
        """Ask for the file of a preset; the dialog is not modal, so that the force can be stopped."""
        if (setting := self._available_setting()) is not None:
            dialog = self._ask_for_file(f"Save preset: {setting.title}", "Presets", "save", setting, saves=True)
            dialog.setDefaultSuffix(_SUFFIX[1:])
            dialog.selectFile(f"{_preset_name(setting.title)}{_SUFFIX}")

    def ask_which_to_open(self) -> None:
        if self._available_setting() is not None:
            self._ask_for_file("Open preset", "Presets and protocols", "preset")

    def ask_to_put_back(self) -> None:
        if (setting := self._available_setting()) is not None and self._view is not None:
            self.put_back_asked.emit(self._view.felt, setting)

    def _available_setting(self) -> Setting | None:
        """Return the felt setting, or None while a dialog is open or the comparison is blind."""
        if self.dialog is not None or self._view is None or self._view.workbench.blind:
            return None
        return self._view.workbench.in_hand

    def _ask_for_file(self, title: str, files: str, request: str, *details: Any, saves: bool = False) -> QFileDialog:
        """Ask for a file in the workspace's protocols; emit the request when it is chosen."""
        dialog = self.dialog = QFileDialog(self, title, str(workspace().protocols), f"{files} (*{_SUFFIX})")
        if saves:
            dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        else:
            dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.fileSelected.connect(lambda name: self.ask(request, Path(name), *details))
        dialog.finished.connect(self._forget_dialog)
        dialog.show()
        return dialog

    def _forget_dialog(self) -> None:
        if self.dialog is not None:
            self.dialog.deleteLater()
        self.dialog = None

    def _ask_to_stop(self) -> None:
        """Stop the force after Esc was held in any window of the program."""
        if self.isVisible():
            self.ask("stop")

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange and not self.isActiveWindow():
            self.tank.release_pointer()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.setFocus()
        self.ask("enter")

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.ask("leave")
        if self.dialog is not None:
            self.dialog.reject()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Adapt to the width: in a narrow window the header has two rows, then the right column moves down."""
        super().resizeEvent(event)
        self.header.arrange(narrow=self.width() < ONE_ROW)
        self._arrange(wide=self.width() >= WIDE)
        self.form.setFixedWidth(FORM_WIDTH if self.width() >= ONE_ROW else FORM_WIDTH_NARROW)


def _preset_name(title: str) -> str:
    """Return a file name for the title of a preset: "water-edited" for "Water, edited"."""
    parts = "".join(letter if letter.isalnum() else " " for letter in title.lower()).split()
    return "-".join(parts) or "preset"
