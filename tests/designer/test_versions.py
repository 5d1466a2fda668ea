"""Versions and copies of a study in several programs: none is lost, and each shows its changes."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel

from study_app.app.main_controller import MainController
from study_app.designer.controller import DesignerController
from study_app.designer.document.document import Document, Standing
from study_app.designer.document.steps import SetValue
from study_app.designer.document.study import read_study
from study_app.designer.version_rows import Comparison
from study_app.designer.versions import SaveCard, Version, compare, latest_run, version_of
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.cards import Chip
from study_app.protocol.source.files import protocol_hash, shipped_file
from study_app.store.versions.drafts import draft_of
from study_app.store.versions.study_runs import Run
from study_app.store.versions.study_versions import kept_content, kept_versions
from tests.designer.support.designer import DEMO, Designer
from tests.designer.support.runs import run

pytestmark = pytest.mark.slow
REPETITIONS = ("blocks", "liquids", "repetitions")


def lines(designer: Any) -> list[str]:
    """Return the changed lines of the shown difference, without context."""
    difference = designer.controller.changes.difference.toPlainText().splitlines()
    return [line.partition("  #")[0].rstrip() for line in difference if line[:1] in {"-", "+"}]


STUDY = read_study(DEMO.encode())


def run_with(content: str, version: str, **counts: int) -> Run:
    return Run(hash=content, version=version, **counts)


def test_the_last_run_with_participants_comes_before_later_pilots() -> None:
    first, last, pilot = (
        run_with("a", "1.0", sessions=2),
        run_with("b", "1.1", sessions=1),
        run_with("c", "1.2", pilots=3),
    )
    assert latest_run((first, last, pilot)) == last
    assert latest_run(iter((pilot, run_with("d", "2", rehearsals=1)))) == run_with("d", "2", rehearsals=1)
    assert latest_run(()) is None


def test_a_study_is_compared_with_a_text_or_with_a_receipt(designer: Any) -> None:
    before = DEMO.replace("repetitions = 1 ", "repetitions = 3 ", 1)
    comparison = compare(Version(before.replace("\n", "\r\n")), STUDY)
    assert [line.partition("  #")[0].rstrip() for line in comparison.lines if line[0] in "+-"] == [
        "-repetitions = 3", "+repetitions = 1"
    ]  # fmt: skip
    assert comparison.note == ""
    assert compare(Version(DEMO), STUDY) == Comparison((), "The study is identical to this version.")
    designer.open()
    run(designer, "P001", before.encode())
    (held,) = designer.controller.runs.read()
    sentences = compare(Version(None, held), STUDY)
    assert any("repetitions" in sentence.lower() for sentence in sentences.lines), sentences
    assert sentences.note.startswith("This computer does not have a copy of this version. The differences")
    faulty = read_study(DEMO.replace("repetitions = 1 ", "repetitions = 0 ", 1).encode())
    for version, study in ((Version(None, held), faulty), (Version(None), STUDY)):
        assert compare(version, study).lines == ()
        assert compare(version, study).note.startswith("This computer does not have a copy of this version. To list")


def test_the_source_of_a_run_is_the_file_if_its_content_matches(designer: Any) -> None:
    designer.open()
    document: Document = designer.editing.opened
    designer.editing.handle_request(SetValue(REPETITIONS, 3))
    ran, other = run_with(protocol_hash(DEMO.encode()), "1.0", sessions=1), run_with("0" * 64, "1.0", sessions=1)
    assert version_of(document, ran) == Version(DEMO, ran)
    assert version_of(document, ran).text == DEMO
    assert version_of(document, other) == Version(None, other)
    assert version_of(document, other).text is None


@pytest.mark.parametrize(
    ("problems", "note"), [(0, ""), (1, "1 problem: correct it is"), (2, "2 problems: correct they are")]
)
def test_the_card_for_saving_asks_for_a_version_or_a_name(qtbot: Any, problems: int, note: str) -> None:
    standing, known = (
        Standing("1.2", "1.1", 0, True, 2),
        (run_with("a", "1.0", sessions=2), run_with("b", "1.1", sessions=1, pilots=3)),
    )
    card, signals = (
        SaveCard(standing, (*known, run_with("c", "0.9", pilots=1)), Comparison(("-a", "+b"), "Note."), problems),
        [],
    )
    qtbot.addWidget(card)
    for name in ("save_asked", "another_asked", "changes_asked"):
        getattr(card, name).connect(lambda *arguments, name=name: signals.append((name, *arguments)))
    words = " ".join(part.text() for part in card.findChildren(QLabel))
    assert "has been run: 2 sessions with version 1.0; 1 session, 3 pilots with version 1.1. A version" in words
    assert (card.difference.toPlainText(), card.difference.isHidden(), "Note." in words) == ("-a\n+b", False, True)
    assert note in words
    assert ("problem" in words) is bool(problems)
    assert (card.version.text(), card.save.text(), card.first) == ("1.2", "Save 1.2", card.save)
    for theme in (LIGHT, DARK):
        apply_theme(card, theme)
        for line, ink in enumerate((theme.bad, theme.ok)):
            ranges = card.difference.document().findBlockByNumber(line).layout().formats()
            assert len(ranges) == 1
            coloured = ranges[0]
            brush = coloured.format.foreground()
            assert brush.color().name() == QColor(ink).name()
    card.refuse("not this.")
    qtbot.keyClick(card.version, Qt.Key.Key_Backspace)
    qtbot.keyClicks(card.version, "3 ")
    assert (card.save.text(), card.refusal.text()) == ("Save 1.3", "")
    qtbot.keyClick(card.version, Qt.Key.Key_Return)
    card.changes.click()
    card.another.click()
    assert (card.save.text(), card.version.isHidden(), card.name.isHidden(), card.another.isHidden()) == (
        "Save the new study", True, False, True
    )  # fmt: skip
    qtbot.keyClicks(card.name, " mine")
    qtbot.keyClick(card.name, Qt.Key.Key_Return)
    card.save.click()
    card.refuse("taken.")
    assert card.refusal.text() == "Taken."
    assert signals == [("save_asked", "1.3"), ("changes_asked",), *[("another_asked", "mine")] * 2]


def test_a_draft_can_be_continued_where_no_study_is_open(designer: Any) -> None:
    designer.open("kitchen", "device")
    designer.editing.handle_request(SetValue(("device", "force_limit_n"), 3.0))
    designer.saving.leave()
    text = designer.text
    another = DesignerController(designer.results)
    another.enter()
    studies = another.place.header.study
    studies.activated.emit(studies.findText("kitchen.toml", Qt.MatchFlag.MatchContains))
    assert another.editing.opened.study.text == text
    assert another.editing.selected == ("device",)
    another.place.deleteLater()


def test_a_copy_takes_the_liquid_files_of_its_study_along(designer: Any, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    liquid = shipped_file("demo").read_text("utf-8").split("[liquids.thick]")[1].split("\n\n")[0]
    (elsewhere / "syrup.toml").write_text(f"format = 2\n[liquids.syrup]{liquid}\n", encoding="utf-8", newline="\n")
    text = designer.file.read_text("utf-8").replace(f"[liquids.thick]{liquid}", '[liquids.thick]\nfile = "syrup.toml"')
    for name in ("thin", "thick"):
        text = text.replace(f"[conditions.{name}]\n", f'[conditions.{name}]\nview = "sea/waves.mp4"\n')
    (elsewhere / "sea").mkdir()
    (elsewhere / "sea" / "waves.mp4").write_bytes(b"copied, not decoded")
    (elsewhere / "kitchen.toml").write_text(text, encoding="utf-8", newline="\n")
    designer.open(str(elsewhere / "kitchen.toml"))
    assert designer.study.faults == ()
    designer.controller.begin_study(str(elsewhere / "kitchen.toml"), "mine")
    designer.saving.save()
    assert designer.editing.opened.file.exists()
    assert (designer.file.parent / "syrup.toml").read_bytes() == (elsewhere / "syrup.toml").read_bytes()
    assert (designer.file.parent / "sea" / "waves.mp4").read_bytes() == b"copied, not decoded"
    designer.open()
    again = DesignerController(designer.results)
    again.open("mine")
    assert again.editing.opened is not None
    assert again.editing.opened.study.faults == ()
    assert kept_content(protocol_hash(again.editing.opened.study.source)) is not None
    again.place.deleteLater()


OTHER = """
import sys
from pathlib import Path
from PySide6.QtTest import QTest
from study_app.designer.controller import DesignerController
from study_app.gui.application import application_here
from study_app.designer.document.steps import SetText
application = application_here()
designer = DesignerController(Path(sys.argv[1]))
designer.open("kitchen")
designer.editing.handle_request(SetText(("pages", "welcome", "title"), "en", sys.argv[2]))
if sys.argv[3] == "save":
    designer.saving.save()
else:
    designer.saving.leave()
"""


def test_the_card_for_saving_lists_runs_and_its_buttons_work(designer: Any, qtbot: Any) -> None:
    source, version = designer.file.read_bytes(), re.compile(rb'^version = "[^"]*"', re.M)
    for participant, stated, pilot in (("P001", b"2.5", False), ("P002", b"0.9", True)):
        run(designer, participant, version.sub(b'version = "%s"' % stated, source), pilot=pilot)
    designer.open()
    designer.editing.handle_request(SetValue(("study", "version"), "2.5"))
    designer.editing.handle_request(SetValue(REPETITIONS, 3))
    qtbot.waitUntil(lambda: len(designer.controller.runs.known) == 2)
    designer.saving.save()
    card = designer.saving.card
    words = " ".join(part.text() for part in card.findChildren(QLabel))
    assert ("1 session with version 2.5" in words, "0.9" in words) == (True, False), "a pilot is no session"
    assert card.version.isVisibleTo(card)
    card.another.click()
    assert (card.version.isVisibleTo(card), card.name.isVisibleTo(card)) == (False, True)
    with qtbot.waitSignal(card.changes_asked):
        card.changes.click()


@pytest.mark.nightly
def test_two_programs_on_one_study_lose_no_edit_silently(designer: Any) -> None:
    def other(words: str, then: str) -> None:
        command = [sys.executable, "-c", OTHER, str(designer.results), words, then]
        subprocess.run(command, check=True, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})

    designer.open()
    designer.editing.handle_request(SetValue(REPETITIONS, 3))
    other("Saved elsewhere", "save")
    assert "Saved elsewhere" in designer.file.read_text("utf-8")
    designer.saving.save()
    assert "Saved elsewhere" in designer.file.read_text("utf-8")
    assert designer.place.banner.sentence.text().startswith("Another program has changed this file")
    designer.saving.answer_banner("keep")
    designer.saving.save()
    assert "repetitions = 3" in designer.file.read_text("utf-8")
    kept = [kept_content(version.hash) or b"" for version in kept_versions(designer.file)]
    assert any(b"Saved elsewhere" in content for content in kept)

    designer.editing.handle_request(SetValue(REPETITIONS, 4))
    other("Typed elsewhere", "leave")
    designer.saving.leave()
    assert designer.place.banner.sentence.text().startswith("This study is also being edited in another window")
    next(iter(designer.place.banner.buttons.values())).click()
    QApplication.processEvents()
    assert any("Typed elsewhere" in line for line in lines(designer))


def test_a_session_of_another_study_is_not_compared(designer: Any) -> None:
    changed = designer.file.read_bytes().replace(b"repetitions = 1 ", b"repetitions = 3 ", 1)
    folder = run(designer, "P001", changed, study="elsewhere")
    designer.open()
    changes, pane = designer.controller.changes, designer.place.pane
    tab = pane.tab
    changes.compare_with_session("demo", folder)
    changes.compare_with_session("kitchen", folder.parent)  # there is no receipt
    assert (pane.tab, changes.chosen) == (tab, "")
    changes.compare_with_session("kitchen", folder)
    assert (pane.tab, changes.chosen) == ("changes", protocol_hash(changed))
    assert changes.note.text().startswith("This computer does not have a copy of this version. The differences")
    assert (changes.restore.isEnabled(), changes.nothing.isHidden()) == (False, True)
    designer.open("demo")
    changes.compare_now()
    assert protocol_hash(changed) not in [changes.version.itemData(at) for at in range(changes.version.count())]


@pytest.mark.parametrize(("kind", "key"), [("pilot", "pilot"), ("rehearsal", "simulated")])
def test_changes_begin_with_the_last_session_where_no_participant_was_run(
    designer: Any, qtbot: Any, kind: str, key: str
) -> None:
    source = designer.file.read_bytes()
    early = source.replace(b"max_s = 30 ", b"max_s = 40 ")
    assert early != source
    run(designer, "P001", source, study=f"kitchen-{kind}-1", **{key: True})
    run(designer, "P001", early, study=f"kitchen-{kind}-2", started_at="2026-11-19T12:00:00+00:00", **{key: True})
    designer.open()
    qtbot.waitUntil(lambda: bool(designer.controller.runs.known))
    designer.editing.handle_request(SetValue(REPETITIONS, 3))
    designer.place.show_tab("changes")
    changes = designer.controller.changes
    assert changes.version.itemText(0) == "The file without the edits"
    assert changes.chosen == protocol_hash(source)
    assert changes.restore.isEnabled()
    before, designer.editing.opened.read_only = designer.text, "The study is read-only."
    changes.restore.click()
    changes.compare_now()
    assert (designer.text, changes.restore.isEnabled()) == (before, False)


def test_the_version_of_a_session_in_results_leads_to_its_changes(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    designer = Designer(tmp_path)
    source = designer.file.read_bytes()
    folder = run(designer, "P001", source, study="elsewhere")
    designer.file.write_bytes(source.replace(b"repetitions = 1", b"repetitions = 3", 1))
    designer.window.close()
    visit = MainController(designer.results)
    visit.window.show()
    visit.window.place("results")
    assert visit.results_place is not None
    card = visit.results_place.sessions
    facts = SessionFacts(
        participant="P001",
        session=1,
        study="kitchen",
        started=datetime.now().astimezone(),
        status="completed",
        validity="valid",
        answers=8,
        answers_of=8,
        simulated=False,
        pilot=False,
        folder=folder,
    )
    card.show_sessions([facts, replace(facts, participant="P002", folder=folder.parent)])
    table = card.rows.table
    words = [[str(table.model().index(row, column).data()) for column in range(4)] for row in range(2)]
    assert [row[3] for row in words] == ["1.1", ""]
    card.rows.table.selectRow(1)
    assert not card.version.isEnabled()
    card.rows.table.selectRow(0)
    assert card.version.isEnabled()
    table.clicked.emit(table.model().index(0, 3))
    assert visit.window.here == "designer"
    qtbot.waitUntil(lambda: visit.designer is not None and visit.designer.place.isVisible(), timeout=20_000)
    assert visit.designer is not None
    changes = visit.designer.changes
    assert changes.chosen == protocol_hash(source)
    assert changes.version.currentText().startswith("1.1: 1 session")
    assert visit.designer.place.pane.tab == "changes"
    changed = source.replace(b'version = "1.1"', b'version = "1.2"', 1)
    run(designer, "P002", changed, study="elsewhere", version="1.2", started_at="2026-11-20T12:00:00+00:00")
    designer.file.unlink()
    visit.show_version(facts)
    assert visit.window.notice is not None
    texts = [label.text() for label in visit.window.notice.findChildren(QLabel)]
    assert any(text.startswith("Version 1.2 (first session: P002, 2026-11-20): ") for text in texts)
    visit.window.close()
    visit.end()
    visit.window.deleteLater()
    designer.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_a_text_that_is_being_typed_is_in_the_draft_when_the_designer_is_left(designer: Any) -> None:
    designer.open("kitchen", "study")
    line = designer.field("study", "version").line
    designer.fill(line, "3.7", keys="")
    designer.window.go("home")
    draft = draft_of(designer.file)
    assert draft is not None
    assert draft.text == designer.text
    assert designer.value("study", "version") == "3.7"


def test_returning_to_the_designer_shows_changes_of_other_programs(designer: Any) -> None:
    designer.open("kitchen", "study")
    designer.window.go("home")
    designer.change(('version = "1.1"', 'version = "1.7"'))
    designer.file.with_name("bath.toml").write_text(DEMO, encoding="utf-8", newline="\n")
    designer.window.go("designer")
    assert designer.field("study", "version").line.text() == "1.7"
    studies = designer.place.header.study
    assert "bath" in {studies.itemData(number) for number in range(studies.count())}
    designer.editing.handle_request(SetValue(REPETITIONS, 3))
    designer.window.go("home")
    designer.change(('version = "1.7"', 'version = "1.8"'))
    designer.window.go("designer")
    assert designer.place.banner.sentence.text().startswith("Another program has changed this file, and you have")


@pytest.mark.parametrize("estimate", [4.0, 5.0])
def test_the_chosen_card_shows_its_template_and_whether_a_known_answer_is_recovered(
    designer: Any, estimate: float
) -> None:
    designer.controller.show_new_page()
    page = designer.place.new_page
    card, before = page.card, next(button.choice for button in page.buttons if button.choice.recovery)
    answer = replace(before.recovery, planted=4.1, found=estimate, low=3.0, high=6.0)
    choice = replace(
        before, source="a", title="Thicker", description="Which is thicker?", study_title="Two oils",
        session=(("lock", "Welcome", "1 min"), ("layers", "Stirring", "7 min")), recovery=answer, languages=("nl",),
        tags=(("device", "Up to 3 N"), ("lock", "Double-blind")), questions=(),
    )  # fmt: skip
    card.show_choice(replace(before, source="b", title="Other", description="Another", recovery=None))
    card.show_choice(choice)
    words = [line.text() for line in card.findChildren(QLabel) if line.text()]
    for texts in (("Thicker",), ("Which is thicker?",), ("The session",), ("Welcome", "1 min"), ("Stirring", "7 min")):
        at = words.index(texts[0])
        assert tuple(words[at : at + len(texts)]) == texts
    assert [chip.word for chip in card.about.findChildren(Chip)] == ["Up to 3 N", "Double-blind"]
    (chip,) = card.details.findChildren(Chip)
    assert (chip.word, chip.tone) == (("recovered", "ok") if estimate == 4.0 else ("not recovered", "warn"))
    assert answer.sentence in words
    assert not {"Other", "Another"} & set(words)
    assert card.questions.title.placeholderText() == "Two oils"
    assert [code for code, check in card.questions.languages.items() if check.isChecked()] == ["nl"]
    for height, places in ((800, [0, 2, 1]), (1000, [0, 1, 2])):
        card.resize(400, height)
        card.resizeEvent(QResizeEvent(card.size(), card.size()))
        assert [card.inside.indexOf(part) for part in (card.about, card.details, card.begin)] == places
