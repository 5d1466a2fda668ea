"""The study designer's place: header, outline, form, file and problems."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QMenu, QStackedWidget, QVBoxLayout, QWidget

from study_app.gui.designer.form.form import FormCard
from study_app.gui.designer.header import DesignerHeader
from study_app.gui.designer.new_study import NewStudyPage, NoStudyCard
from study_app.gui.designer.outline import OutlineCard
from study_app.gui.designer.pane.file_editor import FileCard
from study_app.gui.designer.pane.right_pane import PanePage, RightPane
from study_app.gui.designer.problems import ProblemsCard
from study_app.gui.designer.prompts import DeleteCard, Prompt, VersionCard
from study_app.gui.designer.segments import Segments
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import dress, take_away
from study_app.gui.widgets.cards import SHADOW, Card
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place
from study_app.viewmodels.designer.fact_cards import FactCards
from study_app.viewmodels.designer.new_study import TemplateChoice
from study_app.viewmodels.designer.outline_rows import OutlineRow
from study_app.viewmodels.designer.problem_rows import ProblemRow
from study_app.viewmodels.designer.prompts import DeletePrompt
from study_app.viewmodels.designer.requests import AddElement, RetypeFile
from study_app.viewmodels.designer.view import Banner, DesignerView, HeaderState

OUTLINE_PX, OUTLINE_NARROW_PX, WIDE_FROM = 284, 244, 1400
ONE_PANE_BELOW = 1130


class DesignerPlace(Place):
    """Draws a `DesignerView` and says what is asked for.

    Signals: ``entered``, ``left``; ``asked`` (a request); ``selected`` (path) and ``back_asked``; ``study_asked``
    (source), ``new_asked``, ``begin_asked`` (source, name, answers); ``undo_asked``, ``redo_asked``, ``save_asked``,
    ``save_as_version_asked`` (version); ``delete_asked`` (path); ``repair_asked`` (row, words); ``find_changed``;
    ``banner_asked`` (action).
    """

    entered = Signal()
    left = Signal()
    asked = Signal(object)
    selected = Signal(object)
    back_asked = Signal()
    study_asked = Signal(str)
    new_asked = Signal()
    begin_asked = Signal(str, str, object)
    undo_asked = Signal()
    redo_asked = Signal()
    save_asked = Signal()
    save_as_version_asked = Signal(str)
    delete_asked = Signal(object)
    repair_asked = Signal(object, str)
    find_changed = Signal(str)
    banner_asked = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.view = DesignerView()
        self.prompt: Prompt | None = None
        self.menu: QMenu | None = None
        self._repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self._side = "form"
        self.header = DesignerHeader()
        self.banner = Card(padding=10, gap=6)
        self.banner_words = label("", "label", wraps=True)
        self._banner_row = QHBoxLayout()
        self._banner_row.addWidget(self.banner_words, 1)
        self.banner.column.addLayout(self._banner_row)
        self.banner_buttons: list[ActionButton] = []
        self.outline = OutlineCard()
        self.form = FormCard()
        self.file = FileCard()
        self.problems = ProblemsCard()
        self.new_page = NewStudyPage()
        self.sides = Segments("Side")
        self.pane = RightPane()
        self.pane.add_page(PanePage("file", "File", self.file))
        self.nothing = NoStudyCard()
        self._lay_out()
        self._connect()
        self._take_keys()
        self.banner.hide()
        self.problems.hide()
        self.show_view(DesignerView())

    def _lay_out(self) -> None:
        self._prompts = QVBoxLayout()
        right = QVBoxLayout()
        right.setSpacing(12 - 2 * SHADOW)
        across = QHBoxLayout()
        across.setSpacing(14 - 2 * SHADOW)
        across.addWidget(self.form, 44)
        across.addWidget(self.pane, 56)
        sides = QHBoxLayout()
        sides.setContentsMargins(SHADOW, 0, SHADOW, 0)
        sides.addWidget(self.sides)
        sides.addStretch()
        right.addLayout(sides)
        right.addLayout(self._prompts)
        right.addLayout(across, 1)
        right.addWidget(self.problems)
        whole = QHBoxLayout()
        whole.setSpacing(14 - 2 * SHADOW)
        whole.addWidget(self.outline)
        whole.addLayout(right, 1)
        self._editing = QWidget()
        self._editing.setLayout(whole)
        whole.setContentsMargins(0, 0, 0, 0)
        main = QWidget()
        column = QVBoxLayout(main)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(10)
        column.addWidget(self.header)
        column.addWidget(self.banner)
        column.addWidget(self.nothing, 1)
        column.addWidget(self._editing, 1)
        self.stack = QStackedWidget()
        self.stack.addWidget(main)
        self.stack.addWidget(self.new_page)
        page = QVBoxLayout(self)
        page.setContentsMargins(20, 14, 20, 14)
        page.addWidget(self.stack)

    def _connect(self) -> None:
        header, outline, form = self.header, self.outline, self.form
        header.study_asked.connect(self.study_asked)
        header.new_asked.connect(self.new_asked)
        header.file_asked.connect(self._open_file)
        header.problems_asked.connect(lambda: self.problems.setVisible(not self.problems.isVisible()))
        header.undo_asked.connect(self._undo)
        header.redo_asked.connect(self._redo)
        header.save_asked.connect(self._save)
        self.nothing.new.clicked.connect(self.new_asked)
        outline.chosen.connect(self._select)
        outline.find_changed.connect(self.find_changed)
        outline.add_asked.connect(self.ask_to_add)
        outline.duplicate_asked.connect(form.head.duplicate)
        outline.delete_asked.connect(form.head.ask_to_delete)
        form.asked.connect(self.asked)
        form.open_asked.connect(self._select)
        form.delete_asked.connect(self.delete_asked)
        self.file.typed.connect(lambda text: self.asked.emit(RetypeFile(text)))
        self.problems.opened.connect(self._open_problem)
        self.problems.repair_asked.connect(self.repair_asked)
        self.problems.close_asked.connect(self.problems.hide)
        self.new_page.begin_asked.connect(self.begin_asked)
        self.new_page.given_up.connect(self.close_new)
        self.sides.chosen.connect(lambda side: self._show_side(str(side)))

    def _take_keys(self) -> None:
        for keys, act in (
            ("Ctrl+Z", self._undo), ("Ctrl+Shift+Z", self._redo), ("Ctrl+Y", self._redo), ("Ctrl+S", self._save),
            ("F8", self._next_problem), ("Ctrl+D", self.form.head.duplicate), ("Ctrl+F", self.outline.words.setFocus),
            ("Alt+Up", lambda: self.form.head.move_by(-1)), ("Alt+Down", lambda: self.form.head.move_by(1)),
            ("Alt+Left", self.back_asked.emit), ("F2", self._rename), ("Ctrl+E", self._switch_to_file),
            ("F6", lambda: self._cycle(1)), ("Shift+F6", lambda: self._cycle(-1)),
            ("Ctrl+1", self.outline.tree.setFocus), ("Ctrl+2", self._focus_form), ("Ctrl+3", self._focus_pane),
            ("Ctrl+4", self._focus_problems),
        ):  # fmt: skip
            made = QShortcut(QKeySequence(keys), self)
            made.setContext(Qt.ShortcutContext.WindowShortcut)
            made.activated.connect(act)

    # what is shown

    def show_view(self, view: DesignerView) -> None:
        """Show a study; only what has changed is made anew."""
        before, self.view = self.view, view
        self.show_header(view.header)
        self.nothing.setVisible(view.form is None)
        self._editing.setVisible(view.form is not None)
        self._show_banner(view.banner)
        if view.form is None:
            return
        elsewhere = before.form is None or before.form.path != view.form.path
        if elsewhere:
            self.close_prompt()
        self.form.show_form(view.form, read_only=view.header.read_only)
        self.file.show_file(view.file, scroll=elsewhere, read_only=view.header.read_only)
        self._repairs = {row: words for row, words in self._repairs.items() if row in view.problems}
        self.problems.show_problems(view.problems, view.form.path, self._repairs)
        self.outline.duplicate.setEnabled(self.form.head.copy.isEnabled())
        self.outline.add.setEnabled(not view.header.read_only)
        if not view.problems and before.problems:
            self.problems.hide()
        if self.outline.rows:
            self.outline.mark(view.form.path)

    def show_header(self, state: HeaderState) -> None:
        """Show the header's state."""
        self.header.show_state(state)

    def show_outline(self, rows: tuple[OutlineRow, ...], selected: object, facts: FactCards) -> None:
        """Show the rows of the outline, and the facts of the study."""
        self.outline.show_outline(rows, selected)
        self.pane.facts.show_facts(facts)

    def show_repairs(self, row: ProblemRow, words: tuple[str, ...]) -> None:
        """Offer the repairs of a problem."""
        self._repairs[row] = words
        self.problems.show_repairs(row, words)

    def _show_banner(self, banner: Banner | None) -> None:
        self.banner.setVisible(banner is not None)
        if banner is None or banner.words == self.banner_words.text():
            return
        self.banner_words.setText(banner.words)
        for button in self.banner_buttons:
            take_away(button)
        self.banner_buttons = []
        for action, words in banner.actions:
            made = ActionButton("", words, height=36)
            made.clicked.connect(lambda _checked=False, action=action: self.banner_asked.emit(action))
            dress(made, self.theme)
            self._banner_row.addWidget(made)
            self.banner_buttons.append(made)

    def show_new(self, choices: tuple[TemplateChoice, ...], chosen: str) -> None:
        """Show what a new study can begin from."""
        self.new_page.show_choices(choices, chosen)
        self.stack.setCurrentWidget(self.new_page)
        self.new_page.name.setFocus()

    def close_new(self) -> None:
        """Go back to the study."""
        self.stack.setCurrentIndex(0)

    def refuse_new(self, sentence: str) -> None:
        """Say why a study cannot begin so."""
        self.new_page.refuse(sentence)

    def refuse(self, path: tuple[str | int, ...], sentence: str, *, renaming: bool) -> None:
        """Say at its field why something was not done."""
        if renaming:
            self.form.head.refuse(sentence)
        else:
            self.form.refuse(path, sentence)

    def ask_to_delete(self, asked: DeletePrompt) -> None:
        """Show what names an element, and ask what becomes of it."""
        made = DeleteCard(asked)
        made.answered.connect(self.asked)
        self._show_prompt(made, made.first)

    def ask_for_version(self, reason: str, version: str) -> None:
        """Ask whether to save under another version."""
        made = VersionCard(reason, version)
        made.answered.connect(self.save_as_version_asked.emit)
        self._show_prompt(made, made.first)

    def _show_prompt(self, prompt: Prompt, first: QWidget) -> None:
        self.close_prompt()
        self.prompt = prompt
        prompt.answered.connect(lambda _answer: self.close_prompt())
        prompt.given_up.connect(self.close_prompt)
        dress(prompt, self.theme)
        self._prompts.addWidget(prompt)
        first.setFocus()

    def close_prompt(self) -> None:
        """Close a question that is open."""
        if self.prompt is not None:
            closing, self.prompt = self.prompt, None
            take_away(closing)

    # what is asked for

    def flush(self) -> None:
        """Hand on what is being typed."""
        self.form.flush()
        self.file.editor.flush()

    def _select(self, path: object) -> None:
        self.flush()
        self.selected.emit(path)

    def _undo(self) -> None:
        self.flush()
        self.undo_asked.emit()

    def _redo(self) -> None:
        self.flush()
        self.redo_asked.emit()

    def _save(self) -> None:
        self.flush()
        self.save_asked.emit()

    def ask_to_add(self) -> None:
        """Show what can be added: an element of each kind."""
        if self.view.form is None or self.view.header.read_only:
            return
        menu = QMenu(self)
        menu.setFont(font("label"))
        for section, words in self.view.addable:
            action = menu.addAction(words)
            action.triggered.connect(lambda _checked=False, section=section: self.asked.emit(AddElement(section)))
            if section == self.view.form.path[: len(section)]:
                menu.setActiveAction(action)
        self.menu = menu
        menu.popup(self.outline.add.mapToGlobal(self.outline.add.rect().topLeft()))

    def _open_file(self) -> None:
        chosen, _ = QFileDialog.getOpenFileName(self, "Open study", "", "Protocols (*.toml)")
        if chosen:
            self.study_asked.emit(chosen)

    def _open_problem(self, row: ProblemRow) -> None:
        self.problems.show()
        if row.element:
            self._select(row.element)
        in_form = bool(row.element) and self.form.focus(row.fault.path)
        if row.line is not None and not in_form:
            self._focus_file()
        if row.line is not None:
            self.file.editor.go_to(row.line - 1)

    def _next_problem(self) -> None:
        if self.view.form is not None:
            self.flush()
            self.problems.open_next()

    def _rename(self) -> None:
        if self.form.head.id.isVisible() and not self.view.header.read_only:
            self.form.head.id.setFocus(Qt.FocusReason.ShortcutFocusReason)
            self.form.head.id.selectAll()

    # parts of the place

    def _focus_form(self) -> None:
        self._show_side("form")
        self.form.focus_first()

    def _focus_pane(self) -> None:
        self._show_side("pane")
        page = next(one for one in self.pane.pages if one.name == self.pane.tab)
        (page.body.focusProxy() or self.pane.tabs).setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _focus_file(self) -> None:
        self.pane.show_tab("file")
        self._focus_pane()

    def _focus_problems(self) -> None:
        self.problems.show()
        self.problems.next.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _switch_to_file(self) -> None:
        if self.file.editor.hasFocus():
            self._focus_form()
        else:
            self._focus_file()

    def _cycle(self, by: int) -> None:
        stops = [
            (self.header, self.header.study.setFocus),
            (self.outline, self.outline.tree.setFocus),
            (self.form, self._focus_form),
            (self.pane, self._focus_pane),
        ]
        if self.problems.isVisible():
            stops.append((self.problems, self._focus_problems))
        focused = self.focusWidget()
        here = next((at for at, (part, _) in enumerate(stops) if focused and part.isAncestorOf(focused)), -by)
        stops[(here + by) % len(stops)][1]()

    def _show_side(self, side: str) -> None:
        self._side = side
        self._arrange()

    def _arrange(self) -> None:
        one = self.width() < ONE_PANE_BELOW
        self.outline.setFixedWidth(OUTLINE_PX if self.width() >= WIDE_FROM else OUTLINE_NARROW_PX)
        self.sides.setVisible(one)
        self.sides.show_values((("form", "Form"), ("pane", "Views")), self._side)
        self.form.setVisible(not one or self._side == "form")
        self.pane.setVisible(not one or self._side == "pane")
        self.pane.make_room()

    def enter(self) -> None:
        """Look again at what there is."""
        self.entered.emit()

    def leave(self) -> None:
        """Hand on what is being typed; the draft is written at once."""
        self.flush()
        self.left.emit()

    def wants_narrow_rail(self) -> bool:
        """Return that form and file need the width."""
        return True

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 - Qt's name
        """Make room."""
        super().resizeEvent(event)
        self._arrange()
