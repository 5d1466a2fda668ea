"""What the study designer asks before some steps."""

from dataclasses import dataclass

from study_app.designer.document.edited_study import Study
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import Row, label_of
from study_app.designer.document.series import check_values, number_row, number_rows, titles_with
from study_app.designer.document.writer.refused import Refused
from study_app.designer.place.requests import MakeSeries
from study_app.number_text import exact_text
from study_app.protocol.source.document import Path


@dataclass(frozen=True, slots=True)
class DeletePrompt:
    """What refers to an element that is to be deleted.

    Attributes
    ----------
    path : tuple of str or int
        The element.
    title : str
        What it is called.
    references : tuple of str
        The places that name it, in words.
    others : tuple of (str, str)
        Id and title of what could be named in its place.
    also : tuple of path
        Others that are deleted with it.
    together : tuple of str
        Elements that cannot be without it, with kind and title.
    """

    path: Path
    title: str
    references: tuple[str, ...]
    others: tuple[tuple[str, str], ...] = ()
    also: tuple[Path, ...] = ()
    together: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SeriesPrompt:
    """What a series is asked for with: the element, its title, and its numbers with their words and units."""

    path: Path
    title: str
    fields: tuple[tuple[Path, str], ...]


def series_prompt(study: Study, path: Path) -> SeriesPrompt | None:
    """Return what a series is asked for with; None where an element has no number."""
    fields = tuple((row.path, _in_words(row)) for row in number_rows(study.document, path))
    return SeriesPrompt(path, title_of(study.document, path), fields) if fields else None


def series_titles(study: Study, asked: MakeSeries) -> tuple[tuple[str, ...], str]:
    """Return the title of each copy of a series; where there can be no copies with these values, why."""
    row = number_row(study.document, asked.path, asked.field)
    try:
        check_values(study.document, row, asked.values)
    except Refused as refusal:
        return (), f"{str(refusal)[:1].upper()}{str(refusal)[1:]}."
    own = title_of(study.document, asked.path)
    shown = []
    for value in asked.values:
        titles = dict(titles_with(study.document, asked.path, row, value))
        shown.append(next(iter(titles.values()), f"{own}, {exact_text(value)} {row.unit}".rstrip()))
    return tuple(shown), ""


def _in_words(row: Row) -> str:
    words = ", ".join(label_of(step) for step in row.path[2:])
    return f"{words} [{row.unit}]" if row.unit else words
