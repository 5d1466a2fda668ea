"""The points of a scale: their words in each language, lowest first."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row
from study_app.designer.form.row_facts import RowFacts
from study_app.protocol.source.document import entries
from study_app.protocol.wording.languages import language_name


@dataclass(frozen=True, slots=True)
class ScalePoints:
    """Code and name of each language, and the words of each point in each of them, "" where it is missing."""

    languages: tuple[tuple[str, str], ...]
    points: tuple[tuple[str, ...], ...]


def scale_points(study: Study, row: Row) -> ScalePoints:
    """Return the points of a scale, for the languages of the study and others that it has."""
    labels = row.value if isinstance(row.value, Mapping) else {}
    codes = [str(code) for _, code in entries(study.document, "study.languages.*")] or ["en"]
    codes = list(dict.fromkeys([*codes, *labels]))
    columns = [labels[code] if isinstance(labels.get(code), tuple) else () for code in codes]
    count = max(map(len, columns), default=0)
    points = tuple(tuple(str(column[at]) if at < len(column) else "" for column in columns) for at in range(count))
    return ScalePoints(tuple((code, language_name(code)) for code in codes), points)


FACTS: Final = RowFacts((("Scale", "labels"),), scale_points)
