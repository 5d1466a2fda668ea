"""The photodiode's square: it toggles when a movement begins."""

from PySide6.QtCore import QPoint
from PySide6.QtGui import QColor

from study_app.gui.participant.tank.onset_patch import OnsetPatch
from study_app.gui.participant.tank.photodiode_patch import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.small import task_page, view


def onsets(patch: OnsetPatch, speeds_mps: list[float], step_ns: int = 10_000_000) -> list[bool]:
    place, lit = 0.0, []
    patch.follow((0, 0, 0), 0)
    for index, speed in enumerate(speeds_mps, 1):
        place += speed * step_ns / 1e9
        lit.append(patch.follow((place, 0, 0), index * step_ns))
    return lit


def test_patch_toggles_once_when_a_movement_begins() -> None:
    assert onsets(OnsetPatch(), [0, 0, 0.1, 0.2, 0.1]) == [False, False, True, True, True]


def test_patch_toggles_again_only_after_a_rest() -> None:
    assert onsets(OnsetPatch(), [0.1, 0, 0, 0.1]) == [True] * 4
    assert onsets(OnsetPatch(), [0.1, *[0] * 10, 0.1])[-1] is False


def test_patch_is_not_moved_by_drift_and_does_not_miss_a_gentle_start() -> None:
    assert not any(onsets(OnsetPatch(), [0.005] * 40))
    assert onsets(OnsetPatch(), [0, 0, 0.012, 0.05])[-1] is True


def test_patch_in_the_corner_turns_white_at_the_onset(tank: TankWidget) -> None:
    corner = QPoint(tank.width() - 10, tank.height() - 10)
    tank.show_view(view((0, 0, 0), sample_ns=1_000_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("black")
    tank.show_view(view((0.002, 0, 0), sample_ns=1_016_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("white")
    edge = QPoint(round(tank.width() - PATCH[0]) + 3, tank.height() - 10)
    assert tank.grab().toImage().pixelColor(edge) == QColor("black")


def test_the_photodiodes_square_can_be_switched_off(qtbot):
    corners = {}
    for photodiode in (True, False):
        widget = TankWidget(task_page(), words("en"), photodiode=photodiode)
        qtbot.addWidget(widget)
        widget.resize(1366, 768)
        widget.show()
        widget.show_view(view())
        image = widget.grab().toImage()
        corners[photodiode] = image.pixelColor(image.width() - 82, image.height() - 82).name()
        assert ("patch" in widget.things) is photodiode
    assert corners[True] == "#000000"
    assert corners[False] != "#000000"
