"""A slider's numbers, and what mouse, keyboard, wheel and a screen reader do to it."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.widgets.sliders import Range, Slider

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
    value = span.value(share)
    assert span.least <= value <= span.most
    coarse = 0.51 / (span.most - span.least) if span.whole and not span.logarithmic else 0.0
    if span.logarithmic and span.whole and value < 100:
        coarse = 0.07
    assert span.share(value) == pytest.approx(share, abs=max(coarse, 0.002))


@pytest.mark.parametrize("span", SPANS)
def test_ends_and_order(span: Range) -> None:
    values = [span.value(step / 50) for step in range(51)]
    assert (values[0], values[-1]) == (span.least, span.most)
    assert values == sorted(values)
    assert all(value == round(value) for value in values) or not span.whole
    assert (span.share(span.least - 1), span.share(span.most + 1)) == (0.0, 1.0)


def test_decades_are_equally_long() -> None:
    span = Range(1.0, 1000.0, logarithmic=True)
    assert [span.share(value) for value in (1, 10, 100, 1000)] == pytest.approx([0, 1 / 3, 2 / 3, 1])


def test_a_range_without_width_has_one_number() -> None:
    assert Range(3.0, 3.0).value(0.5) == 3.0
    assert Range(3.0, 3.0).share(3.0) == 0.0


@pytest.fixture
def slider(qtbot: Any) -> Slider:
    made = Slider()
    made.resize(222, 32)
    made.show_number(Range(0.0, 10.0), 4.0, tick=2.5)
    qtbot.addWidget(made)
    made.show()
    made.told = []  # type: ignore[attr-defined]
    made.slid.connect(lambda value, held: made.told.append((value, held)))  # type: ignore[attr-defined]
    return made


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (Qt.Key.Key_Right, 4.05), (Qt.Key.Key_Up, 4.05), (Qt.Key.Key_Left, 3.95), (Qt.Key.Key_Down, 3.95),
        (Qt.Key.Key_PageUp, 5.0), (Qt.Key.Key_PageDown, 3.0), (Qt.Key.Key_Home, 0.0), (Qt.Key.Key_End, 10.0),
        (Qt.Key.Key_Delete, 2.5),
    ],
)  # fmt: skip
def test_keys_move_it(slider: Any, qtbot: Any, key: Qt.Key, value: float) -> None:
    qtbot.keyClick(slider, key)
    assert slider.told == [(pytest.approx(value), False)]


def test_every_key_press_changes_a_whole_number(slider: Any, qtbot: Any) -> None:
    slider.show_number(Range(1.0, 100_000.0, logarithmic=True, whole=True), 3.0)
    qtbot.keyClick(slider, Qt.Key.Key_Right)
    qtbot.keyClick(slider, Qt.Key.Key_Left)
    assert [value for value, _ in slider.told] == [4.0, 3.0]


def test_a_drag_is_held_until_it_is_let_go(slider: Any, qtbot: Any) -> None:
    QTest.mousePress(slider, Qt.MouseButton.LeftButton, pos=QPoint(111, 16))
    assert slider.dragged
    QTest.mouseMove(slider, QPoint(150, 16))
    QTest.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=QPoint(150, 16))
    values, held = zip(*slider.told, strict=True)
    assert held == (*[True] * (len(held) - 1), False)
    assert values[0] == pytest.approx(5.0, abs=0.1)
    assert values[-1] == values[-2] > values[0]
    assert not slider.dragged


def test_a_double_click_goes_back_to_the_tick(slider: Any) -> None:
    QTest.mouseDClick(slider, Qt.MouseButton.LeftButton, pos=QPoint(200, 16))
    assert slider.told[-1] == (2.5, False)
    assert slider.number == 2.5


def test_the_wheel_scrolls_the_page_and_not_the_slider(qtbot: Any) -> None:
    slider, told = Slider(), []
    slider.show_number(Range(0.0, 10.0), 4.0)
    slider.slid.connect(lambda value, _held: told.append(value))
    area, inside = QScrollArea(), QWidget()
    column = QVBoxLayout(inside)
    column.addWidget(slider)
    inside.setMinimumHeight(2000)
    area.setWidget(inside)
    area.resize(300, 200)
    qtbot.addWidget(area)
    area.show()
    slider.setFocus()
    place = QPointF(20, 16)
    turn = QWheelEvent(
        place, slider.mapToGlobal(place), QPoint(), QPoint(0, -120), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(slider, turn)
    assert told == []
    assert slider.number == 4.0
    assert not turn.isAccepted()


def test_a_screen_reader_can_set_it(slider: Any) -> None:
    slider.setValue(100)
    assert slider.told == [(5.0, False)]
    slider.show_number(Range(0.0, 10.0), 7.5)
    assert slider.value() == 150
    assert len(slider.told) == 1
