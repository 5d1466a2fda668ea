"""The outline and the lists in their window: dragged, clicked, several at once, by keys and by the menu."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDropEvent, QGuiApplication, QKeyEvent, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from shiboken6 import isValid

from study_app.designer.document.steps import AddInstrument, MoveTo, SetValue
from study_app.designer.outline import ROW_ROLE
from study_app.protocol.source.files import shipped
from study_app.store.study_settings import begin_settings

pytestmark = pytest.mark.slow


CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LEFT = Qt.MouseButton.LeftButton


def place_of(designer: Any, *path: str | int) -> QPoint:
    """Return the middle of an element's first row."""
    outline = designer.place.outline
    index = next(one for one in outline.indexes() if one.data(ROW_ROLE).path == path)
    outline.tree.scrollTo(index)
    return outline.tree.visualRect(index).center()


def click(qtbot: Any, designer: Any, *path: str | int, held: Any = Qt.KeyboardModifier.NoModifier) -> None:
    qtbot.mouseClick(designer.place.outline.tree.viewport(), LEFT, held, place_of(designer, *path))


def drag(qtbot: Any, designer: Any, start: QPoint, end: QPoint, *, drop: bool = True) -> None:
    view = designer.place.outline.tree.viewport()
    qtbot.mousePress(view, LEFT, pos=start)
    for at in (start + QPoint(0, 20), end):
        event_move(view, at)
    if drop:
        qtbot.mouseRelease(view, LEFT, pos=end)


def event_move(view: Any, at: QPoint) -> None:
    none = Qt.KeyboardModifier.NoModifier
    event = QMouseEvent(QEvent.Type.MouseMove, QPointF(at), QPointF(view.mapToGlobal(at)), LEFT, LEFT, none)
    QApplication.sendEvent(view, event)


def sequence(designer: Any) -> tuple[str, ...]:
    return tuple(designer.value("sequence"))


def test_a_row_is_dragged_to_where_the_line_is_and_esc_cancels(qtbot: Any, designer: Any) -> None:
    designer.open()
    before, text = sequence(designer), designer.text
    tree = designer.place.outline.tree
    first, third = (
        place_of(designer, designer_path, name) for designer_path, name in (_thing(designer, 0), _thing(designer, 2))
    )
    drag(qtbot, designer, first, third + QPoint(0, 14), drop=False)
    assert tree.target is not None
    assert tree.target[0] == ("sequence", 3)
    qtbot.keyClick(tree, Qt.Key.Key_Escape)
    qtbot.mouseRelease(tree.viewport(), LEFT, pos=third)
    assert designer.text == text
    drag(qtbot, designer, first, third + QPoint(0, 14))
    assert sequence(designer) == (*before[1:3], before[0], *before[3:])
    designer.editing.undo()
    assert designer.text == text


TLX = ("questionnaires", "nasa_tlx")


@pytest.fixture
def with_form(designer: Any) -> Any:
    """The study with a standard questionnaire that no step asks."""
    designer.change(("format = 1", "format = 2"))
    designer.open()
    designer.editing.ask(AddInstrument("nasa-tlx"))
    designer.controller.show_outline()
    return designer


@pytest.mark.parametrize(
    ("words", "steps"),
    [
        ("Before the first block", ["welcome", "nasa_tlx", "liquids", "reaching", "delays", "thanks"]),
        ("After each trial of Delays", ["welcome", "liquids", "reaching", "delays", "thanks"]),
        ("After each block", ["welcome", "liquids", "nasa_tlx", "reaching", "delays", "nasa_tlx", "thanks"]),
        ("At the end", ["welcome", "liquids", "reaching", "delays", "nasa_tlx", "thanks"]),
    ],
)
def test_a_questionnaire_is_asked_when_the_menu_says(with_form: Any, words: str, steps: list[str]) -> None:
    head = with_form.place.form.head
    assert head.used.whole == "not used"
    assert head.ask.isVisible()
    with_form.click_on(head.ask)
    assert head.asks.isVisible()
    action = next(one for one in head.asks.actions() if one.text().startswith(words))
    assert action.text().partition("\t")[2]  # what differs is said
    QTest.mouseClick(head.asks, LEFT, pos=head.asks.actionGeometry(action).center())
    assert list(sequence(with_form)) == steps
    asked = [name for name, block in with_form.value("blocks").items() if block.get("questionnaire") == "nasa_tlx"]
    assert bool(asked) == ("trial" in words)
    assert head.used.whole.startswith("used by")
    assert len(with_form.steps) == 2
    assert with_form.study.faults == ()


def test_a_questionnaire_is_dragged_into_the_session(qtbot: Any, with_form: Any) -> None:
    tree, before = with_form.place.outline.tree, with_form.text
    start = place_of(with_form, *TLX)
    drag(qtbot, with_form, start, start + QPoint(0, 30))
    assert with_form.text == before  # far from the session
    qtbot.mousePress(tree.viewport(), LEFT, pos=start)
    event_move(tree.viewport(), start - QPoint(0, 20))
    tree.verticalScrollBar().setValue(0)
    thanks = tree.visualRect(with_form.index("pages", "thanks")).center()
    event_move(tree.viewport(), thanks - QPoint(0, 12))
    qtbot.mouseRelease(tree.viewport(), LEFT, pos=thanks)
    assert list(sequence(with_form)) == ["welcome", "liquids", "reaching", "delays", "nasa_tlx", "thanks"]
    with_form.editing.undo()
    assert with_form.text == before


def test_a_small_drag_of_a_questionnaire_in_its_block_adds_no_step(qtbot: Any, designer: Any) -> None:
    designer.open()
    before = sequence(designer)
    at = place_of(designer, "questionnaires", "liquid")
    drag(qtbot, designer, at, at + QPoint(6, 5))
    assert sequence(designer) == before


def test_the_outline_has_a_row_for_the_session_order_with_that_of_the_blocks(designer: Any) -> None:
    designer.change(("format = 1", "format = 2"))
    designer.open()
    click_first = place_of(designer, "sequence")
    QTest.mouseClick(designer.place.outline.tree.viewport(), LEFT, pos=click_first)
    row = designer.place.outline.tree.currentIndex().data(ROW_ROLE)
    assert (row.title, row.note) == ("Session order", "5 steps")
    names = designer.field("sequence").names
    names.activated.emit(next(at for at in range(names.count()) if names.itemText(at) == "delay"))
    assert sequence(designer)[-1] == "delay"
    designer.click_on(designer.field("study", "block_order").segments.buttons[1])
    assert designer.value("study", "block_order") == "balanced"


def _thing(designer: Any, at: int) -> tuple[str, str]:
    name = sequence(designer)[at]
    return next((section, name) for section in ("pages", "blocks") if name in designer.value(section))


def test_several_selected_elements_move_are_copied_and_deleted_together(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    document, text = designer.study.document, designer.text
    items = [item["id"] for item in document["questionnaires"]["liquid"]["items"]]
    path = ("questionnaires", "liquid", "items")

    def ids() -> list[str]:
        return [item["id"] for item in designer.value("questionnaires", "liquid", "items")]

    designer.editing.select((*path, 0))
    designer.controller.show_outline()
    click(qtbot, designer, *path, 0)
    click(qtbot, designer, *path, 1, held=SHIFT)
    assert designer.place.outline.selected == ((*path, 0), (*path, 1))
    tree = designer.place.outline.tree
    qtbot.keyClick(tree, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    assert ids()[:3] == [items[2], items[0], items[1]]
    assert designer.place.outline.selected == ((*path, 1), (*path, 2))
    qtbot.keyClick(tree, Qt.Key.Key_D, CONTROL)
    assert ids()[1:5] == [items[0], f"{items[0]}_2", items[1], f"{items[1]}_2"]
    designer.editing.undo()
    designer.editing.undo()
    assert designer.text == text
    designer.editing.select(("liquids", "honey"))
    designer.controller.show_outline()
    click(qtbot, designer, "liquids", "syrup", held=CONTROL)
    qtbot.keyClick(tree, Qt.Key.Key_Delete)
    prompt = designer.place.prompt
    assert prompt is not None
    assert "2 elements" in prompt.accessibleName()
    prompt.all.click()
    assert tree.hasFocus()
    assert not {"honey", "syrup"} & set(designer.value("liquids"))
    designer.editing.undo()
    assert designer.text == text


def test_entries_of_a_list_are_dragged_or_moved_by_keys(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    path = ("blocks", "liquids", "conditions")

    def listed() -> tuple[str, ...]:
        return designer.value("blocks", "liquids", "conditions")

    designer.go_to(*path[:2])
    first, second, third = listed()
    field = designer.field(*path)
    field.choose((0,))
    at = QPointF(field.rows[1].geometry().bottomLeft())
    field.list.dropEvent(QDropEvent(at, Qt.DropAction.MoveAction, QMimeData(), LEFT, Qt.KeyboardModifier.NoModifier))
    assert listed() == (second, first, third)
    QApplication.processEvents()
    row = designer.field(*path).rows[1]
    row.setFocus()
    qtbot.keyClick(row, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    assert listed() == (second, third, first)
    row = designer.field(*path).rows[2]
    row.setFocus()
    qtbot.keyClick(row, Qt.Key.Key_Up, Qt.KeyboardModifier.AltModifier)
    assert listed() == (second, first, third)
    designer.field(*path).choose((0,))
    row = designer.field(*path).rows[0]
    row.setFocus()
    qtbot.keyClick(row, Qt.Key.Key_C, CONTROL)
    assert f"[conditions.{second}]" in QGuiApplication.clipboard().text()
    row.setFocus()
    qtbot.keyClick(row, Qt.Key.Key_V, CONTROL)
    assert f"{second}_2" in designer.value("conditions")
    designer.editing.undo()
    assert designer.editing.selected == path[:2]


def test_what_changes_by_itself_is_said_once(designer: Any, monkeypatch: Any) -> None:
    said: list[str] = []
    monkeypatch.setattr("study_app.designer.place.header.say", lambda _widget, words: said.append(words))
    monkeypatch.setattr("study_app.designer.place.view.say", lambda _widget, words: said.append(words))
    designer.open()
    assert said == []
    designer.editing.ask(MoveTo((("sequence", 1),), 3))
    assert said[-1].endswith("now 3 of 5")
    said.clear()
    designer.editing.ask(SetValue(("device", "force_limit_n"), -1))
    designer.editing.ask(SetValue(("device", "force_limit_n"), -2))
    designer.saving.write_draft(at_once=True)
    designer.saving.write_draft(at_once=True)
    assert [words for words in said if words == "1 problem"] == ["1 problem"]
    assert len([words for words in said if words.startswith("Draft kept")]) == 1


def test_what_keys_do_in_the_outline_its_menu_does_too(designer: Any) -> None:
    designer.open()
    before = sequence(designer)
    designer.editing.select(("pages", "welcome"))
    outline = designer.place.outline

    def choose(words: str) -> None:
        next(action for action in outline.tree.actions() if action.text() == words).trigger()

    choose("Move down")
    assert sequence(designer) == (before[1], before[0], *before[2:])
    designer.editing.select(("liquids", "thick"))
    choose("Copy")
    choose("Paste")
    assert "thick_2" in designer.value("liquids")
    choose("Delete")
    assert "thick_2" not in designer.value("liquids")
    choose("Rename")
    assert designer.place.form.head.id.hasFocus()


def type_id(qtbot: Any, designer: Any, path: tuple[str, str], name: str) -> None:
    """Select an element and type another id, without leaving the field."""
    designer.editing.select(path)
    field = designer.place.form.head.id
    qtbot.mouseClick(field, LEFT)
    field.selectAll()
    qtbot.keyClicks(field, name)


def test_a_list_that_is_clicked_after_an_id_was_typed_stays_open(qtbot: Any, designer: Any) -> None:
    designer.open()
    type_id(qtbot, designer, ("conditions", "thick"), "honey")
    liquids = designer.field("conditions", "thick", "liquid").list
    qtbot.mouseClick(liquids, LEFT)
    qtbot.wait(100)
    assert isValid(liquids)
    assert liquids.view().isVisible()
    assert "[conditions.thick]" in designer.text
    liquids.hidePopup()
    qtbot.waitUntil(lambda: "[conditions.honey]" in designer.text)
    assert designer.place.view.form.path == ("conditions", "honey")


def test_a_field_that_is_clicked_thrice_after_an_id_was_typed_takes_what_is_typed(qtbot: Any, designer: Any) -> None:
    designer.open()
    type_id(qtbot, designer, ("liquids", "thick"), "honey")
    (density,) = designer.form_row("liquids", "thick", "density_kg_m3").findChildren(QLineEdit)
    at = density.mapTo(designer.window, density.rect().center())
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    qtbot.waitUntil(lambda: "[liquids.honey]" in designer.text)
    QTest.mouseDClick(designer.window.windowHandle(), LEFT, pos=at)
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    assert designer.keyboard is density, "the form was made anew under the click"
    assert density.selectedText() == density.text()
    qtbot.keyClicks(density, "1402")
    qtbot.waitUntil(lambda: "density_kg_m3 = 1402" in designer.text)
    qtbot.mouseClick(next(one for one in designer.place.form.adds.values() if one.isVisible()), LEFT)
    assert designer.value("liquids", "honey", "density_kg_m3") == 1402
    assert "thick" not in designer.value("liquids")


@pytest.mark.parametrize("way", ["Enter", "double click"])
def test_an_entry_opens_by_enter_and_a_double_click(qtbot: Any, designer: Any, way: str) -> None:
    designer.open("kitchen", "blocks", "liquids")
    field = designer.field("blocks", "liquids", "conditions")
    qtbot.mouseClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("blocks", "liquids")
    if way == "Enter":
        qtbot.keyClick(field.rows[1], Qt.Key.Key_Return)
    else:
        qtbot.mouseDClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("conditions", field.row.value[1])


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
    designer.open()
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
    designer.open("beta")
    designer.place.ask("save")
    designer.controller.enter()
    assert listed(designer) == before
    box = designer.place.header.study
    assert box.currentText() == "Melons  ·  beta.toml  (copy of alpha)"
    assert (
        box.itemData(box.currentIndex(), Qt.ItemDataRole.AccessibleTextRole)
        == "Melons  ·  beta.toml  (copy of alpha), open"
    )


def test_keys_open_the_list_and_no_other_study(qtbot: Any, designer: Any) -> None:
    add_study(designer, "zeta", "Zebra")
    designer.open()
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
