import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import parse
from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import open_or_draw_key, read_key, whole_protocol
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.journals.journal_events import Event
from study_app.store.progress import Progress, progress_of
from study_app.store.receipt import without_conditions
from tests.journal_lines import event_from
from tests.protocol.trials.level_studies import text_of


def lines_of(*events: dict[str, Any]) -> list[Event]:
    start = {"event": "session_started", "participant": "P007", "seed": 11, "language": ""}
    numbered = enumerate((start, *events), start=1)
    return [event_from({"n": number, "t_s": number / 2, **event}) for number, event in numbered]


def shown(page: str) -> dict[str, Any]:
    return {"event": "page_shown", "page": page}


def left(page: str) -> dict[str, Any]:
    return {"event": "page_left", "page": page}


def started(trial: int, attempt: int = 1) -> dict[str, Any]:
    return {"event": "trial_started", "trial": trial, "attempt": attempt}


def ended(trial: int, attempt: int = 1, outcome: str = "complete") -> dict[str, Any]:
    return {"event": "trial_ended", "trial": trial, "attempt": attempt, "outcome": outcome}


def chosen(item: str, value: int | None, at_s: float) -> dict[str, Any]:
    return {"event": "choice", "trial": 1, "item": item, "value": value, "t_s": at_s}


ANSWERED = {"event": "responses", "trial": 1, "attempt": 1, "items": []}


@pytest.mark.parametrize(
    ("events", "step", "under_way"),
    [
        ([], 0, {}),
        ([shown("consent")], 0, {"page": "consent"}),
        ([shown("consent"), left("consent")], 1, {}),
        ([shown("consent"), left("consent"), started(1)], 1, {"trial": 1, "attempt": 1}),
        ([started(1), ended(1)], 0, {"trial": 1, "attempt": 1, "task_done": True}),
        ([started(1), ended(1, outcome="timeout")], 0, {"trial": 1, "attempt": 1, "task_done": True}),
        ([started(1), ended(1, outcome="interrupted")], 0, {"trial": 1, "attempt": 1}),
        ([started(1), ended(1), started(1, 2)], 0, {"trial": 1, "attempt": 2}),
        ([started(1), ended(1), ANSWERED], 1, {}),
        ([started(1), ended(1), started(2)], 1, {"trial": 2, "attempt": 1}),
        ([started(1), ended(1), shown("rest")], 1, {"page": "rest"}),
        ([shown("rest"), {"event": "session_resumed"}, shown("rest")], 0, {"page": "rest", "resumed": 1}),
        ([started(1), {"event": "broke", "what": "device"}], 0, {"trial": 1, "attempt": 1}),
        (
            [started(1), {"event": "session_ended", "status": "aborted"}],
            0,
            {"trial": 1, "attempt": 1, "ended": "aborted"},
        ),
    ],
)
def test_it_stands_at_the_first_step_that_was_not_left(
    events: list[dict[str, Any]], step: int, under_way: dict[str, Any]
) -> None:
    lines = lines_of(*events)
    assert place(progress_of(lines)) == place(Progress(lines[0], step=step, **under_way))


def place(told: Progress) -> dict[str, Any]:
    names = ("start", "step", "page", "trial", "attempt", "task_done", "answers", "ended", "resumed", "language")
    return {name: getattr(told, name) for name in names}


def test_choices_of_the_attempt_are_told_as_they_would_be_answered() -> None:
    lines = lines_of(
        started(1),
        {"event": "item_shown", "trial": 1, "item": "wet", "t_s": 3.0},
        chosen("wet", 3, 3.5),
        ended(1),
        {"event": "item_shown", "trial": 1, "item": "wet", "t_s": 4.0},
        {"event": "item_shown", "trial": 1, "item": "calm", "t_s": 4.0},
        {"event": "item_shown", "trial": 1, "item": "wet", "t_s": 9.0},
        chosen("wet", 5, 5.0),
        chosen("wet", 5, 6.0),
        chosen("wet", None, 7.0),
    )
    told = progress_of(lines)
    assert told.answers["wet"] == journal_events.Answer(onset_s=3.0, first_s=3.5, last_s=7.0, changes=2, value=None)
    assert told.answers["calm"] == journal_events.Answer(onset_s=4.0)


def test_choices_that_no_confirmation_followed_are_kept_by_attempt() -> None:
    removed = {"event": "answer_removed", "trial": 1, "item": "wet"}
    second = (started(1, 2), ended(1, 2), chosen("wet", 2, 7.0), removed, chosen("calm", None, 8.0))
    lines = lines_of(started(1), ended(1), chosen("wet", 5, 5.0), *second)
    assert progress_of(lines_of(started(1), ended(1), chosen("wet", 5, 5.0), started(1, 2))).answers == {}
    assert unconfirmed(lines) == {(1, 1): {"wet": 5}, (1, 2): {"calm": None}}
    assert unconfirmed([*lines, event_from(ANSWERED | {"attempt": 2})]) == {(1, 1): {"wet": 5}}


def unconfirmed(lines: list[Event]) -> dict[tuple[int, int], dict[str, Any]]:
    found = progress_of(lines).unconfirmed
    return {which: {item: given.value for item, given in chosen.items()} for which, chosen in found.items()}


@pytest.mark.parametrize(
    "steps",
    [
        ('sequence = ["viscosity"]', 'sequence = ["viscosity"]'),
        ('sequences = [["viscosity"], ["viscosity"]]', 'sequence = ["viscosity"]'),
        ("", 'sequences = [["viscosity"]]'),
        (),
    ],
)
def test_the_protocol_is_whole_again_with_its_key_whoever_has_which_steps(tmp_path: Path, steps: Sequence[str]) -> None:
    groups = "".join(f"\n[groups.g{number}]\n{own}\n" for number, own in enumerate(steps))
    shared = () if "" in steps else (('sequence = ["viscosity"]\n', "" if steps else 'sequences = [["viscosity"]]\n'),)
    protocol = parse(f"{text_of(*shared)}{groups}".encode(), "levels")
    open_or_draw_key(tmp_path, protocol, random=stream(1, "key").random)
    shown = json.loads(json.dumps(without_conditions(protocol)))
    assert whole_protocol(shown, read_key(tmp_path)) == protocol


def test_sessions_are_listed_while_a_participant_is_withdrawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, listed = StudyFolder(tmp_path), Path.glob
    study.session("P002", 1).path.mkdir(parents=True)
    gone = iter([True, False])

    def folder_that_goes(self: Path, pattern: str) -> Iterator[Path]:
        if next(gone):
            raise FileNotFoundError(self / "sub-P001")
        return listed(self, pattern)

    monkeypatch.setattr(Path, "glob", folder_that_goes)
    assert study.ids() == ("P002",)
