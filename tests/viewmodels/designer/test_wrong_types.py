"""A value of a wrong type, as it is typed into the file, is a fault in the designer and stops none of its views."""

from typing import Any

import pytest

from study_app.app.designer.participant.shown_step import showing
from study_app.app.designer.participant.sound_part import sound_part
from study_app.app.designer.play.playable import NotPlayableError, playable
from study_app.authoring.new_study import template
from study_app.authoring.repairs import repairs
from study_app.authoring.study_facts import facts
from study_app.authoring.versions.changes import changes
from study_app.authoring.writer.edits import Edit, Set, Unset
from study_app.protocol.source.document import Path, value_at
from study_app.viewmodels.designer.form.form_rows import form
from study_app.viewmodels.designer.measures.measures_view import Controls, SlowResults, measures_view
from study_app.viewmodels.designer.outline_rows import outline_rows
from study_app.viewmodels.designer.problem_rows import problem_rows

ITEM = ("questionnaires", "remarks", "items", 0)
WRONG: tuple[tuple[str, Path, tuple[Any, ...]], ...] = (
    ("viscosity-jnd", ("study",), ("x",)),
    ("viscosity-jnd", ("study", "languages"), (5, "x", [{}])),
    ("viscosity-jnd", ("blocks",), (None, 5)),
    ("viscosity-jnd", ("sequence",), ("x", [])),
    ("questionnaire-only", (*ITEM, "id"), (5, [], {})),
    ("questionnaire-only", (*ITEM, "kind"), ([], {})),
    ("questionnaire-only", ITEM[:3], ("x", [])),
    ("rate-realism", ("blocks", "liquids", "order"), (5, {})),
    ("delay-detection", ("designs", "pair", "kind"), (5, {})),
)


@pytest.mark.parametrize(
    ("name", "path", "value"), [(name, path, value) for name, path, values in WRONG for value in values]
)
def test_a_value_of_a_wrong_type_is_a_fault_that_every_view_shows(name: str, path: Path, value: Any) -> None:
    sound = template(name)
    edit: Edit = Unset(path) if value is None else Set(path, value)
    study, _ = sound.edited(edit)
    assert study.faults
    known = facts(study)
    outline_rows(study, known.steps_s, "")
    problems = problem_rows(study)
    assert len(problems) == len(study.faults)
    for fault in study.faults:
        repairs(study, fault)
    assert changes(sound.text, study)
    assert changes(study.text, sound)
    protocol = sound_part(study, sound.document)
    for selected in {("study",), path[:2], path[:4]}:
        if not isinstance(value_at(study.document, selected), dict):
            continue
        form(study, selected)
        measures_view(study, known, selected, Controls(), SlowResults(), dict.fromkeys(problems, ()))
        if protocol is not None:
            showing(protocol, selected)
        with pytest.raises(NotPlayableError):
            playable(study, selected)
