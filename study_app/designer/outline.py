"""The outline: the elements of a study as a tree with a search field, and the elements that can be added."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, TypeAlias

from PySide6.QtCore import (
    QEvent,
    QItemSelectionModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPoint,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QFrame,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeView,
    QWidget,
)

from study_app.designer.document.elements import (
    FIRST,
    LABEL,
    SEQUENCE,
    Element,
    FoundField,
    first_match_by_element,
    has_text,
    outline,
    search_words,
    short_note,
    title_of,
)
from study_app.designer.document.fields import EXCLUSIONS, distinguishing_key, element_noun, label_of, node_at, rows
from study_app.designer.document.steps import AddElement, AddInstrument, AddLiquid, shipped_liquids_to_add
from study_app.designer.document.study import Study
from study_app.designer.parts import make_dense
from study_app.gui.kit import command_tip, key_cap, keys_of, with_key
from study_app.gui.theme import RADIUS_CONTROL, Coloured, Theme, Themed, draw_icon, font, icon
from study_app.gui.widgets import (
    ActionButton,
    Card,
    Elided,
    add_parts,
    announce,
    fill_rounded,
    hbox,
    label,
    plain_tip,
    vbox,
)
from study_app.number_text import counted, duration
from study_app.protocol.checks import SEQUENCE_KEYS
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.questions import STATEMENT
from study_app.protocol.source import Path, names, value_at
from study_app.protocol.wording import language_name, languages_of

_ICONS: Final = {
    "pages": "file", "blocks": "layers", "tasks": "route", "questionnaires": "list", "liquids": "drop",
    "conditions": "columns", "scales": "scale", "stimuli": "pulse", "designs": "columns", "methods": "bars",
    "sequence": "bars", "sequences": "bars", "groups": "people", "study": "file", "device": "device", "scene": "drop",
    "limits": "check", "analysis": "bars", "simulated_participants": "people",
}  # fmt: skip
"""The icon of each section; a section that is not listed has a ring."""
_PAGES: Final[Mapping[Any, str]] = {"consent": "pen", "break": "pause", "debrief": "flag"}
"""The icon of a kind of page, if it is not that of other pages."""
_SECTIONS: Final = ("Session, in order", "Elements", "Settings")
"""The headings; the study itself, with its title, description and languages, is above the first one."""
SESSION, PARTS, SETTINGS = _SECTIONS
_QUESTIONNAIRES: Final = "questionnaires"
_FORCE_LIMIT: Final = ("device", "force_limit_n")

ElementPath: TypeAlias = Path
"""The path of an element, as signals carry it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutlineRow:
    """One row of the outline."""

    path: Path  # () for the heading of a section
    title: str
    icon: str = ""
    note: str = ""  # the text at its right: a duration, a count, or its `short_note`
    depth: int = 0  # level below the heading of its section
    faults: int = 0  # number of faults in it
    name: str = ""  # the text for screen readers
    step: Path = ()  # its entry in the list that orders it; () if it cannot be moved
    field: Path = ()  # the matching field; () without a search
    named: bool = False  # whether its title or id matches the search


def outline_rows(
    study: Study, times_s: Mapping[str, float], search_text: str = "", *, session_s: float | None = None
) -> tuple[OutlineRow, ...]:
    """Return the outline of a study; with a search text, only the matching elements.

    ``times_s`` are the durations of steps [s] by ID, empty while the study has faults, and ``session_s`` is that of the
    session. An element matches if its title, ID or texts, or the labels or choices of its fields contain the text.
    """
    if study.is_unreadable:
        only = Element(FIRST, title_of({}, FIRST), FIRST[0], faults=len(study.faults))
        return (_outline_row(study, only, {}, in_session=False),)
    shown, document, text = outline(study), study.document, search_text.strip()
    fields = first_match_by_element(study, text)
    rows: list[OutlineRow] = []
    titles = _distinct_titles((*shown.parts, *shown.session, *shown.study))
    settings = [element for element in shown.study if element.path != FIRST]
    study_row = [element for element in shown.study if element.path == FIRST]
    for heading, elements in (("", study_row), (SESSION, shown.session), (PARTS, shown.parts), (SETTINGS, settings)):
        titled = [replace(element, title=titles[element.path]) for element in elements]
        rows_of_section = [_outline_row(study, element, times_s, in_session=heading == SESSION) for element in titled]
        if text:
            section_paths = {row.path for row in rows_of_section if heading == PARTS and len(row.path) == 1}
            rows_of_section = [
                row
                for row in rows_of_section
                if row.path not in section_paths or has_text(document, row.path, text, titles_only=True)
            ]
            rows_of_section = [
                matching
                for row in rows_of_section
                if (matching := _matching_row(study, row, text, fields.get(row.path))) is not None
            ]
        total = "" if session_s is None or heading != SESSION else duration(session_s)
        if rows_of_section:
            rows += [
                *([OutlineRow(path=(), title=heading, note=total, name=heading)] if heading else []),
                *rows_of_section,
            ]
    return tuple(rows)


def _distinct_titles(elements: Sequence[Element]) -> dict[Path, str]:
    """Return the title of each element, followed by its ID if an earlier element has the same title."""
    first: dict[tuple[Path, str], Path] = {}
    for element in elements:
        first.setdefault((element.path[:-1], element.title), element.path)
    is_first = {element.path: first[element.path[:-1], element.title] == element.path for element in elements}
    return {
        element.path: element.title if is_first[element.path] else f"{element.title} ({element.id})"
        for element in elements
    }


def _matching_row(study: Study, row: OutlineRow, text: str, field: FoundField | None) -> OutlineRow | None:
    """Return a matching row with the label of its matching field; None if the element does not match."""
    named = has_text(study.document, row.path, text, titles_only=True)
    if field is not None and (field.rank == LABEL or not named):
        title, name = f"{row.title} · {field.label}", f"{row.name}, field {field.label}"
        return replace(row, title=title, name=name, field=field.field, named=named)
    return replace(row, named=named) if named or has_text(study.document, row.path, text) else None


def icon_of(path: Path, document: Mapping[str, Any]) -> str:
    """Return the icon of an element."""
    if len(path) == 2 and path[0] == "pages":
        value = value_at(document, path)
        return _PAGES.get(str(value.get("kind")), _ICONS["pages"]) if isinstance(value, Mapping) else _ICONS["pages"]
    return "list" if "items" in path else _ICONS.get(str(path[0]), "ring") if path else "ring"


def _outline_row(study: Study, element: Element, times_s: Mapping[str, float], *, in_session: bool) -> OutlineRow:
    path, note, kind = element.path, "", str(element.path[0])
    if in_session and len(path) == 1:
        listed = value_at(study.document, path)
        note = counted(len(listed), "step" if path == SEQUENCE else "session") if isinstance(listed, tuple) else ""
    elif in_session and element.depth == 0:
        note = duration(times_s[element.id]) if element.id in times_s else ""
    elif in_session:
        note = short_note(study.document, path)
    elif element.depth == 0 and kind in _TABLE_SECTIONS:
        count = len(names(study.document, kind))
        note = str(count) if count else "none"
    elif path == FIRST:
        note = " ".join(languages_of(study.document)).upper()
    elif path == ("device",) and isinstance(limit := value_at(study.document, _FORCE_LIMIT), int | float):
        note = f"{limit:g} N"
    faults = counted(element.faults, "problem") if element.faults else ""
    noun = element_noun(kind) if len(path) == 2 else "question" if "items" in path else ""
    position = ""
    if element.step and isinstance(element.step[-1], int):
        count = len(value_at(study.document, element.step[:-1]))
        position = f"{'question' if 'items' in path else 'step'} {element.step[-1] + 1} of {count}"
        noun = "" if "items" in path else noun
    name = ", ".join(filter(None, (element.title, noun, note, position, faults)))
    title, step = element.title, element.step
    return OutlineRow(
        path=path,
        title=title,
        icon=icon_of(path, study.document),
        note=note,
        depth=element.depth + 1,
        faults=element.faults,
        name=name,
        step=step,
    )


_TABLE_SECTIONS: Final = frozenset(_ICONS) - {
    *SEQUENCE_KEYS, "study", "device", "scene", "limits", "analysis", "simulated_participants"
}  # fmt: skip


_SECTION_HELP: Final = {
    "designs": "2IFC and other trial designs",
    "groups": "Groups of participants. A study has at least two, so the first one comes with a second one.",
    "liquids": "A new liquid; you enter its values. To copy a shipped liquid, such as water or slime, type its name.",
}
"""The help texts of sections whose names need an explanation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Addable:
    """An entry of the list of additions: label, icon, request, and a line of help."""

    label: str
    icon: str
    asks: AddElement | AddInstrument | AddLiquid
    help: str = ""


_EXCLUSION: Final = Addable(
    label="Exclusion rule",
    icon="bars",
    asks=AddElement(EXCLUSIONS),
    help="Proposes to exclude sessions with constant or fast answers, answers below chance, or thresholds beyond the "
    "levels. Catch trials exclude sessions by a separate rule: add them to a block with levels.",
)


def addable_elements(study: Study, selected: Path) -> tuple[Addable, ...]:
    """Return the possible additions: to lists of the selected element, to its section, then to other sections.

    Shipped liquids come right after a new liquid if a liquid is selected, otherwise after the sections.
    """
    document = study.document
    element = selected[:2] if len(selected) > 1 else ()
    list_paths = [row.path for row in rows(document, element) if row.kind == "list"] if element else []
    sections = [row.path for row in rows(document, ()) if row.kind == "tables"]
    sections.sort(key=lambda path: path[:1] != selected[:1])
    entries = [_addable_entry(study, path) for path in list_paths]
    entries += [
        Addable(
            label="Two groups" if path == ("groups",) and path[0] not in document else label_of(element_noun(path[0])),
            icon=icon_of(path, study.document),
            asks=AddElement(path),
            help=_SECTION_HELP.get(str(path[0]), ""),
        )
        for path in sections
    ]
    entries += _addable_questions(study, element) if not any(path[0] == _QUESTIONNAIRES for path in list_paths) else ()
    entries.append(_EXCLUSION)
    first = 1 if selected[:1] == ("liquids",) else len(entries)
    return (*entries[:first], *_addable_liquids(study), *entries[first:], *_addable_instruments(languages_of(document)))


def _addable_liquids(study: Study) -> tuple[Addable, ...]:
    """Return the liquids of the shipped studies."""
    icon_name, requests = icon_of(("liquids", ""), {}), shipped_liquids_to_add(study)
    return tuple(
        Addable(label=request.label, icon=icon_name, asks=request, help=request.help(study)) for request in requests
    )


def _addable_questions(study: Study, element: Path) -> Iterator[Addable]:
    """Yield an added question for each questionnaire that permits it, or only for that of the element ``element``.

    If there are several, the label contains the title of the questionnaire.
    """
    own_name = value_at(study.document, (*element, "questionnaire")) if element else None
    tables = names(study.document, _QUESTIONNAIRES)
    editable_names = [
        name for name in tables if value_at(study.document, (_QUESTIONNAIRES, name, "instrument")) is None
    ]
    for name in (own_name,) if own_name in editable_names else editable_names:
        addition = _addable_entry(study, (_QUESTIONNAIRES, str(name), "items"))
        title = title_of(study.document, (_QUESTIONNAIRES, str(name)))
        yield addition if len(editable_names) == 1 else replace(addition, label=f"{addition.label} of {title}")


@cache
def _addable_instruments(languages: tuple[str, ...]) -> tuple[Addable, ...]:
    """Return the standard questionnaires, with source, licence, and missing languages of their texts."""
    entries = []
    for name in Instrument.names():
        instrument = Instrument(name).table
        missing_languages = " or ".join(
            language_name(code) for code in languages if code not in instrument["languages"]
        )
        texts = (
            f". The program does not include its {missing_languages} texts, so you must write them"
            if missing_languages
            else ""
        )
        help_ = f"{instrument['source']}. Licence: {instrument['licence']}{texts}"
        title = f"Instrument: {name.upper()}, {len(instrument['items'])} questions"
        entries.append(Addable(label=title, icon="list", asks=AddInstrument(name), help=help_))
    return tuple(entries)


def _addable_entry(study: Study, path: Path) -> Addable:
    """Return the addition to a list; its help contains each kind of entry, so that a search finds it."""
    tables = distinguishing_key(node_at(study.document, (*path, 0)))[1]
    kinds = ", ".join(label_of(kind or STATEMENT).lower() for kind in tables)
    target = f"To {title_of(study.document, path[:2])}{kinds and f'; kinds: {kinds}'}"
    return Addable(
        label=label_of(element_noun(path[-1])), icon=icon_of(path, study.document), asks=AddElement(path), help=target
    )


WIDTH, BESIDE_PX, MAX_LIST_PX, ADD_ROW_PX, HELP_PX = 360, 84, 520, 34, 78
"""Minimum width of the list, width of an entry without its text, maximum height, and heights of parts [px]."""
_ARROW_KEYS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class AddList(Themed, QFrame):
    """A popup list of additions with a filter; ``chosen`` carries an `Addable`."""

    chosen = Signal(object)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAccessibleName("Add")
        self.setProperty("role", "card")
        self._additions: tuple[Addable, ...] = ()
        self.filter_field = make_dense(QLineEdit(), "Filter the elements that can be added", 36)
        self.filter_field.setPlaceholderText("Type to filter")
        self.list = QListWidget()
        self.list.setAccessibleName("Elements that can be added")
        self.list.setProperty("role", "links")
        self.list.setFont(font("label"))
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setIconSize(QSize(18, 18))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.help = label("", "small", "text2", wraps=True)
        self.help.setMinimumHeight(HELP_PX)
        self.help.setAlignment(Qt.AlignmentFlag.AlignTop)
        vbox(self.filter_field, (self.list, 1), self.help, spacing=8, margins=10, parent=self)
        self.filter_field.textChanged.connect(self._filter)
        self.filter_field.installEventFilter(self)
        self.list.currentItemChanged.connect(lambda item: self.help.setText(item.toolTip() if item else ""))
        self.list.itemClicked.connect(lambda _item: self._choose())
        self.list.itemActivated.connect(lambda _item: self._choose())

    def open(self, additions: tuple[Addable, ...], above: QPoint) -> None:
        """Show the additions, with the lower left corner of the list at a screen position."""
        self._additions = additions
        self.filter_field.clear()
        self._filter("")
        height = min(MAX_LIST_PX, 82 + HELP_PX + ADD_ROW_PX * len(additions))
        screen = self.screen().availableGeometry()
        label_widths = (self.list.fontMetrics().horizontalAdvance(entry.label) for entry in additions)
        width = max(WIDTH, max(label_widths, default=0) + BESIDE_PX)
        position = QPoint(min(above.x(), screen.right() - width), max(screen.top(), above.y() - height))
        self.setGeometry(position.x(), position.y(), width, height)
        self.show()
        self.filter_field.setFocus(Qt.FocusReason.PopupFocusReason)

    def _filter(self, text: str) -> None:
        words = search_words(text)
        self.list.clear()
        fitting = [
            entry
            for entry in self._additions
            if all(part in f"{entry.label} {entry.help}".casefold() for part in words)
        ]
        typed = text.casefold().strip()
        fitting.sort(key=lambda entry: not entry.label.casefold().startswith(typed))
        for entry in fitting:
            item = QListWidgetItem(icon(entry.icon, self.theme.text2, 18), entry.label)
            item.setData(Qt.ItemDataRole.UserRole, entry)
            item.setToolTip(plain_tip(entry.help))
            item.setData(Qt.ItemDataRole.AccessibleDescriptionRole, entry.help)
            item.setSizeHint(QSize(0, ADD_ROW_PX))
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        if not self.list.count():
            find = keys_of("find")[0]
            self.help.setText(f"No element with this name can be added. Press {find} to find an element in the study.")

    def _choose(self) -> None:
        if (item := self.list.currentItem()) is not None:
            self.close()
            self.chosen.emit(item.data(Qt.ItemDataRole.UserRole))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            if event.key() in _ARROW_KEYS:
                self.list.keyPressEvent(event)
                return True
            if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
                self._choose()
                return True
        return super().eventFilter(watched, event)


ROW_PX, HEADING_PX = 32, 38
_INDENT = 20
"""The indentation per level, which leaves room for the grip of a row [px]."""
ROW_ROLE = Qt.ItemDataRole.UserRole + 1
_Index = QModelIndex | QPersistentModelIndex


class _RowPainter(QStyledItemDelegate):
    """Paints the rows of a tree in its theme; ``movable`` is whether rows can be dragged."""

    def __init__(self, tree: "Tree") -> None:
        super().__init__(tree)
        self.tree = tree
        self.movable = True

    @property
    def theme(self) -> Theme:
        return self.tree.theme

    def sizeHint(self, option: QStyleOptionViewItem, index: _Index) -> QSize:
        return QSize(100, HEADING_PX if not index.data(ROW_ROLE).path else ROW_PX)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: _Index) -> None:
        """Paint the heading of a section, or an element with icon, title, time and faults."""
        row = index.data(ROW_ROLE)
        place = QRectF(option.rect)  # type: ignore[attr-defined]  # missing in the stubs
        place.setLeft(0)
        place.setRight(self.tree.viewport().width())
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if row.path:
            self._paint_element(painter, place, row, option.state, index)  # type: ignore[attr-defined]
        else:
            middle = Qt.AlignmentFlag.AlignVCenter
            painter.setPen(QColor(self.theme.text2))
            painter.setFont(font("label", weight=600, tabular=True))
            painter.drawText(place.adjusted(8, 6, -10, 0), middle, row.title)
            painter.drawText(place.adjusted(8, 6, -10, 0), middle | Qt.AlignmentFlag.AlignRight, row.note)
        painter.restore()

    def _paint_element(
        self, painter: QPainter, place: QRectF, row: OutlineRow, state: QStyle.StateFlag, index: _Index
    ) -> None:
        theme = self.theme
        assert theme is not None  # noqa: S101 - painted with a theme
        middle, right_px = Qt.AlignmentFlag.AlignVCenter, place.right() - 10
        is_selected = bool(state & QStyle.StateFlag.State_Selected)
        current = index == self.tree.currentIndex()
        is_hovered = bool(state & QStyle.StateFlag.State_MouseOver)
        if is_selected or is_hovered:
            fill_rounded(
                painter, place.adjusted(0, 1, 0, -1), RADIUS_CONTROL - 2, theme.selected if is_selected else theme.hover
            )
        if current and is_selected:
            painter.setBrush(QColor(theme.accent))
            painter.drawRoundedRect(QRectF(0, place.top() + 5, 3, place.height() - 10), 1.5, 1.5)
            if self.tree.hasFocus():
                painter.setPen(QPen(QColor(theme.accent), 2))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRoundedRect(place.adjusted(1, 2, -1, -2), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        x = _arrow_right_px(row) - _INDENT
        if row.step and self.movable and (is_selected or is_hovered):
            _paint_grip(painter, QRectF(x - 8, place.top(), 8, place.height()), theme.text2)
        if self.tree.model().hasChildren(index):
            chevron = "chevron_down" if self.tree.isExpanded(index) else "chevron"
            draw_icon(painter, chevron, QRectF(x + 2, place.center().y() - 7, 14, 14), theme.text2, 2.0)
        colour = theme.accent if is_selected else theme.text if row.depth == 1 else theme.text2
        draw_icon(painter, row.icon, QRectF(x + 20, place.center().y() - 9, 18, 18), colour, 1.9)
        painter.setFont(font("label", weight=600, tabular=True))
        if row.faults:
            badge = QRectF(right_px - 22, place.center().y() - 10, 22, 20)
            fill_rounded(painter, badge, 10, theme.bad_bg)
            painter.setPen(QColor(theme.bad))
            painter.drawText(badge, Qt.AlignmentFlag.AlignCenter, str(row.faults))
            right_px = badge.left() - 6
        if row.note:
            painter.setFont(font("label", weight=400, tabular=True))
            painter.setPen(QColor(theme.text2))
            width = painter.fontMetrics().horizontalAdvance(row.note) + 2
            painter.drawText(QRectF(right_px - width, place.top(), width, place.height()), middle, row.note)
            right_px -= width + 8
        painter.setFont(font("label", weight=600 if is_selected else 500))
        painter.setPen(QColor(colour))
        room = QRectF(x + 46, place.top(), right_px - x - 46, place.height())
        title = painter.fontMetrics().elidedText(row.title, Qt.TextElideMode.ElideRight, int(room.width()))
        painter.drawText(room, middle, title)


def _arrow_right_px(row: OutlineRow) -> float:
    """Return the right edge of the arrow that expands or collapses a row [px]."""
    return 12.0 + _INDENT * row.depth


def _paint_grip(painter: QPainter, place: QRectF, ink: str) -> None:
    """Paint the six dots of a drag handle."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(ink))
    middle = place.center()
    for across in (-2.2, 2.2):
        for down in (-4.6, 0.0, 4.6):
            painter.drawEllipse(QRectF(middle.x() + across - 1.1, middle.y() + down - 1.1, 2.2, 2.2))


_LINE_PX = 2.0
_EDGE_PX = 24


class Tree(Themed, QTreeView):
    """The rows of the outline.

    Signals: ``entered_row`` (Enter was pressed), ``dropped`` (path of an entry, and that of the entry before which it
    was dropped). Its context menu shows its actions.
    """

    entered_row = Signal()
    dropped = Signal(object, object)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Study outline")
        self.setHeaderHidden(True)
        self.setIndentation(0)
        self.setRootIsDecorated(False)
        self.setExpandsOnDoubleClick(False)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setMouseTracking(True)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
        self.rows = _RowPainter(self)
        self.setItemDelegate(self.rows)
        self.setStyleSheet("QTreeView { background: transparent; border: none; outline: none; }")
        self.dragged: ElementPath = ()
        self.target: tuple[ElementPath, float] | None = None
        self.arrow_pressed = False
        self._pressed: tuple[QPoint, ElementPath] | None = None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.dragged and event.key() == Qt.Key.Key_Escape:
            self._end_drag()
        elif event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            self.entered_row.emit()
        else:
            super().keyPressEvent(event)

    # dragging

    def mousePressEvent(self, event: QMouseEvent) -> None:
        index = self.indexAt(event.position().toPoint())
        row = index.data(ROW_ROLE) if index.isValid() else None
        self._pressed = None
        on_arrow = row is not None and self.model().hasChildren(index) and event.position().x() < _arrow_right_px(row)
        self.arrow_pressed = on_arrow
        is_plain_click = event.button() == Qt.MouseButton.LeftButton and not event.modifiers()
        if is_plain_click and row is not None and row.step and self.rows.movable:
            self._pressed = (event.position().toPoint(), row.step)
        super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        position = event.position().toPoint()
        if self._pressed is None or not event.buttons() & Qt.MouseButton.LeftButton:
            super().mouseMoveEvent(event)
            return
        start, entry = self._pressed
        if not self.dragged and (position - start).manhattanLength() >= QApplication.startDragDistance():
            self.dragged = entry
            self.viewport().setCursor(Qt.CursorShape.ClosedHandCursor)
        if self.dragged:
            bar, height = self.verticalScrollBar(), self.viewport().height()
            if position.y() < _EDGE_PX or position.y() > height - _EDGE_PX:
                bar.setValue(bar.value() + (-12 if position.y() < _EDGE_PX else 12))
            self.target = self._drop_target(position)
            self.viewport().update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        dragged, target = self.dragged, self.target
        self._end_drag()
        if not dragged:
            super().mouseReleaseEvent(event)
        elif target is not None:
            self.dropped.emit(dragged, target[0])

    def _end_drag(self) -> None:
        self.dragged, self.target, self._pressed = (), None, None
        self.viewport().unsetCursor()
        self.viewport().update()

    def _drop_target(self, position: QPoint) -> tuple[ElementPath, float] | None:
        """Return the path of the entry after the drop line, and the vertical position of that line [px]."""
        array = self.dragged[:-1]
        places: list[tuple[ElementPath, float]] = []
        end: tuple[ElementPath, float] | None = None
        index = self.model().index(0, 0)
        while index.isValid():
            row, box = index.data(ROW_ROLE), QRectF(self.visualRect(index))
            if row.step and row.step[:-1] == array:
                places.append((row.step, box.top()))
                end = (*array, int(row.step[-1]) + 1), box.bottom()
            elif end is not None and row.path and self._is_below_entry(index, array):
                end = end[0], box.bottom()
            index = self.indexBelow(index)
        return min((*places, *([end] if end else ())), key=lambda array: abs(array[1] - position.y()), default=None)

    def _is_below_entry(self, index: QModelIndex, array: ElementPath) -> bool:
        """Return whether a row is inside an entry of a list."""
        above = index.parent()
        while above.isValid():
            row = above.data(ROW_ROLE)
            if row.step and row.step[:-1] == array:
                return True
            above = above.parent()
        return False

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.target is not None:
            painter = QPainter(self.viewport())
            y = min(max(self.target[1], 1.0), self.viewport().height() - 1.0)
            place = QRectF(6, y - _LINE_PX / 2, self.viewport().width() - 12, _LINE_PX)
            painter.fillRect(place, QColor(self.theme.accent))


class OutlineCard(Coloured, Card):
    """The outline with its search field.

    Signals: ``chosen`` (path), ``element_clicked``, ``form_asked`` (Enter was pressed), and instead of these two,
    ``field_asked`` if a field matches the search (its path).
    """

    chosen = Signal(object)
    element_clicked = Signal()
    form_asked = Signal()
    field_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__(padding=12, gap=8)
        self.setAccessibleName("Outline")
        self.rows: tuple[OutlineRow, ...] = ()
        self._expanded: set[object] = set()
        self._filling = self._is_searching = False
        self.search_field = make_dense(QLineEdit(), "Find in the study", 36)
        self.search_field.setPlaceholderText(command_tip("find"))
        self.search_field.setClearButtonEnabled(True)
        self._search_icon = self.search_field.addAction(
            icon("search", self.theme.text2, 16), QLineEdit.ActionPosition.LeadingPosition
        )
        self.nothing = Elided("label", "text2")
        self.nothing.hide()
        self.tree = Tree()
        self.items = QStandardItemModel(self.tree)
        self.tree.setModel(self.items)
        self.add = ActionButton("plus", "Add", cap=key_cap("add"), height=40)
        self.add.setAccessibleName(f"Add an element ({keys_of('add')[0]})")
        self.duplicate = ActionButton(
            "", "Duplicate", cap=key_cap("duplicate"), height=40
        )  # there is no room for an icon
        self.duplicate.setAccessibleName(with_key("Duplicate the selected element", "duplicate"))
        for button in (self.add, self.duplicate):
            button.setFont(font("label", weight=600))
        self.add.setMaximumWidth(self.add.minimumSizeHint().width())
        foot = hbox(self.add, (self.duplicate, 1), spacing=8)
        add_parts(self.column, self.search_field, self.nothing, (self.tree, 1), foot)
        self.search_field.returnPressed.connect(self._open_first_match)
        self.search_field.installEventFilter(self)
        self.tree.selectionModel().currentChanged.connect(self._choose)
        self.tree.clicked.connect(self._click)
        self.tree.expanded.connect(
            lambda index: None if self._is_searching else self._expanded.add(self._row_key(index))
        )
        self.tree.collapsed.connect(lambda index: self._expanded.discard(self._row_key(index)))
        self.tree.entered_row.connect(self._enter_row)

    def apply_theme(self, theme: Theme) -> None:
        self._search_icon.setIcon(icon("search", theme.text2, 16))

    def begin(self) -> None:
        """Reset the outline for another study: scrolled to the top, collapsed, without a search text."""
        self.rows, self._expanded = (), set()
        self._filling = True
        self.items.clear()
        self._filling = False
        self.search_field.clear()

    def show_outline(self, rows: tuple[OutlineRow, ...], selected: object) -> None:
        """Show rows; expanded branches stay expanded. If nothing matches the search, a line states this."""
        self._show_search_result(rows)
        if rows != self.rows:
            current = self.tree.currentIndex()
            before = current.data(ROW_ROLE).path if current.isValid() else None
            self.rows = rows
            self._filling = True
            scrolled = self.tree.verticalScrollBar().value()
            self.items.clear()
            above: list[QStandardItem] = [self.items.invisibleRootItem()]
            for row in rows:
                item = QStandardItem(row.title)
                item.setData(row, ROW_ROLE)
                item.setData(row.name, Qt.ItemDataRole.AccessibleTextRole)
                item.setToolTip(plain_tip(row.title))  # the title may be elided
                if not row.path:
                    item.setFlags(Qt.ItemFlag.NoItemFlags)  # so that the arrow keys skip it
                depth = max(row.depth - 1, 0)
                del above[depth + 1 :]
                above[-1].appendRow(item)
                above.append(item)
            self._is_searching = bool(self.search_field.text().strip())
            for index in self.indexes():
                if self._row_key(index) in self._expanded or self._is_searching:
                    self.tree.expand(index)
            self._is_searching = False
            self.tree.doItemsLayout()  # otherwise the scroll bar has no range yet
            self.tree.verticalScrollBar().setValue(scrolled)
            self._filling = False
            self.mark_row(selected, reveals=selected != before)
        self.mark_row(selected)

    def _show_search_result(self, rows: tuple[OutlineRow, ...]) -> None:
        text = self.search_field.text().strip()
        sentence = f'"{text}" was not found in this study' if text and not rows else ""
        if sentence and sentence != self.nothing.whole:
            announce(self.search_field, sentence)
        self.nothing.show_text(sentence)
        self.nothing.setVisible(bool(sentence))

    def mark_row(self, path: object, *, reveals: bool = True) -> None:
        """Select the row of an element; with ``reveals``, expand its branch and scroll to it."""
        current = self.tree.currentIndex()
        if current.isValid() and current.data(ROW_ROLE).path == path:
            return
        index = next((index for index in self.indexes() if index.data(ROW_ROLE).path == path), None)
        self._filling = True
        if index is None:
            self.tree.clearSelection()
            self.tree.setCurrentIndex(QModelIndex())
        else:
            if reveals and index.parent().isValid():
                self.tree.expand(index.parent())
            if reveals and "blocks" in path[:1]:  # type: ignore[index]  # a path
                self.tree.expand(index)
            scrolled = self.tree.verticalScrollBar().value()
            flags = QItemSelectionModel.SelectionFlag
            self.tree.selectionModel().setCurrentIndex(index, flags.ClearAndSelect)
            if reveals:
                self.tree.scrollTo(index)
            else:  # setCurrentIndex scrolled to it
                self.tree.verticalScrollBar().setValue(scrolled)
        self._filling = False

    def indexes(self) -> list[QModelIndex]:
        """Return the rows in order, including those of closed branches."""
        indexes: list[QModelIndex] = []
        waiting = [self.items.index(row, 0) for row in range(self.items.rowCount())]
        while waiting:
            index = waiting.pop(0)
            indexes.append(index)
            waiting[:0] = [self.items.index(row, 0, index) for row in range(self.items.rowCount(index))]
        return indexes

    def _row_key(self, index: _Index) -> object:
        row, parent = index.data(ROW_ROLE), index.parent()
        return row.path, row.depth, parent.data(ROW_ROLE).path if parent.isValid() else None

    def _choose(self, index: QModelIndex) -> None:
        if not self._filling and index.isValid() and index.data(ROW_ROLE).path:
            self.chosen.emit(index.data(ROW_ROLE).path)

    def _click(self, index: QModelIndex) -> None:
        """Expand or collapse the clicked branch, else go to the matching field."""
        is_heading = self.items.hasChildren(index) and len(index.data(ROW_ROLE).path) == 1
        if is_heading or self.tree.arrow_pressed:
            self.tree.setExpanded(index, not self.tree.isExpanded(index))
        else:
            self.tree.expand(index)
            if not self._open_field():
                self.element_clicked.emit()
            self.search_field.clear()

    def _enter_row(self) -> None:
        if not self._open_field():
            self.form_asked.emit()
        self.search_field.clear()

    def _open_field(self) -> bool:
        """Go to the matching field of the current row; return whether there is one."""
        current = self.tree.currentIndex()
        field: ElementPath = current.data(ROW_ROLE).field if current.isValid() else ()
        if field:
            self.field_asked.emit(field)
        return bool(field)

    def _select_first_match(self) -> bool:
        """Select the first element with a matching title, else with a matching field; return whether there is one."""
        rows = [(index, index.data(ROW_ROLE)) for index in self.indexes() if index.data(ROW_ROLE).path]
        with_title = [index for index, row in rows if row.named]
        with_field = [index for index, row in rows if row.field]
        first = next(iter((*with_title, *with_field, *(index for index, _ in rows))), None)
        if first is not None:
            self.tree.selectionModel().setCurrentIndex(first, QItemSelectionModel.SelectionFlag.ClearAndSelect)
        return first is not None

    def _open_first_match(self) -> None:
        """Select the first matching element, go to its field, and show the whole study again."""
        if self.search_field.text().strip() and self._select_first_match():
            if not self._open_field():
                self.tree.setFocus(Qt.FocusReason.OtherFocusReason)
            self.search_field.clear()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """End a search at Esc; without a search, the page handles the key."""
        if event.key() == Qt.Key.Key_Escape and self.search_field.text():
            self.search_field.clear()
        else:
            super().keyPressEvent(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        is_down = (
            event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Down
        )
        if is_down and (not self.search_field.text().strip() or self._select_first_match()):
            self.tree.setFocus(Qt.FocusReason.OtherFocusReason)
            return True
        return super().eventFilter(watched, event)
