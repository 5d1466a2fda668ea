"""The questionnaire: what is shown, what keys and clicks tell, and that it fits."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.pages.column_labels import Heading
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.questionnaire_grid import parts
from study_app.gui.participant.pages.statement_field import StatementField
from study_app.protocol.questions.question import ItemView
from study_app.protocol.wording.languages import words
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown, Submitted
from tests.gui.small import LABELS, ManualClock, questionnaire

pytestmark = pytest.mark.slow

KEY = Qt.Key
DUTCH_LABELS = (
    "Helemaal mee oneens",
    "Grotendeels mee oneens",
    "Enigszins mee oneens",
    "Neutraal",
    "Enigszins mee eens",
    "Grotendeels mee eens",
    "Helemaal mee eens",
)


class Shown:
    """A questionnaire on a screen, and what it told."""

    def __init__(self, qtbot: Any, page: QuestionnairePage, size: tuple[int, int], language: str = "en") -> None:
        self.widget = QuestionnaireWidget(page, words(language), ManualClock())
        qtbot.addWidget(self.widget)
        self.events: list[Any] = []
        self.widget.event_made.connect(self.events.append)
        self.widget.resize(*size)
        self.widget.show()
        self.widget.focus_first()
        QApplication.processEvents()
        self.widget.grab()
        QApplication.processEvents()

    @property
    def rows(self) -> tuple[StatementField, ...]:
        return self.widget.fields

    @property
    def told(self) -> list[Any]:
        """The events but for those that say what was shown."""
        return [event for event in self.events if not isinstance(event, ItemShown)]

    @property
    def focus(self) -> Any:
        return self.widget.focusWidget()

    def press(self, *keys: KEY) -> None:
        for key in keys:
            QTest.keyClick(self.focus, key)

    def click(self, row: int, column: int) -> None:
        cell = self.rows[row].options[column]
        QTest.mouseClick(cell, Qt.MouseButton.LeftButton, pos=QPoint(2, 2))


@pytest.fixture
def shown(qtbot: Any) -> Shown:
    return Shown(qtbot, questionnaire(), (1366, 768))


def test_every_item_is_told_once_when_it_is_seen_in_order(shown: Shown) -> None:
    seen = [event for event in shown.events if isinstance(event, ItemShown)]
    assert [event.item for event in seen] == [f"item{n}" for n in range(1, 10)]
    assert sorted(event.at_s for event in seen) == [event.at_s for event in seen]
    shown.widget.repaint()
    QApplication.processEvents()
    assert len(shown.events) == 9


def test_nine_keys_and_enter_make_the_whole_exact_sequence(shown: Shown) -> None:
    values = (6, 5, 4, 3, 7, 2, 1, 4, 7)
    shown.press(*(KEY(KEY.Key_0 + value) for value in values))
    assert shown.focus is shown.widget.button
    shown.press(KEY.Key_Return)
    kinds = [type(event) for event in shown.events]
    assert kinds == [ItemShown] * 9 + [Chosen] * 9 + [Submitted]
    assert [e.value for e in shown.events if isinstance(e, Chosen)] == list(values)
    times = [event.at_s for event in shown.events]
    assert times == sorted(times)


def test_click_anywhere_in_a_cell_answers_and_leaves_the_keyboard_there(shown: Shown) -> None:
    shown.click(4, 2)
    assert [(e.item, e.value) for e in shown.told] == [("item5", 3)]
    assert shown.focus is shown.rows[4]


def test_change_is_told_repetition_is_not(shown: Shown) -> None:
    shown.click(0, 2)
    shown.click(0, 2)
    shown.click(0, 3)
    assert [e.value for e in shown.told] == [3, 4]
    assert [cell.isChecked() for cell in shown.rows[0].options] == [False] * 3 + [True] + [False] * 3


def test_arrows_move_between_rows_and_point_in_a_row(shown: Shown) -> None:
    shown.press(KEY.Key_Down, KEY.Key_Down, KEY.Key_Up)
    assert shown.focus is shown.rows[1]
    shown.press(KEY.Key_Right, KEY.Key_Right, KEY.Key_Right, KEY.Key_Left)
    assert shown.told == []
    assert LABELS[1] in shown.widget.heading
    shown.press(KEY.Key_Space)
    assert [(e.item, e.value) for e in shown.told] == [("item2", 2)]


def test_arrow_keys_stop_at_the_ends(shown: Shown) -> None:
    shown.press(KEY.Key_Up, KEY.Key_Left, *[KEY.Key_Right] * 12, KEY.Key_Space)
    assert [(e.item, e.value) for e in shown.told] == [("item1", 7)]


def test_tab_goes_from_row_to_row_to_the_button_and_back(shown: Shown) -> None:
    order = []
    for _ in range(10):
        order.append(shown.focus)
        shown.press(KEY.Key_Tab)
    assert order == [*shown.rows, shown.widget.button]
    shown.rows[8].setFocus()
    QTest.keyClick(shown.rows[8], KEY.Key_Tab, Qt.KeyboardModifier.ShiftModifier)
    assert shown.focus is shown.rows[7]


def test_continue_names_and_marks_what_is_missing_and_goes_there(shown: Shown) -> None:
    for row in (0, 1, 2, 3, 5, 6, 8):
        shown.click(row, 1)
    told = len(shown.told)
    assert shown.widget.button.isEnabled()
    shown.widget.button.click()
    assert shown.widget.message == "Two statements still need an answer: 5 and 8."
    assert [row.view.number for row in shown.rows if row.missing] == [5, 8]
    assert shown.focus is shown.rows[4]
    assert len(shown.told) == told
    assert "Please answer · press 1 to 7" in shown.rows[4].accessibleDescription()
    foot = shown.widget.foot
    assert "5 and 8. Everything you have answered is kept. 7 of 9 answered" in foot.accessibleName()
    assert foot.accessibleDescription() == "↑ ↓ move, 1–7 answer"
    shown.press(KEY.Key_4)
    assert shown.widget.message == "One statement still needs an answer: 8."
    shown.click(7, 0)
    assert shown.widget.message == ""
    assert not any(row.missing for row in shown.rows)
    shown.press(KEY.Key_Return)
    assert isinstance(shown.told[-1], Submitted)


def test_submitted_is_told_once(shown: Shown) -> None:
    for row in range(9):
        shown.click(row, 3)
    shown.press(KEY.Key_Return, KEY.Key_Return)
    assert sum(isinstance(event, Submitted) for event in shown.events) == 1


def test_optional_items_may_stay_open(qtbot: Any) -> None:
    items = (ItemView("must", 1, "A.", required=True), ItemView("may", 2, "B.", required=False))
    shown = Shown(qtbot, questionnaire(items=items), (1366, 768))
    shown.press(KEY.Key_2)
    shown.widget.submit()
    assert [type(event) for event in shown.told] == [Chosen, Submitted]


def test_cannot_judge_is_there_only_where_the_protocol_allows_it(qtbot: Any) -> None:
    assert all(len(row.options) == 7 for row in Shown(qtbot, questionnaire(), (1366, 768)).rows)
    shown = Shown(qtbot, questionnaire(cannot_judge="Cannot judge"), (1366, 768))
    shown.click(8, 7)
    assert shown.told == [Chosen(shown.told[0].at_s, "item9", None)]
    assert shown.rows[8].is_answered
    assert 9 not in shown.widget.missing
    assert "Cannot judge" in shown.rows[8].accessibleDescription()


def test_ends_and_middle_are_labelled_and_the_column_pointed_at(shown: Shown) -> None:
    fixed = (LABELS[0], LABELS[3], LABELS[6])
    assert set(fixed) <= set(shown.widget.heading)
    QTest.mouseMove(shown.rows[2].options[1])
    QApplication.processEvents()
    assert shown.widget.heading == (LABELS[0], LABELS[1], LABELS[3], LABELS[6])
    QTest.mouseMove(shown.widget, QPoint(5, 5))
    QApplication.processEvents()
    assert shown.widget.heading == fixed


def test_choices_come_back_after_a_pause_without_being_told_again(qtbot: Any) -> None:
    page = questionnaire(cannot_judge="Cannot judge", chosen=(("item1", 6), ("item3", None)))
    shown = Shown(qtbot, page, (1366, 768))
    assert shown.rows[0].options[5].isChecked()
    assert shown.rows[2].options[7].isChecked()
    assert shown.told == []
    assert shown.focus is shown.rows[1]
    assert shown.widget.missing == (2, 4, 5, 6, 7, 8, 9)


def test_a_screen_reader_hears_that_a_statement_is_optional(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(items=(ItemView("may", 1, "B.", required=False),)), (1366, 768))
    assert shown.rows[0].accessibleDescription() == f"{words('en').optional}, no answer yet"


def test_small_window_shows_five_a_page_and_asks_page_by_page(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(), (880, 640))
    visible = [row.view.number for row in shown.rows if row.isVisible()]
    assert visible == [1, 2, 3, 4, 5]
    assert [event.item for event in shown.events] == [f"item{n}" for n in visible]
    assert [tab.text() for tab in shown.widget.tabs] == ["1–5", "6–9"]
    shown.press(*[KEY.Key_3] * 4, KEY.Key_Return)
    assert shown.widget.message == "One statement still needs an answer: 5."
    shown.press(KEY.Key_3, KEY.Key_Return)
    assert [row.view.number for row in shown.rows if row.isVisible()] == [6, 7, 8, 9]
    assert shown.focus is shown.rows[5]
    shown.widget.grab()
    QApplication.processEvents()
    shown.press(KEY.Key_Up)
    assert shown.rows[4].isVisible()
    shown.press(KEY.Key_Down, *[KEY.Key_2] * 4, KEY.Key_Return)
    assert [type(event) for event in shown.told] == [Chosen] * 9 + [Submitted]
    assert {event.item for event in shown.events if isinstance(event, ItemShown)} == {f"item{n}" for n in range(1, 10)}


def test_growing_window_brings_all_statements_back(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(), (880, 640))
    shown.widget.resize(1366, 768)
    assert all(row.isVisible() for row in shown.rows)
    assert shown.widget.tabs == []


def test_parts_are_as_even_as_they_can_be() -> None:
    assert list(parts(9, 1366)) == [9, 5, 3, 3, 2, 1]
    assert list(parts(9, 880)) == [5, 3, 3, 2, 1]
    assert list(parts(3, 1366)) == [3, 3, 2, 1]


def test_heading_gives_way_when_two_labels_would_touch(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(labels=DUTCH_LABELS), (860, 640))
    shown.widget.findChild(Heading).point(1)
    assert DUTCH_LABELS[1] in shown.widget.heading
    assert DUTCH_LABELS[0] not in shown.widget.heading
    shown.widget.findChild(Heading).point(-1)
    assert shown.widget.heading == (DUTCH_LABELS[0], DUTCH_LABELS[3], DUTCH_LABELS[6])
