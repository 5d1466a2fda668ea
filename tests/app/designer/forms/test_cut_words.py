"""Words that would be cut in a window of 1366 × 768: they get room, or go below."""

from typing import Any

import pytest
from PySide6.QtWidgets import QApplication

from study_app.authoring.edited_study import Study
from study_app.authoring.new_study import template
from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.form_head import FormHead
from study_app.gui.designer.form.row_widget import RowWidget
from study_app.gui.designer.measures.parts import LinesPart
from study_app.gui.designer.study_list import StudyList
from study_app.viewmodels.designer.designer_view import StudyChoice
from study_app.viewmodels.designer.form.form_rows import Entry, form
from study_app.viewmodels.designer.measures.session_cards import LinesCard

FORM_PX = 505
"""The width of a form within its card, in a window that is 1366 wide [px]."""


@pytest.fixture
def study() -> Study:
    return template("questionnaire-only")


def shown(qtbot: Any, part: Any, width: int) -> Any:
    """Show a part in a width."""
    qtbot.addWidget(part)
    part.setFixedWidth(width)
    part.show()
    QApplication.processEvents()
    return part


def test_the_kind_of_a_question_takes_one_line(qtbot: Any, study: Study) -> None:
    questions = ("questionnaires", "about_you", "items")
    at = next(at for at, one in enumerate(study.document["questionnaires"]["about_you"]["items"]) if "kind" in one)
    kind = next(row for row in form(study, (*questions, at)).rows if row.row.kind == "kind")
    row = shown(qtbot, RowWidget(kind), FORM_PX - 20)
    assert row.remove.geometry().left() > row.field.geometry().right()
    assert row.remove.y() == row.field.y()
    assert row.field.all.isVisible(), "all kinds are seen"
    assert not row.words.isVisible()


def test_what_followed_a_rename_is_whole_beside_the_buttons(qtbot: Any, study: Study) -> None:
    head = FormHead()
    head.show_form(form(study, ("blocks", next(iter(study.document["blocks"])))), read_only=False)
    shown(qtbot, head, FORM_PX)
    words = "8 places updated"
    head.show_followed(words)
    QApplication.processEvents()
    assert head.followed.text() == words
    head.show_followed("")
    assert head.kind.isVisible()


def test_words_beside_the_title_of_a_card_go_below_where_there_is_no_room(qtbot: Any) -> None:
    words = "at 0.1 m/s, limit 1.58 N"
    part = shown(qtbot, LinesPart(LinesCard("Force of each liquid", words, ())), 400)
    assert part.aside.geometry().right() > part.heading.geometry().right()
    part.setFixedWidth(240)
    QApplication.processEvents()
    assert part.aside.y() > part.heading.y()
    assert part.aside.text() == words
    part.setFixedWidth(400)
    QApplication.processEvents()
    assert part.aside.geometry().bottom() <= part.heading.geometry().bottom() + 2


def test_a_short_note_leaves_the_room_to_the_title_of_an_entry(qtbot: Any) -> None:
    row = shown(qtbot, EntryRow(Entry((), "Comfortable", "4"), "", grip=True), 150)
    assert row.title.text() == "Comfortable"


def test_the_title_of_a_study_gets_the_room_that_its_file_has_not(qtbot: Any) -> None:
    studies = StudyList()
    qtbot.addWidget(studies)
    study = StudyChoice("A first look", "first_look.toml", "first_look")
    studies.add_study(study, opened=True)
    room = studies.fontMetrics().horizontalAdvance(study.words)
    assert studies.fitted(study.words, room + 10) == study.words
    assert studies.fitted(study.words, room - 10) == study.title
    assert studies.fitted(study.words, 30).endswith("…")
