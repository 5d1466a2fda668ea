"""Two settings and their edits: undo, drags, blinding."""

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import StudyError
from study_app.lab.ab_comparison import Setting, Side, Workbench, other_side
from study_app.protocol.load import load_scenes

SCENES = load_scenes("rek2024")


def bench() -> Workbench:
    water, oil = SCENES["water"], SCENES["light_oil"]
    return Workbench(Setting("Water", water, water), Setting("Light oil", oil, oil))


def test_a_refused_edit_states_the_reason_and_changes_nothing() -> None:
    with pytest.raises(StudyError, match="outrun"):
        bench().change("wake.length", 1701.0)


def test_each_edit_names_its_parameters_and_is_one_step_for_undo_and_redo() -> None:
    steps = [bench()]
    steps.append(steps[-1].change("wake.length", 900.0))
    steps.append(steps[-1].choose("B", "Honey", SCENES["honey"]))
    steps.append(steps[-1].change("wake.exponent", 1.25))
    states = [(step.a, step.b) for step in steps]
    last = steps[-1]
    assert (last.setting("A").name, last.setting("B").name) == ("Water", "Honey")
    assert {*last.changed_names("A")} == {"wake.length", "wake.exponent"}
    assert last.changed_names("B") == ()
    assert (last.shown_name("A"), last.shown_name("B")) == ("Water, edited", "Honey")
    assert (last.a.value("wake.length"), last.a.chosen_value("wake.length")) == (900.0, 1700)
    undone = [last, last.undo(), last.undo().undo(), last.undo().undo().undo()]
    assert [(step.a, step.b) for step in undone] == states[::-1]
    assert [(step.may_undo, step.may_redo) for step in undone] == [
        (True, False), (True, True), (True, True), (False, True),
    ]  # fmt: skip
    redone = undone[-1].redo()
    assert (redone.a, redone.b, redone.redo().b) == (*states[1], states[2][1])
    assert not redone.choose("A", "Honey", SCENES["honey"]).may_redo
    dragged = bench().change("wake.length", 800.0, held=True).change("wake.length", 700.0, held=True)
    assert (dragged.undo().a, dragged.a.value("wake.length")) == (bench().a, 700.0)
    two_drags = dragged.change("wake.length", 600.0).change("wake.length", 500.0, held=True)
    assert two_drags.undo().a.value("wake.length") == 600.0
    copied = last.switch().copy_to_other()
    assert (copied.a, copied.b, copied.presented, copied.undo().a) == (last.b, last.b, "B", last.a)


edits = st.lists(
    st.one_of(
        st.tuples(st.just("density"), st.floats(1.0, 25_000.0)),
        st.tuples(st.just("held"), st.integers(1, 100)),
        st.tuples(st.sampled_from(["switch", "copy", "undo", "redo"]), st.none()),
    ),
    max_size=25,
)


@pytest.mark.slow
@settings(max_examples=40)
@given(edits)
def test_undo_takes_everything_back_and_redo_makes_it_again(steps: list[tuple[str, float | None]]) -> None:
    it = bench()
    for what, value in steps:
        match what:
            case "density":
                it = it.change("liquid.density_kg_m3", value)
            case "held":
                it = it.change("wake.length", float(value or 1), held=True)
            case "switch":
                it = it.switch()
            case "copy":
                it = it.copy_to_other()
            case "undo":
                it = it.undo()
            case _:
                it = it.redo()
    last = it
    while last.may_redo:
        last = last.redo()
    begun = it
    while begun.may_undo:
        begun = begun.undo()
    assert (begun.a, begun.b) == (bench().a, bench().b)
    again = begun
    while again.may_redo:
        again = again.redo()
    assert (again.a, again.b) == (last.a, last.b)


def test_blinding_hides_names_and_edits_and_draws_both_sides() -> None:
    drawn_sides: set[tuple[Side, Side]] = set()
    for seed in range(40):
        blind = bench().blinded(Random(seed))  # noqa: S311 - a test draws
        drawn_sides.add((blind.first, blind.presented))
        assert {blind.shown_name("A"), blind.shown_name("B")} == {"Setting 1", "Setting 2"}
        assert blind.shown_name(blind.first) == "Setting 1"
        assert (blind.a, blind.b) == (bench().a, bench().b)
    assert len(drawn_sides) == 4


def test_while_blind_nothing_can_be_edited_and_switching_goes_on() -> None:
    edited = bench().change("wake.exponent", 1.0)
    blind = edited.blinded(Random(1))  # noqa: S311 - a test draws
    for what in (
        lambda: blind.change("wake.exponent", 2.0),
        lambda: blind.choose("A", "Honey", SCENES["honey"]),
        blind.copy_to_other,
    ):
        with pytest.raises(StudyError, match="during a blind comparison"):
            what()
    assert blind.undo() == blind
    assert blind.changed_names("A") == ()
    assert blind.switch().presented == other_side(blind.presented)
    assert blind.blinded(Random(2)) == blind  # noqa: S311 - a test draws
    revealed = blind.revealed()
    assert revealed.shown_name("A") == "Water, edited"
    assert (revealed.may_undo, revealed.may_redo) == (True, False)
