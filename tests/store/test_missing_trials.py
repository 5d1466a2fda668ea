"""Missing trials of a session, from its journal: how many, why, and whether the study permits so many."""

import pytest

from study_app.store.journals.journal_events import Event
from study_app.store.session_progress.missing_trials import MissingTrials
from study_app.store.session_progress.progress import Progress
from tests.journal_lines import event_of

ATTEMPTS = 2
LIMITS = {"attempts": ATTEMPTS, "withheld_percent": 25, "frame_gap_ms": 250}


def answered_trial(trial: int) -> list[Event]:
    which = {"trial": trial, "attempt": 1}
    return [
        event_of("trial_started", **which, block="liquids", code="L1", phase="main", sealed="00"),
        event_of("trial_ended", **which, outcome="complete"),
        event_of("responses", **which, items=[{"item": "abx", "value": "like_first"}]),
    ]


def failed_trial(
    trial: int, *broken: str, attempts: int = ATTEMPTS, phase: str = "main", code: str = "L1"
) -> list[Event]:
    """Return the presentations of a trial whose first interval breaks limits."""
    events: list[Event] = []
    for attempt in range(1, attempts + 1):
        which = {"trial": trial, "attempt": attempt}
        events += [
            event_of("trial_started", **which, block="liquids", code=code, phase=phase, sealed="00"),
            event_of("interval_ended", **which, interval=1, outcome="complete", invalid=list(broken)),
            event_of("trial_ended", **which, outcome="invalid"),
        ]
    return events


def missing_after(*trials: list[Event], **limits: float) -> MissingTrials:
    progress = Progress()
    for line in (event_of("session_started", limits=LIMITS | limits), *(line for trial in trials for line in trial)):
        progress.process_line(line)
    return progress.missing_trials


@pytest.mark.parametrize(
    ("trials", "sentence"),
    [
        ([answered_trial(1), answered_trial(2)], ""),
        (
            [failed_trial(1, "withheld_percent"), answered_trial(2)],
            "1 of 2 trials was not delivered: the safety layer held back too much force (limit 25 %)",
        ),
        (
            [failed_trial(1, "withheld_percent")],
            "1 of 1 trial was not delivered: the safety layer held back too much force (limit 25 %)",
        ),
        (
            [failed_trial(1, "frame_gap_ms"), failed_trial(2, "frame_gap_ms"), answered_trial(3)],
            "2 of 3 trials were not delivered: frames were late or missing (limit 250 ms)",
        ),
        (
            [
                failed_trial(1, "withheld_percent"),
                failed_trial(2, "force_limit_n"),
                failed_trial(3, "withheld_percent"),
            ],
            "3 of 3 trials were not delivered: the safety layer held back too much force (limit 25 %) in 2, "
            "the force limit was reached in 1",
        ),
    ],
)
def test_a_sentence_says_how_many_trials_are_missing_and_why(trials: list[list[Event]], sentence: str) -> None:
    assert str(missing_after(*trials)) == sentence


def test_a_trial_is_missing_only_after_its_last_attempt_and_unless_it_is_answered_later() -> None:
    once = failed_trial(1, "withheld_percent", attempts=1)
    assert missing_after(once).count == 0
    assert missing_after(once, answered_trial(2)).count == 1, "the session went on without it"
    assert missing_after(failed_trial(1, "withheld_percent"), answered_trial(1)).count == 0, (
        "the operator repeated the block"
    )
    interrupted = [
        failed_trial(1, "withheld_percent")[0],
        event_of("trial_ended", trial=1, attempt=1, outcome="interrupted"),
    ]
    assert missing_after(interrupted, answered_trial(2)).count == 0
    practice = failed_trial(1, "withheld_percent", phase="practice")
    missing_trials = missing_after(practice, answered_trial(2))
    assert (missing_trials.count, missing_trials.asked) == (0, 1)


def test_missing_trials_are_counted_by_block_and_code() -> None:
    missing_trials = missing_after(
        *(failed_trial(n, "withheld_percent", code=code) for n, code in enumerate(("L2", "L1", "L2"), 1))
    )
    assert missing_trials.tracks == {("liquids", "L2"): 2, ("liquids", "L1"): 1}
    assert [(trial.trial, trial.broken) for trial in missing_trials.missing] == [
        (n, ("withheld_percent",)) for n in (1, 2, 3)
    ]


@pytest.mark.parametrize(("lost", "percent", "exceed"), [(2, 5, False), (3, 5, True), (1, 0, True), (40, 100, False)])
def test_a_session_is_incomplete_if_more_trials_are_missing_than_stated(lost: int, percent: int, exceed: bool) -> None:
    trials = [failed_trial(n, "withheld_percent") if n <= lost else answered_trial(n) for n in range(1, 41)]
    missing_trials = missing_after(*trials, missing_percent=percent)
    assert (missing_trials.count, missing_trials.asked, missing_trials.exceed) == (lost, 40, exceed)
    assert missing_trials.brief == f"{lost} of 40 not delivered"


def test_a_session_of_an_earlier_version_which_stated_no_number_is_never_incomplete() -> None:
    assert not missing_after(failed_trial(1, "withheld_percent")).exceed
    assert missing_after(answered_trial(1)).brief == ""
