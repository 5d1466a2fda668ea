import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, build_schedule
from study_app.protocol.streams import stream
from study_app.session.start import resumed
from study_app.store.blinded.blinding import open_or_draw_key, read_key, whole_protocol
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.journals.journal import read
from study_app.store.journals.journal_events import Event
from study_app.store.progress import Progress, progress_of
from study_app.store.receipt import without_conditions
from tests.journal_lines import event_from
from tests.protocol.trials.level_studies import text_of
from tests.store.conftest import Attend, Start


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


ENDED = {"event": "session_ended", "status": "aborted"}
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


def test_wherever_a_session_stops_it_stands_where_its_schedule_was(
    protocol: Protocol, start: Start, attend: Attend
) -> None:
    """Cut after every line of a whole session: steps are left one by one, in the schedule's order."""
    store = start()
    store.append(journal_events.PageShown(page="consent"))
    store.append(journal_events.PageLeft(page="consent"))
    attend(store)
    steps = build_schedule(protocol, "P007", 11).steps
    stands = [progress_of(store.lines[:count]) for count in range(1, len(store.lines) + 1)]
    store.close()
    for told in stands:
        step = steps[told.step] if told.step < len(steps) else None
        if told.page is not None:
            assert step == PageStep(told.page)
        if told.trial is not None:
            assert step is not None
            assert not isinstance(step, PageStep)
            assert step.number == told.trial
    assert all(0 <= after.step - before.step <= 1 for before, after in itertools.pairwise(stands))
    assert (stands[0].step, stands[-1].step) == (0, len(steps))


def test_the_protocol_is_kept_without_its_conditions(protocol: Protocol) -> None:
    shown, whole = without_conditions(protocol), protocol.model_dump(mode="json")
    assert set(whole) - set(shown) == {"liquids", "conditions"}
    kept = ("questionnaires", "scales", "pages", "tasks", "limits")
    assert [shown[name] for name in kept] == [whole[name] for name in kept]
    found = {name: (block["codes"], block["compares"]) for name, block in shown["blocks"].items()}
    assert found == {
        "practice": (["practice"], None),
        "liquids": (["L1", "L2"], "liquids"),
        "delays": (["D1", "D2"], "delays"),
    }
    assert not any("conditions" in block for block in shown["blocks"].values())


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


def test_of_a_folder_a_torn_line_does_not_count_and_what_is_no_session_is_named(tmp_path: Path, start: Start) -> None:
    with start() as store:
        store.append(journal_events.PageShown(page="consent"))
    with store.folder.journal.open("ab") as file:
        file.write(b'{"n":3,"event":"page_left"')
    told = progress_of(read(store.folder.journal))
    assert (told.step, told.page) == (0, "consent")
    with pytest.raises(StoreError, match="is not a session folder: name one such as"):
        resumed(tmp_path)
    with pytest.raises(StoreError, match="does not begin with session_started"):
        progress_of([])


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
