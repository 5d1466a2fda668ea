"""The left column: which liquid a side has, and every parameter of the side that is felt."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QStackedLayout, QWidget

from study_app.gui.lab.parameter_rows import ParameterRow, SwitchRow, row_for
from study_app.gui.lab.side_switch import Badge
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import Clamped, label
from study_app.gui.widgets.masked_panel import MaskedPanel
from study_app.lab.ab_comparison import Setting, other
from study_app.viewmodels.lab import FormSection, LabView, form

HIDDEN = "Hidden during a blind comparison"


class SectionBlock(QWidget):
    """A heading with its rows, and how many of them are changed."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.rows: dict[str, ParameterRow] = {}
        self.count = label("", "small", "text2")
        head = hbox(label(title, "strong", heading=True), STRETCH, self.count)
        self._grid = QGridLayout()
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(8)
        self._grid.setVerticalSpacing(2)
        vbox(head, self._grid, spacing=4, margins=(0, 8, 0, 8), parent=self)

    def show_section(self, section: FormSection) -> list[ParameterRow]:
        """Show the section's rows; return those that came new."""
        names = [row.parameter.name for row in section.rows]
        for name in self.rows.keys() - set(names):
            gone = self.rows.pop(name)
            self._grid.removeWidget(gone)
            gone.hide()
            gone.deleteLater()
        came = []
        for row in section.rows:
            if row.parameter.name not in self.rows:
                came.append(row_for(row.parameter))
                self.rows[row.parameter.name] = came[-1]
        self.rows = {name: self.rows[name] for name in names}
        if came or len(names) != self._grid.count():
            self._place()
        for row in section.rows:
            self.rows[row.parameter.name].show_row(row)
        changed = sum(row.changed for row in section.rows)
        self.count.setText(f"{changed} of {len(names)} changed" if changed else "")
        return came

    def _place(self) -> None:
        """Place two switches per line, and every other row on a line of its own."""
        line, column = 0, 0
        for row in self.rows.values():
            if isinstance(row, SwitchRow):
                self._grid.addWidget(row, line, column)
                line, column = (line + 1, 0) if column else (line, 1)
                continue
            line, column = (line + 1, 0) if column else (line, 0)
            self._grid.addWidget(row, line, 0, 1, 2)
            line += 1


class FormPanel(Card):
    """Liquid and parameters of the side that is felt; while blind, nothing of them in the same place."""

    changed = Signal(str, object, bool)
    liquid_chosen = Signal(str, object)
    copied = Signal()
    open_asked = Signal()
    use_asked = Signal()
    put_back_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=16, gap=8)
        self._setting: Setting | None = None
        self._liquids: tuple[object, ...] = ()
        self._side = "A"
        self._refused: tuple[str, str] | None = None
        self.blocks: dict[str, SectionBlock] = {}
        self.rows: dict[str, ParameterRow] = {}
        self.badge = Badge()
        self.liquid = Choice()
        self.liquid.setProperty("dense", "true")
        self.liquid.setFont(font("label"))
        self.liquid.activated.connect(self._choose)
        self.copy = ActionButton("copy", "Copy to B", height=32)
        self.copy.setProperty("dense", "true")
        self.copy.clicked.connect(self.copied)
        self.open = ActionButton("file", "Open preset …", height=32)
        self.use = ActionButton("layers", "Use in a study …", height=32)
        self.back = ActionButton("designer", "Put back into the study", height=32)
        self.back.hide()
        self.said = Clamped("", 2, "small", "text2")
        for button, asked in (
            (self.open, self.open_asked),
            (self.use, self.use_asked),
            (self.back, self.put_back_asked),
        ):
            button.setProperty("dense", "true")
            button.clicked.connect(asked)
        self._lay_out()

    def _lay_out(self) -> None:
        head = hbox(self.badge, (self.liquid, 1), self.copy, spacing=8)
        inside = QWidget()
        self._column = vbox(STRETCH, spacing=0, margins=(0, 0, 6, 0), parent=inside)
        self._rules: list[Rule] = []
        self.area = scrolled(inside)
        whole = QWidget()
        column = vbox(head, Rule(), (self.area, 1), spacing=8, margins=0, parent=whole)
        foot = hbox((self.open, 1), (self.use, 1), spacing=8)
        column.addWidget(Rule())
        column.addWidget(self.said)  # above the buttons, which stay in their place when it appears
        add_parts(column, self.back, foot)
        self.hidden = MaskedPanel(HIDDEN, "Parameters would reveal which is which.")
        self._stack = QStackedLayout()
        self._stack.addWidget(whole)
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
        self.back.setToolTip(f"{view.study} is open in the study designer")
        setting = bench.in_hand
        if setting != self._setting or bench.felt != self._side:
            refused = self._side != bench.felt
            self._setting, self._side = setting, bench.felt
            self._show_form(form(setting), forget=refused)
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
        self.badge.show_side(bench.felt)
        self.liquid.setAccessibleName(f"Liquid of {bench.felt}")
        index = self.liquid.findText(bench.in_hand.name)
        self.liquid.setCurrentIndex(index)
        self.liquid.setPlaceholderText(bench.in_hand.name)
        words = f"Copy to {other(bench.felt)}"
        self.copy.show_action("copy", words)

    def _show_form(self, sections: tuple[FormSection, ...], *, forget: bool) -> None:
        titles = [section.title for section in sections]
        new = titles != list(self.blocks)
        for title in self.blocks.keys() - set(titles):
            gone = self.blocks.pop(title)
            self._column.removeWidget(gone)
            gone.hide()
            gone.deleteLater()
        for title in titles:
            if title not in self.blocks:
                self.blocks[title] = SectionBlock(title)
        self.blocks = {title: self.blocks[title] for title in titles}
        if new:
            self._stack_up()
        if forget:
            for row in self.rows.values():
                row.let_go()
        came = [row for section in sections for row in self.blocks[section.title].show_section(section)]
        for row in came:
            row.changed.connect(self.changed)
        self.rows = {name: row for block in self.blocks.values() for name, row in block.rows.items()}
        if new or came:
            self._order()
            for block in self.blocks.values():
                apply_theme_within(block, self.theme)

    def _stack_up(self) -> None:
        """Place the blocks below one another, a hairline between them."""
        for rule in self._rules:
            self._column.removeWidget(rule)
            rule.hide()
            rule.deleteLater()
        for block in self.blocks.values():
            self._column.removeWidget(block)
        self._rules = [Rule() for _ in list(self.blocks)[1:]]
        for rule in self._rules:
            rule.apply_theme(self.theme)
        parts = [part for pair in zip(self.blocks.values(), self._rules, strict=False) for part in pair]
        for at, part in enumerate([*parts, *list(self.blocks.values())[-1:]]):
            self._column.insertWidget(at, part)

    def _order(self) -> None:
        """Let Tab go from top to bottom."""
        before: QWidget = self.copy
        for row in self.rows.values():
            for part in row.parts():
                QWidget.setTabOrder(before, part)
                before = part

    def _choose(self, index: int) -> None:
        self.liquid_chosen.emit(self._side, self._liquids[index])
