"""What a window asks of a study is told piece by piece, by a process that stops when it is asked to."""

import multiprocessing
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.analysis.export_study import export
from study_app.analysis.study_worker import carry_out
from study_app.analysis.worker_messages import (
    AnalysisClient,
    Answer,
    Done,
    FigureDrawn,
    FindStudies,
    FirstPage,
    LeaveOut,
    OpenKey,
    Order,
    Progress,
    ReadStudy,
    SessionsFound,
    StudiesFound,
    StudyFound,
    TakeBack,
    WriteReport,
    WriteTables,
    start_analysis_worker,
)
from study_app.errors import AnalysisError, StoreError
from study_app.gui.sessions.session_facts import session_facts
from study_app.protocol.load import load
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclusions
from study_app.store.files.folders import StudyFolder
from study_app.store.sites.merge import merge_sites
from study_app.workers.server import Refused, Stopped
from tests.studies import made_up, rehearsed

pytestmark = pytest.mark.slow

SOON_S = 120.0


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearsed(tmp_path_factory.mktemp("results"))


@pytest.fixture
def study(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "results" / "demo"))


def told(order: Order, stop: Callable[[], bool] = lambda: False) -> list[Answer]:
    answers: list[Answer] = []
    answers.append(carry_out(order, answers.append, stop))
    return answers


def of_kind(kind: type, answers: list[Answer]) -> list:
    return [answer for answer in answers if isinstance(answer, kind)]


def test_studies_are_found_whatever_else_lies_there(study: Path) -> None:
    results = study.parent
    (results / "notes").mkdir()
    (results / "readme.txt").write_text("x", encoding="utf-8", newline="\n")
    (results / "empty" / "data").mkdir(parents=True)
    (found,) = of_kind(StudiesFound, told(FindStudies(results)))
    assert [(one.folder.name, one.simulated, one.pilot) for one in found.studies] == [
        ("demo", True, False),
        ("empty", False, False),
    ]
    assert found.studies[0].newest_s > found.studies[1].newest_s == 0.0


def test_while_sealed_nothing_is_told_but_codes_and_nothing_is_tested(study: Path) -> None:
    answers = told(ReadStudy(study))
    (sessions,), (found,) = of_kind(SessionsFound, answers), of_kind(StudyFound, answers)
    assert [row["participant"] for row in sessions.rows] == ["P001", "P002", "P003"]
    assert (sessions.reveal, found.revealed, found.n) == (None, False, 3)
    figures = of_kind(FigureDrawn, answers)
    assert [figure.name for figure in figures] == ["liquids", "delays"]
    assert not [one for one in of_kind(Progress, answers) if one.what.startswith("testing")]
    said = b" ".join([*(figure.svg for figure in figures), repr((sessions, found)).encode()]).lower()
    assert b">l1<" in said
    assert b">d1<" in said
    for name in (*load("demo").conditions, *load("demo").liquids):
        assert not re.search(rf"[>', ]{name}[<', ]".encode(), said), name


def test_once_open_names_are_told_and_what_tests_add_is_drawn_again(study: Path) -> None:
    opening = of_kind(Progress, told(OpenKey(study, "AK", "done")))
    assert [one.what for one in opening[:3]] == [f"opening session {number} of 3" for number in (1, 2, 3)]
    assert [(one.share, one.stops) for one in opening] == [(number / 4, False) for number in range(4)]
    answers = told(ReadStudy(study))
    (sessions,), (found,) = of_kind(SessionsFound, answers), of_kind(StudyFound, answers)
    assert sessions.reveal is not None
    assert (sessions.reveal["by"], found.revealed) == ("AK", True)
    names = [figure.name for figure in of_kind(FigureDrawn, answers)]
    assert names[:2] == ["liquids", "delays"]
    assert sorted(set(names[2:])) == sorted({"liquids", "delays", *names[2:]})
    shares = [one.share for one in of_kind(Progress, answers) if one.what.startswith("testing")]
    assert shares == sorted(shares)
    assert shares
    assert next(one.title for one in of_kind(FigureDrawn, answers)) == "Agreement for each liquid"
    (first,) = of_kind(FirstPage, answers)
    shown = {one.name: one for one in of_kind(FigureDrawn, answers)}
    asked = [shown[name] for name in first.names]
    assert [one.question.partition(": ")[2] or one.title for one in asked] == [
        "Which liquids were distinguished?",
        "At what delay do participants begin to notice a difference?",
        "Up to what delay do answers remain practically unchanged?",
    ]
    assert all(one.answer or one.caption for one in asked)
    assert asked[0].numbers.startswith("participant\t")


def test_the_first_page_is_shown_if_the_presented_liquids_cannot_be_named(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_study: object) -> None:
        raise LookupError("no such liquid")

    told(OpenKey(study, "AK", "done"))
    monkeypatch.setattr("study_app.analysis.report.first_page.presented_in", fail)
    (first,) = of_kind(FirstPage, told(ReadStudy(study)))
    assert len(first.names) == 3


def test_trials_can_be_named_for_leaving_out_and_then_do_not_count(study: Path) -> None:
    (found,) = of_kind(StudyFound, told(ReadStudy(study)))
    number, words = found.trials["P001", 1][0]
    assert words.split(", ")[-1][:1] in "LD"
    told(LeaveOut(folder=study, participant="P001", session=1, trial=number, by="AK", reason="phone rang"))
    told(LeaveOut(folder=study, participant="P002", session=1, trial=None, by="AK", reason="asleep"))
    answers = told(ReadStudy(study))
    assert [one.what for one in of_kind(SessionsFound, answers)[0].exclusions] == [
        ("P001", 1, number),
        ("P002", 1, None),
    ]
    assert of_kind(StudyFound, answers)[0].n == 2


def test_what_the_store_refuses_changes_nothing(study: Path) -> None:
    with pytest.raises(StoreError, match="does not contain session 1 of participant P009"):
        told(LeaveOut(folder=study, participant="P009", session=1, trial=None, by="AK", reason="x"))
    with pytest.raises(StoreError, match="reason"):
        told(OpenKey(study, "AK", " "))
    assert exclusions(study) == ()
    assert not StudyFolder(study).reveals.exists()


def test_sessions_are_told_even_where_the_study_cannot_be_read(study: Path) -> None:
    table = StudyFolder(study).session("P002", 1).table("demo", "responses")
    table.write_bytes(table.read_bytes()[:-120])
    answers: list[Answer] = []
    with pytest.raises(AnalysisError, match="P002"):
        carry_out(ReadStudy(study), answers.append, lambda: False)
    assert len(of_kind(SessionsFound, answers)[0].rows) == 3


def test_tables_are_those_of_the_command(study: Path, tmp_path: Path) -> None:
    (done,) = of_kind(Done, told(WriteTables(study, tmp_path / "window", ("wide",))))
    by_command = export(study, tmp_path / "command", extras=["wide"])
    assert [path.name for path in done.files] == [path.name for path in by_command]
    assert [path.read_bytes() for path in done.files] == [path.read_bytes() for path in by_command]


@pytest.mark.parametrize(("kind", "after"), [(WriteTables, 1), (WriteTables, 2), (WriteReport, 1), (WriteReport, 3)])
def test_what_is_stopped_writes_nothing(study: Path, tmp_path: Path, kind: type, after: int) -> None:
    asked = iter(range(100))
    with pytest.raises(Stopped):
        told(kind(study, tmp_path / "to"), lambda: next(asked) >= after - 1)
    assert not (tmp_path / "to").exists()


def last_of(worker: AnalysisClient, number: int) -> Done | Refused:
    end_s = time.perf_counter() + SOON_S
    while time.perf_counter() < end_s:
        for of_number, answer in worker.answers():
            if of_number == number and isinstance(answer, (Done, Refused)):
                return answer
        assert worker.works
    raise AssertionError("no answer")


def test_the_process_answers_stops_and_is_gone_when_closed(study: Path, tmp_path: Path) -> None:
    worker = start_analysis_worker()
    try:
        assert last_of(worker, worker.order(FindStudies(study.parent))) == Done()
        refused = last_of(worker, worker.order(ReadStudy(tmp_path / "none")))
        assert isinstance(refused, Refused)
        assert not refused.stopped
        given_up = worker.order(WriteReport(study, tmp_path / "to"))
        worker.stop()
        stopped = last_of(worker, given_up)
        assert isinstance(stopped, Refused)
        assert stopped.stopped
        assert not (tmp_path / "to").exists()
        assert (
            last_of(
                worker,
                worker.order(
                    LeaveOut(folder=study, participant="P001", session=1, trial=None, by="AK", reason="asleep")
                ),
            )
            == Done()
        )
    finally:
        worker.close()
    end_s = time.perf_counter() + SOON_S
    while any(child.name == "analysis" for child in multiprocessing.active_children()):
        assert time.perf_counter() < end_s


def test_a_merged_study_is_found_read_decided_on_and_opened(whole: Path, tmp_path: Path) -> None:
    other = rehearse_answers("demo", participants=2, seed=2, results=tmp_path / "labs/demo", features=made_up("demo"))
    pooled = tmp_path / "results" / "pooled"
    merge_sites({"A": whole, "B": other}, pooled)
    (found,) = of_kind(StudiesFound, told(FindStudies(pooled.parent)))
    assert [(one.folder, one.simulated) for one in found.studies] == [(pooled, True)]
    answers = told(ReadStudy(pooled))
    (listed,) = of_kind(SessionsFound, answers)
    assert [row["participant"] for row in listed.rows] == ["A-P001", "A-P002", "A-P003", "B-P001", "B-P002"]
    assert listed.reveal is None
    facts = session_facts(pooled, listed.rows, (), {})
    assert [one.folder.is_dir() for one in facts] == [True] * 5
    told(LeaveOut(folder=pooled, participant="B-P002", session=1, trial=None, by="AK", reason="coughed"))
    assert [row.participant for row in exclusions(pooled / "sites/B")] == ["P002"]
    assert told(OpenKey(pooled, "AK", "closed"))[-1] == Done()
    again = told(ReadStudy(pooled))
    (listed,) = of_kind(SessionsFound, again)
    assert listed.reveal is not None
    assert [row.participant for row in listed.exclusions] == ["B-P002"]
    (study_found,) = of_kind(StudyFound, again)
    assert (study_found.revealed, study_found.n) == (True, 4)
    told(TakeBack(folder=pooled, participant="B-P002", session=1, trial=None, by="AK", reason="a mistake"))
    assert exclusions(pooled / "sites/B") == ()
