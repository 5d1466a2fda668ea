"""The pages of a trial design's question, feedback, and the controls for setting a level."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QImage, QKeyEvent, QPainter, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.pages.page_widget import draw_progress
from study_app.gui.participant.window import PointerCapture
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import Interval, Progress, TaskPage
from study_app.session.transitions.events import Continue, PauseRequested, Stepped, Submitted
from tests.gui.participant.driver import KEY, Participant
from tests.gui.small import ORDINALS, choice, follow, number, task_page, view

Opening = Callable[..., Participant]
STEP_MS = 125
"""Between two steps of a key that is held."""
FULL, SMALL = (1366, 768), (1024, 640)
NONE = Qt.KeyboardModifier.NoModifier


def values(participant: Participant) -> list[Any]:
    return [value for _, value in participant.answers]


@pytest.mark.parametrize(
    ("key", "language", "value"),
    [
        (KEY.Key_1, "en", "first"),
        (KEY.Key_2, "en", "second"),
        (KEY.Key_Left, "en", "first"),
        (KEY.Key_Right, "en", "second"),
        (KEY.Key_1, "ar", "first"),
        (KEY.Key_Right, "ar", "first"),
        (KEY.Key_Left, "ar", "second"),
    ],
)
def test_one_key_answers_and_continues_once(opening: Opening, key: KEY, language: str, value: str) -> None:
    participant = opening(choice(language=language), FULL, language)
    first, second = (participant.find(words(language).design_answers[name]) for name in ORDINALS[:2])
    assert (first.x() > second.x()) == (language == "ar")
    held = QKeyEvent(QEvent.Type.KeyPress, KEY.Key_2, NONE, "2", True)
    QApplication.sendEvent(participant.page, held)
    assert values(participant) == [], "a key that is held from the page before"
    participant.press(key, KEY.Key_2)
    assert values(participant) == [value]
    assert participant.kinds.count(Submitted) == 1


@pytest.mark.parametrize(("language", "on", "back"), [("en", "Right", "Left"), ("ar", "Left", "Right")])
def test_each_arrow_goes_to_the_next_of_three_answers_and_enter_chooses_it(
    opening: Opening, language: str, on: str, back: str
) -> None:
    participant, passed = opening(choice(3, language), FULL, language), []
    for way in (on, on, on, on, back):
        participant.press(KEY[f"Key_{way}"])
        passed.append(participant.focus.accessibleName())
    assert passed == [words(language).design_answers[ORDINALS[at]] for at in (0, 1, 2, 0, 2)]
    participant.press(KEY.Key_Return)
    assert (values(participant), participant.kinds.count(Submitted)) == ([ORDINALS[2]], 1)


@pytest.mark.parametrize("typed", ["12", "2.5", "2,5", "1e3", "", "0", "-3", "many", "nan", "inf", "1e400"])
def test_a_positive_number_is_accepted_and_other_input_is_reported(opening: Opening, typed: str) -> None:
    accepted = {"12": [12], "2.5": [2.5], "2,5": [2.5], "1e3": [1000]}.get(typed, [])
    participant = opening(number(), FULL)
    participant.type(typed)
    participant.press(KEY.Key_Return)
    assert values(participant) == accepted
    assert participant.texts.count("Enter a number above 0.") == (1 if accepted else 2)  # the question, and the refusal
    if not accepted:
        participant.type("4")
        assert participant.texts.count("Enter a number above 0.") == 1


@pytest.mark.parametrize(("language", "typed"), [("en", "2,500"), ("de", "2.500")])
def test_an_ambiguous_estimate_is_requested_again(opening: Opening, language: str, typed: str) -> None:
    participant = opening(number(), FULL, language)
    participant.type(typed)
    participant.press(KEY.Key_Return)
    assert values(participant) == []
    assert words(language).unclear_number(typed) in participant.texts
    participant.type("2500")
    participant.press(KEY.Key_Return)
    assert values(participant) == [2500]


def interval(*, adjusts: bool = False, language: str = "en", resting: bool = False) -> TaskPage:
    at = 2 if adjusts or resting else 1
    announced = "Next: the second" if resting else ("First of 2", "Second of 2")[at - 1]
    task = follow().lasting(60.0) if adjusts else follow()
    question = words(language).design_questions["adjustment"]
    return replace(task_page(task, question=question, interval=Interval(at, 2, resting, announced)), adjusts=adjusts)


def setting(participant: Participant, language: str = "en") -> Any:
    """Show standard, rest and adjustable interval as a session does; return the controls."""
    for page in (interval(language=language), interval(resting=True), interval(adjusts=True, language=language)):
        participant.window.show_page(page)
        QApplication.processEvents()
    return participant.page.controls


def steps(participant: Participant) -> list[int]:
    return [event.steps for event in participant.events if isinstance(event, Stepped)]


def test_a_key_that_is_held_steps_eight_times_a_second_and_stops_with_it(participant: Participant, qtbot: Any) -> None:
    setting(participant)
    QTest.keyPress(participant.window, KEY.Key_Right)
    for _ in range(20):  # the system's own repetition, 30 a second or another rate
        QApplication.sendEvent(participant.window, QKeyEvent(QEvent.Type.KeyPress, KEY.Key_Right, NONE, "", True))
    assert steps(participant) == [1]
    began_s = time.perf_counter()
    qtbot.waitUntil(lambda: len(steps(participant)) >= 5)
    assert time.perf_counter() - began_s >= 0.95 * 4 * STEP_MS / 1000
    QTest.keyPress(participant.window, KEY.Key_Left)
    QTest.keyRelease(participant.window, KEY.Key_Right)
    right = len(steps(participant))
    qtbot.waitUntil(lambda: len(steps(participant)) >= right + 2)
    QTest.keyRelease(participant.window, KEY.Key_Left)
    held = len(steps(participant))
    qtbot.wait(3 * STEP_MS)
    assert len(steps(participant)) == held
    assert set(steps(participant)[: right - 1]) == {1}
    assert set(steps(participant)[right:]) == {-1}, "letting go of one arrow keeps the other"


def test_nothing_steps_in_the_rest_that_follows(participant: Participant, qtbot: Any) -> None:
    setting(participant)
    QTest.keyPress(participant.window, KEY.Key_Right)
    participant.window.show_page(interval(resting=True))
    before = len(steps(participant))
    qtbot.wait(3 * STEP_MS)
    QTest.keyClick(participant.window, KEY.Key_Left)
    QTest.keyClick(participant.window, KEY.Key_Return)
    QApplication.sendEvent(participant.window, wheel(participant.page, 120))
    assert len(steps(participant)) == before
    assert Submitted not in participant.kinds


def wheel(widget: QWidget, eighths: int) -> QWheelEvent:
    place = QPointF(widget.rect().center())
    turn, none = QPoint(0, eighths), Qt.MouseButton.NoButton
    return QWheelEvent(
        place, widget.mapToGlobal(place), QPoint(), turn, none, NONE, Qt.ScrollPhase.NoScrollPhase, False
    )


def test_arrows_and_the_wheel_step_at_once_forwards_more_and_enter_confirms(participant: Participant) -> None:
    setting(participant)
    participant.press(*[KEY.Key_Right] * 3, KEY.Key_Left)
    unheard = wheel(participant.page, 120)
    QApplication.sendEvent(participant.page, unheard)
    assert not unheard.isAccepted()  # Qt gives it to the window
    for turned in (120, -240, *[30] * 4):  # a touchpad's turns are smaller
        QApplication.sendEvent(participant.window, wheel(participant.page, turned))
    assert steps(participant) == [1, 1, 1, -1, 1, -2, 1]
    participant.press(KEY.Key_Return)
    assert participant.kinds[-1] is Submitted
    participant.press(KEY.Key_Space)
    assert Continue not in participant.kinds


def test_the_mouse_presses_and_holds_the_buttons(participant: Participant, qtbot: Any) -> None:
    controls = setting(participant)
    participant.click(controls.less)
    participant.click(controls.more)
    assert steps(participant) == [-1, 1]
    qtbot.mousePress(controls.more, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(steps(participant)) >= 4)
    qtbot.mouseRelease(controls.more, Qt.MouseButton.LeftButton)
    assert set(steps(participant)[1:]) == {1}
    participant.click(controls.done)
    assert participant.kinds[-1] is Submitted
    assert participant.window.hasFocus()
    QTest.keyClick(participant.window, KEY.Key_Escape)
    qtbot.waitUntil(lambda: PauseRequested in participant.kinds)


def test_with_the_mouse_as_device_keys_are_named_and_buttons_hidden(captured: Participant) -> None:
    controls = setting(captured)
    captured.window.show_view(view(lit=0, target_m=(0.0, 0.0, 0.0)))
    assert controls.isHidden()
    assert captured.page.parts["hint"].state == "← Less · More → · Enter: Done"
    QTest.keyClick(captured.window, KEY.Key_Left)
    assert steps(captured) == [-1]
    captured.window.findChild(PointerCapture).pressed.emit(1)
    assert captured.buttons == [1]  # the session hears it as the device's first button


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(("size", "text_scale"), [(SMALL, 1.0), (FULL, 2.0)])
def test_buttons_are_within_the_window_large_enough_and_cover_no_word(
    opening: Opening, language: str, size: tuple[int, int], text_scale: float
) -> None:
    participant = opening(None, size, language, text_scale)
    controls = setting(participant, language)
    participant.window.show_view(view(lit=0, target_m=(0.0, 0.0, 0.0)))
    participant.settle()
    assert participant.page.rect().contains(controls.geometry())
    buttons = (controls.less, controls.more, controls.done)
    assert min(min(button.height(), button.width()) for button in buttons) >= 44
    assert controls.less.x() < controls.more.x() < controls.done.x()
    covered = controls.geometry()
    controls.move(-covered.width(), 0)
    below = participant.page.grab(covered).toImage().convertToFormat(QImage.Format.Format_Grayscale8)
    greys = np.frombuffer(below.constBits(), np.uint8).reshape(below.height(), -1)[:, : below.width()]
    assert int(greys.max()) - int(greys.min()) < 40, "a word is below the controls"


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_head_of_a_trial_of_intervals_stays_in_its_room(qapp: QApplication, language: str) -> None:
    scale, room = 2.0, QRectF(0, 0, 360, 40)
    progress = Progress(part=1, parts=2, label=words(language).trial + " 57", index=57, of=220, at_most=True)
    painter = QPainter(image := QImage(400, 40, QImage.Format.Format_RGB32))
    before = painter.font(), painter.pen(), painter.layoutDirection()
    end = draw_progress(painter, room, progress, words(language), scale=scale)
    assert (painter.font(), painter.pen(), painter.layoutDirection()) == before
    painter.end()
    assert not image.isNull()
    assert end <= room.width() + 10 * scale + 1


def test_a_head_without_words_has_bars_only(qapp: QApplication) -> None:
    """A break between the trials of the only part has neither part nor label."""
    painter = QPainter(image := QImage(400, 40, QImage.Format.Format_RGB32))
    progress = Progress(part=1, parts=1, label="", index=2, of=3)
    end = draw_progress(painter, QRectF(0, 0, 360, 40), progress, words("en"))
    painter.end()
    assert not image.isNull()
    assert end > 100  # three bars of 40 px
