"""What a step changes in the form of an element."""

from typing import Final

from study_app.protocol.source.document import Path
from study_app.viewmodels.designer.form.form_rows import Form

BELOW: Final = 2
"""Where the keys of an element begin in a path, after its section and its id."""


def shape_of(form: Form) -> object:
    """Return what makes other editors necessary, beside the rows: other questions, sections, keys to add."""
    others = [line for line in form.questions.lines if line.path != form.path]
    return (
        others,
        form.questions.languages,
        [
            (one.path[BELOW:], one.title, tuple(row.path[BELOW:] for row in one.absent), one.faults)
            for one in form.sections
        ],
    )


def added_row(form: Form, before: Form) -> Path | None:
    """Return the path of the first row that the form did not have before; None where it had each."""
    known = {row.row.path for row in before.rows}
    return next((row.row.path for row in form.rows if row.row.path not in known), None)
