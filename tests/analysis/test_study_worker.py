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


def answers_to(order: Order, stop: Callable[[], bool] = lambda: False) -> list[Answer]:
    answers: list[Answer] = []
    answers.append(carry_out(order, answers.append, stop))
    return answers


def of_kind(kind: type, answers: list[Answer]) -> list:
    return [answer for answer in answers if isinstance(answer, kind)]


def test_studies_are_found_among_other_files(study: Path) -> None:
    results = study.parent
    (results / "notes").mkdir()
    (results / "readme.txt").write_text("x", encoding="utf-8", newline="\n")
    (results / "empty" / "data").mkdir(parents=True)
    (studies,) = of_kind(StudiesFound, answers_to(FindStudies(results)))
    assert [(study.folder.name, study.simulated, study.pilot) for study in studies.studies] == [
        ("demo", True, False),
        ("empty", False, False),
    ]
    assert studies.studies[0].newest_s > studies.studies[1].newest_s == 0.0


def test_a_sealed_study_shows_only_codes_and_is_not_tested(study: Path) -> None:
    answers = answers_to(ReadStudy(study))
    (sessions,), (found_study,) = of_kind(SessionsFound, answers), of_kind(StudyFound, answers)
    assert [row["participant"] for row in sessions.rows] == ["P001", "P002", "P003"]
    assert (sessions.reveal, found_study.revealed, found_study.n) == (None, False, 3)
    figures = of_kind(FigureDrawn, answers)
    assert [figure.name for figure in figures] == ["liquids", "delays"]
    assert not [progress for progress in of_kind(Progress, answers) if progress.what.startswith("testing")]
    content = b" ".join([*(figure.svg for figure in figures), repr((sessions, found_study)).encode()]).lower()
    assert b">l1<" in content
    assert b">d1<" in content
    for name in (*load("demo").conditions, *load("demo").liquids):
        assert not re.search(rf"[>', ]{name}[<', ]".encode(), content), name


def test_an_opened_study_shows_names_and_redraws_figures_with_test_results(study: Path) -> None:
    opening = of_kind(Progress, answers_to(OpenKey(study, "AK", "done")))
    assert [progress.what for progress in opening[:3]] == [f"opening session {number} of 3" for number in (1, 2, 3)]
    assert [(progress.share, progress.stops) for progress in opening] == [(number / 4, False) for number in range(4)]
    answers = answers_to(ReadStudy(study))
    (sessions,), (found_study,) = of_kind(SessionsFound, answers), of_kind(StudyFound, answers)
    assert sessions.reveal is not None
    assert (sessions.reveal["by"], found_study.revealed) == ("AK", True)
    names = [figure.name for figure in of_kind(FigureDrawn, answers)]
    assert names[:2] == ["liquids", "delays"]
    assert sorted(set(names[2:])) == sorted({"liquids", "delays", *names[2:]})
    shares = [progress.share for progress in of_kind(Progress, answers) if progress.what.startswith("testing")]
    assert shares == sorted(shares)
    assert shares
    assert next(figure.title for figure in of_kind(FigureDrawn, answers)) == "Agreement for each liquid"
    (first,) = of_kind(FirstPage, answers)
    figures_by_name = {figure.name: figure for figure in of_kind(FigureDrawn, answers)}
    first_figures = [figures_by_name[name] for name in first.names]
    assert [answer.question.partition(": ")[2] or answer.title for answer in first_figures] == [
        "Which liquids were distinguished?",
        "At what delay do participants begin to notice a difference?",
        "Up to what delay do answers remain practically unchanged?",
    ]
    assert all(answer.answer or answer.caption for answer in first_figures)
    assert first_figures[0].numbers.startswith("participant\t")


def test_the_first_page_is_shown_if_the_presented_liquids_cannot_be_named(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_study: object) -> None:
        raise LookupError("no such liquid")

    answers_to(OpenKey(study, "AK", "done"))
    monkeypatch.setattr("study_app.analysis.report.first_page.presented_in", fail)
    (first,) = of_kind(FirstPage, answers_to(ReadStudy(study)))
    assert len(first.names) == 3


def test_trials_can_be_named_for_leaving_out_and_then_do_not_count(study: Path) -> None:
    (study_answer,) = of_kind(StudyFound, answers_to(ReadStudy(study)))
    number, words = study_answer.trials["P001", 1][0]
    assert words.split(", ")[-1][:1] in "LD"
    answers_to(LeaveOut(folder=study, participant="P001", session=1, trial=number, by="AK", reason="phone rang"))
    answers_to(LeaveOut(folder=study, participant="P002", session=1, trial=None, by="AK", reason="asleep"))
    answers = answers_to(ReadStudy(study))
    assert [exclusion.what for exclusion in of_kind(SessionsFound, answers)[0].exclusions] == [
        ("P001", 1, number),
        ("P002", 1, None),
    ]
    assert of_kind(StudyFound, answers)[0].n == 2


def test_a_refusal_of_the_store_leaves_the_study_unchanged(study: Path) -> None:
    with pytest.raises(StoreError, match="does not contain session 1 of participant P009"):
        answers_to(LeaveOut(folder=study, participant="P009", session=1, trial=None, by="AK", reason="x"))
    with pytest.raises(StoreError, match="reason"):
        answers_to(OpenKey(study, "AK", " "))
    assert exclusions(study) == ()
    assert not StudyFolder(study).reveals.exists()


def test_sessions_are_listed_even_if_the_study_cannot_be_read(study: Path) -> None:
    table = StudyFolder(study).session("P002", 1).table("demo", "responses")
    table.write_bytes(table.read_bytes()[:-120])
    answers: list[Answer] = []
    with pytest.raises(AnalysisError, match="P002"):
        carry_out(ReadStudy(study), answers.append, lambda: False)
    assert len(of_kind(SessionsFound, answers)[0].rows) == 3


def test_tables_are_those_of_the_command(study: Path, tmp_path: Path) -> None:
    (answer,) = of_kind(Done, answers_to(WriteTables(study, tmp_path / "window", ("wide",))))
    by_command = export(study, tmp_path / "command", extras=["wide"])
    assert [path.name for path in answer.files] == [path.name for path in by_command]
    assert [path.read_bytes() for path in answer.files] == [path.read_bytes() for path in by_command]


@pytest.mark.parametrize(("kind", "after"), [(WriteTables, 1), (WriteTables, 2), (WriteReport, 1), (WriteReport, 3)])
def test_a_stopped_order_writes_no_file(study: Path, tmp_path: Path, kind: type, after: int) -> None:
    stop_calls = iter(range(100))
    with pytest.raises(Stopped):
        answers_to(kind(study, tmp_path / "to"), lambda: next(stop_calls) >= after - 1)
    assert not (tmp_path / "to").exists()


def last_of(worker: AnalysisClient, number: int) -> Done | Refused:
    end_s = time.perf_counter() + SOON_S
    while time.perf_counter() < end_s:
        for of_number, answer in worker.answers():
            if of_number == number and isinstance(answer, (Done, Refused)):
                return answer
        assert worker.works
    raise AssertionError("no answer")


def test_the_process_answers_stops_and_ends_when_closed(study: Path, tmp_path: Path) -> None:
    worker = start_analysis_worker()
    try:
        assert last_of(worker, worker.order(FindStudies(study.parent))) == Done()
        last_answer = last_of(worker, worker.order(ReadStudy(tmp_path / "none")))
        assert isinstance(last_answer, Refused)
        assert not last_answer.stopped
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
    (studies,) = of_kind(StudiesFound, answers_to(FindStudies(pooled.parent)))
    assert [(study.folder, study.simulated) for study in studies.studies] == [(pooled, True)]
    answers = answers_to(ReadStudy(pooled))
    (sessions_found,) = of_kind(SessionsFound, answers)
    assert [row["participant"] for row in sessions_found.rows] == ["A-P001", "A-P002", "A-P003", "B-P001", "B-P002"]
    assert sessions_found.reveal is None
    facts = session_facts(pooled, sessions_found.rows, (), {})
    assert [facts_of_site.folder.is_dir() for facts_of_site in facts] == [True] * 5
    answers_to(LeaveOut(folder=pooled, participant="B-P002", session=1, trial=None, by="AK", reason="coughed"))
    assert [row.participant for row in exclusions(pooled / "sites/B")] == ["P002"]
    assert answers_to(OpenKey(pooled, "AK", "closed"))[-1] == Done()
    again = answers_to(ReadStudy(pooled))
    (sessions_found,) = of_kind(SessionsFound, again)
    assert sessions_found.reveal is not None
    assert [row.participant for row in sessions_found.exclusions] == ["B-P002"]
    (study_found,) = of_kind(StudyFound, again)
    assert (study_found.revealed, study_found.n) == (True, 4)
    answers_to(TakeBack(folder=pooled, participant="B-P002", session=1, trial=None, by="AK", reason="a mistake"))
    assert exclusions(pooled / "sites/B") == ()
