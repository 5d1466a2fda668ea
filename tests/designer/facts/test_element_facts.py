"""The number that stands next to an element's name, and values of wrong types, which stop no view."""

import pathlib
from typing import Any

import pytest

from study_app.designer.document.additions import repairs
from study_app.designer.document.elements import used_by
from study_app.designer.document.names import blocks_using
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.form.form import form
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import Controls, Simulated
from study_app.designer.measures.study_facts import facts, restored_part
from study_app.designer.new_study.new_study import template
from study_app.designer.new_study.templates import FOLDER
from study_app.designer.outline.outline_rows import outline_rows
from study_app.designer.participant.playable import NotPlayableError, playable, showing
from study_app.designer.problems.problems import problem_rows
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import shipped_file
from tests.designer.document.grown import PROTOCOLS


def study_of(file: pathlib.Path) -> Study:
    return read(file.read_bytes(), file.parent)


def test_questions_that_use_a_scale_are_counted_one_by_one() -> None:
    study = study_of(shipped_file("rek2024"))
    items = ("questionnaires", "liquid", "items")
    study, _ = study.edited(*(Set((*items, at, "scale"), "agreement") for at in (0, 1)))
    assert used_by(study.document, ("scales", "agreement")) == "used by 2 questions, 2 questionnaires"


@pytest.mark.parametrize(
    ("name", "path", "words", "blocks"),
    [
        ("delaydetect", ("conditions", "water"), "used by 1 stimulus", ("training", "delay")),
        ("delayjnd", ("tasks", "reach"), "used by 1 block", ("delay",)),
        ("delayjnd", ("liquids", "water"), "used by 1 stimulus", ("delay",)),
    ],
)
def test_what_is_the_only_one_is_used_where_its_name_is_left_out(
    name: str, path: Path, words: str, blocks: tuple[str, ...]
) -> None:
    study = study_of(PROTOCOLS / f"{name}.toml")
    assert (used_by(study.document, path), blocks_using(study.document, path)) == (words, blocks)


def test_liquids_are_used_as_conditions_where_a_study_has_none() -> None:
    document = {"liquids": {"water": {}, "oil": {}}, "blocks": {"one": {"conditions": ("water",)}}}
    assert [used_by(document, ("liquids", name)) for name in ("water", "oil")] == ["used by 1 block", "not used"]
    assert blocks_using(document, ("liquids", "water")) == ("one",)


@pytest.mark.parametrize("file", [*PROTOCOLS.glob("*.toml"), *FOLDER.glob("*.toml")], ids=lambda file: file.stem)
def test_what_is_not_used_can_be_deleted(file: pathlib.Path) -> None:
    study = study_of(file)
    elements = (path for path, _ in entries(study.document, "*.*"))
    for path in [one for one in elements if used_by(study.document, one) == "not used"]:
        assert study.edited(Unset(path))[0].faults == study.faults, path


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
    protocol = restored_part(study, sound.document).protocol
    for selected in {("study",), path[:2], path[:4]}:
        if not isinstance(value_at(study.document, selected), dict):
            continue
        form(study, selected)
        measures_view(study, known, selected, Controls(), Simulated(), dict.fromkeys(problems, ()))
        if protocol is not None:
            showing(protocol, selected)
        with pytest.raises(NotPlayableError):
            playable(study, selected)
