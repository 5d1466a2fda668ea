"""The real results page: rehearsed studies are read, unblinded, excluded from and reported."""

import multiprocessing
import shutil
import statistics
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from pytestqt.qtbot import QtBot

from study_app.analysis.data.study_tables import group_members, load_study
from study_app.analysis.study_worker import carry_out
from study_app.analysis.worker_messages import Answer, Order, start_analysis_worker
from study_app.errors import StudyError
from study_app.gui.home.main_window import MainWindow
from study_app.gui.results.figures import FigureCard, ResultsView
from study_app.gui.results.view import ResultsPlace
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.main_view import Place
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.blinding import reveals
from study_app.store.exclusions import exclusions
from study_app.store.files.folders import StudyFolder
from study_app.workers.server import Crashed, Refused
from tests.protocol.groups.grouped import GROUPS, STUDY
from tests.studies import begun, made_up, rehearsed

pytestmark = pytest.mark.slow

SOON_MS = 120_000
"""A process loads its libraries anew, on machines that do other things too."""


class Here:
    """A worker that carries out orders at once in this process, and returns answers on request."""

    def __init__(self) -> None:
        self.pending_answers: list[tuple[int, Answer | Refused | Crashed]] = []
        self.number = 0
        self.works = True
        self.stops = False
        self.closed = False

    def order(self, order: Order) -> int:
        self.number += 1
        number = self.number
        try:
            last: Answer | Refused = carry_out(
                order, lambda answer: self.pending_answers.append((number, answer)), lambda: self.stops
            )
        except StudyError as error:
            last = Refused(str(error), stopped=self.stops)
        self.pending_answers.append((number, last))
        return number

    def stop(self) -> None:
        self.stops = True

    def answers(self) -> list[tuple[int, Answer | Refused | Crashed]]:
        answers, self.pending_answers = self.pending_answers, []
        return answers

    def close(self) -> None:
        self.closed = True


class Opened:
    """A main window with results, and the files opened from it."""

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
def results_window(qtbot: QtBot, results: Path) -> Iterator[Opened]:
    results_window = Opened(qtbot, results)
    yield results_window
    results_window.window.close()


def test_a_blinded_study_is_shown_by_code_and_by_name_once_unblinding_is_recorded(
    results_window: Opened, results: Path
) -> None:
    assert results_window.chips == ["Simulated participants", "Blinded"]
    assert results_window.place.hidden.isVisible()
    assert results_window.titles == ["Agreement by condition", "Answers by condition"]
    drawn = b"".join(card.figure.svg for card in results_window.place.figures.cards)
    assert b">L1<" in drawn
    assert b">Thick<" not in drawn
    assert [session.participant for session in results_window.place.sessions.rows.shown] == ["P001", "P002", "P003"]
    assert results_window.place.view.testing is None
    views, show_view = list[ResultsView](), results_window.place.show_view
    results_window.place.show_view = lambda view: (views.append(view), show_view(view))  # type: ignore[method-assign]
    results_window.decide(results_window.place.unblind, "AK", "collection closed")
    unblinded = [view for view in views if view.opened]
    assert any(view.figures for view in unblinded)
    assert not [view for view in unblinded if any(b">L1<" in figure.svg for figure in view.figures)]
    (record,) = reveals(results / "demo")
    assert (record["by"], record["reason"]) == ("AK", "collection closed")
    assert results_window.chips[1].endswith("by AK: collection closed")
    assert not results_window.place.unblind.isVisible()
    assert not results_window.place.hidden.isVisible()
    assert results_window.titles[:2] == [
        "Every participant's answers",
        "Answers as a function of added delay",
    ]  # first page
    assert "Agreement for each liquid" in results_window.titles
    questions = [card.question.text() for card in results_window.place.figures.cards]
    assert questions[0].endswith("Which liquids were distinguished?")
    assert b">Thick<" in results_window.place.figures.cards[0].figure.svg
    stops = [button for card in results_window.place.figures.cards for button in card.buttons if button.isVisible()]
    stops[0].setFocus()
    passed = stops[:1]
    while len(passed) < len(stops):
        results_window.qtbot.keyClick(passed[-1], Qt.Key.Key_Tab)
        passed.append(results_window.window.focusWidget())
    assert passed == stops, "Tab goes through the cards from top to bottom"
    for table in (results / "demo").rglob("*trials_data.csv"):
        assert b",force_mean_n," in table.read_bytes()


def test_an_exclusion_changes_footer_figures_and_list_until_it_is_undone(results_window: Opened, results: Path) -> None:
    before = results_window.place.figures.cards[0].figure
    assert results_window.place.sessions.head.text() == "3 of 3 sessions in the figures"
    results_window.place.sessions.rows.table.selectRow(1)
    results_window.decide(results_window.place.exclusions.leave_out, "AK", "fell asleep")
    assert [exclusion.what for exclusion in exclusions(results / "demo")] == [("P002", 1, None)]
    assert results_window.place.sessions.head.text() == "2 of 3 sessions in the figures"
    assert results_window.place.sessions.why.text() == "P002 is excluded."
    (line,) = results_window.place.exclusions.lines
    assert "fell asleep" in line.accessibleName()
    assert "1 session is excluded." in results_window.place.figures.cards[0].figure.caption
    assert results_window.place.figures.cards[0].figure != before
    results_window.decide(line.findChild(ActionButton), "CD", "wrong participant")
    assert exclusions(results / "demo") == ()
    assert results_window.place.sessions.head.text() == "3 of 3 sessions in the figures"
    assert not results_window.place.exclusions.lines


def choose(qtbot: QtBot, choice: Choice, text: str) -> None:
    """Choose an item with the keyboard."""
    choice.setFocus()
    down = choice.findText(text) - choice.currentIndex()
    for _ in range(abs(down)):
        qtbot.keyClick(choice, Qt.Key.Key_Down if down > 0 else Qt.Key.Key_Up)


def copied_rows(results_window: Opened, card: FigureCard) -> list[dict[str, str]]:
    """Return the rows that "Copy numbers" of a card puts on the clipboard."""
    results_window.click(card.copy_numbers)
    head, *lines = [line.split("\t") for line in QGuiApplication.clipboard().text().splitlines()]
    return [dict(zip(head, line, strict=True)) for line in lines]


def test_figures_are_split_by_the_groups_that_unblinding_makes_known(qtbot: QtBot, tmp_path: Path) -> None:
    source, folder = tmp_path / "grouped.toml", tmp_path / "results" / "grouped"
    source.write_text(STUDY + GROUPS, encoding="utf-8", newline="\n")
    rehearse_answers(source, participants=6, seed=8, results=folder, features=made_up(str(source)))
    results_window = Opened(qtbot, folder.parent)
    place = results_window.place
    assert not place.split.isVisible(), "the groups are randomised and sealed"
    results_window.decide(place.unblind, "AK", "collection closed")
    assert place.split.isVisible()

    study = load_study(folder)
    answers = study.responses[study.responses["counted"] & (study.responses["block"] == "thick")]
    members = group_members(study)
    groups = sorted({*members.values()})
    names = {code: setting.liquid for (block, code), setting in study.settings.items() if block == "thick"}
    own = answers.groupby(["participant", answers["code"].map(names)])["response"].median()  # of two answers

    def mean(group: str, liquid: str) -> float:
        return statistics.mean(own[person, liquid] for person in members if members[person] == group)

    def cards() -> list[FigureCard]:
        return [card for card in place.figures.cards if card.figure.name == "effects-thick"]

    (together,) = cards()
    verdict = together.figure.verdict
    assert verdict
    choose(qtbot, place.split, "Side by side")
    results_window.wait()
    (compared,) = cards()
    assert compared.figure.question == together.figure.question
    assert not compared.figure.verdict, "the tests are of all participants"
    rows = copied_rows(results_window, compared)
    assert {row["participant"]: row["group"] for row in rows[:6]} == members
    mean_rows = {row["group"]: row for row in rows if row["participant"] == "mean"}
    means = {
        (group, name): mean(group, liquid)
        for group in groups
        for name, liquid in (("Heavy Honey", "honey"), ("Heavy Water", "water"))
    }
    assert {(group, name): float(mean_rows[group][name]) for group, name in means} == pytest.approx(means)
    assert len(set(means.values())) == 4, "or any mean would do"

    choose(qtbot, place.split, f"Only {groups[1]}")
    results_window.wait()
    (alone,) = cards()
    people = [row["participant"] for row in copied_rows(results_window, alone) if row["participant"].startswith("P")]
    assert people == [person for person in sorted(members) if members[person] == groups[1]]
    choose(qtbot, place.split, "All together")
    results_window.wait()
    assert [card.figure.verdict for card in cards()] == [verdict]
    results_window.window.close()


def test_a_study_without_groups_has_no_choice_of_groups(results_window: Opened) -> None:
    results_window.decide(results_window.place.unblind, "AK", "collection closed")
    assert not results_window.place.split.isVisible()
    assert {card.figure.split for card in results_window.place.figures.cards} == {""}


def cut_table(study: Path) -> None:
    table = StudyFolder(study).session("P002", 1).table("demo", "responses")
    table.write_bytes(table.read_bytes()[:-120])


def cut_exclusions(study: Path) -> None:
    (study / "exclusions.csv").write_text("what\n", encoding="utf-8", newline="\n")


def without_sessions(study: Path) -> None:
    shutil.rmtree(study)
    (study / "data").mkdir(parents=True)


def none_complete(study: Path) -> None:
    shutil.rmtree(study)
    begun(study).close()


@pytest.mark.parametrize(
    ("change", "title", "named", "button", "listed"),
    [
        (shutil.rmtree, "No studies yet", "", "Go to Home", 0),
        (without_sessions, "No sessions yet", "", "Go to Home", 0),
        (none_complete, "No complete session to show", "Start or continue a session on Home", "Go to Home", 1),
        (cut_table, "The study cannot be read", "P002", "Refresh", 3),
        (cut_exclusions, "The study cannot be read", "exclusions.csv", "Refresh", 0),
    ],
)
def test_unreadable_results_are_reported_in_one_sentence(
    qtbot: QtBot, results: Path, change: Callable[[Path], object], title: str, named: str, button: str, listed: int
) -> None:
    change(results / "demo")
    results_window = Opened(qtbot, results)
    trouble = results_window.place.figures.trouble
    assert (trouble.title.text(), trouble.button.text()) == (title, button)
    assert named in trouble.sentence.text()
    assert (len(results_window.place.sessions.rows.shown), results_window.titles) == (listed, [])
    assert results_window.place.report.isEnabled() == (listed > 0)
    if title == "No studies yet":
        results_window.click(trouble.button)
        assert results_window.window.here == "home"


def test_a_written_report_is_opened_and_of_exported_tables_the_folder(
    qtbot: QtBot, results: Path, tmp_path: Path
) -> None:
    results_window, file = Opened(qtbot, results), tmp_path / "report" / "report.html"
    for button, label, path in (
        (results_window.place.report, "Open the report", file),
        (results_window.place.export, "Open the folder", file.parent),
    ):
        results_window.click(button)
        dialog: Any = results_window.place.writing
        dialog.editors["to"].show_value(str(file.parent))
        chosen = () if button is results_window.place.report else ("wide", "psych-ds")
        for name in chosen:
            dialog.editors[name].control.setChecked(True)
        assert dialog.asked == (file.parent, chosen)
        dialog.show_written([file], ())
        assert dialog.go_on.text() == label
        results_window.click(dialog.go_on)
        assert results_window.files.pop() == path
        dialog.reject()


def nobody_left() -> bool:
    return not any(child.name == "analysis" for child in multiprocessing.active_children())


@pytest.mark.nightly
def test_a_report_in_worker_processes_is_cancelled_then_written_without_leftovers(
    qtbot: QtBot, results: Path, tmp_path: Path
) -> None:
    results_window = Opened(qtbot, results, start_analysis_worker)
    assert results_window.titles == ["Agreement by condition", "Answers by condition"]
    assert not nobody_left()
    results_window.click(results_window.place.report)
    dialog: Any = results_window.place.writing
    dialog.editors["to"].show_value(str(tmp_path / "report"))
    results_window.click(dialog.go_on)
    results_window.click(dialog.back)
    qtbot.waitUntil(lambda: results_window.place.writing is None, timeout=SOON_MS)
    assert not (tmp_path / "report").exists()
    results_window.click(results_window.place.report)
    dialog = results_window.place.writing
    dialog.editors["to"].show_value(str(tmp_path / "report"))
    results_window.click(dialog.go_on)
    results_window.wait()
    results_window.click(dialog.go_on)
    assert results_window.files == [tmp_path / "report" / "report.html"]
    assert results_window.files[0].is_file()
    dialog.reject()
    results_window.window.close()
    qtbot.waitUntil(nobody_left, timeout=SOON_MS)


@pytest.mark.nightly
def test_a_killed_process_is_reported_and_restarted(qtbot: QtBot, results: Path) -> None:
    results_window = Opened(qtbot, results, start_analysis_worker)
    reader: Any = results_window.place.reader
    psutil.Process(reader.process.pid).suspend()  # or it may answer before it is killed
    results_window.place.read_studies()
    reader.process.kill()
    qtbot.waitUntil(lambda: "bug in the program" in results_window.place.figures.trouble.title.text(), timeout=SOON_MS)
    results_window.click(results_window.place.figures.trouble.button)
    results_window.wait()
    assert len(results_window.titles) == 2
    results_window.window.close()
    qtbot.waitUntil(nobody_left, timeout=SOON_MS)
