"""The form of an element: every key of it once, faults at their rows, and where everything is in the file."""

from pathlib import Path
from typing import Any

import pytest

from study_app.designer.document.elements import outline
from study_app.designer.document.study import Study, read
from study_app.designer.form.form import form
from study_app.designer.new_study.templates import FOLDER, templates
from study_app.protocol.source.document import value_at
from study_app.protocol.source.files import shipped, shipped_file

FILES = [*(shipped_file(name) for name in shipped()), *(FOLDER / f"{name}.toml" for name in templates())]


@pytest.fixture(scope="module")
def study() -> Study:
    return read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


def leaves(value: Any, path: tuple[Any, ...] = ()) -> set[tuple[Any, ...]]:
    """The keys of an element, those of tables within it too; entries of lists are forms of their own."""
    if isinstance(value, dict) and (value or not path):
        return {found for key, inner in value.items() for found in leaves(inner, (*path, key))}
    return {path}


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_key_of_every_element_is_in_its_form_with_its_value(file: Path) -> None:
    study = read(file.read_bytes(), file.parent)
    shown = outline(study)
    for element in {one.path for one in (*shown.session, *shown.parts, *shown.study)}:
        if len(element) == 1 and element[0] not in {"study", "device", "scene", "limits", "analysis"}:
            continue
        if value_at(study.document, element) is None:
            continue
        made = form(study, element)
        rows = {row.row.path: row.row.value for row in made.rows}
        for leaf in leaves(value_at(study.document, element), element):
            if leaf[-1] == "id" and len(leaf) > 3:
                assert made.id is not None
                continue
            around = next((leaf[:length] for length in range(len(leaf), 0, -1) if leaf[:length] in rows), None)
            assert around is not None, leaf
            assert rows[around] == value_at(study.document, around)
