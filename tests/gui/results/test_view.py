"""The results window draws a view and says what is asked for; it knows no file and computes nothing."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QLabel

from study_app.gui.results.view import ResultsPlace
from study_app.gui.theme.theme import DARK
from study_app.gui.widgets.controls import ActionButton
from study_app.viewmodels.results import FigureShown, Going, Opened, Trouble
from tests.gui.results.sample import LEFT_OUT, STUDY, SVG, facts, view
from tests.gui.windows import results

pytestmark = pytest.mark.slow


@pytest.fixture
def place(qtbot):
    return results(qtbot)


def click(qtbot, button):
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def decided(qtbot, asked, dialog, by, reason):
    """Press the button of a dialog without a name, then with a name and a reason; return what is asked for."""
    click(qtbot, dialog.go_on)
    assert dialog.isVisible()
    assert "name" in dialog.missing.text()
    dialog.by.setText(by)
    qtbot.keyClick(dialog.by, Qt.Key.Key_Return)
    assert "reason" in dialog.missing.text()
    dialog.reason.setText(reason)
    with qtbot.waitSignal(asked) as heard:
        click(qtbot, dialog.go_on)
    return heard.args


def test_what_needs_care_is_first_and_an_open_study_says_by_whom_and_why(place):
    assert place.sessions.rows.shown[0].participant == "P007"
    assert place.sessions.head.text() == "6 of 7 sessions in the figures"
    assert place.sessions.why.text() == "P007 is not complete."
    by = Opened(datetime(2026, 11, 19, tzinfo=UTC), "AK", "collection closed, " + "and so on " * 20)
    place.show_view(replace(view(), sealed=False, opened=by))
    assert place.chips[1].word.startswith("Unblinded 19 Nov by AK: collection closed")
    assert place.chips[1].toolTip() == by.words
    assert not place.unblind.isVisible()


@pytest.mark.parametrize(("width", "stacked"), [(1024, True), (1920, False)])
def test_figures_keep_their_proportions_and_stand_below_the_sessions_in_a_narrow_window(place, qtbot, width, stacked):
    place.main.resize(width, 1080)

    def fits():
        for card in place.figures.cards:
            assert card.drawing.settled
            assert card.drawing.height() == card.drawing.heightForWidth(card.drawing.width())

    qtbot.waitUntil(fits)
    figures, sessions = (part.mapTo(place, QPoint()).y() for part in (place.figures, place.sessions))
    assert (figures > sessions + 100) is stacked


def test_sessions_are_searched_and_filtered(place, qtbot):
    def shown():
        return [one.participant for one in place.sessions.rows.shown]

    qtbot.keyClicks(place.sessions.search, "p00")
    assert len(shown()) == 7
    qtbot.keyClicks(place.sessions.search, "3")
    assert shown() == ["P003"]
    place.sessions.state.setFocus()
    qtbot.keyClick(place.sessions.state, Qt.Key.Key_Tab)
    assert place.sessions.rows.table.hasFocus(), "the keyboard finds what is shown"
    place.sessions.search.clear()
    place.sessions.state.setCurrentIndex(place.sessions.state.findData("unfinished"))
    assert shown() == ["P007"]
    place.sessions.search.setText("P001")
    assert shown() == []
    assert place.sessions.rows.none.isVisible()
    place.show_view(replace(view(), sessions=(*view().sessions, facts("P020", status="unfinished"))))
    assert place.sessions.state.currentData() == "unfinished", "what was filtered stays so when sessions come"


def test_rows_are_chosen_by_the_keyboard_and_the_choice_begins_the_dialog(place, qtbot):
    table = place.sessions.rows.table
    place.sessions.state.setFocus()
    qtbot.keyClick(place.sessions.state, Qt.Key.Key_Tab)
    assert table.hasFocus()
    for _ in range(3):
        qtbot.keyClick(table, Qt.Key.Key_Down)
    assert place.sessions.rows.chosen.participant == "P003"
    qtbot.keyClick(table, Qt.Key.Key_Up)
    assert place.sessions.rows.chosen.participant == "P002"
    place.show_view(replace(view(), sessions=(facts("P000"), *view().sessions)))
    assert place.sessions.rows.chosen.participant == "P002", "what was chosen stays so when sessions come"
    click(qtbot, place.exclusions.leave_out)
    assert place.dialog.session.currentText() == "P002"
    place.dialog.reject()


def test_leaving_out_wants_a_name_and_a_reason(place, qtbot):
    place.sessions.rows.table.selectRow(1)
    click(qtbot, place.exclusions.leave_out)
    dialog = place.dialog
    assert [dialog.trial.itemText(at) for at in range(3)] == [
        "Whole session", "Trial 2: Part 1, L2", "Trial 3: Part 1, L1"
    ]  # fmt: skip
    dialog.trial.setCurrentIndex(2)
    asked = decided(qtbot, place.leave_out_asked, dialog, "AK", "phone rang")
    assert asked == [("P001", 1, 3, "AK", "phone rang")]


def test_unblinding_warns_of_sessions_that_go_on(place, qtbot):
    click(qtbot, place.unblind)
    dialog = place.dialog
    said = " ".join(one.text() for one in dialog.findChildren(QLabel))
    assert "1 session is not complete" in said
    assert "cannot be undone" in said
    assert decided(qtbot, place.unblind_asked, dialog, "AK", "closed") == ["AK", "closed"]


def test_what_is_left_out_is_listed_the_last_first_with_its_reason(place, qtbot):
    assert place.exclusions.none.isVisible()
    place.show_view(replace(view(), left_out=(LEFT_OUT, replace(LEFT_OUT, what="P005", reason="asleep"))))
    assert [line.accessibleName().split(" (")[0] for line in place.exclusions.lines] == [
        "P005: asleep",
        "P003, trial 4: phone rang",
    ]
    with qtbot.waitSignal(place.open_asked) as asked:
        click(qtbot, place.exclusions.open)
    assert asked.args[0] == STUDY / "exclusions.csv"


def test_what_is_left_out_is_taken_back_with_a_name_and_a_reason(place, qtbot):
    place.show_view(replace(view(), left_out=(LEFT_OUT,)))
    back = place.exclusions.lines[0].findChild(ActionButton)
    assert back.accessibleName() == "Include again: P003, trial 4"
    click(qtbot, back)
    asked = decided(qtbot, place.take_back_asked, place.dialog, "CD", "wrong trial")
    assert asked == [("P003", 1, 4, "CD", "wrong trial")]
    back.setFocus()
    place.show_view(view())
    assert place.window().focusWidget() is place.exclusions.leave_out


def test_choosing_a_study_asks_for_it_and_showing_one_does_not(place, qtbot):
    asked = []
    place.study_asked.connect(asked.append)
    place.show_view(replace(view(), chosen=Path("results/demo")))
    assert asked == []
    place.study.setFocus()
    qtbot.keyClick(place.study, Qt.Key.Key_Up)
    assert asked == [STUDY]


@pytest.mark.parametrize("sealed", [True, False])
def test_outputs_say_that_settings_appear_as_codes_while_the_key_is_sealed_and_what_cannot_be_written(qtbot, sealed):
    place = ResultsPlace(handed_to=Path(), no_sav="It needs pyreadstat.")
    qtbot.addWidget(place)
    place.show_view(view(sealed=sealed))
    place.show()
    for button in (place.export, place.report):
        click(qtbot, button)
        said = [one.text() for one in place.writing.findChildren(QLabel)]
        (explanation,) = (text for text in said if "very " in text)
        assert explanation.endswith("Settings appear as codes because the key is sealed.") is sealed
        if button is place.export:
            assert not place.writing.extras["sav"].isEnabled()
            assert "It needs pyreadstat." in said
        place.writing.reject()


def test_exporting_asks_for_what_the_command_has(place, qtbot):
    click(qtbot, place.export)
    dialog = place.writing
    assert set(dialog.extras) == {"wide", "parquet", "sav", "psych-ds"}
    dialog.extras["wide"].click()
    dialog.to.setText("/elsewhere/tables")
    with qtbot.waitSignal(place.tables_asked) as asked:
        click(qtbot, dialog.go_on)
    assert asked.args == [Path("/elsewhere/tables"), ("wide",)]
    dialog.show_progress("making the tables", 0.3)
    assert dialog.said.text() == "Making the tables …"
    dialog.show_written([Path("/elsewhere/tables/a.csv")], Path("/elsewhere/tables"), [])
    assert dialog.said.text() == "1 file in /elsewhere/tables."
    with qtbot.waitSignal(place.open_asked) as asked:
        click(qtbot, dialog.go_on)
    assert asked.args[0] == Path("/elsewhere/tables")
    click(qtbot, dialog.cancel)
    assert place.writing is None


def test_a_report_can_be_given_up_and_a_refusal_lets_one_try_again(place, qtbot):
    click(qtbot, place.report)
    dialog = place.writing
    click(qtbot, dialog.go_on)
    dialog.show_refused("/somewhere cannot be written (Permission denied)")
    assert dialog.to.isVisible()
    click(qtbot, dialog.go_on)
    with qtbot.waitSignal(place.stop_asked):
        click(qtbot, dialog.cancel)
    assert dialog.isVisible(), "until it is known that nothing was written"
    dialog.stopped()
    assert place.writing is None


@pytest.mark.parametrize("remedy", ["again", "read", "stop"])
def test_trouble_is_one_sentence_and_one_button(place, qtbot, remedy):
    place.show_view(
        replace(view(), figures=(), trouble=Trouble("It cannot be read", "P002 is damaged.", "Look", remedy))
    )
    trouble = place.figures.trouble
    assert (trouble.title.text(), trouble.sentence.text()) == ("It cannot be read", "P002 is damaged.")
    with qtbot.waitSignal(place.remedy_asked) as asked:
        click(qtbot, trouble.button)
    assert asked.args == [remedy]
    place.show_view(view())
    assert not trouble.isVisible()


def test_reading_says_how_far_it_is_and_can_be_stopped(place, qtbot):
    place.show_view(replace(view(), figures=(), drawing=Going("drawing", 0.4)))
    assert place.figures.trouble.title.text() == "Drawing …"
    with qtbot.waitSignal(place.remedy_asked) as asked:
        click(qtbot, place.figures.trouble.button)
    assert asked.args == ["stop"]
    place.show_view(replace(view(), testing=Going("testing: Unusable", 0.4)))
    assert place.figures.work.isVisible()
    assert not place.figures.trouble.isVisible()
    place.show_view(replace(view(), untested=True))
    with qtbot.waitSignal(place.remedy_asked) as asked:
        click(qtbot, place.figures.work.again)
    assert asked.args == ["read"]


def test_a_figure_drawn_again_keeps_its_card_and_its_caption_can_be_read(place, qtbot):
    card = place.figures.cards[1]
    click(qtbot, card.more)
    assert card.caption.isVisible()
    again = FigureShown("delays", "Answers over added delay", "Dashed: lowest.", SVG)
    place.show_view(replace(view(), figures=(view().figures[0], again, replace(again, name="recognition"))))
    assert place.figures.cards[1] is card
    assert card.caption.text() == "Dashed: lowest."
    assert (card.drawing.accessibleName(), card.drawing.accessibleDescription()) == (again.title, again.caption)
    assert len(place.figures.cards) == 3
    place.show_view(replace(view(), figures=(replace(again, svg=b"", caption="No completed session."),)))
    assert [one.figure.name for one in place.figures.cards] == ["delays"]
    assert card.drawing is None
    assert card.caption.isVisible()
    qtbot.waitUntil(lambda: all(one.drawing is None or one.drawing.settled for one in place.figures.cards))


def test_figures_take_the_colours_of_the_theme(place, qtbot):
    drawing = place.figures.cards[0].drawing
    place.main.rail.theme_asked.emit()
    qtbot.waitUntil(
        lambda: drawing.settled and drawing.grab().toImage().pixelColor(3, 3).name() == DARK.surface.lower()
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "Reading the sessions …"),
        ({"trouble": Trouble("The study cannot be read", "It is damaged.", "Refresh", "again")}, ""),
        ({"listed": True}, "No sessions."),
    ],
)
def test_sessions_are_said_to_be_none_only_where_they_were_read(place, changes, words):
    place.show_view(view(sessions=(), **changes))
    assert (place.sessions.rows.none.text(), place.sessions.head.text()) == (words, "")
