"""The step that shows and plays an element: in studies with groups, earlier faults, and missing texts."""

import pytest

from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Edit, Unset
from study_app.designer.measures.study_facts import restored_part
from study_app.designer.participant.playable import (
    STANDALONE,
    NotPlayableError,
    StepPosition,
    find_first_step,
    find_step,
    first_step,
    part_to_play,
    step_id,
)
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import PageStep, Trial
from study_app.protocol.source.files import source_bytes
from study_app.session.transitions.page_builder import preview
from tests.protocol.groups.grouped import grouped


def test_an_element_of_another_group_is_shown_in_a_session_of_that_group() -> None:
    study = grouped()
    steps = {
        name: find_first_step(study, ("questionnaires" if name == "end" else "blocks", name))
        for name in ("thin", "end")
    }
    assert all(step is not None for step in steps.values())
    thin, end = steps["thin"], steps["end"]
    assert thin is not None
    assert thin.session == ""
    assert end is not None
    assert step_id(end.shown.schedule.steps[end.index]) == "end"
    groups = {end.session, thin.session}
    assert groups <= {"", "group first_thin"}
    again = find_step(study, "end", 1, end.session)
    assert again is not None
    assert again.index == end.index


def test_a_step_that_is_gone_is_not_found_and_a_shorter_block_keeps_its_last_trial() -> None:
    study = grouped()
    assert find_step(study, "gone", 1, "") is None
    last = find_step(study, "thick", 99, "")
    assert last is not None
    assert last.shown.schedule.steps[last.index].index == 4  # type: ignore[union-attr]


@pytest.mark.parametrize("path", [("study",), ("device", "force_limit_n"), ("sequence", 0), ("sequences", "thin")])
def test_an_element_that_no_step_is_about_is_shown_nowhere(path: tuple[str | int, ...]) -> None:
    assert find_first_step(grouped(), path) is None


def test_a_page_that_is_in_no_session_is_shown_on_its_own() -> None:
    study = grouped()
    page = study.pages["hello"].model_copy()
    step = find_first_step(study.model_copy(update={"pages": {**study.pages, "unused": page}}), ("pages", "unused"))
    assert step is not None
    assert step.session == STANDALONE
    assert step_id(step.shown.schedule.steps[step.index]) == "unused"


@pytest.mark.parametrize("name", ["rek2024", "thickness", "delayjnd"])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_table_leads_to_the_first_step_that_shows_it(name: str, seed: int) -> None:
    study = load(name)
    session = preview(study, seed)
    steps = session.schedule.steps
    for page in study.pages:
        step = steps[first_step(session, ("pages", page, "body", "en")) or 0]
        assert step == PageStep(page) or PageStep(page) not in steps
    for block in study.blocks:
        step = steps[first_step(session, ("blocks", block)) or 0]
        assert isinstance(step, Trial)
        assert (step.block, step.index) == (block, 1)
    for questionnaire in study.questionnaires:
        step = steps[first_step(session, ("questionnaires", questionnaire, "items", 0)) or 0]
        assert getattr(step, "form", None) == questionnaire or study.blocks[step.block].questionnaire == questionnaire
    presented = {session.codes[trial.block][trial.code]: at for at, trial in reversed([*enumerate(steps)])
                 if isinstance(trial, Trial)}  # fmt: skip
    for condition in study.conditions:
        if condition in presented:
            assert first_step(session, ("conditions", condition)) == presented[condition]
    assert first_step(session, ("study",)) is None


def edited(name: str, *edits: Edit) -> Study:
    return Study(source_bytes(name).decode()).with_edits(*edits)[0]


def test_an_element_that_is_gone_while_it_is_named_is_shown_as_it_was() -> None:
    before = Study(source_bytes("demo").decode())
    study = edited("demo", Unset(("liquids", "thin")))
    protocol = restored_part(study, before.document).protocol
    assert study.protocol is None
    assert protocol is not None
    assert before.protocol is not None
    assert protocol.liquids["thin"] == before.protocol.liquids["thin"]


@pytest.mark.slow
def test_a_sound_draft_is_played_as_it_is() -> None:
    study = Study(source_bytes("rek2024").decode())
    part = part_to_play(study, ("study",), StepPosition("liquids", trial=3, language="nl", seed=7))
    step = preview(load("rek2024"), 7).schedule.steps[part.step]
    assert isinstance(step, Trial)
    assert (step.block, step.index) == ("liquids", 3)
    assert part.source == source_bytes("rek2024")
    assert part.words.endswith("trial 3 of 3")


@pytest.mark.slow
def test_a_missing_text_of_another_language_prevents_nothing() -> None:
    study = edited("rek2024", Unset(("pages", "debrief", "title", "nl")))
    assert study.protocol is None
    part = part_to_play(study, ("blocks", "liquids"), StepPosition("liquids", language="en"))
    title = part.protocol.pages["debrief"].title
    assert isinstance(title, dict)
    assert title["nl"] == title["en"]
    with pytest.raises(NotPlayableError) as refused:
        part_to_play(study, ("blocks", "liquids"), StepPosition("liquids", language="nl"))
    (problem,) = refused.value.problems
    assert problem.place == "pages.debrief.title"
    assert problem.line is not None
