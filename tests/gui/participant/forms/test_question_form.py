"""Forms: questions that come and go, entries that are not permitted, pauses, what is missing, room for each part."""

from itertools import pairwise
from typing import Any

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.gui.participant.forms.question_field import LEAST_TARGET
from study_app.protocol.questions.choice import ChoiceView
from study_app.protocol.questions.number import NumberView
from study_app.protocol.questions.question import ItemView
from study_app.protocol.questions.rating import RatingView
from study_app.protocol.questions.slider import SliderView
from study_app.session.transitions.events import Chosen, ItemShown, PauseAsked, Retracted, Submitted
from tests.gui.participant.forms.opened_form import FIVE, KEY, QUESTIONS, Opened, click, form, place_of

pytestmark = pytest.mark.slow


def test_answer_shows_a_question_and_hides_it_with_its_answer(opened: Opened) -> None:
    assert "since" not in opened.asked
    click(opened.field("hand").options[2])
    opened.settle()
    assert "since" in opened.asked
    assert opened.field("since").isVisible()
    assert opened.events[-1] == ItemShown(opened.events[-1].at_s, "since")
    opened.field("since").setFocus()
    opened.type("7")
    opened.press(KEY.Key_Return)
    assert opened.answers[-1] == ("since", 7)
    click(opened.field("hand").options[0])
    assert not opened.field("since").isVisible()
    assert not opened.field("since").is_answered
    assert opened.field("since").entry.text() == ""
    click(opened.field("hand").options[2])
    assert 3 in opened.page.missing


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("12", "Enter a whole number from 16 to 99."), ("20.5", "Enter a whole number from 16 to 99.")],
)
def test_entry_that_is_not_permitted_is_reported_and_not_taken(opened: Opened, text: str, sentence: str) -> None:
    height = opened.field("age").height()
    opened.type(text)
    opened.press(KEY.Key_Return)
    opened.settle()
    assert opened.field("age").height() == height  # there was room for the sentence
    assert opened.field("age").problem == sentence
    assert opened.answers == []
    assert QApplication.focusWidget() is opened.field("age").entry
    opened.page.submit()
    assert not any(isinstance(event, Submitted) for event in opened.told)


@pytest.mark.parametrize("text", ["1,5", "1.5"])
def test_number_takes_point_and_comma(opening: Any, text: str) -> None:
    opened = opening(form((NumberView("size", 1, "How large?", True),)))
    opened.type(text)
    opened.press(KEY.Key_Return)
    assert opened.answers == [("size", 1.5)]


@pytest.mark.parametrize(("value", "text"), [(1.5, "1.5"), (-0.25, "−0.25"), (0, "0")])
def test_answered_number_is_shown_again(opening: Any, value: float, text: str) -> None:
    opened = opening(form((NumberView("size", 1, "How large?", True),), chosen=(("size", value),)))
    assert opened.field("size").entry.text() == text
    assert opened.field("size").is_answered


def test_emptied_entry_is_retracted(opened: Opened) -> None:
    field = opened.field("comment")
    field.setFocus()
    opened.type("x")
    field.finish()
    opened.press(KEY.Key_Backspace)
    field.finish()
    assert [type(event) for event in opened.told] == [Chosen, Retracted]


def test_last_option_taken_back_is_no_answer(opened: Opened) -> None:
    option = opened.field("used").options[0]
    click(option)
    click(option)
    assert [type(event) for event in opened.told] == [Chosen, Retracted]


def test_text_keeps_to_its_length_and_takes_no_line_break_in_one_line(opened: Opened) -> None:
    field = opened.field("comment")
    field.entry.setPlainText("a\u202eb\x07 " + "c" * 40)
    field.finish()
    ((_, text),) = opened.answers
    assert len(text) <= 20
    assert "\x07" not in text


@pytest.mark.parametrize("item", ["age", "comment", "pleasant", "thick", "used"])
def test_escape_pauses_from_every_question_and_takes_what_was_typed(opened: Opened, item: str) -> None:
    opened.field(item).setFocus()
    QApplication.processEvents()
    focused = QApplication.focusWidget()
    assert focused is not None
    if item in ("age", "comment"):
        opened.type("33")
    QTest.keyClick(focused, KEY.Key_Escape)
    assert isinstance(opened.told[-1], PauseAsked)
    assert len(opened.answers) == (item in ("age", "comment"))


def test_answers_come_back_after_a_pause_without_being_told_again(opening: Any) -> None:
    chosen = (("age", 42), ("hand", "both"), ("used", ("mouse",)), ("thick", None), ("pleasant", 35), ("comment", "x"))
    opened = opening(form(chosen=chosen))
    assert opened.told == []
    assert opened.field("age").entry.text() == "42"
    assert opened.field("hand").options[2].isChecked()
    assert opened.field("thick").options[5].isChecked()
    assert opened.field("pleasant").line.value() == 7
    assert "since" in opened.asked
    assert opened.page.missing == (3,)


def test_continue_names_and_marks_what_is_missing(opened: Opened) -> None:
    opened.page.submit()
    assert opened.page.message == "Four questions still need an answer: 1, 2, 5 and 6."
    assert opened.field("age").missing
    opened.type("20")
    opened.press(KEY.Key_Return)
    assert opened.page.message == "Three questions still need an answer: 2, 5 and 6."


def test_submitted_is_told_once(opening: Any) -> None:
    opened = opening(form((RatingView("one", 1, "One?", True, labels=FIVE),)))
    opened.press(KEY.Key_3, KEY.Key_Return, KEY.Key_Return)
    assert [type(event) for event in opened.told] == [Chosen, Submitted]


TLX = tuple(
    SliderView(
        f"scale{n}", n, "How much of it was required, and how easy or demanding was it, taken as a whole? " * 2, True,
        low="Low", high="High", step=5,
    )
    for n in range(1, 7)
)  # fmt: skip
SUS = tuple(RatingView(f"sus{n}", n, "I found the system unnecessarily complex.", True, labels=FIVE) for n in range(10))
ELEVEN = (RatingView("r", 1, "How rough?", True, labels=tuple("abcdefghijk"), cannot_judge="Cannot judge"),)
TWELVE = (ChoiceView("c", 1, "Which?", True, options=tuple((f"o{n}", f"The option number {n}") for n in range(12))),)


def test_six_sliders_are_one_part(opening: Any) -> None:
    opened = opening(form(TLX))
    assert len(opened.page.part) == 6


@pytest.mark.variants(10)
@pytest.mark.parametrize("items", [QUESTIONS, TLX, SUS, ELEVEN, TWELVE], ids=["all", "tlx", "sus", "eleven", "twelve"])
@pytest.mark.parametrize(
    ("size", "language", "text_scale"),
    [
        ((1366, 768), "en", 1.0),
        ((1366, 768), "ar", 1.0),
        ((1024, 640), "de", 1.0),
        ((1920, 1080), "fr", 1.0),
        ((1366, 768), "nl", 2.0),
    ],
)
def test_every_part_fits_and_can_be_hit(
    opening: Any, items: tuple[ItemView, ...], size: tuple[int, int], language: str, text_scale: float
) -> None:
    opened = opening(form(items), size, language, text_scale)
    opened.page.submit()  # the notes take room as well
    seen: list[str] = []
    for part in opened.page.parts:
        opened.page.go_to(part[0])
        opened.settle()
        seen += [field.view.id for field in opened.page.part]
        for field in part:
            assert field.isVisible()
            assert opened.page.rect().contains(field.geometry())
            assert field.geometry().bottom() <= opened.page.foot.geometry().top()
            assert field.statement.height() >= field.statement.heightForWidth(field.statement.width()) - 1
            for label in field.findChildren(QLabel):
                if label.isVisible() and label.wordWrap():
                    assert label.height() >= label.heightForWidth(label.width()) - 1, label.text()
            for hit in targets(field):
                assert min(hit.width(), hit.height()) >= LEAST_TARGET, (type(hit), hit.size())
                assert opened.page.rect().contains(place_of(opened, hit))
        for one, other in pairwise(opened.page.part):
            assert one.geometry().bottom() < other.geometry().top() + 1
    assert seen == opened.asked


def targets(field: Any) -> list[QWidget]:
    """Return everything in a question that can be hit."""
    parts = (getattr(field, name, []) for name in ("options", "options", "keys"))
    single = [getattr(field, name) for name in ("line", "entry") if hasattr(field, name)]
    return [one for many in parts for one in many] + single


def test_scale_keeps_its_order_from_right_to_left_and_all_else_is_mirrored(opening: Any) -> None:
    here, there = opening(form()), opening(form(), language="ar")
    for item, part in (("thick", "options"), ("age", "keys")):
        lefts = [place_of(there, one).left() for one in getattr(there.field(item), part)[:5]]
        assert lefts == sorted(lefts)
    options = [place_of(there, one).left() for one in there.field("hand").options]
    assert options == sorted(options, reverse=True)
    width = here.page.width()
    for item in ("hand", "comment"):
        words_here, words_there = (place_of(one, one.field(item).statement) for one in (here, there))
        assert words_here.left() == pytest.approx(width - words_there.right() - 1, abs=2)
