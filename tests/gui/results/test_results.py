"""Results with their real place: rehearsed studies read, unblinded, left out of and reported."""

import multiprocessing
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from study_app.analysis.study_worker import carry_out
from study_app.analysis.worker_messages import Answer, Order, start_analysis_worker
from study_app.errors import StudyError
from study_app.gui.home.main_window import MainWindow
from study_app.gui.results.view import ResultsPlace
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.main_view import Place
from study_app.store.blinded.blinding import reveals
from study_app.store.exclusions import exclusions
from study_app.store.folders import StudyFolder
from study_app.workers.server import Crashed, Refused
from tests.studies import rehearsed

pytestmark = pytest.mark.slow

SOON_MS = 120_000
"""A process loads its libraries anew, on machines that do other things too."""


class Here:
    """Carries out orders here and at once, in place of a process; tells the answers when it is asked."""

    def __init__(self) -> None:
        self.told: list[tuple[int, Answer | Refused | Crashed]] = []
        self.number = 0
        self.works = True
        self.stops = False
        self.closed = False

    def order(self, order: Order) -> int:
        self.number += 1
        number = self.number
        try:
            last: Answer | Refused = carry_out(
                order, lambda answer: self.told.append((number, answer)), lambda: self.stops
            )
        except StudyError as error:
            last = Refused(str(error), stopped=self.stops)
        self.told.append((number, last))
        return number

    def stop(self) -> None:
        self.stops = True

    def answers(self) -> list[tuple[int, Answer | Refused | Crashed]]:
        told, self.told = self.told, []
        return told

    def close(self) -> None:
        self.closed = True


class Opened:
    """A main window with results, and what was opened from there."""

    def __init__(self, qtbot: QtBot, results: Path, start_worker: Callable[[], Any] = Here) -> None:
        self.qtbot = qtbot
        self.files: list[Path] = []
        self.place = ResultsPlace(results, opener=self.files.append, start_worker=start_worker)
        self.window = MainWindow({"home": Place, "results": lambda: self.place})
        qtbot.addWidget(self.window)
        self.window.show()
        self.window.go("results")
        self.wait()

    def wait(self) -> None:
        self.qtbot.waitUntil(lambda: not self.place.is_busy, timeout=SOON_MS)
        cards = self.place.figures.cards
        self.qtbot.waitUntil(lambda: all(card.drawing is None or card.drawing.is_settled for card in cards))

    def click(self, button: Any) -> None:
        self.qtbot.mouseClick(button, Qt.MouseButton.LeftButton)

    def decide(self, button: Any, by: str, reason: str) -> None:
        self.click(button)
        dialog: Any = self.place.dialog
        dialog.editors["by"].show_value(by)
        dialog.editors["reason"].show_value(reason)
        self.click(dialog.go_on)
        self.wait()

    @property
    def titles(self) -> list[str]:
        return [card.figure.title for card in self.place.figures.cards]

    @property
    def chips(self) -> list[str]:
        return [chip.word for chip in self.place.chips]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearsed(tmp_path_factory.mktemp("results")).parent


@pytest.fixture
def results(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "results"))


@pytest.fixture
def shown(qtbot: QtBot, results: Path) -> Iterator[Opened]:
    opened = Opened(qtbot, results)
    yield opened
    opened.window.close()


def test_a_blinded_study_is_shown_by_code_and_by_name_once_unblinding_is_recorded(shown: Opened, results: Path) -> None:
    assert shown.chips == ["Simulated participants", "Blinded: shown by code"]
    assert shown.titles == ["Agreement for each setting", "Answers for each delay setting"]
    drawn = b"".join(card.figure.svg for card in shown.place.figures.cards)
    assert b">L1<" in drawn
    assert b">Thick<" not in drawn
    assert [one.participant for one in shown.place.sessions.rows.shown] == ["P001", "P002", "P003"]
    assert shown.place.view.testing is None
    shown.decide(shown.place.unblind, "AK", "collection closed")
    (record,) = reveals(results / "demo")
    assert (record["by"], record["reason"]) == ("AK", "collection closed")
    assert shown.chips[1].endswith("by AK: collection closed")
    assert not shown.place.unblind.isVisible()
    assert shown.titles[:2] == ["Every participant's answers", "Answers as a function of added delay"]  # first page
    assert "Agreement for each liquid" in shown.titles
    questions = [card.question.text() for card in shown.place.figures.cards]
    assert questions[0].endswith("Which liquids were distinguished?")
    assert b">Thick<" in shown.place.figures.cards[0].figure.svg
    for table in (results / "demo").rglob("*trials_data.csv"):
        assert b",force_mean_n," in table.read_bytes()


def test_leaving_out_changes_foot_figures_and_list_until_it_is_taken_back(shown: Opened, results: Path) -> None:
    before = shown.place.figures.cards[0].figure
    assert shown.place.sessions.head.text() == "3 of 3 sessions in the figures"
    shown.place.sessions.rows.table.selectRow(1)
    shown.decide(shown.place.exclusions.leave_out, "AK", "fell asleep")
    assert [one.what for one in exclusions(results / "demo")] == [("P002", 1, None)]
    assert shown.place.sessions.head.text() == "2 of 3 sessions in the figures"
    assert shown.place.sessions.why.text() == "P002 is excluded."
    (line,) = shown.place.exclusions.lines
    assert "fell asleep" in line.accessibleName()
    assert "1 session is excluded." in shown.place.figures.cards[0].figure.caption
    assert shown.place.figures.cards[0].figure != before
    shown.decide(line.findChild(ActionButton), "CD", "wrong participant")
    assert exclusions(results / "demo") == ()
    assert shown.place.sessions.head.text() == "3 of 3 sessions in the figures"
    assert not shown.place.exclusions.lines


def cut_table(study: Path) -> None:
    table = StudyFolder(study).session("P002", 1).table("demo", "responses")
    table.write_bytes(table.read_bytes()[:-120])


def cut_exclusions(study: Path) -> None:
    (study / "exclusions.csv").write_text("what\n", encoding="utf-8", newline="\n")


def without_sessions(study: Path) -> None:
    shutil.rmtree(study)
    (study / "data").mkdir(parents=True)


@pytest.mark.parametrize(
    ("change", "title", "named", "listed"),
    [
        (shutil.rmtree, "No studies yet", "", 0),
        (without_sessions, "No sessions yet", "", 0),
        (cut_table, "The study cannot be read", "P002", 3),
        (cut_exclusions, "The study cannot be read", "exclusions.csv", 0),
    ],
)
def test_what_cannot_be_shown_is_said_in_one_sentence(
    qtbot: QtBot, results: Path, change: Callable[[Path], object], title: str, named: str, listed: int
) -> None:
    change(results / "demo")
    opened = Opened(qtbot, results)
    trouble = opened.place.figures.trouble
    assert trouble.title.text() == title
    assert named in trouble.sentence.text()
    assert (len(opened.place.sessions.rows.shown), opened.titles) == (listed, [])
    assert opened.place.report.isEnabled() == (listed > 0)
    if title == "No studies yet":
        opened.click(trouble.button)
        assert opened.window.here == "home"


def nobody_left() -> bool:
    return not any(child.name == "analysis" for child in multiprocessing.active_children())


@pytest.mark.nightly
def test_a_report_by_processes_of_its_own_is_cancelled_then_written_and_none_is_left(
    qtbot: QtBot, results: Path, tmp_path: Path
) -> None:
    opened = Opened(qtbot, results, start_analysis_worker)
    assert opened.titles == ["Agreement for each setting", "Answers for each delay setting"]
    assert not nobody_left()
    opened.click(opened.place.report)
    dialog: Any = opened.place.writing
    dialog.editors["to"].show_value(str(tmp_path / "report"))
    opened.click(dialog.go_on)
    opened.click(dialog.back)
    qtbot.waitUntil(lambda: opened.place.writing is None, timeout=SOON_MS)
    assert not (tmp_path / "report").exists()
    opened.click(opened.place.report)
    dialog = opened.place.writing
    dialog.editors["to"].show_value(str(tmp_path / "report"))
    opened.click(dialog.go_on)
    opened.wait()
    opened.click(dialog.go_on)
    assert opened.files == [tmp_path / "report" / "report.html"]
    assert opened.files[0].is_file()
    dialog.reject()
    opened.window.close()
    qtbot.waitUntil(nobody_left, timeout=SOON_MS)


@pytest.mark.nightly
def test_a_process_that_is_killed_is_told_and_begun_again(qtbot: QtBot, results: Path) -> None:
    opened = Opened(qtbot, results, start_analysis_worker)
    reader: Any = opened.place.reader
    psutil.Process(reader.process.pid).suspend()  # or it may answer before it is killed
    opened.place.read_studies()
    reader.process.kill()
    qtbot.waitUntil(lambda: "bug in the program" in opened.place.figures.trouble.title.text(), timeout=SOON_MS)
    opened.click(opened.place.figures.trouble.button)
    opened.wait()
    assert len(opened.titles) == 2
    opened.window.close()
    qtbot.waitUntil(nobody_left, timeout=SOON_MS)
