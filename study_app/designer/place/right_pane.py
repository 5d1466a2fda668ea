"""The pane at the right of the designer: a page for each tab, and the facts below."""

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QStackedWidget, QWidget

from study_app.designer.measures.measure_cards import FactsRow
from study_app.designer.place.segments import Segments
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, SHADOW

FACTS_FROM, FACTS_FROM_OWN, FACTS_LEAST = 740, 560, 110
"""The height of the window and of the pane from which there is room for facts, and what they need themselves [px]."""
GAP = 24


@dataclass(frozen=True)
class PanePage:
    """A page of the pane.

    Attributes
    ----------
    name, words : str
        Name of the tab, and what it says.
    body : QWidget
        What the tab shows; its focus proxy takes the keyboard.
    aside : QWidget or None
        Controls at the right of the tabs, while the page is shown.
    with_facts : bool
        Whether the facts stay below the page.
    fit_aside : callable
        Fits the controls into so much room beside the tabs [px].
    most_px : callable
        Returns how high the body is at most; the facts take the rest [px].
    tip : str
        The tip of its tab.
    """

    name: str
    words: str
    body: QWidget
    aside: QWidget | None = None
    with_facts: bool = True
    fit_aside: Callable[[int], None] = lambda _room_px: None
    most_px: Callable[[], int] = lambda: QWIDGETSIZE_MAX
    tip: str = ""


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

    @property
    def in_order(self) -> list[QWidget]:
        """Its parts in the order in which Tab goes through them."""
        page = next(one for one in self.pages if one.name == self.tab)
        return [self.tabs, *([] if page.aside is None else [page.aside]), page.body, self.facts]

    def _place_aside(self) -> None:
        """Put the controls of the page at the right of the tabs, or below them where there is no room."""
        page = next((one for one in self.pages if one.name == self.tab), None)
        if page is not None and page.aside is not None:
            room = self.width() - 2 * SHADOW - self.tabs.sizeHint().width() - GAP
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
