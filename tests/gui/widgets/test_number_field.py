"""Numbers as people write them, and a field that loses nothing of what was typed."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QVBoxLayout, QWidget

from study_app.gui.widgets.number_field import NumberField, read_number, write_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.75", 0.75), ("0,75", 0.75), ("−20", -20.0), ("-20", -20.0), ("45 918", 45918.0), ("1e-3", 0.001),
        (" 7 ", 7.0), ("", None), ("water", None), ("1.2.3", None), ("nan", None), ("inf", None), ("1e999", None),
    ],
)  # fmt: skip
def test_numbers_are_read_as_people_write_them(text: str, value: float | None) -> None:
    assert read_number(text) == value


@pytest.mark.slow
@given(st.floats(-1e6, 1e6).filter(lambda value: abs(value) > 1e-3), st.integers(3, 6))
def test_what_is_written_can_be_read(value: float, decimals: int) -> None:
    assert read_number(write_number(value, decimals)) == pytest.approx(value, abs=0.51 * 10**-decimals, rel=0.01)


def test_a_small_number_is_never_written_as_nothing() -> None:
    assert write_number(0.0004, 2) == "0.0004"
    assert write_number(0.0, 2) == "0"
    assert write_number(1700.0, 0) == "1700"
    assert write_number(-0.5, 2) == "−0.5"


@pytest.fixture
def field(qtbot: Any) -> Any:
    window = QWidget()
    column = QVBoxLayout(window)
    made: Any = NumberField()
    made.other = NumberField()
    column.addWidget(made)
    column.addWidget(made.other)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    made.setFocus()
    made.told = []
    made.entered.connect(made.told.append)
    made.unread.connect(made.told.append)
    made.abandoned.connect(lambda: made.told.append("back"))
    made.stepped.connect(lambda steps: made.told.append(("step", steps)))
    made.show_text("45")
    qtbot.waitUntil(made.hasFocus)
    yield made
    window.close()


def type_over(field: Any, text: str) -> None:
    field.selectAll()
    QTest.keyClicks(field, text)


def test_return_takes_a_number_once(field: Any, qtbot: Any) -> None:
    type_over(field, "60")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    qtbot.keyClick(field, Qt.Key.Key_Return)
    field.other.setFocus()
    assert field.told == [60.0]


def test_leaving_takes_a_number(field: Any) -> None:
    type_over(field, "60,5")
    field.other.setFocus()
    assert field.told == [60.5]


def test_what_is_no_number_stays_to_be_mended(field: Any, qtbot: Any) -> None:
    type_over(field, "4..5")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    field.show_text("45")
    assert field.told == ["4..5"]
    assert field.text() == "4..5"


def test_escape_goes_back(field: Any, qtbot: Any) -> None:
    type_over(field, "60")
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert field.text() == "45"
    assert field.told == ["back"]
    field.other.setFocus()
    assert field.told == ["back"]


def test_up_and_down_step(field: Any, qtbot: Any) -> None:
    qtbot.keyClick(field, Qt.Key.Key_Up)
    qtbot.keyClick(field, Qt.Key.Key_Down)
    assert field.told == [("step", 1), ("step", -1)]


def test_what_is_being_typed_is_not_overwritten(field: Any) -> None:
    type_over(field, "6")
    field.show_text("45.5")
    assert field.text() == "6"
    field.put_back()
    assert field.text() == "45.5"


def test_letters_reach_the_windows_shortcuts_and_not_the_field(field: Any, qtbot: Any) -> None:
    heard = []
    shortcut = QShortcut(QKeySequence("X"), field.window())
    shortcut.activated.connect(lambda: heard.append("X"))
    QTest.keyClicks(field, "x")
    QTest.keyClicks(field, "w")
    assert heard == ["X"]
    assert field.text() == "45"


def test_undo_is_the_fields_while_something_is_typed_and_the_windows_otherwise(field: Any, qtbot: Any) -> None:
    heard = []
    shortcut = QShortcut(QKeySequence(QKeySequence.StandardKey.Undo), field.window())
    shortcut.activated.connect(lambda: heard.append("undo"))
    QTest.keySequence(field, QKeySequence("Ctrl+Z"))
    assert heard == ["undo"]
    QTest.keyClicks(field, "7")
    QTest.keySequence(field, QKeySequence("Ctrl+Z"))
    assert heard == ["undo"]
