"""The operator reads how a track is doing, and nothing that depends on a level or on whether answers were correct."""

from typing import Any

import pytest

from study_app.gui.operator.operator_view import UNDELIVERED, track_words, unanswered_words
from study_app.protocol.model import Limits, Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.progress import Progress
from tests.journal_lines import event_of
from tests.protocol.trials.level_studies import study

CHOICES = {"first": "First", "second": "Second"}


class Told:
    """A session's progress, told trial by trial."""

    def __init__(self, protocol: Protocol) -> None:
        self.schedule = build_schedule(protocol, "P001", 1)
        self.progress = Progress()

    def tell(self, event: str, at_s: float, **fields: Any) -> None:
        sealed = {"sealed": "00"} if event == "trial_started" else {}
        self.progress.take(event_of(event, t_s=at_s, **sealed, **fields))

    def trial(self, number: int, answer: str, seconds: float = 1.0, attempt: int = 1) -> None:
        self.tell("trial_started", number * 10, trial=number, attempt=attempt)
        self.tell("trial_ended", number * 10 + 4, trial=number, attempt=attempt, outcome="complete")
        item = {"item": "choice_2ifc", "value": answer, "onset_s": 5.0, "first_s": 5.0 + seconds}
        self.tell("responses", number * 10 + 6, trial=number, attempt=attempt, items=[item])

    def lines(self) -> tuple[str, ...]:
        trial = next(one for one in self.schedule.trials if one.number == self.progress.of_intervals)
        return track_words(self.progress, self.schedule, trial, CHOICES)


@pytest.fixture
def told() -> Told:
    return Told(study(("standards = [1, 2]", "standards = [1]")))


def test_a_track_shows_answers_shares_run_and_time(told: Told) -> None:
    for number, answer in enumerate(("first", "first", "second", "first"), start=1):
        told.trial(number, answer, seconds=number / 2)
    code = told.schedule.trials[0].code
    assert told.lines() == (
        f"Track {code}: 4 of at most 24 answered",
        "First 75 %, Second 25 %",
        "longest run 2",
        "median answer time 1.25 s",
    )


def test_a_run_of_8_and_a_median_below_300_ms_are_marked(told: Told) -> None:
    for number in range(1, 8):
        told.trial(number, "second", seconds=0.31)
    assert not any(line.endswith("check") for line in told.lines())
    told.trial(8, "second", seconds=0.1)
    assert "longest run 8: check" in told.lines()
    for number in range(9, 18):
        told.trial(number, "first", seconds=0.29)
    assert "median answer time 0.29 s: check" in told.lines()


def test_what_was_repeated_is_counted_with_its_reason(told: Told) -> None:
    told.tell("trial_started", 1.0, trial=1, attempt=1)
    told.tell("trial_ended", 2.0, trial=1, attempt=1, outcome="interrupted")
    told.trial(1, "first", attempt=2)
    told.tell("repeat", 20.0, trial=1, reason="hand slipped")
    told.trial(1, "second", attempt=3)
    assert told.lines()[0].endswith("1 of at most 24 answered")
    assert told.lines()[1] == "First 0 %, Second 100 %"
    assert told.lines()[-2:] == ("repeated 1: interrupted", "repeated 1: hand slipped")
    told.tell("trial_started", 25.0, trial=2, attempt=1)
    told.tell("session_resumed", 50.0)
    told.trial(2, "first", attempt=2)
    assert told.lines()[-1] == "repeated 1: program ended"


def test_tracks_are_counted_apart(told: Told) -> None:
    told = Told(study())
    codes = [trial.code for trial in told.schedule.trials[:6]]
    assert len(set(codes)) == 2
    for number in range(1, 7):
        told.trial(number, "first")
    assert told.lines()[0] == f"Track {codes[5]}: {codes.count(codes[5])} of at most 24 answered"


def test_a_trial_without_intervals_has_no_track(told: Told) -> None:
    told.trial(1, "first")
    assert told.progress.of_intervals == 1
    told.progress.take(event_of("trial_started", t_s=30.0, trial=2, attempt=1))
    assert told.progress.of_intervals is None


def undelivered(told: Told, number: int, attempt: int, *limits: str) -> None:
    """Present a trial whose first interval broke limits."""
    told.tell("trial_started", 1.0, trial=number, attempt=attempt)
    told.tell("interval_ended", 2.0, trial=number, attempt=attempt, interval=1, outcome="complete", invalid=limits)
    told.tell("trial_ended", 3.0, trial=number, attempt=attempt, outcome="invalid")


def test_reasons_of_invalid_intervals_are_words_without_a_number(told: Told) -> None:
    undelivered(told, 1, 1, "pace_error_percent")
    undelivered(told, 1, 2, "pace_error_percent", "force_limit_n")
    told.trial(1, "first", attempt=3)
    assert told.lines()[-2:] == (
        "not delivered 2: the hand did not keep the pace",
        "not delivered 1: the force limit was reached",
    )
    assert not any("repeated" in line for line in told.lines())


def test_a_trial_that_was_never_delivered_is_counted_as_unanswered(told: Told) -> None:
    for attempt in (1, 2, 3):
        undelivered(told, 1, attempt, "level_error_ms")
        assert told.lines()[-1] == f"not delivered {attempt}: the visual delays did not differ as requested"
    told.trial(2, "first")
    assert told.lines()[-1] == "1 unanswered: no attempt was delivered"


def test_every_limit_that_makes_an_interval_invalid_has_words() -> None:
    assert set(UNDELIVERED) == {*Limits.model_fields, "force_limit_n"} - {"attempts"}


def test_an_ended_session_counts_trials_of_which_no_attempt_was_delivered(told: Told) -> None:
    assert unanswered_words(told.progress) == ""
    undelivered(told, 1, 1, "delay_error_ms")
    assert unanswered_words(told.progress) == "1 trial unanswered: no attempt was delivered"
    undelivered(told, 2, 1, "delay_error_ms")
    assert unanswered_words(told.progress) == "2 trials unanswered: no attempt was delivered"
    told.trial(2, "first", attempt=2)
    assert unanswered_words(told.progress) == "1 trial unanswered: no attempt was delivered"
