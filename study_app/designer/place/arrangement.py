"""How outline, form, right pane with its tabs, and problems are arranged at each width."""

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import QRect, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QSizePolicy, QStackedWidget, QWidget

from study_app.designer.form.card import FormCard
from study_app.designer.form.rows import Form
from study_app.designer.measures.measures_page import FactsRow
from study_app.designer.outline.card import OutlineCard
from study_app.designer.place.segments import Segments
from study_app.designer.problems.card import ProblemsCard
from study_app.gui.kit.commands import key_cap, tip
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import apply_theme_within, remove_widget
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, SHADOW, Icon
from study_app.gui.widgets.controls import ActionButton, PressedByEnter

FACTS_FROM, FACTS_FROM_OWN, FACTS_LEAST = 740, 560, 110
"""The height of the window and of the pane from which there is room for facts, and what they need themselves [px]."""
ASIDE_GAP = 24


@dataclass(frozen=True)
class PanePage:
    """A page of the pane."""

    # name of the tab, and what it says
    name: str
    words: str
    body: QWidget  # what the tab shows; its focus proxy takes the keyboard
    aside: QWidget | None = None  # controls at the right of the tabs, while the page is shown
    with_facts: bool = True  # whether the facts stay below the page
    fit_aside: Callable[[int], None] = lambda _room_px: None  # fits the controls into so much room beside the tabs [px]
    # returns how high the body is at most; the facts take the rest [px]
    most_px: Callable[[], int] = lambda: QWIDGETSIZE_MAX
    tip: str = ""  # the tip of its tab


class RightPane(QWidget):
    """Tabs, the page of the chosen one, and the facts; ``tab_shown`` carries the name of a tab when it is shown."""

    tab_shown = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Views of the study")
        self.pages: list[PanePage] = []
        self.tab = ""
        self.tabs = Segments("View of the study")
        self.facts = FactsRow()
        self._asides, self._below = hbox(), hbox(STRETCH, margins=(SHADOW, 0, SHADOW, 0))
        bar = hbox(self.tabs, STRETCH, self._asides, margins=(SHADOW, 0, SHADOW, 0))
        self._stack = QStackedWidget()
        parts = (bar, self._below, (self._stack, 1), self.facts, STRETCH)
        self._column = vbox(*parts, spacing=12 - 2 * SHADOW, margins=0, parent=self)
        self.tabs.chosen.connect(lambda name: self.show_tab(str(name)))

    def add_page(self, page: PanePage, *, first: bool = False) -> None:
        """Add a page as the last tab, or as the first one, which is then shown."""
        self.pages.insert(0 if first else len(self.pages), page)
        self._stack.addWidget(page.body)
        if page.aside is not None:
            self._asides.addWidget(page.aside)
        self.show_tab(page.name if first else self.tab or page.name)

    def show_tab(self, name: str) -> None:
        page = next(one for one in self.pages if one.name == name)
        changed, self.tab = name != self.tab, name
        self.tabs.tips = {one.name: one.tip for one in self.pages}
        self.tabs.show_values([(one.name, one.words) for one in self.pages], name)
        self._stack.setCurrentWidget(page.body)
        for one in self.pages:
            if one.aside is not None:
                one.aside.setVisible(one is page)
        self.make_room()
        if changed:
            self.tab_shown.emit(name)

    def _place_aside(self) -> None:
        """Put the controls of the page at the right of the tabs, or below them where there is no room."""
        page = next((one for one in self.pages if one.name == self.tab), None)
        if page is not None and page.aside is not None:
            room = self.width() - 2 * SHADOW - self.tabs.sizeHint().width() - ASIDE_GAP
            page.fit_aside(room)
            row = self._asides if page.aside.sizeHint().width() <= room else self._below
            if row.indexOf(page.aside) < 0:
                row.addWidget(page.aside)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.make_room()

    def make_room(self) -> None:
        """Place the controls; hide the facts where the window is too low for them, or the page takes their place."""
        self._place_aside()
        page = next((one for one in self.pages if one.name == self.tab), None)
        height = self.window().height()
        room = not self.isVisible() or self.height() >= FACTS_FROM_OWN
        facts = page is not None and page.with_facts and height >= FACTS_FROM and room
        most = QWIDGETSIZE_MAX if page is None or not facts else page.most_px()
        left = self.height() - self._stack.y() - most - self._column.spacing()
        if most < QWIDGETSIZE_MAX and self.isVisible() and left < FACTS_LEAST:
            facts = False  # the page is shown as wide as the pane
        self._stack.setMaximumHeight(most if facts else QWIDGETSIZE_MAX)
        self.facts.make_room(height, left)
        self.facts.setVisible(facts)


OUTLINE_PX, DRAWER_PX = 284, 320
DRAWER_BELOW, ONE_PANE_BELOW = 1400, 1130
GAP = 14 - 2 * SHADOW
FORM_SHARE = 44
"""Percent of the width that the form takes beside the views."""


class Crumb(PressedByEnter):
    """A step of the path; its words end in "…" where its room is too small."""

    def __init__(self, words: str, least_px: int) -> None:
        super().__init__(words)
        self.whole, self._least_px = words, least_px
        self.setAccessibleName(words)
        self.setToolTip(words)
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


class PathBar(QWidget):
    """The way to the element of the form, where the outline is a drawer; ``open_asked`` carries a path."""

    outline_asked = Signal()
    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Path of the element")
        self.outline = ActionButton("layers", "Outline", cap=key_cap("outline"), height=40)
        self.outline.setProperty("dense", "true")
        self.outline.setAccessibleName(tip("outline"))
        self.outline.setToolTip(tip("outline"))
        self.outline.clicked.connect(self.outline_asked)
        self.steps: list[Crumb] = []
        self._parts: list[QWidget] = []
        self._shown: object = None
        self._steps = hbox(spacing=0)
        self.row = hbox(self.outline, self._steps, STRETCH, spacing=4, margins=0, parent=self)

    def show_form(self, form: Form) -> None:
        if form.around == self._shown:
            return
        self._shown = form.around
        for part in self._parts:
            remove_widget(part)
        self.steps, self._parts = [], []
        for path, title in form.around:
            sign = Icon("chevron", "text2", 14)
            made = Crumb(title, 56 if path == form.path else 104)
            made.clicked.connect(lambda _checked=False, path=path: self.open_asked.emit(path))
            for part in (sign, made):
                self._steps.addWidget(part)
                apply_theme_within(part, self.outline.theme)
            self.steps.append(made)
            self._parts += [sign, made]


class Arrangement(QWidget):
    """Places outline, form, pane and problems; ``used`` is that of the first three that had the keyboard last."""

    def __init__(self, outline: OutlineCard, form: FormCard, pane: RightPane, problems: ProblemsCard) -> None:
        super().__init__()
        self.outline, self.form, self.pane, self.problems = outline, form, pane, problems
        self.side = "form"
        self.used: QWidget = form
        self.drawer = False
        self._width = DRAWER_BELOW
        self.path = PathBar()
        self.path.outline_asked.connect(self.toggle_drawer)
        self.sides = Segments("Side")
        self.sides.tips = {"form": tip("form"), "pane": tip("views")}
        self.sides.chosen.connect(lambda side: self.show_side(str(side)))
        self.prompts = vbox()
        self._left = vbox((form, 1), spacing=12 - 2 * SHADOW)
        self._across = hbox((self._left, FORM_SHARE), (pane, 100 - FORM_SHARE), spacing=GAP)
        self.top = QWidget()
        hbox((self.path, 1), self.sides, margins=(SHADOW, 0, SHADOW, 0), parent=self.top)
        self._right = vbox(self.top, self.prompts, (self._across, 1), problems, spacing=12 - 2 * SHADOW)
        self._whole = hbox(outline, (self._right, 1), spacing=GAP, margins=0, parent=self)
        outline.setFixedWidth(OUTLINE_PX)
        application = QApplication.instance()
        assert isinstance(application, QApplication)  # noqa: S101 - a window has one
        application.focusChanged.connect(self._follow_focus)

    def show_side(self, side: str) -> None:
        self.side = side
        self.arrange(self._width)

    def arrange(self, width: int) -> None:
        """Place the parts for so wide a place."""
        self._width = width
        one, drawer = width < ONE_PANE_BELOW, width < DRAWER_BELOW
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
        (self._right if one else self._left).insertWidget(0, self.top)
        self.sides.setVisible(one)
        self.sides.show_values((("form", "Form"), ("pane", "Views")), self.side)
        self.form.setVisible(not one or self.side == "form")
        self._across.setStretch(0, FORM_SHARE if self.form.isVisibleTo(self) else 0)  # an empty layout would take room
        self.pane.setVisible(not one or self.side == "pane")
        self.pane.make_room()

    def focus_outline(self) -> None:
        """Give the keyboard to the outline; a drawer opens."""
        if self.drawer:
            self._place_drawer()
            self.outline.show()
            self.outline.raise_()
        self.outline.tree.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def focus_find(self) -> None:
        """Give the keyboard to the field that finds; a drawer opens."""
        self.focus_outline()
        self.outline.words.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def toggle_drawer(self) -> None:
        if self.outline.isVisible():
            self.close_drawer()
        else:
            self.focus_outline()

    def close_drawer(self) -> None:
        """Close the drawer, where there is one; the button that opens it takes the keyboard that it had."""
        if self.drawer and self.outline.isVisible():
            had = self.outline.isAncestorOf(self.window().focusWidget() or self)
            self._hide_drawer()
            if had:
                self.path.outline.setFocus(Qt.FocusReason.OtherFocusReason)

    def _follow_focus(self, _left: QWidget | None, now: QWidget | None) -> None:
        """Note which part has the keyboard; close the drawer when another part of the place takes it."""
        parts = (self.outline, self.form, self.pane)
        self.used = next((part for part in parts if now is not None and part.isAncestorOf(now)), self.used)
        if self.drawer and now is not None and self.isAncestorOf(now) and not self.outline.isAncestorOf(now):
            self._hide_drawer()

    def _hide_drawer(self) -> None:
        """Hide the drawer; it lists every element when it opens again."""
        self.outline.hide()
        self.outline.words.clear()

    def _place_drawer(self) -> None:
        self.outline.setGeometry(QRect(0, 46, DRAWER_PX, max(200, self.height() - 46)))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self.drawer:
            self._place_drawer()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.drawer and self.outline.isVisible() and event.key() == Qt.Key.Key_Escape:
            self.close_drawer()
        else:
            super().keyPressEvent(event)
