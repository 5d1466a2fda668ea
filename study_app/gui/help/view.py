"""The page Help: the list of documentation pages, a search, and the current page."""

import posixpath
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, QSize, Qt, QUrl, Signal
from PySide6.QtGui import (
    QColor,
    QDesktopServices,
    QFont,
    QFontDatabase,
    QImage,
    QKeyEvent,
    QKeySequence,
    QResizeEvent,
    QShortcut,
    QTextBlock,
    QTextBlockFormat,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
    QTextFrameFormat,
    QTextLength,
    QTextTable,
)
from PySide6.QtWidgets import QFrame, QLineEdit, QListWidget, QListWidgetItem, QTextBrowser

from study_app import documentation
from study_app.documentation import anchor_of, plain
from study_app.gui.theme.theme import RADIUS_CONTROL, SHADOW, Theme, font
from study_app.gui.theme.themed import Coloured
from study_app.gui.widgets.accessible import plain_tip
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place

_FIRST_PAGE: Final = documentation.INDEX
_PAGES_OF_PLACES: Final = {
    "home": "first-session",
    "designer": "designer",
    "results": "answers-to-report",
    "lab": "lab",
    "devices": "devices",
    "machine": "this-machine",
}
"""The documentation page about each page of the main window."""

_COMMENT: Final = re.compile(r"<!--.*?-->\n*", re.DOTALL)
_HTML_IMAGE: Final = re.compile(r'<img src="([^"]+)"[^>]*alt="([^"]*)"[^>]*>')
_EMPTY_CELL: Final = re.compile(r"(?<=\|) *(?=\|)")


@dataclass(frozen=True, slots=True, kw_only=True)
class HelpEntry:
    """A row of the list of pages: its page, title and anchor, and whether it is the heading of a section."""

    page: str
    title: str
    is_heading: bool = False
    anchor: str = ""


@cache
def help_entries() -> tuple[HelpEntry, ...]:
    """Return the pages in the order of the sections, each page followed by its sections."""
    rows = [HelpEntry(page=_FIRST_PAGE, title="Start page", is_heading=True)]
    for section, pages in documentation.sections().items():
        rows.append(HelpEntry(page=section, title=plain(documentation.title(section)), is_heading=True))
        rows += [HelpEntry(page=page, title=plain(documentation.title(page))) for page in pages]
    return tuple(rows)


def matching_entries(text: str) -> tuple[HelpEntry, ...]:
    """Return the pages that contain a text, best match first, each at its best heading; all pages for an empty text."""
    if not text.strip():
        return help_entries()
    titles = {entry.page: entry.title for entry in help_entries()}
    return tuple(
        HelpEntry(
            page=section.page,
            title=titles[section.page],
            anchor="" if section.heading == titles[section.page] else anchor_of(section.heading),
        )
        for section in documentation.search(text)
    )


@cache
def page_markdown(page: str) -> str:
    """Return a page as Markdown that Qt can display, without comments, HTML images, empty cells and escaped bars."""
    text = _HTML_IMAGE.sub(r"![\2](\1)", _COMMENT.sub("", documentation.page(page)))
    return "\n".join(
        _EMPTY_CELL.sub("\N{NO-BREAK SPACE}", line).replace(r"\|", "\N{DIVIDES}") if line.startswith("|") else line
        for line in text.split("\n")
    )


_SUFFIX = ".md"
CELL_PADDING, MARGIN = 6, 28
_WIDEST_TEXT = 860  # px; longer lines are hard to read
_HEADING_SIZES = {1: 26, 2: 20, 3: 16, 4: 15}  # px
_CODE_SIZE = 14  # px
_PICTURE = "\N{OBJECT REPLACEMENT CHARACTER}"
CODE = (QTextFormat.Property.BlockCodeFence, QTextFormat.Property.BlockCodeLanguage)


def _heading_font(level: int) -> QFont:
    """Return the font of a heading; the highest level is 1."""
    heading_font = font("title" if level == 1 else "card")
    heading_font.setPixelSize(_HEADING_SIZES[min(level, 4)])
    return heading_font


def _code_font() -> QFont:
    code_font = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
    code_font.setPixelSize(_CODE_SIZE)
    return code_font


def _text_format(text_font: QFont) -> QTextCharFormat:
    text_format = QTextCharFormat()
    text_format.setFont(text_font)
    return text_format


class _PageReader(Coloured, QTextBrowser):
    """A view of a documentation page.

    ``page_asked(name, anchor)`` is emitted for links to other pages; other links open outside the program.
    """

    page_asked = Signal(str, str)

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.page = ""
        self._folder = folder
        self._drawn: QTextDocument | None = None
        self.setAccessibleName("Page")
        self.setOpenLinks(False)
        self.setFrameShape(QTextBrowser.Shape.NoFrame)
        self.setVerticalScrollBarPolicy(
            Qt.ScrollBarPolicy.ScrollBarAlwaysOn
        )  # otherwise it would change the width, and the page would be drawn twice
        self.anchorClicked.connect(self._follow_link)

    def show_page(self, name: str, anchor: str = "") -> None:
        """Show a page from its start, or from the heading with ``anchor``."""
        if name != self.page:
            self.page = name
            self._draw_page()
        self.verticalScrollBar().setValue(0)
        if anchor:
            self._scroll_to(anchor)

    def apply_theme(self, theme: Theme) -> None:
        ring = f"border: 2px solid {theme.surface}; border-radius: {RADIUS_CONTROL}px;"
        colours = f"QTextBrowser {{ background: {theme.surface}; color: {theme.text}; {ring} }}"
        self.setStyleSheet(f"{colours} QTextBrowser:focus {{ border-color: {theme.accent}; }}")
        if self.page:
            self._draw_page()

    def loadResource(self, kind: int, name: QUrl | str) -> Any:
        if kind != QTextDocument.ResourceType.ImageResource.value:
            return super().loadResource(kind, name)
        path = name.toString() if isinstance(name, QUrl) else name
        picture = QImage(str(self._folder / self._path_from_docs(path)))
        ratio = self.devicePixelRatioF()
        width = round(max(200, min(_WIDEST_TEXT, self.viewport().width() - 2 * MARGIN)) * ratio)
        if picture.width() > width:
            picture = picture.scaledToWidth(width, Qt.TransformationMode.SmoothTransformation)
        picture.setDevicePixelRatio(ratio)
        return picture

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Redraw the page, since pictures are as wide as the text, and keep the reading position."""
        fraction = self.verticalScrollBar().value() / max(1, self.verticalScrollBar().maximum())
        super().resizeEvent(event)
        if self.page and event.size().width() != event.oldSize().width():
            self._draw_page()
            self.verticalScrollBar().setValue(round(fraction * self.verticalScrollBar().maximum()))

    def _path_from_docs(self, path: str) -> str:
        """Return a path on the page as one relative to the folder of pages."""
        return posixpath.normpath(posixpath.join(posixpath.dirname(self.page), path))

    def _draw_page(self) -> None:
        document = QTextDocument(self, defaultFont=font("body", weight=400), documentMargin=MARGIN)
        document.setMarkdown(page_markdown(self.page), QTextDocument.MarkdownFeature.MarkdownDialectGitHub)
        self._style_blocks(document)
        self._style_tables(document)
        self.setDocument(document)  # last, so that it is laid out once
        previous, self._drawn = self._drawn, document
        if previous is not None:
            previous.deleteLater()  # and its cached pictures, which would accumulate

    def _style_blocks(self, document: QTextDocument) -> None:
        cursor = QTextCursor(document)
        cursor.beginEditBlock()
        block = document.begin()
        while block.isValid():
            cursor.setPosition(block.position())
            in_table = cursor.currentTable() is not None
            cursor.movePosition(QTextCursor.MoveOperation.EndOfBlock, QTextCursor.MoveMode.KeepAnchor)
            shape = block.blockFormat()
            if shape.headingLevel():
                cursor.mergeCharFormat(_text_format(_heading_font(shape.headingLevel())))
                shape.setTopMargin(0 if shape.headingLevel() == 1 else 22)
                shape.setBottomMargin(6)
            elif any(shape.hasProperty(key) for key in CODE):
                cursor.mergeCharFormat(_text_format(_code_font()))
                shape.setBackground(QColor(self.theme.sunk))
                shape.setNonBreakableLines(False)
            elif not in_table:
                shape.setTopMargin(6)
                shape.setBottomMargin(4)
                if _PICTURE not in block.text():
                    shape.setLineHeight(125, QTextBlockFormat.LineHeightTypes.ProportionalHeight.value)
            cursor.setBlockFormat(shape)
            self._colour_links(block)
            block = block.next()
        cursor.endEditBlock()

    def _colour_links(self, block: QTextBlock) -> None:
        links = QTextCharFormat()
        links.setForeground(QColor(self.theme.accent))
        spans: list[tuple[int, int]] = []
        parts = block.begin()
        while not parts.atEnd():
            part = parts.fragment()
            if part.charFormat().isAnchor():
                spans.append((part.position(), part.length()))
            parts += 1
        for start, length in spans:
            cursor = QTextCursor(block)
            cursor.setPosition(start)
            cursor.setPosition(start + length, QTextCursor.MoveMode.KeepAnchor)
            cursor.mergeCharFormat(links)

    def _style_tables(self, document: QTextDocument) -> None:
        for frame in document.rootFrame().childFrames():
            if isinstance(frame, QTextTable):
                shape = frame.format()
                shape.setBorder(1)
                shape.setBorderCollapse(True)
                shape.setBorderStyle(QTextFrameFormat.BorderStyle.BorderStyle_Solid)
                shape.setBorderBrush(QColor(self.theme.border))
                shape.setCellPadding(CELL_PADDING)
                shape.setCellSpacing(0)
                shape.setTopMargin(8)
                shape.setBottomMargin(12)
                shape.setWidth(QTextLength(QTextLength.Type.PercentageLength, 100))
                frame.setFormat(shape)
                first = frame.cellAt(0, 0).firstCursorPosition()
                if not first.block().text() and first.block().next().text() and not first.atEnd():
                    first.deleteChar()  # Qt's empty block, in a table that follows code

    def _scroll_to(self, anchor: str) -> None:
        block = self.document().begin()
        while block.isValid():
            if block.blockFormat().headingLevel() and anchor_of(block.text()) == anchor:
                top = self.document().documentLayout().blockBoundingRect(block).top()
                self.verticalScrollBar().setValue(round(top) - MARGIN // 2)
                return
            block = block.next()

    def _follow_link(self, link: QUrl) -> None:
        path, anchor = link.path(), link.fragment()
        if link.scheme() in {"http", "https"}:
            QDesktopServices.openUrl(link)
        elif not path:
            self._scroll_to(anchor)
        elif path.endswith(_SUFFIX):
            self.page_asked.emit(self._path_from_docs(path.removesuffix(_SUFFIX)), anchor)


LIST_WIDTH, ROW_PX, HEADING_PX = 280, 30, 40
PAGE, ANCHOR = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1
_MOVE_KEYS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
_ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


class HelpPlace(Place):
    """The page with the documentation; ``open_page`` shows one of its pages."""

    def __init__(self, folder: Path | None = None) -> None:
        super().__init__()
        self._history: list[str] = []
        self._origin = ""
        self.search_field = QLineEdit(placeholderText="Search the pages", clearButtonEnabled=True)
        self.search_field.setAccessibleName("Search the pages")
        self.search_field.setFont(font("label", weight=400))
        self.list = QListWidget()
        self.list.setAccessibleName("Pages")
        self.list.setProperty("role", "links")
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.no_results = label("No page contains these words.", "label", "text2", wraps=True)
        self.reader = _PageReader(documentation.folder() if folder is None else folder)
        self.back = ActionButton("chevron_left", "Back", height=38)
        self.back.setEnabled(False)
        self._lay_out()
        self.search_field.textChanged.connect(lambda text: self._show_rows(matching_entries(text)))
        self.search_field.installEventFilter(self)
        self.list.currentItemChanged.connect(self._open_chosen)
        self.reader.page_asked.connect(self.open_page)
        self.back.clicked.connect(self.go_back)
        self.back.setToolTip("Back (Alt+←); Esc returns to the page from which Help was opened")
        QShortcut(QKeySequence("Alt+Left"), self, self.go_back)
        QShortcut(QKeySequence("Esc"), self, self._go_to_origin)
        QShortcut(QKeySequence(QKeySequence.StandardKey.Find), self, self.search_field.setFocus)
        self._show_rows(help_entries())
        self.open_page(_FIRST_PAGE)

    def _lay_out(self) -> None:
        pages, page = Card(padding=14, gap=10), Card(padding=6, gap=0)
        pages.setFixedWidth(LIST_WIDTH)
        add_parts(pages.column, self.search_field, self.no_results, (self.list, 1))
        page.column.addWidget(self.reader, 1)
        head = hbox((label("Help", "title"), 1), self.back, margins=(SHADOW, 0, SHADOW, 0))
        body = hbox(pages, (page, 1), spacing=14)
        vbox(head, (body, 1), spacing=14, margins=(24, 24, 24, 18), parent=self)

    def open_page(self, name: str, anchor: str = "") -> None:
        """Show a page, at the heading with ``anchor`` if given; ignore an unknown page."""
        if name not in documentation.names():
            return
        if self.reader.page and self.reader.page != name:
            self._history.append(self.reader.page)
            self.back.setEnabled(True)
        self.reader.show_page(name, anchor)
        self._select(name)

    def open_from(self, place: str) -> None:
        """Show the documentation about a page of the main window, to which *Back* returns; otherwise the first page."""
        if place not in _PAGES_OF_PLACES:
            self.open_page(_FIRST_PAGE)
            return
        self.open_page(_PAGES_OF_PLACES[place])
        self._history, self._origin = [], place
        self.back.setEnabled(True)

    def go_back(self) -> None:
        """Show the previous page; at the first one, return to where help was opened."""
        if self._history:
            name = self._history.pop()
            self.back.setEnabled(bool(self._history or self._origin))
            self.reader.show_page(name)
            self._select(name)
        else:
            self._go_to_origin()

    def _go_to_origin(self) -> None:
        if self._origin:
            self.go_asked.emit(self._origin)

    def leave(self) -> None:
        """Forget from where help was opened."""
        self._origin = ""
        self.back.setEnabled(bool(self._history))

    def _show_rows(self, rows: tuple[HelpEntry, ...]) -> None:
        with QSignalBlocker(self.list):
            self.list.clear()
            for row in rows:
                item = QListWidgetItem(row.title)
                item.setData(PAGE, row.page)
                item.setData(ANCHOR, row.anchor)
                item.setToolTip(plain_tip(row.title))
                item.setFont(font("label", weight=600 if row.is_heading else 400))
                item.setSizeHint(QSize(LIST_WIDTH - 60, HEADING_PX if row.is_heading else ROW_PX))
                self.list.addItem(item)
        self.no_results.setVisible(not rows)
        self._select("" if self.search_field.text().strip() else self.reader.page)

    def _select(self, name: str) -> None:
        rows = [row for row in range(self.list.count()) if self.list.item(row).data(PAGE) == name]
        with QSignalBlocker(self.list):
            self.list.setCurrentRow(rows[0] if rows else -1)
            if not rows:
                self.list.clearSelection()

    def _open_chosen(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.open_page(item.data(PAGE), item.data(ANCHOR))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Let arrow keys in the search field move in the list; the first key, or Enter, opens the first page."""
        if (
            event.type() == QEvent.Type.KeyPress
            and isinstance(event, QKeyEvent)
            and event.key() in (*_MOVE_KEYS, *_ENTER_KEYS)
        ):
            if not self.list.selectedItems():
                self.list.setCurrentRow(0)
            elif event.key() in _MOVE_KEYS:
                self.list.keyPressEvent(event)
            return True
        return super().eventFilter(watched, event)
