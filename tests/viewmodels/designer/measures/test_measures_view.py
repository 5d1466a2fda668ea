"""What is shown of each element: cards that concern it, warnings among them, from the program's own functions."""

from types import SimpleNamespace
from typing import Any

import pytest

from study_app.authoring.edited_study import Study, read
from study_app.authoring.measures.observers import Measurable, Observed
from study_app.authoring.measures.planned import Detectable, Finding, GroupPrecision
from study_app.authoring.new_study import template
from study_app.authoring.study_facts import facts
from study_app.authoring.writer.edits import Set
from study_app.haptics.model.steady_state import HAND_MPS, steady
from study_app.protocol.source.document import Path
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.measures.level_plots import AS_ASKED, Simulated
from study_app.viewmodels.designer.measures.level_words import even_ticks, log_ticks, rounded
from study_app.viewmodels.designer.measures.measures_view import Controls, SlowResults, measures_view
from study_app.viewmodels.designer.measures.number_cards import (
    ON_AVERAGE,
    UNKNOWN,
    BalanceCard,
    LinesCard,
    MeasuresView,
    SessionCard,
    TextsCard,
)
from study_app.viewmodels.designer.measures.session_cards import warnings_card


def study_of(name: str) -> Study:
    return read(shipped_file(name).read_bytes(), shipped_file(name).parent)


def view(
    study: Study, path: Path, slow: SlowResults | None = None, people: int = 12, planned: int | None = None
) -> MeasuresView:
    controls = Controls(people, planned=planned)
    return measures_view(study, facts(study), path, controls, slow or SlowResults(), {})


def test_a_block_of_statements_shows_session_balance_power_and_force() -> None:
    study = study_of("physical2")
    found = Detectable(12, 200, 7, (Finding("like_honey", 1.04), Finding("thick", None)))
    session, balance, power, force, *_ = view(
        study, ("blocks", "liquids"), SlowResults(detectable=found, parts=1)
    ).cards
    assert isinstance(session, SessionCard)
    assert ("ok", "check", "One page, no scrolling at 1366 × 768") in session.verdicts
    assert sum(share for _, share, *_ in session.segments) == pytest.approx(1.0)
    assert isinstance(balance, BalanceCard)
    assert balance.verdict == ("ok", "check", "balanced: 12 participants are 2 rounds of 6")
    assert {count for line in balance.positions for count in line} == {4}
    assert isinstance(power, LinesCard)
    assert [line.number for line in power.lines] == ["1.0", UNKNOWN]
    assert power.aside == "12 simulated"
    assert "in points of 7" in power.sentences[0][2]
    assert isinstance(force, LinesCard)
    assert study.protocol is not None
    names = list(study.protocol.conditions_in("liquids"))
    liquids = [study.protocol.conditions[name].liquid_ids[0] for name in names]
    forces = [steady(study.protocol.scene_of(name), HAND_MPS).force_n for name in liquids]
    assert [line.number for line in force.lines] == [f"{force_n:.2f} N" for force_n in forces]
    uneven = view(study, ("blocks", "liquids"), people=13).cards[1]
    assert isinstance(uneven, BalanceCard)
    assert (uneven.people, uneven.verdict[2]) == (
        "13 simulated",
        "balanced with 12 or 18 participants, for a Williams design",
    )
    few = view(study, ("blocks", "liquids"), people=5, planned=5).cards[1]
    assert isinstance(few, BalanceCard)
    assert (few.people, few.verdict[2]) == ("5 planned", "balanced with 6 participants, for a Williams design")


def test_a_questionnaire_shows_each_time_it_is_asked_and_its_languages() -> None:
    asked, texts, *_ = view(study_of("rek2024"), ("questionnaires", "liquid"), SlowResults(parts=2)).cards
    assert isinstance(asked, SessionCard)
    assert asked.figures == (("59", "s"), ("9", "answers"))
    assert [words for _, _, words in asked.verdicts] == [
        "2 pages at 1366 × 768",
        "27 answers per session, asked 3 times",
    ]
    assert isinstance(texts, TextsCard)
    assert [line.number for line in texts.languages] == ["60 of 60", "60 of 60"]


def test_a_force_that_a_limit_clips_is_said_and_sums_of_a_broken_study_are_not_known() -> None:
    study = study_of("rek2024")
    weak, _ = study.edited(Set(("device", "force_limit_n"), 0.5))
    (force,) = [card for card in view(weak, ("study",)).cards if isinstance(card, LinesCard) and card.lines]
    assert {line.verdict[2] for line in force.lines} == {"clipped by the force limit"}
    assert {line.share for line in force.lines} == {1.0}
    broken, _ = study.edited(Set(("blocks", "liquids", "repetitions"), -1))
    session = view(broken, ("study",)).cards[0]
    assert isinstance(session, SessionCard)
    assert {number for number, _ in session.figures} == {UNKNOWN}
    assert any(isinstance(card, LinesCard) and len(card.lines) == 4 for card in view(broken, ("study",)).cards)


ADAPTIVE, JNDS = ("methods", "adaptive"), "Block Viscosity"
MEASURED, NOTHING = {"viscosity": (0.05, 0.5)}, {"viscosity": None}


@pytest.mark.parametrize(
    ("name", "path", "ranges", "title", "rows"),
    [
        ("rek2024", ("liquids", "honey"), {}, "Blocks that use Honey", ["liquids"]),
        ("rek2024", ("questionnaires", "liquid"), {}, "Blocks that use Liquid", ["liquids"]),
        ("viscosityjnd", ("study",), {}, "Blocks of the study", ["training", "viscosity"]),
        ("viscosityjnd", ("study",), MEASURED, "Blocks of the study", ["training", f"{JNDS}: JND 5 – 50 %, 46 min"]),
        ("viscosityjnd", ("study",), NOTHING, "Blocks of the study", ["training", f"{JNDS}: no JND, 46 min"]),
        ("viscosityjnd", ADAPTIVE, {}, "Blocks that use Adaptive", [f"{JNDS}: JNDs, 46 min, shown here"]),
        ("viscosityjnd", ("pages", "welcome"), {}, "", []),
        ("viscosityjnd", ("blocks", "viscosity"), {}, "", []),
    ],
)
def test_an_element_that_is_no_block_leads_to_the_measures_of_its_blocks(
    name: str, path: Path, ranges: dict[str, tuple[float, float] | None], title: str, rows: list[str]
) -> None:
    card = view(study_of(name), path, SlowResults(ranges=ranges)).blocks
    assert (card is not None) == bool(rows)
    if card is not None:
        assert card.title == title
        for row, (words, block) in zip(rows, card.blocks, strict=True):
            assert row in (words, block[1])


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
        jnds, _, people, _ = view(study, ("blocks", "viscosity"), SlowResults(simulated=measured)).numbers
        assert jnds.more == said
        own = view(study, ("blocks", "training")).forces
        assert own is not None
        assert own.warning == ""  # it presents no clipped level
        assert people.more == f"80 % are enough; with 107 trials: 100 %{group}"


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
        slow = SlowResults(simulated=Simulated(measurable=Measurable(None, ())))
        jnds = view(study, ("blocks", "viscosity"), slow).numbers[0]
        assert (jnds.number, jnds.note) == ("none", ("bad", "warning", why))
        assert jnds.more.startswith(f"{more} clipped" if "clipped" in why else more)
    if threshold is None:
        return
    observed = Observed(threshold, 0.02, 400, 0.75, (0.1,), (0.7,), ((0.7,),), (), ((1, (0.1,) * 5),), (), 0.03, 80)
    group = GroupPrecision(12, 60, 0.15, 80, 1.0, 107, 1.0, 60, 12)
    slow = SlowResults(simulated=Simulated(observed, group=group, threshold=threshold))
    _, one, people, _ = view(study, ("blocks", "viscosity"), slow).numbers
    if threshold == 0.019 or not why:  # its levels are presented in full
        assert (one.number, people.note[2]) == ("± 3", "Enough")
        return
    for card in (one, people):
        assert (card.number, card.note) == (UNKNOWN, ("bad", "warning", CLIPPED))
        assert card.more == f"{more} clipped: observers are simulated with what the limits leave"


def test_ticks_are_round_and_few() -> None:
    assert log_ticks(2, 60) == (2, 5, 10, 20, 50)
    assert log_ticks(5, 250) == (5, 10, 20, 50, 100, 200)
    assert even_ticks(0, 8.16, 5) == (0, 2, 4, 6, 8)
    assert even_ticks(50, 100, 7) == (50, 60, 70, 80, 90, 100)
    assert [rounded(value) for value in (0.0201, 53.0, 1234.5, 0, 8.0)] == ["0.0201", "53", "1234", "0", "8"]


def test_nothing_is_said_of_the_texts_of_a_file_that_was_never_readable() -> None:
    (session,) = view(Study("[study"), ("study",)).cards
    assert isinstance(session, SessionCard)
    assert session.verdicts == ()


def test_a_warning_about_precision_says_what_it_is_about_and_a_failure_why_there_is_none() -> None:
    facts: Any = SimpleNamespace(warnings=())
    card = warnings_card(facts, ("methods.adaptive.trials: 80 trials give ±18 %",))
    assert card is not None
    assert card.sentences[-1] == ("neutral", "info", f"{ON_AVERAGE}.")
    card = warnings_card(facts, (), "The process ended.")
    assert card is not None
    assert [words for *_, words in card.sentences] == ["The expected precision is not known.", "The process ended."]
