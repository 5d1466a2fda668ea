"""Confirmation cards and lines with buttons: each button sends its request."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.designer.document.additions import number_rows
from study_app.designer.document.steps import DeleteElement, DuplicateElement, MakeSeries
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.header import Notice, NoticeCard
from study_app.designer.problems import ProblemLine, ProblemsCard, problem_rows, warning_rows
from study_app.designer.prompts import ConfirmCard, DeleteCard, SeriesCard, places_of_references
from study_app.gui.widgets.cards import Icon
from tests.designer.support.designer import DEMO

pytestmark = pytest.mark.slow
STUDY = read_study(DEMO.encode())
LIQUID, BLOCK = ("liquids", "thin"), ("blocks", "liquids")


def texts(card: QWidget) -> list[str]:
    return [part.text() for part in card.findChildren(QLabel) if not part.isHidden()]


def test_the_card_of_a_deletion_names_the_places_and_offers_the_other_elements(qtbot: Any) -> None:
    places = places_of_references(STUDY, LIQUID)
    assert places == ("Condition Thin: Liquid", "Condition Prompt: Liquid", "Condition Late: Liquid")
    card, answers = DeleteCard(STUDY, LIQUID, places), list[object]()
    qtbot.addWidget(card)
    card.answered.connect(answers.append)
    assert {"Delete Thin?", "It is used in 3 places:", *places} <= set(texts(card))
    assert [card.other.itemText(at) for at in range(card.other.count())] == ["Thick (thick)"]
    assert card.first is card.cancel
    card.gaps.click()
    card.all.click()
    card.other.activated.emit(0)
    assert answers == [DeleteElement(LIQUID, how) for how in ("gaps", "all")] + [
        DeleteElement(LIQUID, "other", "thick")
    ]
    assert places_of_references(STUDY, ("pages", "thanks")) == ("Session order: 5",)


@pytest.mark.parametrize(
    ("path", "duplicates", "heading", "explanation"),
    [
        (BLOCK, False, "Series of Liquids", "one value per copy of Liquids. The copies are added to the session."),
        (LIQUID, False, "Series of Thin", "copy of Thin. The copies are added to the blocks that use the original."),
        (BLOCK, True, "Duplicate Liquids", "Enter the value for the copy's own conditions, such as a delay"),
    ],
)
def test_the_card_of_a_series_asks_for_copies_with_the_typed_values(
    qtbot: Any, path: Any, duplicates: bool, heading: str, explanation: str
) -> None:
    numbers = number_rows(STUDY.document, path)
    card, answers = SeriesCard(STUDY, path, numbers, duplicates=duplicates), list[object]()
    qtbot.addWidget(card)
    card.answered.connect(answers.append)
    assert heading in texts(card)
    assert any(explanation in text for text in texts(card))
    assert card.number.count() == len(numbers)
    assert card.same.isHidden() == (not duplicates)
    for typed, makes in (("", False), ("2 x", False), ("7 11", True)):
        card.values.setText(typed)
        assert card.make.isEnabled() == makes, typed
        assert bool(card.copies.text()) == bool(typed)
    card.make.click()
    card.same.click()
    assert answers == [MakeSeries(path, numbers[0].path, (7, 11)), DuplicateElement(path)]


def test_a_confirmation_answers_its_action_and_escape_gives_up(qtbot: Any) -> None:
    card, answers = (
        ConfirmCard("Change the ID?", "It was recorded.", "Change it", "pen", ["One", "Two"]),
        list[object](),
    )
    qtbot.addWidget(card)
    card.answered.connect(answers.append)
    assert texts(card)[-2:] == ["•  One", "•  Two"]
    for give_up in (card.cancel.click, lambda: QTest.keyClick(card, Qt.Key.Key_Escape)):
        with qtbot.waitSignal(card.given_up):
            give_up()
    assert answers == []
    card.confirm.click()
    assert answers == ["Change it"]


@pytest.mark.parametrize("closes", [True, False])
def test_each_button_of_a_notice_asks_for_its_own_action(qtbot: Any, closes: bool) -> None:
    card, actions = NoticeCard(of_playing=False), list[str]()
    qtbot.addWidget(card)
    card.asked.connect(actions.append)
    card.show_notice(
        Notice("Changed", (("keep", "Keep mine"), ("take", "Use the file's")), listed=("a",), closes=closes)
    )
    assert {action: button.text() for action, button in card.buttons.items()} == {
        "keep": "Keep mine",
        "take": "Use the file's",
    }
    assert [part.text() for part in card.findChildren(QLabel)][:2] == ["Changed", "a"]
    for action in ("take", "keep"):
        card.buttons[action].click()
    assert card.close_button.isHidden() == (not closes)
    assert card.close_by_key() == closes
    assert actions == ["take", "keep"] + ["close"] * closes
    card.show_notice(None)
    assert card.isHidden()


def test_problems_and_warnings_have_their_own_signs_and_can_be_limited_to_an_element(qtbot: Any) -> None:
    study, _ = STUDY.with_edits(Unset((*LIQUID, "density_kg_m3")), Set((*BLOCK, "repetitions"), 0))
    problems, warned = problem_rows(study), warning_rows(study, ["blocks.delays.order: the order is fixed"])
    inks = []
    for row in (*problems, *warned):
        line = ProblemLine(row, ("Use 1", "Remove", "Third"), narrow=False)
        qtbot.addWidget(line)
        inks.append(line.findChildren(Icon)[0].ink)
        assert [button.text() for button in line.repairs] == ["Use 1", "Remove"]
        with qtbot.waitSignal(line.repair_asked, check_params_cb=lambda words: words == "Remove"):
            line.repairs[1].click()
    assert inks == ["bad", "bad", "warn"]
    card = ProblemsCard()
    qtbot.addWidget(card)
    card.show_problems(problems, LIQUID)
    card.show_warnings(warned)
    assert card.heading.text() == "2 problems, 1 warning"
    elements = {}
    for element in (LIQUID, ("blocks", "delays"), ("device",)):
        card.show_problems(problems, element)
        for here_only in (False, True):
            card.limit.buttons[here_only].click()
            elements[element[-1], card.limit.buttons[here_only].text()] = [line.row.element for line in card.lines]
    everything = [LIQUID, BLOCK, ("blocks", "delays")]
    assert elements == {
        ("thin", "All"): everything,
        ("thin", "Here only"): [LIQUID],
        ("delays", "All"): everything,
        ("delays", "Here only"): [("blocks", "delays")],
        ("device", "All"): everything,
        ("device", "Here only"): [],
    }
    assert "This element does not have any problems; the other elements have 3" in texts(card.area.widget())


def test_back_leads_through_the_elements_that_were_selected(designer: Any) -> None:
    designer.open()
    first, *others = designer.editing.selected, LIQUID, BLOCK, ("device",)
    for path in others:
        designer.editing.select(path)
    back = []
    for _ in range(4):
        designer.editing.go_back()
        back.append(designer.editing.selected)
    assert back == [BLOCK, LIQUID, first, first]
