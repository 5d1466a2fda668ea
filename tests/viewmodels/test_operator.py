"""The operator's view as a value: pure, neutral, and true to the journal."""

import dataclasses

import pytest

from study_app.haptics.model.layout import SAMPLE, records
from study_app.protocol.model import Limits
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.broken_limits import beyond_limits
from study_app.store.tables.column import header
from study_app.store.tables.columns import TRIALS
from study_app.viewmodels.number_words import duration, duration_range, duration_words, grouped, minutes
from study_app.viewmodels.operator import MEASURES
from study_app.viewmodels.servo_health import ServoHealth
from study_app.viewmodels.session.stages import stages
from tests.protocol.trials.level_studies import study

SECRETS = ("thin", "thick", "prompt", "200")


def words(view):
    """Return every text of a view, its notes left out."""
    found = []

    def walk(value):
        if isinstance(value, str):
            found.append(value)
        elif isinstance(value, tuple):
            for part in value:
                walk(part)
        elif dataclasses.is_dataclass(value):
            for part in dataclasses.fields(value):
                walk(getattr(value, part.name))

    walk(view)
    return found


def test_a_trial_has_its_neutral_name_and_a_time_that_stands_still_while_statements_are_answered(told):
    told.welcome()
    told.start(1)
    told.now_s += 12.0
    view = told.view()
    assert view.heading == "Trial 1 of 4"
    assert view.setting_line.startswith("Liquid setting 1")
    assert view.part_line.startswith("Part 1 of 2")
    assert (view.state, view.may_pause, view.may_repeat) == ("running", True, True)
    time = view.trial_time
    assert (time.least_s, time.most_s, time.words) == (5.0, 30.0, "0:12 of 0:30")
    told.end(1)
    told.now_s += 33.0
    assert told.view().trial_time.elapsed_s == 32.0
    assert "answering" in told.view().setting_line


def test_time_in_a_trial_of_intervals_has_no_limit_of_a_single_interval(told):
    protocol = study()
    schedule = build_schedule(protocol, "P001", 1)
    session = dataclasses.replace(told.session, protocol=protocol, schedule=schedule, stages=stages(protocol, schedule))
    paired = dataclasses.replace(told, protocol=protocol, schedule=schedule, session=session)
    paired.tell("trial_started", 10.0, trial=1, attempt=1, sealed="00")
    paired.now_s += 12.0
    assert paired.view().trial_time.words == "0:12"


def test_an_ended_session_says_how_many_trials_were_not_delivered(told):
    told.tell("interval_ended", 5.0, trial=2, attempt=1, interval=1, outcome="complete", invalid=["delay_error_ms"])
    told.tell("session_ended", 5.0, status="completed", fingerprint="abcd")
    line = "All answers are on disk  ·  1 trial unanswered: no attempt was delivered  ·  Fingerprint abcd"
    assert told.view().setting_line == line


def test_reaching_shows_targets_reached_while_they_are_and_after(told):
    (first, *_) = (trial.number for trial in told.schedule.trials if trial.code.startswith("D"))
    told.welcome()
    told.start(first)
    assert told.view().setting_line.endswith("reaching targets  ·  0 of 6 targets")
    for target in (0, 1):
        told.tell("target_reached", 1.0, trial=first, target=target, t_task_s=1.0)
    assert told.view().setting_line.endswith("reaching targets  ·  2 of 6 targets")
    told.end(first, "timeout")
    assert told.view().setting_line.endswith("answering  ·  2 of 6 targets")
    told.start(first, 2)
    assert told.view().setting_line.endswith("0 of 6 targets")


def test_a_lost_recording_is_told_first_by_the_recorder_or_the_journal(told):
    told.welcome()
    told.start(1)
    told.end(1, lateness_p99_ms=99.0)
    assert told.view().beyond[0].startswith("Liquid setting 1 out of limits")
    line = "Recording of Liquid setting 1 lost: No space left on device"
    assert told.view(lost={1: "No space left on device"}).beyond[0] == line
    told.tell("recording_lost", trial=1, attempt=1, reason="No space left on device")
    assert told.view().beyond[0] == line
    assert len(told.view(lost={1: "No space left on device"}).beyond) == 2
    for trial, count in ((1, 1200), (2, 0), (3, 7)):
        told.tell("recorded", trial=trial, attempt=1, samples_unrecorded=count)
    third, first = told.view().beyond[1:3]
    assert first == "Recording of Liquid setting 1 lacks 1\u2009200 samples: the disk does not keep up"
    assert third.startswith("Recording of Delay setting 1 lacks 7 samples")


def test_a_failed_outlet_is_shown_by_the_outlets_or_the_journal(told):
    told.welcome()
    told.start(1)
    line = "Serial port: it was unplugged"
    assert told.view(outlets_lost={"Serial port": "it was unplugged"}).beyond == (line,)
    told.tell("outlet_lost", outlet="Serial port", reason="it was unplugged")
    assert told.view().beyond == (line,)
    assert told.view(outlets_lost={"Serial port": "it was unplugged"}).beyond == (line,)


def test_a_device_slower_than_at_the_start_is_named_until_it_recovers(told):
    health = ServoHealth(1000.0)
    said = []
    for delay_ticks in (1, 3, 1):
        samples = records(SAMPLE, 5)
        samples.delay_ticks = delay_ticks
        health.take(samples)
        said.append(told.view(health).beyond)
    assert said[0] == said[2] == ()
    assert said[1][0].startswith("The device answers after 3 ticks, after 1 at the start: ")


def test_what_is_offered_follows_pause_trouble_and_end(told):
    told.welcome()
    told.start(1)
    told.end(1, outcome="interrupted")
    told.tell("paused", by="participant")
    view = told.view()
    assert (view.state, view.may_resume, view.may_repeat) == ("paused", True, False)
    told.tell("broke", what="the device 'mouse' stopped responding")
    view = told.view(force_on=False)
    assert view.state == "trouble"
    assert "stopped responding" in view.trouble
    assert [view.may_pause, view.may_resume, view.may_repeat] == [False, False, False]
    for ready, faults in ((True, 0), (False, 2)):  # whatever else is wrong
        device = told.view(device_ready=ready, faults=faults).device
        assert (device.ready, dict(device.rows)["Safety faults"]) == (ready, str(faults))
    told.tell("session_ended", 4.0, status="withdrawn", reason="")
    ended_s = told.view().elapsed_s
    told.now_s += 100.0
    view = told.view()
    assert (view.over, view.state_word, view.elapsed_s) == (True, "Withdrawn", ended_s)


def test_a_complete_session_has_every_step_done(told):
    told.welcome()
    told.tell("session_ended", 4.0, status="completed", reason="", fingerprint="k3vq-7m2p-xw4d")
    assert {row.state for row in told.view().steps} == {"done"}
    assert told.view().elapsed_s == 5.0
    assert told.view().trials_line == "4 of 4 trials"
    assert told.view().setting_line.endswith("Fingerprint k3vq-7m2p-xw4d")


def test_progress_counts_trials_that_were_left_behind_part_by_part(told):
    told.welcome()
    told.now_s += 3600.0  # however long it took
    assert (told.view().main_trials, told.view().trials_line) == (((0, 2), (0, 2)), "0 of 4 trials")
    told.start(1)
    told.end(1)
    assert told.view().trials_line == "0 of 4 trials"
    told.answer(1)
    told.start(2)
    assert (told.view().main_trials, told.view().trials_line) == (((1, 2), (0, 2)), "1 of 4 trials")
    told.end(2)
    told.answer(2)
    told.tell("page_shown", 1.0, page="reaching")
    told.start(3)
    told.end(3)
    told.answer(3)
    told.tell("repeat", trial=3, reason="phone rang")
    assert (told.view().main_trials, told.view().trials_line) == (((2, 2), (0, 2)), "2 of 4 trials")
    told.tell("session_ended", 1.0, status="withdrawn", reason="")
    assert told.view().trials_line == "2 of 4 trials"


def test_a_resumed_session_counts_what_was_worked_and_not_the_gap(told):
    told.welcome()  # at 1 s
    told.tell("note", 2.0, kind="note", text="before")
    told.tell("session_resumed", 1020.0, gap_s=1020.0)
    told.tell("page_shown", 0.5, page="welcome")
    told.tell("note", 0.5, kind="mark", text="")
    told.now_s += 1.0
    view = told.view()
    assert view.elapsed_s == 5.0
    assert [note.at_s for note in view.notes] == [4.0, 3.0]
    told.start(1)  # at 15 s of work; the page was there since 1 s
    assert told.view().steps[0].note == "0:14"
    told.tell("session_resumed", 300.0)
    told.tell("session_ended", 2.0, status="aborted", reason="")
    told.now_s += 60.0
    assert told.view().elapsed_s == 17.0


def test_counts_are_of_what_is_on_disk(told):
    told.welcome()
    told.start(1)
    told.end(1)
    told.answer(1)
    told.tell("note", kind="mark", text="")
    counts = dict(told.view().counts)
    assert counts["Answers on disk"] == "2 of 8"
    assert counts["Trials within limits"] == "1 of 1"
    assert counts["Marks, repeats"] == "1, 0"


def test_a_trial_out_of_limits_says_which_and_by_how_much_the_newest_first(told):
    told.welcome()
    told.start(1)
    told.end(1, lateness_p99_ms=1.0, worst_gap_ms=31.25)
    told.start(2)
    told.end(2, lateness_p99_ms=1.0)
    told.start(3)
    told.end(3, first_frame_gap_ms=327.211752, worst_frame_gap_ms=300.0)
    assert told.view().beyond == (
        "Delay setting 1 out of limits: time to the first frame 327 ms, limit 250 ms; longest gap between frames "
        "300 ms, limit 250 ms",
        "Liquid setting 1 out of limits: longest gap of the servo 31.2 ms, limit 20 ms",
    )


@pytest.mark.parametrize("blinding", ["double", "single"])
def test_what_tells_a_condition_is_judged_before_an_operator_who_sees_forces_alone(told, blinding):
    if blinding == "single":
        told.make_single_blind()
    told.welcome()
    told.start(1)
    told.end(1, withheld_share=0.0712, delay_error_p95_ms=27.211752)
    said = [line.partition(" out of limits: ")[2] for line in told.view().beyond]
    single = "delay error, p95, 27.2 ms, limit 25 ms; force withheld 7.12 %, limit 5 %"
    assert said == ([] if blinding == "double" else [single])
    assert dict(told.view().counts)["Trials within limits"] == ("1 of 1" if blinding == "double" else "0 of 1")


def test_every_limit_of_a_trial_has_a_name_for_the_operator(told):
    bad = dict.fromkeys(header(TRIALS), 1000000000.0) | {"targets_reached": 0.0}
    limits = Limits(targets_percent=50).model_dump()
    judged = {measure for measure, _, _ in beyond_limits(bad, limits)}
    assert judged == set(MEASURES)


def test_tiles_judge_by_the_asked_rate_and_the_protocols_limit_and_claim_nothing_unmeasured(told, health):
    tiles = told.view(health).tiles
    assert [tile.verdict for tile in tiles] == ["ok", "ok", "ok", "ok"]
    assert (tiles[0].value, tiles[1].value, tiles[1].unit) == ("1000.0", "15", "µs")
    assert {tile.verdict for tile in told.view().tiles} == {"open"}


def test_no_word_of_a_view_names_a_condition_a_force_or_a_limiter(told, health):
    told.welcome()
    for trial in told.schedule.trials:
        told.start(trial.number)
        said = " ".join(words(told.view(health))).lower().split()
        for secret in SECRETS:
            assert secret not in said
        told.end(trial.number)
        told.answer(trial.number)
    assert "hidden" in " ".join(words(told.view(health)))


def test_durations_are_written_in_one_way() -> None:
    for seconds, words in (
        (0.4, "0 s"), (2.5, "3 s"), (45.2, "45 s"), (59.6, "1 min"), (150, "3 min"), (612, "10 min"),
        (3599, "1 h 00 min"), (3900, "1 h 05 min"),
    ):  # fmt: skip
        assert duration(seconds) == duration_range(seconds, seconds) == words
    assert [duration(one, tenths=True) for one in (0.6, 11.42, 120)] == ["0.6 s", "11.4 s", "2 min"]
    for least, most, words in (
        (900, 1920, "15 to 32 min"),
        (3300, 4200, "55 min to 1 h 10 min"),
        (3700, 7500, "1 h 02 min to 2 h 05 min"),
        (30, 150, "30 s to 3 min"),
    ):
        assert duration_range(least, most) == words
    assert (minutes(68), minutes(3723), grouped(45918)) == ("1:08", "1:02:03", "45\u2009918")
    assert (duration_words(62e-6), duration_words(1.4e-3)) == ("62 µs", "1.4 ms")
