"""The row of a trial that the runner writes: what was measured, and nothing that tells the condition."""

from typing import Any

import pytest

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.session.transitions.events import Begin, Continue, EndRequested, PauseRequested, ResumeRequested
from study_app.session.trial import SETTLED_S
from tests.session.fakes import LEFT, RIGHT, World, at_block, step


@pytest.mark.slow
def test_a_sample_that_was_refused_at_the_door_changes_nothing_but_its_own_count() -> None:
    worlds = at_block("seeing"), at_block("seeing")
    for world, position_m, limiters in zip(worlds, (LEFT, (1.0, 1.0, 1.0)), (0, LIMITER_GLITCH), strict=True):
        world.servo.run(0.1, LEFT)
        world.servo.run(0.001, position_m, limiters=limiters)
        world.run(0.199, LEFT)
        world.run(0.5, RIGHT)
    spared, glitched = worlds
    assert [line["t_task_s"] for line in glitched.journal.of("target_reached")] == [
        line["t_task_s"] for line in spared.journal.of("target_reached")
    ]
    spared_row, row = (world.journal.of("trial_ended")[-1] for world in worlds)
    assert row["path_length_m"] == pytest.approx(0.04)
    assert row == spared_row | {"limiter_glitch": 1}


def test_the_row_of_a_trial_holds_the_error_of_the_delay_and_never_the_delay() -> None:
    world = at_block("seeing", delayed=True)
    for error_ms in (0, 5, 10, 40):
        world.servo.run(0.05, LEFT)
        now = world.servo.now_ns()
        world.runner.frame_shown(now + error_ms * 1_000_000, world.runner.view(now).sample_time_ns)
    world.run(0.1, LEFT)
    world.run(0.5, RIGHT)
    row = world.journal.of("trial_ended")[-1]
    assert (row["frames"], row["frames_late"]) == (5, 1)  # the study allows 25 ms
    assert row["delay_error_mean_ms"] == pytest.approx((4 * (13.75 + 1000 * SETTLED_S) - 137) / 5)
    assert row["delay_error_max_ms"] == pytest.approx(40 + 1000 * SETTLED_S)
    assert 137 not in [round(value) for value in row.values() if isinstance(value, float)]


def test_no_line_of_a_delayed_trial_names_condition_liquid_or_delay(world: World) -> None:
    world.runner.post(Begin(0.0))
    while not world.runner.finished:
        step(world)
    text = repr(world.journal.lines) + repr(world.pages) + repr(world.state)
    assert [word for word in ("is_late", "on_time", "is_thin", "is_thick", "0.137", "1013.7") if word in text] == []


def test_the_row_of_a_trial_sums_up_force_path_and_limiters(practising: World) -> None:
    practising.servo.run(1.0, (0.0, 0.0, 0.0), device_force_n=(3.0, 0.0, 4.0), limiters=0b1001)
    practising.servo.run(1.0, (0.03, 0.04, 0.0), device_force_n=(0.0, 0.0, 1.0), lateness_ns=2_000_000)
    practising.run(1.2, (0.0, 0.0, 0.0))
    (row,) = practising.journal.of("trial_ended")
    assert row["ticks"] == 3001
    assert row["tick_rate_hz"] == pytest.approx(1000)
    assert row["path_length_m"] == pytest.approx(0.1)
    assert row["mean_speed_mps"] == pytest.approx(0.1 / 3, abs=1e-6)
    assert row["force_mean_n"] == pytest.approx((5 * 1000 + 1 * 1000) / 3001, abs=1e-6)
    assert row["force_peak_n"] == pytest.approx(5)
    assert (row["limiter_slope"], row["limiter_norm"], row["limiter_slew"]) == (1000, 1000, 0)
    assert row["lateness_p99_ms"] == pytest.approx(2)
    assert (row["frames"], row["first_frame_gap_ms"], row["worst_frame_gap_ms"]) == (1, 0.0, None)


def test_the_row_of_a_trial_holds_the_share_of_the_force_withheld_in_its_task(practising: World) -> None:
    practising.servo.scene = 0
    practising.servo.run(0.5, permitted_n=9.0, withheld_n=9.0)  # before the task
    practising.servo.scene = 1
    practising.servo.run(1.0, permitted_n=4.0, withheld_n=0.5)
    practising.servo.run(1.0, permitted_n=2.0)
    practising.servo.run(1.001)
    practising.run(0.2, permitted_n=9.0, withheld_n=9.0)  # after it
    (row,) = practising.journal.of("trial_ended")
    assert row["withheld_share"] == pytest.approx(0.5 / 6, abs=1e-6)


def test_a_trial_without_force_has_no_share_withheld_and_no_error(practising: World) -> None:
    practising.run(3.2)
    (row,) = practising.journal.of("trial_ended")
    assert (row["withheld_share"], row["delivered_error"]) == (None, None)


def test_the_row_of_a_trial_says_that_the_loops_delay_changed(practising: World) -> None:
    practising.run(0.5, delay_ticks=1)
    for _ in range(2):
        practising.run(0.5, delay_ticks=3)
        practising.run(0.5, delay_ticks=2)
    practising.run(0.7, delay_ticks=2)
    practising.run(3.2, delay_ticks=2)
    rows = practising.journal.of("trial_ended")
    assert [(row["loop_delay_ticks"], row["loop_delay_changes"]) for row in rows] == [(3, 4), (2, 0)]


def test_samples_that_were_lost_are_counted_for_their_trial_alone(practising: World) -> None:
    practising.servo.telemetry.dropped = 7
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[0]["samples_dropped"] == 7
    practising.run(3.2)
    assert practising.journal.of("trial_ended")[1]["samples_dropped"] == 0


def test_an_interrupted_attempt_keeps_what_was_measured_and_the_trial_starts_again(practising: World) -> None:
    practising.run(0.8)
    practising.runner.post(PauseRequested(0.8, "operator"))
    (first,) = practising.journal.of("trial_ended")
    assert (first["attempt"], first["outcome"], first["ticks"]) == (1, "interrupted", 800)
    practising.run(5.0)  # a pause is no exploration
    practising.runner.post(ResumeRequested(5.8, "operator"))
    assert practising.servo.scene == 2
    practising.run(3.2)
    second = practising.journal.of("trial_ended")[-1]
    assert (second["attempt"], second["outcome"], second["ticks"]) == (2, "complete", 3001)


def test_a_trial_with_a_late_screen_or_a_late_servo_says_so(practising: World) -> None:
    for _ in range(20):
        now = practising.servo.now_ns()
        practising.runner.frame_shown(now + 90_000_000, now)
    practising.run(1.0)
    practising.servo.ticks += 150  # the servo stood still
    practising.run(2.2, lateness_ns=5_000_000)
    (row,) = practising.journal.of("trial_ended")
    assert row["delay_error_p95_ms"] == pytest.approx(90)
    assert row["frames_late"] == 20
    assert row["lateness_p99_ms"] == pytest.approx(5)


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
    world.runner.post(PauseRequested(2.0, "operator"))
    (row,) = world.journal.of("trial_ended")
    assert (row["outcome"], row["duration_s"], row["ticks"], row["first_frame_gap_ms"]) == ("interrupted", 0, 0, None)
    assert row["samples_dropped"] == 0
    assert tape.told == []
    world.runner.frame_shown(1, 0)  # the last frame of a tank that is gone
    world.runner.post(ResumeRequested(3.0, "operator"))
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
    world.runner.post(PauseRequested(0.5, "operator"))
    world.run(0.5)
    world.runner.post(ResumeRequested(1.0, "operator"))
    told = [told for told in tape.told if isinstance(told, tuple)]
    first = [("start", 1, 1, 1000.0), ("frame", 0, 0), ("frame", 500, 400), ("stop",)]
    assert told == [*first, ("start", 1, 2, 1000.0), ("frame", 10**9, 10**9)]


def test_the_end_is_put_off_until_the_recordings_are_on_the_disk() -> None:
    settled: list[bool] = []
    world = unpainted(settled=lambda: bool(settled))
    told: list[bool] = []
    world.runner.on_change(lambda _state: told.append(world.runner.finished))
    world.runner.post(EndRequested(3.0, "aborted", "cable"))
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
