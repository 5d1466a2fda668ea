"""The keyboard in the designer: every key, the Tab order, and fields during typing."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QPlainTextEdit, QWidget

from study_app.designer.document.steps import ChangeLanguage
from study_app.designer.measures.study_facts import revealing_texts
from study_app.designer.outline import ROW_ROLE
from study_app.designer.window import focus_stops
from study_app.gui.kit.commands import COMMANDS
from study_app.gui.widgets.controls import ActionButton

pytestmark = pytest.mark.slow


def test_every_key_of_the_designer_belongs_to_exactly_one_shortcut(designer: Any) -> None:
    actual = [keys.toString() for action in designer.place.actions() for keys in action.shortcuts()]
    actual.append(designer.place.header.play.play.shortcut().toString())
    expected = [keys for command in COMMANDS if not command.within for keys in command.keys]
    assert sorted({"Ins": "Insert"}.get(keys, keys) for keys in actual) == sorted(expected)


CAPS = {"Add": "Ins", "Duplicate": "Ctrl D", "Outline": "Ctrl 1", "Next": "F8", "New study…": "Ctrl N",
        "Make study": "Enter", "Play from here": "F5"}  # fmt: skip


def test_each_button_shows_the_key_that_does_the_same(designer: Any) -> None:
    designer.open("kitchen", "study")
    buttons = designer.place.findChildren(ActionButton)
    assert {button.text(): button.cap for button in buttons if button.cap} == CAPS


def test_a_requested_tab_comes_to_the_front_in_a_narrow_window(designer: Any) -> None:
    designer.open(width=1024)
    designer.place.parts.show_tab("file")
    assert designer.place.pane.isVisible()
    assert designer.place.pane.isAncestorOf(designer.keyboard)


def test_a_key_leads_from_the_designer_to_the_home_page(designer: Any) -> None:
    designer.open("kitchen", "study")
    designer.hit("alt+Home")
    assert designer.window.here == "home"


def test_escape_closes_the_problems_and_returns_the_keyboard(designer: Any) -> None:
    designer.open("kitchen", "study")
    at = designer.hit("ctrl+2")
    designer.hit("ctrl+4")
    assert designer.place.problems.isAncestorOf(designer.keyboard)
    assert designer.hit("Escape") is at
    assert not designer.place.problems.isVisible()


def test_page_down_scrolls_the_measures_from_the_page_and_from_the_tabs(designer: Any, qtbot: Any) -> None:
    designer.open(width=1366)
    designer.place.show_tab("measures")
    measures = designer.place.measures
    bar = measures.verticalScrollBar()
    measures.power.setMinimumHeight(3 * measures.height())
    qtbot.waitUntil(lambda: bar.maximum() > 0)
    designer.hit("ctrl+2")
    for name in ("Measures", "Measures tab"):
        at = designer.hit("ctrl+3")
        assert (at is measures) == (name == "Measures")
        assert designer.place.pane.isAncestorOf(at)
        designer.hit("PageDown")
        assert bar.value() > 0, name
        designer.hit("PageUp")
        assert bar.value() == 0, name


MOST = 250


@pytest.fixture
def dutch(qtbot: Any, designer: Any) -> Any:
    """Return the designer with a study in two languages and a selected block."""
    designer.open()
    for how in ("add", "copy"):
        designer.editing.handle_request(ChangeLanguage(how, "nl"))
    designer.go_to("blocks", "liquids")
    qtbot.waitUntil(lambda: len(designer.controller.preview.languages.buttons) == 2)
    return designer


def stops_until(designer: Any, until: Callable[[QWidget], bool]) -> list[Any]:
    """Press Tab until a widget that fulfils ``until`` has the focus; return every focused widget."""
    stops = [designer.keyboard]
    while not until(stops[-1]):
        assert len(stops) < MOST, [stop.accessibleName() for stop in stops[-40:]]
        stops.append(designer.hit("Tab"))
    return stops


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
    dutch.place.parts.focus_header()
    stops = stops_until(dutch, lambda part: part is dutch.place.pane.tabs.buttons[0])
    assert [part.accessibleName() for part in stops if form.inside.isAncestorOf(part)] == [
        part.accessibleName() for part in focus_stops(form.inside) if part.isVisible() and part.isEnabled()
    ]


def test_enter_in_the_outline_leads_to_the_first_field_to_type_in_of_each_element(designer: Any) -> None:
    designer.open()
    designer.editing.handle_request(ChangeLanguage("add", "nl"))  # whose texts are missing
    text = designer.text
    outline = designer.place.outline
    landed = {}
    for path in dict.fromkeys(index.data(ROW_ROLE).path for index in outline.indexes()):
        if len(path) != 2 and path != ("study",):
            continue
        designer.go_to(*path)
        outline.tree.setFocus()
        field = designer.hit("Return")
        stops = focus_stops(designer.place.form.inside)
        assert field is next((stop for stop in stops if isinstance(stop, QLineEdit | QPlainTextEdit)), field), path
        landed[path] = field.accessibleName()
    assert landed["study",] == "Name"
    assert landed["pages", "welcome"] == "Title, English"
    assert landed["blocks", "liquids"] == "Title, English"
    assert landed["questionnaires", "liquid"] == "Introduction, English"
    assert designer.text == text


def test_delete_changes_nothing_in_the_field_to_which_the_outline_leads(designer: Any) -> None:
    designer.open("kitchen", "liquids", "thin", width=1366)
    before = designer.text
    designer.hit("ctrl+1")
    field = designer.hit("Return")
    assert designer.field("liquids", "thin", "density_kg_m3").isAncestorOf(field)
    designer.hit("Delete")
    assert (field.text(), designer.text) == ("1000", before)


def test_three_actions_lead_to_a_second_abx_block_at_another_delay(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "late")
    designer.go_to("blocks", "liquids")
    hint = designer.field("analysis", "contrasts").why
    assert "Duplicate (Ctrl+D) asks for the delay" in hint.text(), "no hypothesis is possible before"
    designer.place.parts.focus_form()
    before = designer.actions
    designer.key("ctrl+d")
    designer.type("80")
    designer.key("Return")
    assert designer.actions - before == 3
    blocks, conditions = designer.value("blocks"), designer.value("conditions")
    copy = blocks["liquids_2"]
    assert (copy["conditions"], copy["standard"]) == (("thin_80", "thick_80"), "thin_80")
    assert copy["title"] == f"{blocks['liquids']['title']} 2"
    assert [conditions[name] for name in copy["conditions"]] == [
        {"liquid": "thin", "delay_ms": 80}, {"liquid": "thick", "delay_ms": 80},
    ]  # fmt: skip
    assert (designer.study.faults, designer.editing.selected) == ((), ("blocks", "liquids_2"))
    assert blocks["liquids"]["conditions"] == ("thin", "thick")
    assert designer.field("analysis", "contrasts").why.text() == ""
    assert revealing_texts(designer.study, designer.study.protocol) == (), "results show its title before unblinding"


def test_a_copy_of_an_abx_block_can_have_the_same_conditions(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "late")
    designer.go_to("blocks", "liquids")
    designer.key("ctrl+d")
    designer.press("Same conditions")
    assert designer.value("blocks", "liquids_2", "conditions") == ("thin", "thick")


@pytest.mark.parametrize("words", ["exclusion", "exclude", "catch trials"])
def test_add_finds_exclusion_rules_and_adds_one_with_its_usual_limit(designer: Any, words: str) -> None:
    designer.controller.begin_study("template:compare-liquids", "rules")
    designer.hit("Insert")
    QTest.keyClicks(designer.place.adding.filter_field, words)
    designer.hit("Return")
    assert designer.value("analysis", "exclusions") == ({"rule": "constant_answers", "limit": 95},)
    assert (designer.study.faults, designer.editing.selected) == ((), ("analysis", "exclusions", 0))


def test_groups_are_added_in_twos_which_the_entry_and_the_foot_say(designer: Any) -> None:
    designer.open("kitchen", "study")
    designer.add("Two groups")
    assert tuple(designer.value("groups")) == ("group", "group_2")
    form = designer.place.form
    assert form.foot.help_label.text() == "Also added, because the study needs it: Group 2. Groups lists it."
    assert (designer.keyboard, form.head.id.selectedText()) == (form.head.id, "group")
    QTest.keyClicks(designer.keyboard, "thick_first")
    designer.hit("Return")
    assert tuple(designer.value("groups")) == ("thick_first", "group_2")


@pytest.mark.parametrize("path", [("conditions", "thin", "liquid"), ("blocks", "liquids", "conditions")])
def test_a_shipped_liquid_is_chosen_without_leaving_the_form(designer: Any, path: tuple[str, ...]) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "mine")
    designer.go_to(*path[:2])
    request = next(
        request for words, request in designer.form_row(*path).row.additions if words.startswith("Slime liquid")
    )
    designer.place.form.asked.emit(request)
    assert designer.editing.selected == path[:2]
    named = designer.value(*path)
    assert named == "slime" if path[0] == "conditions" else named[-1] == "slime"
    assert designer.value("conditions", "slime") == ({"liquid": "slime"} if path[0] == "blocks" else None)
    assert "slime" in designer.value("liquids")


def test_tab_skips_the_buttons_of_conditions_which_have_keys(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    row = designer.form_row("blocks", "liquids", "conditions")
    inner = [stop.accessibleName() for stop in focus_stops(row.field.list) if stop is not row.field.list]
    assert inner == []
    row.field.list.setFocus()
    designer.hit("shift+Return")
    assert designer.editing.selected == ("liquids", "thin")


def test_a_key_leads_from_a_questionnaire_to_the_text_of_each_question_and_back(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "mine")
    designer.go_to("questionnaires", "after")
    designer.place.parts.focus_form()
    for key, number in (("Down", 0), ("Down", 1), ("Down", 2), ("Down", 2), ("Up", 1)):
        designer.hit(f"alt+Page{key}")
        assert designer.editing.selected == ("questionnaires", "after", "items", number)
        (line,) = designer.field("questionnaires", "after", "items", number, "text").lines.values()
        assert (designer.keyboard, line.textCursor().selectedText()) == (line, line.typed_text())


def test_each_key_leads_to_its_part_and_f6_goes_around(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    place = designer.place
    parts = {"header": place.header, "outline": place.outline, "form": place.form, "views": place.pane,
             "problems": place.problems}  # fmt: skip

    def part_after(keys: str) -> str:
        focused = designer.hit(keys)
        return next(name for name, part in parts.items() if part.isAncestorOf(focused))

    assert [part_after(f"ctrl+{number}") for number in (5, 1, 2, 3, 4)] == [*parts]
    assert [part_after("F6") for _ in range(6)] == [*parts, "header"]
    assert [part_after("shift+F6") for _ in range(5)] == [*reversed(parts)]
    designer.hit("ctrl+2")
    field = designer.keyboard
    assert designer.hit("ctrl+e") is place.file.editor
    assert (place.pane.tab, designer.hit("ctrl+e")) == ("file", field)
    assert designer.hit("ctrl+f") is place.outline.search_field


def test_arrow_keys_change_the_last_digit_of_a_number_and_the_chosen_segment(designer: Any) -> None:
    designer.open("kitchen", "conditions", "late")
    line = designer.field("conditions", "late", "delay_ms").line
    for typed, keys, number in (("19.95", "Up", 19.96), ("20.1", "Down", 20.0), ("7", "Up", 8), ("7", "Down", 6)):
        designer.fill(line, typed, keys)
        assert designer.value("conditions", "late", "delay_ms") == pytest.approx(number), (typed, keys)
    designer.place.show_tab("measures")
    tabs = designer.place.pane.tabs
    names = [page.name for page in designer.place.pane.pages]
    tabs_shown = []
    for name, keys in ((names[1], "Right"), (names[1], "Left"), (names[-1], "Right"), (names[0], "Left")):
        designer.place.show_tab(name)
        tabs.buttons[names.index(name)].setFocus()
        designer.hit(keys)
        tabs_shown.append(designer.place.pane.tab)
    assert tabs_shown == [names[2], names[0], names[-1], names[0]]
