"""Spans of sliders, and number fields: how numbers are read and written; nothing typed is lost."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QVBoxLayout, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.controls import Number
from study_app.gui.widgets.numbers import MARGIN, NumberField, Range, Slider, read_number, write_number

SPANS = [
    Range(0.0, 1.0),
    Range(-5.0, 5.0),
    Range(0.99, 1.0),
    Range(0.01, 1e6, logarithmic=True),
    Range(1.0, 100_000.0, logarithmic=True, whole=True),
    Range(2.0, 16.0, whole=True),
    Range(0.0, 10.0, logarithmic=True),  # no decades from nothing: even
]


@pytest.mark.parametrize("span", SPANS)
@given(share=st.floats(0, 1))
def test_a_number_is_found_where_it_was_put(span: Range, share: float) -> None:
    value = span.value_at(share)
    assert span.least <= value <= span.most
    coarse = 0.51 / (span.most - span.least) if span.whole and not span.logarithmic else 0.0
    if span.logarithmic and span.whole and value < 100:
        coarse = 0.07
    assert span.fraction_of_range(value) == pytest.approx(share, abs=max(coarse, 0.002))


@pytest.mark.parametrize("span", SPANS)
def test_ends_and_order(span: Range) -> None:
    values = [span.value_at(step / 50) for step in range(51)]
    assert (values[0], values[-1]) == (span.least, span.most)
    assert values == sorted(values)
    assert all(value == round(value) for value in values) or not span.whole
    assert (span.fraction_of_range(span.least - 1), span.fraction_of_range(span.most + 1)) == (0.0, 1.0)
    decades = Range(1.0, 1000.0, logarithmic=True)
    assert [decades.fraction_of_range(value) for value in (1, 10, 100, 1000)] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert (Range(3.0, 3.0).value_at(0.5), Range(3.0, 3.0).fraction_of_range(3.0)) == (3.0, 0.0)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.75", 0.75), ("0,75", 0.75), ("−20", -20.0), ("-20", -20.0), ("45 918", 45918.0), ("1e-3", 0.001),
        (" 7 ", 7.0), ("", None), ("water", None), ("1.2.3", None), ("nan", None), ("inf", None), ("1e999", None),
        ("2,500", None), ("1 5", None),
    ],
)  # fmt: skip
def test_numbers_are_read_as_people_write_them(text: str, value: float | None) -> None:
    assert read_number(text) == value


@pytest.mark.slow
@given(st.floats(-1e6, 1e6).filter(lambda value: abs(value) > 1e-3), st.integers(3, 6))
def test_written_numbers_can_be_read(value: float, decimals: int) -> None:
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
    number_field: Any = NumberField()
    number_field.other = NumberField()
    column.addWidget(number_field)
    column.addWidget(number_field.other)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    number_field.setFocus()
    number_field.signals = []
    number_field.entered.connect(number_field.signals.append)
    number_field.unread.connect(number_field.signals.append)
    number_field.abandoned.connect(lambda: number_field.signals.append("back"))
    number_field.stepped.connect(lambda steps: number_field.signals.append(("step", steps)))
    number_field.show_text("45")
    qtbot.waitUntil(number_field.hasFocus)
    yield number_field
    window.close()


def type_over(field: Any, text: str) -> None:
    field.selectAll()
    QTest.keyClicks(field, text)


def test_return_or_leaving_takes_a_number_once_and_escape_goes_back(field: Any, qtbot: Any) -> None:
    type_over(field, "60")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    qtbot.keyClick(field, Qt.Key.Key_Return)
    field.other.setFocus()
    assert field.signals == [60.0]
    type_over(field, "60,5")
    field.setFocus()
    field.other.setFocus()
    assert field.signals == [60.0, 60.5]
    field.setFocus()
    field.show_text("45")
    type_over(field, "70")
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    field.other.setFocus()
    assert field.text() == "45"
    assert field.signals == [60.0, 60.5, "back"]


@pytest.mark.parametrize(("reason", "selected"), [("Tab", "45"), ("Backtab", "45"), ("Mouse", "")])
def test_the_tab_key_selects_the_number_that_it_leads_to(field: Any, reason: str, selected: str) -> None:
    field.other.setFocus()
    field.deselect()
    field.setFocus(getattr(Qt.FocusReason, f"{reason}FocusReason"))
    assert field.selectedText() == selected


def test_invalid_text_stays_for_correction(field: Any, qtbot: Any) -> None:
    type_over(field, "4..5")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    field.show_text("45")
    assert field.signals == ["4..5"]
    assert field.text() == "4..5"


def test_up_and_down_step_and_typing_is_not_overwritten(field: Any, qtbot: Any) -> None:
    qtbot.keyClick(field, Qt.Key.Key_Up)
    qtbot.keyClick(field, Qt.Key.Key_Down)
    assert field.signals == [("step", 1), ("step", -1)]
    type_over(field, "6")
    field.show_text("45.5")
    assert field.text() == "6"
    field.restore_text()
    assert field.text() == "45.5"


def test_letters_and_undo_reach_the_windows_shortcuts_unless_something_is_typed_to_be_undone(field: Any) -> None:
    heard: list[str] = []
    for keys in ("X", "Ctrl+Z"):
        shortcut = QShortcut(QKeySequence(keys), field.window())
        shortcut.activated.connect(lambda keys=keys: heard.append(keys))
    QTest.keyClicks(field, "xw")
    QTest.keySequence(field, QKeySequence("Ctrl+Z"))
    assert (heard, field.text()) == (["X", "Ctrl+Z"], "45")
    QTest.keyClicks(field, "7")
    QTest.keySequence(field, QKeySequence("Ctrl+Z"))
    assert heard == ["X", "Ctrl+Z"]


@pytest.mark.parametrize("typed", ["2,5", "2.500", "1 5", "-3"])
def test_a_whole_number_is_typed_in_digits_or_the_one_before_comes_back(qtbot: Any, typed: str) -> None:
    window = QWidget()
    column = QVBoxLayout(window)
    number, other = Number(1, 5000, 7), NumberField()
    column.addWidget(number)
    column.addWidget(other)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    number.setFocus()
    qtbot.waitUntil(number.hasFocus)
    number.selectAll()
    QTest.keyClicks(number, typed)
    assert number.refusal == f"“{typed}” is not a whole number from 1 to 5000"
    QTest.keyClick(number, Qt.Key.Key_Return)
    assert number.text() == typed
    other.setFocus()
    assert (number.value(), number.text(), number.refusal) == (7, "7", "")


def test_return_submits_a_rejected_number_again_and_escape_restores_it(field: Any, qtbot: Any) -> None:
    field.show_state("refused")
    assert (field.state, field.property("state"), field.font().weight()) == ("refused", "refused", 600)
    for _ in range(2):
        qtbot.keyClick(field, Qt.Key.Key_Return)
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    field.show_state("")
    assert (field.state, field.font().weight()) == ("", font("label").weight())
    for key in (Qt.Key.Key_Return, Qt.Key.Key_Escape):
        qtbot.keyClick(field, key)
    assert field.signals == [45.0, 45.0, "back"]


def test_keys_mouse_and_screen_readers_move_a_slider_and_only_a_dragged_knob_is_held(qtbot: Any) -> None:
    slider = Slider()
    qtbot.addWidget(slider)
    slider.resize(round(100 + 2 * MARGIN), 32)
    moves: list[tuple[float, bool]] = []
    slider.slid.connect(lambda value, held: moves.append((value, held)))
    qtbot.keyClick(slider, Qt.Key.Key_Delete)  # there is no tick
    for value in (0.4013, 0.4):  # the first is between two steps
        slider.show_number(Range(0.0, 1.0), value, tick=0.7)
        assert (slider.number, slider.tick, slider.value(), moves) == (value, 0.7, 80, [])
    for key, value in (
        ("Right", 0.405), ("Up", 0.41), ("Left", 0.405), ("Down", 0.4), ("PageUp", 0.5), ("PageDown", 0.4), ("Home", 0),
        ("End", 1), ("Delete", 0.7), ("Home", 0), ("Backspace", 0.7),
    ):  # fmt: skip
        qtbot.keyClick(slider, getattr(Qt.Key, f"Key_{key}"))
        assert (moves.pop(), moves, slider.value()) == ((pytest.approx(value), False), [], round(200 * value)), key
    left, right = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton
    at_quarter, at_half = QPoint(37, 16), QPoint(62, 16)
    qtbot.mousePress(slider, right, pos=at_half)
    qtbot.mouseMove(slider, at_quarter)
    qtbot.mouseRelease(slider, right, pos=at_quarter)
    assert (moves, slider.dragged) == ([], False)
    qtbot.mousePress(slider, left, pos=at_quarter)
    qtbot.mouseMove(slider, at_half)
    assert slider.dragged
    qtbot.mouseRelease(slider, left, pos=at_half)
    qtbot.mouseMove(slider, at_quarter)
    assert (moves, slider.dragged) == ([(0.255, True), (0.505, True), (0.505, False)], False)
    qtbot.mousePress(slider, left, pos=at_quarter)
    slider.release_knob()
    qtbot.mouseRelease(slider, left, pos=at_quarter)
    qtbot.mouseDClick(slider, left, pos=at_quarter)
    slider.setValue(150)
    assert moves[3:] == [(0.255, True), (0.7, False), (0.75, False)]
    slider.show_number(Range(1.0, 100_000.0, logarithmic=True, whole=True), 1.0)
    for steps in (-1, 1, 1, -1):
        slider.step(steps)
    assert moves[6:] == [(2.0, False), (3.0, False), (2.0, False)]
