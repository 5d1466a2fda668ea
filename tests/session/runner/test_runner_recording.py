"""What the runner hands to the recorder, and that force and recording begin with the first painted frame."""

from typing import Any

import pytest

from study_app.session.transitions.events import Begin, Continue, EndAsked, PauseAsked, ResumeAsked
from tests.session.fakes import World


class Tape:
    """A recorder that is all memory: what came in which order."""

    def __init__(self) -> None:
        self.told: list[Any] = []

    def start(self, trial: int, attempt: int, rate_hz: float, _interval: int | None = None) -> None:
        self.told.append(("start", trial, attempt, rate_hz))

    def append(self, samples: Any) -> None:
        self.told.append(samples)

    def frame(self, painted_ns: int, sample_ns: int, _video: Any = None) -> None:
        self.told.append(("frame", painted_ns, sample_ns))

    def stop(self) -> None:
        self.told.append(("stop",))


def recorded(tape: Tape) -> list[list[int]]:
    """Return the ticks of each recording."""
    found: list[list[int]] = []
    for told in tape.told:
        if isinstance(told, tuple) and told[0] == "start":
            found.append([])
        elif not isinstance(told, tuple):
            found[-1] += told["tick"].tolist()
    return found


def unpainted(recorder: Any = None, **ports: Any) -> World:
    """Return a world whose practice was asked for two seconds ago, and no frame of its tank was painted."""
    world = World(recorder=recorder, **ports)
    world.paints = False
    world.runner.post(Begin(0.0))
    world.runner.post(Continue(0.0))
    world.run(2.0)
    return world


def test_force_task_and_recording_begin_with_the_first_painted_frame_of_the_tank() -> None:
    tape = Tape()
    world = unpainted(tape)
    assert "load" not in world.log
    assert tape.told == []
    assert world.runner.task.elapsed_s == 0.0
    assert world.runner.view(world.servo.now_ns()).task.elapsed_s == 0.0
    world.runner.post(Continue(2.0))  # there is nothing to leave yet, though the exploration lasts 1 s at least
    world.runner.frame_shown(world.servo.now_ns(), world.servo.now_ns())
    assert world.log[-1] == "load"
    world.run(1.4)
    assert world.runner.task.elapsed_s == pytest.approx(1.399)
    world.run(1.8)
    (row,) = world.journal.of("trial_ended")
    assert row["duration_s"] == pytest.approx(3.0)
    assert row["ticks"] == 3001
    assert row["first_frame_gap_ms"] == pytest.approx(2000)
    assert recorded(tape)[0][0] == 2000 - 600 + 1


def test_a_trial_that_is_paused_before_its_first_frame_was_neither_felt_nor_recorded() -> None:
    tape = Tape()
    world = unpainted(tape)
    world.runner.post(PauseAsked(2.0, "operator"))
    (row,) = world.journal.of("trial_ended")
    assert (row["outcome"], row["duration_s"], row["ticks"], row["first_frame_gap_ms"]) == ("interrupted", 0, 0, None)
    assert row["samples_dropped"] == 0
    assert tape.told == []
    world.runner.frame_shown(1, 0)  # the last frame of a tank that is gone
    world.runner.post(ResumeAsked(3.0, "operator"))
    assert "load" not in world.log


def test_every_turn_of_a_trial_is_recorded_and_those_shortly_before_it() -> None:
    tape = Tape()
    world = World(recorder=tape)
    world.runner.post(Begin(0.0))
    for _ in range(10):
        world.run(0.5)
    world.runner.post(Continue(world.clock()))
    for _ in range(8):
        world.run(0.4)
    world.run(0.05)
    first, second = recorded(tape)
    assert first == list(range(5000 - 600 + 1, 5000 + 3200 + 1))  # until it was left, after its end was shown
    assert second == list(range(8200 - 600 + 1, 8250 + 1))
    assert [told for told in tape.told if isinstance(told, tuple) and told[0] != "frame"] == [
        ("start", 1, 1, 1000.0),
        ("stop",),
        ("start", 2, 1, 1000.0),
    ]


def test_frames_are_recorded_with_their_trial_and_attempts_have_recordings_of_their_own() -> None:
    tape = Tape()
    world = World(recorder=tape)
    world.runner.post(Begin(0.0))
    world.runner.frame_shown(1, 0)
    world.runner.post(Continue(0.0))
    world.run(0.5)
    world.runner.frame_shown(500, 400)
    world.runner.post(PauseAsked(0.5, "operator"))
    world.run(0.5)
    world.runner.post(ResumeAsked(1.0, "operator"))
    told = [told for told in tape.told if isinstance(told, tuple)]
    first = [("start", 1, 1, 1000.0), ("frame", 0, 0), ("frame", 500, 400), ("stop",)]
    assert told == [*first, ("start", 1, 2, 1000.0), ("frame", 10**9, 10**9)]


def test_the_end_is_put_off_until_the_recordings_are_on_the_disk() -> None:
    settled: list[bool] = []
    world = unpainted(settled=lambda: bool(settled))
    told: list[bool] = []
    world.runner.on_change(lambda _state: told.append(world.runner.finished))
    world.runner.post(EndAsked(3.0, "aborted", "cable"))
    world.run(0.5)
    assert world.runner.ending
    assert not world.runner.finished
    assert world.servo.scene == 0, "the hand is let go of at once"
    assert "finish" not in world.log
    settled.append(True)
    world.run(0.1)
    assert world.runner.finished
    assert "finish" in world.log
    assert told == [False, True]
