import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.protocol.load import parse
from study_app.protocol.randomization.streams import stream
from study_app.protocol.source.files import shipped, shipped_file
from study_app.store.blinded.blinding import complete_protocol, open_or_draw_key, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals.journal_events import Event
from study_app.store.receipt import without_conditions
from study_app.store.session_progress.progress import Progress, attempt_name, progress_of, recordable, trial_results
from tests.journal_lines import event_of
from tests.protocol.edited_studies import STUDIES
from tests.protocol.edited_studies import text_of as edited
from tests.protocol.trials.level_studies import study, text_of

ORACLE = Path(__file__).parents[1] / "analysis" / "oracle"


def assert_whole_with_key(folder: Path, text: bytes) -> None:
    protocol = parse(text, "study")
    open_or_draw_key(folder, protocol, random=stream(1, "key").random)
    published = json.loads(json.dumps(without_conditions(protocol)))
    completed, expected = complete_protocol(published, read_key(folder)).model_dump(), protocol.model_dump()
    for block in (*completed["blocks"].values(), *expected["blocks"].values()):
        block["conditions"], block["compares"] = sorted(block["conditions"]), None  # in the order of the codes
    assert completed == expected


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
    assert_whole_with_key(tmp_path, f"{text_of(*shared)}{groups}".encode())


@pytest.mark.parametrize("path", [*map(shipped_file, shipped()), *STUDIES.glob("*.toml"), *ORACLE.glob("*.toml")])
def test_the_protocol_of_every_study_is_whole_again_with_its_key(tmp_path: Path, path: Path) -> None:
    assert_whole_with_key(tmp_path, path.read_bytes())


def test_sessions_are_listed_while_a_participant_is_withdrawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, list_folder = StudyFolder(tmp_path), Path.glob
    study.session("P002", 1).path.mkdir(parents=True)
    vanishes = iter([True, False])

    def folder_that_goes(self: Path, pattern: str) -> Iterator[Path]:
        if next(vanishes):
            raise FileNotFoundError(self / "sub-P001")
        return list_folder(self, pattern)

    monkeypatch.setattr(Path, "glob", folder_that_goes)
    assert study.ids() == ("P002",)


def test_each_step_lasts_from_its_first_page_to_the_next_without_the_time_of_a_gap() -> None:
    progress = Progress()
    for line in (
        event_of("page_shown", t_s=2.0, page="welcome"),
        event_of("page_left", t_s=9.0, page="welcome"),
        event_of("trial_started", t_s=10.0, trial=1, attempt=1),
        event_of("trial_started", t_s=13.0, trial=1, attempt=2),
        event_of("session_resumed", t_s=113.0),
        event_of("trial_started", t_s=115.0, trial=1, attempt=3),
        event_of("responses", t_s=120.0, trial=1, attempt=3),
        event_of("form_shown", t_s=121.5, form="end"),
    ):
        progress.process_line(line)
    assert (progress.here, progress.here_since_s, progress.away_s) == (2, 121.5, 100.0)
    assert progress.durations_s == {0: 10.0 - 2.0, 1: 121.5 - 10.0 - 100.0}
    progress.process_line(event_of("session_ended", t_s=125.0, status="completed"))
    assert progress.durations_s[2] == 125.0 - 121.5
    ends = {status: Progress() for status in ("completed", "incomplete", "aborted", "withdrawn", "broken")}
    for status, ended in ends.items():
        ended.process_line(event_of("session_ended", status=status))
    assert [status for status, ended in ends.items() if ended.reached_end] == ["completed", "incomplete"]


def test_each_further_attempt_at_a_trial_of_intervals_has_its_reason() -> None:
    progress = Progress()
    for attempt, (outcome, between) in enumerate(
        (("interrupted", {}), ("complete", {"name": "repeat", "reason": "a call"}), ("invalid", {}), ("", {})), start=1
    ):
        which = {"trial": 4, "attempt": attempt}
        progress.process_line(event_of("trial_started", t_s=10.0, phase="main", arrangement="SC", **which))
        progress.process_line(event_of("trial_ended", t_s=12.0, outcome=outcome, **which))
        if between:
            progress.process_line(event_of(t_s=13.0, trial=4, **between))
    assert progress.repeated == {4: ("interrupted", "a call")}
    assert progress.invalid == 1


def test_the_operators_facts_about_a_trial_are_reset_when_it_is_repeated() -> None:
    progress, which = Progress(), {"trial": 4, "attempt": 2}
    answer = {"item": "which", "value": "second", "onset_s": 20.0, "first_s": 21.5, "last_s": 22.75}
    measured = {"device_delay_ticks": 4, "loop_delay_ticks": 1}
    for line in (
        event_of("session_started", limits={"lateness_ms": 2.0}),
        event_of("trial_started", t_s=10.0, phase="main", arrangement="SC", block="b", code="V1", **which),
        event_of("interval_ended", t_s=14.0, interval=1, invalid=["level_error_percent"], **which, **measured),
        event_of("trial_ended", t_s=17.0, outcome="complete", lateness_p99_ms=2.5, **which),
        event_of("responses", t_s=23.0, items=[answer], **which),
        event_of("recorded", t_s=24.0, samples_unrecorded=7, **which),
        event_of("recording_lost", t_s=25.0, trial=5, attempt=1, reason="no space"),
        event_of("session_resumed", t_s=125.0),
        event_of("note", t_s=130.0, kind="note", text="coughed"),
    ):
        progress.process_line(line)
    trial_answers = progress.trial_answers[4]
    assert (trial_answers.value, trial_answers.seconds, progress.answered) == ("second", 1.5, {4: 1})
    assert (progress.broken[4], progress.undelivered) == (
        (("lateness_p99_ms", 2.5, 2.0),), {4: ("level_error_percent",)},
    )  # fmt: skip
    assert progress.late == {4: "the device answered after 4 ticks, but the servo assumes 1 tick"}
    assert (progress.lacking, progress.lost) == ({4: 7}, {5: "no space"})
    assert [(note.text, note.t_s) for note in progress.notes] == [("coughed", 130.0 - 100.0)]
    progress.process_line(event_of("repeat", t_s=131.0, trial=4, reason="noise"))
    assert (progress.trial_answers, progress.broken, progress.late, progress.answered) == ({}, {}, {}, {})


@pytest.mark.parametrize(
    ("limits", "invalid", "missing"), [({"attempts": 3.0}, 2, 0), ({"attempts": 3.0}, 3, 1), ({}, 1, 1)]
)
def test_a_trial_counts_as_missing_only_if_it_is_not_repeated(
    limits: dict[str, float], invalid: int, missing: int
) -> None:
    progress = Progress()
    progress.process_line(event_of("session_started", limits=limits))
    for attempt in range(1, invalid + 1):
        which = {"trial": 4, "attempt": attempt}
        progress.process_line(event_of("trial_started", phase="main", arrangement="SC", block="b", code="V1", **which))
        progress.process_line(event_of("trial_ended", outcome="invalid", **which))
    assert (progress.missing_trials.count, progress.missing_trials.asked) == (missing, missing)


def test_choices_that_were_not_confirmed_are_kept_by_trial_and_attempt() -> None:
    progress = Progress()
    lines = [
        event_of("trial_started", t_s=10.0, trial=4, attempt=2, phase="main"),
        event_of("trial_ended", t_s=17.0, trial=4, attempt=2, outcome="complete"),
        event_of("item_shown", t_s=18.0, trial=4, item="thick"),
        event_of("item_shown", t_s=18.5, trial=4, item="warm"),
        event_of("choice", t_s=20.0, trial=4, item="thick", value=6),
    ]
    for line in lines:
        progress.process_line(line)
    assert {which: dict(answers) for which, answers in progress.unconfirmed.items()} == {
        (4, 2): {"thick": progress.answers["thick"]}
    }
    answer = progress.answers["thick"]
    assert (answer.value, answer.onset_s, answer.first_s) == (6, 18.0, 20.0)
    assert progress.trial_lasted_s == 7.0
    progress.process_line(event_of("broke", t_s=21.0, what="the cable"))
    progress.process_line(event_of("session_resumed", t_s=31.0))
    assert (progress.broke, progress.paused, progress.away_s, progress.trial_lasted_s) == ("", False, 10.0, None)
    answers = [{"item": "thick", "value": 6, "first_s": 1.0}, {"item": "warm"}]
    progress.process_line(event_of("responses", t_s=40.0, trial=4, attempt=2, items=answers))
    assert (progress.answered, progress.unconfirmed) == ({4: 1}, {})
    progress.process_line(event_of("repeat", t_s=41.0, trial=4, reason="noise"))
    assert (progress.answered, progress.repeats) == ({}, 1)


PASSED = {"reason": "the criterion was met"}


def test_each_line_leaves_the_session_at_its_step_page_and_trial() -> None:
    """(step, page, trial, attempt, task done) after each line: what resuming starts from."""
    progress = Progress()
    for line, expected in (
        (event_of("page_shown", page="welcome"), (0, "welcome", None, 0, False)),
        (event_of("page_shown", page="welcome"), (0, "welcome", None, 0, False)),
        (event_of("page_left", page="welcome"), (1, None, None, 0, False)),
        (event_of("page_shown", page="rules"), (1, "rules", None, 0, False)),
        (event_of("trial_started", trial=1, attempt=1), (2, None, 1, 1, False)),
        (event_of("trial_ended", trial=1, attempt=1, outcome="timeout"), (2, None, 1, 1, True)),
        (event_of("trial_started", trial=1, attempt=2), (2, None, 1, 2, False)),
        (event_of("trial_ended", trial=1, attempt=2, outcome="interrupted"), (2, None, 1, 2, False)),
        (event_of("trial_started", trial=1, attempt=3), (2, None, 1, 3, False)),
        (event_of("trial_ended", trial=1, attempt=3, outcome="complete"), (2, None, 1, 3, True)),
        (event_of("responses", trial=1, attempt=3), (3, None, None, 0, False)),
        (event_of("passed_over", page="rest", **PASSED), (4, None, None, 0, False)),
        (event_of("passed_over", trial=2, **PASSED), (5, None, None, 0, False)),
        (event_of("trial_started", trial=3, attempt=1), (5, None, 3, 1, False)),
        (event_of("trial_started", trial=4, attempt=1), (6, None, 4, 1, False)),
        (event_of("form_shown", form="end"), (7, "end", None, 0, False)),
        (event_of("form_answered", form="end"), (8, None, None, 0, False)),
        (event_of("trial_started", trial=1, attempt=4), (2, None, 1, 4, False)),
    ):
        progress.process_line(line)
        at = (progress.step, progress.page, progress.trial, progress.attempt, progress.task_done)
        assert at == expected, line
    assert (progress.presented, progress.steps) == ({1: 4, 3: 1, 4: 1}, {1: 2, 3: 5, 4: 6})


def test_a_repeated_form_is_counted_by_its_block_and_starts_without_choices() -> None:
    progress, choice = Progress(), {"item": "calm", "value": 3, "first_s": 2.0}
    for line in (
        event_of("form_shown", form="load"),
        event_of("choice", t_s=2.0, form="load", item="calm", value=3),
        event_of("form_shown", form="load"),
    ):
        progress.process_line(line)
    assert progress.answers == {}, "the page was shown anew"
    for line in (
        event_of("choice", t_s=2.0, form="load", item="calm", value=3),
        event_of("answer_removed", t_s=3.0, form="load", item="calm"),
    ):
        progress.process_line(line)
    assert (progress.answers["calm"].given, progress.unconfirmed) == (False, {})
    progress.process_line(event_of("form_answered", form="load", items=[choice]))
    assert progress.answers == {}
    progress.process_line(event_of("form_shown", form="load", after="delays"))
    items = [choice, {"item": "wet"}, choice]
    progress.process_line(event_of("form_answered", form="load", after="delays", items=items))
    assert progress.answered == {("load", None): 1, ("load", "delays"): 2}
    for phase, expected in (("practice", {}), ("main", {5: 1})):
        other = Progress()
        other.process_line(event_of("trial_started", trial=5, attempt=1, phase=phase))
        other.process_line(event_of("responses", trial=5, attempt=1, items=[choice]))
        assert (other.answered, other.trial_answers) == (expected, {}), "a trial without intervals"


def test_choices_of_a_trial_that_begins_again_are_kept_by_attempt_and_given_up_in_progress() -> None:
    progress = Progress()
    for line in (
        event_of("trial_started", trial=4, attempt=1, phase="main"),
        event_of("choice", t_s=2.0, trial=4, item="thick", value=6),
        event_of("trial_started", trial=4, attempt=2, phase="main"),
        event_of("choice", t_s=9.0, trial=4, item="thick", value=2),
    ):
        progress.process_line(line)
    unconfirmed = {which: answers["thick"].value for which, answers in progress.unconfirmed.items()}
    assert (unconfirmed, progress.answers["thick"].value) == ({(4, 1): 6, (4, 2): 2}, 2)
    progress.process_line(event_of("page_shown", page="rest"))
    assert (progress.answers, progress.unconfirmed.keys()) == ({}, {(4, 1), (4, 2)})


def test_the_state_of_a_session_is_that_of_its_last_lines() -> None:
    lines = [
        event_of("session_started", language="de"),
        event_of("language_chosen", language="en"),
        event_of("trial_started", t_s=3.0, trial=1, attempt=1),
        event_of("target_reached", t_s=4.0, trial=1, attempt=1),
        event_of("target_reached", t_s=5.0, trial=1, attempt=1),
        event_of("outlet_lost", t_s=5.5, outlet="camera", reason="unplugged"),
        event_of("broke", t_s=5.6, what="the cable"),
        event_of("paused", t_s=6.0),
    ]
    progress = progress_of(lines)
    assert (progress.start, progress.language, progress.targets, progress.t_s) == (lines[0], "en", 2, 6.0)
    assert (progress.outlets_lost, progress.broke, progress.paused) == ({"camera": "unplugged"}, "the cable", True)
    assert (progress.trial_since_s, progress.trial_lasted_s) == (3.0, None)
    for line in (event_of("device_reconnected", t_s=5.0), event_of("resumed", t_s=5.0)):
        progress.process_line(line)
    assert (progress.t_s, progress.broke, progress.paused) == (6.0, "", False), "a time never goes back"
    progress.process_line(event_of("trial_started", t_s=7.0, trial=2, attempt=1))
    assert progress.targets == 0
    progress.process_line(event_of("paused", t_s=8.0))
    progress.process_line(event_of("session_ended", t_s=9.0, status="withdrawn", fingerprint="ab12"))
    ended = (progress.ended, progress.fingerprint, progress.paused, progress.reached_end, progress.durations_s)
    assert ended == ("withdrawn", "ab12", False, False, {0: 7.0 - 3.0, 1: 9.0 - 7.0})
    with pytest.raises(StoreError, match="session_started"):
        progress_of(lines[1:])


def test_a_recording_covers_a_trial_or_each_of_its_intervals() -> None:
    lines = [
        event_of("trial_started", trial=1, attempt=1),
        event_of("trial_ended", trial=1, attempt=1),
        event_of("trial_started", trial=2, attempt=1, arrangement="SC"),
        event_of("interval_started", trial=2, attempt=1, interval=1),
        event_of("interval_started", trial=2, attempt=1, interval=2),
        event_of("trial_started", trial=1, attempt=2),
    ]
    assert recordable(lines) == [(1, 1, None), (2, 1, 1), (2, 1, 2), (1, 2, None)]
    assert attempt_name(3, 1, None) == "trial 3, attempt 1"
    assert attempt_name(3, 2, 4) == "trial 3, attempt 2, interval 4"


def test_results_are_those_of_the_last_attempt_by_number_and_only_of_trials_with_a_design() -> None:
    protocol = study()
    fields = {"block": "viscosity", "code": "V1", "phase": "main"}

    def presented(trial: int, attempt: int, level: float, arrangement: str | None, answer: str | None) -> list[Event]:
        which = {"trial": trial, "attempt": attempt}
        items = [] if answer is None else [{"item": "which", "value": answer}]
        start = event_of("trial_started", **which, **fields, level=level, standard=1.0, arrangement=arrangement)
        return [start, event_of("responses", **which, items=items)]

    lines = presented(7, 1, 0.8, "CS", "first")
    lines += presented(3, 1, 0.2, "SC", "second") + presented(3, 2, 0.4, "SC", "first")
    assert [
        (result.trial, result.code, result.level, result.success, result.correct, result.catch)
        for result in trial_results(protocol, lines)
    ] == [(3, "V1", 0.4, False, False, False), (7, "V1", 0.8, True, True, False)]
    for broken in (presented(3, 1, 0.2, None, "first"), presented(3, 1, 0.2, "SC", None)):
        with pytest.raises(KeyError, match="arrangement and answer"):
            trial_results(protocol, broken)
    with pytest.raises(KeyError):
        trial_results(protocol, lines[1:])
    plain = parse(edited("brackish").encode(), "brackish.toml")
    of_plain = {"trial": 1, "attempt": 1}
    start = event_of("trial_started", **of_plain, block="liquids", code="L1", phase="main")
    assert trial_results(plain, [start, event_of("responses", **of_plain, items=[])]) == ()
