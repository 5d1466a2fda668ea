"""The designer in its window: by keys alone, by mouse alone, with names for everything, and killed while typing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QWidget,
)

from study_app.authoring.drafts import draft_of
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.theme.theme import DARK, LIGHT

pytestmark = pytest.mark.slow

KILLS = int(os.environ.get("LIQUID_STUDY_DRAFT_KILLS", "2"))
MODIFIERS = {"Ctrl": Qt.KeyboardModifier.ControlModifier, "Alt": Qt.KeyboardModifier.AltModifier,
             "Shift": Qt.KeyboardModifier.ShiftModifier}  # fmt: skip


def press(qtbot: Any, designer: Any, keys: str) -> None:
    """Press keys in the focused part, as "Ctrl+Z"."""
    *held, key = keys.split("+")
    modifiers = Qt.KeyboardModifier.NoModifier
    for one in held:
        modifiers |= MODIFIERS[one]
    part = QApplication.focusWidget() or designer.window
    qtbot.keyClick(part, getattr(Qt.Key, f"Key_{key}"), modifiers)


@pytest.mark.usefixtures("editors")
def test_a_small_study_is_edited_by_keys_alone(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.window.activateWindow()
    before = designer.file.read_text()
    press(qtbot, designer, "Ctrl+1")
    assert designer.place.outline.tree.hasFocus()
    press(qtbot, designer, "Down")
    press(qtbot, designer, "Down")
    press(qtbot, designer, "Up")
    assert designer.place.view.form.path == ("blocks", "liquids")
    press(qtbot, designer, "Alt+Down")
    assert designer.editing.opened.study.document["sequence"][:3] == ("welcome", "reaching", "liquids")
    press(qtbot, designer, "Alt+Up")
    press(qtbot, designer, "F2")
    assert designer.place.form.head.id.hasFocus()
    qtbot.keyClicks(designer.place.form.head.id, "fluids")
    press(qtbot, designer, "Return")
    assert "[blocks.fluids]" in designer.text
    assert '"fluids"' in designer.text
    press(qtbot, designer, "Ctrl+2")
    for _ in range(60):
        if QApplication.focusWidget() is designer.row("blocks", "fluids", "repetitions").field.line:
            break
        press(qtbot, designer, "Tab")
    line = designer.row("blocks", "fluids", "repetitions").field.line
    assert line.hasFocus()
    qtbot.keyClicks(line, "4")
    press(qtbot, designer, "Return")
    assert designer.editing.opened.study.document["blocks"]["fluids"]["repetitions"] == int(line.text())
    assert f"repetitions = {line.text()}" in designer.place.file.editor.words()
    press(qtbot, designer, "Ctrl+E")
    assert designer.place.file.editor.hasFocus()
    press(qtbot, designer, "Ctrl+Z")
    press(qtbot, designer, "Ctrl+Z")
    assert "[blocks.liquids]" in designer.place.file.editor.words()
    press(qtbot, designer, "Ctrl+Shift+Z")
    press(qtbot, designer, "Ctrl+S")
    assert designer.file.read_text() == designer.text != before
    while designer.editing.opened.history.done:
        press(qtbot, designer, "Ctrl+Z")
    assert designer.text == before


@pytest.mark.usefixtures("editors")
def test_a_small_study_is_edited_by_mouse_alone(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    before = designer.file.read_text()
    place, tree = designer.place, designer.place.outline.tree

    def click(part: Any) -> None:
        qtbot.mouseClick(part, Qt.MouseButton.LeftButton)

    index = next(one for one in place.outline.indexes() if one.data(ROW_ROLE).path == ("blocks", "liquids"))
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=tree.visualRect(index).center())
    assert place.view.form.path == ("blocks", "liquids")
    replicates = designer.row("blocks", "liquids", "replicates").field.toggle
    qtbot.mouseClick(replicates, Qt.MouseButton.LeftButton, pos=QPoint(16, 16))
    assert designer.editing.opened.study.document["blocks"]["liquids"]["replicates"] is True
    click(designer.row("blocks", "liquids", "task").field.arrow)
    assert place.view.form.path == ("tasks", "explore")
    click(place.form.head.copy)
    assert place.view.form.path == ("tasks", "explore_2")
    click(place.form.head.delete)
    assert "explore_2" not in designer.text
    click(place.header.undo)
    assert "[tasks.explore_2]" in place.file.editor.words()
    click(place.header.save)
    assert designer.file.read_text() == designer.text != before


def test_typing_into_the_file_reaches_the_form_and_a_fault_its_field(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("blocks", "liquids"))
    editor = designer.place.file.editor
    line = next(at for at, text in enumerate(editor.words().split("\n")) if text.startswith("order = ")
                and editor.shown.selected[0][0] < at)  # fmt: skip
    editor.go_to(line)
    editor.setFocus()
    press(qtbot, designer, "End")
    cursor = editor.textCursor()
    cursor.movePosition(cursor.MoveOperation.StartOfBlock)
    cursor.movePosition(cursor.MoveOperation.Right, n=len('order = "'))
    editor.setTextCursor(cursor)
    qtbot.keyClicks(editor, "x")
    qtbot.waitUntil(lambda: not editor.pending)
    row = designer.row("blocks", "liquids", "order")
    assert row.wrong.isVisible()
    assert "is not" in row.wrong.sentence.text()
    press(qtbot, designer, "F8")
    assert designer.place.problems.isVisible()
    assert designer.place.form.isAncestorOf(QApplication.focusWidget())
    press(qtbot, designer, "Ctrl+Z")
    assert not designer.row("blocks", "liquids", "order").wrong.isVisible()


def test_text_that_is_not_a_number_stays_with_its_reason(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("device",))
    before = designer.text
    row = designer.row("device", "force_limit_n")
    row.field.line.setFocus()
    row.field.line.selectAll()
    qtbot.keyClicks(row.field.line, "strong")
    press(qtbot, designer, "Return")
    assert designer.text == before
    assert row.field.line.text() == "strong"
    assert "is not a number" in row.wrong.sentence.text()
    press(qtbot, designer, "Escape")
    assert row.field.line.text() != "strong"
    assert not row.wrong.isVisible()


def test_esc_restores_what_was_accepted_last(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("device",))
    line = designer.row("device", "force_limit_n").field.line
    line.setFocus()
    for typed, key in (("5", "Return"), ("strong", "Return"), ("", "Escape")):
        line.selectAll()
        qtbot.keyClicks(line, typed)
        press(qtbot, designer, key)
    assert line.text() == "5"
    assert designer.editing.opened.study.document["device"]["force_limit_n"] == 5


@pytest.mark.usefixtures("editors")
@pytest.mark.parametrize("width", [pytest.param(1600, marks=pytest.mark.nightly), 1366])
def test_every_form_fits_its_width(designer: Any, width: int) -> None:
    designer.window.resize(width, 768)
    designer.controller.open("kitchen")
    area = designer.place.form.area
    for row in designer.place.outline.rows:
        designer.editing.select(row.path)
        QApplication.processEvents()
        assert area.widget().minimumSizeHint().width() <= area.viewport().width(), row.path


def test_a_file_that_is_not_toml_keeps_the_outline_and_says_its_fault(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    rows = len(designer.place.outline.rows)
    editor = designer.place.file.editor
    editor.setFocus()
    editor.go_to(0)
    qtbot.keyClicks(editor, "broken = ")
    qtbot.waitUntil(lambda: not editor.pending)
    assert designer.place.header.problems.words == "1 problem"
    qtbot.wait(400)
    assert len(designer.place.outline.rows) == rows
    press(qtbot, designer, "F8")
    assert editor.hasFocus()


def above(part: Any) -> list[Any]:
    found = []
    while (part := part.parent()) is not None:
        found.append(part)
    return found


class Shown(QObject):
    """Notes every window that is shown."""

    def __init__(self, windows: list[str], parent: QObject) -> None:
        super().__init__(parent)
        self.windows = windows

    def eventFilter(self, part: Any, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        window = event.type() == QEvent.Type.Show and isinstance(part, QWidget) and part.isWindow()
        if window and part.graphicsProxyWidget() is None:  # the participant's page lies within the designer
            self.windows.append(type(part).__name__)
        return False


def test_no_part_of_a_form_is_shown_as_a_window(designer: Any) -> None:
    windows: list[str] = []
    watch = Shown(windows, designer.window)
    QApplication.instance().installEventFilter(watch)
    designer.controller.open("kitchen")
    for path in [row.path for row in designer.place.outline.rows if row.path]:
        designer.editing.select(path)
    designer.controller.ask_to_delete(("liquids", "thick"))
    QApplication.instance().removeEventFilter(watch)
    assert not windows


@pytest.mark.usefixtures("editors")
def test_everything_that_takes_the_keyboard_has_a_name(designer: Any) -> None:
    kinds = (QAbstractButton, QLineEdit, QPlainTextEdit, QComboBox, QAbstractItemView)
    designer.controller.open("kitchen")
    nameless = []
    for path in [row.path for row in designer.place.outline.rows if row.path]:
        designer.editing.select(path)
        for kind in kinds:
            for part in designer.place.findChildren(kind):
                inner = any(isinstance(one, QComboBox) for one in above(part))
                words = part.accessibleName() or (part.text() if isinstance(part, QAbstractButton) else "")
                if not words and not inner and part.focusPolicy() != Qt.FocusPolicy.NoFocus:
                    nameless.append((path, part))
    assert not nameless


@pytest.mark.variants(3)
@pytest.mark.parametrize("size", [(1600, 1000), (1366, 768), (1024, 640)])
@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_the_place_fits_its_window(designer: Any, size: tuple[int, int], theme: Any) -> None:
    designer.window.show_theme(theme)
    designer.window.resize(*size)
    designer.controller.open("kitchen")
    QApplication.processEvents()
    assert (designer.window.width(), designer.window.height()) == size
    assert designer.place.form.isVisible()
    assert designer.place.pane.isVisible() == (size[0] > 1200)
    designer.place.sides.buttons[1].click()
    assert designer.place.pane.isVisible()
    QApplication.processEvents()
    wide = designer.place.parts.width()
    assert designer.place.pane.width() > (0.4 if designer.place.form.isVisible() else 0.95) * wide


SCRIPT = """
import sys, time
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from study_app.app.designer.controller import DesignerController
from study_app.gui.application import application_here

application = application_here()
designer = DesignerController(Path(sys.argv[1]))
designer.place.resize(1400, 900)
designer.place.show()
designer.open("kitchen")
designer.editing.select(("study",))
line = next(row for row in designer.place.form.rows if row.row.row.path[-1] == "version").field.line
line.setFocus()
line.selectAll()
for letters in range(1, 100000):
    QTest.keyClick(line, Qt.Key.Key_1)
    print(letters, time.time(), flush=True)
    QTest.qWait(30)
"""


@pytest.mark.nightly
@pytest.mark.timeout(180 + 30 * KILLS)
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_a_kill_while_typing_loses_at_most_the_last_second(designer: Any, tmp_path: Path) -> None:
    before = designer.file.read_bytes()
    for number in range(KILLS):
        typed: dict[int, float] = {}
        command = [sys.executable, "-c", SCRIPT, str(tmp_path / "results")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            assert process.stdout is not None
            until = None
            for line in process.stdout:
                letters, moment = line.split()
                typed[int(letters)] = float(moment)
                until = until or time.time() + 1.6 + 0.17 * number % 1.0
                if time.time() > until:
                    break
            killed = time.time()
            process.send_signal(signal.SIGKILL)
        draft = draft_of(designer.file)
        assert draft is not None
        kept = next(line for line in draft.text.splitlines() if line.startswith("version")).split('"')[1]
        assert set(kept) == {"1"}
        lost = [moment for letters, moment in typed.items() if letters > len(kept)]  # the draft may be ahead of `typed`
        assert not lost or killed - lost[0] < 1.0
        assert designer.file.read_bytes() == before
