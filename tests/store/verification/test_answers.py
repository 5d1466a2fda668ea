"""Answers of a journal that contradict its choices or were never confirmed, and receipts that contradict a journal."""

from dataclasses import replace
from typing import Any

import pytest

from study_app import __version__
from study_app.store import receipt
from study_app.store.journals.journal_events import Event
from study_app.store.verification.verify_session import _changed_responses, _differing_fields, _unconfirmed_answers
from tests.journal_lines import event_of

ROW: dict[str, Any] = {
    "item": "calm", "number": 1, "value": 5, "onset_s": 2.0, "first_s": 3.0, "last_s": 4.0, "changes": 1,
}  # fmt: skip
WAS_CHANGED = "that differs from the one chosen earlier: it has been changed"


def numbered(*lines: Event) -> list[Event]:
    return [replace(line, n=number) for number, line in enumerate(lines, start=1)]


def confirmed_answer(*rows: dict[str, Any], form: str | None = None) -> list[Event]:
    """Return a trial or a form with the choices 4 and 5 for one of two items, and these confirmed rows."""
    where = {"trial": 3} if form is None else {"form": form}
    begun = trial(3) if form is None else form_shown(form)
    end = "responses" if form is None else "form_answered"
    return numbered(
        begun,
        event_of("item_shown", t_s=2.0, item="calm", **where),
        event_of("choice", t_s=3.0, item="calm", value=4, **where),
        event_of("choice", t_s=4.0, item="calm", value=5, **where),
        event_of("item_shown", t_s=2.5, item="warm", **where),
        event_of(end, t_s=5.0, items=rows, **({"trial": 3, "attempt": 2} if form is None else {"form": form})),
    )


WARM: dict[str, Any] = {"item": "warm", "number": 2, "onset_s": 2.5, "changes": 0}


@pytest.mark.parametrize(
    ("changes", "is_changed"),
    [
        ({}, False),
        ({"value": 4}, True),
        ({"changes": 0}, True),
        *(({name: ROW[name] + shift}, shift > 1.1e-6) for name in ("onset_s", "first_s", "last_s")
          for shift in (1e-6, 2e-6)),
        ({"onset_s": None}, True),
        ({"last_s": None}, True),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("form", "where"), [(None, "trial 3"), ("start", "form start")])
def test_an_answer_that_differs_from_the_choices_is_named_with_its_line(
    changes: dict[str, Any], is_changed: bool, form: str | None, where: str
) -> None:
    """Times in lines are rounded to a microsecond."""
    end = "responses" if form is None else "form_answered"
    expected = [f"line 6 ({end}) has an answer for 'calm' in {where} {WAS_CHANGED}"] if is_changed else []
    assert list(_changed_responses(confirmed_answer(ROW | changes, WARM, form=form))) == expected


def test_an_answer_without_a_choice_and_a_choice_without_an_answer_are_named() -> None:
    """In format 2, in which answers state their kind, a question that was not answered may have been hidden again."""
    lacking = "line 6 (responses) does not contain the answer to {!r} in trial 3: it has been changed"
    invented = f"line 6 (responses) has an answer for 'cold' in trial 3 {WAS_CHANGED}"
    cold = {"item": "cold", "number": 3, "value": 2, "first_s": 3.5, "last_s": 3.5, "changes": 0}
    assert list(_changed_responses(confirmed_answer(ROW, WARM, cold))) == [invented]
    (row,) = confirmed_answer(ROW)[-1].items  # type: ignore[attr-defined]
    for kind, expected in ((None, [lacking.format("warm")]), ("statement", [])):
        lines = confirmed_answer(ROW)
        lines[-1] = replace(lines[-1], items=(replace(row, kind=kind),))  # type: ignore[call-arg]
        assert list(_changed_responses(lines)) == expected
    assert list(_changed_responses(confirmed_answer(WARM))) == [lacking.format("calm")]


def form_shown(form: str, after: str | None = None) -> Event:
    return event_of("form_shown", form=form, after=after)


def trial(number: int) -> Event:
    return event_of("trial_started", trial=number, attempt=1)


CHOICE = event_of("choice", trial=3, item="calm", value=5)
ASKED = event_of("page_shown", page="rest")
COMPLETED, ABORTED = (event_of("session_ended", status=status) for status in ("completed", "aborted"))
ANSWER_OF_2 = "line 2 contains an answer in trial 3 that was never confirmed: a line was removed"
FORM_1 = "line 1 shows form start, which was never confirmed: a line was removed"


@pytest.mark.parametrize(
    ("lines", "sentences"),
    [
        ((trial(3), CHOICE, trial(4)), [ANSWER_OF_2]),
        ((trial(3), CHOICE, trial(4), trial(5)), [ANSWER_OF_2]),
        ((trial(3), CHOICE, COMPLETED), [ANSWER_OF_2]),
        ((trial(3), CHOICE, replace(COMPLETED, status="incomplete")), [ANSWER_OF_2]),  # type: ignore[call-arg]
        ((trial(3), CHOICE, ABORTED), []),
        ((trial(3), CHOICE, trial(3), trial(4)), []),
        ((trial(3), CHOICE, event_of("responses", trial=3, attempt=1), trial(4)), []),
        ((trial(3), CHOICE, event_of("passed_over", trial=3, reason=""), trial(4)), []),
        ((trial(3), CHOICE, event_of("responses", trial=4, attempt=1), trial(4)), [ANSWER_OF_2]),
        ((trial(3), event_of("choice", form="start", item="calm", value=5), trial(4)), []),
        ((form_shown("start"), ASKED), [FORM_1]),
        ((form_shown("start"), trial(1)), [FORM_1]),
        ((form_shown("start"), form_shown("load")), [FORM_1]),
        ((form_shown("start"), form_shown("start", "stir")), [FORM_1]),
        ((form_shown("start"), form_shown("start"), COMPLETED), [FORM_1.replace("line 1", "line 2")]),
        ((form_shown("start"), event_of("form_answered", form="start"), ASKED), []),
        ((form_shown("start"), event_of("session_resumed"), ASKED), []),
        ((form_shown("start"), event_of("passed_over", page="rest", reason=""), ASKED), []),
        ((form_shown("start"), ABORTED), []),
    ],
)
def test_answers_of_a_continued_session_were_confirmed(lines: tuple[Event, ...], sentences: list[str]) -> None:
    assert list(_unconfirmed_answers(numbered(*lines))) == sentences


AT, LATER = "2026-03-02T09:30:00.000+01:00", "2026-03-02T11:30:00.000+01:00"


def test_each_field_of_a_receipt_that_the_journal_contradicts_is_named() -> None:
    entry = {"at": LATER, "operator": "CD"}
    start = event_of("session_started", at=AT, device="falcon", version=__version__)
    resumed = event_of("session_resumed", at=LATER, receipt_hash=receipt.digest(entry))
    fields = {
        "started_at": AT, "status": "unfinished", "reason": "", "ended_at": None, "generator": receipt.GENERATOR,
        "device": {"name": "falcon"}, "clock": {"origin_at": AT}, "versions": {"liquid-study": __version__},
        "resumed": [entry],
    }  # fmt: skip
    assert _differing_fields(fields, [start, resumed]) == []
    for name, wrong in (
        ("started_at", LATER), ("status", "completed"), ("reason", "tired"), ("ended_at", LATER), ("generator", "dice"),
        ("device", {"name": "mouse"}), ("device", {}), ("clock", {"origin_at": LATER}),
        ("versions", {"liquid-study": "0.1"}), ("resumed", [entry | {"operator": "EF"}]),
        ("resumed", [entry | {"at": AT}]), ("resumed", [7]),
    ):  # fmt: skip
        assert _differing_fields(fields | {name: wrong}, [start, resumed]) == [name]
    ended = fields | {"status": "completed", "reason": "r", "ended_at": LATER}
    assert _differing_fields(ended, [start, resumed, COMPLETED]) == []
    without_hash = replace(resumed, receipt_hash=None)  # type: ignore[call-arg]
    assert _differing_fields(fields | {"resumed": [entry | {"operator": "EF"}]}, [start, without_hash]) == []
    earlier = replace(start, version="0.1")  # type: ignore[call-arg]
    of_earlier = fields | {"generator": "dice", "versions": {"liquid-study": "0.1"}}
    assert _differing_fields(of_earlier, [earlier, resumed]) == []
