"""The keyboard in the designer: every key, Tab through the place as it is seen, fields that are typed in."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from study_app.designer.document.steps import ChangeLanguage, SetValue
from study_app.designer.place.view import stops
from study_app.gui.kit.commands import COMMANDS

pytestmark = pytest.mark.slow


def test_every_key_of_the_place_is_one_shortcut(designer: Any) -> None:
    made = [keys.toString() for action in designer.place.actions() for keys in action.shortcuts()]
    made.append(designer.place.header.play.play.shortcut().toString())
    wanted = [keys for one in COMMANDS if not one.within for keys in one.keys]
    assert sorted({"Ins": "Insert"}.get(keys, keys) for keys in made) == sorted(wanted)


LEFT = Qt.MouseButton.LeftButton
BLOCK = ("blocks", "liquids")


def typed(qtbot: Any, designer: Any) -> Any:
    """Open a study, type a number into a field of a block, and return the field."""
    designer.open("kitchen", *BLOCK)
    field = designer.field(*BLOCK, "repetitions").line
    designer.fill(field, "3", "")
    qtbot.waitUntil(designer.place.header.undo.isEnabled)
    return field


@pytest.mark.variants(3)
@pytest.mark.parametrize("how", ["click", "space"])
@pytest.mark.parametrize("width", [1600, 1366, 1100])
def test_a_button_of_the_header_that_is_disabled_gives_the_keyboard_back(
    qtbot: Any, designer: Any, how: str, width: int
) -> None:
    designer.window.resize(width, 768)
    field = typed(qtbot, designer)
    header = designer.place.header
    for button in (header.undo, header.redo, header.save):
        if how == "space":
            button.setFocus(Qt.FocusReason.TabFocusReason)
            assert designer.hit("Space") is field
        else:
            for _ in range(2):  # the second one on a disabled button
                QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=button.mapTo(designer.window, QPoint(9, 9)))
                assert field.hasFocus()
        assert not button.isEnabled()
    assert "repetitions = 3" in designer.file.read_text()


def first_row(designer: Any) -> QWidget:
    return designer.place.form.rows[0]


@pytest.mark.parametrize("back", [False, True])
def test_a_number_that_is_left_by_tab_at_once_keeps_the_keyboard_in_its_form(
    qtbot: Any, designer: Any, back: bool
) -> None:
    path = ("conditions", "thin", "force_delay_ms")
    designer.change(("format = 1", "format = 2"))
    designer.open("kitchen", *path[:2])
    designer.field(*path).line.setFocus()
    rows = [row.row.path for row in designer.place.form.rows]
    qtbot.keyClicks(designer.keyboard, "7")
    designer.hit("Backtab" if back else "Tab")  # the key is new in the file: the form is made anew
    assert designer.value("conditions", "thin", "force_delay_ms") == 7
    beside = rows[rows.index(path) + (-1 if back else 1)]
    assert designer.form_row(*beside).isAncestorOf(designer.keyboard)


def test_the_first_row_has_the_keyboard_where_undo_removes_the_row_that_had_it(designer: Any) -> None:
    designer.open("kitchen", "tasks", "explore")
    designer.editing.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    designer.field("tasks", "explore", "dwell_s").line.setFocus()
    keyboard = designer.hit("ctrl+z")
    assert designer.value("tasks", "explore", "kind") == "explore"
    assert first_row(designer).isAncestorOf(keyboard)


def test_ctrl_delete_removes_the_key_of_a_field_whose_cross_tab_passes(designer: Any) -> None:
    designer.open()
    block = ("blocks", "liquids")
    designer.go_to(*block)
    text, removable = designer.text, [row for row in designer.place.form.rows if row.row.removable]
    assert {"title", "order", "repetitions", "questionnaire"} <= {str(row.row.path[-1]) for row in removable}
    for row in removable:
        assert row.remove not in stops(designer.place.form)
        assert "(Ctrl+Del)" in row.remove.toolTip()
        path = row.row.path
        designer.place.form.focus(path)
        if isinstance(designer.keyboard, QLineEdit):
            designer.keyboard.selectAll()  # as where Tab leads to it
        designer.hit("ctrl+Delete")
        assert path[-1] not in designer.value("blocks", "liquids"), path
        assert designer.place.form.isAncestorOf(designer.keyboard)
        designer.editing.undo()
        assert designer.text == text


def test_ctrl_delete_deletes_a_word_where_one_follows_and_no_key_comes_back_with_what_was_typed(
    qtbot: Any, designer: Any
) -> None:
    designer.open()
    title = ("blocks", "liquids", "title")
    designer.go_to(*title[:2])
    designer.place.form.focus(title)
    field = designer.keyboard
    field.setText("Two liquids")
    field.setCursorPosition(0)
    designer.hit("ctrl+Delete")
    assert field.text() == "liquids"
    field.setCursorPosition(len(field.text()))
    qtbot.keyClicks(field, " now")
    designer.hit("ctrl+Delete")
    assert "title" not in designer.value("blocks", "liquids")


@pytest.mark.parametrize("shown", ["the form gets another row", "the file can be read again"])
def test_what_is_typed_into_the_file_stays_there_where_the_form_is_made_anew(
    qtbot: Any, designer: Any, shown: str
) -> None:
    again = shown == "the file can be read again"
    if again:
        designer.open("rek2024")
        designer.change(("[study]", "[study"))
    designer.open("kitchen", "study")
    designer.place.form.focus_first()
    editor = designer.place.file.editor
    designer.place.show_tab("file")
    editor.setFocus()
    line = designer.text.split("\n").index("[study" if again else "[study]")
    cursor = editor.textCursor()
    cursor.setPosition(editor.document().findBlockByNumber(line).position())
    cursor.movePosition(cursor.MoveOperation.EndOfBlock)
    editor.setTextCursor(cursor)
    typed = "] # and more" if again else '\rcredits = "abc" # and more'
    for letter in typed:
        qtbot.keyClicks(designer.keyboard, letter)
        qtbot.wait(30)
    qtbot.wait(300)
    assert editor.hasFocus()
    assert typed.strip() in designer.text


MOST = 250


@pytest.fixture
def dutch(qtbot: Any, designer: Any) -> Any:
    """The study in two languages, with a block selected."""
    designer.open()
    for how in ("add", "copy"):
        designer.editing.ask(ChangeLanguage(how, "nl"))
    designer.go_to("blocks", "liquids")
    qtbot.waitUntil(lambda: len(designer.controller.preview.languages.buttons) == 2)
    return designer


def passed(designer: Any, until: Callable[[QWidget], bool]) -> list[Any]:
    """Press Tab until the keyboard is at a part; return all that it was at."""
    seen = [designer.keyboard]
    while not until(seen[-1]):
        assert len(seen) < MOST, [one.accessibleName() for one in seen[-40:]]
        seen.append(designer.hit("Tab"))
    return seen


@pytest.mark.parametrize("width", [1600, 1366])
def test_tab_goes_through_the_parts_as_they_are_seen(dutch: Any, width: int) -> None:
    dutch.window.resize(width, 800)
    QApplication.processEvents()
    place, rail = dutch.place, dutch.window.rail
    place.areas.focus_header()
    seen = passed(dutch, lambda part: part is place.pane.tabs.buttons[0])
    parts = [place.header, place.parts.path if width < 1400 else place.outline, place.form.head, place.form.inside]
    areas = [next((at for at, part in enumerate(parts) if part.isAncestorOf(one)), len(parts)) for one in seen]
    assert areas == sorted(areas)
    assert set(areas) == set(range(len(parts) + 1))
    assert place.form.rows[0].isAncestorOf(seen[areas.index(3)])
    for crumb in place.parts.path.steps:
        assert (crumb in seen) == (width < 1400)
    tab = dutch.controller.preview
    seen = passed(dutch, lambda part: part is tab.page)
    assert seen == [*place.pane.tabs.buttons, *tab.languages.buttons, tab.screens, tab.page]
    tab.page.left.emit()
    assert rail.isAncestorOf(passed(dutch, lambda part: not place.isAncestorOf(part))[-1])


@pytest.mark.variants(4)
@pytest.mark.parametrize(
    "path", [("blocks", "liquids"), ("questionnaires", "liquid"), ("tasks", "reach"), ("liquids", "thin"), ("study",)]
)
def test_tab_goes_to_each_stop_of_a_form_once(dutch: Any, editors: None, path: tuple[str | int, ...]) -> None:
    del editors
    dutch.go_to(*path)
    form = dutch.place.form
    assert form.rows
    QApplication.processEvents()
    dutch.place.areas.focus_header()
    seen = passed(dutch, lambda part: part is dutch.place.pane.tabs.buttons[0])
    assert [part.accessibleName() for part in seen if form.inside.isAncestorOf(part)] == [
        part.accessibleName() for part in stops(form.inside) if part.isVisible() and part.isEnabled()
    ]


def test_tab_goes_through_problems_questions_and_the_banner_which_are_made_later(
    qtbot: Any, designer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.designer.problems.REST_MS", 0)
    designer.open()
    designer.editing.ask(ChangeLanguage("add", "nl"))
    designer.saving.save()
    place = designer.place
    place.problems.show()
    place.show_tab("changes")
    qtbot.waitUntil(lambda: all(line.repairs for line in place.problems.lines))
    designer.controller.ask_to_delete(("liquids", "thick"))
    qtbot.waitUntil(place.prompt.isVisible)
    place.areas.focus_header()
    designer.hit("Tab")
    seen = passed(designer, lambda part: part is place.header.study or designer.window.rail.isAncestorOf(part))
    lines = [part for line in place.problems.lines for part in (line.go, *line.repairs)]
    card = place.prompt
    made = [*place.banner.buttons.values(), place.outline.tree, card.cancel, card.gaps, card.other, card.all, *lines]
    assert [part for part in seen if part in made] == made
    assert len(set(seen)) == len(seen)


@pytest.mark.variants(2)
@pytest.mark.parametrize("place", ["form", "outline", "measures", "nothing"])
def test_letters_and_space_do_nothing_where_no_field_has_the_keyboard(qtbot: Any, designer: Any, place: str) -> None:
    """A sentence typed next to a row neither leaves the designer nor opens or fills anything."""
    designer.open("kitchen", *BLOCK)
    parts = designer.place
    parts.show_tab("measures")
    row = designer.form_row(*BLOCK, "title")
    beside = {
        "form": row.words, "outline": parts.outline, "measures": parts.measures,
        "nothing": parts,
    }[place]  # fmt: skip
    row.field.setFocus()
    designer.click_on(beside, at=QPoint(3, 3))
    if place == "nothing":
        designer.keyboard.clearFocus()
    text, selected = designer.text, designer.editing.selected
    assert not isinstance(designer.keyboard, QLineEdit)
    QTest.keyClicks(designer.keyboard or designer.window, "no plan s d n o v x 1 2")
    QApplication.processEvents()
    assert designer.place.isVisible()
    assert (designer.text, designer.editing.selected) == (text, selected)
    assert (parts.prompt, QApplication.activeModalWidget(), QApplication.activePopupWidget()) == (None, None, None)
