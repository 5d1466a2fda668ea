"""The runner in a world of fakes: what it asks of whom, in which order, and what it makes of samples and buttons."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.errors import ServoFault, SessionError
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.session.device_buttons import ANSWERS, CONTINUE, DeviceButtons
from study_app.session.pages import PausePage, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Continue,
    EndRequested,
    ForceStopped,
    Note,
    PauseRequested,
    Reconnected,
    ResumeRequested,
    Submitted,
    TimeUp,
)
from study_app.session.transitions.state import Phase
from study_app.store.journals.journal_events import Event
from tests.golden import compare
from tests.session.fakes import World, step
from tests.session.runner.played_worlds import begun, play
from tests.transcripts import every, played

FILES = every(Path(__file__).parent / "transcripts", "rows runner")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_the_runner_executes_the_recorded_commands(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, play), pytestconfig)


EMPTY: dict[str, float | None] = {
    **dict.fromkeys(("targets_reached", "targets", "withheld_share", "device_delay_ticks", "worst_frame_gap_ms")),
    **dict.fromkeys(("lateness_p99_ms", "overruns", "samples_dropped", "path_length_m", "mean_speed_mps"), 0),
    **dict.fromkeys(("force_mean_n", "force_peak_n", "loop_delay_ticks", "loop_delay_changes", "frames_late"), 0),
    **{f"delay_error_{name}_ms": 0.0 for name in ("mean", "p95", "max")},
    **{f"limiter_{name}": 0 for name in LIMITER_NAMES},
    **{"duration_s": 3.0, "ticks": 3001, "tick_rate_hz": 1000.0, "worst_gap_ms": 1.0, "frames": 1},
    "first_frame_gap_ms": 0.0,
}
"""The row of 3 s at rest, without a force."""
REACHED = {"duration_s": 0.55, "targets_reached": 2, "targets": 2, "ticks": 551, "path_length_m": 0.04}
REACHED |= {"mean_speed_mps": 0.04 / 0.55}


@pytest.mark.parametrize(
    ("commands", "row", "page"),
    [
        ('to("seeing"); samples(0.101, LEFT); run(0.199, LEFT); run(0.5, RIGHT)', REACHED, QuestionnairePage),
        (
            "go_on(); samples(1.0, device_force_n=(3.0, 0.0, 4.0), limiters=9); "
            "samples(1.0, (0.03, 0.04, 0.0), device_force_n=(0.0, 0.0, 1.0), lateness_ns=2000000); run(1.2)",
            {"force_mean_n": (1000 * 5 + 1000 * 1) / 3001, "force_peak_n": 5.0, "path_length_m": 0.05 + 0.05,
             "mean_speed_mps": 0.1 / 3, "lateness_p99_ms": 2.0, "limiter_slope": 1000, "limiter_norm": 1000},
            TaskPage,
        ),
        (
            "go_on(); servo_is(scene=0); samples(0.5, permitted_n=9.0, withheld_n=9.0); servo_is(scene=1); "
            "samples(1.0, permitted_n=4.0, withheld_n=0.5); samples(1.0, permitted_n=2.0); samples(1.001); run(0.2)",
            {"withheld_share": 0.5 / (4 + 2)},
            TaskPage,
        ),
        (
            "go_on(); run(0.5, delay_ticks=1); run(0.5, delay_ticks=3); run(0.5, delay_ticks=2); "
            "run(0.5, delay_ticks=3); run(1.2, delay_ticks=2)",
            {"loop_delay_ticks": 3, "loop_delay_changes": 4},
            TaskPage,
        ),
        ("go_on(); lose(7); run(3.2)", {"samples_dropped": 7}, TaskPage),
        (  # 137 ms late, drawn 2 ms later: -137, 2, 7, 12 and 42 ms beyond the delay
            'to("seeing", delayed=True); samples(0.05, LEFT); paint(0); samples(0.05, LEFT); paint(5); '
            "samples(0.05, LEFT); paint(10); samples(0.05, LEFT); paint(40); run(0.1, LEFT); run(0.5, RIGHT)",
            {**REACHED, "frames": 5, "frames_late": 1, "delay_error_mean_ms": -14.8, "delay_error_p95_ms": 36.0,
             "delay_error_max_ms": 42.0, "worst_frame_gap_ms": 551.0 - 240.0},
            QuestionnairePage,
        ),
        (
            "go_on(); paint(90, view=False); paint(90, view=False); run(1.0); servo_is(ticks=1150); run(2.2)",
            {"ticks": 2851, "frames": 3, "frames_late": 2, "delay_error_mean_ms": 60.0, "delay_error_p95_ms": 90.0,
             "delay_error_max_ms": 90.0, "worst_frame_gap_ms": 2911.0},
            PausePage,
        ),
    ],
)  # fmt: skip
def test_the_row_of_a_trial_sums_up_its_samples_and_frames(
    commands: str, row: dict[str, float], page: type[object]
) -> None:
    world = begun(f"1: post(Begin(0.0)); {commands}")
    ended = world.journal.of("trial_ended")[-1]
    assert {name: ended[name] for name in EMPTY} == pytest.approx(EMPTY | row, abs=1e-6)
    assert isinstance(world.pages[-1], page)


def test_the_force_ends_first_then_a_line_is_written_and_then_its_page_is_shown(world: World) -> None:
    """A trial's scene is loaded with the first frame of its page."""
    world.runner.on_change(lambda _state: world.log.append("told"))
    trial, pause = ["trial_started", "TaskPage", "load", "told"], ["paused", "PausePage", "told"]
    lines_written = 0
    for kind, words, page_fields, waited, force_is_on, scene in (
        (Begin, (), ["page_shown", "TextPage", "told"], [], True, 0),
        (Continue, (), ["page_left", *trial], ["page_left"], True, 1),
        (PauseRequested, ("operator",), ["rest", "trial_ended", *pause], [], True, 0),
        (ResumeRequested, ("operator",), ["resumed", *trial], [], True, 2),
        (
            ForceStopped, ("operator",),
            ["stop_force", "stop_force", "rest", "trial_ended", "force_stopped", *pause], [], False, 0,
        ),
        (
            ResumeRequested, ("operator",),
            ["resumed", "force_restored", "fade_in", *trial], [], True, 3,
        ),
        (None, (), ["stop_force", "rest", "trial_ended", "broke", "TroublePage", "told"], [], False, 0),
        (
            Reconnected, ({"name": "memory"},),
            ["stop_force", "device_reconnected", *pause], ["device_reconnected"], False, 0,
        ),
        (
            EndRequested, ("aborted", "fire"),
            ["finish", "EndPage", "told"], [], False, 0,
        ),
    ):  # fmt: skip
        world.servo.fault = "the cable" if kind is None else None
        world.run(0.25)
        if kind is not None:
            world.runner.post(kind(world.clock(), *words))
        assert (world.log, world.journal.waited) == (page_fields, waited)
        assert (world.servo.force_is_on, world.servo.scene) == (force_is_on, scene)
        assert world.runner.cause == ("the cable" if "TroublePage" in page_fields else "")
        assert {line["t_s"] for line in world.journal.lines[lines_written:]} <= {world.clock()}
        lines_written = len(world.journal.lines)
        world.log.clear()
        world.journal.waited.clear()
    outcomes = [(line["attempt"], line["outcome"], line["t_s"]) for line in world.journal.of("trial_ended")]
    assert outcomes == [(1, "interrupted", 0.75), (2, "interrupted", 1.25), (3, "interrupted", 1.75)]
    assert world.runner.finished
    assert not world.runner.ending


@pytest.mark.parametrize(("button", "way"), [(ANSWERS[0], -1), (ANSWERS[1], 1)])
def test_the_second_button_steps_to_less_and_the_third_to_more(world: World, button: int, way: int) -> None:
    buttons = DeviceButtons()

    def steps(*pressed: int, at_s: float) -> list[int]:
        samples = np.zeros(len(pressed), [("buttons", int), ("time_ns", int)])
        samples["buttons"], samples["time_ns"] = pressed, round(at_s * 1e9)
        return [event.steps for event in buttons.events(samples, 0, at_s, lambda: (world.state, True))]

    assert steps(0, button, at_s=1.0) == [way]
    assert steps(button, at_s=1.124) == []
    assert steps(button, at_s=1.126) == [way]
    assert steps(0, at_s=1.2) == steps(0, at_s=1.4) == []


def test_a_stall_of_the_program_is_noted_while_no_task_runs(world: World) -> None:
    world.runner.post(Begin(0.0))
    while world.state.phase is not Phase.TASK:
        step(world)
    for seconds in (0.1, 3.1):
        world.run(seconds)
    assert world.journal.of("note") == []
    world.runner.post(PauseRequested(world.clock(), "operator"))
    world.run(3.1)
    assert [line["text"] for line in world.journal.of("note")] == ["the program stalled for 3.1 s"]


def test_lines_that_are_not_on_the_disk_stop_the_force_until_they_are(world: World) -> None:
    world.runner.post(Begin(0.0))
    while world.state.phase is not Phase.TASK:
        step(world)
    world.run(0.1)
    world.log.clear()
    world.journal.unflushed = "no flush"
    world.run(0.1)
    assert (world.runner.stalled, world.log[0]) == ("no flush", "stop_force")
    world.run(1.01)
    assert world.runner.stalled == "no flush"
    world.journal.unflushed = None
    world.run(1.01)
    assert (world.runner.stalled, world.state.phase) == (None, Phase.PAUSED)
    assert [line["outcome"] for line in world.journal.of("trial_ended")] == ["interrupted"]
    world.runner.post(EndRequested(world.clock(), "aborted", "fire"))
    assert (world.runner.finished, world.journal.status) == (True, "aborted")


def test_a_write_refused_by_a_full_disk_is_repeated_once_per_second(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts: list[float] = []
    append = world.journal.append

    def counted(event: Event, **options: Any) -> None:
        attempts.append(world.clock())
        append(event, **options)

    monkeypatch.setattr(world.journal, "append", counted)
    world.runner.post(Begin(0.0))
    world.run(0.1)
    world.journal.fails_after = len(world.journal.lines)
    attempts.clear()
    world.runner.post(Continue(world.clock()))
    assert (world.runner.stalled, world.journal.lines[-1]["event"]) == ("disk full", "page_shown")
    for seconds in (0.9, 0.099, 0.001, 0.9, 0.099):
        world.run(seconds)
    assert [round(at_s, 3) for at_s in attempts] == [0.1, 1.1]
    world.journal.fails_after = None
    world.run(0.001)
    assert (world.runner.stalled, world.state.phase) == (None, Phase.PAUSED)
    assert [(line["event"], line["t_s"]) for line in world.journal.lines[1:3]] == [
        ("page_left", 0.1), ("trial_started", 0.1),
    ]  # fmt: skip
    assert [line["event"] for line in world.journal.lines].count("page_left") == 1
    assert [type(page) for page in world.pages] == [TextPage, TroublePage, TroublePage, TaskPage, PausePage]


def test_a_servo_that_refuses_a_scene_ends_the_force_and_informs_the_operator(world: World) -> None:
    world.runner.post(Begin(0.0))
    world.run(0.5)
    world.servo.refuses = ServoFault("its thread ended")
    world.log.clear()
    world.runner.post(Continue(world.clock()))
    assert world.state.phase is Phase.TROUBLE
    assert (world.runner.cause, world.servo.force_is_on) == ("its thread ended", False)
    (line,) = world.journal.of("broke")
    assert (line["what"], line["t_s"]) == ("its thread ended", 0.5)
    assert world.log[:3] == ["page_left", "trial_started", "TaskPage"]
    assert "stop_force" in world.log[3:]
    assert isinstance(world.pages[-1], TroublePage)


@pytest.mark.parametrize("phase", [Phase.RESTING, Phase.FEEDBACK])
def test_a_rest_and_feedback_end_at_their_time(world: World, monkeypatch: pytest.MonkeyPatch, phase: Phase) -> None:
    posted: list[Any] = []
    monkeypatch.setattr(world.runner, "post", posted.append)
    world.runner._state = replace(world.state, phase=phase, until_s=2.0, index=1)
    for seconds in (1.0, 0.999):
        world.run(seconds)
    assert posted == []
    world.run(0.001)
    assert posted == [TimeUp(2.0)]
    assert (world.runner.view(world.servo.now_ns()) is None) == (phase is Phase.FEEDBACK)


def test_a_refused_event_does_not_prevent_the_events_posted_with_it(world: World) -> None:
    world.on_page = lambda page: world.runner.post(Note(world.clock(), "mark", type(page).__name__))
    world.runner.post(Begin(0.0))
    assert [line["text"] for line in world.journal.of("note")] == ["TextPage"], "posted while the page was presented"
    before = world.state
    with pytest.raises(SessionError):
        world.runner.post(Submitted(1.0))
    assert (world.state, world.runner.task, world.runner.view(0)) == (before, None, None)
    world.runner.frame_shown(0, 0)
    world.on_page = lambda _page: (world.runner.post(Begin(1.0)), world.runner.post(Note(1.0, "mark", "late")))[0]
    with pytest.raises(SessionError):
        world.runner.post(Continue(1.0))
    assert [line["text"] for line in world.journal.of("note")] == ["TextPage", "late"]
    assert world.state.phase is Phase.TASK


def test_the_end_of_a_session_waits_for_its_recordings() -> None:
    settled = False
    world = World(settled=lambda: settled)
    world.runner.post(Begin(0.0))
    assert not world.runner.ending
    while not world.state.over:
        step(world)
    assert (world.runner.ending, world.runner.finished, world.journal.status) == (True, False, None)
    settled = True
    world.run(0.1)
    assert (world.runner.ending, world.runner.finished, world.journal.status) == (False, True, "completed")


def test_a_button_leaves_a_page_unless_it_was_pressed_before_the_page_was_there(world: World) -> None:
    changes: list[Phase] = []
    world.runner.on_change(lambda state: changes.append(state.phase))
    world.runner.post(Begin(0.0))
    world.run(0.1, buttons=CONTINUE)
    assert changes == [Phase.READING], "consent is not given with a button"
    while world.state.phase is not Phase.READING or world.state.page_id != "thanks":
        step(world)
    world.run(0.1)
    world.servo.run(0.05, buttons=CONTINUE)
    for event in (Broke(world.clock(), "the cable", "device"), Reconnected(world.clock(), {"name": "memory"})):
        causes = world.runner.cause
        world.runner.post(event)
        assert (causes, world.runner.cause) in {("", "the cable"), ("the cable", "")}
    world.runner.post(ResumeRequested(world.clock(), "operator"))
    world.run(0.05)
    assert world.state.phase is Phase.READING, "pressed before the page"
    world.run(0.05, buttons=CONTINUE)
    assert world.state.phase is changes[-1] is Phase.COMPLETE


def test_lines_of_a_delayed_trial_do_not_name_condition_liquid_or_delay(world: World) -> None:
    world.runner.post(Begin(0.0))
    while not world.runner.finished:
        step(world)
    text = repr(world.journal.lines) + repr(world.pages) + repr(world.state)
    assert [word for word in ("is_late", "on_time", "is_thin", "is_thick", "0.137", "1013.7") if word in text] == []
    assert 137 not in [round(value) for line in world.journal.lines for value in line.values() if type(value) is float]
