"""The form: showing a value is not an edit, and special editors request the same steps as plain ones."""

from dataclasses import replace
from typing import Any

import pytest
import shiboken6
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QFocusEvent, QFontMetricsF, QKeySequence, QTextCursor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QFileDialog,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QWidget,
    QWidgetItem,
)

from study_app.designer.document.document import Answers, template
from study_app.designer.document.elements import title_of
from study_app.designer.document.steps import AddElement, AddKey, ChangeLanguage, RemoveKey, RenameElement
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.form.card import FormCard
from study_app.designer.form.fields import SENTENCE_EDGE_PX, TypedSentence, TypedText
from study_app.designer.form.special import Compared, Hypothesis
from study_app.designer.new_study_page import Questions, TemplateQuestion, template_choice
from study_app.designer.parts import FIELD_PX, SEGMENT_PX, Segments
from study_app.designer.problems import problem_rows
from study_app.designer.window import focus_stops
from study_app.gui.theme import font
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.controls import IconButton
from study_app.protocol.load import parse
from tests.gui.walk import settle
from tests.protocol.edited_studies import text_of

pytestmark = pytest.mark.slow


def test_forms_leave_no_wrapper_of_an_item_of_their_layouts(qtbot: Any, designer: Any) -> None:
    """Otherwise an event at the address of a deleted item would get its wrapper, and a key press would fail."""
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    for row in [("study",), *((name, id) for name, ids in designer.study.document.items()
                              if isinstance(ids, dict) for id in ids if isinstance(ids[id], dict))]:  # fmt: skip
        designer.go_to(*row)
    qtbot.wait(50)
    assert [wrapper for wrapper in shiboken6.getAllValidWrappers() if type(wrapper) is QWidgetItem] == []


@pytest.mark.variants(3)
@pytest.mark.parametrize("path", [("pages", "welcome", "body"), ("questionnaires", "liquid", "items", 0, "text")])
@pytest.mark.parametrize("text", ["a\rb", "a\u2029b", "a\r\nb"])
def test_qt_normalising_a_shown_text_is_not_an_edit(
    qtbot: Any, designer: Any, path: tuple[str | int, ...], text: str
) -> None:
    designer.open("kitchen")
    designer.editing.make_step("Change", Set(path, {"en": text}))
    designer.go_to(*path[:-1])
    (line,) = designer.field(*path).findChildren(QPlainTextEdit)
    assert not line.pending
    qtbot.wait(300)
    assert designer.value(*path) == {"en": text}
    line.insertPlainText("c")
    line.show_text("a text that is shown meanwhile")
    line.flush()
    assert designer.value(*path) == {"en": "ca\nb"}


QUESTIONNAIRE = ("questionnaires", "liquid")
ITEMS = (*QUESTIONNAIRE, "items")


def press(qtbot: Any, part: QWidget) -> None:
    qtbot.mouseClick(part, Qt.MouseButton.LeftButton)


def test_a_row_that_stays_keeps_its_widget_caret_and_keyboard(qtbot: Any, designer: Any, editors: None) -> None:
    designer.open("kitchen", "blocks", "liquids")
    conditions, title = (designer.form_row("blocks", "liquids", key) for key in ("conditions", "title"))
    count = len(conditions.field.rows)
    first = conditions.field.rows[0].findChildren(IconButton)
    press(qtbot, next(button for button in first if "Remove" in button.accessibleName()))
    assert designer.form_row("blocks", "liquids", "conditions") is conditions
    assert len(conditions.field.rows) == count - 1
    assert conditions.isAncestorOf(designer.keyboard)
    (line,) = title.field.lines.values()
    line.setFocus()
    line.setCursorPosition(2)
    designer.editing.handle_request(AddKey(("blocks", "liquids", "setting_label")))
    designer.editing.handle_request(RenameElement(("blocks", "liquids"), "fluids"))
    assert designer.keyboard is line
    assert (line.cursorPosition(), designer.form_row("blocks", "fluids", "title")) == (2, title)


def test_the_next_element_has_no_selected_entries_and_shows_the_field_with_the_keyboard(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids", width=1100)
    entries = designer.field("blocks", "liquids", "conditions").list
    designer.click_on(entries.viewport(), at=entries.visualItemRect(entries.item(0)).center())
    assert entries.selectedItems()
    last = designer.place.form.rows[-1]
    designer.place.form.focus_row(last.row.path)
    designer.go_to("blocks", "delays")
    assert designer.field("blocks", "delays", "conditions").list is entries
    assert not entries.selectedItems()
    area = designer.place.form.area
    assert area.verticalScrollBar().maximum()
    assert designer.place.form.inside.isAncestorOf(designer.keyboard)
    assert area.viewport().rect().contains(designer.keyboard.mapTo(area.viewport(), designer.keyboard.rect().center()))


def test_the_form_of_the_liquids_adds_a_shipped_one(designer: Any) -> None:
    designer.open("kitchen", "liquids")
    names = designer.field("liquids").add
    names.activated.emit(names.findText("Slime liquid", Qt.MatchFlag.MatchStartsWith))
    assert designer.editing.selected == ("liquids", "slime")
    assert designer.value("liquids", "slime", "non_newtonian", "kind") == "maxwell"


def test_the_help_shows_the_row_with_the_focus(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    for key in ("title", "conditions", "phase", "task"):
        row = designer.form_row("blocks", "liquids", key)
        keyboard = next(part for part in focus_stops(row) if part.isVisible())
        keyboard.setFocus()
        assert designer.place.form.foot.title.text() == row.row.label
    repetitions = designer.form_row("blocks", "liquids", "repetitions").row
    assert replace(repetitions, bounds=("at least 1", "at most 9")).range == "1 to 9"


def test_the_file_is_handed_on_while_typing_goes_on_and_when_it_is_left(
    designer: Any, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.designer.file.SUBMIT_DELAY_MS", 60_000)
    designer.open()
    editor = designer.place.file.editor
    designer.place.show_tab("file")
    editor.setFocus()
    editor._typing_timer.setTimerType(Qt.TimerType.PreciseTimer)
    editor.insertPlainText("# ")
    left_ms = editor._typing_timer.remainingTime()
    qtbot.wait(50)
    editor.insertPlainText("x")
    assert 0 < editor._typing_timer.remainingTime() <= left_ms - 40
    assert "# x" not in designer.text
    designer.place.outline.tree.setFocus()
    assert "# x" in designer.text


def test_a_text_loses_its_selection_with_the_keyboard(designer: Any) -> None:
    designer.open("kitchen", *QUESTIONNAIRE)
    (line,) = designer.field(*QUESTIONNAIRE, "intro").findChildren(QPlainTextEdit)
    line.setFocus(Qt.FocusReason.TabFocusReason)
    assert line.textCursor().hasSelection()
    designer.form_row(*ITEMS).field.take_keyboard()
    assert not line.textCursor().hasSelection()


@pytest.mark.parametrize("where", ["form", "file"])
def test_a_text_shows_the_caret_only_while_it_has_the_keyboard(designer: Any, where: str) -> None:
    flash_ms = QApplication.cursorFlashTime()
    QApplication.setCursorFlashTime(0)
    designer.open("kitchen", *QUESTIONNAIRE)
    designer.place.show_tab("file")
    around = designer.place.file if where == "file" else designer.field(*QUESTIONNAIRE, "intro")
    text = around.findChildren(QPlainTextEdit)[0]
    settle(designer.window)
    pictures = []
    for part in (designer.place.outline.tree, text, designer.place.outline.tree):
        part.setFocus()
        settle(designer.window)
        pictures.append(text.grab().toImage())
    QApplication.setCursorFlashTime(flash_ms)
    assert pictures[0] == pictures[2] != pictures[1]


def test_a_liquid_file_is_chosen_before_a_liquid_changes(designer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    preset = designer.file.parent / "presets" / "thin.toml"
    preset.parent.mkdir()
    preset.write_text("format = 2\n[liquids.thin]\ndensity_kg_m3 = 913.5\n", encoding="utf-8", newline="\n")
    answers = iter(["", str(preset)])
    dialogs: list[tuple[str, ...]] = []
    monkeypatch.setattr(
        QFileDialog, "getOpenFileName", lambda _by, *words: (dialogs.append(words) or next(answers), "")
    )
    designer.open("kitchen", "liquids", "thin")
    before = designer.text
    press_add = designer.place.form.adds["liquids", "thin", "file"].click
    press_add()
    assert designer.text == before, "after Cancel"
    press_add()
    assert dialogs == [("Choose a liquid file", str(designer.file.parent), "Protocols (*.toml)")] * 2
    assert designer.value("liquids", "thin") == {"file": "presets/thin.toml"}
    assert designer.study.faults == ()
    assert designer.study.protocol.liquids["thin"].density_kg_m3 == 913.5


def test_an_instrument_is_chosen_before_a_questionnaire_changes(designer: Any, qtbot: Any) -> None:
    designer.open("kitchen", *QUESTIONNAIRE)
    designer.editing.handle_request(AddElement(("questionnaires",)))
    path, before = designer.editing.selected, designer.text
    form = designer.place.form
    press(qtbot, form.adds[*path, "instrument"])
    assert form.instruments.isVisible()
    form.instruments.close()
    assert designer.text == before
    press(qtbot, form.adds[*path, "instrument"])
    use = {action.text(): action for action in form.instruments.actions()}
    assert list(use) == ["IPQ", "NASA-TLX", "NASA-TLX-WEIGHTED", "PANAS", "SSQ", "SUS", "UEQ"]
    use["SUS"].trigger()
    form.instruments.close()
    assert designer.value(*path)["instrument"] == "sus"
    assert [fault.message for fault in designer.study.faults if fault.path[:2] == path] == []
    assert len(designer.study.formed.questionnaires[path[1]].items) == 10


def test_write_scrolls_to_the_missing_text_of_each_question(designer: Any, qtbot: Any) -> None:
    designer.open("kitchen", *QUESTIONNAIRE, width=1366)
    count = 6
    texts = [f"Question {number}: how much did you have to look, think and search for it?" for number in range(count)]
    items = [{"id": f"i{at}", "text": {"en": f"{text} {text} {text}"}} for at, text in enumerate(texts)]
    designer.editing.make_step("Change", Set(("study", "languages"), ["en", "fr"]), Set(ITEMS, items))
    form = designer.place.form
    for number in range(1, count + 1):
        listed = designer.form_row(*ITEMS).field.rows.rows if number == 1 else form.below.rows
        write = next(row.write for row in listed if row.line.number == number)
        form.area.ensureWidgetVisible(write)
        press(qtbot, write)
        qtbot.wait(50)
        line = designer.keyboard
        assert designer.editing.selected == (*ITEMS, number - 1)
        assert line is designer.field(*ITEMS, number - 1, "text").lines["fr"]
        assert line.visibleRegion().boundingRect() == line.rect(), number
        QTest.keyClicks(
            line, "a text of so many words that it has several lines and a space at the end of the last one "
        )
        assert not line.horizontalScrollBar().value(), "no letter is cut"


def test_a_long_line_shows_its_start_after_the_keyboard_left_it(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids", width=1366)
    line = designer.field("blocks", "liquids", "title").lines["en"]
    designer.fill(line, "a title that is far longer than its field in a window of this width, and still longer", "")
    assert line.cursorPosition() == len(line.text())
    designer.form_row("blocks", "liquids", "conditions").field.take_keyboard()
    assert line.cursorPosition() == 0
    line.setFocus()
    assert line.cursorPosition() == len(line.text()), "typing goes on where it ended"


def test_add_offers_the_conditions_that_a_block_does_not_have(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    listed, conditions = designer.value("blocks", "liquids", "conditions"), designer.value("conditions")
    assert 0 < len(listed) < len(conditions)
    field = designer.field("blocks", "liquids", "conditions")
    offered = {field.names.itemText(at) for at in range(field.names.count())}
    titles = {title_of(designer.study.document, ("conditions", name)) for name in {*conditions} - {*listed}}
    shipped = {name for name in offered if " liquid, " in name}
    assert offered - shipped == {*titles, "New condition…"}
    assert any(name.startswith("Honey") for name in shipped)
    assert (field.names.currentText(), field.names.placeholderText()) == ("", "Add…")


def test_add_to_the_session_shows_titles(designer: Any) -> None:
    designer.open("kitchen", "sequence")
    names = designer.field("sequence").names
    at = names.findText("Page A first look")
    assert at >= 0, "a step can be repeated"
    names.activated.emit(at)
    assert designer.value("sequence")[-1] == "welcome"


def test_the_next_problem_of_a_scale_is_its_first_missing_label(designer: Any) -> None:
    designer.open("kitchen", "scales", "agreement")
    english = list(designer.value("scales", "agreement", "labels", "en"))
    labels = {"en": english, "fr": ["pas du tout", *[""] * (len(english) - 2), "tout à fait"]}
    designer.editing.make_step(
        "Change", Set(("study", "languages"), ["en", "fr"]), Set(("scales", "agreement", "labels"), labels)
    )
    field = designer.field("scales", "agreement", "labels")
    designer.place.form.focus_row(("scales", "agreement", "labels"))
    assert designer.keyboard is field.lines[1][1]


def test_the_wheel_over_a_list_or_a_text_leaves_keyboard_and_value(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    title = designer.field("blocks", "liquids", "title").lines["en"]
    title.setFocus()
    before = designer.text
    for part in (designer.field("blocks", "liquids", key).list for key in ("task", "questionnaire")):
        designer.place.form.area.ensureWidgetVisible(part)
        at = part.mapTo(designer.window, part.rect().center())
        QTest.wheelEvent(designer.window.windowHandle(), QPointF(at), QPoint(0, -120))
        QApplication.processEvents()
        assert designer.keyboard is title
    assert designer.text == before
    designer.go_to("pages", "welcome")
    body = designer.field("pages", "welcome", "body").lines["en"]
    designer.place.form.head.id.setFocus()
    QTest.wheelEvent(
        designer.window.windowHandle(), QPointF(body.mapTo(designer.window, QPoint(9, 9))), QPoint(0, -120)
    )
    assert designer.keyboard is designer.place.form.head.id


def test_an_incomplete_language_is_marked_with_its_whole_name(designer: Any) -> None:
    designer.open("kitchen", "study", width=1920)
    designer.editing.handle_request(ChangeLanguage("add", "fr"))
    designer.editing.make_step("Change", Set((*ITEMS, 0, "text"), {"en": "Honey", "fr": "Honey"}))
    QApplication.processEvents()
    rows = designer.field("study", "languages").rows
    assert "French" in [label.text() for label in rows[-1].findChildren(QLabel)]
    assert rows[-1].accessibleName().startswith("French, ")
    assert {row.property("role") for row in rows} == {"entry"}
    assert [row.property("state") for row in rows] == [*[""] * (len(rows) - 1), "refused"]


@pytest.mark.parametrize("row", [("scales", "agreement", "labels"), (*ITEMS, 0, "text")])
def test_any_language_from_right_to_left_is_typed_so(
    designer: Any, monkeypatch: pytest.MonkeyPatch, row: tuple[str | int, ...]
) -> None:
    monkeypatch.setattr("study_app.protocol.wording.languages.RIGHT_TO_LEFT", {"en"})
    designer.open("kitchen", *row[:-1])
    field = designer.field(*row)
    lines = [*field.findChildren(QLineEdit), *field.findChildren(QPlainTextEdit)]
    assert {line.layoutDirection() for line in lines} == {Qt.LayoutDirection.RightToLeft}


def test_a_field_does_not_move_while_its_row_shrinks(designer: Any) -> None:
    """After a message disappears, row and form are too high until Qt has laid them out."""
    designer.open("kitchen", "blocks", "liquids")
    (line,) = designer.field("blocks", "liquids", "title").findChildren(QLineEdit)
    for higher in (designer.form_row("blocks", "liquids", "title"), designer.place.form.panel):
        before = line.mapTo(higher, QPoint())
        higher.resize(higher.width(), higher.height() + 80)
        higher.layout().activate()
        assert line.mapTo(higher, QPoint()) == before


def test_each_trial_design_has_its_own_picture(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "toldapart")
    (block,) = (name for name, facts in designer.study.document["blocks"].items() if "design" in facts)
    designer.go_to("blocks", block)
    designs = designer.field("blocks", block, "design").list
    pictures = {designs.itemText(at).partition(" ")[0]: designs.itemIcon(at).pixmap(80, 14).toImage()
                for at in range(designs.count()) if not designs.itemIcon(at).isNull()}  # fmt: skip
    assert {"abx", "2ifc", "3ifc", "4ifc", "oddity", "samedifferent"} <= pictures.keys()
    assert len({bytes(picture.constBits()) for picture in pictures.values()}) == len(pictures)


def test_the_picture_of_a_design_fills_the_comparisons_and_ends_with_the_sign_of_its_reply(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "toldapart")
    (block,) = (name for name, facts in designer.study.document["blocks"].items() if "design" in facts)
    designer.go_to("blocks", block)
    designs, ratio = designer.field("blocks", block, "design").list, 3
    side, gap = 14 * ratio, 4 * ratio
    letters = {designs.theme.accent: "C", designs.theme.surface: "S"}
    signs = {}
    for kind, intervals in {
        "abx": "CSS", "2ifc": "SC", "3ifc": "SSC", "4ifc": "SSSC", "oddity": "CCS", "samedifferent": "CS",
    }.items():  # fmt: skip
        icon = next(designs.itemIcon(at) for at in range(designs.count()) if designs.itemText(at).split(" ")[0] == kind)
        image = icon.pixmap(designs.iconSize(), ratio).toImage()
        lefts = range(0, image.width() - side + 1, side + gap)
        outlined = [image.pixelColor(left + ratio, side // 2).name().upper() == designs.theme.accent for left in lefts]
        assert outlined == [at < len(intervals) for at in range(len(lefts))], kind
        middles = [image.pixelColor(left + side // 2, side // 2) for left in lefts[: len(intervals)]]
        assert "".join(letters[colour.name().upper()] for colour in middles) == intervals, kind
        for left in lefts[: len(intervals)]:  # a pixel's width of the outline is smoothed
            edge = [(left, side // 2), (left + side, side // 2), (left + side // 2, 0), (left + side // 2, side - 1)]
            assert max(image.pixelColor(*point).alpha() for point in edge) < 64, kind
        reply = image.copy(lefts[len(intervals)], 0, 2 * side, side)
        signs[kind] = bytes(reply.constBits())
    assert signs["2ifc"] == signs["3ifc"] == signs["4ifc"] == signs["abx"]
    assert len({signs[kind] for kind in ("abx", "oddity", "samedifferent")}) == 3


def test_help_of_two_lines_does_not_move_the_form(designer: Any) -> None:
    designer.open("kitchen", "study")
    form, heights = designer.place.form, set()
    for words in ("One line.", "Two lines. " * 12):
        form.foot.show_help("Field", "study.field", words)
        for _ in range(3):  # the label, its foot and the form are laid out one after the other
            QApplication.processEvents()
        heights.add(form.area.height())
    assert len(heights) == 1


def test_the_help_names_the_key_that_removes_a_field(designer: Any) -> None:
    designer.open("kitchen", "study")
    form = designer.place.form
    for key, removable in (("version", True), ("name", False)):
        designer.field("study", key).take_keyboard()
        form.show_help_of(designer.field("study", key))
        assert form.foot.place.whole.startswith("remove (Ctrl+Del) · ") is removable


def test_a_default_of_one_value_is_shown_without_brackets(designer: Any) -> None:
    designer.open("kitchen", "liquids", "thin")
    designer.editing.handle_request(RemoveKey(("liquids", "thin", "effects")))
    assert designer.form_row("liquids", "thin", "effects").row.default == ["drag"]
    assert designer.field("liquids", "thin", "effects").inner.list.currentText() == "drag"


def test_conditions_are_listed_with_other_liquids_delay_and_whether_the_force_is_limited(designer: Any) -> None:
    designer.open()
    names = ("thin", "late", "both", "gone")
    for path, value in (
        (("conditions", "both"), {"liquids": ["thin", "thick"], "delay_ms": 7}),
        (("blocks", "liquids", "conditions"), names),
    ):
        designer.editing.make_step("Change", Set(path, value))
    designer.go_to("blocks", "liquids")
    facts = designer.form_row("blocks", "liquids", "conditions").row.facts
    assert {name: (fact.note, fact.liquid) for name, fact in zip(names, facts, strict=True)} == {
        "thin": ("0 ms late", ("liquids", "thin")),
        "late": ("Thin, 200 ms late", ("liquids", "thin")),
        "both": ("2 liquids, 7 ms late", None),
        "gone": ("not in the study", None),
    }


def test_the_faults_of_a_row_are_below_its_field_and_above_its_repairs(qtbot: Any, designer: Any) -> None:
    designer.open()
    designer.editing.make_step("Remove a key", Unset(("liquids", "thin", "density_kg_m3")))
    designer.go_to("liquids", "thin")
    row = designer.form_row("liquids", "thin", "density_kg_m3")
    qtbot.waitUntil(lambda: bool(row.repairs))
    QApplication.processEvents()
    tops = [part.mapTo(row, QPoint()).y() for part in (row.field, row.fault_line, row.repairs[0])]
    assert tops == sorted(set(tops)), tops


def test_a_text_is_handed_in_at_once_when_its_field_loses_the_keyboard_but_not_by_a_click(designer: Any) -> None:
    """A click may hit a widget that the step would remove."""
    designer.open("kitchen", "conditions", "late")
    line = designer.field("conditions", "late", "delay_ms").findChild(QLineEdit)
    for number, reason in enumerate(Qt.FocusReason, start=137):
        before = designer.value("conditions", "late", "delay_ms")
        line.setFocus()
        line.selectAll()
        QTest.keyClicks(line, str(number))
        QApplication.sendEvent(line, QFocusEvent(QEvent.Type.FocusOut, reason))
        after = designer.value("conditions", "late", "delay_ms")
        assert after == (before if reason == Qt.FocusReason.MouseFocusReason else number), reason


def test_the_texts_of_questions_stand_in_a_column_for_each_language(designer: Any) -> None:
    designer.open("kitchen")
    designer.editing.handle_request(ChangeLanguage("add", "nl"))
    texts = [{"en": "Thin?", "nl": "Dun?"}, {"en": "Honey" * 9, "nl": "Dik?"}, {"en": "New?", "nl": "Vers" * 20}]
    items = designer.value(*ITEMS)
    changed = [{**items[0], "id": f"q{number}", "text": text} for number, text in enumerate(texts)]
    designer.editing.make_step("Change", Set(ITEMS, changed))
    designer.go_to(*QUESTIONNAIRE)
    places: dict[str, set[tuple[int, int]]] = {"en": set(), "nl": set()}
    for label in designer.place.form.findChildren(QLabel):
        for language, positions in places.items():
            if label.isVisible() and label.text() in {text[language] for text in texts}:
                positions.add((label.mapTo(designer.window, QPoint()).x(), label.width()))
    assert [len(place) for place in places.values()] == [1, 1], places


@pytest.mark.parametrize("blocked", [None, "activePopupWidget", "mouseButtons"])
def test_typed_text_waits_for_an_open_list_and_a_pressed_button(
    designer: Any, monkeypatch: pytest.MonkeyPatch, blocked: str | None
) -> None:
    designer.open("kitchen", "conditions", "late")
    line = designer.field("conditions", "late", "delay_ms").findChild(QLineEdit)
    line.setFocus()
    line.selectAll()
    QTest.keyClicks(line, "137")
    if blocked is not None:
        held = designer.window if blocked == "activePopupWidget" else Qt.MouseButton.LeftButton
        monkeypatch.setattr(f"study_app.designer.form.fields.QApplication.{blocked}", lambda: held)
    line._flush_after_click()
    assert (designer.value("conditions", "late", "delay_ms") == 137) == (blocked is None)
    assert line.pending == line._submit_timer.isActive() == (blocked is not None)


def test_a_bound_that_is_not_a_number_is_refused_with_the_value_that_stays(qtbot: Any) -> None:
    line, refusals, tables = Hypothesis("Hypothesis 1"), list[str](), list[Any]()
    qtbot.addWidget(line)
    line.show_value({"measure": "like_honey", "bound": 0.4}, ())
    line.refused.connect(refusals.append)
    line.changed.connect(tables.append)
    for typed in ("a lot", "0.75"):
        line.bound.setText(typed)
        line.bound.typed.emit(typed)
    assert len(refusals) == 2
    assert "a lot" in refusals[0]
    assert "0.4" in refusals[0]
    assert refusals[1] == ""
    assert tables == [{"measure": "like_honey", "bound": 0.75}]


def test_the_help_at_the_foot_of_a_form_is_hidden_while_the_form_is_low(qtbot: Any) -> None:
    form = FormCard()
    qtbot.addWidget(form)
    form.resize(500, 700)
    form.show()
    for height, is_shown in ((459, False), (460, True), (351, False), (803, True)):
        form.resize(500, height)
        settle(form)
        assert (form.height(), form.foot.isVisible()) == (height, is_shown)
        form.show_note("Deleted Late. Ctrl+Z restores it.")
        assert form.foot.isVisible()
        form.show_help()
        assert form.foot.isVisible() == is_shown


@pytest.mark.parametrize("kind", [TypedText, TypedSentence])
def test_a_text_of_several_lines_leaves_undo_and_tab_to_the_form(qtbot: Any, kind: type[TypedText]) -> None:
    window, text, other = QWidget(), kind("Body, English"), QLineEdit()
    vbox(text, other, parent=window)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    undone = list[str]()
    text.typed.connect(undone.append)
    text.setFocus()
    QTest.keyClicks(text, "stir")
    assert text.typed_text() == "stir"
    QTest.keySequence(text, QKeySequence(QKeySequence.StandardKey.Undo))
    assert (undone, text.typed_text()) == (["stir"], "stir"), "the form undoes the step that it gets"
    menu = text.createStandardContextMenu()
    assert not [action.text() for action in menu.actions() if action.isEnabled() and "Undo" in action.text()]
    menu.deleteLater()
    QTest.keyClick(text, Qt.Key.Key_Tab)
    assert (other.hasFocus(), text.typed_text()) == (True, "stir")
    assert (text.accessibleName(), text.focusPolicy()) == ("Body, English", Qt.FocusPolicy.StrongFocus)


def test_a_sentence_grows_as_its_field_becomes_narrower_up_to_its_lines(qtbot: Any) -> None:
    max_lines = 3
    sentence = TypedSentence("Description, English", max_lines=max_lines)
    qtbot.addWidget(sentence)
    sentence.show_text("stir the thin liquid slowly and hold the ball still")
    line_px = sentence.fontMetrics().lineSpacing()
    text_px = sentence.fontMetrics().horizontalAdvance(sentence.typed_text())
    sentence.resize(2 * text_px, sentence.height())
    sentence.show()
    is_high = Qt.ScrollBarPolicy.ScrollBarAsNeeded
    for fraction, lines, scrolls in ((2.0, 1, False), (0.75, 2, False), (0.2, max_lines, True), (2.0, 1, False)):
        sentence.resize(round(fraction * text_px), sentence.height())
        assert sentence.height() == max(FIELD_PX, lines * line_px + SENTENCE_EDGE_PX), fraction
        assert (sentence.verticalScrollBarPolicy() == is_high) == scrolls, fraction


def test_a_segment_has_room_for_its_text_in_bold_and_9_px_on_each_side(qtbot: Any) -> None:
    segments = Segments("Order")
    qtbot.addWidget(segments)
    segments.show_values([("drawn", "Drawn"), ("fixed", "Fixed for all")], "drawn")
    hints = [button.sizeHint() for button in segments.buttons]
    bold = QFontMetricsF(font("label", weight=600))
    text_px = [round(bold.horizontalAdvance(text)) for text in ("Drawn", "Fixed for all")]
    assert [hint.width() for hint in hints] == [width + 9 + 9 for width in text_px]
    assert {hint.height() for hint in hints} == {SEGMENT_PX}


def test_a_sentence_never_scrolls_sideways(qtbot: Any) -> None:
    sentence = TypedSentence("Description, English")
    qtbot.addWidget(sentence)
    across = sentence.horizontalScrollBar()
    across.setRange(2, 30)  # as Qt does for a caret after a trailing space
    assert (across.minimum(), across.maximum()) == (0, 0)


def test_undo_in_a_text_undoes_the_step_of_the_study(designer: Any) -> None:
    path = ("pages", "welcome", "body")
    designer.open("kitchen")
    designer.go_to(*path[:-1])
    before, body = designer.text, designer.value(*path)
    text = designer.field(*path).lines["en"]
    text.setFocus()
    text.selectAll()
    QTest.keyClicks(text, "Stir slowly")
    assert (text.pending, designer.value(*path)) == (True, body), "it is not a step yet"
    designer.hit("ctrl+z")
    assert (designer.text, text.typed_text()) == (before, body)
    designer.hit("ctrl+shift+z")
    assert (designer.value(*path), text.typed_text()) == ("Stir slowly", "Stir slowly")


def test_the_caret_is_at_the_end_of_a_text_that_is_not_or_completely_selected(designer: Any) -> None:
    designer.open("kitchen")
    designer.go_to("pages", "welcome")
    text: Any = designer.window.findChildren(QPlainTextEdit)[0]
    text.show_text("Stir slowly\nand rest")
    for anchor, caret, is_at_end in ((0, 0, False), (20, 20, True), (19, 19, False), (0, 20, True), (3, 20, False)):
        cursor = text.textCursor()
        cursor.setPosition(anchor)
        cursor.setPosition(caret, QTextCursor.MoveMode.KeepAnchor)
        text.setTextCursor(cursor)
        assert text.is_at_end() == is_at_end, (anchor, caret)


def test_a_hypothesis_shows_its_comparison_and_names_missing_elements(qtbot: Any) -> None:
    shared, own = ("like_honey", "Like honey"), ("thickness", "Thickness")
    thin = Compared(key="conditions", block="liquids", name="thin", label="Thin in Liquids", measures=(own, shared))
    thick, warm = (
        replace(thin, name=name, label=f"{name.capitalize()} in Liquids", measures=(shared,))
        for name in ("thick", "warm")
    )
    line = Hypothesis("Hypothesis 1")
    qtbot.addWidget(line)
    table = {"blocks": ("liquids",), "conditions": ("thin", "warm"), "measure": "like_honey", "expected": "lower"}
    line.show_value(table, (thin, thick, warm))
    texts = [box.currentText() for box in (line.measure, line.first, line.relation, line.second)]
    assert texts == ["Like honey", "Thin in Liquids", "is lower than", "Warm in Liquids"]
    assert line.bound.isHidden()
    line.show_value({**table, "conditions": ("thin", "gone"), "form": "after", "bound": 0.75}, (thin, thick, warm))
    assert (line.first.currentText(), line.second.currentIndex(), line.measure.currentIndex()) == (
        "Thin in Liquids", -1, -1
    )  # fmt: skip
    placeholders = [box.placeholderText() for box in (line.measure, line.first, line.second)]
    assert placeholders == ["after/like_honey", "thin", "gone"]
    assert [line.measure.itemText(index) for index in range(line.measure.count())] == ["Thickness", "Like honey"]
    assert (line.bound.isHidden(), line.bound.typed_text()) == (False, "0.75")


RELATIONS: list[tuple[dict[str, Any], dict[str, dict[str, Any]]]] = [
    # a hypothesis, and what each relation that is chosen makes of it
    (
        {},
        {
            "is different from": {},
            "is higher than": {"expected": "higher"},
            "is lower than": {"expected": "lower"},
            "is equal to": {"bound": 0.5},
        },
    ),
    (
        {"bound": 0.4},
        {
            "is different from": {},
            "is higher than": {"expected": "higher"},
            "is lower than": {"expected": "lower"},
            "is equal to": {"bound": 0.4},
        },
    ),
    (
        {"expected": "lower"},
        {
            "is different from": {},
            "is higher than": {"expected": "higher"},
            "is lower than": {"expected": "lower"},
            "is equal to": {"bound": 0.5},
        },
    ),
    (
        {"expected": "higher", "bound": 0.7},
        {
            "is different from": {},
            "is higher than": {"expected": "higher", "bound": 0.7},
            "is lower than": {"expected": "lower", "bound": 0.7},
            "is equal to": {"bound": 0.7},
        },
    ),
]


@pytest.mark.parametrize("is_known", [True, False], ids=["compared", "not in the study"])
@pytest.mark.parametrize(("stated", "chosen"), RELATIONS)
def test_a_chosen_relation_keeps_a_bound_that_fits_it(
    qtbot: Any, stated: dict[str, Any], chosen: dict[str, dict[str, Any]], is_known: bool
) -> None:
    """A bound without a direction states an equality, which can be replaced by a difference in one step."""
    thin, thick = (
        Compared(key="conditions", block="liquids", name=name, label=name, measures=(("harder", "Harder"),))
        for name in ("thin", "thick")
    )
    line, tables = Hypothesis("Hypothesis 1"), list[dict[str, Any]]()
    qtbot.addWidget(line)
    line.changed.connect(tables.append)
    compared = {"measure": "harder", "blocks": ("liquids",), "conditions": ("thin", "thick")}
    for relation, expected in chosen.items():
        line.show_value(compared | stated, (thin, thick) if is_known else ())
        line.relation.setCurrentText(relation)
        line.relation.activated.emit(line.relation.currentIndex())
        table = {key: tuple(value) if isinstance(value, list) else value for key, value in tables[-1].items()}
        assert table == compared | expected, relation
        line.show_value(table, (thin, thick) if is_known else ())
        assert line.relation.currentText() == relation


@pytest.mark.parametrize(("extent", "bound"), [(6, 0.5), (100, 5)])
def test_a_new_equality_on_a_wide_scale_has_a_bound_of_5_percent(qtbot: Any, extent: float, bound: float) -> None:
    late, prompt = (
        Compared(key="blocks", block=name, name=name, label=name, measures=(("load/raw", "Raw score"),),
                 ranges={"load/raw": extent})
        for name in ("late", "prompt")
    )  # fmt: skip
    line, tables = Hypothesis("Hypothesis 1"), list[dict[str, Any]]()
    qtbot.addWidget(line)
    line.changed.connect(tables.append)
    line.show_value({"measure": "raw", "form": "load", "blocks": ("late", "prompt")}, (late, prompt))
    line.relation.setCurrentText("is equal to")
    line.relation.activated.emit(line.relation.currentIndex())
    assert tables[0]["bound"] == bound


def test_the_ranges_of_questions_and_scores_are_those_of_their_scales() -> None:
    protocol = parse(text_of("mixed").encode(), "mixed.toml")
    after = protocol.questionnaires["after"].ranges(protocol.scales, "en")
    assert after == {"feels_liquid": 6, "thickness": 4, "pleasant": 100}
    assert protocol.questionnaires["load"].ranges(protocol.scales, "en")["raw"] == pytest.approx(100)


@pytest.mark.parametrize(
    ("measure", "bound"), {"threshold": 1.25, "pse": 1.25, "d_prime": 0.5, "exponent": 0.5}.items()
)
def test_a_new_equality_of_thresholds_is_bounded_by_a_ratio(qtbot: Any, measure: str, bound: float) -> None:
    line, tables = Hypothesis("Hypothesis 1"), list[dict[str, Any]]()
    qtbot.addWidget(line)
    line.changed.connect(tables.append)
    line.show_value({"measure": measure, "blocks": ("thin", "thick"), "expected": "lower"}, ())
    line.relation.setCurrentText("is equal to")
    line.relation.activated.emit(line.relation.currentIndex())
    assert tables == [{"measure": measure, "blocks": ("thin", "thick"), "bound": bound}]


def test_each_point_of_a_list_is_typed_kept_and_removed_by_itself(designer: Any) -> None:
    path = ("tasks", "reach", "targets_mm")
    designer.open()
    points = ((-31, 2, 3), (34, 5, 6), (7, -8, 9))
    designer.editing.make_step("Change", Set(path, points))
    designer.go_to("tasks", "reach")
    field = designer.field(*path)
    assert [line.typed_text() for line in field.lines] == ["-31  2  3", "34  5  6", "7  -8  9"]
    designer.fill(field.lines[1], "34, five, 6")
    assert designer.value(*path) == points
    assert [bool(line.property("state")) for line in field.lines] == [False, True, False]
    sentence = "The study still contains 34  5  6; press Esc to restore it."
    assert [label.text() for label in designer.form_row(*path).findChildren(QLabel) if sentence in label.text()]
    designer.fill(field.lines[1], "34.5, -5, 0")
    assert designer.value(*path) == (points[0], (34.5, -5, 0), points[2])
    assert not any(line.property("state") for line in field.lines)
    field.list.setCurrentRow(1)
    field.list.clearSelection()
    field.list.setFocus(Qt.FocusReason.TabFocusReason)
    assert field.chosen == 1, "the keyboard returns to the current row"
    designer.hit("Delete")
    assert designer.value(*path) == (points[0], points[2])
    assert field.chosen == 1


def test_each_language_is_copied_and_removed_by_its_own_buttons(designer: Any) -> None:
    designer.open()
    for code in ("fr", "nl"):
        designer.editing.handle_request(ChangeLanguage("add", code))
    designer.go_to("study")
    field, requests = designer.field("study", "languages"), list[Any]()
    field.asked.disconnect()
    field.asked.connect(requests.append)
    languages = {"en": "English", "fr": "French", "nl": "Dutch"}
    names = [[button.accessibleName() for button in row.findChildren(QAbstractButton)] for row in field.rows]
    removals = [f"Remove {language} from every text" for language in languages.values()]
    write, copy = "Write the texts that are missing in {}", "Copy the English text wherever {} is missing"
    assert names == [
        [removals[0]], *([write.format(language), copy.format(language), removal]
                         for language, removal in zip(("French", "Dutch"), removals[1:], strict=True))
    ]  # fmt: skip
    for row in field.rows:
        row.findChildren(QAbstractButton)[-1].click()
    for copy_button in field.copies.values():
        copy_button.click()
    assert list(field.copies) == ["fr", "nl"]
    removed, copied = (
        (ChangeLanguage("remove", code) for code in languages),
        (ChangeLanguage("copy", code) for code in ("fr", "nl")),
    )
    assert requests == [*removed, *copied]
    offered = [field.names.itemData(index) for index in range(field.names.count())]
    assert offered
    assert not {*offered} & {*languages}
    field.names.activated.emit(len(offered) - 1)
    assert requests[-1] == ChangeLanguage("add", offered[-1])


def test_a_new_study_refuses_an_answer_that_is_not_a_number_and_names_its_question(qtbot: Any) -> None:
    shared_values = {"text": "Trials", "unit": "", "bounds": "at least 1"}
    trials = TemplateQuestion(path=("methods", "adaptive", "trials"), value="40", **shared_values)
    standards = TemplateQuestion(path=("stimuli", "damping", "standards"), value="4, 8", several=True,
                                 **{**shared_values, "text": "Standards"})  # fmt: skip
    choice = replace(template_choice("empty", template("empty")), languages=("nl",), questions=(trials, standards))
    questions = Questions()
    qtbot.addWidget(questions)
    questions.show_choice(choice)
    assert questions.answers() == Answers("", ("nl",), ())
    for question, text, sentence in (
        (trials, "many", "Trials: “many” is not a number"),
        (trials, "1,500", "Trials: “1,500” can be read as 1.5 or 1500: write 1.5 or 1500"),
        (standards, "4; x", "Standards: “x” is not a number"),
        (standards, " ; ", "Standards: Enter at least one number"),
    ):
        field = questions.template_fields[question]
        field.setText(text)
        assert questions.answers() == sentence
        field.setText(question.value)
    questions.title.setText("  Two oils ")
    questions.languages["en"].setChecked(True)
    questions.template_fields[trials].setText(" 60 ")
    questions.template_fields[standards].setText("3, 5.5")
    answers = Answers("Two oils", ("en", "nl"), ((trials.path, 60), (standards.path, [3, 5.5])))
    assert questions.answers() == answers
    for check in questions.languages.values():
        check.setChecked(False)
    assert questions.answers() == "choose at least one language"


def test_the_balance_of_an_order_is_shown_beside_it_with_its_reason(designer: Any) -> None:
    block = ("blocks", "liquids")
    designer.open("kitchen", *block)
    chip = designer.field(*block, "order").extra
    fixed = "The effects of condition and position cannot be separated."
    latin = "Positions and carry-over are balanced for any multiple of 2 participants."
    for order, text, sentence in (("fixed", "same for everyone", fixed), ("latin", "balanced for 2, 4, 6 …", latin)):
        designer.editing.make_step("Change", Set((*block, "order"), order))
        QApplication.processEvents()
        assert (chip.accessibleName(), chip.accessibleDescription(), chip.isHidden()) == (text, sentence, False)
        assert sentence in chip.toolTip()
    designer.editing.make_step("Change", Set((*block, "conditions"), ["thin"]))
    QApplication.processEvents()
    assert chip.isHidden(), "the order of a single condition has no balance"


def test_a_read_only_study_shows_its_problems_without_repairs(qtbot: Any, designer: Any) -> None:
    path = ("liquids", "thin", "density_kg_m3")
    designer.open()
    designer.editing.make_step("Remove a key", Unset(path))
    designer.go_to("liquids", "thin")
    qtbot.waitUntil(lambda: bool(designer.form_row(*path).repairs))
    form = designer.place.form
    form.show_form(form.form, read_only=True)
    form.show_repairs(dict.fromkeys(problem_rows(designer.study), ("Repair",)))
    row = designer.form_row(*path)
    assert row.repairs == []
    assert not row.fault_line.isHidden()
