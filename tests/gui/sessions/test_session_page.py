"""The page of a session: reading its folder and showing it."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QWidget

from study_app.gui.sessions.session_facts import sessions
from study_app.gui.sessions.session_page import (
    SessionPage,
    TrialRecord,
    _limits_sentence,
    _within_limits_sentence,
    read_record,
)
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import load
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.journals.journal_events import UNDELIVERED
from study_app.store.session_progress.missing_trials import MISSING_PERCENT, MissingTrial, MissingTrials
from study_app.store.unblinding import unblind
from tests.golden import compare, each_once, what_comes
from tests.golden_values import changed
from tests.gui.transcript import widget_lines
from tests.journal_lines import event_of
from tests.studies import begun

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A rehearsed session of the demo with its recordings."""
    folder = tmp_path_factory.mktemp("whole") / "demo"
    rehearse("demo", participants=1, seed=1, results=folder)
    return folder


@pytest.fixture
def study(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "results" / "demo"))


def begin_demo(study):
    """Begin a session of the demo."""
    return begun(study, "P007", operator="AK")


def trial(store, number, **measured):
    which = {"block": "feeling", "phase": "main", "part": 1, "of": 2}
    store.append(journal_events.TrialStarted(trial=number, attempt=1, index=number, code=f"L{number}", **which))
    store.append(event_of("trial_ended", trial=number, attempt=1, outcome="complete", **measured))


def unconfirmed(study):
    """Hold a session in which the choices of the second trial were not confirmed."""
    with begin_demo(study) as store:
        for number in (1, 2):
            trial(store, number)
            for value in (3, 5):
                store.append(journal_events.Choice(trial=number, item="feels_liquid", value=value))
            if number == 1:
                answer = {"item": "feels_liquid", "number": 1, "value": 5, "changes": 1}
                times = {"onset_s": 0.0, "first_s": 0.1, "last_s": 0.2}
                store.append(event_of("responses", trial=1, attempt=1, items=[answer | times]))
        store.finish("aborted")
    return StudyFolder(study).session("P007", 1).path


def measured(study):
    """Hold a session with a valid trial, a trial that exceeded two limits, and a note."""
    with begin_demo(study) as store:
        trial(store, 1, worst_gap_ms=3.0, lateness_p99_ms=0.2, first_frame_gap_ms=12.0)
        trial(store, 2, worst_gap_ms=41.26, lateness_p99_ms=2.5, first_frame_gap_ms=12.0)
        store.append(journal_events.RecordingLost(trial=1, attempt=1, reason="its thread ended"))
        store.append(journal_events.Note(kind="note", text="phone rang"))
        store.finish("completed")
    return StudyFolder(study).session("P007", 1).path


CELLS = {
    unconfirmed: [
        ["1", "Part 1, L1", "complete", "Open", "1", ""],
        ["2", "Part 1, L2", "complete", "Open", "0 + 1?", ""],
    ],
    measured: [
        ["1", "Part 1, L1", "complete", "Valid", "0", "recording lost"],
        ["2", "Part 1, L2", "complete", "Out of limits", "0", "phone rang"],
    ],
}


def page_of(qtbot, study, participant=None):
    window = QWidget()
    qtbot.addWidget(window)
    facts = next(session for session in sessions(study.parent, {}) if participant in (None, session.participant))
    files_opened = []
    page = SessionPage(window, LIGHT, facts, files_opened.append)
    page.opened, page.window_below = files_opened, window
    page.show()
    qtbot.addWidget(page)
    qtbot.waitUntil(lambda: page.record is not None)
    return page


def test_a_page_describes_each_trial_and_explains_an_unreadable_session(qtbot, tmp_path, pytestconfig):
    lines, before = [], []
    for hold in (unconfirmed, measured):
        study = tmp_path / hold.__name__ / "demo"
        folder = hold(study)
        page = page_of(qtbot, study)
        assert [[page.model.index(row, column).data() for column in range(6)] for row in range(2)] == CELLS[hold]
        for row in range(page.model.rowCount()):
            page.trials.selectRow(row)
            # Qt before 6.12 tells the name of a table as its value, too.
            after = [line.replace(str(study), "STUDY").removesuffix(" |  | =") for line in widget_lines(page)]
            lines += [f"== {hold.__name__}, trial {row + 1}", *changed(before, after)]
            before = after
    page.folder.click()
    assert page.opened == [page.facts.folder]
    (folder / "journal.jsonl").unlink()
    page.read_folder()
    qtbot.waitUntil(lambda: "journal" in page.limits.text())
    lines += ["== without its journal", page.limits.text().replace(str(study), "STUDY")]
    compare(Path(__file__).parent / "golden" / "page.txt", each_once(what_comes(lines)), pytestconfig)


def test_no_page_names_a_condition_of_a_sealed_study(study):
    record = read_record(next(iter(StudyFolder(study).sessions())).path)
    assert record.limits == "All 4 measured trials met the study's limits."
    unjudged = [_within_limits_sentence((), sealed=sealed, verdict=None) for sealed in (True, False)]
    assert [sentence.endswith("will be checked after unblinding.") for sentence in unjudged] == [True, False]
    text = repr(record)
    protocol = load("demo")
    assert [name for name in protocol.conditions if re.search(rf"\b{name}\b", text)] == []


def test_unblinding_keeps_the_validity_of_a_rehearsed_session_and_names_its_conditions(study):
    (session,) = StudyFolder(study).sessions()
    before = read_record(session.path)
    unblind(study, "AK", "end of the study")
    after = read_record(session.path)

    assert (before.facts.validity, after.facts.validity) == ("valid", "valid")
    codes = {code: name for block in read_key(study).codes.values() for code, name in block.items()}
    assert [trial.words for trial in after.trials] == [
        f"{trial.words}: {codes[trial.words.rpartition(' ')[2]]}" for trial in before.trials
    ]


@pytest.mark.parametrize(
    ("undelivered", "sentence"),
    [
        (0, ""),
        (1, "1 presentation exceeded a limit and was not followed by a question. "),
        (2, "2 presentations exceeded a limit and were not followed by a question. "),
    ],
)
def test_presentations_beyond_a_limit_are_counted(undelivered: int, sentence: str) -> None:
    trial = TrialRecord(
        number=1, attempt=1, words="", outcome="complete", valid=True, broken=(), answers=1, unconfirmed=(), notes="",
        lost="", excluded=None,
    )  # fmt: skip
    trials = [trial, *[replace(trial, outcome=UNDELIVERED)] * undelivered]
    text = _limits_sentence(trials, MissingTrials(limits={}), sealed=False)
    assert text == f"{sentence}The one trial so far met the study's limits."


@pytest.mark.parametrize(
    ("permitted", "excluded", "more"),
    [
        ({}, False, ""),
        ({MISSING_PERCENT: 25.0}, False, "The study allows up to 25 % of the trials to be missing. "),
        (
            {MISSING_PERCENT: 24.0},
            False,
            "The study allows up to 24 % of the trials to be missing. The session is incomplete. "
            "It was included manually. ",
        ),
        (
            {MISSING_PERCENT: 24.0},
            True,
            "The study allows up to 24 % of the trials to be missing. The session is incomplete. "
            "Include it again in Results to analyse it. ",
        ),
    ],
)
def test_missing_trials_are_counted_and_compared_with_those_permitted(permitted, excluded, more):
    lost = tuple(MissingTrial(trial=at, block="pairs", code="A", broken=("force_limit_n",)) for at in (3, 5))
    missing = MissingTrials(missing=lost, asked=8, limits={"force_limit_n": 6.5, **permitted})
    assert _limits_sentence([], missing, excluded=excluded, sealed=False) == (
        "2 of 8 trials were not delivered: the force limit was reached (limit 6.5 N). These trials were not answered. "
        f"{more}No trials have been measured yet."
    )


def test_a_sealed_session_beyond_a_sealed_limit_is_out_of_limits_before_unblinding_already(tmp_path):
    study = tmp_path / "results" / "demo"
    with begin_demo(study) as store:
        trial(store, 1, withheld_share=0.02)
        trial(store, 2, withheld_share=0.2, loop_delay_ticks=1, device_delay_ticks=3)
        store.finish("completed")
    folder = StudyFolder(study).session("P007", 1).path
    before = read_record(folder)
    unblind(study, "AK", "end of the study")
    after = read_record(folder)

    assert (before.facts.validity, after.facts.validity) == ("invalid", "invalid")
    assert [trial.valid for trial in before.trials] == [None, None]  # which trial it was would tell the thick liquid
    assert before.limits.endswith("Unblinding will show which trial.")
    assert [trial.valid for trial in after.trials] == [True, False]
    assert after.limits.startswith("Out of limits: 1 of 2 measured trials")
    assert [trial.notes for trial in before.trials] == ["", ""]
    late = "the device answered after 3 ticks, but the servo assumes 1 tick"
    assert [trial.notes for trial in after.trials] == ["", late]
