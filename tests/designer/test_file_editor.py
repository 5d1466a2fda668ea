"""The editor of a study's file: marks, cursor and typing, while the file changes elsewhere."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.designer.file import FileCard, FileText
from study_app.gui.theme.theme import DARK

LINES = ["[study]", 'name = "a"', "", "[scene]", "scale = 1"]


@pytest.fixture
def card(qtbot: Any) -> Iterator[FileCard]:
    card = FileCard()
    qtbot.addWidget(card)
    card.resize(400, 300)
    card.show()
    card.activateWindow()
    qtbot.waitUntil(card.isActiveWindow)
    card.editor.clearFocus()
    card.show_file(FileText("a.toml", "\n".join(LINES), ((3, 4),), (1,)), scroll=True, read_only=False)
    yield card
    card.editor.flush()


def test_the_selected_element_is_shown_and_its_lines_are_marked(card: FileCard) -> None:
    editor = card.editor
    assert (card.name.whole, editor.raw_text().split("\n"), editor.isReadOnly()) == ("a.toml", LINES, False)
    assert editor.textCursor().blockNumber() == 3
    assert [editor._is_selected(line) for line in range(5)] == [False, False, False, True, True]
    card.show_file(FileText("b.toml", "x", (), ()), scroll=True, read_only=True)
    assert (card.name.whole, editor.toPlainText(), editor.isReadOnly()) == ("b.toml", "x", True)


def test_a_hidden_editor_shows_the_last_file_and_its_selected_element_once_it_is_visible(card: FileCard) -> None:
    editor = card.editor
    lines = [f"# {number}" for number in range(100)]
    card.hide()
    card.show_file(FileText("a.toml", "\n".join(lines), ((60, 61),)), scroll=True, read_only=False)
    lines[0] = "# changed"
    card.show_file(FileText("a.toml", "\n".join(lines), ((50, 52),)), scroll=False, read_only=False)
    assert editor.toPlainText().split("\n") == LINES
    card.show()
    assert editor.toPlainText().split("\n") == lines
    assert (editor.textCursor().blockNumber(), editor.verticalScrollBar().value()) == (50, 47)
    card.show_file(FileText("a.toml", "\n".join(lines), ((20, 22),)), scroll=False, read_only=False)
    assert editor.textCursor().blockNumber() == 50
    card.show_file(FileText("a.toml", "\n".join(lines), ((70, 71),)), scroll=True, read_only=False)
    assert (editor.textCursor().blockNumber(), editor.verticalScrollBar().value()) == (70, 67)


def test_a_change_elsewhere_moves_neither_cursor_nor_is_it_typed_text(card: FileCard, qtbot: Any) -> None:
    editor, typed = card.editor, list[str]()
    editor.typed.connect(typed.append)
    editor.setFocus()
    editor.go_to(4)
    for text in ('name = "\U0001f600b\u00a0c"', 'name = "\U0001f600xc"', "name = 3\nversion = 4", 'name = "a"'):
        lines = [LINES[0], text, *LINES[2:]]
        card.show_file(FileText("a.toml", "\n".join(lines), ((0, 1),), ()), scroll=True, read_only=False)
        assert editor.document().toRawText().split("\u2029") == "\n".join(lines).split("\n")
        assert editor.textCursor().block().text() == "scale = 1"
    editor.apply_theme(DARK)
    qtbot.wait(10)
    assert (editor.pending, typed) == (False, [])


def test_typed_text_is_sent_after_a_pause_and_at_once_when_the_focus_leaves(card: FileCard, qtbot: Any) -> None:
    editor, typed = card.editor, list[str]()
    editor.typed.connect(typed.append)
    editor.setFocus()
    editor.go_to(4)
    qtbot.keyClicks(editor, "# ")
    assert (editor.pending, typed) == (True, [])
    card.show_file(FileText("a.toml", "other", (), ()), scroll=False, read_only=False)
    assert editor.raw_text().endswith("# scale = 1"), "what is being typed stays"
    qtbot.waitUntil(lambda: len(typed) == 1)
    assert (typed[0].split("\n")[-1], editor.pending) == ("# scale = 1", False)
    card.show_file(FileText("a.toml", typed[0], (), ()), scroll=False, read_only=False)
    for leave in (editor.clearFocus, lambda: qtbot.keyClick(editor, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)):
        editor.setFocus()
        qtbot.keyClicks(editor, "#")
        before = len(typed)
        leave()
        assert (len(typed), editor.pending) == (before + 1, False)
    card.hide()
    card.show_file(FileText("a.toml", "hidden", (), ()), scroll=False, read_only=False)
    assert editor.document().toPlainText() != "hidden", "a hidden editor is not updated"
    card.show()
    assert editor.document().toPlainText() == "hidden"
