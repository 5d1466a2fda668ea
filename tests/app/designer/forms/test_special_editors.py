"""Special editors in the window: what they show, and that they ask for the same steps as the editors they replace."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QGuiApplication, QMouseEvent
from PySide6.QtWidgets import QApplication, QBoxLayout, QWidget

from study_app.authoring.fields import rows
from study_app.gui.designer.form.special import EDITORS
from study_app.gui.widgets.controls import IconButton
from study_app.haptics.model.steady_state import steady
from study_app.protocol.load import load
from study_app.protocol.source.json_schema import schema
from study_app.viewmodels.designer.requests import SetValue
from study_app.viewmodels.designer.special import FACTS
from tests.authoring.grown import PROTOCOLS
from tests.authoring.test_fields import every_row

pytestmark = pytest.mark.slow

QUESTIONNAIRE = ("questionnaires", "liquid")
ITEMS = (*QUESTIONNAIRE, "items")


def test_every_special_editor_is_for_a_key_of_a_model() -> None:
    keys = {(row.model, str(row.path[-1])) for row in (*every_row({}), *rows({}, ()))}
    assert set(EDITORS) <= keys, set(EDITORS) - keys
    assert set(FACTS) <= set(EDITORS)
    assert {node["title"] for node in schema()["$defs"].values()} >= {model for model, _ in EDITORS}


def press(qtbot: Any, part: QWidget) -> None:
    qtbot.mouseClick(part, Qt.MouseButton.LeftButton)


def test_conditions_say_liquid_delay_and_force(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "blocks", "delays")
    protocol = load(designer.file)
    late = designer.field("blocks", "delays", "conditions").rows[1]
    assert late.note.text() == "Thin, 200 ms late"
    assert late.force.text() == f"{steady(protocol.scene_for('late')).force_n:.2f} N"
    field = designer.field("blocks", "delays", "conditions")
    designer.change(("density_kg_m3 = 1000", "density_kg_m3 = 1300"))
    designer.controller.enter()
    assert field.rows[1].force.text() == f"{steady(load(designer.file).scene_for('late')).force_n:.2f} N"
    press(qtbot, field.rows[1].liquid)
    assert designer.place.view.form.path == ("liquids", "thin")


def test_an_order_states_with_how_many_it_is_balanced(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    for order, words in (
        ("shuffled", "balanced on average"),
        ("fixed", "same for all"),
        ("williams", "balanced at 2, 4, 6 …"),
        ("latin", "balanced at 2, 4, 6 …"),
    ):
        designer.editing.ask(SetValue(("blocks", "liquids", "order"), order))
        chip = designer.field("blocks", "liquids", "order").chip
        assert chip.isVisible()
        assert chip.word == words
    field = designer.field("blocks", "liquids", "order")
    for width, below in ((400, False), (150, True)):
        field.resize(width, field.height())
        assert (field.box.direction() == QBoxLayout.Direction.TopToBottom) == below


def two_languages(designer: Any) -> None:
    text = designer.file.read_text().replace('languages = ["en"]', 'languages = ["en", "nl"]')
    designer.file.write_text(
        text.replace('text = "This liquid behaves like honey."', 'text = { en = "Like honey.", nl = "Als honing." }')
    )
    designer.open()


def test_questions_stand_side_by_side_and_a_missing_text_is_written(qtbot: Any, designer: Any) -> None:
    two_languages(designer)
    designer.editing.select(QUESTIONNAIRE)
    first, second = designer.field(*ITEMS).rows.rows
    assert first.write is not None
    assert second.write is None
    assert second.line.texts == ("Like honey.", "Als honing.")
    press(qtbot, first.write)
    assert designer.place.view.form.path == (*ITEMS, 0)
    english, dutch = designer.field(*ITEMS, 0, "text").lines.values()
    assert dutch.hasFocus()
    qtbot.keyClicks(dutch, "Dit voelt vloeibaar.")
    qtbot.keyClick(dutch, Qt.Key.Key_Return)
    item = designer.value("questionnaires", "liquid", "items", 0)
    assert item["text"]["nl"] == "Dit voelt vloeibaar."
    assert item["text"]["en"] == english.words() != ""
    assert [row.line.number for row in designer.place.form.others] == [2]
    press(qtbot, designer.place.form.others[0])
    assert designer.place.view.form.path == (*ITEMS, 1)


@pytest.mark.parametrize("width", [1600, 1024])
def test_the_kind_of_a_question_is_chosen_and_its_texts_stay(designer: Any, width: int) -> None:
    designer.window.resize(width, 1000)
    designer.open("kitchen", *ITEMS, 0)
    QApplication.processEvents()
    field = designer.field(*ITEMS, 0, "kind")
    assert field.all.isVisible() != field.list.isVisible()
    if field.all.isVisible():
        next(button for button in field.all.buttons if button.text() == "Slider").click()
    else:
        field.list.activated.emit(field.list.findText("Slider"))
    item = designer.value("questionnaires", "liquid", "items", 0)
    assert item["kind"] == "slider"
    assert item["short"] == "Feels like a liquid"


def test_a_target_is_dragged_moved_by_keys_and_typed(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "tasks", "reach")
    before = designer.text
    field = designer.field("tasks", "reach", "targets_mm")

    def targets() -> Any:
        return designer.value("tasks", "reach", "targets_mm")

    QApplication.processEvents()
    view = field.front
    start, end = (view.place(point).toPoint() for point in ((30.0, 0.0, 0.0), (20.0, 12.0, 0.0)))
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=start)
    for share in (0.3, 0.6, 1.0):
        QApplication.sendEvent(view, _drag(view, start + (end - start) * share))
    assert targets() == ((-30, 0, 0), (30, 0, 0))
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=end)
    x, y, z = targets()[1]
    assert (x, z) == (pytest.approx(20, abs=1), 0)
    assert y == pytest.approx(12, abs=1)
    assert len(designer.steps) == 1
    field.above.setFocus()
    qtbot.keyClick(field.above, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    assert targets()[1] == (x, y, 5)
    for _ in range(20):
        qtbot.keyClick(field.above, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    assert targets()[1] == (x, y, 24)
    assert designer.study.faults == ()
    qtbot.keyClick(field.above, Qt.Key.Key_PageDown)
    assert "target 1 of 2" in field.above.accessibleDescription()
    line = field.lines[0][1]
    designer.fill(line, "-7.5")
    assert targets()[0] == (-30, -7.5, 0)
    assert designer.undo_all() == before


def _drag(view: QWidget, at: QPoint) -> QMouseEvent:
    return QMouseEvent(
        QEvent.Type.MouseMove, QPointF(at), QPointF(view.mapToGlobal(at)), Qt.MouseButton.NoButton,
        Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
    )  # fmt: skip


def test_points_of_a_scale_are_written_added_and_removed_in_every_language(qtbot: Any, designer: Any) -> None:
    text = (PROTOCOLS / "rek2024.toml").read_text().replace('name = "rek2024"', 'name = "kitchen"')
    designer.file.write_text(text)
    designer.open("kitchen", "scales", "agreement")

    def labels() -> Any:
        return designer.value("scales", "agreement", "labels")

    def field() -> Any:
        return designer.field("scales", "agreement", "labels")

    first = labels()
    line = field().lines[6][1]
    designer.fill(line, "Eens")
    assert labels()["nl"] == (*first["nl"][:6], "Eens")
    press(qtbot, field().add)
    assert [len(words) for words in labels().values()] == [8, 8]
    designer.editing.undo()
    assert [len(words) for words in labels().values()] == [7, 7]
    designer.editing.redo()
    away = [part for part in field().findChildren(IconButton) if part.accessibleName() == "Remove point 8"]
    press(qtbot, away[0])
    designer.editing.undo()
    designer.editing.undo()
    designer.editing.undo()
    assert designer.text == text


def test_a_question_without_an_id_says_so_at_its_id_and_gets_one(qtbot: Any, designer: Any) -> None:
    designer.change(('id = "like_honey"\n', ""))
    designer.open("kitchen", *ITEMS, 1)
    head = designer.place.form.head
    assert head.refusal.isVisible()
    assert "Is missing" in head.refusal.text()
    qtbot.keyClicks(head.id, "honey")
    qtbot.keyClick(head.id, Qt.Key.Key_Return)
    assert designer.value("questionnaires", "liquid", "items", 1, "id") == "honey"
    assert not designer.place.form.head.refusal.isVisible()


def test_the_keyboard_stays_in_a_row_that_is_made_anew(qtbot: Any, designer: Any, editors: None) -> None:
    designer.open("kitchen", "blocks", "liquids")
    path = ("blocks", "liquids", "conditions")
    before = designer.form_row(*path)
    count = len(before.field.rows)
    press(qtbot, next(one for one in before.field.rows[0].findChildren(IconButton) if "Remove" in one.accessibleName()))
    after = designer.form_row(*path)
    assert after is not before
    assert len(after.field.rows) == count - 1
    assert after.isAncestorOf(designer.keyboard)


def test_a_question_is_shown_whole_and_typed_as_one_paragraph(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", *ITEMS, 0)
    before = designer.text
    (line,) = designer.field(*ITEMS, 0, "text").lines.values()
    low = line.height()
    line.setFocus()
    line.selectAll()
    QGuiApplication.clipboard().setText(
        "Would you say\nthat this liquid\nbehaves as a liquid does " + 3 * "which you know "
    )
    qtbot.keyClick(line, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert designer.text == before
    qtbot.keyClick(line, Qt.Key.Key_Return)
    assert "\n" not in line.words()
    assert designer.value("questionnaires", "liquid", "items", 0, "text") == line.words()
    qtbot.waitUntil(lambda: line.height() > low)
    assert line.verticalScrollBar().maximum() == 0
    line.selectAll()
    qtbot.keyClick(line, Qt.Key.Key_X)
    qtbot.keyClick(line, Qt.Key.Key_Escape)
    assert designer.text != before
    designer.editing.undo()
    assert designer.text == before
