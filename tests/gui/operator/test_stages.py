"""What the operator is told of a session's progress is what its journal holds."""

from study_app.gui.operator.operator_view import stages
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.delivered import within_limits
from study_app.store.progress import Progress
from tests.journal_lines import event_of


def test_trials_are_done_interrupted_judged_and_repeated(told):
    limit = told.protocol.limits.lateness_ms
    told.welcome()
    told.start(1)
    told.end(1, outcome="interrupted")
    told.tell("paused", by="operator")
    assert (told.progress.broken, told.progress.paused) == ({}, True)
    told.tell("resumed")
    told.start(1, attempt=2)
    assert (told.progress.paused, told.progress.here) == (False, 1)
    told.end(1, lateness_p99_ms=limit * 0.9)
    told.answer(1)
    told.start(2)
    told.end(2, lateness_p99_ms=limit * 1.1)
    assert told.session.broken(told.progress) == {1: (), 2: (("lateness_p99_ms", limit * 1.1, limit),)}
    assert ("Trials within limits", "1 of 2") in told.view().counts
    told.answer(2)
    told.tell("repeat", trial=2, reason="phone rang")
    assert (set(told.progress.answered), set(told.progress.broken), told.progress.repeats) == ({1}, {1}, 1)


def test_a_picture_that_came_too_early_is_judged_as_in_the_trials_table(told):
    told.welcome()
    told.start(1)
    told.make_single_blind()
    told.end(1, delay_error_p95_ms=-40.0)
    assert within_limits({"delay_error_p95_ms": -40.0}, told.protocol.limits.model_dump()) is False
    assert told.session.broken(told.progress) == {1: (("delay_error_p95_ms", -40.0, 25.0),)}


def test_a_resumed_session_is_where_its_journal_says_and_an_attempt_takes_back_the_one_before(told):
    told.welcome()
    told.start(1)
    told.end(1)
    told.answer(1)
    told.tell("broke", what="cable")
    told.tell("session_resumed", 60.0)
    assert told.progress.broke == ""
    told.start(1, attempt=2)
    assert (told.progress.answered, told.progress.broken) == ({}, {})
    assert told.session.trial(told.progress).number == 1
    again = Progress()
    again.take(event_of("page_shown", t_s=1.0, page="welcome"))
    again.take(event_of("note", t_s=2.0, kind="mark", text=""))
    assert (again.here, [note.kind for note in again.notes], again.t_s) == (0, ["mark"], 2.0)


def test_a_page_is_the_step_after_the_present_one_and_stays_it_when_shown_again(told):
    told.welcome()
    told.start(2)
    told.tell("page_shown", 1.0, page="reaching")
    assert told.schedule.steps[told.progress.here].page_id == "reaching"
    told.tell("page_shown", 1.0, page="reaching")  # after a resume: nothing moves
    assert told.schedule.steps[told.progress.here].page_id == "reaching"


def test_rows_cover_every_step_once_and_name_no_condition_and_no_liquid():
    protocol = load("rek2024")
    schedule = build_schedule(protocol, "P001", 1)
    rows = stages(protocol, schedule)
    assert [step for stage in rows for step in range(stage.first, stage.last + 1)] == list(range(len(schedule.steps)))
    labels = [stage.label for stage in rows]
    assert {"Liquid setting 1", "Liquid setting 3", "Delay setting 1 to 7"} <= set(labels)  # long blocks are one row
    conditions = {name for block in protocol.main_blocks for name in block.conditions}
    assert not {*conditions, "water", "honey", "oil", "ms"} & set(" ".join(labels).lower().split())
