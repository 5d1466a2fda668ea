"""A series of elements in the window, and what helps where a study cannot take one."""

from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.app.designer.edit_steps import Steps
from study_app.app.designer.series_steps import judged_series
from study_app.authoring.edited_study import Study, read
from study_app.gui.designer.prompts import SeriesCard
from study_app.protocol.source.document import value_at
from study_app.viewmodels.designer.prompts import SeriesPlan
from study_app.viewmodels.designer.requests import AddKey, AskSeries, MakeSeries
from tests.authoring.grown import PROTOCOLS

pytestmark = pytest.mark.slow


LEFT = Qt.MouseButton.LeftButton
CONDITION = ("conditions", "thin")
LISTED = ("blocks", "liquids", "conditions")


@pytest.fixture
def water(designer: Any) -> Any:
    """The designer at a condition that a block with a Williams design lists alone."""
    text = designer.file.read_text().replace('conditions = ["thin", "thick"]', 'conditions = ["thin"]')
    designer.file.write_text(text)
    designer.open("kitchen", *CONDITION)
    return designer


def document(designer: Any) -> Any:
    return designer.study.document


def card(designer: Any) -> SeriesCard:
    shown = designer.place.prompt
    assert isinstance(shown, SeriesCard)
    return shown


def test_a_series_of_delays_is_made_by_keys_alone_in_one_step(qtbot: Any, water: Any) -> None:
    before = water.text
    qtbot.keyClick(water.window, Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    values = card(water).values
    assert values.hasFocus()
    assert card(water).number.currentText() == "Delay [ms]"
    qtbot.keyClicks(values, "0 60 120 240")
    assert card(water).lines.text().splitlines()[1] == "Thin 60: 60 ms  ·  thin_60"
    assert card(water).make.text() == "Make 4 conditions"
    qtbot.keyClick(values, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: water.place.prompt is None)
    conditions = document(water)["conditions"]
    named = ["thin", "thin_60", "thin_120", "thin_240"]
    assert [conditions[name]["delay_ms"] for name in named] == [0, 60, 120, 240]
    assert list(document(water)["blocks"]["liquids"]["conditions"]) == named
    assert water.study.faults == ()
    assert water.editing.selected == CONDITION
    assert water.place.outline.selected == tuple(("conditions", name) for name in named)
    assert len(water.steps) == 1
    water.editing.undo()
    assert water.text == before


def test_values_are_refused_in_the_card_and_enter_then_makes_nothing(qtbot: Any, water: Any) -> None:
    before = water.text
    qtbot.mouseClick(water.place.form.head.series, LEFT)
    values = card(water).values
    qtbot.keyClick(values, Qt.Key.Key_Return)
    assert card(water).refusal.text() == "Type the values, such as 0 60 120 240."
    qtbot.keyClicks(values, "0 5000")
    assert card(water).refusal.text() == "5000 is not permitted: Delay is at most 1000."
    assert not card(water).make.isEnabled()
    qtbot.keyClick(values, Qt.Key.Key_Return)
    assert water.text == before
    qtbot.keyClick(values, Qt.Key.Key_Escape)
    assert water.place.prompt is None
    assert water.text == before


def test_a_series_is_offered_in_the_list_of_conditions_and_at_headings(qtbot: Any, designer: Any) -> None:
    designer.open()
    head = designer.place.form.head
    designer.go_to(*LISTED[:2])
    assert head.series.isVisible()  # of blocks
    field = designer.field(*LISTED)
    for chosen, path in (((0,), CONDITION), ((1,), ("conditions", "thick")), ((), ()), ((0, 1), ())):
        field = designer.field(*LISTED)
        field.choose(chosen)
        qtbot.mouseClick(field.series, LEFT)
        assert card(designer).asked.path == path
        designer.place.close_prompt()
        designer.go_to(*LISTED[:2])
    designer.go_to(*LISTED[2:])
    qtbot.mouseClick(head.series, LEFT)
    assert [path for path, _ in card(designer).asked.among] == [
        ("conditions", name) for name in document(designer)["conditions"]
    ]
    assert card(designer).asked.path == ()
    page = next(("pages", name) for name, one in document(designer)["pages"].items())
    designer.editing.ask(AddKey((*page, "min_s")))
    for path in (("study",), ("scene",), ("pages",), page):
        designer.go_to(*path)
        assert not head.series.isVisible()


def test_a_series_of_a_list_asks_which_condition_it_is_of(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", *LISTED[:2])
    qtbot.mouseClick(designer.field(*LISTED).series, LEFT)
    shown = card(designer)
    assert shown.elements.hasFocus()
    assert shown.elements.currentIndex() == -1
    assert not shown.values.isEnabled()
    assert not shown.make.isEnabled()
    for path in (CONDITION, ("conditions", "thick")):
        qtbot.keyClick(card(designer).elements, Qt.Key.Key_Down)
        assert card(designer).elements.hasFocus()
        assert designer.editing.selected == card(designer).asked.path == path
    qtbot.keyClicks(card(designer).values, "0 60")
    qtbot.keyClick(card(designer).elements, Qt.Key.Key_Up)
    assert card(designer).asked.path == CONDITION
    assert card(designer).values.text() == "0 60"
    qtbot.waitUntil(lambda: "differ in liquid and in delay" in card(designer).refusal.text())  # of the block


def shown_ways(designer: Any) -> list[str]:
    return [way.text() for way in card(designer).ways if way.isVisible()]


def test_a_way_on_is_offered_until_the_values_change_and_made_in_one_step(qtbot: Any, designer: Any) -> None:
    designer.open()
    before = designer.text
    designer.place.series_asked.emit(AskSeries(CONDITION))
    values = card(designer).values
    qtbot.keyClicks(values, "0 60")
    qtbot.waitUntil(lambda: len(shown_ways(designer)) == 2)
    assert not card(designer).make.isEnabled()
    qtbot.keyClicks(values, "0")
    assert shown_ways(designer) == []
    qtbot.waitUntil(lambda: shown_ways(designer) == ["List only these in Liquids", "Leave Liquids as it is"])
    qtbot.mouseClick(card(designer).ways[0], LEFT)
    assert designer.place.prompt is None
    assert list(document(designer)["blocks"]["liquids"]["conditions"]) == ["thin", "thin_600"]
    assert len(designer.steps) == 1
    designer.editing.undo()
    assert designer.text == before


def test_values_typed_before_cancel_come_back_for_the_same_element(qtbot: Any, water: Any) -> None:
    liquid = ("liquids", "thin")
    water.place.series_asked.emit(AskSeries(liquid))
    shown = card(water)
    shown.number.setCurrentText("Viscosity [Pa·s]")
    qtbot.keyClicks(shown.values, "1 x")
    qtbot.mouseClick(shown.cancel, LEFT)
    water.place.series_asked.emit(AskSeries(CONDITION))
    assert card(water).values.text() == ""
    water.place.series_asked.emit(AskSeries(liquid))
    shown = card(water)
    assert (shown.number.currentText(), shown.values.text()) == ("Viscosity [Pa·s]", "1 x")
    assert shown.refusal.text() == "“x” is not a number."
    qtbot.keyClicks(shown.values, "1 2")  # in place of them
    qtbot.mouseClick(shown.make, LEFT)
    qtbot.waitUntil(lambda: water.place.prompt is None)
    made = document(water)["liquids"]["thin_2"]
    assert made == {**document(water)["liquids"]["thin"], "viscosity_pa_s": 2}
    water.place.series_asked.emit(AskSeries(liquid))
    assert card(water).values.text() == ""


@pytest.mark.parametrize(("word", "selected"), [("delays", CONDITION), ("series", LISTED[:2])])
def test_a_series_is_found_in_the_list_of_what_can_be_added(
    qtbot: Any, water: Any, word: str, selected: tuple[str, str]
) -> None:
    water.go_to(*selected)
    water.place.ask_to_add()
    adding = water.place.adding
    qtbot.keyClicks(adding.words, word)
    offered = [adding.list.item(at).text() for at in range(adding.list.count())]
    assert "Series of Thin …" in offered
    assert ("Series of Liquids …" in offered) == (selected[0] == "blocks" and word != "delays")
    adding.list.setCurrentRow(offered.index("Series of Thin …"))
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert card(water).asked.path == CONDITION
    assert card(water).values.hasFocus()


@pytest.mark.parametrize(
    ("name", "selected", "why"),
    [
        ("kitchen", ("study",), "This element has no numeric field."),
        ("rek2024", ("conditions", "water"), "This study ships with the program. Make a copy to change it."),
    ],
)
def test_ctrl_shift_d_says_why_there_can_be_no_series(
    qtbot: Any, designer: Any, name: str, selected: tuple[str, ...], why: str
) -> None:
    designer.open(name)
    designer.go_to(*selected)
    both = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    qtbot.keyClick(designer.window, Qt.Key.Key_D, both)
    assert designer.messages == [("There can be no series of this element", why)]
    assert designer.place.prompt is None


def test_blocks_of_a_series_get_letters_titles_and_places_in_the_session(designer: Any) -> None:
    block = ("blocks", "liquids")
    designer.open("rek2024", "conditions", "water")
    assert not designer.place.form.head.series.isVisible()  # read-only
    designer.controller.begin("rek2024", "mine")
    before = document(designer)["sequence"]
    faults = designer.study.faults
    designer.editing.ask(MakeSeries(block, (*block, "repetitions"), "1 2 3"))
    after = document(designer)
    at = before.index("liquids")
    assert after["sequence"] == (*before[: at + 1], "liquids_2", "liquids_3", *before[at + 1 :])
    letters = [one["code_prefix"] for one in after["blocks"].values() if "code_prefix" in one]
    assert len(letters) == len(set(letters))
    assert after["blocks"]["liquids_3"]["title"]["nl"] == "Basisinstellingen, 3"
    assert designer.study.faults == faults


WATER, NO_DELAY = ("conditions", "water"), ("conditions", "delay_0")
SYRUP = ("liquids", "syrup")
LIQUIDS, BASELINE, DELAYS = ((("blocks", name, "conditions")) for name in ("liquids", "baseline", "delays"))
ALONE, LEFT_OUT = "Leave Baseline as it is", "Leave out 50 ms"


@pytest.fixture(scope="module")
def study() -> Study:
    """A study with a block of liquids, and a condition that a baseline has alone and another block with delays."""
    return read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)


def judged(study: Study, path: tuple[str, str], values: str, key: str = "delay_ms") -> SeriesPlan | None:
    """Return what is shown last of a series of delays, None where it can be made."""
    plans = [one for one in judged_series(study, MakeSeries(path, (*path, key), values)) if one is not None]
    return plans[-1] if plans else None


def words_of(plan: SeriesPlan | None) -> list[str]:
    assert plan is not None
    return [way.words for way in plan.ways]


def made(study: Study, plan: SeriesPlan | None, words: str) -> Study:
    """Return the study after one of the ways of a plan, which causes no problem."""
    assert plan is not None
    way = next(one for one in plan.ways if one.words == words)
    after, _ = study.edited(*Steps().step(study, way.asks).edits)
    assert after.faults == ()
    return after


def listed(study: Study, path: tuple[str, ...]) -> list[str]:
    return list(value_at(study.document, path))


def test_the_block_that_is_the_cause_alone_stays_as_it_is(study: Study) -> None:
    plan = judged(study, NO_DELAY, "0 30 60")
    assert ALONE in words_of(plan)
    after = made(study, plan, ALONE)
    assert listed(after, BASELINE) == ["delay_0"]
    assert listed(after, DELAYS)[:4] == ["delay_0", "delay_30", "delay_60", "delay_50"]


def test_values_that_cause_a_problem_are_named_and_left_out(study: Study) -> None:
    plan = judged(study, NO_DELAY, "0 30 50 60")
    assert plan is not None
    assert plan.refusal == '50 ms: Delay effect, Conditions: "delay_50" presents the same as "delay_50_2".'
    after = made(study, plan, f"{LEFT_OUT}, and leave Baseline as it is")
    assert listed(after, DELAYS)[:4] == ["delay_0", "delay_30", "delay_60", "delay_50"]
    without, _ = study.edited(
        *Steps().step(study, MakeSeries(NO_DELAY, (*NO_DELAY, "delay_ms"), "1 2", kept=(BASELINE,))).edits
    )
    again = judged(without, ("conditions", "delay_2"), "2 30 50")
    assert words_of(again)[0] == LEFT_OUT
    assert "delay_30" in made(without, again, LEFT_OUT).document["conditions"]


@pytest.mark.parametrize(
    ("values", "why", "words"),
    [
        ("900 0.001 950", "0.001 is not permitted: Density is at least 0.01.", "Leave out 0.001 kg/m³"),
        ("900 950 950", "950 is there twice.", "Leave out one 950 kg/m³"),
        ("-1 -2 900 -3 -4 950", "-1 is not permitted: Density is at least 0.01.", "Leave out 4 values"),
        (" ".join(map(str, range(900, 926))), "A series has at most 24 values.", "Leave out 924, 925 kg/m³"),
    ],
)
def test_values_that_are_not_permitted_can_be_left_out(study: Study, values: str, why: str, words: str) -> None:
    plan = judged(study, SYRUP, values, "density_kg_m3")
    assert plan is not None
    assert plan.refusal.splitlines()[0] == why
    assert words_of(plan) == [words]
    made(study, plan, words)


def test_a_series_is_refused_while_the_file_cannot_be_read_or_has_no_such_number(study: Study) -> None:
    broken, _ = study.typed(f"{study.text}\n[")
    for now, key, why in ((broken, "delay_ms", "The file cannot be read"), (study, "nosuch", "Choose a number")):
        plan = judged(now, WATER, "0 60", key)
        assert plan is not None
        assert plan.refusal.startswith(why)
        assert plan.ways == ()
