"""Every kind of question: shown without an answer, answered in every way, asked for, brought back, legible."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QEnterEvent, QImage, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QSlider,
    QWidget,
)

from study_app.gui.participant.forms.questions import FIELDS
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.questions import ChoiceView, ItemView, NumberView, RatingView, SliderView, TextView
from study_app.protocol.wording.languages import words
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import (
    Begin,
    Chosen,
    ItemShown,
    PauseRequested,
    Retracted,
    ShowPage,
    Submitted,
    TaskDone,
    Write,
)
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance, initial_state
from study_app.store.journals.journal_events import FormAnswered, Responses
from tests.gui.participant.driver import KEY, Participant, description_of, tap, told_of
from tests.gui.small import FIVE, QUESTIONS, form, questionnaire
from tests.protocol.forms.mixed import mixed_file

pytestmark = pytest.mark.slow

Opening = Callable[..., Participant]
FULL = (1366, 768)
LEAST_TARGET = 44


def alone(index: int) -> QuestionnairePage:
    """Return a form of one of the questions, which needs an answer."""
    return form(replace(QUESTIONS[index], number=1, required=True))  # type: ignore[call-arg]


@dataclass(frozen=True)
class Kind:
    """A page with one question of a kind, and two ways to answer it: keys, and pressed buttons."""

    page: QuestionnairePage
    keys: tuple[KEY | str, ...]
    value: Any
    pressed: tuple[str, ...] = ()
    then: Any = None
    entry_text: str = ""

    @property
    def item(self) -> ItemView:
        return self.page.items[0]


STATEMENT = questionnaire(items=(ItemView("flows", 1, "It flows.", True),), cannot_judge="Cannot judge")
KINDS = {
    "statement": Kind(STATEMENT, (KEY.Key_6,), 6, ("3 Somewhat disagree",), 3),
    "rating": Kind(alone(4), (KEY.Key_3,), 3, ("4 Rather",), 4),
    "cannot judge": Kind(alone(4), (*[KEY.Key_Right] * 6, KEY.Key_Space), None, ("Cannot judge",), None),
    "choice": Kind(alone(1), (KEY.Key_2,), "right", ("Left",), "left"),
    "several": Kind(alone(3), (KEY.Key_1, KEY.Key_3), ("mouse", "other"), ("A haptic device",), ("falcon",)),
    "number": Kind(alone(0), ("42", KEY.Key_Return), 42, ("4", "⌫", "7", "5"), 75, "42"),
    "decimals": Kind(form(NumberView("size", 1, "Large?", True)), ("1,5", KEY.Key_Return), 1.5, (), None, "1.5"),
    "below 0": Kind(form(NumberView("size", 1, "Warm?", True)), ("-0.25", KEY.Key_Return), -0.25, (), None, "−0.25"),
    "slider": Kind(alone(5), (KEY.Key_End, KEY.Key_PageDown, KEY.Key_Left), 45),
    "text": Kind(alone(6), ("Fine.", KEY.Key_Return), "Fine.", (), None, "Fine."),
}
ALL = pytest.mark.parametrize("name", KINDS)


def press_keys(participant: Participant, keys: tuple[KEY | str, ...]) -> None:
    for key in keys:
        if isinstance(key, str):
            participant.type(key)
        else:
            participant.press(key)


def entries(participant: Participant) -> list[str]:
    """Return the texts in the fields of the page."""
    lines = [entry.text() for entry in participant.page.findChildren(QLineEdit)]
    return lines + [entry.toPlainText() for entry in participant.page.findChildren(QPlainTextEdit)]


def test_every_widget_of_a_question_is_tested() -> None:
    assert {kind.item.widget for kind in KINDS.values()} | {"statement"} >= set(FIELDS)


@ALL
def test_nothing_is_preset_and_keys_alone_answer_and_submit_once(opening: Opening, name: str) -> None:
    kind = KINDS[name]
    participant = opening(kind.page, FULL)
    assert [type(event) for event in participant.events] == [ItemShown]
    assert (participant.events[0].item, participant.page.missing) == (kind.item.id, (1,))
    assert participant.question(1).accessibleName() == f"1. {kind.item.text}"
    assert description_of(participant.question(1)).endswith("no answer yet")
    press_keys(participant, kind.keys)
    assert participant.answers[-1] == (kind.item.id, kind.value)
    assert "no answer yet" not in description_of(participant.question(1))
    for _ in range(3):
        participant.press(KEY.Key_Return)
    assert participant.kinds.count(Submitted) == 1
    assert participant.kinds[-1] is Submitted
    assert sum(isinstance(event, ItemShown) for event in participant.events) == 1


@pytest.mark.parametrize(
    ("language", "typed", "asks"),
    [
        ("en", "2,500", "“2,500” can be read as 2.5 or 2500. Enter 2.5 or 2500."),
        ("en", "-1,234", "“-1,234” can be read as -1.234 or -1234. Enter -1.234 or -1234."),
        ("de", "1.234", "„1.234“ kann 1,234 oder 1234 bedeuten. Geben Sie 1,234 oder 1234 ein."),
        ("nl", "1.234", "“1.234” kan 1,234 of 1234 betekenen. Voer 1,234 of 1234 in."),
        ("fr", "1.234", "«\u00a01.234\u00a0» peut signifier 1,234 ou 1234. Saisissez 1,234 ou 1234."),
        ("ar", "2,500", "يمكن أن يعني «2,500» العدد 2.5 أو 2500. يرجى إدخال 2.5 أو 2500."),
        ("en", "1 5", "Enter a number."),
        ("de", "1'00", "Geben Sie eine Zahl ein."),
    ],
)
def test_an_invalid_number_is_requested_again(opening: Opening, language: str, typed: str, asks: str) -> None:
    participant = opening(form(NumberView("size", 1, "Large?", True)), FULL, language)
    participant.type(typed)
    participant.press(KEY.Key_Return)
    assert participant.answers == []
    assert asks in participant.texts
    assert Submitted not in participant.kinds


def test_an_ambiguous_number_is_requested_again_even_if_one_reading_is_permitted(opening: Opening) -> None:
    participant = opening(form(NumberView("size", 1, "Large?", True, least=0.0, most=10.0)), FULL)
    participant.type("2,500")
    participant.press(KEY.Key_Return)
    assert participant.answers == []
    assert "“2,500” can be read as 2.5 or 2500. Enter 2.5 or 2500." in participant.texts


@pytest.mark.parametrize(
    ("language", "typed", "value"),
    [
        ("en", "2,5", 2.5), ("en", "2.500", 2.5), ("de", "0,5", 0.5), ("nl", "2,500", 2.5), ("fr", "1 000", 1000),
        ("de", "2.5", 2.5), ("ar", "٣٫٥", 3.5), ("ar", "١٬٠٠٠", 1000), ("de", "1.234,5", 1234.5),
    ],
)  # fmt: skip
def test_a_number_with_one_reading_is_taken(opening: Opening, language: str, typed: str, value: float) -> None:
    participant = opening(form(NumberView("size", 1, "Large?", True)), FULL, language)
    participant.type(typed)
    participant.press(KEY.Key_Return)
    assert participant.answers == [("size", value)]


@pytest.mark.parametrize(("language", "sign"), [("en", "."), ("nl", ","), ("de", ","), ("fr", ","), ("ar", ".")])
def test_numbers_are_shown_and_kept_with_the_languages_decimal_sign(opening: Opening, language: str, sign: str) -> None:
    page = form(NumberView("size", 1, "Large?", True, least=16.5, most=99.0))
    participant = opening(page, FULL, language)
    participant.type("3")
    participant.press(KEY.Key_Return)
    assert words(language).number_between.format(kind=words(language).any_number, least=f"16{sign}5", most="99") in (
        participant.texts
    )
    assert [key.text() for key in participant.page.findChildren(QPushButton) if key.text() in {".", ","}] == [sign]
    back = opening(replace(page, chosen=(("size", 17.125),)), FULL, language)
    assert entries(back) == [f"17{sign}125"]
    back.page.button.setFocus()
    back.press(KEY.Key_Return)
    assert Submitted in back.kinds


@pytest.mark.parametrize("way", ["mouse", "touch", "screen reader"])
@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.pressed])
def test_a_question_is_answered_by_one_hand_or_a_screen_reader(
    opening: Opening, finger: QPointingDevice, qtbot: Any, name: str, way: str
) -> None:
    kind = KINDS[name]
    participant = opening(kind.page, FULL)

    def use(target: str) -> None:
        if way == "mouse":
            participant.click(target)
        elif way == "touch":
            tap(finger, participant.find(target))
        else:
            action = told_of(participant.find(target)).actionInterface()
            action.doAction(action.actionNames()[0])
            qtbot.waitUntil(lambda: not participant.find(target).isDown())

    for target in (*kind.pressed, participant.page.button.text()):
        use(target)
    assert participant.answers == [(kind.item.id, kind.then)]
    assert participant.kinds[-1] is Submitted


@pytest.mark.parametrize("way", ["mouse", "touch", "screen reader"])
def test_the_end_of_a_line_is_its_greatest_number(opening: Opening, finger: QPointingDevice, way: str) -> None:
    participant = opening(KINDS["slider"].page, FULL)
    line = participant.page.findChild(QSlider)
    end = QPoint(line.width() - 2, line.height() // 2)
    QTest.wheelEvent(
        participant.window.windowHandle(), line.mapTo(participant.window, line.rect().center()), QPoint(0, 120)
    )
    assert participant.answers == [], "the wheel changes no answer"
    if way == "mouse":
        participant.click(line, place=end)
    elif way == "touch":
        tap(finger, line, end)
    else:
        told_of(line).valueInterface().setCurrentValue(line.maximum())
    assert participant.answers == [("pleasant", 100)]
    assert "chosen: 100" in line.accessibleDescription()


@ALL
def test_an_answer_is_restored_after_a_pause_without_another_event(opening: Opening, name: str) -> None:
    kind = KINDS[name]
    first_time = opening(kind.page, FULL)
    press_keys(first_time, kind.keys)
    again = opening(replace(kind.page, chosen=((kind.item.id, kind.value),)), FULL)
    assert again.told == []
    assert again.page.missing == ()
    for participant in (first_time, again):
        participant.page.button.setFocus()
        participant.settle()
    assert description_of(again.question(1)) == description_of(first_time.question(1))
    if kind.entry_text:
        assert kind.entry_text in entries(again)
    else:
        assert again.question(1).grab().toImage() == first_time.question(1).grab().toImage()


@ALL
def test_escape_pauses_and_keeps_the_typed_answer(opening: Opening, name: str) -> None:
    kind = KINDS[name]
    participant = opening(kind.page, FULL)
    press_keys(participant, tuple(key for key in kind.keys if isinstance(key, str)))
    participant.press(KEY.Key_Escape)
    assert participant.kinds[-1] is PauseRequested
    assert len(participant.answers) == isinstance(kind.keys[0], str)


def test_a_retracted_answer_does_not_count_and_text_is_limited_in_length(opening: Opening) -> None:
    participant = opening(form(), FULL)
    for _ in range(2):
        participant.click("A mouse")
    participant.question(7).setFocus()
    participant.type("x")
    participant.question(7).finish()
    participant.press(KEY.Key_Backspace)
    participant.question(7).finish()
    assert participant.kinds == [Chosen, Retracted] * 2
    participant.page.findChild(QPlainTextEdit).setPlainText("a\u202eb\x07 " + "c" * 40)
    participant.question(7).finish()
    _, text = participant.answers[-1]
    assert len(text) <= 20
    assert "\x07" not in text


def test_the_footer_states_missing_answers_progress_and_answer_keys(opening: Opening) -> None:
    participant, en = opening(form(), (1366, 2000)), words("en")

    def foot(message: str, answered: int, of: int) -> str:
        kept = f"{message} {en.answers_kept} " if message else ""
        return f"{kept}{en.answered.format(done=answered, of=of)}"

    def keys(answer_keys: str) -> str:
        return f"↑ ↓ {en.key_move}, {answer_keys} {en.key_answer}"

    states = [(participant.page.foot.accessibleName(), participant.page.foot.accessibleDescription())]
    for act in (("42", KEY.Key_Return), (KEY.Key_3,), ("7", KEY.Key_Return), (KEY.Key_1,)):
        press_keys(participant, act)
        states.append((participant.page.foot.accessibleName(), participant.page.foot.accessibleDescription()))
    assert states == [
        (foot("", 0, 6), keys(participant.question(1).answer_keys)),
        (foot("", 1, 6), keys("1–3")),
        (foot("", 2, 7), keys(participant.question(3).answer_keys)),  # a new question
        (foot("", 3, 7), keys("1–3")),
        (foot("", 4, 7), keys("1–3")),
    ]
    participant.click("Continue")
    message = en.questions_missing([5, 6])
    assert participant.page.foot.accessibleName() == foot(message, 4, 7)
    assert participant.page.button.accessibleDescription() == message
    assert (participant.question(5).missing, participant.question(7).missing, participant.focus) == (
        True,
        False,
        participant.question(5),
    )
    participant.click("Left", 2)  # which hides the third question
    assert (participant.page.foot.accessibleName(), participant.question(3).isHidden()) == (foot(message, 3, 6), True)
    participant.click("Both", 2)
    assert (participant.page.foot.accessibleName(), entries(participant)[1]) == (
        foot(en.questions_missing([5, 6]), 3, 7),
        "",
    )
    participant.click("A mouse", 4)
    assert participant.page.foot.accessibleName() == foot(message, 2, 7)
    assert (participant.question(4).is_answered, participant.question(4).value) == (False, None)
    assert description_of(participant.question(4)).endswith("no answer yet")


def test_a_key_leads_to_the_next_question_and_a_click_stays(opening: Opening) -> None:
    page = form(*(replace(QUESTIONS[index], number=at) for at, index in enumerate((1, 4), 1)))  # type: ignore[arg-type]
    participant, pointed = opening(page, FULL), list[int]()
    first, second = participant.question(1), participant.question(2)
    first.pointed_at.connect(pointed.append)
    participant.click("Left", 1)
    assert (participant.focus, first.value) == (first, "left")
    participant.press(KEY.Key_Right, KEY.Key_Right, KEY.Key_Right)
    assert (pointed, first.value) == ([1, 2], "left")
    participant.press(KEY.Key_Space)
    assert (participant.focus, first.value, first.pointed, pointed[-1]) == (second, "both", -1, -1)
    participant.press(KEY.Key_Left)
    assert second.pointed == 5, "from the end"
    participant.press(KEY.Key_Up, KEY.Key_2)
    assert (participant.focus, first.value) == (second, "right")
    participant.press(KEY.Key_6)  # five points
    assert not second.is_answered
    participant.press(KEY.Key_5)
    assert (second.value, participant.focus) == (5, participant.page.button)


def test_the_mouse_highlights_an_option_until_it_leaves_but_a_finger_does_not(
    opening: Opening, finger: QPointingDevice
) -> None:
    participant, pointed = opening(alone(1), FULL), list[int]()
    question = participant.question(1)
    question.pointed_at.connect(pointed.append)
    for place in (1, 0):
        QApplication.sendEvent(question.options[place], QEnterEvent(QPoint(1, 1), QPoint(1, 1), QPoint(1, 1)))
        assert [option.pointed for option in question.options] == [at == place for at in range(3)]
        QApplication.sendEvent(question.options[place], QEvent(QEvent.Type.Leave))
        assert not any(option.pointed for option in question.options)
    assert pointed == [1, -1, 0, -1]
    question.point_at(2)
    tap(finger, question.options[2])
    assert (question.pointed, participant.answers) == (-1, [("hand", "both")])


def test_enter_begins_a_line_where_there_are_several_and_goes_on_with_ctrl(opening: Opening, qtbot: Any) -> None:
    page = form(*(TextView(f"text{n}", n, "What else?", False, lines=lines) for n, lines in ((1, 3), (2, 1))))
    participant = opening(page, FULL)
    press_keys(participant, ("One", KEY.Key_Return, "two"))
    assert (entries(participant), participant.focus) == (["One\ntwo", ""], participant.question(1).entry)
    qtbot.keyClick(participant.focus, KEY.Key_Return, Qt.KeyboardModifier.ControlModifier)
    assert (participant.answers, participant.focus) == ([("text1", "One\ntwo")], participant.question(2).entry)
    press_keys(participant, ("three", KEY.Key_Return))
    assert (participant.answers[1:], participant.focus) == ([("text2", "three")], participant.page.button)


def test_a_slider_begins_in_the_middle_and_states_that_it_has_no_answer(opening: Opening) -> None:
    participant = opening(KINDS["slider"].page, FULL)
    texts = [label.text() for label in participant.question(1).findChildren(QLabel)]
    assert {"Unpleasant", "no answer yet", "Pleasant"} <= {*texts}
    for key, value in (("Right", 50), ("Right", 55), ("Left", 50), ("PageUp", 100), ("PageDown", 50), ("Home", 0)):
        participant.press(getattr(KEY, f"Key_{key}"))
        assert participant.answers[-1] == ("pleasant", value), key
    assert "no answer yet" not in participant.texts


def test_the_place_where_the_handle_is_let_go_is_the_answer(opening: Opening) -> None:
    participant = opening(KINDS["slider"].page, FULL)
    line = participant.page.findChild(QSlider)
    middle = line.height() // 2
    left, half, right = (QPoint(x, middle) for x in (0, line.width() // 2, line.width() - 1))
    for button, places, answers in (
        (Qt.MouseButton.RightButton, (half, right, left), []),
        (Qt.MouseButton.LeftButton, (half, right, right), [100]),
        (Qt.MouseButton.LeftButton, (right, half, left), [100, 0]),
    ):
        before = len(participant.answers)
        QTest.mousePress(line, button, pos=places[0])
        QTest.mouseMove(line, places[1])
        if button is Qt.MouseButton.LeftButton:
            assert line.value() == {half: 10, right: 20}[places[1]]
        assert len(participant.answers) == before
        QTest.mouseRelease(line, button, pos=places[2])
        assert [value for _, value in participant.answers] == answers


@pytest.mark.parametrize("text_scale", [1.0, 2.0])
def test_targets_grow_with_the_text_but_never_shrink(opening: Opening, text_scale: float) -> None:
    participant = opening(KINDS["slider"].page, FULL, text_scale=text_scale)
    scale = participant.question(1).scale
    assert (scale > 1.3) is (text_scale == 2.0)
    assert participant.page.findChild(QSlider).height() == round(LEAST_TARGET * max(1.0, scale))


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


def place_of(participant: Participant, widget: QWidget) -> Any:
    return widget.rect().translated(widget.mapTo(participant.page, QPoint(0, 0)))


@pytest.mark.variants(8)
@pytest.mark.parametrize("items", [QUESTIONS, TLX, SUS, ELEVEN, TWELVE], ids=["all", "tlx", "sus", "eleven", "twelve"])
@pytest.mark.parametrize(
    ("size", "language", "text_scale"),
    [(FULL, "ar", 1.0), ((1024, 640), "de", 1.0), ((1920, 1080), "fr", 1.0), (FULL, "nl", 2.0)],
)
def test_every_part_fits_and_can_be_hit(
    opening: Opening, items: tuple[ItemView, ...], size: tuple[int, int], language: str, text_scale: float
) -> None:
    participant = opening(form(*items), size, language, text_scale)
    participant.page.submit()  # the notes take room as well
    field_ids: list[str] = []
    for part in participant.page.parts:
        participant.page.go_to(part[0])
        participant.settle()
        field_ids += [field.view.id for field in participant.page.part]
        for field in part:
            assert field.isVisible()
            assert participant.page.rect().contains(field.geometry())
            assert field.geometry().bottom() <= participant.page.foot.geometry().top()
            assert field.statement.height() >= field.statement.heightForWidth(field.statement.width()) - 1
            for label in field.findChildren(QLabel):
                if label.isVisible() and label.wordWrap():
                    assert label.height() >= label.heightForWidth(label.width()) - 1, label.text()
            for kind in (QAbstractButton, QLineEdit, QPlainTextEdit, QSlider):
                for hit in field.findChildren(kind):
                    assert min(hit.width(), hit.height()) >= LEAST_TARGET, (type(hit), hit.size())
                    assert participant.page.rect().contains(place_of(participant, hit))
        for upper, lower in pairwise(participant.page.part):
            assert upper.geometry().bottom() < lower.geometry().top() + 1
    assert field_ids == [field.view.id for field in participant.page.asked]
    assert items is not TLX or size != FULL or text_scale > 1 or len(participant.page.parts) == 1


GIVEN: dict[str, tuple[KEY | str, ...]] = {
    "number": ("33",),
    "text": ("Fine.",),
    "choice": (KEY.Key_1,),
    "rating": (KEY.Key_2,),
    "slider": (KEY.Key_Home, KEY.Key_Right),
}


class Session:
    """The state machine connected with the window."""

    def __init__(self, study: Any, participant: Participant) -> None:
        self.participant = participant
        self.answered: list[Any] = []
        key = draw_key(study, stream(1, "key").random)
        self.state = initial_state(study, build_schedule(study, "P001", 1), key, "en")
        participant.window.event.connect(self.post)

    def post(self, event: Any) -> None:
        self.state, commands = advance(self.state, event)
        for command in commands:
            if isinstance(command, Write) and isinstance(command.line, FormAnswered | Responses):
                self.answered.append(command.line)
            if isinstance(command, ShowPage) and self.state.phase is not Phase.TASK:
                self.participant.window.show_page(command.page)


def test_a_session_with_every_kind_of_question_is_completed_by_keys_alone(opening: Opening, tmp_path: Any) -> None:
    participant = opening(size=FULL)
    session = Session(load(mixed_file(tmp_path)), participant)
    session.post(Begin(0.0))
    for _ in range(200):
        QApplication.processEvents()
        if session.state.phase is Phase.COMPLETE:
            break
        if session.state.phase is Phase.TASK:
            session.post(TaskDone(1.0, "complete", {}))
            continue
        focused = participant.focus
        field = next((part for part in participant.page.part if part is focused or part.isAncestorOf(focused)), None)
        if field is None:
            participant.press(KEY.Key_Return)
            continue
        press_keys(participant, GIVEN[field.view.widget])
        if participant.focus is focused:
            participant.press(KEY.Key_Down)
    assert session.state.phase is Phase.COMPLETE
    rows = [row for line in session.answered for row in line.items]
    assert len(rows) == 3 + 2 * 3 + 6 + 10 + 1
    assert all(row.onset_s is not None and row.first_s is not None for row in rows)
    values = {row.item: row.value for row in rows}
    assert (values["age"], values["hand"], values["used"]) == (33, "left", ("mouse",))
    assert (values["thickness"], values["pleasant"], values["effort"], values["sus10"]) == (2, 5, 5, 2)


def test_the_text_of_a_question_begins_right_of_the_column_of_numbers(opening: Opening) -> None:
    question = opening(KINDS["number"].page, FULL).question(1).statement
    widths = []
    for column in (40, 70):
        question.set_number_width(column)
        widths.append(question.minimumSizeHint().width())
    assert widths[1] == widths[0] + 30


def test_the_foot_is_written_in_letters_of_the_pages_size(opening: Opening) -> None:
    scales, heights = [], []
    for text_scale in (1.0, 1.6):
        foot = opening(KINDS["number"].page, FULL, text_scale=text_scale).page.foot
        foot.show_state("", 3, 5, "")
        image = foot.parentWidget().grab(foot.geometry()).toImage().convertToFormat(QImage.Format.Format_Grayscale8)
        greys = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
        written = greys[4:, : foot.button.x() - 4].astype(int)
        (rows,) = np.nonzero((abs(written - np.median(written)) > 60).any(axis=1))
        scales.append(foot._scale)
        heights.append(np.ptp(rows))
    assert scales[1] > 1.2 * scales[0]
    assert heights[1] / heights[0] == pytest.approx(scales[1] / scales[0], rel=0.15)
