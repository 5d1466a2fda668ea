"""The questionnaire of statements: rows and columns by keys, mouse and touch, and what a screen reader hears."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QAccessible, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.widgets.accessible import HeadingLabel
from study_app.session.transitions.events import Chosen, ItemShown, Submitted
from tests.gui.drawn import drawn_by
from tests.gui.participant.driver import KEY, Participant, name_of, tap, told_of
from tests.gui.small import DUTCH_LABELS, LABELS, questionnaire

pytestmark = pytest.mark.slow

Opening = Callable[..., Participant]
FULL, SMALL = (1366, 768), (880, 640)
GIVEN = (6, 5, 4, None, 7, 2, 1, 4, 7)


@pytest.fixture
def participant(opening: Opening) -> Participant:
    return opening(questionnaire(cannot_judge="Cannot judge"), FULL)


def values(participant: Participant) -> list[Any]:
    return [value for _, value in participant.answers]


def visible(participant: Participant) -> list[int]:
    return [row.view.number for row in participant.page.fields if row.isVisible()]


def cell(participant: Participant, row: int, value: int | None) -> Any:
    """Return the cell of a point, or of "cannot judge", in a row from 1."""
    return participant.find("Cannot judge" if value is None else f"{value} {LABELS[value - 1]}", row)


@pytest.mark.parametrize("way", ["keys", "mouse", "touch"])
def test_all_statements_are_answered_in_each_way_with_events_in_order(
    participant: Participant, finger: QPointingDevice, way: str
) -> None:
    for row, value in enumerate(GIVEN, 1):
        if way == "mouse":
            participant.click(cell(participant, row, value))
        elif way == "touch":
            tap(finger, cell(participant, row, value))
        elif value is None:
            participant.press(*[KEY.Key_Right] * 8, KEY.Key_Space)
        else:
            participant.press(KEY(KEY.Key_0 + value))
    assert way == "touch" or participant.focus is (
        participant.page.button if way == "keys" else participant.question(9)
    )
    if way == "touch":
        tap(finger, cell(participant, 1, 2), QPoint(2, 2))  # a change, at the corner of its cell
        tap(finger, participant.page.button)
    else:
        participant.press(KEY.Key_Return, KEY.Key_Return)
    changes = 1 if way == "touch" else 0
    kinds = [type(event) for event in participant.events]
    assert kinds == [ItemShown] * 9 + [Chosen] * (9 + changes) + [Submitted]
    assert [event.item for event in participant.events[:9]] == [f"item{n}" for n in range(1, 10)]
    assert values(participant) == [*GIVEN, *[2] * changes]
    times = [event.at_s for event in participant.events]
    assert times == sorted(times)


def test_the_column_that_is_pointed_at_is_labelled_beside_ends_and_middle(
    participant: Participant, opening: Opening, finger: QPointingDevice
) -> None:
    fixed = (LABELS[0], LABELS[3], LABELS[6])
    assert set(fixed) <= set(participant.page.heading)
    before = participant.page.heading
    QTest.mouseMove(cell(participant, 3, 2))
    participant.click(cell(participant, 3, 2))
    assert set(participant.page.heading) == set(before) | {LABELS[1]}
    QTest.mouseMove(participant.page, QPoint(5, 5))
    QApplication.processEvents()
    assert participant.page.heading == before
    tap(finger, cell(participant, 3, 2))
    assert participant.page.heading == before, "a finger that is lifted points at nothing"
    participant = opening(questionnaire(labels=DUTCH_LABELS), (860, 640))  # which have no room beside each other
    participant.press(KEY.Key_Right, KEY.Key_Right)
    assert DUTCH_LABELS[1] in participant.page.heading
    assert DUTCH_LABELS[0] not in participant.page.heading


def test_a_small_window_shows_five_a_page_and_asks_page_by_page(opening: Opening, finger: QPointingDevice) -> None:
    participant = opening(questionnaire(), SMALL)
    assert visible(participant) == [1, 2, 3, 4, 5]
    assert [event.item for event in participant.events] == [f"item{n}" for n in visible(participant)]
    participant.press(*[KEY.Key_3] * 4, KEY.Key_Return)
    assert participant.page.message == "One statement still needs an answer: 5."
    participant.press(KEY.Key_3, KEY.Key_Return)
    assert visible(participant) == [6, 7, 8, 9]
    assert participant.focus is participant.question(6)
    participant.settle()
    participant.press(KEY.Key_Up)
    assert visible(participant) == [1, 2, 3, 4, 5]
    participant.settle()
    tap(finger, participant.find("6–9"))
    participant.settle()
    tap(finger, participant.page.button)
    assert participant.page.message.endswith("6, 7, 8 and 9.")
    participant.press(*[KEY.Key_2] * 4, KEY.Key_Return)
    assert participant.kinds == [Chosen] * 9 + [Submitted]
    assert {event.item for event in participant.events if isinstance(event, ItemShown)} == {
        f"item{n}" for n in range(1, 10)
    }
    participant.window.resize(*FULL)
    assert visible(participant) == [*range(1, 10)]
    assert participant.page.tabs == []


def test_pointed_chosen_and_missing_answers_are_announced(
    participant: Participant, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    checked: list[tuple[str, bool]] = []

    def update(event: Any) -> None:
        if event.type() == QAccessible.Event.Announcement:
            said.append(event.message())
        elif event.type() == QAccessible.Event.Focus:
            checked.append((name_of(event.object()), bool(told_of(event.object()).state().checked)))

    monkeypatch.setattr(QAccessible, "isActive", lambda: True)
    monkeypatch.setattr(QAccessible, "updateAccessibility", update)
    participant.press(KEY.Key_Right, KEY.Key_Space, KEY.Key_4)
    assert said == ["1 Completely disagree", "chosen: 1 Completely disagree", "chosen: 4 Neutral"]
    assert ("4 Neutral", True) in checked
    participant.press(KEY.Key_Return)
    assert said[-1] == "Seven statements still need an answer: 3, 4, 5, 6, 7, 8 and 9."


def test_announcements_reach_qt(participant: Participant) -> None:
    was = QAccessible.isActive()
    QAccessible.setActive(True)
    participant.press(KEY.Key_Right, KEY.Key_Space)  # an announcement that Qt refuses would be a warning, and fail
    QAccessible.setActive(was)


def test_all_is_mirrored_but_the_order_of_the_scale_and_the_keys_that_go_along_it(opening: Opening) -> None:
    page = questionnaire(cannot_judge="Cannot judge")
    here, there = opening(page, FULL), opening(page, FULL, "ar")

    def lefts(participant: Participant) -> list[int]:
        return [option.mapTo(participant.page, QPoint()).x() for option in participant.question(1).options]

    assert lefts(here) == sorted(lefts(here))
    assert lefts(there)[:7] == sorted(lefts(there)[:7])
    assert lefts(there)[7] < lefts(there)[0]
    row, mirror = here.question(1), there.question(1)
    assert mirror.geometry() == row.geometry()
    assert mirror.columns[0][0] == pytest.approx(row.width() - sum(row.columns[6]), abs=2)
    assert there.page.button.geometry().left() < 60 < here.page.button.geometry().left()
    there.press(KEY.Key_Right, KEY.Key_Right, KEY.Key_Space)
    assert values(there) == [2]


@pytest.mark.parametrize(("judge", "has_column"), [(None, False), ("Cannot judge", True)])
def test_only_a_page_that_asks_it_has_a_column_for_cannot_judge(
    opening: Opening, judge: str | None, has_column: bool
) -> None:
    sizes = opening(questionnaire(cannot_judge=judge), FULL).question(1).sizes
    assert (sizes.judge_width > 0.0, sizes.judge_gap > 0.0) == (has_column, has_column)


def test_numbers_and_statements_grow_with_the_text_of_the_page(opening: Opening) -> None:
    heights, scales = list[list[float]](), list[float]()
    for text_scale in (1.0, 2.0):
        participant = opening(questionnaire(("It is thick.", "It is warm.")), FULL, text_scale=text_scale)
        ink = {drawn.text: drawn.ink.height() for drawn in drawn_by(participant.window)}
        heights.append([ink[text] for text in ("1", "It is thick.", "2", "It is warm.")])
        scales.append(participant.question(2).sizes.text)
    assert scales[1] > 1.3 * scales[0]
    assert heights[1] == pytest.approx([scales[1] / scales[0] * height for height in heights[0]], rel=0.08)


@pytest.mark.parametrize(
    ("size", "words", "text_scale", "parts"),
    [(FULL, 20, 1.0, [7]), (SMALL, 20, 1.0, [4, 3]), (SMALL, 40, 1.0, [1] * 7), (FULL, 60, 2.0, [1] * 7)],
)
def test_statements_are_divided_evenly_and_one_to_a_page_where_no_more_fit(
    opening: Opening, size: tuple[int, int], words: int, text_scale: float, parts: list[int]
) -> None:
    statements = tuple(f"Statement {number}: {'thick ' * words}" for number in range(1, 8))
    participant = opening(questionnaire(statements), size, text_scale=text_scale)
    assert [len(part) for part in participant.page.parts] == parts
    assert [field.view.number for part in participant.page.parts for field in part] == list(range(1, 8))


@pytest.mark.parametrize("size", [SMALL, FULL, (1920, 1080)])
def test_two_hundred_statements_stay_legible_and_quick(opening: Opening, size: tuple[int, int]) -> None:
    participant = opening(questionnaire(tuple(f"Statement {number}" for number in range(1, 201))), size)
    parts = len(participant.page.parts)
    for part in (0, parts // 2, parts - 1):
        participant.page.go_to(participant.page.parts[part][0])
        QApplication.processEvents()
        tabs = [tab for tab in participant.page.tabs if tab.isVisible()]
        assert len([tab for tab in tabs if tab.isChecked()]) == 1
        edges = sorted((tab.geometry().left(), tab.geometry().right()) for tab in tabs)
        assert all(right < left for (_, right), (left, _) in pairwise(edges))
        assert edges[0][0] > participant.page.findChild(HeadingLabel).geometry().right()
        assert edges[-1][1] < participant.page.width()
        assert all(tab.fontMetrics().horizontalAdvance(tab.text()) < tab.width() for tab in tabs)
    for _ in participant.page.parts[-1]:
        participant.press(KEY.Key_4)
    assert [value for _, value in participant.answers] == [4] * len(participant.page.parts[-1])
