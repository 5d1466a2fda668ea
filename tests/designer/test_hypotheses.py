"""Order and hypotheses of the main blocks: found in their words, chosen beside the blocks, planned in Measures."""

from typing import Any

import pytest
from PySide6.QtWidgets import QTableWidgetItem

from study_app.designer.document.steps import RetypeFile
from study_app.designer.outline import ROW_ROLE

pytestmark = pytest.mark.slow

CONTRASTS, ORDER = ("analysis", "contrasts"), ("study", "block_order")


@pytest.fixture
def planned(designer: Any) -> Any:
    """The study in format 2 with a number of participants."""
    designer.change(("format = 1", "format = 2"), ("[limits]", "[analysis]\nparticipants = 11\n\n[limits]"))
    designer.open()
    return designer


def choose(box: Any, words: str) -> None:
    """Choose an entry of a list as a user does: open it, and press its place."""
    at = next(at for at in range(box.count()) if box.itemText(at).startswith(words))
    box.setFocus()
    box.setCurrentIndex(at)
    box.activated.emit(at)


@pytest.mark.parametrize("words", ["counterbalance", "order of blocks", "block order"])
def test_the_order_of_the_blocks_is_found_in_the_words_of_the_field(planned: Any, words: str) -> None:
    planned.hit("ctrl+f")
    planned.type(words)
    planned.hit("Return")
    assert planned.editing.selected == ("sequence",)
    assert planned.form_row(*ORDER).isAncestorOf(planned.keyboard)


@pytest.mark.parametrize("path", [("sequence",), ("blocks", "delays")])
def test_the_order_of_the_blocks_says_what_the_planned_participants_get(planned: Any, path: tuple[str, ...]) -> None:
    planned.go_to(*path)
    assert planned.field(*ORDER).extra.text() == "Everybody has them in this order."
    planned.click_on(planned.field(*ORDER).segments.buttons[1])
    assert planned.value(*ORDER) == "balanced"
    said = planned.field(*ORDER).extra
    assert said.isVisible()
    assert said.text() == (
        "2 orders, by the number in the participant's id; 11 participants have each block in each place 5 to 6 times, "
        "5.5 on average; 12 would be even."
    )


def test_a_hypothesis_is_a_sentence_with_choices(planned: Any) -> None:
    planned.go_to("sequence")
    before = planned.text
    planned.click_on(planned.field(*CONTRASTS).add)
    line = planned.field(*CONTRASTS).lines[0]
    assert line.isAncestorOf(planned.keyboard)
    thin = {"measure": "feels_liquid", "blocks": ("liquids",), "conditions": ("thin", "thick")}
    assert dict(planned.value(*CONTRASTS)[0]) == {**thin, "expected": "higher"}
    choose(line.first, "Late in Delays")
    late = {"measure": "harder", "blocks": ("delays",), "conditions": ("late", "prompt")}
    assert dict(planned.value(*CONTRASTS)[0]) == {**late, "expected": "higher"}
    choose(line.measure, "Comfortable")
    choose(line.relation, "is equal to")
    assert dict(planned.value(*CONTRASTS)[0]) == {**late, "measure": "comfortable", "bound": 0.5}
    planned.fill(line.bound, "0.25")
    assert planned.value(*CONTRASTS)[0]["bound"] == 0.25
    choose(line.relation, "is different from")
    assert dict(planned.value(*CONTRASTS)[0]) == {**late, "measure": "comfortable"}
    assert planned.study.faults == ()
    planned.go_to("blocks", "delays")
    assert planned.field(*CONTRASTS).lines[0].first.currentText() == "Late in Delays"
    planned.click_on(planned.field(*CONTRASTS).lines[0].away)
    assert planned.value(*CONTRASTS) is None
    assert planned.undo_all() == before


@pytest.mark.parametrize("written", ["3", "[3]", "[{ blocks = 4, measure = 5, expected = 6, bound = 'x' }]"])
def test_hypotheses_that_cannot_be_read_are_shown_with_their_fault(planned: Any, written: str) -> None:
    planned.editing.ask(RetypeFile(planned.text.replace("participants = 11", f"contrasts = {written}")))
    planned.go_to("sequence")
    assert planned.form_row(*CONTRASTS).wrong.isVisible()
    for line in planned.field(*CONTRASTS).lines:
        assert line.first.currentIndex() == -1


def test_two_blocks_of_levels_are_compared_by_their_thresholds(designer: Any) -> None:
    designer.controller.begin("template:viscosity-jnd", "thicker")
    designer.go_to("blocks", "viscosity")
    assert not designer.field(*CONTRASTS).add.isEnabled()
    assert "add a second one" in designer.field(*CONTRASTS).why.text()
    designer.place.duplicate()
    designer.go_to("sequence")
    designer.click_on(designer.field(*CONTRASTS).add)
    first, second = (one for one in designer.value("blocks") if one.startswith("viscosity"))
    wanted = {"measure": "threshold", "blocks": (first, second), "expected": "higher"}
    assert dict(designer.value(*CONTRASTS)[0]) == wanted
    line = designer.field(*CONTRASTS).lines[0]
    shown = line.first.currentText(), line.second.currentText()
    assert shown == ("Viscosity (viscosity)", "Viscosity (viscosity_2)")
    (row,) = [one for one in designer.place.outline.indexes() if one.data(ROW_ROLE).path == ("sequence",)]
    assert row.data(ROW_ROLE).faults == 0


def test_the_guide_of_two_conditions_makes_a_study_without_problems(designer: Any) -> None:
    """The steps of docs/two-conditions.md, by clicks and typed words."""
    designer.controller.begin("template:viscosity-jnd", "thicker")
    head = designer.place.form.head
    designer.go_to("conditions", "damper")
    designer.click_on(designer.form_row("conditions", "damper", "ball").remove)
    designer.click_on(head.series)
    card = designer.place.prompt
    choose(card.number, "Visual delay")
    card.table.setCurrentCell(0, 0)
    card.table.setItem(0, 0, QTableWidgetItem("60"))
    designer.click_on(card.make)
    designer.go_to("stimuli", "damping")
    designer.click_on(head.copy)
    choose(designer.field("stimuli", "damping_2", "condition").list, "damper_60")
    designer.go_to("blocks", "viscosity")
    designer.click_on(head.copy)
    choose(designer.field("blocks", "viscosity_2", "stimulus").list, "damping_2")
    (title,) = designer.field("blocks", "viscosity_2", "title").lines.values()
    designer.fill(title, "Viscosity, late")
    designer.go_to("sequence")
    designer.click_on(designer.field(*ORDER).segments.buttons[1])
    designer.click_on(designer.field(*CONTRASTS).add)
    choose(designer.field(*CONTRASTS).lines[0].relation, "is different from")
    designer.hit("Insert")
    designer.type("nasa")
    designer.hit("Return")
    next(one for one in head.asks.actions() if one.text().startswith("After each block")).trigger()
    steps = ("welcome", "training", "ready", "viscosity", "nasa_tlx", "viscosity_2", "nasa_tlx", "thanks")
    assert designer.value("sequence") == steps
    contrast = {"measure": "threshold", "blocks": ("viscosity", "viscosity_2")}
    assert tuple(map(dict, designer.value(*CONTRASTS))) == (contrast,)
    assert designer.study.protocol is not None
    assert designer.study.protocol.study.block_order == "balanced"


ONE = 'measure = "like_honey", blocks = ["liquids"], conditions = ["thin", "thick"]'
IN_GROUPS = """[groups.a]
sequence = ["welcome", "liquids", "reaching", "delays", "thanks"]

[groups.b]
sequence = ["welcome", "delays", "reaching", "liquids", "thanks"]

[limits]"""


def stated(designer: Any, hypothesis: str, *changes: tuple[str, str]) -> Any:
    """Return the line of a hypothesis of the study."""
    tables = f"[analysis]\nparticipants = 11\ncontrasts = [{{ {hypothesis} }}]\n\n[limits]"
    designer.change(("format = 1", "format = 2"), ("[limits]", tables), *changes)
    designer.open()
    designer.go_to("sequence")
    return designer.field(*CONTRASTS).lines[0]


@pytest.mark.parametrize("typed", ["Backspace", "x"])
def test_a_bound_that_is_no_number_is_refused_and_changes_nothing(qtbot: Any, designer: Any, typed: str) -> None:
    line = stated(designer, f"{ONE}, bound = 0.6")
    before = designer.text
    line.bound.setFocus()
    line.bound.selectAll()
    designer.hit(typed)
    qtbot.waitUntil(lambda: "The study keeps 0.6" in designer.field(*CONTRASTS).refusal)
    assert designer.text == before
    assert designer.keyboard is line.bound


def test_a_hypothesis_without_anything_to_compare_keeps_what_it_names(designer: Any) -> None:
    fewer = (
        ('conditions = ["thin", "thick"]', 'conditions = ["thin"]'),
        ('conditions = ["prompt", "late"]', 'conditions = ["prompt"]'),
    )
    choose(stated(designer, f'{ONE}, expected = "higher"', *fewer).relation, "is lower than")
    (table,) = designer.value(*CONTRASTS)
    assert (table["conditions"], table["expected"]) == (("thin", "thick"), "lower")


def test_a_measure_stays_by_its_id(designer: Any) -> None:
    line = stated(designer, f'{ONE}, expected = "higher"', ('id = "harder"', 'id = "like_honey"'))
    choose(line.first, "Late")
    (table,) = designer.value(*CONTRASTS)
    assert (table["measure"], table["blocks"]) == ("like_honey", ("delays",))


def test_the_order_is_found_where_groups_have_their_own_sessions(designer: Any) -> None:
    own = 'sequence = ["welcome", "liquids", "reaching", "delays", "thanks"]\n'
    designer.change(("format = 1", "format = 2"), (own, ""), ("[limits]", IN_GROUPS))
    designer.open()
    designer.hit("ctrl+f")
    designer.type("order of blocks")
    designer.hit("Return")
    assert designer.editing.selected == ("blocks", "liquids")
    assert designer.form_row(*ORDER).isAncestorOf(designer.keyboard)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('conditions = ["thin", "thick"]', ""),
        ('phase = "main" ', "phase = {} "),
        ('sequence = ["w', 'sequence = 5 # ["w'),
    ],
)
def test_a_study_with_other_things_in_their_places_is_shown(designer: Any, before: str, after: str) -> None:
    designer.change(("format = 1", "format = 2"), (before, after))
    designer.open()
    for block in designer.value("blocks"):
        designer.go_to("blocks", block)
        assert designer.form_row("blocks", block, "task").isVisible()
