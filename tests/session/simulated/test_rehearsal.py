"""Simulated participants: how they move, what they sense, and how they go through a session."""

import re
import signal
from collections.abc import Iterable
from contextlib import nullcontext
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import SessionError, StoreError
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule, stream
from study_app.protocol.questions import RatingView
from study_app.protocol.simulated import NO_FEATURES, OBSERVER, Comparison, Observer, TrialFeatures
from study_app.protocol.source.files import shipped_file
from study_app.session.pages import QuestionnairePage, TextPage
from study_app.session.simulated import rehearsal
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.observers import RATE_HZ, SensedTrial, answer_choices, exploration, reading_s
from study_app.session.simulated.participant import AdjustingObserver, SimulatedParticipant
from study_app.session.simulated.rehearsal import RehearsedSession, condition_features, finish_session
from study_app.session.simulated.rehearsal_worker import RehearsalOrder, carry_out
from study_app.session.tasks import TankView, TaskView
from study_app.session.transitions.events import Chosen, Submitted
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal import Journal
from study_app.store.journals.journal_events import Responses, SessionResumed
from study_app.store.session_progress.missing_trials import MissingTrial, MissingTrials
from study_app.store.sessions.open_session import SessionStore
from study_app.store.tables.study_files import write_description
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.compiled import needs_servo
from tests.journal_lines import event_of, raw
from tests.session import small
from tests.studies import made_up
from tests.transcripts import Files

HALF_M = (0.05, 0.03, 0.03)


@needs_servo
@pytest.mark.parametrize(
    ("number", "ends_by"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)], ids=["Ctrl+C", "ended"]
)
def test_a_signal_within_a_write_leaves_a_journal_that_can_be_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, ends_by: type[BaseException]
) -> None:
    write, lines, sent = Journal._write, count(1), []

    def interrupted(self: Journal, content: bytes) -> Any:
        written_bytes = write(self, content)
        if next(lines) == 8:
            sent.append(number)
            signal.raise_signal(number)  # Python's handler runs before the journal counts the line
        return written_bytes

    monkeypatch.setattr(Journal, "_write", interrupted)
    with pytest.raises(ends_by):
        rehearsal.rehearse("demo", participants=1, seed=1, results=tmp_path)
    (session,) = StudyFolder(tmp_path).sessions()
    assert sent
    assert journal.read_complete(session.journal).lines[7].n == 8
    rehearsal.resume_rehearsal(session.path)
    responses = [line for line in journal.read(session.journal) if isinstance(line, Responses)]
    assert [line.trial for line in responses] == [1, 2, 3, 4]


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.floats(1, 60))
def test_an_exploration_stays_in_the_tank_moves_without_jumps_and_lasts(seed: int, duration_s: float) -> None:
    t_s, position_m = exploration(stream(seed, "test").random, HALF_M, duration_s)
    assert t_s[-1] >= duration_s - 1 / RATE_HZ
    assert (np.abs(position_m) <= HALF_M).all()
    assert np.linalg.norm(np.diff(position_m, axis=0), axis=1).max() * RATE_HZ < 0.6  # m/s


@pytest.mark.parametrize("drawn", [0.2, 0.5, 0.9])
def test_an_exploration_rests_where_each_figure_ends(drawn: float) -> None:
    _, position_m = exploration(lambda: drawn, HALF_M, 60.0)
    reach_m = 0.7 * np.array(HALF_M)
    rests = position_m[1:][(np.diff(position_m, axis=0) == 0).all(axis=1)] / reach_m
    aside, radius_m = 0.5 * (2 * drawn - 1), min(reach_m[0], reach_m[2]) * (0.6 + 0.4 * drawn)
    strokes, circles, zigzag = [(-1, aside, 0), (aside, 1, 0), (aside, 0, 1)], radius_m / reach_m[0], (1, 0, -0.5)
    ends = np.round([*strokes, (circles, 0, 0), zigzag], 9) + 0.0  # -0.0 is 0.0
    assert {*map(tuple, np.round(rests, 9) + 0.0)} == {*map(tuple, ends)}


def test_senses_tell_drag_from_a_push_and_half_of_each() -> None:
    def share(force_x: list[float]) -> float:
        senses = SensedTrial(scale=10.0)
        force = np.zeros((len(force_x), 3))
        force[:, 0] = force_x
        times = np.arange(len(force_x)) / 1000
        senses.feel(
            np.asarray(
                small.samples(
                    times, np.zeros((len(force_x), 3)), device_force_n=force, velocity_mps=(1.0, 0, 0), scene=1
                )
            )
        )
        return senses.features().push_share

    assert share([-1.0, -2.0]) == 0.0
    assert share([1.0, 2.0]) == pytest.approx(1.0)
    assert share([1.0, -1.0]) == pytest.approx(0.5)


def test_senses_that_were_cleared_contain_only_later_samples() -> None:
    """The force is sent 3 ms after that of the model; until then it is zero."""
    senses = SensedTrial(scale=10.0, period_s=0.001)
    rows = np.arange(400)
    model_n, sent_n = np.zeros((2, 400, 3))
    model_n[:, 0] = 2.0 * np.sin(rows / 20) * (rows > 50)
    sent_n[3:] = model_n[:-3]
    for requested_n, device_n in ((model_n[::-1], 0 * sent_n), (model_n, sent_n)):
        senses.clear()
        senses.feel(
            np.asarray(small.samples(rows / 1000, 0 * sent_n, device_force_n=device_n, force_n=requested_n, scene=1))
        )
    assert senses.features().force_delay_s == pytest.approx(0.003, abs=1e-5)
    assert senses.features().force_mean_n == pytest.approx(np.abs(sent_n).sum() / 400)


def test_senses_measure_force_speed_of_the_hand_roughness_and_delay() -> None:
    senses = SensedTrial(scale=10.0)
    force = [(3.0, 0.0, 4.0), (0.0, 0.0, 0.0)] * 50
    rows = small.samples(
        np.arange(100) / 1000, np.zeros((100, 3)), device_force_n=force, velocity_mps=(0, 2.0, 0), scene=4
    )
    dry = small.samples([1.0], np.zeros((1, 3)), device_force_n=(99.0, 0, 0), scene=0)
    senses.feel(np.asarray(rows))
    senses.feel(np.asarray(dry))
    for age_ms in (100, 110):
        painted_ns = 1_000_000_000
        shown_ns = painted_ns - age_ms * 1_000_000
        senses.see(
            painted_ns, TankView(np.zeros(3), TaskView(lit=0, reached=0, of=1, dwell=0.0, elapsed_s=0.0), shown_ns)
        )
    features = senses.features()
    assert features.force_mean_n == pytest.approx(2.5)
    assert features.force_peak_n == pytest.approx(5)
    assert features.speed_rms_mps == pytest.approx(0.2)
    assert features.roughness_n == pytest.approx(5)
    assert features.delay_s == pytest.approx(0.105)
    for delays, vary, sensed in ((True, "delay_ms", 0.105), (False, "force_loss", 5.0), (False, "", 12.5)):
        assert Comparison(delays, False, OBSERVER, vary).sensed(features) == pytest.approx(sensed)


@pytest.mark.parametrize(
    ("start", "steps"), [(-6, [4, 4, -1, -1, 0]), (7, [-4, -4, 1, 0]), (-1, [4, -1, -1, -1, 0]), (0, [0])]
)
def test_a_setting_begins_with_large_steps_and_ends_after_it_was_crossed_in_small_ones(
    start: int, steps: list[int]
) -> None:
    observer = AdjustingObserver(Comparison(True, False, Observer(delay_jnd_s=0.0), "delay_ms"), lambda: 0.5)
    level, moves = start, list[int]()
    while not moves or moves[-1]:
        moves.append(observer.steps(0.3 + 0.01 * level, 0.3))
        level += moves[-1]
    assert moves == steps


@pytest.mark.parametrize("own", [None, np.int64(-3)])
@pytest.mark.parametrize(("interval", "felt"), [(None, ("now",)), (1, ("now",)), (2, ("first", "now"))])
def test_a_setting_is_adjusted_by_its_observer_or_from_the_sensed_features(
    own: Any, interval: int | None, felt: tuple[str, ...]
) -> None:
    page: Any = SimpleNamespace(trial=7, interval=interval and SimpleNamespace(number=interval))
    calls = list[Any]()
    session: Any = SimpleNamespace(
        _features_of={6: ("other",), 7: ("first",)},
        _answer=lambda question: calls.append(question) or own,
        _comparison_of=lambda trial: SimpleNamespace(sensed=lambda features: f"{trial} {features}"),
        _reference_magnitude=lambda trial, sensed: f"{trial} reference, {sensed}",
    )
    setting: Any = SimpleNamespace(
        senses=SimpleNamespace(features=lambda: "now"), observer=SimpleNamespace(steps=lambda *magnitudes: magnitudes)
    )
    steps: Any = RehearsedSession._next_steps
    simulated = "7 now", "7 reference, 7 now"
    assert steps(session, page, setting) == (simulated if own is None else -3)
    assert [(question.page, question.felt) for question in calls] == [(page, felt)]
    session._answer = None
    assert steps(session, page, setting) == simulated


def test_a_page_is_read_word_by_word_and_some_answers_are_changed_from_a_neighbouring_one() -> None:
    page = TextPage(id="a", kind="break", title="Two words", paragraphs=("three more words", "one"), button="long text")
    assert reading_s(page) == pytest.approx(1.0 + 6 * 0.12)
    item: Any = SimpleNamespace(id="thick", nearby=lambda value: value + 1)
    for draw, changes, values in ((0.0, True, [5, 4]), (0.5, True, [4]), (0.0, False, [4])):
        choices = answer_choices([item], {"thick": 4}, lambda draw=draw: draw, changes_mind=changes)
        assert [(answer.item, answer.value, answer.after_s) for answer in choices] == [
            ("thick", value, pytest.approx(0.8 + draw * (2.6 - 0.8))) for value in values
        ]


class Respondent(SimulatedParticipant):
    """A participant who records the posted events; the page changes during wait number ``leaves_in``."""

    def __init__(self, leaves_in: int | None) -> None:
        study = load("demo")
        super().__init__(study, build_schedule(study, "P001", 1))
        self.events: list[Any] = []
        self._leaves_in = leaves_in
        self._waits_s: list[float] = []

    def _seconds(self) -> float:
        return sum(self._waits_s)

    def _wait(self, seconds: float) -> None:
        self._waits_s.append(seconds)
        if len(self._waits_s) == self._leaves_in:
            self.page = TextPage(id="pause", kind="break", title="Pause", paragraphs=(), button="Go on")

    def _post(self, event: Any) -> None:
        self.events.append(event)

    def _perceived_features(self, trial: int | None) -> TrialFeatures:
        assert trial is None
        return NO_FEATURES

    def _sensed_magnitudes(self, block: Any) -> dict[int, Any]:
        raise AssertionError(block)


@pytest.mark.parametrize(("leaves_in", "answers"), [(1, 0), (2, 1), (3, 2), (4, 3), (None, 3)])
def test_a_page_is_answered_question_by_question_and_confirmed_until_it_changes(
    leaves_in: int | None, answers: int
) -> None:
    labels = ("Not at all", "Somewhat", "Rather", "Very")
    items = tuple(
        RatingView(name, number, f"How {name} was it?", True, labels=labels)
        for number, name in enumerate(("thick", "warm", "slow"), 1)
    )
    page = QuestionnairePage(
        trial=None,
        title="Your answers",
        intro="",
        items=items,
        labels=(),
        cannot_judge=None,
        progress=None,
        form="start",
    )
    respondent = Respondent(leaves_in)
    respondent.page = page
    respondent._fill_in(page)
    first_events, events = respondent.events[:3], respondent.events[3:]
    assert [(event.at_s, event.item) for event in first_events] == [(0, "thick"), (0, "warm"), (0, "slow")]
    choices = [event for event in events if isinstance(event, Chosen)]
    assert [event.item for event in choices] == ["thick", "warm", "slow"][:answers]
    assert all(1 <= event.value <= 4 for event in choices)
    assert events[answers:] == ([Submitted(choices[-1].at_s + 1.0)] if leaves_in is None else [])


def test_each_participant_of_a_rehearsal_has_all_sessions_until_one_ends_early(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests, sessions_run, messages, grouped = list[Any](), list[str](), list[str](), list[Any]()

    def run_to_end(label: str, context: Any, say: Any) -> Any:
        assert context == "opened"
        sessions_run.append(label)
        say(f"{label} ran")
        return SimpleNamespace(lines=label)

    monkeypatch.setattr(rehearsal, "open_session", lambda *words, **named: requests.append((words, named)) or "opened")
    monkeypatch.setattr(rehearsal, "_run_to_end", run_to_end)
    monkeypatch.setattr(rehearsal, "planned_sessions", lambda _folder, _study, _participant: 3)
    early = {"P001, session 2": "aborted"}
    monkeypatch.setattr(rehearsal, "progress_of", lambda lines: SimpleNamespace(ended=early.get(lines, "completed")))
    monkeypatch.setattr(
        rehearsal, "simulated_groups",
        lambda folder, _study, ids, group: grouped.append((folder.path, ids, group)) or {"P001": None, "P002": "old"},
    )  # fmt: skip
    folder = rehearsal.rehearse(
        "demo", participants=2, seed=9, device="falcon-emulated", results=tmp_path / "r", recordings=False,
        group="young", progress=messages.append, observer=OBSERVER,
    )  # fmt: skip
    assert (folder, grouped) == (tmp_path / "r", [(tmp_path / "r", ["P001", "P002"], "young")])
    old = "P002 (group old)"
    assert sessions_run == ["P001", "P001, session 2", old, f"{old}, session 2", f"{old}, session 3"]
    assert messages == [
        "P001 ran\nP001, session 2 ran", f"{old} ran\n{old}, session 2 ran\n{old}, session 3 ran",
    ]  # fmt: skip
    which = [(words[0].study.name, words[2], named.pop("session"), named.pop("group")) for words, named in requests]
    assert which == [
        *(("demo", "P001", session, None) for session in (1, 2)),
        *(("demo", "P002", session, "old") for session in (1, 2, 3)),
    ]
    choices = {"seed": 9, "device": "falcon-emulated", "results": tmp_path / "r", "recordings": False}
    assert all(named == choices | {"observer": OBSERVER} for _, named in requests)


def test_every_frame_that_is_due_is_painted_a_little_later_and_seen() -> None:
    """Frames are painted 2 to 6 ms after each sixtieth of a second; frames before the tank show no sample."""
    painted_frames, seen_frames = list[Any](), list[Any]()
    views = {0: None, 16_666_667: "first", 33_333_334: "second", 50_000_001: "third"}
    view_of = lambda at_ns: views[at_ns] and SimpleNamespace(name=views[at_ns], sample_time_ns=at_ns - 7)  # noqa: E731
    session: Any = SimpleNamespace(
        _next_frame_ns=0, _paint=lambda: 0.5, rig=SimpleNamespace(servo=SimpleNamespace(now_ns=lambda: now_ns)),
        _runner=SimpleNamespace(view=view_of, frame_shown=lambda *times_ns: painted_frames.append(times_ns)),
    )  # fmt: skip
    senses: Any = SimpleNamespace(see=lambda at_ns, view: seen_frames.append((at_ns, view.name)))
    now_ns = 40_000_000
    assert RehearsedSession.look(session, senses).name == "second"  # type: ignore[union-attr]
    assert painted_frames == [(16_666_667 + 4_000_000, 16_666_660), (33_333_334 + 4_000_000, 33_333_327)]
    assert seen_frames == [(20_666_667, "first"), (37_333_334, "second")]
    assert RehearsedSession.look(session, senses) is None, "no other frame is due"
    now_ns = 50_000_001
    assert RehearsedSession.look(session, senses).name == "third"  # type: ignore[union-attr]


@needs_servo
def test_a_device_that_is_lost_ends_the_rehearsal_with_a_word_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    look = RehearsedSession.look

    def pull_the_cable(self: Any, senses: Any) -> TankView | None:
        self.rig.device.unplug()
        return look(self, senses)

    monkeypatch.setattr(RehearsedSession, "look", pull_the_cable)
    with pytest.raises(SessionError, match="stopped responding"):
        rehearsal.rehearse("demo", participants=1, seed=1, results=tmp_path / "demo")


def test_the_folder_of_another_study_is_named_before_an_id_that_is_used_in_it(tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "other")
    folder.session("P001", 1).path.mkdir(parents=True)
    write_description(folder, small.protocol().study)
    with pytest.raises(StoreError, match="contains the study 'small', not 'demo'"):
        rehearsal.rehearse("demo", participants=1, seed=1, results=folder.path)


def test_finished_and_withdrawn_participants_are_not_rehearsed_again(tmp_path: Path) -> None:
    study = rehearse_answers("demo", participants=2, seed=4, results=tmp_path / "demo", features=made_up("demo"))
    withdraw(study, "P002", by="AB", reason="asked for it")
    files, lines = Files(study), list[str]()
    for participant in ("P001", "P002"):
        finish_session("demo", participant, seed=1, device="scripted", results=study, progress=lines.append)
    assert (list(files.files()), lines) == ([], [])


def test_a_session_that_was_killed_between_its_last_line_and_its_proofs_is_rebuilt_once(tmp_path: Path) -> None:
    results = rehearse_answers("demo", participants=2, seed=4, results=tmp_path / "demo", features=made_up("demo"))
    study = StudyFolder(results)
    session = study.session("P001", 1)
    tables = {path: path.read_bytes() for path in session.path.glob("*_data.csv")}
    sums, own, other = session.checksums.read_text("utf-8"), *study.fingerprints.read_text("utf-8").splitlines(True)
    assert (len(tables), own.endswith("  data/sub-P001/ses-01\n")) == (2, True)
    lines = list[str]()
    for progress in (None, lines.append):
        for path in (*tables, session.checksums):
            path.unlink()
        study.fingerprints.write_text(other, encoding="utf-8", newline="\n")
        finish_session("demo", "P001", seed=1, device="scripted", results=results, progress=progress)
        assert {path: path.read_bytes() for path in tables} == tables
        assert {*sums.splitlines()} <= {*session.checksums.read_text("utf-8").splitlines()}
    assert verify_study(results).errors == ()
    finish_session("demo", "P001", seed=1, device="scripted", results=results, progress=lines.append)
    assert lines == ["P001: rebuilt the tables and checksums of the finished session"]


def test_a_session_is_begun_if_it_never_was_and_resumed_after_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = rehearse_answers("demo", participants=2, seed=4, results=tmp_path / "demo", features=made_up("demo"))
    study = StudyFolder(results)
    study.fingerprints.unlink()
    interrupted, never_begun = (study.session(participant, 1) for participant in ("P001", "P002"))
    for session, line_count in ((interrupted, -1), (never_begun, 0)):
        journal_lines = session.journal.read_bytes().splitlines(keepends=True)
        session.journal.write_bytes(b"".join(journal_lines[:line_count]))
        for path in (session.checksums, *session.path.glob("*_data.csv")):
            path.unlink()
    never_begun.receipt.unlink()  # it records the end
    source, calls = shipped_file("demo"), list[Any]()
    monkeypatch.setattr(rehearsal, "open_session", lambda *args, **named: ("begun", *args, named))
    monkeypatch.setattr(rehearsal, "reopen_session", lambda *args, **named: ("resumed", *args, named))
    monkeypatch.setattr(rehearsal, "_run_to_end", lambda *args: calls.append(args))
    for participant in ("P001", "P002", "P003"):
        finish_session(source, participant, seed=5, device="mouse", results=results, progress=print)
    named = {"seed": 5, "device": "mouse", "results": results}
    assert calls == [
        ("P001", ("resumed", interrupted.path, {"protocol": source}), print),
        *(
            (participant, ("begun", load("demo"), source.read_bytes(), participant, named), print)
            for participant in ("P002", "P003")
        ),
    ]


def test_a_signal_that_was_ignored_before_a_rehearsal_stays_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with rehearsal._HeldSignals():
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGINT) not in {signal.SIG_IGN, signal.default_int_handler}
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_rehearsed_session_is_summarised_with_answers_time_and_missing_trials() -> None:
    """One question of two forms with 2 and 3 questions was skipped."""
    forms = {"load": (0.25, 0.5), "end": (None, 0.75, 1.0)}
    lines = [
        event_of("session_started", t_s=0.0),
        *(
            event_of("form_answered", form=form, items=[{"item": f"q{s}", "first_s": s} for s in firsts])
            for form, firsts in forms.items()
        ),
    ]
    missing = MissingTrials(
        missing=(MissingTrial(trial=3, block="b", code="L1", broken=()),), asked=40, limits={"missing_percent": 5.0}
    )
    messages_of_run, messages = list[str](), list[str]()
    session: Any = SimpleNamespace(run=lambda: messages_of_run.append("run"))
    for lost in (missing, MissingTrials(asked=40, limits={})):
        clock = SimpleNamespace(seconds=lambda: 450.0)
        store: Any = SimpleNamespace(clock=clock, missing_trials=lost, fingerprint="abcd-efgh", lines=lines)
        rehearsal._run_to_end("P007", nullcontext((session, store)), messages.append)
    rehearsal._run_to_end("P008", nullcontext((session, store)), None)
    assert messages_of_run == ["run"] * 3
    assert session.signals is not None
    sentence = r"P007: 4 responses, 7\.5 min of session time simulated in 0\.\d s, fingerprint abcd-efgh"
    assert re.fullmatch(f"{sentence}; {re.escape(str(missing))}", messages[0])
    assert re.fullmatch(sentence, messages[1])
    assert len(messages) == 2
    full, disk_gone = "No space left on device", "Input/output error"
    store.lines = [
        *lines,
        *(event_of("recording_lost", trial=2, attempt=1, reason=why) for why in (full, disk_gone, full)),
    ]
    rehearsal._run_to_end("P009", nullcontext((session, store)), messages.append)
    assert messages[2].endswith(f"fingerprint abcd-efgh; 3 recordings could not be stored: {full}, {disk_gone}")


@pytest.mark.slow
@needs_servo
def test_a_rehearsal_worker_reports_only_the_compilation_before_its_start(monkeypatch: Any) -> None:
    messages: list[float | str | Path] = []
    rehearsed: list[tuple[str, int, int]] = []

    def rehearse(study: str, *, participants: int, seed: int, **_given: Any) -> Path:
        rehearsed.append((study, participants, seed))
        compiled(2)
        return Path("results")

    compiled, later = numba.njit(lambda x: x + 1), numba.njit(lambda x: x + 2)
    monkeypatch.setattr(rehearsal, "rehearse", rehearse)
    order = RehearsalOrder("demo", participants=3, seed=7, results=Path("results"))
    assert carry_out(order, messages.append, lambda: False) == Path("results")
    assert rehearsed == [("demo", 3, 7)]
    shares = tuple(messages)
    later(2)
    assert shares
    assert all(isinstance(share, float) and 0 < share < 1 for share in shares)
    assert tuple(messages) == shares


@needs_servo
def test_a_servo_that_is_ended_from_outside_ends_the_rehearsal(monkeypatch: Any) -> None:
    turns, advance = count(), Servo.advance

    def ended(self: Servo, ticks: int) -> int:
        if next(turns) == 50:
            self.loop.control[0].run = 0  # as a request to terminate does
        return advance(self, ticks)

    monkeypatch.setattr(Servo, "advance", ended)
    with pytest.raises(SessionError, match="another program stopped"):
        condition_features(small.protocol(), seed=1, people=1)


def confirmed_answers(lines: Iterable[Any]) -> dict[tuple[int, str], int]:
    """Return the answers by trial and item, those of the last attempt."""
    return {
        (line["trial"], item["item"]): item["value"]
        for line in lines
        if line["event"] == "responses"
        for item in line["items"]
    }


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize(("seed", "page"), [(8, 1), pytest.param(5, 2, marks=pytest.mark.nightly), (9, 4)])
def test_a_rehearsal_that_was_interrupted_and_resumed_answers_like_one_that_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int, page: int
) -> None:
    """With these seeds, different noise of the hand in the repeated trial would change the answers."""
    whole, parted = StudyFolder(tmp_path / "whole"), StudyFolder(tmp_path / "parted")
    rehearsal.rehearse("demo", participants=1, seed=seed, results=whole.path, recordings=False)
    append, pages = SessionStore.append, count(1)

    def interrupted(self: SessionStore, event: Any, **about: Any) -> None:
        if isinstance(event, Responses) and next(pages) == page:
            raise KeyboardInterrupt
        append(self, event, **about)

    with monkeypatch.context() as patched:
        patched.setattr(SessionStore, "append", interrupted)
        with pytest.raises(KeyboardInterrupt):
            rehearsal.rehearse("demo", participants=1, seed=seed, results=parted.path, recordings=False)
    rehearsal.resume_rehearsal(parted.session("P001", 1).path)
    lines = [journal.read(folder.session("P001", 1).journal) for folder in (whole, parted)]
    answers, others = (confirmed_answers(raw(journal_lines)) for journal_lines in lines)
    assert answers == others
    (resumed,) = (line for line in lines[1] if isinstance(line, SessionResumed))
    assert resumed.gap_s == 0.0, "its simulated clock is ahead of the wall clock and must not go back"
