"""Which step shows an element, in studies whose sessions differ, for what is in no session, and which is the first."""

import pytest

from study_app.app.designer.participant.shown_step import STANDALONE, same_step, showing, step_name
from study_app.app.designer.play.first_step import first_step
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import PageStep, Trial
from study_app.session.simulated.preview import preview
from tests.protocol.groups.grouped import grouped


def test_an_element_of_another_group_is_shown_in_a_session_of_that_group() -> None:
    study = grouped()
    found = {name: showing(study, ("questionnaires" if name == "end" else "blocks", name)) for name in ("thin", "end")}
    assert all(one is not None for one in found.values())
    thin, end = found["thin"], found["end"]
    assert thin is not None
    assert thin.session == ""
    assert end is not None
    assert step_name(end.shown.schedule.steps[end.index]) == "end"
    groups = {end.session, thin.session}
    assert groups <= {"", "group first_thin"}
    again = same_step(study, "end", 1, end.session)
    assert again is not None
    assert again.index == end.index


def test_a_step_that_is_gone_is_not_found_and_a_shorter_block_keeps_its_last_trial() -> None:
    study = grouped()
    assert same_step(study, "gone", 1, "") is None
    last = same_step(study, "thick", 99, "")
    assert last is not None
    assert last.shown.schedule.steps[last.index].index == 4  # type: ignore[union-attr]


def test_a_page_that_is_in_no_session_is_shown_on_its_own() -> None:
    study = grouped()
    page = study.pages["hello"].model_copy()
    found = showing(study.model_copy(update={"pages": {**study.pages, "unused": page}}), ("pages", "unused"))
    assert found is not None
    assert found.session == STANDALONE
    assert step_name(found.shown.schedule.steps[found.index]) == "unused"


@pytest.mark.parametrize("name", ["rek2024", "thickness", "delayjnd"])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_table_leads_to_the_first_step_that_shows_it(name: str, seed: int) -> None:
    study = load(name)
    shown = preview(study, seed)
    steps = shown.schedule.steps
    for page in study.pages:
        step = steps[first_step(shown, ("pages", page, "body", "en"))]
        assert step == PageStep(page) or PageStep(page) not in steps
    for block in study.blocks:
        step = steps[first_step(shown, ("blocks", block))]
        assert isinstance(step, Trial)
        assert (step.block, step.index) == (block, 1)
    for questionnaire in study.questionnaires:
        step = steps[first_step(shown, ("questionnaires", questionnaire, "items", 0))]
        assert getattr(step, "form", None) == questionnaire or study.blocks[step.block].questionnaire == questionnaire
    presented = {shown.codes[trial.block][trial.code]: at for at, trial in reversed([*enumerate(steps)])
                 if isinstance(trial, Trial)}  # fmt: skip
    for condition in study.conditions:
        if condition in presented:
            assert first_step(shown, ("conditions", condition)) == presented[condition]
    assert first_step(shown, ("study",)) == 0
