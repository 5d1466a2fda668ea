"""The pre-flight window: a stopped servo is reported, and going back does not wait."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.app.session import preflight_controller
from study_app.app.session.live_session import LiveSession
from study_app.app.session.preflight_controller import Appraisal, Preflight
from study_app.errors import DeviceLost, DisplayError
from study_app.evidence.appraisal import Costs, DeliveryQuestion, Errors, Question
from study_app.gui.theme.theme import LIGHT
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.runtime.grants import NO_THREAD
from study_app.haptics.runtime.telemetry import Timing
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.load import load
from study_app.protocol.trials.tasks import Stroke
from study_app.session.preflight import Masking, Measurements, PredictedDelivery
from study_app.session.start import NewSession, Ready
from tests.session import small
from tests.session.small import CHOSEN

FACTS = replace(
    small.WELL,
    timing=Timing(ticks=2000, rate_hz=1000.0, lateness_p99_s=6e-5, worst_gap_s=2e-3, overruns=0),
    participant="P001",
    grant=NO_THREAD,
)

COSTS = Costs(tick_ns=146.0, rest_ns=40.0, effects=())
ERRORS = Errors(wake=0.0, force_n=0.02, lag_s=0.0, left_out=())


class Answering:
    """A replacement of the process that appraises scenes, with given answers."""

    given_answers: tuple[Any, ...] = ()

    def __init__(self) -> None:
        self.question_count = 0
        self.works = True
        self.devices: list[Dynamics] = []

    def order(self, question: Question | DeliveryQuestion) -> int:
        if isinstance(question, Question):
            assert question.stroke is not None
            assert question.stroke.speed_mps > 0
            self.devices.append(question.dynamics)
        self.question_count += 1
        return self.question_count

    def answers(self) -> list[tuple[int, Any]]:
        return (
            [(self.question_count, COSTS), (self.question_count, self.given_answers[self.question_count - 1])]
            if self.given_answers
            else []
        )

    def close(self) -> None:
        self.works = False


class Servo:
    """A servo at rest that is well until its device is lost."""

    lost = False

    def check(self) -> None:
        if self.lost:
            raise DeviceLost("the device 'falcon' does not answer any more; the force is zero")


@pytest.fixture
def machine(monkeypatch: Any) -> Any:
    """Return a replacement of an open device with its servo."""
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    return SimpleNamespace(servo=Servo())


@pytest.fixture
def ask(qapp: Any, machine: Any) -> Iterator[Callable[..., Preflight]]:
    """Return a function that opens the pre-flight of a demo session with given facts and outlets."""
    preflights: list[Preflight] = []

    def ask(facts: Measurements = FACTS, chosen: NewSession = CHOSEN, **options: Any) -> Preflight:
        ready = Ready(machine, facts, **options)
        preflights.append(
            Preflight(chosen, load("demo"), ready, QGuiApplication.primaryScreen, "Participant P001", LIGHT)
        )
        preflights[-1].open()
        return preflights[-1]

    yield ask
    for preflight in preflights:
        preflight.close()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def preflight(ask: Callable[..., Preflight]) -> Preflight:
    return ask()


def rows_of(preflight: Preflight) -> dict[str, str]:
    """Return the rows about the coming session."""
    texts = [label.text() for label in preflight.window.runs.findChildren(QLabel)]
    return dict(zip(texts[1::2], texts[2::2], strict=True))


@pytest.mark.parametrize(("device", "masking"), [("mouse", None), ("falcon", Masking("noise", 60))])
def test_a_session_begins_with_the_measurements_and_answers(
    ask: Callable[..., Preflight], monkeypatch: Any, qtbot: Any, device: str, masking: Masking | None
) -> None:
    errors = [replace(ERRORS, force_n=force_n) for force_n in (0.02, 0.25, 0.13)]
    delivery = PredictedDelivery(missing=0, asked=0, out=0, judged=8, limit_percent=25)
    count = len(preflight_controller.study_scenes(load("demo")))
    monkeypatch.setattr(Answering, "given_answers", (*errors[:count], delivery))
    preflight = ask(chosen=replace(CHOSEN, device=device))
    assert rows_of(preflight)["Expected force error"] == "measuring…"
    qtbot.waitUntil(lambda: preflight.appraisal.is_over)
    qtbot.waitUntil(lambda: rows_of(preflight)["Expected force error"] == "0.25 N")
    assert preflight.window.who.text() == "demo  ·  Participant P001"
    assert preflight._facts.delivery == delivery
    assert preflight._facts.tick_s == pytest.approx(146e-9)
    if preflight.window.masking is not None:
        preflight.window.masking.means.setCurrentIndex(2)
    with qtbot.waitSignal(preflight.started) as started:
        preflight.window.start.click()
    (ready,) = started.args
    assert (ready.masking, ready.rig, ready.facts.tick_s) == (masking, preflight._ready.rig, pytest.approx(146e-9))
    with qtbot.waitSignal(preflight.cancelled):
        preflight.window._done = False
        preflight.window.close()


def test_the_most_expensive_scene_and_the_largest_errors_of_the_velocity_count(monkeypatch: Any) -> None:
    costs_ns, velocities = (120.0, 150.0, 130.0), ((0.1, 0.2), (0.3, 0.05), (0.2, 0.4))
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    answers = [
        [(number, replace(COSTS, tick_ns=tick_ns)), (number, replace(ERRORS, velocity=velocity))]
        for number, (tick_ns, velocity) in enumerate(zip(costs_ns, velocities, strict=True), 1)
    ]
    late = (1, replace(COSTS, tick_ns=900.0))  # of a question that was answered
    monkeypatch.setattr(
        Answering, "answers", lambda self: [late] * (self.question_count > 1) + answers[self.question_count - 1]
    )
    appraisal = Appraisal([preflight_controller.study_scenes(load("demo"))[0]] * 3, UNKNOWN)
    ticks_s = []
    while not appraisal.is_over:
        assert appraisal.read_answers()
        ticks_s.append(appraisal.tick_s)
    assert ticks_s == pytest.approx([120e-9, 150e-9, 150e-9])
    assert appraisal.velocity_errors == (0.3, 0.05)
    assert not appraisal.read_answers()


@pytest.mark.parametrize(
    ("scenes", "has_delivery", "is_over"), [(1, False, False), (0, True, False), (1, True, False), (0, False, True)]
)
def test_an_appraisal_is_over_without_open_questions_or_without_its_process(
    monkeypatch: Any, scenes: int, has_delivery: bool, is_over: bool
) -> None:
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    protocol = load("demo")
    questions = preflight_controller.study_scenes(protocol)[:scenes]
    appraisal = Appraisal(questions, UNKNOWN, DeliveryQuestion(protocol, 2) if has_delivery else None)
    assert appraisal.is_over is is_over
    appraisal.close()
    assert appraisal.is_over


def test_the_row_of_the_force_error_is_hidden_if_its_process_ends_without_an_answer(
    preflight: Preflight, qtbot: Any
) -> None:
    (name,) = (row for row in preflight.window.runs.findChildren(QLabel) if row.text() == "Expected force error")
    assert not name.isHidden()
    preflight.appraisal.close()
    qtbot.waitUntil(name.isHidden)


def test_a_device_lost_meanwhile_is_reported_once(preflight: Preflight, machine: Any, qtbot: Any) -> None:
    errors: list[object] = []
    preflight.failed.connect(errors.append)
    machine.servo.lost = True
    with qtbot.waitSignal(preflight.failed, timeout=3000):
        pass
    assert not preflight.findChild(QTimer).isActive()
    assert [str(error) for error in errors] == ["the device 'falcon' does not answer any more; the force is zero"]


def test_going_back_does_not_wait_for_a_measurement(preflight: Preflight, monkeypatch: Any) -> None:
    begun, waited = threading.Event(), []

    def slow(_machine: Any, _chosen: Any, _videos: Any, *, sleep: Any) -> Measurements:
        begun.set()
        waited.append(sleep(60.0))
        return FACTS

    monkeypatch.setattr(preflight_controller, "measure_rig", slow)
    preflight.window.again_asked.emit()
    measuring = preflight.measuring
    assert measuring.busy
    assert begun.wait(5)
    preflight.close()
    assert measuring.wait(0)
    assert waited == [True]


def test_a_deleted_window_takes_no_screen_from_a_repeated_measurement(
    preflight: Preflight, monkeypatch: Any, qtbot: Any
) -> None:
    """PySide releases a screen with the widget whose ``screen()`` returned it last."""
    monkeypatch.setattr(preflight_controller, "measure_rig", lambda *_words, **_named: FACTS)
    other = QWidget()
    other.screen()
    other.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    preflight.window.again.click()
    qtbot.waitUntil(preflight.window.start.isEnabled, timeout=3000)


def test_a_screen_that_is_removed_meanwhile_ends_the_question(
    preflight: Preflight, monkeypatch: Any, qtbot: Any
) -> None:
    def none_left() -> Any:
        raise DisplayError("screen 2 cannot be used: there is 1 screen")

    monkeypatch.setattr(preflight_controller, "measure_rig", lambda *_words, **_named: FACTS)
    monkeypatch.setattr(preflight, "_screen", none_left)
    with qtbot.waitSignal(preflight.failed, timeout=3000) as failure:
        pass
    assert "cannot be used" in str(failure.args[0])
    with qtbot.waitSignal(preflight.failed, timeout=3000):
        preflight.window.again.click()


def test_a_session_on_two_screens_asks_about_the_participants(machine: Any, monkeypatch: Any, qapp: Any) -> None:
    live = LiveSession(CHOSEN, LIGHT)
    participants = SimpleNamespace(refreshRate=lambda: 75.0, devicePixelRatio=lambda: 1.5)
    monkeypatch.setattr(live, "chosen_screens", lambda: (participants, QGuiApplication.primaryScreen()))
    live._show_preflight(Ready(machine, FACTS))
    assert live.preflight is not None
    said = [label.text() for label in live.preflight.window.findChildren(QLabel)]
    assert "75.0 Hz, 150 %" in said
    preflight = live.preflight
    live.end_by_signal(15)
    assert not preflight.window.isVisible(), "no question stays without its session"
    assert isinstance(preflight.appraisal.appraiser, Answering)
    assert not preflight.appraisal.appraiser.works


class ConnectedLater:
    """Outlets with one stream, to which a recording program is connected when a test says so."""

    listens = False

    def statuses(self) -> tuple[OutletStatus, ...]:
        return (OutletStatus(title="LSL markers", listens=self.listens),)


def test_a_recording_program_that_is_connected_meanwhile_is_shown(ask: Callable[..., Preflight], qtbot: Any) -> None:
    outlets = ConnectedLater()
    preflight = ask(outlets=outlets)

    def shown() -> list[str]:
        return [label.text() for label in preflight.window.findChildren(QLabel) if label.isVisible()]

    assert "no listener" in shown()
    outlets.listens = True
    qtbot.waitUntil(lambda: "listener" in shown())
    assert "no listener" not in shown()


def test_strokes_are_asked_of_the_measured_device_and_again_when_its_delay_has_changed(
    ask: Callable[..., Preflight], monkeypatch: Any, qtbot: Any
) -> None:
    measured = replace(FACTS, dynamics=Dynamics(delay_s=0.0004, count_m=20e-6, mass_kg=0.3), delay_ticks=1)
    preflight = ask(measured)
    first: Any = preflight.appraisal.appraiser
    assert first.devices == [Dynamics(delay_s=0.001, count_m=20e-6, mass_kg=0.3)]
    slower = replace(measured, delay_ticks=3)
    monkeypatch.setattr(preflight_controller, "measure_rig", lambda *_words, **_named: slower)
    preflight.window.again_asked.emit()
    qtbot.waitUntil(lambda: not preflight.measuring.busy)
    again: Any = preflight.appraisal.appraiser
    assert again.devices == [Dynamics(delay_s=0.003, count_m=20e-6, mass_kg=0.3)]
    assert not first.works


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_mistake_in_measuring_does_not_leave_the_window_waiting(
    preflight: Preflight, monkeypatch: Any, qtbot: Any
) -> None:
    def broken(*_words: Any, **_named: Any) -> Measurements:
        raise ValueError("no samples")

    monkeypatch.setattr(preflight_controller, "measure_rig", broken)
    with qtbot.waitSignal(preflight.failed) as failed:
        preflight.window.again_asked.emit()
    assert isinstance(failed.args[0], ValueError)
    assert not preflight.measuring.busy
    for thread in threading.enumerate():
        if thread.name == "background":
            thread.join(10)  # it reports its exception within this test


@pytest.mark.parametrize(
    ("answers", "largest"),
    [
        (
            (
                Errors(wake=0.0, force_n=0.02, lag_s=0.0, left_out=()),
                Errors(wake=0.0, force_n=0.04, lag_s=0.0, left_out=()),
            ),
            0.04,
        ),
        (
            (
                Errors(wake=0.0, force_n=0.02, lag_s=0.0, left_out=()),
                Errors(wake=None, force_n=None, lag_s=0.0, left_out=()),
            ),
            None,
        ),
        (("it could not be measured", Errors(wake=0.0, force_n=0.02, lag_s=0.0, left_out=())), None),
    ],
)
def test_an_unknown_error_is_not_reported_as_zero(monkeypatch: Any, answers: Any, largest: float | None) -> None:
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    monkeypatch.setattr(Answering, "given_answers", answers)
    protocol = load("demo")
    question = preflight_controller.study_scenes(protocol)[0]
    appraisal = Appraisal([question, question], UNKNOWN)
    while not appraisal.is_over:
        appraisal.read_answers()
    assert appraisal.error_n == largest
    assert appraisal.tick_s == pytest.approx(146e-9)


def test_the_share_withheld_is_asked_of_each_liquid_in_the_fastest_stroke_of_its_tasks(monkeypatch: Any) -> None:
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    protocol = load("rek2024")
    questions = preflight_controller.study_scenes(protocol)
    assert {question.liquid for question in questions} == set(protocol.liquids)
    assert {question.stroke for question in questions if question.liquid == "honey"} == {
        Stroke(5.0, 0.03)
    }  # it is explored
    monkeypatch.setattr(
        Answering,
        "given_answers",
        tuple(
            Errors(wake=0.0, force_n=0.0, lag_s=0.0, left_out=(), withheld=0.01 * (n + 1))
            for n in range(len(questions))
        ),
    )
    appraisal = Appraisal(questions, UNKNOWN)
    assert appraisal.withheld is None
    while not appraisal.is_over:
        appraisal.read_answers()
    assert appraisal.withheld == {
        name: pytest.approx(0.01 * (1 + max(n for n, question in enumerate(questions) if question.liquid == name)))
        for name in protocol.liquids
    }


@pytest.mark.parametrize(
    "answer", [PredictedDelivery(missing=26, asked=40, out=0, judged=0, limit_percent=25), "it could not be predicted"]
)
def test_the_trials_that_would_not_be_delivered_are_asked_last(monkeypatch: Any, answer: Any) -> None:
    monkeypatch.setattr(preflight_controller, "start_appraisal_worker", Answering)
    monkeypatch.setattr(Answering, "given_answers", (Errors(wake=0.0, force_n=0.02, lag_s=0.0, left_out=()), answer))
    protocol = load("demo")
    questions = preflight_controller.study_scenes(protocol)[:1]
    appraisal = Appraisal(questions, UNKNOWN, DeliveryQuestion(protocol, 1))
    while not appraisal.is_over:
        appraisal.read_answers()
    assert appraisal.error_n == 0.02
    assert appraisal.delivery == (answer if isinstance(answer, PredictedDelivery) else None)
