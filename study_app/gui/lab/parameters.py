"""The header of the lab, and the form with a liquid's parameters."""

from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPaintEvent, QPixmap
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QStackedLayout, QWidget

from study_app.gui.lab.lab_state import SIDES, Choices, LabView
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed, give_ground, replace_inside
from study_app.gui.widgets.accessible import button_text, plain_tip
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Card, Icon, MaskedPanel, Rule, scrolled, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Cap, Choice, CompactStop, IconButton, Toggle
from study_app.gui.widgets.labels import Clamped, label, set_property
from study_app.gui.widgets.numbers import NumberField, Range, Slider, read_number, write_number
from study_app.haptics.model.effects import Parameter, Value
from study_app.lab.ab_comparison import Setting, Side, other_side
from study_app.lab.parameters import OFF, ON, Section, sections
from study_app.number_text import readings_of, unclear_number

_SWITCH_HEIGHT = 44
_WIDEST = 190
_BADGE = 20
KEY = "X"


def _side_colour(theme: Theme, side: Side) -> str:
    """Return the colour of a side in the switch, the plots and the tank's texts."""
    return theme.trace_x if side == "A" else theme.trace_y


def _draw_badge(painter: QPainter, middle: QPointF, theme: Theme, side: Side, letter: str) -> None:
    """Paint a letter on a disc in the colour of a side."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(_side_colour(theme, side)))
    painter.drawEllipse(middle, _BADGE / 2, _BADGE / 2)
    painter.setPen(QColor(theme.on_accent))
    painter.setFont(font("key"))
    half = _BADGE / 2
    painter.drawText(QRectF(middle.x() - half, middle.y() - half, _BADGE, _BADGE), Qt.AlignmentFlag.AlignCenter, letter)


class _Badge(Themed, QWidget):
    """A badge with the letter of a side."""

    def __init__(self) -> None:
        super().__init__()
        self._side: Side = "A"
        self.setFixedSize(_BADGE + 2, _BADGE + 2)

    def show_side(self, side: Side) -> None:
        if side != self._side:
            self._side = side
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        _draw_badge(painter, QRectF(self.rect()).center(), self.theme, self._side, self._side)


class _Segment(Themed, QPushButton):
    """The button of a side, with its letter and name; that of the felt side is checked."""

    def __init__(self) -> None:
        super().__init__()
        self._shown: tuple[object, ...] = ()
        self.setCheckable(True)
        self.setIconSize(QSize(_BADGE + 6, _BADGE))  # with the gap to the name
        self.setProperty("role", "segment")
        self.setFont(font("strong", scale=0.94))
        self.setFixedHeight(_SWITCH_HEIGHT - 8)
        self.setMinimumWidth(110)
        self.setMaximumWidth(_WIDEST)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def show_name(self, name: str, letter: str) -> None:
        if (shown := (name, letter, self.theme)) == self._shown:
            return
        self._shown = shown
        text = self.fontMetrics().elidedText(name, Qt.TextElideMode.ElideRight, _WIDEST - _BADGE - 30)
        self.setText(button_text(text))
        self.setToolTip(plain_tip(name))
        picture = QPixmap((QSizeF(self.iconSize()) * self.devicePixelRatioF()).toSize())
        picture.setDevicePixelRatio(self.devicePixelRatioF())
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        _draw_badge(painter, QPointF(_BADGE / 2, _BADGE / 2), self.theme, "A" if letter in {"A", "1"} else "B", letter)
        painter.end()
        self.setIcon(QIcon(picture))

    def nextCheckState(self) -> None:
        """Do nothing, because the view decides which side is felt."""


class _SideSwitch(QWidget):
    """A switch between the sides; ``switched`` is emitted when the other side should be felt."""

    switched = Signal()

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "segments")
        self.setFixedHeight(_SWITCH_HEIGHT)
        self.segments = {side: _Segment() for side in SIDES}
        for segment in self.segments.values():
            segment.clicked.connect(lambda _on, segment=segment: None if segment.isChecked() else self.switched.emit())
        hbox(*self.segments.values(), 4, Cap(KEY), spacing=2, margins=(4, 4, 8, 4), parent=self)
        self.setToolTip("Feel the other setting (X)")

    def show_view(self, view: LabView) -> None:
        bench = view.workbench
        order: tuple[Side, ...] = SIDES if not bench.blind or bench.first == "A" else SIDES[::-1]
        for number, (place, side) in enumerate(zip(SIDES, order, strict=True), 1):
            segment = self.segments[place]
            segment.show_name(bench.shown_name(side), str(number) if bench.blind else side)
            segment.setChecked(side == bench.presented)
            felt = ", felt now" if side == bench.presented else ""
            segment.setAccessibleName(f"{'' if bench.blind else side + ': '}{bench.shown_name(side)}{felt}")


_BUTTON = 44
_FREE = "Free motion"
_LETTERS = 13  # width of a list, in letters, beyond which choices are elided


class _Picker(Choice):
    """A drop-down list with an icon before its label."""

    def __init__(self, icon: str, name: str) -> None:
        super().__init__()
        self._icon = icon
        self._choices: Choices = ()
        self.setFont(font("label"))
        self.setAccessibleName(name)
        self.setFixedHeight(_BUTTON)
        self.setStyleSheet("QComboBox { padding-left: 40px; }")
        self.setMinimumContentsLength(_LETTERS)
        self.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)

    def show_choices(self, choices: Choices, chosen: str) -> None:
        if choices != self._choices:
            self._choices = choices
            self.clear()
            for value, text in choices:
                self.addItem(text, value)
        self.setCurrentIndex(self.findData(chosen))

    def set_whole(self, whole: bool) -> None:
        """Make the list as wide as its longest label if ``whole``; otherwise elide long labels."""
        policy = self.SizeAdjustPolicy
        self.setSizeAdjustPolicy(policy.AdjustToContents if whole else policy.AdjustToMinimumContentsLengthWithIcon)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        draw_icon(QPainter(self), self._icon, QRectF(13, self.height() / 2 - 10, 20, 20), self.theme.text2, 1.9)


class LabHeader(QWidget):
    """The header of the lab: one row in a wide window, two in a narrow one."""

    blind_asked = Signal(bool)
    device_chosen = Signal(str)
    path_chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "header")
        self.title = label("Liquid lab", "title_dense")
        self.sides = _SideSwitch()
        self.blind = Toggle("Blind A/B")
        self.blind.setFont(font("label"))
        self.blind.setToolTip("Hide which setting is which")
        self.device = _Picker("mouse", "Device")
        self.path = _Picker("route", "Motion")
        self.undo = IconButton("undo", "Undo", "Undo (Ctrl+Z)")
        self.redo = IconButton("redo", "Redo", "Redo (Ctrl+Shift+Z)")
        self.stop = CompactStop()
        self.save = ActionButton("save", "Save preset…", role="primary", height=_BUTTON)
        self.save.setFixedHeight(_BUTTON)
        self._narrow: bool | None = None
        self._lay_out()
        self.arrange(narrow=False)
        self._connect()

    def _lay_out(self) -> None:
        self._grid = grid(16, 8, margins=(24, 12, 24, 13), parent=self)
        self._left, self._middle, self._right = (hbox(spacing=10, margins=0) for _ in range(3))
        parts: dict[QHBoxLayout, tuple[QWidget, ...]] = {
            self._left: (self.title, self.sides),
            self._middle: (self.blind, self.device, self.path),
            self._right: (self.undo, self.redo, self.stop, self.save),
        }
        for row, widgets in parts.items():
            add_parts(row, *widgets)
        self._left.setSpacing(16)
        self._grid.setColumnStretch(2, 1)

    def arrange(self, *, narrow: bool) -> None:
        """Use one row, or two if ``narrow``; the force stop stays at the right end of the first row."""
        if narrow == self._narrow:
            return
        self._narrow = narrow
        for picker in (self.device, self.path):
            picker.set_whole(narrow)
        for row in (self._left, self._middle, self._right):
            self._grid.removeItem(row)
        if narrow:
            add_layout(self._grid, self._left, 0, 0)
            add_layout(self._grid, self._right, 0, 3)
            add_layout(self._grid, self._middle, 1, 0, 1, 4, Qt.AlignmentFlag.AlignLeft)
        else:
            add_layout(self._grid, self._left, 0, 0)
            add_layout(self._grid, self._middle, 0, 1)
            add_layout(self._grid, self._right, 0, 3)

    def _connect(self) -> None:
        self.blind.clicked.connect(self._ask_blind)
        self.device.activated.connect(lambda index: self.device_chosen.emit(self.device.itemData(index)))
        self.path.activated.connect(lambda index: self.path_chosen.emit(self.path.itemData(index) or None))

    def show_view(self, view: LabView) -> None:
        self.sides.show_view(view)
        self.blind.setChecked(view.workbench.blind)
        self.device.show_choices(view.device.choices, view.device.chosen)
        self.device.setAccessibleDescription(view.device.state)
        self.path.show_choices((("", _FREE), *view.paths), view.path or "")
        self.undo.setEnabled(view.workbench.may_undo)
        self.redo.setEnabled(view.workbench.may_redo)
        self.save.setEnabled(not view.workbench.blind)

    def _ask_blind(self, on: bool) -> None:
        self.blind.setChecked(not on)  # until the view changes
        self.blind_asked.emit(on)


LABEL_WIDTH, FIELD_WIDTH, UNIT_WIDTH = 108, 86, 44
_GAP = 8
HEIGHT = 36
_SWITCHED = {OFF, ON}


@dataclass(frozen=True, slots=True)
class _FormRow:
    """A parameter with its current value and its value when the liquid was chosen."""

    parameter: Parameter
    value: Value
    preset: Value

    @property
    def changed(self) -> bool:
        return self.value != self.preset


class _ParameterRow(QWidget):
    """The base class of rows; ``changed(name, value, held)`` requests a value, and a line below shows rejections."""

    changed = Signal(str, object, bool)

    def __init__(self, parameter: Parameter) -> None:
        super().__init__()
        self.parameter = parameter
        self._refused = ""
        self.line = hbox(spacing=_GAP, margins=0)
        self.sign = Icon("warning", "bad", 14)
        self.why = label("", "small", "bad", wraps=True)
        self._below = QWidget()
        hbox(
            (self.sign, 0, Qt.AlignmentFlag.AlignTop),
            (self.why, 1),
            spacing=6,
            margins=(0, 0, 0, 4),
            parent=self._below,
        )
        self._below.hide()
        vbox(self.line, self._below, spacing=0, margins=0, parent=self)

    @property
    def refused(self) -> str:
        return self._refused

    def show_row(self, row: _FormRow) -> None:
        raise NotImplementedError

    def show_refused(self, why: str) -> None:
        """Show why a value is rejected, or nothing; the typed text is kept."""
        self._refused = why
        self.why.setText(why)
        self._below.setVisible(bool(why))

    def discard_input(self) -> None:
        """Discard the user's input, because the row now shows another setting."""
        self.show_refused("")

    def parts(self) -> tuple[QWidget, ...]:
        raise NotImplementedError


class _NumberRow(_ParameterRow):
    """A row with slider, field and unit for a number; a tick on the slider marks the preset's value."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self._row: _FormRow | None = None
        self.name = _name_label(parameter.label)
        self.slider = Slider()
        self.field = NumberField()
        self.field.setFixedWidth(FIELD_WIDTH)
        unit = label(parameter.shown_unit, "small", "text2")
        unit.setFixedWidth(UNIT_WIDTH)
        add_parts(self.line, self.name, (self.slider, 1), self.field, unit)
        name = f"{parameter.label}, {parameter.shown_unit}".rstrip(", ")
        self.slider.setAccessibleName(name)
        self.field.setAccessibleName(name)
        self.slider.slid.connect(self._apply_slide)
        self.field.entered.connect(self._apply_number)
        self.field.unread.connect(self._show_misread)
        self.field.abandoned.connect(self._restore_number)
        self.field.stepped.connect(self.slider.step)

    def show_row(self, row: _FormRow) -> None:
        """Show the number, unless it is being dragged or typed; changed numbers are bold."""
        if self._row is not None and row.value != self._row.value:
            self.show_refused("")
        self._row = row
        p = self.parameter = row.parameter
        span = Range(p.least * p.factor, p.most * p.factor, p.logarithmic, p.whole)
        number = row.value if isinstance(row.value, int | float) else None
        preset = row.preset if isinstance(row.preset, int | float) else None
        if not self.slider.dragged:
            default = p.default if isinstance(p.default, int | float) else p.least
            position = (default if number is None else number) * p.factor
            self.slider.show_number(span, position, None if preset is None else preset * p.factor)
        if not self.refused:
            self.field.show_text("" if number is None else self._text(number))
            self.field.show_state("changed" if row.changed else "")
        self.field.setPlaceholderText("none" if number is None else "")
        self.name.setFont(font("label", weight=600 if row.changed else None))
        initial = "none" if preset is None else p.shown(preset)
        self.setToolTip(f"{p.shown(p.least)} to {p.shown(p.most)}; initially {initial}")
        self.field.setAccessibleDescription(f"initially {initial}" if row.changed else "")

    def show_refused(self, why: str) -> None:
        super().show_refused(why)
        changed = "changed" if self._row is not None and self._row.changed else ""
        self.field.show_state("refused" if why else changed)
        if why:
            self.field.setAccessibleDescription(why)

    def discard_input(self) -> None:
        super().discard_input()
        self.slider.release_knob()
        self.field.restore_text()

    def parts(self) -> tuple[QWidget, ...]:
        return self.slider, self.field

    def _text(self, value: float) -> str:
        return write_number(value * self.parameter.factor, self.parameter.decimals)

    def _apply_slide(self, number: float, held: bool) -> None:
        self.show_refused("")
        self.field.show_text(write_number(number, self.parameter.decimals))
        self.field.restore_text()
        self.changed.emit(self.parameter.name, self._value(number), held)

    def _apply_number(self, number: float) -> None:
        self.show_refused("")
        self.changed.emit(self.parameter.name, self._value(number), False)

    def _value(self, number: float) -> float:
        """Return a displayed number in SI units, or the exact preset or current value if that is displayed alike."""
        row = self._row
        for exact in (row.preset, row.value) if row is not None else ():
            if isinstance(exact, int | float) and read_number(self._text(exact)) == number:
                return float(exact)
        return number / self.parameter.factor

    def _show_misread(self, text: str) -> None:
        preset = self._row.preset if self._row is not None else None
        example = self._text(preset) if isinstance(preset, int | float) else "1.5"
        if len(readings_of(text)) == 2:
            self.show_refused(f"{unclear_number(text)}, or press Esc.")
            return
        problem = f"“{text}” is not a number" if text.strip() else "This field needs a number"
        self.show_refused(f"{problem}: enter a value such as {example}, or press Esc.")

    def _restore_number(self) -> None:
        self.show_refused("")
        if self._row is not None:
            self.show_row(self._row)
            self.field.restore_text()


class _ChoiceRow(_ParameterRow):
    """A row with a choice between a few values."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self._value: Value = None
        self.name = _name_label(parameter.label)
        self.choice = Choice()
        self.choice.setProperty("dense", "true")
        self.choice.setFont(font("label"))
        self.choice.setAccessibleName(parameter.label)
        for value, text in parameter.choices:
            self.choice.addItem(text, value)
        self.choice.activated.connect(self._ask_for_choice)
        add_parts(self.line, self.name, (self.choice, 1))

    def show_row(self, row: _FormRow) -> None:
        if row.value != self._value:
            self.show_refused("")
        self._value = row.value
        self.choice.setCurrentIndex(self.choice.findData(row.value))
        set_property(self.choice, "state", "changed" if row.changed else "")
        for part in (self.name, self.choice):
            part.setFont(font("label", weight=600 if row.changed else None))

    def parts(self) -> tuple[QWidget, ...]:
        return (self.choice,)

    def _ask_for_choice(self, index: int) -> None:
        """Request another value; it is shown once it applies."""
        self.show_refused("")
        self.choice.setCurrentIndex(self.choice.findData(self._value))
        self.changed.emit(self.parameter.name, self.choice.itemData(index), False)


class _SwitchRow(_ParameterRow):
    """A row with a switch."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self.toggle = Toggle(parameter.label)
        self.toggle.setFont(font("label"))
        self.toggle.clicked.connect(self._ask_to_switch)
        add_parts(self.line, self.toggle, STRETCH)

    def show_row(self, row: _FormRow) -> None:
        if (row.value == ON) != self.toggle.isChecked():
            self.show_refused("")
        self.toggle.setChecked(row.value == ON)
        self.toggle.setFont(font("label", weight=600 if row.changed else None))

    def parts(self) -> tuple[QWidget, ...]:
        return (self.toggle,)

    def _ask_to_switch(self, on: bool) -> None:
        """Request the other state; it is shown once it applies."""
        self.show_refused("")
        self.toggle.setChecked(not on)
        self.changed.emit(self.parameter.name, ON if on else OFF, False)


def _row_for(parameter: Parameter) -> _ParameterRow:
    """Return the row that edits a parameter."""
    if not parameter.choices:
        return _NumberRow(parameter)
    return (_SwitchRow if {value for value, _ in parameter.choices} == _SWITCHED else _ChoiceRow)(parameter)


def _name_label(text: str) -> QLabel:
    name = label(text, "label", "text")
    name.setFixedWidth(LABEL_WIDTH)
    name.setMinimumHeight(HEIGHT)
    name.setWordWrap(True)
    return name


HIDDEN = "Hidden during a blind comparison"


class _SectionBlock(QWidget):
    """A section of the form: a heading, the number of changed rows, and the rows; two switches share a line."""

    def __init__(self, section: Section) -> None:
        super().__init__()
        self.rows = {parameter.name: _row_for(parameter) for parameter in section.parameters}
        self.count = label("", "small", "text2")
        head = hbox(label(section.title, "strong", heading=True), STRETCH, self.count)
        cells = grid(8, 2, margins=0)
        vbox(head, cells, spacing=4, margins=(0, 8, 0, 8), parent=self)
        line, column = 0, 0
        for row in self.rows.values():
            if isinstance(row, _SwitchRow):
                cells.addWidget(row, line, column)
                line, column = (line + 1, 0) if column else (line, 1)
                continue
            line, column = (line + 1, 0) if column else (line, 0)
            cells.addWidget(row, line, 0, 1, 2)
            line += 1

    def show_section(self, section: Section, setting: Setting) -> None:
        rows = [_FormRow(p, setting.value(p.name), setting.chosen_value(p.name)) for p in section.parameters]
        for row in rows:
            self.rows[row.parameter.name].show_row(row)
        changed = sum(row.changed for row in rows)
        self.count.setText(f"{changed} of {len(rows)} changed" if changed else "")


class FormPanel(Card):
    """The card with liquid and parameters of the felt side, whose content is hidden during a blind comparison."""

    changed = Signal(str, object, bool)
    liquid_chosen = Signal(str, object)

    def __init__(self) -> None:
        super().__init__(padding=16, gap=8)
        self._setting: Setting | None = None
        self._liquids: tuple[object, ...] = ()
        self._side = "A"
        self._refused: tuple[str, str] | None = None
        self.blocks: dict[str, _SectionBlock] = {}
        self.rows: dict[str, _ParameterRow] = {}
        self.badge = _Badge()
        self.liquid = Choice()
        self.liquid.setProperty("dense", "true")
        self.liquid.setFont(font("label"))
        self.liquid.activated.connect(self._choose_liquid)
        self.copy = ActionButton("copy", "Copy to B", height=32)
        self.copy.setProperty("dense", "true")
        self.open = ActionButton("file", "Open preset…", height=32)
        self.back = ActionButton("designer", "Put back into the study", height=32)
        self.back.hide()
        self.said = Clamped("", 2, "small", "text2")
        for button in (self.open, self.back):
            button.setProperty("dense", "true")
        self._lay_out()

    def _lay_out(self) -> None:
        head = hbox(self.badge, (self.liquid, 1), self.copy, spacing=8)
        self.area = scrolled(QWidget())
        form = QWidget()
        column = vbox(head, Rule(), (self.area, 1), spacing=8, margins=0, parent=form)
        column.addWidget(Rule())
        column.addWidget(self.said)  # above the buttons, so that they do not move when it appears
        add_parts(column, self.back, self.open)
        self.hidden = MaskedPanel(HIDDEN, "The parameters would reveal the settings.")
        self._stack = QStackedLayout()
        self._stack.addWidget(form)
        self._stack.addWidget(self.hidden)
        add_layout(self.column, self._stack, 1)

    def show_view(self, view: LabView) -> None:
        bench = view.workbench
        self._stack.setCurrentIndex(int(bench.blind))
        if bench.blind:
            return
        self._show_liquids(view)
        self.said.show_text(view.said)
        self.said.setVisible(bool(view.said))
        self.back.setVisible(bool(view.study))
        self.back.setToolTip(plain_tip(f"Copy these parameters to {view.study}, which is open in the study designer"))
        setting = bench.in_hand
        if setting != self._setting or bench.presented != self._side:
            has_switched = self._side != bench.presented
            self._setting, self._side = setting, bench.presented
            self._show_form(setting, discard_input=has_switched)
        if view.refused is not self._refused:
            self._refused = view.refused
            name, why = view.refused or ("", "")
            if name in self.rows:
                self.rows[name].show_refused(why)

    def _show_liquids(self, view: LabView) -> None:
        bench = view.workbench
        if view.liquids != self._liquids:
            self._liquids = view.liquids
            self.liquid.clear()
            for liquid in view.liquids:
                self.liquid.addItem(liquid.title)
        self.badge.show_side(bench.presented)
        self.liquid.setAccessibleName(f"Liquid of {bench.presented}")
        index = self.liquid.findText(bench.in_hand.name)
        self.liquid.setCurrentIndex(index)
        self.liquid.setPlaceholderText(bench.in_hand.name)
        text = f"Copy to {other_side(bench.presented)}"
        self.copy.show_action("copy", text)

    def _show_form(self, setting: Setting, *, discard_input: bool) -> None:
        parts = sections(setting.scene)
        shape = [(section.title, tuple(parameter.name for parameter in section.parameters)) for section in parts]
        if shape != [(title, tuple(block.rows)) for title, block in self.blocks.items()]:
            self._make_rows(parts)
        elif discard_input:
            for row in self.rows.values():
                row.discard_input()
        for section in parts:
            self.blocks[section.title].show_section(section, setting)

    def _make_rows(self, form_sections: tuple[Section, ...]) -> None:
        """Create new rows, but keep focus and scroll position."""
        rows = self.rows.items()
        focused = [(name, index) for name, row in rows for index, part in enumerate(row.parts()) if part.hasFocus()]
        scrolled_px = self.area.verticalScrollBar().value()
        self.blocks = {section.title: _SectionBlock(section) for section in form_sections}
        self.rows = {name: row for block in self.blocks.values() for name, row in block.rows.items()}
        for row in self.rows.values():
            row.changed.connect(self.changed)
        inside, first = QWidget(), next(iter(self.blocks.values()), None)
        parts = [
            part for block in self.blocks.values() for part in ((Rule(), block) if block is not first else (block,))
        ]
        vbox(*parts, STRETCH, spacing=0, margins=(0, 0, 6, 0), parent=inside)
        replace_inside(self.area, inside)
        previous: QWidget = self.copy
        for part in (part for row in self.rows.values() for part in row.parts()):
            QWidget.setTabOrder(previous, part)
            previous = part
        QTimer.singleShot(0, self.area, lambda: self.area.verticalScrollBar().setValue(scrolled_px))
        for name, index in focused:
            if name in self.rows:
                self.rows[name].parts()[index].setFocus()

    def _choose_liquid(self, index: int) -> None:
        self.liquid_chosen.emit(self._side, self._liquids[index])
