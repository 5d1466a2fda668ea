"""What one sees first: no study, a study that is read-only, the study's own form, and what a deletion takes away."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QApplication, QLabel

from study_app.authoring.kept_settings import kept_original
from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow

CONTROL, KEY = Qt.KeyboardModifier.ControlModifier, Qt.Key


def test_tab_goes_first_to_a_new_study_where_none_is_open(qtbot: Any, designer: Any) -> None:
    place = designer.place
    place.setFocus()
    place.focusNextChild()
    assert place.nothing.new.hasFocus()
    qtbot.keyClick(place.nothing.new, KEY.Key_Tab)
    assert place.header.study.hasFocus()


@pytest.mark.parametrize("opened", [False, True])
def test_ctrl_n_begins_a_study_anywhere_and_keeps_what_is_typed_for_one(
    qtbot: Any, designer: Any, opened: bool
) -> None:
    if opened:
        designer.controller.open("kitchen")
        designer.place.parts.focus_outline()
    for _ in range(2):
        qtbot.keyClick(QApplication.focusWidget() or designer.window, KEY.Key_N, CONTROL)
        assert designer.place.stack.currentWidget() is designer.place.new_page
        title = designer.place.new_page.card.questions.title
        assert title.hasFocus()
        qtbot.keyClicks(title, "a")
    assert title.text() == "aa"


def test_fields_of_a_read_only_study_have_a_muted_ground(qtbot: Any, designer: Any) -> None:
    def ground(widget: Any) -> str:
        return str(widget.grab().toImage().pixelColor(widget.width() // 2, 4).name())

    place = designer.place
    designer.controller.open("rek2024")
    designer.select(("blocks", "liquids"))
    title = designer.row("blocks", "liquids", "title").field.lines["en"]
    muted = QColor(place.theme.sunk).name()
    assert {ground(title), ground(place.form.head.id)} == {muted}
    switches = [row.keys for row in place.form.rows if row.keys is not None]
    assert switches
    assert not any(one.isEnabled() for one in switches)
    (copy,) = place.banner.buttons
    assert copy.property("role") == "primary"
    assert ground(place.banner) == QColor(place.theme.selected).name()
    designer.controller.begin("rek2024", "mine")
    designer.select(("blocks", "liquids"))
    assert ground(designer.row("blocks", "liquids", "title").field.lines["en"]) == QColor(place.theme.surface).name()


def test_the_fields_of_a_copy_can_be_edited_at_once(designer: Any) -> None:
    title = ("pages", "welcome", "title")
    designer.controller.open("demo")
    designer.select(title[:2])
    assert not designer.row(*title).field.isEnabled()
    designer.controller.begin("demo", "mine")
    designer.select(title[:2])
    assert designer.row(*title).field.isEnabled()
    assert kept_original(designer.editing.opened.file) == "demo"


def test_the_description_grows_to_three_lines(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("study",))
    line = designer.row("study", "description").field.line
    heights = []
    for words in (1, 16, 40, 400):
        designer.editing.ask(SetValue(("study", "description"), " ".join(["liquid"] * words)))
        QApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest)
        QApplication.processEvents()
        heights.append(line.height())
    assert heights[0] < heights[1] < heights[2] == heights[3]
    line.selectAll()
    qtbot.keyClicks(line, "Short")
    qtbot.keyClick(line, KEY.Key_Return)
    assert designer.editing.opened.study.document["study"]["description"] == "Short"


def test_a_deletion_says_what_else_it_deletes_right_above_the_buttons(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    designer.controller.ask_to_delete(("liquids", "water"))
    QApplication.processEvents()
    shown = designer.place.prompt
    (also,) = [one for one in shown.findChildren(QLabel) if one.text().startswith("Also deletes: Block Delay effect")]
    places = [one for one in shown.findChildren(QLabel) if one.text().startswith("Condition Delay 200:")]
    bottom = places[-1].mapTo(shown, places[-1].rect().bottomLeft()).y()
    assert also.geometry().top() - bottom < 20
    assert shown.all.geometry().top() - also.geometry().bottom() < 20
