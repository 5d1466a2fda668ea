"""What is shown of each element: cards that concern it, warnings among them, from the program's own functions."""

import pytest

from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.cards import UNKNOWN, Figures, Line, Lines, MeasureCard
from study_app.designer.measures.levels import AS_ASKED
from study_app.designer.measures.measures_page import clipped_sentence
from study_app.designer.measures.measures_view import MeasuresView, measures_view
from study_app.designer.measures.simulation import Controls, GroupPrecision, Measurable, Observed, Simulated
from study_app.designer.measures.study_facts import facts
from study_app.designer.new_study.new_study import template
from study_app.protocol.source.document import Path
from study_app.protocol.source.files import shipped_file


def study_of(name: str) -> Study:
    return read(shipped_file(name).read_bytes(), shipped_file(name).parent)


def view(
    study: Study, path: Path, simulated: Simulated | None = None, controls: Controls | None = None
) -> MeasuresView:
    return measures_view(study, facts(study), path, controls or Controls(), simulated or Simulated(), {})


def lines_of(card: MeasureCard) -> tuple[Line, ...]:
    return next((part.lines for part in card.parts if isinstance(part, Lines)), ())


def test_a_force_that_a_limit_clips_is_said_and_sums_of_a_broken_study_are_not_known() -> None:
    study = study_of("rek2024")
    weak, _ = study.edited(Set(("device", "force_limit_n"), 0.5))
    (force,) = [card for card in view(weak, ("study",)).cards if card.title == "Force of each liquid"]
    assert {line.verdict[2] for line in lines_of(force)} == {"clipped by the force limit"}
    assert {line.share for line in lines_of(force)} == {1.0}
    broken, _ = study.edited(Set(("blocks", "liquids", "repetitions"), -1))
    session = view(broken, ("study",)).cards[0]
    figures = session.parts[0]
    assert isinstance(figures, Figures)
    assert {number for number, _ in figures.figures} == {UNKNOWN}
    assert any(len(lines_of(card)) == 4 for card in view(broken, ("study",)).cards)


def test_cards_say_which_levels_are_clipped_and_whether_that_is_simulated() -> None:
    levels = Set(("stimuli", "damping", "levels"), [0.02, 2.0])
    free = {"kind": "explore", "min_s": 2, "max_s": 4, "instruction": "Feel."}
    paced, _ = template("viscosity-jnd").edited(levels, Set(("stimuli", "damping", "standards"), [32]))
    unpaced, _ = template("viscosity-jnd").edited(
        levels, Set(("stimuli", "damping", "standards"), [12]), Set(("tasks", "stir"), free)
    )
    measured = Simulated(
        measurable=Measurable((0.02, 0.4), ()), group=GroupPrecision(12, 60, 0.15, 80, 0.9, 107, 1, 60, 9)
    )
    for study, said, group in (
        (paced, "Levels above 65.6 % are clipped: observers are simulated with what the limits leave", ""),
        (
            unpaced,
            f"Levels above 122 % are clipped in fast motions, whose trials are repeated. {AS_ASKED}",
            f". {AS_ASKED}",
        ),
        (template("viscosity-jnd"), "", ""),
    ):
        jnds, _, people, _ = view(study, ("blocks", "viscosity"), measured).numbers
        assert jnds.more == said
        own = view(study, ("blocks", "training")).levels
        assert own is not None
        assert clipped_sentence(own) == ""  # it presents no clipped level
        assert people.more == f"80 % are enough; with 107 trials: 100 %{group}"


@pytest.mark.parametrize(
    ("study", "block", "name"), [("viscosityjnd", "viscosity", "JND"), ("forcedelay", "delay", "threshold")]
)
def test_what_is_simulated_is_called_a_threshold_where_the_standard_is_nothing(
    study: str, block: str, name: str
) -> None:
    words = view(study_of(study), ("blocks", block)).words
    assert words is not None
    assert words.name == name


CLIPPED = "levels are clipped"


@pytest.mark.parametrize(
    ("key", "value", "threshold", "why", "more"),
    [
        ("levels", [0.005, 0.03], None, "levels are too small", "All levels are below twice the level error"),
        ("standards", [32], 0.19, "", ""),
        ("standards", [52], 0.019, CLIPPED, "Levels above 1.92 % are"),
        ("standards", [52], 0.19, CLIPPED, "Levels above 1.92 % are"),
        ("standards", [8, 52], None, CLIPPED, "Levels above 1.92 % of standard 52 N·s/m are"),
        ("standards", [60], 0.19, "the standard is clipped", "The standard is"),
        ("standards", [8, 60], None, "the standard is clipped", "The standard 60 N·s/m is"),
    ],
)
def test_where_nothing_is_measured_the_cards_say_why(
    key: str, value: list[float], threshold: float | None, why: str, more: str
) -> None:
    study, _ = template("viscosity-jnd").edited(Set(("stimuli", "damping", key), value))
    if why:
        asked = Controls(threshold=threshold or 0.19)
        jnds = view(study, ("blocks", "viscosity"), Simulated(measurable=Measurable(None, ())), asked).numbers[0]
        assert (jnds.number, jnds.note) == ("none", ("bad", "warning", why))
        assert jnds.more.startswith(f"{more} clipped" if "clipped" in why else more)
    if threshold is None:
        return
    observed = Observed(threshold, 0.02, 400, 0.75, (0.1,), (0.7,), ((0.7,),), (), ((1, (0.1,) * 5),), (), 0.03, 80)
    group = GroupPrecision(12, 60, 0.15, 80, 1.0, 107, 1.0, 60, 12)
    simulated, asked = Simulated(observed, group=group), Controls(threshold=threshold)
    _, one, people, _ = view(study, ("blocks", "viscosity"), simulated, asked).numbers
    if threshold == 0.019 or not why:  # its levels are presented in full
        assert (one.number, people.note[2]) == ("± 3", "Enough")
        return
    for card in (one, people):
        assert (card.number, card.note) == (UNKNOWN, ("bad", "warning", CLIPPED))
        assert card.more == f"{more} clipped: observers are simulated with what the limits leave"


def test_nothing_is_said_of_the_texts_of_a_file_that_was_never_readable() -> None:
    (session,) = view(Study("[study"), ("study",)).cards
    assert [type(part) for part in session.parts] == [Figures]
