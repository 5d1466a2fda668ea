"""Clicks that follow typing, the list of studies, and what one sees first."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton
from shiboken6 import isValid

from study_app.authoring.kept_settings import begin_settings, kept_original
from study_app.gui.designer.measures.parts import Strip
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.designer.study_list import cut_title
from study_app.protocol.source.files import shipped
from study_app.viewmodels.designer.requests import SetText, SetValue

pytestmark = pytest.mark.slow

LEFT = Qt.MouseButton.LeftButton


def type_id(qtbot: Any, designer: Any, path: tuple[str, str], name: str) -> None:
    """Select an element and type another id, without leaving the field."""
    designer.editing.select(path)
    field = designer.place.form.head.id
    qtbot.mouseClick(field, LEFT)
    field.selectAll()
    qtbot.keyClicks(field, name)


def test_a_list_that_is_clicked_after_an_id_was_typed_stays_open(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("conditions", "thick"), "honey")
    liquids = designer.row("conditions", "thick", "liquid").field.list
    qtbot.mouseClick(liquids, LEFT)
    qtbot.wait(100)
    assert isValid(liquids)
    assert liquids.view().isVisible()
    assert "[conditions.thick]" in designer.text
    liquids.hidePopup()
    qtbot.waitUntil(lambda: "[conditions.honey]" in designer.text)
    assert designer.place.view.form.path == ("conditions", "honey")


def test_a_click_on_a_block_in_the_drawer_closes_it(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.window.resize(1366, 768)
    outline, tree = designer.place.outline, designer.place.outline.tree
    for path, closes in ((("blocks", "liquids"), True), (("conditions",), False)):
        designer.place.parts.focus_outline()
        QApplication.processEvents()
        index = next(one for one in outline.indexes() if one.data(ROW_ROLE).path == path)
        tree.scrollTo(index)
        qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualRect(index).center())
        assert designer.place.view.form.path == path
        assert outline.isVisible() is not closes


def test_arrow_keys_walk_the_whole_outline_of_the_empty_study(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:empty", "walked")
    tree = designer.place.outline.tree
    qtbot.keyClick(designer.window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    seen = []
    for _ in range(60):
        qtbot.keyClick(tree, Qt.Key.Key_Down)
        if tree.currentIndex().data(ROW_ROLE).path:
            assert designer.editing.selected == tree.currentIndex().data(ROW_ROLE).path
            assert designer.place.form.form.path == designer.editing.selected
        seen.append(designer.editing.selected)
    assert {("questionnaires",), ("groups",), ("scene",), ("limits",), ("analysis",)} <= set(seen)
    designer.editing.select(("limits",))
    designer.editing.ask(SetValue(("limits", "lateness_ms"), 3))
    assert designer.editing.opened.study.document["limits"] == {"lateness_ms": 3}


def test_arrow_keys_walk_the_outline_after_a_number_was_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.window.resize(1366, 768)
    designer.editing.select(("conditions", "thick"))
    (delay,) = designer.row("conditions", "thick", "delay_ms").findChildren(QLineEdit)
    qtbot.mouseClick(delay, LEFT)
    qtbot.keyClicks(delay, "5")
    qtbot.keyClick(delay, Qt.Key.Key_Return)
    text = designer.text
    qtbot.keyClick(designer.window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    for _ in range(4):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Up)
        QApplication.processEvents()
        assert designer.place.outline.tree.hasFocus()
    assert designer.text == text


def test_a_field_that_is_clicked_after_an_id_was_typed_keeps_the_keyboard(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("liquids", "thick"), "honey")
    (density,) = designer.row("liquids", "thick", "density_kg_m3").findChildren(QLineEdit)
    qtbot.mouseClick(density, LEFT)
    qtbot.waitUntil(lambda: "[liquids.honey]" in designer.text)
    field = QApplication.focusWidget()
    assert designer.row("liquids", "honey", "density_kg_m3").isAncestorOf(field)
    field.selectAll()
    qtbot.keyClicks(field, "1402")
    qtbot.waitUntil(lambda: "1402" in designer.text)


def test_a_field_that_is_clicked_thrice_after_an_id_was_typed_takes_what_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("liquids", "thick"), "honey")
    (density,) = designer.row("liquids", "thick", "density_kg_m3").findChildren(QLineEdit)
    at = density.mapTo(designer.window, density.rect().center())
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    qtbot.waitUntil(lambda: "[liquids.honey]" in designer.text)
    QTest.mouseDClick(designer.window.windowHandle(), LEFT, pos=at)
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    assert QApplication.focusWidget() is density, "the form was made anew under the click"
    assert density.selectedText() == density.text()
    qtbot.keyClicks(density, "1402")
    qtbot.waitUntil(lambda: "density_kg_m3 = 1402" in designer.text)
    qtbot.mouseClick(next(one for one in designer.place.form.adds.values() if one.isVisible()), LEFT)
    assert designer.editing.opened.study.document["liquids"]["honey"]["density_kg_m3"] == 1402
    assert "thick" not in designer.editing.opened.study.document["liquids"]


def test_a_difference_that_is_reverted_outlives_the_click(qtbot: Any, designer: Any) -> None:
    """Qt still handles the click on its button; content that a scroll area drops is deleted at once."""
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("blocks", "liquids", "repetitions"), 3))
    designer.place.show_tab("changes")
    shown = designer.controller.changes.card.list
    qtbot.waitUntil(lambda: bool(shown.lines))
    gone: list[bool] = []
    after: list[int] = []
    button = shown.lines[0].revert
    button.destroyed.connect(lambda: gone.append(True))
    shown.revert_asked.connect(lambda _row: after.append(len(gone)))
    qtbot.mouseClick(button, LEFT)
    assert shown.lines == []
    assert after == [0]
    qtbot.waitUntil(lambda: gone == [True])


def test_the_arrow_of_an_entry_opens_what_it_names(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("blocks", "liquids"))
    field = designer.row("blocks", "liquids", "conditions").field
    words = f"Open {field.row.entries[1].title}"
    (arrow,) = (one for one in field.rows[1].findChildren(QPushButton) if one.accessibleName() == words)
    qtbot.mouseClick(arrow, LEFT)
    assert designer.editing.selected == ("conditions", field.row.row.value[1])


@pytest.mark.parametrize("way", ["Enter", "double click"])
def test_an_entry_opens_by_enter_and_a_double_click(qtbot: Any, designer: Any, way: str) -> None:
    designer.controller.open("kitchen")
    designer.select(("blocks", "liquids"))
    field = designer.row("blocks", "liquids", "conditions").field
    qtbot.mouseClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("blocks", "liquids")
    if way == "Enter":
        qtbot.keyClick(field.rows[1], Qt.Key.Key_Return)
    else:
        qtbot.mouseDClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("conditions", field.row.row.value[1])


def test_a_row_of_a_section_opens_by_a_click(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("liquids",))
    qtbot.mouseClick(designer.row("liquids").field.rows[1], LEFT)
    assert designer.editing.selected == ("liquids", "thick")


def test_a_step_of_the_session_bar_opens_by_the_left_button_alone(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    strip, asked = Strip(), list[object]()
    strip.resize(100, 14)
    strip.show_segments((("Welcome", 1.0, False, ("pages", "welcome")),))
    strip.open_asked.connect(asked.append)
    qtbot.mouseClick(strip, Qt.MouseButton.RightButton)
    assert asked == []
    qtbot.mouseClick(strip, LEFT)
    assert asked == [("pages", "welcome")]


def test_the_question_before_a_delete_says_what_goes(designer: Any) -> None:
    designer.controller.begin("template:compare-liquids", "liquids")
    designer.select(("liquids", "syrup"))
    designer.place.form.head.delete.click()
    said = [one.text() for one in designer.place.prompt.findChildren(QLabel)]
    assert "Condition Practice: Liquid" in said
    assert "Also deletes: Block Practice, Condition Practice." in said
    designer.place.prompt.all.click()
    assert "practice" not in designer.editing.opened.study.document["blocks"]
    assert not designer.editing.opened.study.faults


def test_the_question_before_a_delete_names_elements_and_no_places_of_lists(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("liquids", "thick"))
    designer.place.form.head.delete.click()
    said = [one.text() for one in designer.place.prompt.findChildren(QLabel)]
    (besides,) = (words for words in said if words.startswith("Also deletes"))
    assert besides == "Also deletes: Condition Thick."


def listed(designer: Any) -> list[str]:
    box = designer.place.header.study
    return [box.itemText(at) for at in range(box.count())]


def add_study(designer: Any, name: str, title: str) -> None:
    text = designer.file.read_text()
    before = next(line for line in text.splitlines() if line.startswith("title = "))
    made = text.replace('name = "kitchen"', f'name = "{name}"').replace(before, f'title = "{title}"', 1)
    (designer.file.parent / f"{name}.toml").write_text(made)


def test_studies_are_listed_by_title_with_their_files_whatever_was_opened_last(designer: Any) -> None:
    for name, title in (("zeta", "apples"), ("beta", "Melons"), ("alpha", "Melons")):
        add_study(designer, name, title)
    begin_settings(designer.file.with_name("beta.toml"), "alpha")
    designer.controller.open("kitchen")
    own = [words for words in listed(designer) if "(shipped)" not in words][:-2]
    assert own[:2] == ["A first look  ·  kitchen.toml", "apples  ·  zeta.toml"]
    assert [words for words in own if words.startswith("Melons")] == [
        "Melons  ·  alpha.toml",
        "Melons  ·  beta.toml  (copy of alpha)",
    ]
    assert own == sorted(own, key=str.casefold)
    shipped_ones = [words for words in listed(designer) if "(shipped)" in words]
    assert len(shipped_ones) == len(shipped())
    assert listed(designer)[len(own) : len(own) + len(shipped_ones)] == sorted(shipped_ones, key=str.casefold)
    before = listed(designer)
    designer.controller.open("beta")
    designer.place.save_asked.emit()
    designer.controller.enter()
    assert listed(designer) == before
    box = designer.place.header.study
    assert box.currentText() == "Melons  ·  beta.toml  (copy of alpha)"
    assert (
        box.itemData(box.currentIndex(), Qt.ItemDataRole.AccessibleTextRole)
        == "Melons  ·  beta.toml  (copy of alpha), open"
    )


def test_the_field_shows_the_file_of_a_study_whose_title_another_one_has(designer: Any) -> None:
    for name in ("beta", "alpha"):
        add_study(designer, name, "Which of two liquids is the thicker one?")
    add_study(designer, "zeta", "Which of two liquids is the warmer one?")
    begin_settings(designer.file.with_name("beta.toml"), "alpha")
    box = designer.place.header.study
    for name in ("alpha", "beta"):
        designer.controller.open(name)
        shown = box.fitted(box.currentText(), 240)
        assert shown.startswith("Which of")
        assert shown.endswith(f"…  ·  {name}.toml")
        assert box.fontMetrics().horizontalAdvance(shown) <= 240
    designer.controller.open("zeta")
    assert box.fitted(box.currentText(), 240).endswith("…")


def test_the_list_cuts_a_long_title_and_not_the_file(qtbot: Any, designer: Any) -> None:
    add_study(designer, "alpha", "Which of two liquids is the thicker one? " * 9)
    designer.controller.open("alpha")
    box = designer.place.header.study
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Down)
    assert box.view().width() < designer.window.width()
    words, length = box.currentText(), len(designer.editing.opened.title)
    cut = cut_title(words, length, box.fontMetrics(), 600)
    assert cut.endswith("…")
    assert box.fontMetrics().horizontalAdvance(cut + words[length:]) <= 600
    assert cut_title("Melons  ·  a.toml", 6, box.fontMetrics(), 600) == "Melons"


def test_the_list_shows_a_title_as_it_is_edited(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(SetText(("study", "title"), "en", "Zest"))
    assert designer.place.header.study.currentText() == "Zest  ·  kitchen.toml"
    designer.editing.undo()
    assert not designer.place.header.study.currentText().startswith("Zest")


def test_a_file_that_cannot_be_read_is_listed_by_its_name(designer: Any) -> None:
    (designer.file.parent / "odd.toml").write_text("this is not TOML")
    designer.controller.open("kitchen")
    assert "odd  ·  odd.toml" in listed(designer)


def test_keys_open_the_list_and_no_other_study(qtbot: Any, designer: Any) -> None:
    add_study(designer, "zeta", "Zebra")
    designer.controller.open("kitchen")
    box, opened = designer.place.header.study, designer.editing.opened
    qtbot.keyClick(box, Qt.Key.Key_Escape)
    assert not box.view().isVisible()
    altgr = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    QApplication.sendEvent(box, QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Z, altgr, "z"))
    assert designer.editing.opened is opened
    qtbot.keyClick(box, Qt.Key.Key_Home, Qt.KeyboardModifier.ControlModifier)
    assert designer.editing.opened is opened
    moves = (Qt.Key.Key_Home, Qt.Key.Key_End, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Up, Qt.Key.Key_Down)
    for key in (*moves, Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_F4, Qt.Key.Key_Z):
        box.setFocus()
        qtbot.keyClick(box, key)
        assert box.view().isVisible(), key
        assert designer.editing.opened is opened
        if key != Qt.Key.Key_Z:
            box.hidePopup()
    assert box.view().currentIndex().data() == "Zebra  ·  zeta.toml"
    qtbot.keyClick(box.view(), Qt.Key.Key_Return)
    QApplication.processEvents()
    assert designer.editing.opened.name == "zeta"


def test_the_first_line_is_marked_where_no_study_is_open(qtbot: Any, designer: Any) -> None:
    box = designer.place.header.study
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Down)
    assert [index.row() for index in box.view().selectedIndexes()] == [0]
    qtbot.keyClick(box.view(), Qt.Key.Key_Return)
    QApplication.processEvents()
    assert designer.editing.opened.name == "kitchen"


def test_another_study_has_the_keyboard_at_its_selected_element(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.place.header.play.setFocus()
    designer.controller.open("rek2024")
    assert designer.place.outline.tree.hasFocus(), "not at a button that would start a session"


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
