"""The first step of a session that shows an element, by the preview's own orders."""

import pytest

from study_app.app.designer.play.first_step import first_step
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import PageStep, Trial
from study_app.session.simulated.preview import preview


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
