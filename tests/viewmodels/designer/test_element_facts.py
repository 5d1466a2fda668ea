"""The number that stands next to an element's name."""

from __future__ import annotations

from typing import Any

import pytest

from study_app.authoring.edited_study import read
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.element_facts import brief
from study_app.viewmodels.designer.form.form_rows import form
from study_app.viewmodels.designer.outline_rows import outline_rows

REACH = {"kind": "reach", "count": 12}


@pytest.mark.parametrize(
    ("section", "table", "words"),
    [
        ("tasks", {"min_s": 30, "max_s": 120.5}, "30 to 120.5 s"),
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


def test_outline_and_lists_to_choose_from_say_it() -> None:
    study = read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)
    task = next(row for row in outline_rows(study, {}) if row.path == ("tasks", "explore") and row.depth == 2)
    assert (task.note, task.name) == ("30 to 120 s", "Explore, task, 30 to 120 s")
    row = next(row for row in form(study, ("blocks", "liquids")).rows if row.row.path[-1] == "task")
    assert dict(row.notes)["reach"] == "12 targets"
