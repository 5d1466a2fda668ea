"""Clicks that follow typing, the list of studies, and what one sees first."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from shiboken6 import isValid

from study_app.protocol.source.files import shipped
from study_app.store.study_settings import begin_settings

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
    assert designer.editing.selected == ("conditions", field.row.row.value[1])


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
