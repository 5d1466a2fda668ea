"""The list of studies in the designer's header: in the order of titles, with files, whatever was saved last."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication

from study_app.authoring.kept_settings import begin_settings
from study_app.gui.designer.study_list import cut_title
from study_app.protocol.source.files import shipped
from study_app.viewmodels.designer.requests import SetText

pytestmark = pytest.mark.slow


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
