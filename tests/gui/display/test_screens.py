"""A window stands on its screen with its frame."""

from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget

from study_app.errors import DisplayError
from study_app.gui.display import screens
from study_app.gui.display.screens import (
    choose_screens,
    describe_screen,
    has_graphics_card,
    place_window,
    screen_shown,
    screens_shown,
)

pytestmark = pytest.mark.slow


def test_window_as_large_as_the_screen_makes_room_for_a_frame_that_comes_late(qtbot) -> None:
    room = QGuiApplication.primaryScreen().availableGeometry()
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(room.size())
    place_window(window, window.screen(), corner=False)
    qtbot.wait(600)  # until then it has no frame
    window.show()
    qtbot.waitExposed(window)
    qtbot.waitUntil(lambda: room.contains(window.frameGeometry()))
    assert window.frameGeometry() != window.geometry()
    assert window.frameGeometry().size() == room.size()


def test_window_that_fits_or_fills_the_screen_keeps_size_and_least_size(qtbot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.setMinimumSize(QSize(300, 200))
    window.resize(500, 400)
    place_window(window, window.screen(), corner=True)
    window.show()
    qtbot.waitExposed(window)
    qtbot.wait(400)
    assert window.size() == QSize(500, 400)
    assert window.minimumSize() == QSize(300, 200)
    window.showFullScreen()
    qtbot.wait(400)
    assert window.windowState() & Qt.WindowState.WindowFullScreen
    assert window.size() == window.screen().size()


def screen(name: str, scaling: float = 1.0, refresh_hz: float = 60.0) -> Any:
    return SimpleNamespace(
        name=lambda: name, size=lambda: QSize(1920, 1080), physicalSize=lambda: QSize(527, 296),
        refreshRate=lambda: refresh_hz, devicePixelRatio=lambda: scaling, physicalDotsPerInch=lambda: 92.54,
    )  # fmt: skip


@pytest.fixture
def three(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    screen_list = [screen("A"), screen("B", 1.5, 143.8567), screen("C")]
    monkeypatch.setattr(screens, "QGuiApplication", SimpleNamespace(screens=lambda: screen_list))
    return screen_list


def test_the_participant_has_the_chosen_screen_or_the_last_and_the_operator_the_first_other(three: list[Any]) -> None:
    a, b, c = three
    assert [choose_screens(number) for number in (None, 1, 2, 3)] == [(c, a), (a, b), (b, a), (c, a)]
    for number in (0, 4):
        with pytest.raises(DisplayError, match=rf"screen {number} .* there are 3 screens; choose a number from 1 to 3"):
            choose_screens(number)
    three[1:] = []
    assert choose_screens(None) == (a, a)
    with pytest.raises(DisplayError, match="there is 1 screen; choose a number from 1 to 1"):
        choose_screens(2)


def test_a_screen_is_described_in_logical_pixels_and_named_in_its_own(three: list[Any]) -> None:
    described = screen_shown(three[1])
    assert (described.number, described.name, described.width_px, described.height_px) == (2, "B", 1920, 1080)
    assert (described.refresh_hz, described.scaling, described.width_mm, described.height_mm) == (
        143.8567,
        1.5,
        527,
        296,
    )
    assert described.words == "2880 × 1620, 144 Hz, 150\u202f%"
    assert [shown_screen.name for shown_screen in screens_shown()] == ["A", "B", "C"]
    assert describe_screen(three[1]) == {
        "name": "B", "number": 2, "size_px": [1920, 1080], "refresh_hz": 143.857, "scaling": 1.5, "dots_per_inch": 92.5
    }  # fmt: skip


@pytest.mark.parametrize(
    ("corner", "size", "least", "place"),
    [
        (False, (400, 300), (0, 0), (210, 120, 400, 300)),
        (True, (400, 300), (0, 0), (410, 220, 400, 300)),
        (False, (900, 300), (0, 0), (10, 120, 800, 300)),
        (True, (400, 300), (1000, 0), (10, 220, 1000, 300)),
    ],
)
def test_a_window_is_in_the_middle_or_the_lower_right_corner(qtbot, corner, size, least, place) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.setMinimumSize(*least)
    window.resize(*size)
    area = QRect(QPoint(10, 20), QSize(800, 500))
    assert screens._rectangle_inside(window, area, corner=corner).getRect() == place


@pytest.mark.parametrize(
    ("renderer", "has_card"),
    [(None, False), ("NVIDIA GeForce", True), ("llvmpipe (LLVM 15)", False), ("Microsoft Basic Render Driver", False)],
)
def test_software_rendering_does_not_count_as_a_graphics_card(
    monkeypatch: pytest.MonkeyPatch, renderer: str | None, has_card: bool
) -> None:
    monkeypatch.setattr(screens, "opengl_renderer", lambda: renderer)
    assert has_graphics_card() is has_card
