"""The tab Changes: what differs from a version that was run, and single differences taken back."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from study_app.app.main_controller import MainController
from study_app.protocol.source.files import protocol_hash
from study_app.viewmodels.designer.requests import SetText, SetValue
from study_app.viewmodels.sessions import SessionFacts
from tests.app.designer.conftest import Designer
from tests.app.designer.versions.conftest import REPETITIONS, click, rows, run

pytestmark = pytest.mark.slow


def test_changes_lists_what_differs_and_reverts_single_differences(ran: Any, qtbot: Any) -> None:
    before = ran.text
    ran.editing.ask(SetValue(REPETITIONS, 3))
    ran.editing.ask(SetText(("pages", "welcome", "title"), "en", "Hello"))
    click(qtbot, ran.place.header.version)
    assert ran.place.pane.tab == "changes"
    card = ran.controller.changes.card
    assert card.view.versions[0].words == "The file, without the edits"
    assert "2 sessions, 1 pilot" in card.version.currentText()
    assert rows(ran) == [
        "blocks.liquids.repetitions: 1 before, 3 now", 'pages.welcome.title: "A first look" before, "Hello" now'
    ]  # fmt: skip
    click(qtbot, card.list.lines[1].go)
    assert ran.place.view.form.path == ("pages", "welcome")
    click(qtbot, card.list.lines[0].revert)
    assert rows(ran) == ['pages.welcome.title: "A first look" before, "Hello" now']
    assert "Revert Liquids, Repetitions" in ran.place.header.undo.accessibleName()
    click(qtbot, card.how.buttons[1])
    assert card.sides.place.text() == "1 of 1"
    click(qtbot, card.sides.revert)
    assert ran.text == before
    assert card.view.note == "The study does not differ from this version."
    ran.editing.undo()
    ran.editing.undo()
    qtbot.waitUntil(lambda: len(rows(ran)) == 2)


@pytest.mark.parametrize(("kind", "key"), [("pilot", "pilot"), ("rehearsal", "simulated")])
def test_changes_begin_with_the_last_session_where_no_participant_was_run(
    designer: Any, qtbot: Any, kind: str, key: str
) -> None:
    source = designer.file.read_bytes()
    early = source.replace(b"max_s = 30 ", b"max_s = 40 ")
    assert early != source
    run(designer, "P001", source, study=f"kitchen-{kind}-1", **{key: True})
    run(designer, "P001", early, study=f"kitchen-{kind}-2", started_at="2026-11-19T12:00:00+00:00", **{key: True})
    designer.controller.open("kitchen")
    qtbot.waitUntil(lambda: bool(designer.controller.runs.known))
    designer.editing.ask(SetValue(REPETITIONS, 3))
    designer.place.show_tab("changes")
    view = designer.controller.changes.card.view
    assert view.versions[0].words == "The file, without the edits"
    assert view.chosen == protocol_hash(source)


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
    card = ran.controller.changes.card
    assert "No copy of this version is kept" in card.note.text()
    assert rows(ran) == [
        "conditions: may differ, no copy of this version is kept", 'study.version: "0.9" before, "1.0" now'
    ]  # fmt: skip
    assert not card.how.isVisible()
    assert all(line.revert is None for line in card.list.lines)


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
    both = visit.lab_and_designer
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
    qtbot.waitUntil(lambda: both.designer is not None and both.designer.place.isVisible(), timeout=20_000)
    assert both.designer is not None
    changes = both.designer.changes.card
    assert changes.view.chosen == protocol_hash(source)
    assert changes.version.currentText().startswith("1.0: 1 session")
    assert both.designer.place.pane.tab == "changes"
    visit.window.close()
    visit.end()
    visit.window.deleteLater()
    designer.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
