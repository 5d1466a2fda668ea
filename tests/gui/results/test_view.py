"""The results window draws a view and says what is asked for; it knows no file and computes nothing."""

import importlib.util
import re
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QLabel

from study_app import figure_style as style
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.report.study_figures import plot
from study_app.analysis.worker_messages import FigureDrawn, LeaveOut, OpenKey, Progress, ReadStudy, TakeBack
from study_app.gui.results import figures
from study_app.gui.results.view import NO_SAV
from study_app.gui.widgets.controls import ActionButton
from study_app.workers.server import Refused
from tests.analysis.conftest import SAMPLE
from tests.gui.results.sample import LEFT_OUT, SVG, facts, view
from tests.gui.windows import results

pytestmark = pytest.mark.slow


@pytest.fixture
def place(qtbot):
    return results(qtbot)


def click(qtbot, button):
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def confirm_decision(qtbot, place, by, reason):
    """Confirm a dialog without a name, then with name and reason; return the resulting order."""
    dialog = place.dialog
    click(qtbot, dialog.go_on)
    assert dialog.isVisible()
    assert "name" in dialog.missing.text()
    dialog.editors["by"].show_value(by)
    qtbot.keyClick(dialog.editors["by"].control, Qt.Key.Key_Return)
    assert "reason" in dialog.missing.text()
    dialog.editors["reason"].show_value(reason)
    click(qtbot, dialog.go_on)
    return place.reader.orders[-1]


def test_sessions_are_searched_and_filtered(place, qtbot):
    def shown():
        return [session.participant for session in place.sessions.rows.shown]

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


def test_the_group_stands_below_the_participant_and_can_be_searched(place, qtbot):
    groups = {"P031": "novice", "P032": "expert", "P033": "novice"}
    place.show_view(replace(view(), sessions=tuple(facts(who, group=group) for who, group in groups.items())))
    model = place.sessions.rows.model
    said = [model.index(row, 0).data(Qt.ItemDataRole.AccessibleTextRole) for row in range(model.rowCount())]
    assert said == ["P031, novice", "P032, expert", "P033, novice"]
    assert place.sessions.search.placeholderText() == "Participant or group"
    qtbot.keyClicks(place.sessions.search, "Nov")
    assert [session.participant for session in place.sessions.rows.shown] == ["P031", "P033"]


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
    assert place.dialog.editors["session"].control.currentText() == "P002"
    place.dialog.reject()


def test_leaving_out_wants_a_name_and_a_reason(place, qtbot):
    place.sessions.rows.table.selectRow(1)
    click(qtbot, place.exclusions.leave_out)
    dialog = place.dialog
    assert [dialog.editors["trial"].control.itemText(at) for at in range(3)] == [
        "Whole session", "Trial 2: Part 1, L2", "Trial 3: Part 1, L1"
    ]  # fmt: skip
    dialog.editors["trial"].control.setCurrentIndex(2)
    assert confirm_decision(qtbot, place, "AK", "phone rang") == LeaveOut(
        folder=place.view.chosen, participant="P001", session=1, trial=3, by="AK", reason="phone rang"
    )


def test_a_figure_asks_for_the_width_at_which_it_is_read_and_the_height_of_its_proportion(place):
    assert place.figures.cards[0].drawing.sizeHint() == QSize(900, 450)


def test_an_answer_stands_above_its_figure_which_can_be_copied_and_saved(place, qtbot, tmp_path, monkeypatch):
    """Qt takes a list of font families for one name, which no font has."""
    drawn = []
    monkeypatch.setattr(figures, "QSvgRenderer", lambda svg: drawn.append(svg) or QSvgRenderer(svg))
    figure_fields = {
        "question": "Which liquids were distinguished?",
        "verdict": "shown",
        "answer": "Both were (p < .001, d_z 0.46).",
    }
    first = replace(view().figures[0], numbers="participant\twater\nP001\t3.0\n", **figure_fields)
    place.show_view(view(figures=(first, *view().figures[1:])))
    card, other = place.figures.cards
    assert card.question.text() == figure_fields["question"]
    assert card.answer.text() == "Both were (p &lt; .001, d<sub>z</sub> 0.46)."
    assert not other.question.isVisible()
    assert not other.copy_numbers.isVisible()
    click(qtbot, card.copy_numbers)
    assert QGuiApplication.clipboard().text() == first.numbers
    click(qtbot, card.copy_figure)
    assert QGuiApplication.clipboard().image().width() == round(200 * 300 / 72)
    QGuiApplication.clipboard().clear()
    for name, begin in (("a.svg", b"<?xml"), ("b.png", b"\x89PNG"), ("c.PDF", b"%PDF"), ("d", b"%PDF")):
        card.save_to(tmp_path / name)
        (saved,) = tmp_path.glob(f"{name}*")
        assert saved.read_bytes().startswith(begin)
    assert (tmp_path / "d.pdf").is_file()
    assert drawn
    assert all(re.findall(rb"font-family: (.*?);", svg) == [b"Inter"] * 2 for svg in drawn)
    with qtbot.waitSignal(place.message) as message:
        card.save_to(tmp_path / "none" / "a.png")
    assert "cannot be written" in message.args[1]


def test_a_click_on_a_participants_point_opens_the_session(place, qtbot):
    """The points of the test's figure are at (50, 40) and (150, 70) of 200 × 100."""
    point = '<g id="person-{}"><g clip-path="url(#p)"><use xlink:href="#m" x="{}" y="{}" style="a"/></g></g>'
    points = '<defs><path id="m" d="M 0 0"/></defs>' + point.format("P002", 50.25, 40) + point.format("P003", 150, 70.5)
    place.show_view(
        view(figures=(replace(view().figures[0], svg=SVG.replace(b"</svg>", points.encode() + b"</svg>")),))
    )
    drawing = place.figures.cards[0].drawing
    qtbot.waitUntil(lambda: drawing.is_settled)
    qtbot.mouseClick(drawing, Qt.MouseButton.LeftButton, pos=QPoint(drawing.width() // 2, drawing.height() // 2))
    assert place.dialog is None, "there is no point"
    for x, y, participant in ((0.25, 0.4, "P002"), (0.75, 0.7, "P003")):
        at = QPoint(round(x * drawing.width()) + 3, round(y * drawing.height()) - 2)
        qtbot.mouseMove(drawing, at)
        assert participant in drawing.toolTip()
        qtbot.mouseClick(drawing, Qt.MouseButton.LeftButton, pos=at)
        assert place.dialog.facts.participant == participant
        place.dialog.reject()


def test_unblinding_warns_of_sessions_that_go_on(place, qtbot):
    click(qtbot, place.unblind)
    said = " ".join(label.text() for label in place.dialog.findChildren(QLabel))
    assert "1 session is not complete" in said
    assert "cannot be undone" in said
    assert confirm_decision(qtbot, place, "AK", "closed") == OpenKey(place.view.chosen, "AK", "closed")
    assert (place.unblind.text(), place.unblind.isEnabled()) == ("Unblinding…", False)
    place.show_view(replace(place.view, drawing=Progress("opening session 2 of 3", 0.25, stops=False)))
    work, panel = place.figures.work, place.figures
    assert (work.words.whole, work.bar.share, work.stop.isVisible()) == ("Opening session 2 of 3…", 0.25, False)
    assert panel.viewport().rect().contains(work.mapTo(panel.viewport(), work.rect().center())), (
        "it is not scrolled out"
    )


def test_an_exclusion_is_undone_with_a_name_and_a_reason(place, qtbot):
    place.show_view(replace(view(), left_out=(LEFT_OUT,)))
    back = place.exclusions.lines[0].findChild(ActionButton)
    assert back.accessibleName() == "Include again: P003, trial 4"
    click(qtbot, back)
    assert confirm_decision(qtbot, place, "CD", "wrong trial") == TakeBack(
        folder=place.view.chosen, participant="P003", session=1, trial=4, by="CD", reason="wrong trial"
    )
    back.setFocus()
    place.show_view(view())
    assert place.window().focusWidget() is place.exclusions.leave_out


def test_a_proposed_exclusion_is_decided_by_a_person(place, qtbot):
    proposed = replace(LEFT_OUT, trial=None, rule_or_person="below_chance", reason="0 of 40", excluded_at="")
    rule = "Planned rule: a block has fewer correct answers than expected by chance. 1 session met this rule."
    place.show_view(replace(view(left_out=()), rules=(rule.replace("1", "No"),)))
    assert place.exclusions.summary.text().split("\n") == [
        "Nothing is excluded from the analysis.",
        rule.replace("1", "No"),
    ]
    place.show_view(replace(view(), proposed=(proposed,), rules=(rule,)))
    assert place.exclusions.summary.text() == rule
    out, keep = place.exclusions.lines[0].findChildren(ActionButton)
    assert "Proposed by the rule “below chance”; not yet decided" in place.exclusions.lines[0].accessibleName()
    click(qtbot, out)
    assert [place.dialog.value(name) for name in ("session", "trial", "by", "reason")] == [
        ("P003", 1), None, "", "0 of 40"
    ]  # fmt: skip
    assert any(
        "P003 meets the exclusion rule “below chance”. " in label.text() for label in place.dialog.findChildren(QLabel)
    )
    place.dialog.editors["by"].show_value("AB")
    click(qtbot, place.dialog.go_on)
    assert place.reader.orders[-1] == LeaveOut(
        folder=place.view.chosen, participant="P003", session=1, trial=None, by="AB", reason="0 of 40",
        rule="below_chance",
    )  # fmt: skip
    click(qtbot, keep)
    assert confirm_decision(qtbot, place, "CD", "left-handed") == TakeBack(
        folder=place.view.chosen, participant="P003", session=1, trial=None, by="CD", reason="left-handed",
        rule="below_chance",
    )  # fmt: skip


DECISION = {"folder": Path("demo"), "by": "AK", "reason": "asleep"}
TRIAL = DECISION | {"participant": "P002", "session": 1, "trial": 3}


@pytest.mark.parametrize(
    ("decision", "stays"),
    [
        (LeaveOut(**TRIAL), "Nothing was excluded"),
        (TakeBack(**TRIAL), "The exclusion still applies"),
        (OpenKey(**DECISION), "The study is still blinded"),
    ],
)
def test_a_failed_decision_is_reported_and_the_study_is_read_again(place, qtbot, decision, stays):
    place._send_order(decision, "deciding")
    with qtbot.waitSignal(place.message) as message:
        place._handle_answer(len(place.reader.orders), Refused("the disk is full"))
    assert message.args == [stays, "the disk is full."]
    assert place.reader.orders[-1] == ReadStudy(decision.folder)


@pytest.mark.parametrize("sealed", [True, False])
def test_outputs_explain_codes_of_a_sealed_study_and_unavailable_formats(place, qtbot, monkeypatch, sealed):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    place.show_view(view(sealed=sealed))
    for button in (place.export, place.report):
        click(qtbot, button)
        said = [label.text() for label in place.writing.findChildren(QLabel)]
        (explanation,) = (text for text in said if "very " in text)
        assert explanation.endswith("Conditions appear as codes because the study is blinded.") is sealed
        if button is place.export:
            assert not place.writing.editors["sav"].control.isEnabled()
            assert NO_SAV in said
        place.writing.reject()


def test_text_of_figures_is_at_least_11_px_high(place, qtbot, tmp_path):
    """In the main window of 1366 × 768, whose sidebar takes 72."""
    place.resize(1366 - 72, 768)
    plot(SAMPLE.path, tmp_path)
    for block in load_study(SAMPLE.path).blocks:
        svg = (tmp_path / f"{block.kind}.svg").read_bytes()
        place.show_view(
            view(figures=(FigureDrawn(name=block.id, title="Title", caption="Caption", svg=svg), *view().figures[1:]))
        )
        drawing = place.figures.cards[0].drawing
        qtbot.waitUntil(lambda waited=drawing: waited.is_settled)
        sizes_pt = [float(size) for size in re.findall(rb"font(?:-size)?: (?:bold )?([0-9.]+)px", svg)]
        assert min(sizes_pt) * drawing.width() / style.PAGE_WIDTH_PT >= 11
