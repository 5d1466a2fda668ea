"""Versions in the window: the chip, the card before saving, two programs on one study, differences taken back."""

import os
import subprocess
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QApplication, QLabel

from study_app.app.main_controller import MainController
from study_app.designer.document.steps import SetText, SetValue
from study_app.designer.place.controller import DesignerController
from study_app.errors import StoreError
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.protocol.source.files import protocol_hash, shipped_file
from study_app.store.drafts import draft_of
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.study_settings import keep_setting, kept_original, kept_participants
from study_app.store.study_versions import kept_content, kept_versions
from tests.designer.support.designer import Designer
from tests.designer.versions.conftest import REPETITIONS, click, lines, run, version_of

pytestmark = pytest.mark.slow


def test_a_study_that_was_not_run_is_saved_without_a_question(designer: Any, qtbot: Any) -> None:
    designer.open()
    qtbot.waitUntil(lambda: designer.place.header.version.words == "Not run yet")
    run(designer, "P001", designer.file.read_bytes(), study="kitchen-pilot", pilot=True)
    designer.controller.enter()
    qtbot.waitUntil(lambda: designer.place.header.version.words == "Piloted")
    assert "1 pilot" in designer.place.header.version.toolTip()
    designer.editing.ask(SetValue(REPETITIONS, 3))
    qtbot.wait(250)
    assert designer.place.header.save.text() == "Save"
    click(qtbot, designer.place.header.save)
    assert designer.place.prompt is None
    assert designer.file.read_text() == designer.text


def test_a_study_that_was_run_is_saved_under_the_next_version(ran: Any, qtbot: Any) -> None:
    before = ran.file.read_bytes()
    ran.editing.ask(SetValue(REPETITIONS, 3))
    ran.editing.ask(SetText(("pages", "welcome", "title"), "en", "Hello"))
    ran.editing.ask(SetValue(("sequence",), ["welcome"]))
    qtbot.waitUntil(lambda: ran.place.header.save.text() == "Save 1.1 …")
    assert ran.place.header.version.words == "1.1, was 1.0"
    qtbot.keyClick(ran.window, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    card = ran.place.prompt
    assert ran.file.read_bytes() == before
    said = " ".join(one.text() for one in card.findChildren(QLabel))
    assert "2 sessions, 1 pilot with version 1.0" in said
    assert '+title = "Hello"' in card.difference.toPlainText()
    assert "new sessions are refused" in said
    card.version.selectAll()
    qtbot.keyClicks(card.version, "1.0")
    qtbot.keyClick(card.version, Qt.Key.Key_Return)
    assert "was run with another content" in card.refusal.text()
    assert ran.file.read_bytes() == before
    card.version.selectAll()
    qtbot.keyClicks(card.version, "1.1")
    click(qtbot, card.save)
    assert ran.place.prompt is None
    assert version_of(ran) == "1.1"
    assert ran.file.read_text() == ran.text
    assert kept_content(protocol_hash(before)) == before
    ran.editing.ask(SetValue(REPETITIONS, 4))
    click(qtbot, ran.place.header.save)
    assert ran.place.prompt is None
    assert ran.file.read_text() == ran.text


def test_what_changes_the_measure_can_be_saved_as_another_study(ran: Any, qtbot: Any) -> None:
    before = ran.file.read_bytes()
    ran.editing.ask(SetValue(REPETITIONS, 3))
    ran.saving.leave()
    ran.window.activateWindow()
    ran.saving.save()
    click(qtbot, ran.place.prompt.another)
    name = ran.place.prompt.name
    qtbot.waitUntil(name.hasFocus)
    qtbot.keyClicks(name, "kitchen")
    qtbot.keyClick(name, Qt.Key.Key_Return)
    refusal = ran.place.prompt.refusal
    assert refusal.text().endswith('already there; "kitchen2" is free.')
    assert refusal.use.text() == "Save as kitchen2"
    click(qtbot, refusal.use)
    file = ran.file.parent / "kitchen2.toml"
    assert ran.editing.opened.file == file
    assert file.read_text() == ran.text
    assert ran.value("blocks", "liquids", "repetitions") == 3
    assert (ran.file.read_bytes(), draft_of(ran.file)) == (before, None)
    ran.open()
    assert ran.text.encode() == before


def test_another_study_that_cannot_be_saved_keeps_its_edits_as_a_draft(
    ran: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_args: object) -> str:
        raise StoreError("the disk is full")

    monkeypatch.setattr("study_app.designer.document.document.save", full)
    keep_setting(ran.file.with_name("pantry.toml"), "participants", 7)  # of a study that was deleted
    ran.editing.ask(SetValue(REPETITIONS, 3))
    ran.saving.save_as_another("pantry")
    assert kept_participants(ran.file.with_name("pantry.toml")) is None
    assert kept_original(ran.file.with_name("pantry.toml")) == "kitchen"
    draft = draft_of(ran.file.with_name("pantry.toml"))
    assert ("The study was not saved", "the disk is full.") in ran.messages
    assert draft is not None
    assert draft.text == ran.text
    assert "repetitions = 3" in ran.text
    assert draft_of(ran.file) is None


def test_another_study_is_not_saved_over_a_version_that_was_run_under_its_name(ran: Any) -> None:
    run(ran, "P001", ran.file.read_bytes().replace(b'"1.0"', b'"0.1"'), study="pantry")
    ran.editing.ask(SetValue(REPETITIONS, 3))
    ran.saving.save_as_another("pantry")
    assert not ran.file.with_name("pantry.toml").exists()
    assert "version 0.1 was run by 1 session with another content" in ran.messages[-1][1]


def test_a_change_by_another_program_is_noticed_while_the_place_is_shown(designer: Any, qtbot: Any) -> None:
    designer.open()
    before = designer.file.read_text()
    designer.file.write_text(before + "# outside\n")
    qtbot.waitUntil(lambda: designer.text.endswith("# outside\n"))
    designer.editing.ask(SetValue(REPETITIONS, 3))
    other = designer.file.with_suffix(".new")
    other.write_text(before.replace("A first look", "Another look"))
    other.replace(designer.file)
    qtbot.waitUntil(designer.place.banner.isVisible)
    click(qtbot, [*designer.place.banner.buttons.values()][2])
    assert designer.controller.changes.chosen == "file"
    assert '-title = "Another look"' in lines(designer)
    click(qtbot, [*designer.place.banner.buttons.values()][1])
    assert "Another look" in designer.text
    designer.editing.undo()
    assert "repetitions = 3" in designer.text


def test_a_session_under_way_makes_the_study_read_only_until_it_ends(ran: Any) -> None:
    ran.editing.ask(SetValue(REPETITIONS, 3))
    text = ran.file.read_text()
    opening = open_alone(ran.results / "kitchen" / "data" / "sub-P001" / "ses-01")
    ran.saving.save()
    assert "session of this study is under way" in ran.place.banner.words.text()
    assert (ran.place.prompt, ran.file.read_text()) == (None, text)
    opening.release()
    ran.controller.enter()
    assert not ran.place.banner.isVisible()
    ran.editing.ask(SetValue(REPETITIONS, 4))
    assert "repetitions = 4" in ran.text


def test_the_id_of_a_question_with_answers_is_locked_until_it_is_said_what_breaks(ran: Any, qtbot: Any) -> None:
    question = ("questionnaires", "delay", "items", 0)
    ran.editing.select(question)
    head = ran.place.form.head
    qtbot.waitUntil(head.unlock.isVisible)
    assert head.id.isReadOnly()
    click(qtbot, head.unlock)
    card = ran.place.prompt
    assert "Answers of 2 sessions" in card.accessibleName() + ran.place.form.head.unlock.toolTip()
    click(qtbot, card.go_on)
    assert ran.place.prompt is None
    assert not head.id.isReadOnly()
    qtbot.keyClicks(head.id, "difficult")
    qtbot.keyClick(head.id, Qt.Key.Key_Return)
    assert 'id = "difficult"' in ran.text
    assert not head.unlock.isVisible()
    ran.editing.select(("pages", "welcome"))
    assert not head.id.isReadOnly()
    ran.editing.undo()
    ran.editing.select(question)
    assert head.id.isReadOnly()


def test_a_copy_takes_the_liquid_files_of_its_study_along(designer: Any, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    liquid = shipped_file("demo").read_text().split("[liquids.thick]")[1].split("\n\n")[0]
    (elsewhere / "syrup.toml").write_text(f"[liquids.syrup]{liquid}\n")
    text = designer.file.read_text().replace(f"[liquids.thick]{liquid}", '[liquids.thick]\nfile = "syrup.toml"')
    text = text.replace("format = 1", "format = 2", 1)
    for name in ("thin", "thick"):
        text = text.replace(f"[conditions.{name}]\n", f'[conditions.{name}]\nview = "sea/waves.mp4"\n')
    (elsewhere / "sea").mkdir()
    (elsewhere / "sea" / "waves.mp4").write_bytes(b"copied, not decoded")
    (elsewhere / "kitchen.toml").write_text(text)
    designer.open(str(elsewhere / "kitchen.toml"))
    assert designer.study.faults == ()
    designer.controller.begin(str(elsewhere / "kitchen.toml"), "mine")
    designer.saving.save()
    assert designer.editing.opened.file.exists()
    assert (designer.file.parent / "syrup.toml").read_bytes() == (elsewhere / "syrup.toml").read_bytes()
    assert (designer.file.parent / "sea" / "waves.mp4").read_bytes() == b"copied, not decoded"
    designer.open()
    again = DesignerController(designer.results)
    again.open("mine")
    assert again.editing.opened is not None
    assert again.editing.opened.study.faults == ()
    assert kept_content(protocol_hash(again.editing.opened.source())) is not None
    again.place.deleteLater()


OTHER = """
import sys
from pathlib import Path
from PySide6.QtTest import QTest
from study_app.designer.place.controller import DesignerController
from study_app.gui.application import application_here
from study_app.designer.document.steps import SetText
application = application_here()
designer = DesignerController(Path(sys.argv[1]))
designer.open("kitchen")
designer.editing.ask(SetText(("pages", "welcome", "title"), "en", sys.argv[2]))
if sys.argv[3] == "save":
    designer.saving.save()
else:
    designer.saving.leave()
"""


@pytest.mark.nightly
def test_two_programs_on_one_study_lose_no_edit_silently(designer: Any) -> None:
    def other(words: str, then: str) -> None:
        command = [sys.executable, "-c", OTHER, str(designer.results), words, then]
        subprocess.run(command, check=True, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})

    designer.open()
    designer.editing.ask(SetValue(REPETITIONS, 3))
    other("Saved elsewhere", "save")
    assert "Saved elsewhere" in designer.file.read_text()
    designer.saving.save()
    assert "Saved elsewhere" in designer.file.read_text()
    assert designer.place.banner.words.text().startswith("Another program changed this file")
    designer.saving.answer_banner("keep")
    designer.saving.save()
    assert "repetitions = 3" in designer.file.read_text()
    kept = [kept_content(one.hash) or b"" for one in kept_versions(designer.file)]
    assert any(b"Saved elsewhere" in content for content in kept)

    designer.editing.ask(SetValue(REPETITIONS, 4))
    other("Typed elsewhere", "leave")
    designer.saving.leave()
    assert designer.place.banner.words.text().startswith("Another window of the program edits this study, too")
    next(iter(designer.place.banner.buttons.values())).click()
    QApplication.processEvents()
    assert any("Typed elsewhere" in line for line in lines(designer))


def test_changes_shows_what_differs_and_restores_a_version(ran: Any, qtbot: Any) -> None:
    before = ran.text
    ran.editing.ask(SetText(("pages", "welcome", "title"), "en", "Hello"))
    click(qtbot, ran.place.header.version)
    assert ran.place.pane.tab == "changes"
    card = ran.controller.changes
    assert card.version.itemText(0) == "The file, without the edits"
    assert "2 sessions, 1 pilot" in card.version.currentText()
    assert lines(ran) == ['-title = "A first look"', '+title = "Hello"']
    click(qtbot, card.restore)
    assert ran.text == before
    assert card.note.text() == "The study does not differ from this version."
    assert not card.restore.isEnabled()
    assert "Restore 1.0: 2 sessions" in ran.place.header.undo.accessibleName()
    ran.editing.undo()
    qtbot.waitUntil(lambda: len(lines(ran)) == 2)


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
    designer.editing.ask(SetValue(REPETITIONS, 3))
    designer.place.show_tab("changes")
    changes = designer.controller.changes
    assert changes.version.itemText(0) == "The file, without the edits"
    assert changes.chosen == protocol_hash(source)


def test_of_a_version_without_a_copy_the_receipt_says_what_differs(ran: Any, qtbot: Any) -> None:
    source = (
        ran.file.read_bytes()
        .replace(b'version = "1.0"', b'version = "0.9"')
        .replace(b"delay_ms = 200", b"delay_ms = 300")
    )
    run(ran, "P009", source, started_at="2026-11-18T12:00:00+00:00")
    ran.controller.enter()
    qtbot.waitUntil(lambda: len(ran.controller.runs.known) == 2)
    ran.controller.changes.compare_with(protocol_hash(source))
    card = ran.controller.changes
    assert "No copy of this version is kept" in card.note.text()
    assert card.difference.toPlainText() == 'study.version: "0.9" before, "1.0" now'
    assert not card.restore.isEnabled()


def test_the_version_of_a_session_in_results_leads_to_what_changed(
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
    assert visit.results_controller is not None
    card = visit.results_controller.place.sessions
    facts = SessionFacts(
        "P001", 1, "kitchen", datetime.now().astimezone(), "completed", "valid", 8, 8, False, False, folder
    )
    card.show_sessions([facts, replace(facts, participant="P002", folder=folder.parent)])
    table = card.rows.table
    words = [[str(table.model().index(row, column).data()) for column in range(4)] for row in range(2)]
    assert [row[3] for row in words] == ["1.0", ""]
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
    assert changes.version.currentText().startswith("1.0: 1 session")
    assert visit.designer.place.pane.tab == "changes"
    visit.window.close()
    visit.end()
    visit.window.deleteLater()
    designer.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
