"""The questionnaire: what is shown, what keys and clicks tell, and that it fits."""

from itertools import pairwise
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.pages.column_labels import Heading
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.questionnaire_grid import LEAST_CELL, POINTS, Asked, grid, parts
from study_app.gui.participant.pages.statement_field import WRAP_LEFT, StatementField
from study_app.gui.theme.theme import font
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
LONG = "De gesimuleerde vloeistof gedraagt zich in alle richtingen op de manier die ik er vooraf van verwachtte."


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


def test_nothing_is_preset(shown: Shown) -> None:
    assert not any(cell.isChecked() for row in shown.rows for cell in row.options)
    assert shown.told == []
    assert shown.widget.message == ""


def test_every_item_is_told_once_when_it_is_seen_in_order(shown: Shown) -> None:
    seen = [event for event in shown.events if isinstance(event, ItemShown)]
    assert [event.item for event in seen] == [f"item{n}" for n in range(1, 10)]
    assert sorted(event.at_s for event in seen) == [event.at_s for event in seen]
    shown.widget.repaint()
    QApplication.processEvents()
    assert len(shown.events) == 9


def test_key_answers_and_moves_on(shown: Shown) -> None:
    assert shown.focus is shown.rows[0]
    shown.press(KEY.Key_6, KEY.Key_5)
    assert [(e.item, e.value) for e in shown.told] == [("item1", 6), ("item2", 5)]
    assert shown.focus is shown.rows[2]
    assert shown.rows[0].options[5].isChecked()


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


def test_names_for_a_screen_reader(shown: Shown) -> None:
    row = shown.rows[4]
    assert row.accessibleName() == "5. This liquid behaves like honey."
    assert row.accessibleDescription() == "no answer yet"
    assert row.options[4].accessibleName() == "5 Somewhat agree"
    shown.click(4, 4)
    assert row.accessibleDescription() == "chosen: 5 Somewhat agree"


def test_a_screen_reader_hears_that_a_statement_is_optional(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(items=(ItemView("may", 1, "B.", required=False),)), (1366, 768))
    assert shown.rows[0].accessibleDescription() == f"{words('en').optional}, no answer yet"


def test_page_of_nine_statements_has_few_widgets(shown: Shown) -> None:
    """Each takes time when the page comes: 63 cells, 9 rows, their words, and what is around them."""
    assert len(shown.widget.findChildren(QWidget)) <= 63 + 9 + 9 + 8


def place_in(row: StatementField, part: QWidget) -> QRect:
    return QRect(part.mapTo(row, QPoint(0, 0)), part.size())


SIZES = [(1366, 768), (1920, 1080), (1280, 720), (1024, 640), (1280, 1024), (2560, 1440)]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("judge", [None, "Cannot judge"])
def test_nine_statements_fit_without_scrolling(qtbot: Any, size: tuple[int, int], judge: str | None) -> None:
    shown = Shown(qtbot, questionnaire(cannot_judge=judge), size)
    area = shown.widget.rect()
    below = shown.widget.foot.geometry().top()
    for before, after in pairwise(shown.rows):
        assert before.geometry().bottom() <= after.geometry().top()
    for row in shown.rows:
        assert row.isVisible()
        assert area.contains(row.geometry())
        assert row.geometry().bottom() < below
        places = [place_in(row, cell) for cell in row.options]
        words = place_in(row, row.statement)
        for place in places:
            assert min(place.width(), place.height()) >= LEAST_CELL
            assert row.rect().contains(place)
            assert place.left() > words.right()
        for one, other in pairwise(places):
            assert one.right() < other.left()
        assert words.height() >= row.statement.heightForWidth(words.width()) - 1


def test_rows_without_an_introduction_do_not_overlap(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(intro=""), (1024, 640))
    assert all(before.geometry().bottom() < after.geometry().top() for before, after in pairwise(shown.rows))


def test_points_stand_on_the_ground_of_their_row(shown: Shown) -> None:
    def grounds() -> list[tuple[QColor, QColor]]:
        image = shown.widget.grab().toImage()
        corners = [point.mapTo(shown.widget, QPoint(0, 0)) for row in shown.rows for point in row.points]
        return [(image.pixelColor(corner), image.pixelColor(corner - QPoint(2, 0))) for corner in corners]

    shown.rows[0].point(0)
    before = grounds()
    assert all(corner == beside for corner, beside in before)
    shown.widget.submit()  # every row is marked as missing an answer
    after = grounds()
    assert all(corner == beside for corner, beside in after)
    assert after[-1] != before[-1]


@pytest.mark.parametrize("size", [(1366, 768), (1024, 640), (860, 640)], ids=str)
def test_long_dutch_texts_are_not_clipped(qtbot: Any, size: tuple[int, int]) -> None:
    page = questionnaire((LONG,) * 9, labels=DUTCH_LABELS, intro="In hoeverre bent u het eens met elke uitspraak?")
    shown = Shown(qtbot, page, size, "nl")
    shown.widget.submit()  # the note under each statement takes room as well
    for row in shown.rows:
        if not row.isVisible():
            continue
        _face, _note, height, note = row.fitted(row.sizes, row.note)
        assert height + note <= row.height()
    for column in range(7):
        heading = shown.widget.findChild(Heading)
        heading.point(column)
        for label in heading.columns():
            place = heading.column_area(label)
            metrics = QFontMetricsF(font("label", scale=shown.rows[0].sizes.scale, weight=600))
            bounds = metrics.boundingRect(QRectF(0, 0, place.width(), 1e4), WRAP_LEFT, DUTCH_LABELS[label])
            assert bounds.height() <= place.height() + 1
            assert bounds.width() <= place.width() + 1
            assert place.right() <= heading.width() + 1
        places = [heading.column_area(c) for c in sorted(heading.columns())]
        for one, other in pairwise(places):
            assert one.right() <= other.left() + 1


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


def test_cells_lie_side_by_side_after_the_window_has_grown(qtbot: Any) -> None:
    shown = Shown(qtbot, questionnaire(), (1366, 768))
    shown.widget.resize(1920, 1080)
    QApplication.processEvents()
    for row in shown.rows:
        for one, other in pairwise(place_in(row, cell) for cell in row.options):
            assert one.right() < other.left()


def test_grid_keeps_cells_large_and_the_row_within_its_width() -> None:
    for width in range(800, 2600, 60):
        for height in range(600, 1500, 60):
            for judge in (0, 60):
                margin = 40 if width >= 1100 else 24
                across = grid(width, height, Asked(470, judge), margin)
                made = (across.with_rows(height - 210, per_page) for per_page in parts(9, width))
                sizes = next(one for one in made if one.holds)
                assert min(sizes.cell_width, sizes.cell_height) >= LEAST_CELL
                assert sizes.cell_height <= sizes.pitch
                assert sizes.statement_width >= 120
                scale = POINTS * sizes.cell_pitch - 6 * sizes.scale + 16 * sizes.scale
                taken = sizes.number_width + sizes.statement_width + scale + sizes.judge_gap + sizes.judge_width
                assert taken == pytest.approx(width - 2 * margin)


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
