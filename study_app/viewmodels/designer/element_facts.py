"""The number by which one tells elements apart, next to their names in the outline and in lists to choose from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from study_app.protocol.source.document import Path, value_at


def brief(document: Mapping[str, Any], path: Path) -> str:
    """Return how long a task takes, or how many questions a questionnaire has; "" of other elements.

    Parameters
    ----------
    document : mapping
        The study, sound or not.
    path : tuple of str or int
        The element.
    """
    value = value_at(document, path)
    if not isinstance(value, Mapping) or len(path) != 2:
        return ""
    if path[0] == "questionnaires" and isinstance(items := value.get("items"), tuple | list):
        return f"{len(items)} question{'s' * (len(items) != 1)}"
    if path[0] != "tasks":
        return ""
    numbers = {key: f"{one:g}" for key, one in value.items() if isinstance(one, int | float)}
    for keys, words in (
        (("min_s", "max_s"), "{min_s} to {max_s} s"),
        (("duration_s",), "{duration_s} s"),
        (("count",), "{count} targets"),
    ):
        if all(key in numbers for key in keys):
            return words.format(**numbers)
    return ""
