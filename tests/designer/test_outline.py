"""The outline and the lists in their window: dragged and clicked."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from shiboken6 import isValid

from study_app.designer.document.toml_edits import Insert, Set
from study_app.designer.measures.study_facts import facts
from study_app.designer.new_study_page import _current_title
from study_app.designer.outline import ROW_ROLE, icon_of
from study_app.number_text import duration
from study_app.protocol.source.files import shipped
from study_app.store.versions.drafts import Keeper
from study_app.store.versions.study_settings import keep_original
from study_app.store.versions.study_versions import content_hash

pytestmark = pytest.mark.slow


CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LEFT = Qt.MouseButton.LeftButton


def place_of(designer: Any, *path: str | int) -> QPoint:
    """Return the middle of an element's first row."""
    outline = designer.place.outline
    index = next(row for row in outline.indexes() if row.data(ROW_ROLE).path == path)
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


def test_each_element_has_the_icon_of_its_kind() -> None:
    kinds = {"consent": "pen", "break": "pause", "debrief": "flag", "instructions": "file", "": "file"}
    document = {"pages": {kind: {"kind": kind} for kind in kinds} | {"": 3}}
    assert {kind: icon_of(("pages", kind), document) for kind in kinds} == kinds
    sections = {"blocks": "layers", "tasks": "route", "liquids": "drop", "groups": "people", "unknown": "ring"}
    assert {section: icon_of((section, "a"), document) for section in sections} == sections
    assert [icon_of(path, document) for path in ((), ("device",), ("questionnaires", "a", "items", 0))] == [
        "ring", "device", "list"
    ]  # fmt: skip


def test_the_outline_follows_a_selection_made_elsewhere_and_leads_on(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    outline, chosen = designer.place.outline, list[Any]()
    outline.chosen.connect(chosen.append)
    for path in (("tasks", "reach"), ("pages", "welcome")):
        designer.editing.select(("device",))
        outline.mark_row(("device",))
        assert outline.tree.currentIndex().data(ROW_ROLE).path == ("device",)
        outline.tree.setCurrentIndex(designer.index(*path))
        assert (chosen.pop(), chosen, designer.editing.selected) == (path, [], path)
    outline.mark_row(("no", "such"))
    assert (outline.tree.currentIndex().isValid(), outline.tree.selectedIndexes()) == (False, [])


def test_enter_at_a_field_that_was_found_leads_to_it_and_ends_the_search(designer: Any, qtbot: Any) -> None:
    designer.open()
    outline, requests = designer.place.outline, list[Any]()
    outline.field_asked.connect(requests.append)
    outline.form_asked.connect(lambda: requests.append("form"))
    for words, path, answer in (
        ("dwell", ("tasks", "reach"), ("tasks", "reach", "dwell_s")),
        ("", ("device",), "form"),
    ):
        outline.search_field.setText(words)
        qtbot.waitUntil(lambda path=path: any(row.data(ROW_ROLE).path == path for row in outline.indexes()))
        outline.tree.setCurrentIndex(designer.index(*path))
        assert bool(outline.tree.currentIndex().data(ROW_ROLE).field) is bool(words)
        qtbot.keyClick(outline.tree, Qt.Key.Key_Return)
        assert (requests.pop(), requests, outline.search_field.text()) == (answer, [], "")


def test_the_outline_scrolls_towards_the_edge_that_a_row_is_dragged_to(qtbot: Any, designer: Any) -> None:
    designer.open()
    tree = designer.place.outline.tree
    tree.setFixedHeight(150)
    start, bar = place_of(designer, *_thing(designer, 1)), tree.verticalScrollBar()
    values = [bar.value()]
    drag(qtbot, designer, start, QPoint(start.x(), 148), drop=False)
    for y in (2, 2, 75):
        values.append(bar.value())
        event_move(tree.viewport(), QPoint(start.x(), y))
    qtbot.keyClick(tree, Qt.Key.Key_Escape)
    assert values[0] < values[1] > values[2] > bar.value(), values


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


def _thing(designer: Any, at: int) -> tuple[str, str]:
    name = sequence(designer)[at]
    return next((section, name) for section in ("pages", "blocks") if name in designer.value(section))


def type_id(qtbot: Any, designer: Any, path: tuple[str, str], name: str) -> None:
    """Select an element and type another id, without leaving the field."""
    designer.editing.select(path)
    field = designer.place.form.head.id
    qtbot.mouseClick(field, LEFT)
    field.selectAll()
    qtbot.keyClicks(field, name)


def test_down_leads_from_an_empty_search_to_the_outline(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    outline = designer.place.outline
    outline.search_field.setFocus()
    assert designer.hit("Down") is outline.tree
    assert designer.place.form_path == ("blocks", "liquids")


@pytest.mark.parametrize(
    ("keys", "selected"),
    [("Return", "welcome"), ("Down Return", "welcome"), ("Escape", ""), ("Down Escape", "welcome"),
     ("Down ctrl+d", "welcome_2")],
)  # fmt: skip
def test_a_search_ends_with_its_result_esc_or_a_new_element(designer: Any, keys: str, selected: str) -> None:
    designer.open("kitchen", "study")
    outline = designer.place.outline
    whole = len(outline.rows)
    designer.hit("ctrl+f")
    QTest.keyClicks(outline.search_field, "welcome")
    assert 0 < len(outline.rows) < whole
    for key in keys.split():
        designer.hit(key)
    assert (outline.search_field.text(), len(outline.rows)) == ("", whole + 2 * (selected == "welcome_2"))
    assert designer.editing.selected == (("pages", selected) if selected else ("study",))


def test_arrow_keys_skip_the_headings_and_each_row_shows_its_form(designer: Any) -> None:
    designer.open("kitchen", "study")
    outline = designer.place.outline
    outline.tree.setFocus()
    rows = [index.data(ROW_ROLE) for index in outline.indexes() if not index.parent().isValid()]
    elements = [row.path for row in rows if row.path]
    assert len(rows) - len(elements) == 3
    visited = [designer.place.form_path]
    for key, stops in (("Down", elements[1:]), ("Up", elements[-2::-1])):
        for _ in stops:
            index = outline.tree.currentIndex()
            outline.tree.collapse(index)
            designer.hit(key)
            visited.append(designer.place.form_path)
            assert outline.tree.selectedIndexes() == [outline.tree.currentIndex()]
    assert visited == [*elements, *elements[-2::-1]]


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


def test_a_field_clicked_three_times_after_typing_an_id_accepts_typing(qtbot: Any, designer: Any) -> None:
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
    qtbot.mouseClick(next(button for button in designer.place.form.adds.values() if button.isVisible()), LEFT)
    assert designer.value("liquids", "honey", "density_kg_m3") == 1402
    assert "thick" not in designer.value("liquids")


def study_titles(designer: Any) -> list[str]:
    box = designer.place.header.study
    return [box.itemText(at) for at in range(box.count())]


def add_study(designer: Any, name: str, title: str) -> None:
    text = designer.file.read_text("utf-8")
    before = next(line for line in text.splitlines() if line.startswith("title = "))
    content = text.replace('name = "kitchen"', f'name = "{name}"').replace(before, f'title = "{title}"', 1)
    (designer.file.parent / f"{name}.toml").write_text(content, encoding="utf-8", newline="\n")


def test_studies_are_listed_by_title_with_their_files_whatever_was_opened_last(designer: Any) -> None:
    for name, title in (("zeta", "apples"), ("beta", "Melons"), ("alpha", "Melons")):
        add_study(designer, name, title)
    keep_original(designer.file.with_name("beta.toml"), "alpha")
    designer.open()
    own = [words for words in study_titles(designer) if "(shipped)" not in words][:-2]
    assert own[:2] == ["A first look  ·  kitchen.toml", "apples  ·  zeta.toml"]
    assert [words for words in own if words.startswith("Melons")] == [
        "Melons  ·  alpha.toml",
        "Melons  ·  beta.toml  (copy of alpha)",
    ]
    assert own == sorted(own, key=str.casefold)
    shipped_ones = [words for words in study_titles(designer) if "(shipped)" in words]
    assert len(shipped_ones) == len(shipped())
    assert study_titles(designer)[len(own) : len(own) + len(shipped_ones)] == sorted(shipped_ones, key=str.casefold)
    before = study_titles(designer)
    designer.open("beta")
    designer.place.ask("save")
    designer.controller.enter()
    assert study_titles(designer) == before
    file = designer.file.with_name("zeta.toml")
    kept = Keeper(file, base=content_hash(file.read_bytes()))
    kept.note_edit(file.read_text("utf-8").replace("apples", "pears"), (), 0.0)
    kept.write()
    assert [_current_title(file, drafted=drafted) for drafted in (False, True)] == ["apples", "pears"]
    box = designer.place.header.study
    assert box.currentText() == "Melons  ·  beta.toml  (copy of alpha)"
    assert (
        box.itemData(box.currentIndex(), Qt.ItemDataRole.AccessibleTextRole)
        == "Melons  ·  beta.toml  (copy of alpha), open"
    )


@pytest.fixture
def small(designer: Any) -> Any:
    """Return the designer with a study of many elements in a small window."""
    designer.window.resize(1366, 768)
    designer.controller.begin_study("rek2024", "mine")
    QApplication.processEvents()
    return designer


def open_drawer(qtbot: Any, designer: Any) -> None:
    designer.key("ctrl+1")
    QApplication.processEvents()


def index_of(designer: Any, *path: str | int) -> Any:
    return next(index for index in designer.place.outline.indexes() if index.data(ROW_ROLE).path == path)


def expanded_rows(designer: Any) -> set[Any]:
    tree = designer.place.outline.tree
    return {index.data(ROW_ROLE).path for index in designer.place.outline.indexes() if tree.isExpanded(index)}


def test_a_click_in_the_drawer_leads_to_the_form_and_keeps_rows_expanded(qtbot: Any, small: Any) -> None:
    outline, tree = small.place.outline, small.place.outline.tree
    small.editing.select(("blocks", "liquids"))
    small.click_on(small.place.parts.path.outline)
    assert outline.isVisible()
    for _ in range(2):
        open_drawer(qtbot, small)
        index = index_of(small, "blocks", "liquids")
        before = expanded_rows(small)
        assert ("blocks", "liquids") in before
        tree.scrollTo(index)
        qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualRect(index).center())
        assert not outline.isVisible()
        assert small.place.form.isAncestorOf(small.keyboard)
        assert expanded_rows(small) == before
    open_drawer(qtbot, small)
    index = index_of(small, "blocks", "liquids")
    tree.scrollTo(index)
    qtbot.mouseClick(tree.viewport(), LEFT, pos=QPoint(20, tree.visualRect(index).center().y()))
    assert outline.isVisible(), "the sign before the title opens and closes, it does not choose"
    assert ("blocks", "liquids") not in expanded_rows(small)


def test_escape_in_the_drawer_returns_the_keyboard_to_the_field(qtbot: Any, small: Any) -> None:
    small.editing.select(("blocks", "liquids"))
    before = small.form_row("blocks", "liquids", "repetitions").field.focusProxy()
    before.setFocus()
    for _ in range(2):
        open_drawer(qtbot, small)
        assert small.place.outline.isAncestorOf(small.keyboard)
        small.hit("Escape")
        assert small.keyboard is before
        assert not small.place.outline.isVisible()


def test_a_click_next_to_the_drawer_closes_it_although_nothing_takes_the_keyboard(qtbot: Any, small: Any) -> None:
    small.editing.select(("blocks", "liquids"))
    open_drawer(qtbot, small)
    right = QPoint(small.place.form.width() - 6, 6)
    assert small.place.outline.isVisible()
    assert not small.place.outline.geometry().contains(small.place.form.mapTo(small.place.parts, right))
    qtbot.mouseClick(small.place.form, LEFT, pos=right)
    assert not small.place.outline.isVisible()


def test_a_step_of_the_path_keeps_the_keyboard_when_it_is_clicked_after_an_id_was_typed(designer: Any) -> None:
    designer.open("kitchen", "conditions", "thin", width=1366)
    designer.fill(designer.place.form.head.id, "thinner")
    QApplication.processEvents()
    step = designer.place.parts.path.steps[0]
    designer.click_on(step)
    QApplication.processEvents()
    assert designer.editing.selected == ("conditions",)
    assert designer.keyboard is designer.place.parts.path.steps[-1]
    assert designer.keyboard.whole == "Conditions"


def test_the_outline_and_the_measures_have_the_same_duration_of_a_session(designer: Any) -> None:
    designer.open()
    sequence = designer.value("sequence")
    places = [("sequence", sequence.index(block) + 1) for block in ("delays", "liquids")]  # the later one first
    form = {"instrument": "nasa-tlx-weighted"}
    designer.editing.make_step("Add", Set(("questionnaires", "load"), form), *(Insert(it, "load") for it in places))
    designer.controller.show_outline()
    known = facts(designer.study)
    assert duration(known.expected_s) != duration(sum(known.steps_s.values())), "the form is filled in twice"
    note = next(row.note for row in designer.place.outline.rows if row.title == "Session, in order")
    assert note == duration(known.expected_s)
