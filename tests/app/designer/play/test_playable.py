"""What is played of a faulty draft: faults before the step and texts of other languages do not prevent it."""

import pytest

from study_app.app.designer.participant.shown_step import StepPosition
from study_app.app.designer.play.playable import NotPlayableError, playable
from study_app.authoring.edited_study import Study
from study_app.authoring.writer.edits import Edit, Set, Unset
from study_app.protocol.load import load, parse, source_bytes
from study_app.protocol.orders.schedule import Trial
from study_app.session.simulated.preview import preview

pytestmark = pytest.mark.slow


def edited(name: str, *edits: Edit) -> Study:
    return Study(source_bytes(name).decode()).edited(*edits)[0]


def test_a_sound_draft_is_played_as_it_is() -> None:
    study = Study(source_bytes("rek2024").decode())
    found = playable(study, ("study",), StepPosition("liquids", trial=3, language="nl", seed=7))
    step = preview(load("rek2024"), 7).schedule.steps[found.step]
    assert isinstance(step, Trial)
    assert (step.block, step.index) == ("liquids", 3)
    assert found.source == source_bytes("rek2024")
    assert found.words.endswith("trial 3 of 3")


def test_a_missing_text_of_another_language_prevents_nothing() -> None:
    study = edited("rek2024", Unset(("pages", "debrief", "title", "nl")))
    assert study.protocol is None
    found = playable(study, ("blocks", "liquids"), StepPosition("liquids", language="en"))
    title = found.protocol.pages["debrief"].title
    assert isinstance(title, dict)
    assert title["nl"] == title["en"]
    with pytest.raises(NotPlayableError) as refused:
        playable(study, ("blocks", "liquids"), StepPosition("liquids", language="nl"))
    (problem,) = refused.value.problems
    assert problem.place == "pages.debrief.title"
    assert problem.line is not None


def test_a_fault_prevents_only_playing_its_step_and_earlier_ones() -> None:
    document = Study(source_bytes("rek2024").decode()).document
    (*_, last) = [name for name in document["sequence"] if name in document["blocks"]]
    study = edited("rek2024", Set(("pages", document["sequence"][0], "body"), 3))
    with pytest.raises(NotPlayableError, match=r"pages\..*\.body"):
        playable(study, ("pages", document["sequence"][0]))
    found = playable(study, ("blocks", last))
    assert found.step == 0
    assert found.protocol == parse(found.source, "played")
    step = preview(found.protocol).schedule.steps[0]
    assert isinstance(step, Trial)
    assert step.block == last
