"""The operator's view as a value: pure, neutral, and true to the journal."""

import dataclasses
from functools import partial
from pathlib import Path

import pytest

from study_app.gui.operator.operator_view import stages
from study_app.gui.operator.servo_health import ForceFigures, ServoHealth
from study_app.gui.sessions.session_facts import LIMIT_WORDS
from study_app.number_text import clock_text, duration, duration_range, duration_text, grouped
from study_app.protocol.load import load
from study_app.protocol.model import Limits
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.files.columns import TRIALS
from study_app.store.files.csv_files import header
from study_app.store.session_progress.delivered import beyond_limits
from study_app.store.session_progress.missing_trials import MISSING_PERCENT, REASONS
from tests.golden import check_kept, compare, each_once, what_comes
from tests.golden_values import changed, value_lines
from tests.gui.operator.session import ticks
from tests.protocol.trials.level_studies import study

SECRETS = ("thin", "thick", "prompt", "200")


def words(view):
    """Return every text of a view except its notes."""
    texts = []

    def walk(value):
        if isinstance(value, str):
            texts.append(value)
        elif isinstance(value, tuple):
            for part in value:
                walk(part)
        elif dataclasses.is_dataclass(value):
            for part in dataclasses.fields(value):
                walk(getattr(value, part.name))

    walk(view)
    return texts


BROKEN = {"lateness_p99_ms": 1.0, "worst_gap_ms": 31.25, "withheld_share": 0.0712, "delay_error_p95_ms": 27.211752}
STORY = (
    # events that are told one by one, each with what else the view says
    (lambda it: None, {}),
    (lambda it: it.welcome(), {}),
    (lambda it: it.tell("note", 3600.0, kind="note", text="however long it took"), {}),
    (lambda it: it.start(1), {"faults": 2, "device_ready": False}),
    (
        lambda it: it.tell("pause_asked", 12.0),
        {"dropped": 7, "forces": ForceFigures(share=0.2, most=0.91, limiters=(("slope", 3),), withheld=0.07)},
    ),
    (lambda it: it.end(1, **BROKEN), {"lost": {1: "No space left on device"}}),
    (lambda it: it.tell("recording_lost", 33.0, trial=1, attempt=1, reason="No space left on device"), {}),
    (lambda it: it.answer(1), {"outlets_lost": {"Serial port": "it was unplugged"}}),
    (lambda it: it.start(2), {}),
    (lambda it: it.tell("note", kind="mark", text=""), {}),
    (lambda it: it.end(2, "interrupted", first_frame_gap_ms=327.211752, worst_frame_gap_ms=300.0), {}),
    (lambda it: it.tell("paused", by="participant"), {}),
    (lambda it: it.tell("session_resumed", 1020.0, gap_s=1020.0), {}),
    (lambda it: it.tell("outlet_lost", 2.0, outlet="Serial port", reason="it was unplugged"), {}),
    (lambda it: it.start(2, 2), {"force_on": False}),
    (lambda it: it.answer(2), {}),
    (lambda it: it.tell("page_shown", 1.0, page="reaching"), {}),
    (lambda it: it.start(3), {"trouble": "it is full", "waits": True}),
    (lambda it: it.tell("target_reached", 1.0, trial=3, target=0, t_task_s=1.0), {}),
    (lambda it: it.tell("target_reached", 1.0, trial=3, target=1, t_task_s=1.0), {}),
    (lambda it: it.end(3, "timeout", loop_delay_ticks=1, device_delay_ticks=4), {}),
    (lambda it: it.tell("recorded", trial=3, attempt=1, samples_unrecorded=1200), {}),
    (lambda it: it.tell("repeat", trial=3, reason="phone rang"), {}),
    (lambda it: it.start(3, 2), {}),
    (lambda it: it.tell("broke", what="the device 'mouse' stopped responding"), {"force_on": False, "waits": True}),
)


def after_changes(lines):
    return (line.removeprefix("+ ") for line in lines if not line.startswith("- "))


def late():
    """Return the health of a late servo whose device answers later than at the start."""
    measured = ServoHealth(1000.0)
    for delay_ticks in (1, 3):
        samples = ticks(600, first=600 * (delay_ticks // 2), lateness_ns=4_000_000)
        samples.delay_ticks = delay_ticks
        measured.add_samples(samples)
    measured.overruns = 9
    return measured


@pytest.mark.parametrize(("blinding", "ended"), [("double", "withdrawn"), ("single", "completed")])
def test_a_view_after_each_event_is_the_reviewed_one(demo_session, blinding, ended, pytestconfig):
    if blinding == "single":
        demo_session.make_single_blind()
    lines, before = list[str](), list[str]()
    end = (lambda it: it.tell("session_ended", 4.0, status=ended, reason="", fingerprint="k3vq-7m2p-xw4d"), {})
    for number, (event, said) in enumerate((*STORY, end)):
        event(demo_session)
        view = demo_session.view(late() if number == 4 else None, **said)
        time = view.trial_time and view.trial_time.words
        after = [*value_lines(view), f"trials: {view.trials_line}", f"time: {time}"]
        lines += [f"== {number}", *changed(before, after)]
        before = after
    if blinding == "double":
        check_kept(Path(__file__).with_name("view.txt"), after_changes(lines))
        return
    compare(Path(__file__).parent / "golden" / "operator_single_blind.txt", each_once(what_comes(lines)), pytestconfig)


def pair(demo_session, number, answer, seconds=1.0, attempt=1):
    """Record an answered pair of intervals."""
    demo_session.tell("trial_started", 10.0, trial=number, attempt=attempt, phase="main", sealed="00")
    demo_session.tell("trial_ended", 4.0, trial=number, attempt=attempt, outcome="complete")
    item = {"item": "choice_2ifc", "value": answer, "onset_s": 5.0, "first_s": 5.0 + seconds}
    demo_session.tell("responses", 2.0, trial=number, attempt=attempt, items=[item])


def undelivered(demo_session, number, attempt, *limits):
    """Record a pair whose first interval exceeded limits."""
    demo_session.tell("trial_started", 1.0, trial=number, attempt=attempt, phase="main", sealed="00")
    demo_session.tell(
        "interval_ended", 2.0, trial=number, attempt=attempt, interval=1, outcome="complete", invalid=limits
    )
    demo_session.tell("trial_ended", 3.0, trial=number, attempt=attempt, outcome="invalid")


PAIRS = (
    *(partial(pair, number=n, answer=a, seconds=n / 2) for n, a in enumerate(("first", "first", "second", "first"), 1)),
    *(partial(pair, number=number, answer="second", seconds=0.29) for number in range(5, 20)),
    *(partial(pair, number=number, answer="second", seconds=0.1) for number in range(20, 30)),
    lambda it: it.tell("trial_started", 1.0, trial=30, attempt=1, sealed="00"),
    lambda it: it.tell("trial_ended", 2.0, trial=30, attempt=1, outcome="interrupted"),
    partial(pair, number=30, answer="first", attempt=2),
    lambda it: it.tell("repeat", 20.0, trial=30, reason="hand slipped"),
    partial(pair, number=30, answer="second", attempt=3),
    lambda it: it.tell("trial_started", 25.0, trial=31, attempt=1, sealed="00"),
    lambda it: it.tell("session_resumed", 50.0),
    partial(pair, number=31, answer="first", attempt=2),
    lambda it: undelivered(it, 32, 1, "pace_error_percent"),
    lambda it: undelivered(it, 32, 2, "pace_error_percent", "force_limit_n"),
    partial(pair, number=32, answer="first", attempt=3),
    *(lambda it, attempt=attempt: undelivered(it, 33, attempt, "level_error_ms") for attempt in (1, 2, 3)),
    partial(pair, number=34, answer="first"),
    lambda it: it.tell("trial_started", 10.0, trial=35, attempt=1),
    lambda it: it.tell("session_ended", 5.0, status="completed", fingerprint="abcd"),
)


def test_tracks_after_each_event_are_the_reviewed_ones(demo_session):
    protocol = study()
    schedule = build_schedule(protocol, "P001", 1)
    session = dataclasses.replace(
        demo_session.session, protocol=protocol, schedule=schedule, stages=stages(protocol, schedule)
    )
    demo_session = dataclasses.replace(demo_session, protocol=protocol, schedule=schedule, session=session)
    lines, before = list[str](), list[str]()
    for number, event in enumerate(PAIRS):
        event(demo_session)
        view = demo_session.view()
        after = [*view.track, view.setting_line, f"time: {view.trial_time and view.trial_time.words}"]
        lines += [f"== {number}", *changed(before, after)]
        before = after
        if number < 4:  # tracks take turns; pairs 1 to 4 were answered first, first, second, first in n / 2 s
            own = [number, number - 2] if number > 1 else [number]
            firsts = sum(at != 2 for at in own)
            share, other = (round(100 * count / len(own)) for count in (firsts, len(own) - firsts))
            assert f"First {share} %, Second {other} %" in view.track[1]
            assert f"median response time {sum((at + 1) / 2 for at in own) / len(own):.2f} s" in view.track[3]
    check_kept(Path(__file__).with_name("tracks.txt"), after_changes(lines))
    assert set(REASONS) == {*Limits.model_fields, "force_limit_n"} - {"attempts", MISSING_PERCENT}


def test_rows_cover_every_step_once_without_naming_conditions_or_liquids():
    protocol = load("rek2024")
    schedule = build_schedule(protocol, "P001", 1)
    rows = stages(protocol, schedule)
    assert [step for stage in rows for step in range(stage.first, stage.last + 1)] == list(range(len(schedule.steps)))
    labels = [stage.label for stage in rows]
    assert {"Liquid setting 1", "Liquid setting 3", "Delay setting 1 to 7"} <= set(labels)  # long blocks are one row
    conditions = {name for block in protocol.main_blocks for name in block.conditions}
    assert not {*conditions, "water", "honey", "oil", "ms"} & set(" ".join(labels).lower().split())


def test_every_limit_of_a_trial_has_a_name_for_the_operator(demo_session):
    bad = dict.fromkeys(header(TRIALS), 1000000000.0) | {"targets_reached": 0.0}
    limits = Limits(targets_percent=50).model_dump()
    judged = {measure for measure, _, _ in beyond_limits(bad, limits)}
    assert judged == set(LIMIT_WORDS)


def test_no_word_of_a_view_names_a_condition_a_force_or_a_limiter(demo_session, health):
    demo_session.welcome()
    for trial in demo_session.schedule.trials:
        demo_session.start(trial.number)
        said = " ".join(words(demo_session.view(health))).lower().split()
        for secret in SECRETS:
            assert secret not in said
        demo_session.end(trial.number)
        demo_session.answer(trial.number)
    assert "hidden" in " ".join(words(demo_session.view(health)))


def test_durations_are_written_in_one_way() -> None:
    for seconds, words in (
        (0.4, "0 s"), (2.5, "3 s"), (45.2, "45 s"), (59.6, "1 min"), (150, "3 min"), (612, "10 min"),
        (3599, "1 h 00 min"), (3900, "1 h 05 min"),
    ):  # fmt: skip
        assert duration(seconds) == duration_range(seconds, seconds) == words
    assert [duration(seconds_taken, tenths=True) for seconds_taken in (0.6, 11.42, 120)] == ["0.6 s", "11.4 s", "2 min"]
    for least, most, words in (
        (900, 1920, "15 to 32 min"),
        (3300, 4200, "55 min to 1 h 10 min"),
        (3700, 7500, "1 h 02 min to 2 h 05 min"),
        (30, 150, "30 s to 3 min"),
    ):
        assert duration_range(least, most) == words
    assert (clock_text(68), clock_text(3723), grouped(45918)) == ("1:08", "1:02:03", "45\u2009918")
    assert (duration_text(62e-6), duration_text(1.4e-3)) == ("62 µs", "1.4 ms")
