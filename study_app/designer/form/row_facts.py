"""What a special editor shows beyond the value of its row."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row


@dataclass(frozen=True, slots=True)
class RowFacts:
    """Facts of certain keys.

    Attributes
    ----------
    keys : tuple of (str, str)
        Title of the model in the JSON Schema, such as "Block", and the key.
    of : callable
        Returns the facts of a row of a study, sound or not: a frozen value.
    """

    keys: tuple[tuple[str, str], ...]
    of: Callable[[Study, Row], Any]
