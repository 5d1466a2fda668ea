"""A trial that runs: a ball that is hidden and a video, drawn as late as everything else; video frames are counted."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from study_app.errors import VideoError
from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.scene import ForceLink, Scene
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks import Explore, Follow
from study_app.session.tasks import TaskView
from study_app.session.transitions.events import StartTrial
from study_app.session.trial import _MIN_SETTING_S, SETTLED_S, Recording, RunningTrial, is_ball_at_start, resting_view
from study_app.video.frames import VideoFrame, VideoStatistics
from tests.session import small
from tests.session.fakes import LEFT, RIGHT, FakeServo

SWING = Follow(kind="follow")
TASK = Explore(kind="explore", instruction="Move", min_s=1, max_s=60)
DELAY_S = 0.1
PERIOD_NS = 33_000_000


def begin_trial(task: Any, recorder: Any = None, **more: Any) -> tuple[RunningTrial, FakeServo]:
    """Return a trial whose first frame has not been painted, after half a second of samples."""
    servo = FakeServo([])
    servo.run(0.5)
    reader = servo.telemetry.reader()
    command = StartTrial(
        trial=3, attempt=2, task=task, presented=Stimulated("presented"), delay_s=DELAY_S, linger_s=DELAY_S
    )
    recording = Recording(recorder, servo.rate_hz)
    trial = RunningTrial(
        command, Scene(), late_s=0.05, servo=servo, reader=reader, recording=recording, paints=False, **more
    )
    reader.read()
    return trial, servo


def painted(task: Any, *, hides_ball: bool) -> tuple[RunningTrial, FakeServo]:
    """Return a trial whose first frame was painted."""
    trial, servo = begin_trial(task, hides_ball=hides_ball)
    trial.frame(servo.now_ns(), servo.now_ns())
    return trial, servo


def hidden_after(trial: RunningTrial, servo: FakeServo, seconds: float) -> list[tuple[float, bool]]:
    """Return (elapsed time that is drawn, whether the ball is hidden) every 10 ms."""
    is_hidden = []
    for _ in range(round(seconds * 100)):
        servo.run(0.01)
        trial.follow(servo.telemetry.read())
        view = trial.view(servo.now_ns())
        is_hidden.append((view.task.elapsed_s, view.ball_hidden))
    return is_hidden


@pytest.mark.slow
def test_a_hidden_ball_is_drawn_during_the_lead_and_not_after_it() -> None:
    trial, servo = painted(SWING, hides_ball=True)
    is_hidden = hidden_after(trial, servo, 5.0)
    assert {hidden for elapsed_s, hidden in is_hidden if elapsed_s < SWING.lead_s} == {False}
    assert {hidden for elapsed_s, hidden in is_hidden if elapsed_s >= SWING.lead_s} == {True}
    newest_s = is_hidden[150][0]
    assert newest_s == pytest.approx(1.51 - DELAY_S - SETTLED_S, abs=0.0021)  # hidden as late as it is drawn


def test_without_a_lead_a_hidden_ball_is_never_drawn() -> None:
    trial, servo = painted(TASK, hides_ball=True)
    assert all(hidden for _, hidden in hidden_after(trial, servo, 1.0))


def test_the_target_is_drawn_where_it_was() -> None:
    trial, servo = painted(SWING, hides_ball=True)
    hidden_after(trial, servo, 2.0)
    task_view: TaskView = trial.view(servo.now_ns()).task
    assert task_view.target_m == pytest.approx(SWING.target_m(task_view.elapsed_s))
    assert trial.task.elapsed_s - task_view.elapsed_s == pytest.approx(DELAY_S + SETTLED_S, abs=0.0011)


def test_a_task_is_over_when_its_end_was_drawn_with_the_longest_delay() -> None:
    trial, servo = painted(Explore(kind="explore", instruction="Move", min_s=1, max_s=1), hides_ball=False)
    lasted_ms = 0
    while trial.outcome() is None:
        servo.run(0.001)
        trial.follow(servo.telemetry.read())
        lasted_ms += 1
    assert lasted_ms == 1 + round(1000 * (1 + DELAY_S + SETTLED_S)), "the first sample comes after a millisecond"
    assert trial.outcome() == "complete"


def test_a_trial_counts_only_its_own_samples_without_glitches() -> None:
    """The first second belongs to the scene before; the task ends after 1 s, and a refused sample moves no ball."""
    trial, servo = painted(Explore(kind="explore", instruction="Move", min_s=1, max_s=1), hides_ball=False)
    assert trial.follow(servo.telemetry.read()) == []
    servo.scene = 0
    servo.run(1.0)
    servo.scene = 1
    servo.run(0.4, device_force_n=(0.0, 3.0, 4.0))
    servo.run(0.001, (1.0, 1.0, 1.0), limiters=LIMITER_GLITCH)
    servo.run(1.0, (0.0, 0.03, 0.04), device_force_n=(0.0, 0.0, 2.0))
    assert trial.outcome() is None
    trial.follow(servo.telemetry.read())
    row = trial.summary()
    assert (row["ticks"], row["limiter_glitch"], row["duration_s"]) == (1001, 1, 1.0)
    assert row["path_length_m"] == pytest.approx(0.05)
    assert row["force_mean_n"] == pytest.approx((400 * 5.0 + 600 * 2.0) / 1001)
    assert (trial.samples["time_ns"][0], trial.samples["time_ns"][-1]) == (1_501_000_000, 2_501_000_000)
    servo.run(0.5)
    assert trial.follow(servo.telemetry.read()) == []
    assert (trial.summary(), trial.outcome()) == (row, "complete")


def test_a_trial_is_frozen_by_a_gap_of_more_than_a_second_in_ticks_or_frames() -> None:
    trial, servo = begin_trial(TASK)
    servo.worst_gap_s = 1.5
    assert not trial.frozen, "it has not begun"
    trial.frame(servo.now_ns(), servo.now_ns())
    assert trial.frozen
    servo.worst_gap_s = 1.0
    servo.run(5.0)
    assert not trial.frozen, "without a window only the first frame is reported"
    trial.frame(servo.now_ns(), servo.now_ns())
    servo.run(1.0)
    assert trial.frozen, "5 s between the frames"


@pytest.mark.parametrize(("task", "lit", "start_m"), [(SWING, 0, (0.0, 0.0, 0.0)), (TASK, None, None)])
def test_a_rest_draws_the_ball_as_it_is_and_the_target_at_its_start(task: Any, lit: int | None, start_m: Any) -> None:
    servo = FakeServo([])
    servo.run(0.3, (0.0, 0.0, 0.006))
    view = resting_view(cast(Any, servo), task, servo.now_ns())
    assert (view.position_m.tolist(), view.sample_time_ns) == ([0.0, 0.0, 0.006], servo.now_ns() - 2_000_000)
    assert view.task == TaskView(lit=lit, reached=0, of=None, dwell=0.0, elapsed_s=0.0, target_m=start_m)
    assert (view.ball_hidden, view.video) == (False, None)
    assert is_ball_at_start(view, task)
    servo.run(0.3, (0.0, 0.0, 0.0061))
    assert is_ball_at_start(resting_view(cast(Any, servo), task, servo.now_ns()), task) == (start_m is None)


def test_a_level_is_adjusted_from_the_first_frame_until_the_time_is_over() -> None:
    trial, servo = begin_trial(TASK)
    adjusting = replace(trial.command, adjusts=True, task=TASK.model_copy(update={"min_s": 0.5, "max_s": 1.5}))
    trial = RunningTrial(
        adjusting, Scene(), late_s=0.05, servo=servo, reader=servo.telemetry.reader(),
        recording=Recording(None, servo.rate_hz), paints=False,
    )  # fmt: skip
    assert not trial.adjustable
    trial.frame(servo.now_ns(), servo.now_ns())
    assert trial.adjustable
    scene = Scene(scale=2.0)
    assert (trial.adjust(None, 0.3), trial.adjust(scene, 0.2)) == (None, 2)
    assert servo.scenes[-1] is scene
    view = trial.view(servo.now_ns())
    assert view.sample_time_ns == servo.now_ns() - 202_000_000
    trial.adjust(None, 0.05)
    trial.frame(servo.now_ns(), view.sample_time_ns)
    assert trial.summary()["delay_error_max_ms"] == 2.0, "the frame was drawn before the last step"
    for seconds, outcome, adjustable in ((1.2, None, True), (0.35, None, False), (0.1, "timeout", False)):
        servo.run(seconds)
        trial.follow(servo.telemetry.read())
        assert (trial.outcome(), trial.adjustable) == (outcome, adjustable)
    assert trial.summary()["delivered_error"] is None, "the participant set the force"


@pytest.mark.parametrize(
    ("link", "adjusts", "has_error"),
    [
        (ForceLink(), False, True),
        (ForceLink(), True, False),
        (ForceLink(delay_s=0.02), False, False),
        (ForceLink(loss=0.1), False, False),
    ],
)
def test_a_force_is_compared_with_its_law_unless_it_is_late_or_set(
    link: ForceLink, adjusts: bool, has_error: bool
) -> None:
    scene = small.protocol().scene_for("is_thick")
    trial, servo = begin_trial(TASK)
    trial = RunningTrial(
        replace(trial.command, adjusts=adjusts), scene.model_copy(update={"link": link}), late_s=0.05, servo=servo,
        reader=servo.telemetry.reader(), recording=Recording(None, servo.rate_hz), paints=False,
    )  # fmt: skip
    assert trial.summary()["delivered_error"] is None, "it has not begun"
    trial.frame(servo.now_ns(), servo.now_ns())
    for place_m in (LEFT, RIGHT, LEFT):
        servo.run(0.5, place_m, device_force_n=(1.0, 0.0, 0.0))
    trial.follow(servo.telemetry.read())
    assert (trial.summary()["delivered_error"] is not None) == has_error


def frame(number: int, due_ns: int, age_ns: int | None = None) -> VideoFrame:
    return VideoFrame(
        number=number, width=2, height=2, stride=8, pixels=bytes(16), due_ns=due_ns, age_ns=age_ns, period_ns=PERIOD_NS
    )


class FakeVideo:
    """A camera whose frame ``n`` was ready n periods after 0."""

    def __init__(self) -> None:
        self.calls: list[Any] = []

    def rewind(self) -> None:
        self.calls.append("rewind")

    def begin(self, at_ns: int) -> None:
        self.calls.append(("begin", at_ns))

    def fit(self, width: int, height: int) -> None:
        """Do nothing."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        self.calls.append(moment_ns)
        number = moment_ns // PERIOD_NS
        return frame(number, number * PERIOD_NS, 7_000_000)


class Recorded:
    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.frames: list[Any] = []
        self.started: list[Any] = []
        self.samples: list[Any] = []

    def start(self, *told: Any) -> None:
        self.started.append(told)

    def append(self, samples: Any) -> None:
        self.samples += list(samples)

    def frame(self, painted_ns: int, sample_ns: int, video: VideoFrame | None = None) -> None:
        self.frames.append((painted_ns, sample_ns, video))

    def stop(self) -> None:
        """Do nothing."""


def test_the_video_is_as_late_as_the_ball_and_both_are_recorded() -> None:
    video, recorder = FakeVideo(), Recorded()
    trial, servo = begin_trial(TASK, recorder, video=video, videos=True)
    assert video.calls == ["rewind"]
    view = trial.view(servo.now_ns())
    asked_ns = servo.now_ns() - round((DELAY_S + SETTLED_S) * 1e9)
    assert video.calls[-1] == asked_ns
    assert abs(view.sample_time_ns - asked_ns) <= 1_000_000
    trial.frame(servo.now_ns() + 5, view.sample_time_ns)
    assert video.calls[-1] == ("begin", servo.now_ns() + 5)
    assert recorder.frames == [(servo.now_ns() + 5, view.sample_time_ns, view.video)]
    assert recorder.started == [(3, 2, 1000.0, None)]
    for _ in range(30):
        servo.run(0.016)
        view = trial.view(servo.now_ns())
        trial.frame(servo.now_ns(), view.sample_time_ns)
    columns = trial.summary()
    assert columns["video_frames"] == 15
    assert (columns["video_frames_late"], columns["video_frames_lost"]) == (0, 0)
    assert 0 <= columns["video_delay_error_max_ms"] <= 1e-6 * PERIOD_NS
    assert columns["video_age_mean_ms"] == 7.0


def test_a_recording_includes_up_to_600_samples_from_before_its_start() -> None:
    recorder = Recorded()
    recording, at = Recording(recorder, 1000.0), iter(range(100_000))
    for counts, expected in (((1, 7), 8), ((400, 150, 170, 90), 600), ((), 600), ((601,), 600)):
        for count in (0, *counts):
            recording.add_samples([next(at) for _ in range(count)])
        recording.start(3, 2, 1)
        newest = next(at)
        recording.add_samples([newest])
        recording.stop()
        assert recorder.started == [(3, 2, 1000.0, 1)]
        assert recorder.samples == [*range(newest - expected, newest + 1)]
        recorder.clear()
    recording.forget()
    recording.add_samples([7, 8, 9])
    recording.start(4, 1)
    assert recorder.samples == [7, 8, 9]


def test_a_trial_without_a_video_has_empty_video_columns() -> None:
    trial, servo = begin_trial(TASK, Recorded(), videos=True)
    view = trial.view(servo.now_ns())
    trial.frame(servo.now_ns(), view.sample_time_ns)
    assert view.video is None
    assert {trial.summary()[name] for name in VideoStatistics().columns()} == {None}


def test_a_camera_that_stops_stops_the_trial() -> None:
    class Stopped(FakeVideo):
        def frame_at(self, moment_ns: int) -> VideoFrame | None:
            raise VideoError("the camera stopped")

    trial, servo = begin_trial(TASK, Recorded(), video=Stopped(), videos=True)
    with pytest.raises(VideoError, match="the camera stopped"):
        trial.view(servo.now_ns())


def test_late_and_lost_frames_are_counted_once_each() -> None:
    statistics = VideoStatistics()
    delay_ns = round(DELAY_S * 1e9)
    painted = (  # number, how late beyond the delay [ns]
        (3, 0),
        (3, 16_000_000),
        (4, PERIOD_NS),
        (7, PERIOD_NS + 1),  # 5 and 6 were lost, and this one is late
        (8, 2 * PERIOD_NS),
        (8, 3 * PERIOD_NS),
    )
    for number, late_ns in painted:
        statistics.frame(number * PERIOD_NS + delay_ns + late_ns, frame(number, number * PERIOD_NS), DELAY_S)
    assert statistics.columns() == {
        "video_frames": 4,
        "video_frames_late": 2,
        "video_frames_lost": 2,
        "video_delay_error_max_ms": 66.0,
        "video_age_mean_ms": None,
    }


@pytest.mark.parametrize(("adjusts", "calls"), [(True, [1.5 + _MIN_SETTING_S]), (False, ["left"])])
def test_a_level_is_set_for_a_moment_before_it_can_be_left(adjusts: bool, calls: list[Any]) -> None:
    pressed: list[Any] = []
    tracker = SimpleNamespace(finish=pressed.append, leave=lambda: pressed.append("left"))
    command = SimpleNamespace(adjusts=adjusts, task=SimpleNamespace(judged_from_s=1.5))
    RunningTrial.leave(cast(Any, SimpleNamespace(command=command, _tracker=tracker)))
    assert pressed == calls
