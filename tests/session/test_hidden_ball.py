"""A hidden ball is drawn while the target starts, as late as everything else, and not while it is felt."""

from typing import Any

import pytest

from study_app.haptics.model.scene import Scene
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks.explore import Explore
from study_app.protocol.trials.tasks.follow import Follow
from study_app.session.tasks import TaskView
from study_app.session.transitions.commands import StartTrial
from study_app.session.trial import SETTLED_S, RunningTrial
from study_app.session.trial_recording import Recording
from tests.session.fakes import FakeServo

SWING = Follow(kind="follow")
DELAY_S = 0.1


def begun(task: Any, *, hides_ball: bool) -> tuple[RunningTrial, FakeServo]:
    servo = FakeServo([])
    servo.run(0.2)
    reader = servo.telemetry.reader()
    command = StartTrial(1, 1, task, Stimulated("damper"), DELAY_S, DELAY_S)
    recording = Recording(None, servo.rate_hz)
    trial = RunningTrial(
        command,
        Scene(),
        late_s=0.05,
        servo=servo,
        reader=reader,
        recording=recording,
        paints=False,
        hides_ball=hides_ball,
    )
    reader.read()
    trial.frame(servo.now_ns(), servo.now_ns())
    return trial, servo


def hidden_after(trial: RunningTrial, servo: FakeServo, seconds: float) -> list[tuple[float, bool]]:
    """Return (elapsed time that is drawn, whether the ball is hidden) every 10 ms."""
    seen = []
    for _ in range(round(seconds * 100)):
        servo.run(0.01)
        trial.follow(servo.telemetry.read())
        view = trial.view(servo.now_ns())
        seen.append((view.task.elapsed_s, view.ball_hidden))
    return seen


@pytest.mark.slow
def test_a_hidden_ball_is_drawn_during_the_lead_and_not_after_it() -> None:
    trial, servo = begun(SWING, hides_ball=True)
    seen = hidden_after(trial, servo, 5.0)
    assert {hidden for elapsed_s, hidden in seen if elapsed_s < SWING.lead_s} == {False}
    assert {hidden for elapsed_s, hidden in seen if elapsed_s >= SWING.lead_s} == {True}
    newest_s = seen[150][0]
    assert newest_s == pytest.approx(1.51 - DELAY_S - SETTLED_S, abs=0.0021)  # hidden as late as it is drawn


@pytest.mark.slow
def test_a_ball_that_is_shown_stays() -> None:
    trial, servo = begun(SWING, hides_ball=False)
    assert not any(hidden for _, hidden in hidden_after(trial, servo, 4.5))


def test_without_a_lead_a_hidden_ball_is_never_drawn() -> None:
    trial, servo = begun(Explore(kind="explore", min_s=1, max_s=2, instruction="Stir."), hides_ball=True)
    assert all(hidden for _, hidden in hidden_after(trial, servo, 1.0))


def test_the_target_is_drawn_where_it_was() -> None:
    trial, servo = begun(SWING, hides_ball=True)
    hidden_after(trial, servo, 2.0)
    drawn: TaskView = trial.view(servo.now_ns()).task
    assert drawn.target_m == pytest.approx(SWING.target_m(drawn.elapsed_s))
    assert trial.task.elapsed_s - drawn.elapsed_s == pytest.approx(DELAY_S + SETTLED_S, abs=0.0011)
