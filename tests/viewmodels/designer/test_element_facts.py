"""The number that stands next to an element's name, and values of wrong types, which stop no view."""

import pathlib
from typing import Any

import pytest

from study_app.app.designer.participant.shown_step import showing
from study_app.app.designer.participant.sound_part import sound_part
from study_app.app.designer.play.playable import NotPlayableError, playable
from study_app.authoring.edited_study import Study, read
from study_app.authoring.names import blocks_using
from study_app.authoring.new_study import template
from study_app.authoring.repairs import repairs
from study_app.authoring.study_facts import facts
from study_app.authoring.templates import FOLDER
from study_app.authoring.versions.changes import changes
from study_app.authoring.writer.edits import Edit, Insert, Set, Unset
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.element_facts import brief, used_by
from study_app.viewmodels.designer.form.form_rows import form
from study_app.viewmodels.designer.measures.measures_view import Controls, SlowResults, measures_view
from study_app.viewmodels.designer.outline_rows import outline_rows
from study_app.viewmodels.designer.problem_rows import problem_rows
from tests.authoring.grown import PROTOCOLS

REACH = {"kind": "reach", "count": 12}


def study_of(file: pathlib.Path) -> Study:
    return read(file.read_bytes(), file.parent)


@pytest.mark.parametrize(
    ("section", "table", "words"),
    [
        ("tasks", {"min_s": 30, "max_s": 120.5}, "30 to 120.5 s"),
        ("tasks", {"min_s": 20, "max_s": 90}, "20 to 90 s"),
        ("tasks", {"min_s": 60, "max_s": 120}, "1 to 2 min"),
        ("tasks", {"min_s": 30, "max_s": 120}, "30 s to 2 min"),
        ("tasks", {"min_s": 60, "max_s": 90}, "60 to 90 s"),
        ("tasks", {"duration_s": 2.5}, "2.5 s"),
        ("tasks", {"duration_s": 0.4}, "0.4 s"),
        ("tasks", {"duration_s": 90}, "90 s"),
        ("tasks", {"duration_s": 30, "timeout_s": 60}, "30 s"),
        ("tasks", REACH, "12 targets"),
        ("tasks", {"min_s": "soon", "max_s": 60}, ""),
        ("questionnaires", {"items": ({}, {})}, "2 questions"),
        ("questionnaires", {"items": ({},)}, "1 question"),
        ("questionnaires", {}, ""),
        ("liquids", {"duration_s": 30}, ""),
        ("tasks", "no table", ""),
    ],
)
def test_an_element_has_one_fact(section: str, table: Any, words: str) -> None:
    assert brief({section: {"one": table}}, (section, "one")) == words


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (("liquids", "water"), "used by 8 conditions"),
        (("liquids", "honey"), "used by 1 condition"),
        (("tasks", "reach"), "used by 1 block"),
        (("scales", "agreement"), "used by 2 questionnaires"),
        (("questionnaires", "liquid"), "used by 1 block, 1 step"),
        (("tasks", "spare"), "not used"),
        (("blocks", "liquids"), ""),
        (("questionnaires", "liquid", "items", 0), ""),
    ],
)
def test_an_element_says_how_many_others_use_it(path: Path, words: str) -> None:
    study = study_of(shipped_file("rek2024"))
    more = Set(("tasks", "spare"), {"kind": "explore", "min_s": 1, "max_s": 2}), Insert(("sequence", 1), "liquid")
    study, _ = study.edited(*more)
    assert used_by(study.document, path) == form(study, path).used == words


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


def test_outline_and_lists_to_choose_from_say_it() -> None:
    study = study_of(shipped_file("rek2024"))
    task = next(row for row in outline_rows(study, {}) if row.path == ("tasks", "explore") and row.depth == 2)
    assert (task.note, task.name) == ("30 s to 2 min", "Explore, task, 30 s to 2 min")
    row = next(row for row in form(study, ("blocks", "liquids")).rows if row.row.path[-1] == "task")
    assert dict(row.notes)["reach"] == "12 targets"


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
