"""The page of the study designer: the layout of its parts, their keys, and the tour of the problems."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cmp_to_key, partial
from typing import Any

from PySide6.QtCore import QEvent, QRect, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QResizeEvent
from PySide6.QtWidgets import QAbstractScrollArea, QAbstractSlider, QApplication, QSizePolicy, QStackedWidget, QWidget
from shiboken6 import isValid

from study_app.designer.document.steps import (
    Do,
    GoTo,
    LeaveText,
    MoveElement,
    MoveTo,
    RetypeFile,
    SetText,
    SetValue,
    Step,
    Task,
    index_of,
    with_path,
)
from study_app.designer.file import FileCard
from study_app.designer.form.card import FormCard
from study_app.designer.form.fields import TypedLine, TypedText
from study_app.designer.form.rows import Form
from study_app.designer.header import DesignerHeader, DesignerView, NoticeCard
from study_app.designer.measures.measures_page import FactsRow, MeasuresPage
from study_app.designer.new_study_page import NewStudyPage, NoStudyCard, TemplateChoice
from study_app.designer.outline import Addable, AddList, ElementPath, OutlineCard
from study_app.designer.parts import Segments, small_button
from study_app.designer.problems import ProblemRow, ProblemsCard
from study_app.designer.prompts import Prompt
from study_app.gui.kit import COMMANDS, add_commands, command_tip, connect_button, key_cap, keys_of
from study_app.gui.theme import SHADOW, font, name_scroll_bars, remove_widget
from study_app.gui.widgets import (
    QWIDGETSIZE_MAX,
    STRETCH,
    Icon,
    Place,
    PressedByEnter,
    add_parts,
    announce,
    hbox,
    last_focused,
    vbox,
)

FACTS_MIN_WINDOW_PX, FACTS_MIN_PANE_PX, FACTS_MIN_PX = 740, 560, 110
"""Minimum heights of the window, of the pane, and of the facts themselves, with which the facts are shown [px]."""
_ASIDE_GAP = 24


@dataclass(frozen=True, kw_only=True)
class PanePage:
    """A page of the right pane."""

    name: str
    title: str  # the label of the tab
    body: QWidget  # the content; its focus proxy takes the keyboard focus
    aside: QWidget | None = None  # controls to the right of the tabs while the page is shown
    with_facts: bool = True  # whether the facts are shown below the page
    # returns the maximum height of the body; the facts take the rest [px]
    max_body_px: Callable[[], int] = lambda: QWIDGETSIZE_MAX
    tip: str = ""  # the tip of its tab


class _RightPane(QWidget):
    """Tabs, the selected page, and the facts; ``tab_shown`` carries the name of the page that is shown."""

    tab_shown = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Study views")
        self.pages: list[PanePage] = []
        self.tab = ""
        self.tabs = Segments("Study view")
        self.facts = FactsRow()
        self._asides, self._below = hbox(), hbox(STRETCH, margins=(SHADOW, 0, SHADOW, 0))
        bar = hbox(self.tabs, STRETCH, self._asides, margins=(SHADOW, 0, SHADOW, 0))
        self._stack = QStackedWidget()
        parts = (bar, self._below, (self._stack, 1), self.facts, STRETCH)
        self._column = vbox(*parts, spacing=12 - 2 * SHADOW, margins=0, parent=self)
        self.tabs.chosen.connect(lambda name: self.show_tab(str(name)))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Scroll the page with the page keys, even while the tabs have the focus."""
        body, key = self._stack.currentWidget(), event.key()
        if isinstance(body, QAbstractScrollArea) and key in {Qt.Key.Key_PageUp, Qt.Key.Key_PageDown}:
            step = QAbstractSlider.SliderAction
            action = step.SliderPageStepAdd if key == Qt.Key.Key_PageDown else step.SliderPageStepSub
            body.verticalScrollBar().triggerAction(action)
        else:
            super().keyPressEvent(event)

    def add_page(self, page: PanePage, *, first: bool = False) -> None:
        self.pages.insert(0 if first else len(self.pages), page)
        self._stack.addWidget(page.body)
        if page.aside is not None:
            self._asides.addWidget(page.aside)
        self.show_tab(page.name if first else self.tab or page.name)

    def show_tab(self, name: str) -> None:
        page = next(page for page in self.pages if page.name == name)
        changed, self.tab = name != self.tab, name
        self.tabs.tips = {page.name: page.tip for page in self.pages}
        self.tabs.show_values([(page.name, page.title) for page in self.pages], name)
        self._stack.setCurrentWidget(page.body)
        for tab_page in self.pages:
            if tab_page.aside is not None:
                tab_page.aside.setVisible(tab_page is page)
        self.arrange_parts()
        if changed:
            self.tab_shown.emit(name)

    def _place_aside(self) -> None:
        """Put the page's controls to the right of the tabs, or below them if there is no room."""
        page = next((page for page in self.pages if page.name == self.tab), None)
        if page is not None and page.aside is not None:
            room = self.width() - 2 * SHADOW - self.tabs.sizeHint().width() - _ASIDE_GAP
            row = self._asides if page.aside.sizeHint().width() <= room else self._below
            if row.indexOf(page.aside) < 0:
                row.addWidget(page.aside)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.arrange_parts()

    def arrange_parts(self) -> None:
        """Arrange controls and facts; the facts are hidden if the window is too low or the page needs their space."""
        self._place_aside()
        page = next((page for page in self.pages if page.name == self.tab), None)
        height = self.window().height()
        has_room = not self.isVisible() or self.height() >= FACTS_MIN_PANE_PX
        shows_facts = page is not None and page.with_facts and height >= FACTS_MIN_WINDOW_PX and has_room
        max_px = QWIDGETSIZE_MAX if page is None or not shows_facts else page.max_body_px()
        left_px = self.height() - self._stack.y() - max_px - self._column.spacing()
        if max_px < QWIDGETSIZE_MAX and self.isVisible() and left_px < FACTS_MIN_PX:
            shows_facts = False  # the page fills the pane
        self._stack.setMaximumHeight(max_px if shows_facts else QWIDGETSIZE_MAX)
        self.facts.fit_height(height, left_px)
        self.facts.setVisible(shows_facts)


OUTLINE_PX, DRAWER_PX = 284, 320
DRAWER_BELOW, ONE_PANE_BELOW = 1400, 1130
_GAP = 14 - 2 * SHADOW
_FORM_SHARE = 44
"""Proportion of the width that the form takes beside the pane [%]."""


class _PathStep(PressedByEnter):
    """A button of the path bar; its text is elided if there is not enough room."""

    def __init__(self, text: str, least_px: int) -> None:
        super().__init__(text)
        self.whole, self._least_px = text, least_px
        self.setAccessibleName(text)
        self.setToolTip(text)
        self.setProperty("role", "plain")
        self.setProperty("dense", "true")
        self.setFont(font("label"))
        self.setFixedHeight(32)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return QSize(self.fontMetrics().horizontalAdvance(self.whole) + 24, 32)

    def minimumSizeHint(self) -> QSize:
        return QSize(min(self._least_px, self.sizeHint().width()), 32)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        room = self.width() - 22
        self.setText(self.fontMetrics().elidedText(self.whole, Qt.TextElideMode.ElideRight, room))


class _PathBar(QWidget):
    """The path of the form's element, shown while the outline is a drawer; ``open_asked`` carries a path."""

    outline_asked = Signal()
    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Element path")
        self.outline = small_button("layers", "Outline", cap=key_cap("outline"), height=40)
        self.outline.setAccessibleName(command_tip("outline"))
        self.outline.setToolTip(command_tip("outline"))
        self.outline.clicked.connect(self.outline_asked)
        self.steps: list[_PathStep] = []
        self._parts: list[QWidget] = []
        self._shown: object = None
        self._steps = hbox(spacing=0)
        self.row = hbox(self.outline, self._steps, STRETCH, spacing=4, margins=0, parent=self)

    def show_form(self, form: Form) -> None:
        if form.around == self._shown:
            return
        self._shown = form.around
        had_focus = any(step.hasFocus() for step in self.steps)
        if had_focus:
            self.outline.setFocus(Qt.FocusReason.OtherFocusReason)  # else Qt moves the focus to the rail
        for part in self._parts:
            remove_widget(part)
        self.steps, self._parts = [], []
        for path, title in form.around:
            separator = Icon("chevron", "text2", 14)
            button = _PathStep(title, 56 if path == form.path else 104)
            button.clicked.connect(lambda _checked=False, path=path: self.open_asked.emit(path))
            for part in (separator, button):
                self._steps.addWidget(part)
            self.steps.append(button)
            self._parts += [separator, button]
        if had_focus and self.steps:
            self.steps[-1].show()  # at once: a hidden widget takes no focus
            self.steps[-1].setFocus(Qt.FocusReason.OtherFocusReason)


_SHORTCUT = Qt.FocusReason.ShortcutFocusReason


def focus_stops(part: QWidget) -> Iterator[QWidget]:
    """Yield the Tab stops of a part in reading order: from top to bottom, side by side from left to right."""
    if part.focusPolicy() & Qt.FocusPolicy.TabFocus and part.focusProxy() is None and part.isEnabled():
        yield part
    inner = (
        child for child in part.children() if isinstance(child, QWidget) and child.isVisible() and not child.isWindow()
    )
    for child in sorted(inner, key=cmp_to_key(_reading_order)):
        yield from focus_stops(child)


def _reading_order(part: QWidget, other: QWidget) -> int:
    first, second = part.geometry(), other.geometry()
    if first.bottom() < second.top() or second.bottom() < first.top():
        return first.top() - second.top()
    return first.left() - second.left()


class _Layout(QWidget):
    """The layout of outline, form, pane and problems; ``used`` is the last focused one of the first three.

    ``entered`` is emitted when a part other than the outline gets the focus.
    """

    entered = Signal()

    def __init__(
        self, header: DesignerHeader, outline: OutlineCard, form: FormCard, pane: _RightPane, file: FileCard,
        problems: ProblemsCard,
    ) -> None:  # fmt: skip
        super().__init__()
        self.header, self.outline, self.form = header, outline, form
        self.pane, self.file, self.problems = pane, file, problems
        header.keyboard_left.connect(self.return_keyboard)
        self.side = "form"
        self.used: QWidget = form
        self.drawer = False
        self._focus_before_drawer: QWidget | None = None
        self._width = DRAWER_BELOW
        self.path = _PathBar()
        self.path.outline_asked.connect(self.toggle_drawer)
        self.sides = Segments("Side")
        self.sides.tips = {"form": command_tip("form"), "pane": command_tip("views")}
        self.sides.chosen.connect(lambda side: self.show_side(str(side)))
        self.prompts = vbox()
        self._left = vbox((form, 1), spacing=12 - 2 * SHADOW)
        self._across = hbox((self._left, _FORM_SHARE), (pane, 100 - _FORM_SHARE), spacing=_GAP)
        self.top = QWidget()
        hbox((self.path, 1), self.sides, margins=(SHADOW, 0, SHADOW, 0), parent=self.top)
        self._right = vbox(self.top, self.prompts, (self._across, 1), problems, spacing=12 - 2 * SHADOW)
        self._whole = hbox(outline, (self._right, 1), spacing=_GAP, margins=0, parent=self)
        outline.setFixedWidth(OUTLINE_PX)
        application = QApplication.instance()
        assert isinstance(application, QApplication)  # noqa: S101 - a window has one
        application.focusChanged.connect(self._follow_focus)

    def show_side(self, side: str) -> None:
        self.side = side
        self.arrange(self._width)

    def arrange(self, width: int) -> None:
        self._width = width
        single, drawer = width < ONE_PANE_BELOW, width < DRAWER_BELOW
        if drawer != self.drawer:
            self.drawer = drawer
            if drawer:
                self._whole.removeWidget(self.outline)
                self.outline.setFixedWidth(DRAWER_PX)
                self.outline.hide()
                self._place_drawer()
            else:
                self.outline.setFixedWidth(OUTLINE_PX)
                self.outline.setMinimumHeight(0)
                self._whole.insertWidget(0, self.outline)
                self.outline.show()
        self.path.setVisible(drawer)
        self.top.setVisible(drawer)
        (self._right if single else self._left).insertWidget(0, self.top)
        self.sides.setVisible(single)
        self.sides.show_values((("form", "Form"), ("pane", "Views")), self.side)
        self.form.setVisible(not single or self.side == "form")
        self._across.setStretch(
            0, _FORM_SHARE if self.form.isVisibleTo(self) else 0
        )  # otherwise the empty layout takes space
        self.pane.setVisible(not single or self.side == "pane")
        self.pane.arrange_parts()

    def focus_outline(self) -> None:
        if self.drawer:
            self._focus_before_drawer = (
                self.window().focusWidget() if not self.outline.isVisible() else self._focus_before_drawer
            )
            self._place_drawer()
            self.outline.show()
            self.outline.raise_()
        self.outline.tree.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def focus_find(self) -> None:
        self.focus_outline()
        self.outline.search_field.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def toggle_drawer(self) -> None:
        if self.outline.isVisible():
            self.close_drawer()
        else:
            self.focus_outline()

    def close_drawer(self) -> None:
        """Close the drawer, if it is open; the focus returns to its previous place, else to the drawer's button."""
        if self.drawer and self.outline.isVisible():
            had_focus = self.outline.isAncestorOf(self.window().focusWidget() or self)
            self._hide_drawer()
            previous = self._focus_before_drawer
            if had_focus and previous is not None and isValid(previous) and previous.isVisible():
                previous.setFocus(Qt.FocusReason.OtherFocusReason)
            elif had_focus:
                self.path.outline.setFocus(Qt.FocusReason.OtherFocusReason)

    def _follow_focus(self, _left: QWidget | None, now: QWidget | None) -> None:
        """Remember the focused part and show its help; close the drawer when another part gets the focus."""
        parts = (self.outline, self.form, self.pane)
        self.form.show_help_of(now)
        if any(part.isAncestorOf(now) for part in (self.form, self.pane, self.problems) if now is not None):
            self.entered.emit()
        self.used = next((part for part in parts if now is not None and part.isAncestorOf(now)), self.used)
        if self.drawer and now is not None and self.isAncestorOf(now) and not self.outline.isAncestorOf(now):
            self._hide_drawer()

    def _hide_drawer(self) -> None:
        self.outline.hide()
        self.outline.search_field.clear()

    def _place_drawer(self) -> None:
        self.outline.setGeometry(QRect(0, 46, DRAWER_PX, max(200, self.height() - 46)))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self.drawer:
            self._place_drawer()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Close the drawer at a click next to it, even on a part that does not take the focus."""
        if not self.outline.geometry().contains(event.position().toPoint()):
            self.close_drawer()
        super().mousePressEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.drawer and self.outline.isVisible() and event.key() == Qt.Key.Key_Escape:
            self.close_drawer()
        else:
            super().keyPressEvent(event)

    # the keyboard

    def focus_header(self) -> None:
        self.header.study.setFocus(_SHORTCUT)

    def focus_form(self) -> None:
        """Focus the field of the current problem if the form shows it, otherwise the first field."""
        self.show_side("form")
        form, row = self.form.form, self.problems.current
        if form is None or row is None or row.element != form.path or not self.form.focus_row(row.fault.path):
            self.form.focus_first_field()

    def focus_first_field(self) -> None:
        self.show_side("form")
        self.form.focus_first_field()

    def focus_field(self, path: ElementPath) -> None:
        """Focus a field of the form and select its value; if the form does not have it, focus the first row."""
        if not self.focus_row(path):
            self.form.focus_first()
        elif isinstance(field := self.form.focusWidget(), TypedLine | TypedText):
            field.selectAll()

    def focus_row(self, path: ElementPath) -> bool:
        self.show_side("form")
        return self.form.focus_row(path)

    def focus_element(self) -> None:
        """Focus the selected element's row, or its form if the outline is a drawer."""
        if self.drawer:
            self.focus_form()
        else:
            self.focus_outline()

    def return_keyboard(self) -> None:
        """Restore the last focus in outline, form or pane; instead of the search field, focus the selected element."""
        last = last_focused(self.used)
        if last is None or last is self.outline.search_field:
            self.focus_element()
        else:
            last.setFocus(Qt.FocusReason.OtherFocusReason)

    def focus_pane(self) -> None:
        """Focus the page of the right pane, or its tabs if the focus is already in the pane."""
        pane = self.pane
        if pane.isAncestorOf(pane.window().focusWidget() or self.header):
            pane.tabs.setFocus(_SHORTCUT)
        else:
            self._focus_page()

    def _focus_tabs(self) -> None:
        """Focus the tabs of the right pane, from which Tab goes to the controls beside them and to the page."""
        self.show_side("pane")
        self.pane.tabs.setFocus(_SHORTCUT)

    def _focus_page(self) -> None:
        self.show_side("pane")
        pane = self.pane
        page = next(page for page in pane.pages if page.name == pane.tab)
        part = page.body.focusProxy() or page.body
        (part if part.isVisible() else pane.tabs).setFocus(_SHORTCUT)

    def show_tab(self, name: str) -> None:
        self.pane.show_tab(name)
        self._focus_page()

    def focus_problems(self) -> None:
        self.problems.show()
        (self.problems.next if self.problems.rows else self.problems.close_button).setFocus(_SHORTCUT)

    def switch_to_file(self) -> None:
        """Focus the file editor; if it already has the focus, return to the last focus in the form."""
        if not self.file.editor.hasFocus():
            self.show_tab("file")
            return
        last = self.form.focusWidget()  # also remembered while the file covers the form
        self.show_side("form")
        if last is not None and last.isVisible() and last.isEnabled():
            last.setFocus(_SHORTCUT)
        else:
            self.form.focus_first()

    def cycle(self, step: int) -> None:
        stops: list[tuple[QWidget, Callable[[], None]]] = [
            (self.header, self.focus_header),
            (self.outline, self.focus_outline),
            (self.form, self.focus_form),
            (self.pane, self._focus_tabs),
        ]
        if self.problems.isVisible():
            stops.append((self.problems, self.focus_problems))
        focused = self.window().focusWidget()
        index = next(
            (position for position, (part, _) in enumerate(stops) if focused and part.isAncestorOf(focused)), -step
        )
        stops[(index + step) % len(stops)][1]()


class DesignerPlace(Place):
    """Shows a `DesignerView`; ``asked`` carries a request for a step, or a task (`Do`)."""

    entered = Signal()
    left = Signal()
    asked = Signal(object)
    keys_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.view = DesignerView()
        self.prompt: Prompt | None = None
        self.header, self.banner = DesignerHeader(), NoticeCard(of_playing=False)
        self.form, self.file, self.problems = FormCard(), FileCard(), ProblemsCard()
        self.outline, self.new_page = OutlineCard(), NewStudyPage()
        self.pane = _RightPane()
        self.measures = MeasuresPage()
        self.pane.add_page(PanePage(name="measures", title="Measures", body=self.measures, with_facts=False))
        self.pane.add_page(
            PanePage(name="file", title="File", body=self.file, aside=self.file.aside, tip=command_tip("file"))
        )
        self.parts = _Layout(self.header, self.outline, self.form, self.pane, self.file, self.problems)
        self.sides = self.parts.sides
        self.adding, self.nothing = AddList(self), NoStudyCard()
        self._lay_out()
        self._connect()
        self._add_key_commands()
        self.problems.hide()
        self.show_view(DesignerView())

    def _lay_out(self) -> None:
        main = QWidget()
        column = vbox(spacing=10, margins=0, parent=main)
        add_parts(column, self.header, self.banner, (self.nothing, 1), (self.parts, 1))
        self.stack = QStackedWidget()
        self.stack.addWidget(main)
        self.stack.addWidget(self.new_page)
        vbox(self.stack, margins=(20, 14, 20, 14), parent=self)

    def _connect(self) -> None:
        header, outline, form = self.header, self.outline, self.form
        header.study_asked.connect(partial(self.ask, "open"))
        header.new_asked.connect(partial(self.ask, "new"))
        header.problems.clicked.connect(lambda: self.ask("leave entries"))
        header.problems.clicked.connect(lambda: self.problems.setVisible(not self.problems.isVisible()))
        self.nothing.new.clicked.connect(lambda: self.ask("new"))
        self.banner.asked.connect(partial(self.ask, "banner"))
        self.banner.left.connect(self.parts.return_keyboard)
        outline.chosen.connect(partial(self.finish, "select"))
        outline.search_field.textChanged.connect(partial(self.ask, "find"))
        outline.field_asked.connect(self.parts.focus_field)
        outline.form_asked.connect(self.parts.focus_first_field)
        outline.element_clicked.connect(lambda: self.parts.focus_first_field() if self.parts.drawer else None)
        outline.tree.dropped.connect(lambda entry, to: self.asked.emit(MoveTo(entry, index_of(to))))
        self.adding.chosen.connect(lambda entry: self._handle_request(entry.asks))
        self.parts.entered.connect(
            self._leave_entries, Qt.ConnectionType.QueuedConnection
        )  # after all parts are updated
        self.parts.path.open_asked.connect(partial(self.finish, "select"))
        form.asked.connect(self._handle_request)
        form.head.id_typed.connect(partial(self.ask, "judge id"))
        self.file.editor.typed.connect(lambda text: self.asked.emit(RetypeFile(text)))
        self.problems.opened.connect(self._open_problem)
        self.problems.next.clicked.connect(self.open_next_problem)
        for part in (self.problems, form):
            part.repair_asked.connect(self._ask_to_repair)
        self.problems.close_asked.connect(
            self.parts.return_keyboard
        )  # before it is hidden, otherwise Qt moves the focus to the page
        self.problems.close_asked.connect(self.problems.hide)
        self.new_page.begin_asked.connect(partial(self.ask, "begin"))
        self.new_page.given_up.connect(self.close_new)

    def _add_key_commands(self) -> None:
        head, tree = self.form.head, self.outline.tree
        runs = {
            command.id: (command.within, partial(command.run, self)) for command in COMMANDS if command.run is not None
        }
        tree_commands = add_commands(tree, {name: run for name, (within, run) in runs.items() if within})
        self.commands = tree_commands | add_commands(
            self, {name: run for name, (within, run) in runs.items() if not within}
        )
        for name, button in (
            ("keys", self.header.keys), ("undo", self.header.undo), ("redo", self.header.redo),
            ("save", self.header.save), ("up", head.up), ("down", head.down), ("duplicate", head.copy),
            ("series", head.series), ("add", self.outline.add), ("duplicate", self.outline.duplicate),
        ):  # fmt: skip
            connect_button(button, self.commands[name])
        head.delete.clicked.connect(self.delete)
        menu = ("add", "duplicate", "up", "down", "rename", "delete")
        tree.addActions([self.commands[name] for name in menu])
        for action in tree_commands.values():  # elsewhere, lists and texts have these keys
            action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)

    def duplicate(self) -> None:
        if self.form.head.copy.isEnabled():
            self.finish("duplicate", self.form_path)

    def make_series(self) -> None:
        if self.view.form is not None:
            self.finish("series", self.view.form.path)

    def delete(self) -> None:
        if self.form.head.delete.isEnabled():
            self.finish("delete", self.form_path)

    def move_by(self, offset: int) -> None:
        if self.form_path and not self.view.header.read_only:
            self.flush()
            self.asked.emit(MoveElement(self.form_path, offset))

    def write_question(self, offset: int) -> None:
        """Go to the text of the question ``offset`` positions away, or from a questionnaire to its first question."""
        if (form := self.view.form) is None:
            return
        question_lists = [row.facts.lines for row in form.rows if row.path[-1] == "items" and row.facts is not None]
        paths = [line.path for line in (*form.questions.lines, *(line for lines in question_lists for line in lines))]
        index = (paths.index(form.path) if form.path in paths else -1) + offset
        if 0 <= index < len(paths):
            self._handle_request(Do("write", (paths[index],)))

    @property
    def form_path(self) -> ElementPath:
        return () if self.view.form is None else self.view.form.path

    # display

    def show_view(self, view: DesignerView) -> None:
        """Show a study; only changed parts are recreated."""
        previous, self.view = self.view, view
        self.header.show_state(view.header)
        self.nothing.setVisible(view.form is None)
        self.parts.setVisible(view.form is not None)
        self.banner.show_notice(view.banner)
        if view.form is None:
            return
        elsewhere = previous.form is None or previous.form.path != view.form.path
        if elsewhere:
            self.close_prompt(elsewhere=True)
        writable = not view.header.read_only and not view.form.unreadable
        of_element = writable and view.form.id is not None
        enabled_commands = dict.fromkeys(
            ("add", "up", "down"), writable
        )  # "up" and "down" always report why an element cannot be moved
        enabled_commands |= dict.fromkeys(("duplicate", "rename", "delete"), of_element)
        for name, possible in enabled_commands.items():
            self.commands[name].setEnabled(possible)
        self.parts.path.show_form(view.form)
        self.form.show_form(view.form, read_only=view.header.read_only)
        self.file.show_file(view.file, scroll=elsewhere, read_only=view.header.read_only)
        self.problems.show_problems(view.problems, view.form.path)
        self.form.show_repairs(self.problems.repairs)
        self.outline.tree.rows.movable = not view.header.read_only
        if self.outline.rows:
            self.outline.mark_row(view.form.path)

    def show_repairs(self, row: ProblemRow, sentences: tuple[str, ...]) -> None:
        self.problems.show_repairs(row, sentences)
        self.form.show_repairs(self.problems.repairs)

    def reset_view(self) -> None:
        """Reset all parts, so that the next view, which is of another study, is shown from the top."""
        self.view, self.form.form = DesignerView(), None
        self.outline.begin()
        self.problems.begin()
        self.measures.verticalScrollBar().setValue(0)

    def show_new(self, choices: tuple[TemplateChoice, ...], chosen: str) -> None:
        self.new_page.card.questions.clear()
        self.new_page.show_choices(choices, chosen)
        self.stack.setCurrentWidget(self.new_page)
        self.new_page.card.questions.title.setFocus()

    def close_new(self) -> None:
        if self.stack.currentIndex():
            self.stack.setCurrentIndex(0)
            self.parts.focus_element()

    def show_prompt(self, prompt: Prompt, first: QWidget) -> None:
        self.close_prompt()
        self.prompt = prompt
        prompt.answered.connect(lambda _answer: self.close_prompt())
        prompt.given_up.connect(self.close_prompt)
        name_scroll_bars(prompt)
        self.parts.prompts.addWidget(prompt)
        first.setFocus()

    def close_prompt(self, *, elsewhere: bool = False) -> None:
        """Close the open prompt, if any; ``elsewhere`` means that another element is selected."""
        if self.prompt is not None:
            closing = self.prompt
            self.prompt = None
            had_focus = closing.isAncestorOf(self.focusWidget())
            remove_widget(closing)
            if had_focus:  # else Qt moves the focus to the rail
                self.parts.focus_element() if elsewhere else self.parts.return_keyboard()

    def flush(self) -> None:
        self.form.flush()
        self.file.editor.flush()

    def ask(self, task: Task, *arguments: Any) -> None:
        """Request a task that is not a step of the study."""
        self.asked.emit(Do(task, arguments))

    def finish(self, task: Task, *arguments: Any) -> None:
        """Submit the typed text, then request a task; its paths have the element's resulting ID."""
        self.asked.emit(self._with_typed_id(Do(task, arguments)))

    def _with_typed_id(self, request: Any) -> Any:
        """Submit the typed text, and return a path or request with the element's resulting ID."""
        before = () if self.form.form is None else self.form.form.path
        self.flush()
        after = () if self.form.form is None else self.form.form.path
        return request if before == after else with_path(request, before, after)

    def _leave_entries(self) -> None:
        """Request to finish the entries that do not contain the focused row."""
        focused = self.window().focusWidget()
        if self.form.isAncestorOf(focused):
            self.ask("leave entries", self.form_path, self.form.row_path_of(focused))
        elif self.pane.isAncestorOf(focused) or self.problems.isAncestorOf(focused):
            self.ask("leave entries")

    def begin_new(self) -> None:
        if not self.stack.currentIndex():
            self.finish("new")

    def leave_for_home(self) -> None:
        self.flush()
        self.go_asked.emit("home")

    def ask_to_add(self) -> None:
        if self.view.form is not None and self.outline.add.isEnabled() and not self.stack.currentIndex():
            self.finish("add")

    def show_addable(self, additions: tuple[Addable, ...]) -> None:
        button = self.outline.add if self.outline.add.isVisible() else self.header
        self.adding.open(additions, button.mapToGlobal(button.rect().topLeft()))

    def _handle_request(self, request: object) -> None:
        """Submit the typed text, then forward a request, or carry it out if it only moves the focus."""
        if not (isinstance(request, SetText | LeaveText) or (isinstance(request, SetValue) and request.typing)):
            request = self._with_typed_id(request)
        match request:
            case Do("write", (path,)):
                self.ask("select", path)
                self.parts.focus_field((*path, "text"))
            case GoTo(element, field):
                self.ask("select", element)
                self.parts.focus_field(field)
            case _:
                self.asked.emit(request)

    def show_step(self, step: Step) -> None:
        """Announce a step, including how to undo a deletion, and focus the first text of a new element."""
        sentence = f"Deleted {step.removed}. {keys_of('undo')[0]} restores it." if step.removed else step.announcement
        if sentence:
            announce(self, sentence)
        in_outline = not self.parts.drawer and self.outline.isAncestorOf(self.focusWidget())
        if step.fresh:
            self.outline.search_field.clear()  # a search would hide the new element
        if step.fresh and not (
            step.fresh == "copy" and in_outline
        ):  # a copy made in the visible outline leaves the focus there
            self.parts.show_side("form")
            self.form.focus_first_text(filled=step.fresh == "copy")  # a copy has its texts
        if sentence and (step.removed or step.entry):
            self.form.show_note(sentence)

    def open_next_problem(self) -> None:
        """Open the next problem and focus its field, or its repair if there is no field to focus."""
        if self.view.form is not None:
            self.flush()
            self.ask("leave entries")
        if not (next_rows := self.problems.rows_after_current):
            return
        row = next_rows[0]
        self.problems.open_problem(row)
        self.finish("repairs", row)
        field = self.window().focusWidget()
        repairs = self.form.repairs_of(row) or self.problems.repairs_of(row)
        if repairs and (field is None or not field.focusPolicy() & Qt.FocusPolicy.TabFocus):
            repairs[0].setFocus(Qt.FocusReason.ShortcutFocusReason)
        for button in repairs[:1]:
            for area in (self.form.area, self.problems.area):
                if area.isAncestorOf(button):
                    area.ensureWidgetVisible(button, 0, 8)  # its field stays visible

    def _open_problem(self, row: ProblemRow) -> None:
        self.problems.show()
        if row.element:
            self.finish("select", row.element)
        in_form = bool(row.element) and self.parts.focus_row(row.fault.path)
        if row.line is not None and not in_form and not row.warning:
            self.parts.show_tab("file")
        if row.line is not None:
            self.file.editor.go_to(row.line - 1)

    def _ask_to_repair(self, row: ProblemRow, sentence: str) -> None:
        """Request a repair, and focus its field when the problem is solved."""
        self.problems.set_current(row)
        self.finish("repair", row, sentence)
        if row not in self.problems.problems:
            self.parts.focus_field(row.fault.path)

    def rename(self) -> None:
        if self.form.head.id.isVisible() and not self.view.header.read_only:
            self.form.head.edit_id()

    def show_tab(self, name: str) -> None:
        self.parts.show_tab(name)

    def enter(self) -> None:
        self.entered.emit()

    def leave(self) -> None:
        self.left.emit()

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Let Tab follow the reading order of visible parts and then wrap around; Shift+Tab reverses the order."""
        self.flush()
        QApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)  # lays out new parts
        stops, focused = list(focus_stops(self)), self.window().focusWidget()
        if focused not in stops:
            if not (forward and stops and focused is not None and focused.isAncestorOf(self.stack)):  # the page itself
                return super().focusNextPrevChild(forward)
            index = -1
        else:
            index = stops.index(focused)
        if not forward and index == 0:
            return super().focusNextPrevChild(forward)
        reason = Qt.FocusReason.TabFocusReason if forward else Qt.FocusReason.BacktabFocusReason
        target = (
            stops[index + (1 if forward else -1)]
            if index + 1 < len(stops) or not forward
            else next(focus_stops(self.window()))
        )
        target.setFocus(reason)
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape or not self.banner.close_by_key():
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.parts.arrange(self.width())
