"""The text of the study's file, its marked lines, and the editor that shows it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from PySide6.QtCore import QEvent, QRect, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFont,
    QFontDatabase,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QShowEvent,
    QSyntaxHighlighter,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
)
from PySide6.QtWidgets import QFrame, QPlainTextEdit, QWidget

from study_app.designer.document.study import Study
from study_app.designer.document.toml_text import common_ends, spans_of, with_line_feeds
from study_app.designer.form.fields import PAGE_KEYS, SUBMIT_DELAY_MS
from study_app.designer.parts import cut_text
from study_app.gui.theme import Coloured, Theme, draw_icon
from study_app.gui.widgets import Card, Icon, hbox, label
from study_app.protocol.load import located_problems
from study_app.protocol.source import Path, Places


class _VisibleLine(NamedTuple):
    """The number of a line from 0, its vertical position, and its height [px]."""

    number: int
    top: float
    height: float


def _visible_lines(text: QPlainTextEdit) -> list[_VisibleLine]:
    lines = []
    block, offset = text.firstVisibleBlock(), text.contentOffset()
    while block.isValid():
        rect = text.blockBoundingGeometry(block).translated(offset)
        if rect.top() > text.viewport().height():
            break
        lines.append(_VisibleLine(number=block.blockNumber(), top=rect.top(), height=rect.height()))
        block = block.next()
    return lines


@dataclass(frozen=True, slots=True)
class FileText:
    """The text of the editor; lines count from 0."""

    name: str = ""  # the name of the file
    text: str = ""  # its text with line feeds alone
    selected: tuple[tuple[int, int], ...] = ()  # first and last line of each part of the selected element
    faulty: tuple[int, ...] = ()  # lines with a fault


def file_text(study: Study, name: str, path: Path) -> FileText:
    """Return the file with the lines of the element at ``path`` marked."""
    problems = study.problems if not study.is_toml else located_problems(study.shown_faults, Places.of(study.text))
    faulty = tuple(sorted({problem.line - 1 for problem in problems if problem.line}))
    selected: tuple[tuple[int, int], ...] = ()
    if study.is_toml and path:
        pieces = spans_of(study.text).pieces(path)
        lines = [
            (_line_number(study.text, piece.start), _line_number(study.text, max(piece.start, piece.end - 1)))
            for piece in pieces
        ]
        selected = tuple(lines)
    return FileText(name, with_line_feeds(study.text), selected, faulty)


def _line_number(text: str, position: int) -> int:
    return text.count("\n", 0, position)


_FONT_PX = 13
_PIECES = r"(#.*$)|(^\s*\[.*?\]\]?)|(\"\"\"|\"(?:[^\"\\]|\\.)*\"|'[^']*')"


class Colours(QSyntaxHighlighter):
    """Colours the groups of a pattern, each with roles for text and background ("" for none) and a weight."""

    def __init__(self, document: QTextDocument, pattern: str, *roles: tuple[str, str, int]) -> None:
        super().__init__(document)
        self._pattern, self._roles = re.compile(pattern), roles
        self._formats: list[QTextCharFormat] = []

    def apply_theme(self, theme: Theme) -> None:
        self._formats = []
        for colour, background, weight in self._roles:
            text_format = QTextCharFormat()
            text_format.setForeground(QColor(getattr(theme, colour)))
            if background:
                text_format.setBackground(QColor(getattr(theme, background)))
            text_format.setFontWeight(weight)
            self._formats.append(text_format)
        self.rehighlight()

    def highlightBlock(self, text: str) -> None:
        for match in self._pattern.finditer(text) if self._formats else ():
            self.setFormat(match.start(), match.end() - match.start(), self._formats[(match.lastindex or 1) - 1])


class _Gutter(QWidget):
    """The line numbers."""

    def __init__(self, editor: _FileEditor) -> None:
        super().__init__(editor)
        self._editor = editor

    def sizeHint(self) -> QSize:
        return QSize(self._editor.gutter_px(), 0)

    def paintEvent(self, event: QPaintEvent) -> None:
        self._editor.paint_gutter(QPainter(self), event.rect())


class _FileEditor(Coloured, QPlainTextEdit):
    """The text editor; ``typed`` emits its text with a short delay. It is not updated while hidden."""

    typed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.shown = FileText()
        self.pending = False
        self._showing = False
        self._pending_scroll: bool | None = None
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        fixed.setPixelSize(_FONT_PX)
        fixed.setStyleHint(QFont.StyleHint.Monospace)
        self.setFont(fixed)
        self.setAccessibleName("File text")
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setUndoRedoEnabled(False)
        self.setTabChangesFocus(True)
        self.setStyleSheet(
            "QPlainTextEdit, QPlainTextEdit:focus { border: none; padding: 0; background: transparent; }"
            "QAbstractScrollArea::corner { background: transparent; border: none; }"
        )
        inks = ("text3", "", 400), ("accent", "", 600), ("warn", "", 400)  # comments, headers and strings
        self._colours = Colours(self.document(), _PIECES, *inks)
        self._gutter = _Gutter(self)
        self._typing_timer = QTimer(self)
        self._typing_timer.setSingleShot(True)
        self._typing_timer.timeout.connect(self.flush)
        self.textChanged.connect(self._note_typing)
        self.updateRequest.connect(self._scroll_gutter)
        self.blockCountChanged.connect(lambda _count: self._place_gutter())
        self._place_gutter()

    def raw_text(self) -> str:
        """Return the text; Qt's plain text would lose non-breaking spaces."""
        self._show_pending_file()
        return self.document().toRawText().replace("\u2029", "\n")

    def show_file(self, file: FileText, *, scroll: bool) -> None:
        """Show a file once the editor is visible; only differences are replaced, cursor and scroll bar stay."""
        self.shown = file
        if not self.pending:
            self._pending_scroll = scroll or bool(self._pending_scroll)
            if self.isVisible():
                self._show_pending_file()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._show_pending_file()

    def _show_pending_file(self) -> None:
        if self._pending_scroll is None:
            return
        scroll, self._pending_scroll = self._pending_scroll, None
        old, new = self.raw_text(), self.shown.text
        if old != new:
            self._replace_text(old, new)
        self._repaint_marks()
        if scroll and self.shown.selected and not self.hasFocus():
            self.go_to(self.shown.selected[0][0])

    def go_to(self, line: int) -> None:
        self._show_pending_file()
        block = self.document().findBlockByNumber(line)
        if block.isValid():
            cursor = QTextCursor(block)
            self.setTextCursor(cursor)
            self.verticalScrollBar().setValue(max(0, line - 3))

    def flush(self) -> None:
        self._typing_timer.stop()
        if self.pending:
            self.pending = False
            self.typed.emit(self.raw_text())

    def _note_typing(self) -> None:
        if not self._showing:
            self.pending = True
            if not self._typing_timer.isActive():
                self._typing_timer.start(SUBMIT_DELAY_MS)

    def _replace_text(self, old: str, new: str) -> None:
        first, last = common_ends(old, new)
        self._showing = True
        cursor = QTextCursor(self.document())
        cursor.setPosition(_utf16_length(old[:first]))
        cursor.setPosition(_utf16_length(old[: len(old) - last]), QTextCursor.MoveMode.KeepAnchor)
        cursor.insertText(new[first : len(new) - last])
        self._showing = False

    def apply_theme(self, theme: Theme) -> None:
        self._showing = True
        self._colours.apply_theme(theme)
        self._showing = False
        self._repaint_marks()

    def _repaint_marks(self) -> None:
        self.viewport().update()
        self._gutter.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self.viewport())
        width = self.viewport().width()
        for line, top, height in _visible_lines(self):
            if line in self.shown.faulty:
                painter.fillRect(QRectF(0, top, width, height), QColor(self.theme.bad_bg))
            elif self._is_selected(line):
                painter.fillRect(QRectF(0, top, width, height), QColor(self.theme.selected))
            if self._is_selected(line):
                painter.fillRect(QRectF(0, top, 2, height), QColor(self.theme.accent))
        painter.end()
        super().paintEvent(event)

    def _is_selected(self, line: int) -> bool:
        return any(first <= line <= last for first, last in self.shown.selected)

    def gutter_px(self) -> int:
        return 34 + self.fontMetrics().horizontalAdvance("9") * max(3, len(str(self.blockCount())))

    def paint_gutter(self, painter: QPainter, _place: QRect) -> None:
        painter.setFont(self.font())
        width = self._gutter.width()
        for line, top, height in _visible_lines(self):
            faulty = line in self.shown.faulty
            painter.setPen(QColor(self.theme.bad if faulty else self.theme.text2))
            painter.drawText(QRectF(0, top, width - 10, height), Qt.AlignmentFlag.AlignRight, str(line + 1))
            if faulty:
                draw_icon(painter, "warning", QRectF(2, top + height / 2 - 7, 14, 14), self.theme.bad, 2.0)

    def _place_gutter(self) -> None:
        self.setViewportMargins(self.gutter_px(), 0, 0, 0)
        inside = self.contentsRect()
        self._gutter.setGeometry(inside.left(), inside.top(), self.gutter_px(), inside.height())

    def _scroll_gutter(self, area: QRect, dy: int) -> None:
        if dy:
            self._gutter.scroll(0, dy)
        else:
            self._gutter.update(0, area.y(), self._gutter.width(), area.height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_gutter()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.flush()

    def event(self, event: QEvent) -> bool:
        overrides = event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
        if overrides and any(event.matches(key) for key in PAGE_KEYS):  # type: ignore[attr-defined]  # a key event
            self.flush()
            event.ignore()
            return True
        return super().event(event)


class FileCard(Card):
    """The editor; ``aside`` holds the file name, for the right of the tabs."""

    def __init__(self) -> None:
        super().__init__(padding=14, gap=8)
        self.setAccessibleName("File")
        self.name = cut_text("", "label", "text2", right=True)
        self.editor = _FileEditor()
        self.setFocusProxy(self.editor)
        self.aside = QWidget()
        note = Icon("check", "ok", 16), label("comments and order are kept", "small", "text2")
        hbox(*note, 10, self.name, spacing=6, margins=0, parent=self.aside)
        self.column.addWidget(self.editor, 1)

    def show_file(self, file: FileText, *, scroll: bool, read_only: bool) -> None:
        self.name.show_text(file.name)
        self.editor.setReadOnly(read_only)
        self.editor.show_file(file, scroll=scroll)


def _utf16_length(text: str) -> int:
    """Return the length of a text in UTF-16 code units, as Qt counts it."""
    return len(text.encode("utf-16-le")) // 2
