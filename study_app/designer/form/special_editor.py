"""What a special editor is: an editor of one key of a model, in place of the one that every key of its kind has."""

from collections.abc import Callable
from dataclasses import dataclass

from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.row_fields import Field


def _same(_row: FormRow) -> object:
    return None


@dataclass(frozen=True, slots=True)
class SpecialEditor:
    """An editor of certain keys; bounds, faults, help and removal stay those of the row.

    Attributes
    ----------
    keys : tuple of (str, str)
        Title of the model in the JSON Schema, such as "Block", and the key.
    make : callable
        Makes the editor of a row.
    wide : bool
        Whether it takes the width of the form, with the label above it.
    labelled : bool
        Whether the label is shown; a screen reader says it in any case.
    structure : callable
        Returns what makes another editor necessary, beyond what does for every row.
    """

    keys: tuple[tuple[str, str], ...]
    make: Callable[[FormRow], Field]
    wide: bool = False
    labelled: bool = True
    structure: Callable[[FormRow], object] = _same
