"""Esc held in any window of the program is zero force at the next tick, with a fake servo and with a real one."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QGuiApplication, QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QLineEdit, QVBoxLayout, QWidget

from study_app.app.session.bridge import SessionBridge
from study_app.gui.widgets import main_view as escape_key
from study_app.session.pages import PausePage, TaskPage
from study_app.session.transitions.events import Continue
from tests.app.world import World, begin_trial
from tests.compiled import needs_servo

pytestmark = pytest.mark.slow

Bridge = SessionBridge
ESC = Qt.Key.Key_Escape
HOLD_MS = 60
LONG_MS = 600_000


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the hold; its real duration is tested with the windows."""
    monkeypatch.setattr(escape_key, "HOLD_MS", HOLD_MS)


def foreign(parent: QWidget | None) -> QDialog:
    """Return a foreign dialog with the focus in one of its fields."""
    dialog = QDialog(parent)
    field = QLineEdit()
    QVBoxLayout(dialog).addWidget(field)
    dialog.show()
    field.setFocus()
    return dialog


def participant(bridge: Bridge) -> QWidget:
    return bridge.participant


def operator(bridge: Bridge) -> QWidget:
    bridge.operator.notes.field.setFocus()
    return bridge.operator


def asking(ask: str) -> Callable[[Bridge], QWidget]:
    """Return a function that opens a question of the operator's window."""

    def open_(bridge: Bridge) -> QWidget:
        getattr(bridge.operator, ask)()
        assert bridge.operator.question is not None
        return bridge.operator.question

    open_.__name__ = ask
    return open_


repeating, ending = (asking(f"ask_to_{what}") for what in ("repeat", "end"))


def message_window(bridge: Bridge) -> QWidget:
    bridge.operator.show_message("The display could not be measured", "It was disconnected.")
    return next(dialog for dialog in bridge.operator.findChildren(QDialog) if dialog.isVisible())


def above_the_operator(bridge: Bridge) -> QWidget:
    return foreign(bridge.operator)


def by_itself(bridge: Bridge) -> QWidget:
    bridge.kept = foreign(None)  # type: ignore[attr-defined]  # goes with the bridge
    return bridge.kept  # type: ignore[attr-defined,no-any-return]


WINDOWS = (participant, operator, repeating, ending, message_window, above_the_operator, by_itself)
every_window = pytest.mark.parametrize("open_", WINDOWS, ids=lambda opener: opener.__name__)
# What a key leads to is the same in all: that it arrives in each of them is `test_held_escape_stops_the_force`.
two_windows = pytest.mark.parametrize(
    "open_",
    [*WINDOWS[:2], *(pytest.param(opener, marks=pytest.mark.nightly) for opener in WINDOWS[2:])],
    ids=lambda opener: opener.__name__,
)


def in_focus(window: QWidget, qtbot: Any) -> QWindow:
    """Activate ``window`` and return the handle that receives its keys."""
    window.activateWindow()
    handle: QWindow = window.windowHandle()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is handle)
    return handle


@every_window
def test_held_escape_stops_the_force(
    bridge: Bridge, world: World, qtbot: Any, open_: Callable[[Bridge], QWidget]
) -> None:
    begin_trial(bridge, world)
    assert world.force_is_on
    handle = in_focus(open_(bridge), qtbot)
    QTest.keyPress(handle, ESC)
    qtbot.waitUntil(lambda: not world.force_is_on)
    by = "participant" if open_ is participant else "operator"
    assert ("force_stopped", {"by": by}) in world.done
    assert world.events().count("force_stopped") == 1
    assert isinstance(bridge.participant.page, PausePage)


@two_windows
def test_tapped_escape_leaves_the_force(
    bridge: Bridge, world: World, qtbot: Any, open_: Callable[[Bridge], QWidget]
) -> None:
    holds = bridge.operator.escape, bridge.participant.findChild(escape_key.EscapeKey)
    timers = [hold.findChild(QTimer) for hold in holds]
    for timer in timers:
        timer.setInterval(LONG_MS)  # the release comes before, however slow the machine is
    begin_trial(bridge, world)
    window = open_(bridge)
    QTest.keyPress(in_focus(window, qtbot), ESC)
    assert any(timer.isActive() for timer in timers)
    gone = window not in (bridge.operator, bridge.participant)  # Esc is a dialog's way back
    QTest.keyRelease(in_focus(bridge.operator if gone else window, qtbot), ESC)
    assert not any(timer.isActive() for timer in timers)
    assert world.force_is_on


def test_a_question_that_goes_with_the_press_ends_no_hold(bridge: Bridge, world: World, qtbot: Any) -> None:
    begin_trial(bridge, world)
    handle = in_focus(ending(bridge), qtbot)
    QTest.keyPress(handle, ESC)
    assert bridge.operator.question is None  # Esc is its way back
    in_focus(bridge.operator, qtbot)
    qtbot.waitUntil(lambda: not world.force_is_on)


@pytest.mark.parametrize("open_", [ending, message_window], ids=lambda opener: opener.__name__)
def test_a_dialog_that_goes_leaves_the_keyboard_to_somebody(
    bridge: Bridge, world: World, qtbot: Any, open_: Callable[[Bridge], QWidget]
) -> None:
    begin_trial(bridge, world)
    in_focus(open_(bridge), qtbot)
    QTest.keyClick(QGuiApplication.focusWindow(), ESC)
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is not None)
    QTest.keyPress(QGuiApplication.focusWindow(), ESC)
    qtbot.waitUntil(lambda: not world.force_is_on)


def test_raising_a_window_keeps_a_hold_and_key_repetition_is_ignored(bridge: Bridge, world: World, qtbot: Any) -> None:
    begin_trial(bridge, world)
    QTest.keyPress(in_focus(bridge.participant, qtbot), ESC)
    handle = in_focus(bridge.operator, qtbot)
    QTest.keyPress(handle, ESC)  # as a window hears it that got the keyboard while the key was down
    qtbot.waitUntil(lambda: "force_stopped" in world.events())
    assert not world.force_is_on
    assert ("force_stopped", {"by": "operator"}) in world.done
    assert world.events().count("force_stopped") == 1


class Real(World):
    """A world whose servo is real and whose hand goes to and fro through a thick liquid."""

    def __init__(self, servo: Any) -> None:
        super().__init__()
        self.servo = servo

    def seconds(self) -> float:
        return float(self.servo.now_ns() / 1e9)

    def forces_n(self, ticks: int) -> Any:
        """Let ticks pass and return the size of the force at each."""
        reader = self.servo.telemetry.reader()
        self.servo.advance(ticks)
        return np.linalg.norm(reader.read().device_force_n, axis=1)


@pytest.fixture
def real() -> Iterator[Real]:
    from study_app.devices.simulated import ScriptedDevice
    from study_app.haptics.runtime.clocks import VirtualClock
    from study_app.haptics.runtime.servo import Servo

    device = ScriptedDevice()
    with device, Servo(device, clock=VirtualClock(), elements=2000) as servo:
        t_s = np.arange(0, 60, 0.005)
        device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0 * t_s, 0 * t_s)))
        yield Real(servo)


@needs_servo
@two_windows
def test_the_servo_sends_no_force_from_the_next_tick_on(
    make: Any, real: Real, qtbot: Any, open_: Callable[[Bridge], QWidget]
) -> None:
    bridge = make(servo=real.servo, journal=real, clock=real.seconds)
    bridge.participant.event.emit(Continue(real.seconds()))
    assert isinstance(bridge.participant.page, TaskPage)
    with qtbot.waitExposed(bridge.participant):
        pass
    bridge.draw_frame()  # the first one of the tank, with which the force begins
    assert real.forces_n(800).max() > 0.1
    handle = in_focus(open_(bridge), qtbot)
    QTest.keyPress(handle, ESC)
    qtbot.waitUntil(lambda: not real.servo.force_is_on)
    assert not real.forces_n(1).any()
    assert not real.forces_n(500).any()
