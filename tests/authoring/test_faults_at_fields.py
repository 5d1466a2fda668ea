"""Every fault that check knows is shown at a field of the form of its element."""

import pytest

from study_app.authoring.edited_study import Study, read
from study_app.protocol.source.problems import Fault
from study_app.viewmodels.designer.form.form_rows import Form, form
from study_app.viewmodels.designer.problem_rows import element_of
from tests.protocol.faulty_protocols import CASES, Case

OF_THE_ELEMENT = {
    "name of a table", "wake called for but missing", "block left out", "page left out", "page named like a block",
    "list for tables", "missing format",
}  # fmt: skip
"""Faults of an element as a whole, which stand above its rows."""


def shown_at(study: Study, fault: Fault) -> str:
    """Return where the form shows a fault: "row", "section", "id", "element", or "" for nowhere."""
    found: Form = form(study, element_of(study, fault.path))
    sentence = f"{fault.message[:1].upper()}{fault.message[1:]}"
    places = (
        (
            "row",
            [words for row in found.rows if fault.path[: len(row.row.path)] == row.row.path for words in row.faults],
        ),
        ("section", [words for section in found.sections for words in section.faults]),
        ("id", list(found.id_faults)),
        ("element", list(found.faults)),
    )
    return next((place for place, said in places if any(words.startswith(sentence) for words in said)), "")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_fault_is_shown_at_a_field(case: Case) -> None:
    study = read(case.text.encode())
    if study.is_toml:
        places = [shown_at(study, fault) for fault in study.faults]
        assert "" not in places
        assert "element" not in places or case.name in OF_THE_ELEMENT
